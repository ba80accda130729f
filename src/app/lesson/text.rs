//! Lesson texts: a Markdown subset, and placeholders such as `{first in us}` for computed values.

use super::names::Names;
use crate::app::value;
use crate::scene::{Quantity, evaluate};

/// Placeholder for a pending value.
const PENDING: &str = "…";

/// Significant digits of a value.
const DIGITS: usize = 3;

/// Units of one dimension in descending order; a value is written in the first unit in which it is at least 1.
type Units = ([i8; 4], &'static [(&'static str, f64)]);

const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// Units by powers of kg, m, s and rad.
const UNITS: [Units; 11] = [
    ([0, 0, 1, 0], &[("s", 1.0), ("ms", 1e-3), ("us", 1e-6)]),
    ([0, 1, 0, 0], &[("m", 1.0), ("mm", 1e-3), ("um", 1e-6)]),
    ([0, 1, -1, 0], &[("m/s", 1.0), ("mm/s", 1e-3)]),
    ([0, 1, -2, 0], &[("m/s^2", 1.0)]),
    ([1, 1, -2, 0], &[("N", 1.0), ("mN", 1e-3)]),
    ([1, 2, -2, 0], &[("J", 1.0), ("mJ", 1e-3), ("uJ", 1e-6)]),
    ([0, 0, -1, 0], &[("Hz", 1.0)]),
    ([0, 0, -1, 1], &[("rad/s", 1.0)]),
    ([0, 0, 0, 1], &[("°", DEGREE), ("mrad", 1e-3)]),
    ([1, 0, 0, 0], &[("kg", 1.0), ("g", 1e-3)]),
    ([0, 0, 0, 0], &[("", 1.0)]),
];

/// A run of text in one style.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextSpan {
    /// The text.
    pub text: String,
    /// Its style.
    pub face: SpanStyle,
}

/// Text style.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum SpanStyle {
    #[default]
    Plain,
    Emphasis,
    Strong,
    Code,
}

/// A paragraph or a list item.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Block {
    /// Whether it is a list item.
    pub entry: bool,
    /// Its text.
    pub pieces: Vec<TextSpan>,
}

/// Parses paragraphs and list items (lines that begin with `- `), with `*emphasis*`, `**strong**` and `` `code` ``.
pub fn blocks(markdown: &str) -> Vec<Block> {
    let (mut blocks, mut lines) = (Vec::new(), Vec::new());
    let mut entry = false;
    for line in markdown.lines().map(str::trim).chain([""]) {
        let item = line.strip_prefix("- ");
        if (line.is_empty() || item.is_some()) && !lines.is_empty() {
            let pieces = pieces(&std::mem::take(&mut lines).join(" "));
            blocks.push(Block { entry, pieces });
        }
        entry = item.is_some() || (entry && !line.is_empty());
        lines.extend(Some(item.unwrap_or(line)).filter(|line| !line.is_empty()));
    }
    blocks
}

/// `text` with the spaces between thousands, as in 10 000, replaced by ones at which egui breaks no line.
pub fn unbroken(text: &str) -> String {
    let is_digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
    let mut before = None;
    let mut out = String::with_capacity(text.len());
    for (at, c) in text.char_indices() {
        let after = text[at + c.len_utf8()..].chars().next();
        let joins = matches!(c, ' ' | '\u{202f}' | '\u{2009}') && is_digit(before) && is_digit(after);
        out.push(if joins { '\u{a0}' } else { c });
        before = Some(c);
    }
    out
}

fn pieces(line: &str) -> Vec<TextSpan> {
    const MARKS: [(&str, SpanStyle); 3] =
        [("**", SpanStyle::Strong), ("*", SpanStyle::Emphasis), ("`", SpanStyle::Code)];
    let (mut pieces, mut rest) = (Vec::new(), line);
    let mut push = |text: &str, face| {
        if !text.is_empty() {
            let text = text.to_owned();
            pieces.push(TextSpan { text, face });
        }
    };
    // An unpaired mark is literal.
    let mut from = 0;
    while let Some(at) = rest[from..].find(['*', '`']).map(|at| from + at) {
        let marked = MARKS.iter().find_map(|(mark, face)| {
            let inside = rest[at..].strip_prefix(mark)?;
            let end = inside.find(mark).filter(|end| *end > 0)?;
            Some((mark.len(), &inside[..end], *face))
        });
        let Some((mark, inside, face)) = marked else {
            from = at + 1;
            continue;
        };
        push(&rest[..at], SpanStyle::Plain);
        push(inside, face);
        rest = &rest[at + 2 * mark + inside.len()..];
        from = 0;
    }
    push(rest, SpanStyle::Plain);
    pieces
}

/// Calls `take` with the content of each placeholder in `text`, and returns the text with the results inserted.
///
/// # Errors
/// The first error of `take`, or an unmatched brace.
fn replace<E: From<String>>(text: &str, mut take: impl FnMut(&str) -> Result<String, E>) -> Result<String, E> {
    let (mut out, mut rest) = (String::new(), text);
    while let Some((before, behind)) = rest.split_once('{') {
        let Some((inside, after)) = behind.split_once('}') else {
            return Err("has a `{` without a `}`".to_owned().into());
        };
        out += before;
        out += &take(inside)?;
        rest = after;
    }
    Ok(out + rest)
}

/// Fills the placeholders of `text`; values missing in `names` are pending.
///
/// # Errors
/// A placeholder cannot be computed; the message gives the cause.
pub fn fill(text: &str, names: &Names<'_>) -> Result<String, String> {
    replace(text, |inside| {
        let (expression, unit) = split(inside);
        match evaluate(expression, &names.known) {
            Ok(quantity) => words(quantity, unit).map_err(|why| format!("{{{inside}}}: {why}")),
            Err(_) => {
                names.check(expression).map(|()| PENDING.to_owned()).map_err(|why| format!("{{{inside}}}: {why}"))
            }
        }
    })
}

/// The expression of a placeholder, and its requested unit.
fn split(inside: &str) -> (&str, Option<&str>) {
    match inside.rsplit_once(" in ") {
        Some((expression, unit)) => (expression.trim(), Some(unit.trim())),
        None => (inside.trim(), None),
    }
}

/// Formats a value with the requested unit, or one that suits its magnitude.
///
/// # Errors
/// The unit has another dimension, or the value has no unit.
pub fn words(quantity: Quantity, unit: Option<&str>) -> Result<String, String> {
    let powers = quantity.powers().ok_or("adds or compares quantities of different dimensions")?;
    let (_, units) =
        UNITS.iter().find(|(own, _)| *own == powers).ok_or("has a dimension that lesson texts cannot show")?;
    let value = quantity.value();
    if !value.is_finite() {
        return Err("is not a finite number".to_owned());
    }
    let chosen = match unit {
        Some(requested) => units.iter().find(|(unit, _)| *unit == requested),
        None if value == 0.0 => units.first(),
        // Rounding makes 999.9 µm 1 mm.
        None => units.iter().find(|(_, size)| value.abs() * 1.000_6 >= *size).or(units.last()),
    };
    let Some((unit, size)) = chosen else {
        let known: Vec<&str> = units.iter().map(|(unit, _)| *unit).collect();
        return Err(format!("not in that unit; allowed: {}", known.join(", ")));
    };
    let number = match value / size {
        large if unit.is_empty() && large.abs() >= 1e6 => in_words(large),
        extreme if unit.is_empty() && extreme != 0.0 && extreme.abs() < 1e-3 => value::power_of_ten(extreme),
        number => value::number(number, DIGITS),
    };
    Ok(match *unit {
        "" => number,
        "°" => number + "°",
        unit => value::typeset(&format!("{number} {unit}")),
    })
}

/// A number of a million or more, to one digit: `100 million`; a power of ten where no word is common.
fn in_words(number: f64) -> String {
    const WORDS: [(f64, &str); 2] = [(1e9, "billion"), (1e6, "million")];
    // To one digit, of which 999 million has four.
    let power = libm::pow(10.0, libm::log10(number.abs()).floor());
    let rounded = (number / power).round() * power;
    let word = WORDS.into_iter().find(|(size, _)| rounded.abs() * 1.000_001 >= *size).filter(|_| rounded.abs() < 1e12);
    match word {
        Some((size, word)) => format!("{}\u{a0}{word}", value::number(rounded / size, DIGITS)),
        None => value::power_of_ten(number),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Dimension;

    #[test]
    fn markdown_has_paragraphs_lists_and_three_faces() {
        let read = blocks("One *two* **three**\nfour `a*b`.\n\n- first\n  goes on\n- second\n\n2 * 3 = 6");
        let letters = |block: &Block| block.pieces.iter().map(|piece| &*piece.text).collect();
        let words: Vec<(bool, String)> = read.iter().map(|b| (b.entry, letters(b))).collect();
        let expected =
            [(false, "One two three four a*b."), (true, "first goes on"), (true, "second"), (false, "2 * 3 = 6")];
        assert_eq!(words, expected.map(|(entry, words)| (entry, words.to_owned())));
        let faces: Vec<SpanStyle> = read[0].pieces.iter().map(|piece| piece.face).collect();
        use SpanStyle::{Code, Emphasis, Plain, Strong};
        assert_eq!(faces, [Plain, Emphasis, Plain, Strong, Plain, Code, Plain]);
    }

    #[test]
    fn no_line_breaks_within_a_number() {
        use eframe::egui;
        let ctx = egui::Context::default();
        crate::app::theme::apply(&ctx, false);
        // Last row in a width into which all but two digits fit.
        let last_row = |text: &str| {
            let mut last = String::new();
            let mut output = ctx.run_ui(egui::RawInput::default(), |ui| {
                let font = egui::TextStyle::Body.resolve(ui.style());
                let lay_out =
                    |text: &str, width| ui.painter().layout(text.to_owned(), font.clone(), egui::Color32::BLACK, width);
                let width = lay_out("runs 10 0", f32::INFINITY).size().x;
                last = lay_out(text, width).rows.last().map_or_else(String::new, |row| row.text());
            });
            output.textures_delta.clear();
            last
        };
        for number in ["runs 10 000", "runs 10\u{202f}000"] {
            assert_eq!(last_row(&unbroken(number)), "10\u{a0}000");
        }
        assert_eq!(last_row("runs 10 000"), "000");
        assert_eq!(unbroken("runs 5 times, S1 2"), "runs 5 times, S1\u{a0}2");
    }

    #[test]
    fn values_have_a_suitable_unit() {
        let write = |value, dimension, unit| words(Quantity::new(value, dimension), unit);
        for (value, dimension, unit, expected) in [
            (7.801_42e-3, Dimension::Time, None, "7.8 ms"),
            (7.801_42e-3, Dimension::Time, Some("us"), "7800 µs"),
            (3e-4, Dimension::Length, None, "300 µm"),
            (3e-4, Dimension::Length, Some("mm"), "0.3 mm"),
            (0.076_9, Dimension::Speed, None, "76.9 mm/s"),
            (870.58, Dimension::Force, None, "871 N"),
            (15f64.to_radians(), Dimension::Angle, None, "15°"),
            (1e-9, Dimension::None, None, "1e-9"),
            (3.97e7, Dimension::None, None, "40\u{a0}million"),
            (1.07e8, Dimension::None, None, "100\u{a0}million"),
            (9.7e8, Dimension::None, None, "1\u{a0}billion"),
            (-2.2e6, Dimension::None, None, "-2\u{a0}million"),
            (3.2e12, Dimension::None, None, "3e12"),
            (999_400.0, Dimension::None, None, "999000"),
            (0.0, Dimension::Force, None, "0 N"),
            (0.15, Dimension::None, None, "0.15"),
        ] {
            assert_eq!(write(value, dimension, unit).as_deref(), Ok(expected));
        }
        let wrong = write(1.0, Dimension::Force, Some("mm"));
        assert_eq!(wrong, Err("not in that unit; allowed: N, mN".to_owned()));
    }
}
