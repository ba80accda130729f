//! Values as text for the screen: the words of files and the command line, with typeset units.

use crate::integrate::StepControl;
use crate::machine::{LooseKind, Machine};
use crate::scene::{Kind, Scene, Value};
use crate::simulate::ContactMode;
use crate::units::{format_quantity, format_quantity_digits};

/// What the joints with play of a machine are called.
pub fn joints(machine: &Machine) -> &'static str {
    let are_balls = machine.loose_joints.iter().all(|joint| joint.kind == LooseKind::Ball);
    if are_balls { "ball joints" } else { "joints with play" }
}

/// Name of place `place` of joint `joint` of `scene`: that of the joint, if it touches at one place only.
pub fn site(scene: &Scene, joint: usize, place: u8) -> String {
    scene.machine.loose_joints.get(joint).map_or_else(String::new, |joint| joint.site_name(place))
}

/// Description of the contact state of a ball, a pin or a block, `part`.
pub fn contact(state: ContactMode, part: &str) -> String {
    let words = match state {
        ContactMode::Free => return format!("The {part} touches nothing"),
        ContactMode::Creep => "In contact, creeping",
        ContactMode::Slip => "In contact, sliding",
        ContactMode::Stick => "In contact, sticking",
        ContactMode::Ideal => "Ideal joint: no clearance",
    };
    words.to_owned()
}

/// `text` with typeset units, `µm` and `m/s²`. Files and the command line write `um` and `m/s^2`, and read both.
pub fn typeset(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut word = String::new();
    // The final separator makes the loop handle the last word.
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

/// An SI value in `unit`, as shown to the user.
pub fn quantity(si: f64, unit: &str, digits: usize) -> String {
    typeset(&format_quantity_digits(si, unit, digits))
}

/// `value` as shown to the user: display unit, six digits.
pub fn shown(value: &Value, kind: &Kind) -> String {
    match (value, kind) {
        (Value::Number(si), Kind::Number { display, .. }) => quantity(*si, display, 6),
        (Value::Number(si), _) => format_quantity(*si, ""),
        (Value::Count(count), _) => count.to_string(),
        (Value::Choice(word), _) => (*word).to_owned(),
        (Value::Unset, _) => "not set".to_owned(),
    }
}

/// Name and displayed value of `key` of `scene`; `None` if the scene has no such key.
pub(crate) fn named(scene: &Scene, key: &str) -> Option<(String, String)> {
    let (value, parameter) = (scene.get(key).ok()?, scene.parameter(key).ok()?);
    let name = match key.strip_prefix("joint.").and_then(|rest| rest.rsplit_once('.')) {
        Some((joint, _)) => format!("{} of {joint}", parameter.label),
        None => parameter.label.to_owned(),
    };
    Some((name, shown(&value, &parameter.kind)))
}

/// A scene in one line: its name, its changes except for the keys `except`, and its solver.
pub fn scene_line(scene: &Scene, except: &[String]) -> String {
    let changed = scene.changes.iter().map(|(key, _)| key);
    let changed = changed.filter(|key| !except.contains(key) && !is_solver_or_view_key(key));
    let mut parts = vec![scene.name.clone()];
    parts.extend(
        changed.filter_map(|key| named(scene, key)).map(|(name, value)| format!("{} {value}", name.to_lowercase())),
    );
    parts.push(solver(scene));
    parts.join(", ")
}

/// Keys of solver and view: the solver is named as a whole, and the view does not affect the motion.
fn is_solver_or_view_key(key: &str) -> bool {
    key.starts_with("solver.") || key.starts_with("view.")
}

/// Method with its fixed step, its tolerance, or its steps per impact.
pub fn solver(scene: &Scene) -> String {
    let solver = &scene.machine.solver;
    let method = solver.method;
    match method.control() {
        StepControl::Fixed => format!("{method} {}", quantity(solver.step, "us", 6)),
        StepControl::Error => format!("{method} {}", power_of_ten(solver.tolerance)),
        StepControl::PerImpact => format!("{method} {} steps per impact", solver.steps_per_impact),
    }
}

/// Changes of a scene, one phrase each.
pub fn changes(scene: &Scene) -> Vec<String> {
    let changed = scene.changes.iter().filter_map(|(key, _)| named(scene, key));
    changed.map(|(name, value)| format!("{name} {value}")).collect()
}

/// Differences of `new_scene` from `old_scene`, one phrase each, without the keys `except`; empty if the motion is the same.
pub fn differences(new_scene: &Scene, old_scene: &Scene, except: &[String]) -> Vec<String> {
    if new_scene.source.text != old_scene.source.text || new_scene.source.beside != old_scene.source.beside {
        let (new, old) = (&new_scene.name, &old_scene.name);
        return vec![if new == old {
            format!("Scene: another file of the name {new}")
        } else {
            format!("Scene: {new} instead of {old}")
        }];
    }
    let mut keys: Vec<&String> = Vec::new();
    for (key, _) in new_scene.changes.iter().chain(&old_scene.changes) {
        if !keys.contains(&key) && !except.contains(key) && !is_solver_or_view_key(key) {
            keys.push(key);
        }
    }
    let mut all: Vec<String> = keys
        .into_iter()
        .filter(|key| new_scene.get(key).ok() != old_scene.get(key).ok())
        .map(|key| {
            let value = |scene| named(scene, key).map_or_else(|| "none".to_owned(), |n| n.1);
            let name = named(new_scene, key).or_else(|| named(old_scene, key));
            let name = name.map_or_else(|| key.clone(), |n| n.0);
            format!("{name}: {} instead of {}", value(new_scene), value(old_scene))
        })
        .collect();
    let (new, old) = (solver(new_scene), solver(old_scene));
    if new != old {
        all.push(format!("Solver: {new} instead of {old}"));
    }
    all
}

/// Typed text with a decimal point where its number has a decimal comma, as in `0,8 mm`. A comma that may stand between thousands, as
/// in `1,500`, stays and is refused.
pub fn with_decimal_point(typed: &str) -> String {
    let digits = |text: &str| text.bytes().take_while(u8::is_ascii_digit).count();
    if let Some((whole, rest)) = typed.split_once(',') {
        let bare = whole.trim_start_matches(['-', '+']);
        let (before, after) = (digits(bare), digits(rest));
        let thousands = after == 3 && bare != "0" && before > 0;
        if before == bare.len() && after > 0 && !thousands && !rest[after..].starts_with(['.', ',']) {
            return format!("{whole}.{rest}");
        }
    }
    typed.to_owned()
}

/// Text typed by the user, with the display unit added to a bare number.
pub fn with_display_unit(typed: &str, kind: &Kind) -> String {
    let typed = &*with_decimal_point(typed.trim());
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

/// Digits that distinguish values of size up to `most` that differ by a thousandth of `span`.
pub fn digits_within(span: f64, most: f64) -> usize {
    let more = (most / span).log10().ceil();
    if more.is_finite() { 4 + (more.max(0.0) as usize).min(11) } else { 4 }
}

/// Decimals of the values of a slider over `span`: a hundred to a thousand steps.
pub fn decimals(span: f64) -> usize {
    let decimals = 2.0 - libm::log10(span);
    // A power of ten has a hundred steps, regardless of rounding in its logarithm.
    if decimals.is_finite() { (decimals - 1e-9).ceil().clamp(0.0, 15.0) as usize } else { 15 }
}

/// A small fraction, as a power of ten where a decimal would hide its size: `2e-6`.
pub fn power_of_ten(fraction: f64) -> String {
    if fraction == 0.0 || (1e-3..1e4).contains(&fraction.abs()) {
        number(fraction, 2)
    } else {
        format!("{fraction:.0e}")
    }
}

/// A fraction as a percentage with two digits, however small.
pub fn percent(fraction: f64) -> String {
    let percent = 100.0 * fraction;
    if percent == 0.0 || percent >= 0.01 { format!("{} %", number(percent, 2)) } else { format!("{percent:.0e} %") }
}

/// Most characters of [`time`] up to 10^9 s: the width reserved for a clock.
pub const MAX_TIME_CHARACTERS: usize = 11;

/// A time in a suitable unit; a long one has fewer decimals, so that the width stays bounded.
pub fn time(seconds: f64) -> String {
    let size = seconds.abs();
    for (unit, name, decimals) in [(1e-6, "µs", 3), (1e-3, "ms", 4)] {
        // A value that rounds up to the next unit is written in that unit.
        let limit = 1000.0 - 0.5 * libm::pow(10.0, -f64::from(decimals));
        if size > 0.0 && size / unit < limit {
            return format!("{:.*} {name}", decimals as usize, seconds / unit);
        }
    }
    let decimals = (0..4)
        .find(|digits| size < libm::pow(10.0, f64::from(4 + digits)) - 0.5)
        .map_or(0, |digits| 4 - digits as usize);
    format!("{seconds:.decimals$} s")
}

/// A time scale as a ratio: `1:50`.
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

/// A measured time scale as a ratio with two digits.
pub fn rounded_time_scale(scale: f64) -> String {
    let size = libm::pow(10.0, libm::floor(libm::log10(1.0 / scale)) - 1.0);
    let slower = libm::round(1.0 / scale / size) * size;
    time_scale(if slower.is_finite() { 1.0 / slower } else { 0.0 })
}

/// A count with a thin space between thousands, if it has five digits or more.
fn grouped(count: u64) -> String {
    let digits = count.to_string();
    if count < 10_000 {
        return digits;
    }
    let first = (digits.len() - 1) % 3 + 1;
    let mut text = digits[..first].to_owned();
    for from in (first..digits.len()).step_by(3) {
        text.push('\u{202f}');
        text.push_str(&digits[from..from + 3]);
    }
    text
}

/// Label of a mark on an axis with mark distance `step`, with enough digits to distinguish neighbours: in digits with thin spaces
/// between thousands, or otherwise with a power of ten.
pub fn mark(mark: f64, step: f64, in_digits: bool) -> String {
    if mark.abs() < 1e-6 * step {
        return "0".to_owned();
    }
    // A step of 2.5 needs one digit more than a step of 2.
    let power = libm::floor(libm::log10(step)) as i32;
    let mantissa = step / libm::pow(10.0, f64::from(power));
    let last = power - i32::from((mantissa - libm::round(mantissa)).abs() > 1e-6);
    if in_digits {
        let text = format!("{:.*}", (-last).max(0) as usize, mark.abs());
        let whole = text.split('.').next().unwrap_or_default();
        let sign = if mark < 0.0 { "-" } else { "" };
        let grouped = whole.parse().map_or_else(|_| whole.to_owned(), grouped);
        return format!("{sign}{grouped}{}", &text[whole.len()..]);
    }
    let digits = libm::floor(libm::log10(mark.abs())) as i32 - last;
    // The font of the window has no raised minus sign.
    format!("{mark:.*e}", digits.max(0) as usize).replace('e', "×10^")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Dimension;

    const LENGTH: Kind = Kind::Number {
        dimension: Dimension::Length,
        min: 0.0,
        max: 2e-3,
        display: "mm",
        slider: (0.0, 1e-3),
        logarithmic: false,
    };

    #[test]
    fn a_bare_number_gets_the_displayed_unit() {
        assert_eq!(with_display_unit(" 0.5 ", &LENGTH), "0.5 mm");
        assert_eq!(with_display_unit("500 um", &LENGTH), "500 um");
        assert_eq!(with_display_unit("half", &LENGTH), "half");
        assert_eq!(with_display_unit("0,8", &LENGTH), "0.8 mm");
        assert_eq!(with_display_unit("-0,125 mm", &LENGTH), "-0.125 mm");
        assert_eq!(with_display_unit("1,5e-1 mm", &LENGTH), "1.5e-1 mm");
        // Thousands or thousandths.
        assert_eq!(with_display_unit("1,500", &LENGTH), "1,500");
        assert_eq!(with_display_unit("1,2,3", &LENGTH), "1,2,3");
    }

    #[test]
    fn displayed_units_are_typeset_and_read_back() {
        for (plain, printed) in [
            ("3 um", "3 µm"),
            ("3um and 5 us.", "3µm and 5 µs."),
            ("units m, mm, um, um/s", "units m, mm, µm, µm/s"),
            ("-9.81 m/s^2 to 20 kg mm^2, m^3", "-9.81 m/s² to 20 kg mm², m³"),
            ("maximum of status, 2^20, x^2y", "maximum of status, 2^20, x^2y"),
            ("", ""),
        ] {
            assert_eq!(typeset(plain), printed);
        }
        let kinds = crate::scene::table().iter().map(|parameter| parameter.kind);
        let mut seen = 0;
        for kind in kinds {
            let Kind::Number { dimension, display, .. } = kind else {
                continue;
            };
            let printed = shown(&Value::Number(0.25), &kind);
            assert!(!printed.contains('^') && !printed.contains("um"), "{printed}");
            let read = crate::units::parse_quantity(&printed, dimension).expect("reads back");
            assert!((read - 0.25).abs() < 1e-6, "{display}: {printed}");
            seen += 1;
        }
        assert!(seen > 10);
    }

    #[test]
    fn a_slider_steps_to_round_values_in_proportion_to_its_range() {
        let cases =
            [(1.0, 2), (0.3, 3), (2.0, 2), (40.0, 1), (500.0, 0), (1e5, 0), (1e-3, 5), (0.0, 15), (f64::NAN, 15)];
        for (span, expected) in cases {
            assert_eq!(decimals(span), expected, "{span}");
        }
    }

    #[test]
    fn a_value_is_displayed_in_its_display_unit() {
        assert_eq!(shown(&Value::Number(3e-4), &LENGTH), "0.3 mm");
    }

    #[test]
    fn times_and_scales_suit_their_size() {
        assert_eq!(time(0.0), "0.0000 s");
        assert_eq!(time(7.85e-3), "7.8500 ms");
        assert_eq!(time(12.5e-6), "12.500 µs");
        assert_eq!(time(0.999_999_99), "1.0000 s");
        assert_eq!(time(999.999_9e-6), "1.0000 ms");
        assert_eq!(time(12_345.678_9), "12345.679 s");
        let longest = (-90..90).map(|k| time(libm::pow(10.0, f64::from(k) / 10.0) * 0.999_999_99));
        let longest = longest.map(|text| text.chars().count()).max();
        assert_eq!(longest, Some(MAX_TIME_CHARACTERS));
        assert_eq!(time_scale(1.0), "1:1");
        assert_eq!(time_scale(0.4), "1:2.5");
        assert_eq!(time_scale(0.02), "1:50");
        assert_eq!(time_scale(1e-4), "1:10\u{202f}000");
        for (scale, words) in [(1.0 / 1.63, "1:1.6"), (1.0 / 138.0, "1:140"), (1.0 / 99.7, "1:100"), (0.0, "1:∞")] {
            assert_eq!(rounded_time_scale(scale), words);
        }
    }

    #[test]
    fn marks_are_written_as_people_read_them() {
        assert_eq!(mark(8000.0, 2000.0, true), "8000");
        assert_eq!(mark(0.0, 2e4, true), "0");
        assert_eq!(mark(1.5e4, 5e3, true), "15\u{202f}000");
        assert_eq!(mark(-7.5e4, 2.5e4, true), "-75\u{202f}000");
        assert_eq!(mark(1_234_567.5, 0.5, true), "1\u{202f}234\u{202f}567.5");
        assert_eq!(mark(2e6, 5e5, false), "2.0×10^6");
        assert_eq!(mark(-2e-7, 1e-7, false), "-2×10^-7");
    }
}
