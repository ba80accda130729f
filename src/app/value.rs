//! Values as text on the screen: the words that files and the command line take, their units as they are printed.

use crate::scene::{Kind, Value, format_quantity, format_quantity_digits};

/// Units in `text` as they are printed, `µm` and `m/s²`. Files and the command line write `um` and `m/s^2`, and read both.
pub fn typeset(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut word = String::new();
    // A last separator, so that the last word is seen.
    for letter in text.chars().chain(['\0']) {
        if letter.is_alphanumeric() {
            word.push(letter);
            continue;
        }
        let number = word.trim_start_matches(|c: char| c.is_ascii_digit());
        let digits = word.len() - number.len();
        let power = out.ends_with('^') && digits == word.len();
        match (number, word.as_str()) {
            ("um" | "us", _) => {
                out.push_str(&word[..digits]);
                out.push('µ');
                out.push_str(&number[1..]);
            }
            (_, "2") if power => out.replace_range(out.len() - 1.., "²"),
            (_, "3") if power => out.replace_range(out.len() - 1.., "³"),
            _ => out.push_str(&word),
        }
        word.clear();
        if letter != '\0' {
            out.push(letter);
        }
    }
    out
}

/// An SI value in `unit` for a person.
pub fn quantity(si: f64, unit: &str, digits: usize) -> String {
    typeset(&format_quantity_digits(si, unit, digits))
}

/// `value` for a person: display unit, six digits.
pub fn shown(value: &Value, kind: &Kind) -> String {
    match (value, kind) {
        (Value::Number(si), Kind::Number { display, .. }) => quantity(*si, display, 6),
        (Value::Number(si), _) => format_quantity(*si, ""),
        (Value::Count(count), _) => count.to_string(),
        (Value::Choice(word), _) => (*word).to_owned(),
        (Value::Unset, _) => "not set".to_owned(),
    }
}

/// What a user typed, with the display unit added to a bare number.
pub fn completed(typed: &str, kind: &Kind) -> String {
    let typed = typed.trim();
    match kind {
        Kind::Number { display, .. } if !display.is_empty() && typed.parse::<f64>().is_ok() => {
            format!("{typed} {display}")
        }
        _ => typed.to_owned(),
    }
}

/// A bare number with at most `digits` significant digits.
pub fn number(value: f64, digits: usize) -> String {
    format_quantity_digits(value, "", digits)
}

/// Digits that tell values apart which lie as close as a thousandth of `span`, where they are as large as `most`.
pub fn digits_within(span: f64, most: f64) -> usize {
    let more = (most / span).log10().ceil();
    if more.is_finite() {
        4 + (more.max(0.0) as usize).min(11)
    } else {
        4
    }
}

/// A small share, as a power of ten where a decimal would hide its size: `2e-6`.
pub fn power_of_ten(share: f64) -> String {
    if share == 0.0 || (1e-3..1e4).contains(&share.abs()) {
        number(share, 2)
    } else {
        format!("{share:.0e}")
    }
}

/// A share in per cent, two digits, however small.
pub fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent == 0.0 || percent >= 0.01 {
        format!("{} %", number(percent, 2))
    } else {
        format!("{percent:.0e} %")
    }
}

/// A time with the unit that suits its size.
pub fn time(seconds: f64) -> String {
    let size = seconds.abs();
    if size == 0.0 || size >= 1.0 {
        format!("{seconds:.4} s")
    } else if size >= 1e-3 {
        format!("{:.4} ms", seconds * 1e3)
    } else {
        format!("{:.3} µs", seconds * 1e6)
    }
}

/// A time scale as people say it: `1:50`.
pub fn time_scale(scale: f64) -> String {
    if scale <= 0.0 || !scale.is_finite() {
        return "1:∞".to_owned();
    }
    let slower = 1.0 / scale;
    if slower < 9.95 {
        format!("1:{}", format_quantity((slower * 10.0).round() / 10.0, ""))
    } else {
        format!("1:{}", grouped(slower.round() as u64))
    }
}

/// A count with a thin space between thousands.
fn grouped(count: u64) -> String {
    if count < 10_000 {
        count.to_string()
    } else {
        format!("{}\u{202f}{:03}", count / 1000, count % 1000)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Dimension;

    const LENGTH: Kind = Kind::Number {
        dimension: Dimension::Length,
        min: 0.0,
        max: 2e-3,
        display: "mm",
        slider: (0.0, 1e-3),
        logarithmic: false,
    };

    #[test]
    fn a_bare_number_takes_the_unit_on_show() {
        assert_eq!(completed(" 0.5 ", &LENGTH), "0.5 mm");
        assert_eq!(completed("500 um", &LENGTH), "500 um");
        assert_eq!(completed("half", &LENGTH), "half");
    }

    #[test]
    fn units_are_printed_one_way_and_read_back() {
        for (plain, printed) in [
            ("3 um", "3 µm"),
            ("3um and 5 us.", "3µm and 5 µs."),
            ("units m, mm, um, um/s", "units m, mm, µm, µm/s"),
            (
                "-9.81 m/s^2 to 20 kg mm^2, m^3",
                "-9.81 m/s² to 20 kg mm², m³",
            ),
            (
                "maximum of status, 2^20, x^2y",
                "maximum of status, 2^20, x^2y",
            ),
            ("", ""),
        ] {
            assert_eq!(typeset(plain), printed);
        }
        let kinds = crate::scene::table().iter().map(|parameter| parameter.kind);
        let mut seen = 0;
        for kind in kinds {
            let Kind::Number {
                dimension, display, ..
            } = kind
            else {
                continue;
            };
            let printed = shown(&Value::Number(0.25), &kind);
            assert!(
                !printed.contains('^') && !printed.contains("um"),
                "{printed}"
            );
            let read = crate::scene::parse_quantity(&printed, dimension).expect("reads back");
            assert!((read - 0.25).abs() < 1e-6, "{display}: {printed}");
            seen += 1;
        }
        assert!(seen > 10);
    }

    #[test]
    fn values_read_as_people_write_them() {
        assert_eq!(shown(&Value::Number(3e-4), &LENGTH), "0.3 mm");
    }

    #[test]
    fn times_and_scales_suit_their_size() {
        assert_eq!(time(0.0), "0.0000 s");
        assert_eq!(time(7.85e-3), "7.8500 ms");
        assert_eq!(time(12.5e-6), "12.500 µs");
        assert_eq!(time_scale(1.0), "1:1");
        assert_eq!(time_scale(0.4), "1:2.5");
        assert_eq!(time_scale(0.02), "1:50");
        assert_eq!(time_scale(1e-4), "1:10\u{202f}000");
    }
}
