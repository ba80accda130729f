//! Quantities as users write them: "0.3 mm", "206 GPa", "15 deg".
//!
//! Decimal prefixes are applied to the decimal exponent of the text, not by a multiplication, so that
//! "0.3 mm", "0.3mm" and "3e-4 m" are the same bits.

use std::f64::consts::PI;

/// Physical dimension of a quantity; determines its units.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// A pure number.
    None,
    /// m
    Length,
    /// s
    Time,
    /// kg
    Mass,
    /// kg/m^3
    Density,
    /// kg m^2
    Inertia,
    /// Pa
    Stress,
    /// rad
    Angle,
    /// m/s
    Speed,
    /// rad/s
    AngularSpeed,
    /// m/s^2
    Acceleration,
    /// Hz
    Frequency,
    /// N
    Force,
    /// N m
    Torque,
    /// N/m
    Stiffness,
    /// Of a contact whose force grows with the power 1.5 of its depth; SI: N/m^1.5.
    ContactStiffness,
    /// N s/m
    Damping,
    /// N m/rad
    TurningStiffness,
    /// N m s/rad
    TurningDamping,
    /// Worn volume by force and distance; m^2/N
    Wear,
    /// Pa s
    Viscosity,
}

/// Why a text is not a quantity of the required dimension.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum QuantityError {
    /// No number at the start.
    #[error("is not a number{}", example(*.0))]
    NotANumber(Dimension),
    /// Infinite, NaN, or beyond the range of double precision.
    #[error("must be a finite number{}", example(*.0))]
    NotFinite(Dimension),
    /// A bare number other than 0 for a dimensional quantity.
    #[error("needs a unit{}", example(*.0))]
    MissingUnit(Dimension),
    /// A comma instead of a decimal point.
    #[error("has a decimal comma; write a point, as in 0.5")]
    Comma,
    /// A unit of another dimension, or an unknown one.
    #[error("wrong unit `{unit}`{}{}", dimension_of_unit(unit), example(*.dimension))]
    WrongUnit {
        /// The unit as written.
        unit: String,
        /// The dimension required.
        dimension: Dimension,
    },
}

/// How a unit converts to SI.
#[derive(Clone, Copy)]
enum Scale {
    /// 10 to this power.
    Decimal(i32),
    /// value * numerator / denominator.
    Ratio(f64, f64),
}

use Scale::{Decimal, Ratio};

/// A unit's name and size.
type Unit = (&'static str, Scale);

/// Every dimension with its name and its units; the first unit is the SI one.
const UNITS: [(Dimension, &str, &[Unit]); 21] = [
    (
        Dimension::Length,
        "length",
        &[
            ("m", Decimal(0)),
            ("cm", Decimal(-2)),
            ("mm", Decimal(-3)),
            ("um", Decimal(-6)),
            ("nm", Decimal(-9)),
            ("km", Decimal(3)),
        ],
    ),
    (
        Dimension::Time,
        "time",
        &[("s", Decimal(0)), ("ms", Decimal(-3)), ("us", Decimal(-6)), ("ns", Decimal(-9)), ("min", Ratio(60.0, 1.0))],
    ),
    (Dimension::Mass, "mass", &[("kg", Decimal(0)), ("g", Decimal(-3)), ("mg", Decimal(-6)), ("t", Decimal(3))]),
    (Dimension::Density, "density", &[("kg/m^3", Decimal(0)), ("g/cm^3", Decimal(3))]),
    (
        Dimension::Inertia,
        "moment of inertia",
        &[
            ("kg m^2", Decimal(0)),
            ("kg cm^2", Decimal(-4)),
            ("kg mm^2", Decimal(-6)),
            ("g cm^2", Decimal(-7)),
            ("g mm^2", Decimal(-9)),
        ],
    ),
    (
        Dimension::Stress,
        "stress",
        &[("Pa", Decimal(0)), ("kPa", Decimal(3)), ("MPa", Decimal(6)), ("GPa", Decimal(9)), ("N/mm^2", Decimal(6))],
    ),
    (Dimension::Angle, "angle", &[("rad", Decimal(0)), ("mrad", Decimal(-3)), ("deg", Ratio(PI, 180.0))]),
    (
        Dimension::Speed,
        "speed",
        &[
            ("m/s", Decimal(0)),
            ("cm/s", Decimal(-2)),
            ("mm/s", Decimal(-3)),
            ("um/s", Decimal(-6)),
            ("nm/s", Decimal(-9)),
            ("km/h", Ratio(1.0, 3.6)),
        ],
    ),
    (
        Dimension::AngularSpeed,
        "angular speed",
        &[("rad/s", Decimal(0)), ("mrad/s", Decimal(-3)), ("deg/s", Ratio(PI, 180.0)), ("rpm", Ratio(PI, 30.0))],
    ),
    (
        Dimension::Acceleration,
        "acceleration",
        &[("m/s^2", Decimal(0)), ("cm/s^2", Decimal(-2)), ("mm/s^2", Decimal(-3))],
    ),
    (
        Dimension::Frequency,
        "frequency",
        &[("Hz", Decimal(0)), ("mHz", Decimal(-3)), ("kHz", Decimal(3)), ("1/s", Decimal(0))],
    ),
    (Dimension::Force, "force", &[("N", Decimal(0)), ("mN", Decimal(-3)), ("kN", Decimal(3)), ("MN", Decimal(6))]),
    (Dimension::Torque, "torque", &[("N m", Decimal(0)), ("N mm", Decimal(-3)), ("kN m", Decimal(3))]),
    (
        Dimension::Stiffness,
        "stiffness",
        &[("N/m", Decimal(0)), ("N/mm", Decimal(3)), ("kN/m", Decimal(3)), ("kN/mm", Decimal(6))],
    ),
    (Dimension::ContactStiffness, "contact stiffness", &[("N/m^1.5", Decimal(0))]),
    (Dimension::Damping, "damping", &[("N s/m", Decimal(0)), ("N s/mm", Decimal(3)), ("kN s/m", Decimal(3))]),
    (
        Dimension::TurningStiffness,
        "turning stiffness",
        &[("N m/rad", Decimal(0)), ("N mm/rad", Decimal(-3)), ("kN m/rad", Decimal(3)), ("N m/deg", Ratio(180.0, PI))],
    ),
    (
        Dimension::TurningDamping,
        "turning damping",
        &[
            ("N m s/rad", Decimal(0)),
            ("N mm s/rad", Decimal(-3)),
            ("kN m s/rad", Decimal(3)),
            ("N m s/deg", Ratio(180.0, PI)),
        ],
    ),
    (
        Dimension::Wear,
        "wear coefficient",
        &[("m^2/N", Decimal(0)), ("mm^2/N", Decimal(-6)), ("mm^3/(N m)", Decimal(-9)), ("1/Pa", Decimal(0))],
    ),
    (Dimension::Viscosity, "viscosity", &[("Pa s", Decimal(0)), ("mPa s", Decimal(-3)), ("cP", Decimal(-3))]),
    (Dimension::None, "pure number", &[]),
];

/// Names of the units of a dimension, SI first; empty for a pure number.
pub fn unit_names(dimension: Dimension) -> Vec<&'static str> {
    units(dimension).iter().map(|(name, _)| *name).collect()
}

/// Display name of a dimension.
pub fn dimension_name(dimension: Dimension) -> &'static str {
    let row = UNITS.iter().find(|(of, ..)| *of == dimension);
    row.map_or("", |(_, name, _)| name)
}

/// All units as a Markdown table.
pub fn unit_table() -> String {
    let row = |&(_, name, units): &(Dimension, &str, &[Unit])| {
        let names: Vec<String> = units.iter().map(|(name, _)| format!("`{name}`")).collect();
        match names.is_empty() {
            true => format!("| {name} | none |\n"),
            false => format!("| {name} | {} |\n", names.join(", ")),
        }
    };
    let rows: String = UNITS.iter().map(row).collect();
    format!("| quantity | units |\n|---|---|\n{rows}")
}

/// SI unit of a dimension; "" for a pure number.
pub fn si_unit(dimension: Dimension) -> &'static str {
    units(dimension).first().map_or("", |(name, _)| *name)
}

/// Parses a quantity as a user writes it, in SI units. A bare 0 needs no unit; pure numbers take none.
///
/// # Errors
/// Not a number, not finite, no unit, or a unit of another dimension.
pub fn parse_quantity(text: &str, dimension: Dimension) -> Result<f64, QuantityError> {
    let text = text.trim();
    let (number, unit) = split_number(text);
    if number.is_empty() {
        let word = text.trim_start_matches(['+', '-']).to_ascii_lowercase();
        return Err(if word.starts_with("inf") || word.starts_with("nan") {
            QuantityError::NotFinite(dimension)
        } else {
            QuantityError::NotANumber(dimension)
        });
    }
    let bare: f64 = number.parse().map_err(|_| QuantityError::NotANumber(dimension))?;
    if let Some(rest) = unit.strip_prefix(',')
        && rest.starts_with(|c: char| c.is_ascii_digit())
    {
        return Err(QuantityError::Comma);
    }
    let value = if unit.is_empty() {
        if dimension != Dimension::None && bare != 0.0 {
            return Err(QuantityError::MissingUnit(dimension));
        }
        bare
    } else {
        let scale = units(dimension)
            .iter()
            .find(|(name, _)| same_unit(name, unit))
            .map(|(_, scale)| *scale)
            .ok_or_else(|| QuantityError::WrongUnit { unit: unit.to_owned(), dimension })?;
        to_si(number, bare, scale)
    };
    if !value.is_finite() {
        return Err(QuantityError::NotFinite(dimension));
    }
    // A negative zero would only make equal scenes hash differently.
    Ok(value + 0.0)
}

/// Powers of kg, m, s and rad in a dimension.
pub fn powers(dimension: Dimension) -> [i8; 4] {
    match dimension {
        Dimension::None => [0, 0, 0, 0],
        Dimension::Length => [0, 1, 0, 0],
        Dimension::Time => [0, 0, 1, 0],
        Dimension::Mass => [1, 0, 0, 0],
        Dimension::Density => [1, -3, 0, 0],
        Dimension::Inertia => [1, 2, 0, 0],
        Dimension::Stress => [1, -1, -2, 0],
        Dimension::Angle => [0, 0, 0, 1],
        Dimension::Speed => [0, 1, -1, 0],
        Dimension::AngularSpeed => [0, 0, -1, 1],
        Dimension::Acceleration => [0, 1, -2, 0],
        Dimension::Frequency => [0, 0, -1, 0],
        Dimension::Force => [1, 1, -2, 0],
        Dimension::Torque => [1, 2, -2, 0],
        Dimension::Stiffness => [1, 0, -2, 0],
        // In place of kg m^-0.5 s^-2, which has no whole powers: what no product of the others gives.
        Dimension::ContactStiffness => [1, 0, -2, 8],
        Dimension::Damping => [1, 0, -1, 0],
        Dimension::TurningStiffness => [1, 2, -2, -1],
        Dimension::TurningDamping => [1, 2, -1, -1],
        Dimension::Wear => [-1, 1, 2, 0],
        Dimension::Viscosity => [1, -1, -1, 0],
    }
}

/// Every unit with its dimension and its size in SI units.
pub fn all_units() -> impl Iterator<Item = (&'static str, Dimension, f64)> {
    UNITS.iter().flat_map(|(dimension, _, units)| {
        let size = |&(name, scale): &Unit| (name, *dimension, to_si("1", 1.0, scale));
        units.iter().map(size)
    })
}

/// Length in bytes of the longest unit at the start of `text`, and its index in [`all_units`].
pub fn unit_at_start(text: &str) -> Option<(usize, usize)> {
    let ends = |length: usize| !text[length..].starts_with(|c: char| c.is_alphanumeric() || c == '_');
    // Names alone: computing the sizes would dominate the time to read a scene.
    let names = UNITS.iter().flat_map(|(_, _, units)| units.iter().map(|(name, _)| *name));
    let begins =
        |(index, name): (usize, &str)| (text.starts_with(name) && ends(name.len())).then_some((name.len(), index));
    names.enumerate().filter_map(begins).max_by_key(|(length, _)| *length)
}

/// The text after the number at the start of `text`; empty without such a number.
pub fn split_unit(text: &str) -> &str {
    split_number(text.trim()).1
}

/// Whether `written` is a spelling of `unit`.
pub fn same_unit(unit: &str, written: &str) -> bool {
    normalised(unit).eq(normalised(written))
}

/// The unit of `dimension` in which the quantity `text` is written.
pub fn unit_of_quantity(text: &str, dimension: Dimension) -> Option<&'static str> {
    let same = |(name, _): &&Unit| same_unit(name, split_unit(text));
    units(dimension).iter().find(same).map(|(name, _)| *name)
}

/// An SI value in `unit`; unchanged if `unit` is unknown or "".
pub fn to_display(si: f64, unit: &str) -> f64 {
    match scale_of(unit) {
        Some(Decimal(exponent)) => scale_by_power_of_ten(&format!("{si:e}"), -exponent).unwrap_or(f64::NAN),
        Some(Ratio(numerator, denominator)) => si * denominator / numerator,
        None => si,
    }
}

/// A value in `unit` as SI; unchanged if `unit` is unknown or "".
pub fn from_display(value: f64, unit: &str) -> f64 {
    scale_of(unit).map_or(value, |scale| to_si(&format!("{value:e}"), value, scale))
}

/// An SI value with its unit, at most `digits` significant digits, no trailing zeros: `0.3 mm`.
pub fn format_quantity_digits(si: f64, unit: &str, digits: usize) -> String {
    let number = format_number(to_display(si, unit), digits);
    if unit.is_empty() { number } else { format!("{number} {unit}") }
}

/// An SI value with its unit for display: six significant digits.
pub fn format_quantity(si: f64, unit: &str) -> String {
    format_quantity_digits(si, unit, 6)
}

/// A text that [`parse_quantity`] reads back to the same bits, in `unit` if possible, otherwise in SI.
pub fn exact_quantity(si: f64, unit: &str, dimension: Dimension) -> String {
    let friendly = format_quantity_digits(si, unit, 15);
    if parse_quantity(&friendly, dimension).map(f64::to_bits) == Ok((si + 0.0).to_bits()) {
        return friendly;
    }
    let unit = si_unit(dimension);
    if unit.is_empty() { format!("{si:e}") } else { format!("{si:e} {unit}") }
}

/// At most `digits` significant digits, in plain notation where that is short.
fn format_number(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".to_owned() } else { format!("{value}") };
    }
    let rounded: f64 = format!("{value:.*e}", digits.saturating_sub(1)).parse().unwrap_or(value);
    let size = rounded.abs();
    if (1e-4..1e9).contains(&size) { format!("{rounded}") } else { format!("{rounded:e}") }
}

fn units(dimension: Dimension) -> &'static [Unit] {
    UNITS.iter().find(|(d, _, _)| *d == dimension).map_or(&[], |(_, _, units)| units)
}

fn scale_of(unit: &str) -> Option<Scale> {
    UNITS.iter().flat_map(|(_, _, units)| units.iter()).find(|(name, _)| *name == unit).map(|(_, scale)| *scale)
}

fn to_si(number: &str, bare: f64, scale: Scale) -> f64 {
    match scale {
        Decimal(exponent) => scale_by_power_of_ten(number, exponent).unwrap_or(f64::NAN),
        Ratio(numerator, denominator) => bare * numerator / denominator,
    }
}

/// The decimal number `text` times 10^`by`, rounded once.
fn scale_by_power_of_ten(text: &str, by: i32) -> Option<f64> {
    let (mantissa, exponent) = match text.find(['e', 'E']) {
        Some(at) => (&text[..at], text[at + 1..].parse::<i64>().ok()?),
        None => (text, 0),
    };
    format!("{mantissa}e{}", exponent.saturating_add(i64::from(by))).parse().ok()
}

/// Splits "0.3 mm" into "0.3" and "mm"; the number is "" if the text does not start with one.
fn split_number(text: &str) -> (&str, &str) {
    let bytes = text.as_bytes();
    let digits = |mut at: usize| {
        while bytes.get(at).is_some_and(u8::is_ascii_digit) {
            at += 1;
        }
        at
    };
    let start = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let mut end = digits(start);
    let mut count = end - start;
    if bytes.get(end) == Some(&b'.') {
        let fraction = digits(end + 1);
        count += fraction - end - 1;
        end = fraction;
    }
    if count == 0 {
        return ("", text);
    }
    // An exponent needs digits; otherwise the `e` belongs to the unit.
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits(end + 1 + sign);
        if exponent > end + 1 + sign {
            end = exponent;
        }
    }
    (&text[..end], text[end..].trim())
}

/// The letters by which units are compared: "kg·m²", "kg m^2" and "kg m2" are one unit, and so are the two signs for micro.
fn normalised(unit: &str) -> impl Iterator<Item = char> {
    let plain = unit.chars().filter(|c| !c.is_whitespace() && !matches!(c, '^' | '*' | '·' | '⋅'));
    plain.flat_map(|c| {
        let (letter, rest) = match c {
            'µ' | 'μ' => ('u', ""),
            '²' => ('2', ""),
            '°' => ('d', "eg"),
            other => (other, ""),
        };
        std::iter::once(letter).chain(rest.chars())
    })
}

/// The allowed units, as the end of a sentence.
fn example(dimension: Dimension) -> String {
    let names = unit_names(dimension);
    match names.first() {
        None => "; a pure number takes no unit".to_owned(),
        Some(_) => format!("; units of {}: {}", dimension_name(dimension), names.join(", ")),
    }
}

/// Names the quantity that a unit measures, if any.
fn dimension_of_unit(unit: &str) -> String {
    UNITS
        .iter()
        .find(|(_, _, units)| units.iter().any(|(name, _)| same_unit(name, unit)))
        .map_or_else(String::new, |(_, name, _)| format!(" (a unit of {name})"))
}

/// `value` with `digits` significant digits, trailing zeros dropped, as C's `%.<digits>g` writes it (but 0 for -0).
pub fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let scientific = format!("{value:.*e}", digits.saturating_sub(1));
    let Some((mantissa, exponent)) = scientific.split_once('e') else {
        return scientific; // not finite: "NaN", "inf"
    };
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if exponent < -4 || exponent >= digits as i32 {
        let sign = if exponent < 0 { '-' } else { '+' };
        return format!("{}e{sign}{:02}", trim(mantissa), exponent.unsigned_abs());
    }
    let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
    trim(&format!("{value:.decimals$}")).to_owned()
}

fn trim(number: &str) -> &str {
    if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_spellings_of_a_quantity_have_the_same_bits() {
        for text in ["0.3 mm", "0.3mm", "3e-4 m", "300 µm", "300μm", "300 um", "  0.3  mm "] {
            assert_eq!(parse_quantity(text, Dimension::Length).map(f64::to_bits), Ok(3e-4_f64.to_bits()), "{text}");
        }
    }

    #[test]
    fn every_dimension_reads_its_units() {
        let cases = [
            ("206 GPa", Dimension::Stress, 206e9),
            ("5 us", Dimension::Time, 5e-6),
            ("20ms", Dimension::Time, 0.02),
            ("180 deg", Dimension::Angle, PI),
            ("0.168 kg", Dimension::Mass, 0.168),
            ("168 g", Dimension::Mass, 0.168),
            ("4.44e-4 kg m^2", Dimension::Inertia, 4.44e-4),
            ("4.44e-4 kg m2", Dimension::Inertia, 4.44e-4),
            ("4.44e-4 kg·m²", Dimension::Inertia, 4.44e-4),
            ("9.81 m/s^2", Dimension::Acceleration, 9.81),
            ("9.81m/s2", Dimension::Acceleration, 9.81),
            ("0.5 Hz", Dimension::Frequency, 0.5),
            ("6 rad/s", Dimension::AngularSpeed, 6.0),
            ("30 rpm", Dimension::AngularSpeed, PI),
            ("-2 mm/s", Dimension::Speed, -2e-3),
            ("0.15", Dimension::None, 0.15),
            (".5", Dimension::None, 0.5),
            ("0", Dimension::Length, 0.0),
            ("-0.0", Dimension::Length, 0.0),
            ("1e-3", Dimension::None, 1e-3),
        ];
        for (text, dimension, si) in cases {
            let read = parse_quantity(text, dimension).unwrap();
            // pi adds one rounding.
            assert!((read - si).abs() <= f64::EPSILON * si.abs(), "{text}: {read}");
        }
    }

    #[test]
    fn invalid_quantities_are_refused_with_the_reason() {
        let cases = [
            ("0.3", Dimension::Length, "needs a unit"),
            ("0.3 s", Dimension::Length, "wrong unit `s` (a unit of time)"),
            ("0.3 furlong", Dimension::Length, "wrong unit `furlong`; units of length: m, cm, mm"),
            ("0.3 mm", Dimension::None, "wrong unit `mm` (a unit of length); a pure number takes no unit"),
            ("inf", Dimension::None, "finite"),
            ("nan m", Dimension::Length, "finite"),
            ("-inf mm", Dimension::Length, "finite"),
            ("1e999 m", Dimension::Length, "finite"),
            ("1e99999999999999999999 m", Dimension::Length, "finite"),
            ("", Dimension::Length, "not a number"),
            ("mm", Dimension::Length, "not a number"),
            ("1.2.3 mm", Dimension::Length, "wrong unit"),
            ("-", Dimension::None, "not a number"),
            ("0x10 m", Dimension::Length, "wrong unit"),
        ];
        for (text, dimension, fragment) in cases {
            let error = parse_quantity(text, dimension).unwrap_err().to_string();
            assert!(error.contains(fragment), "{text}: {error}");
        }
    }

    #[test]
    fn displayed_values_convert_back_to_the_same_bits() {
        for (si, unit, shown) in [
            (3e-4, "mm", "0.3 mm"),
            (206e9, "GPa", "206 GPa"),
            (1e-6, "mm/s", "0.001 mm/s"),
            (0.15, "", "0.15"),
            (1e-11, "", "1e-11"),
        ] {
            assert_eq!(format_quantity(si, unit), shown);
            assert_eq!(from_display(to_display(si, unit), unit).to_bits(), f64::to_bits(si));
        }
        assert_eq!(to_display(PI, "deg"), 180.0);
    }

    #[test]
    fn exact_text_parses_to_the_same_bits() {
        let mut x = 1.234_567_890_123_456_7e-4_f64;
        for _ in 0..200 {
            let text = exact_quantity(x, "mm", Dimension::Length);
            assert_eq!(parse_quantity(&text, Dimension::Length).unwrap().to_bits(), x.to_bits(), "{text}");
            x *= 1.017_3;
        }
        assert_eq!(exact_quantity(3e-4, "mm", Dimension::Length), "0.3 mm");
    }

    #[test]
    fn numbers_look_as_in_the_reference_files() {
        for (value, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (0.203, "0.203"),
            (-0.038_316_734_517_7, "-0.0383167345177"),
            (3.925_231_146_71e-17, "3.92523114671e-17"),
            (1.123_152_959_62e-6, "1.12315295962e-06"),
            (0.000_1, "0.0001"),
            (0.000_01, "1e-05"),
            (771.151_234_567_89, "771.151234568"),
            (1.0e12, "1e+12"),
            (123_456_789_012.0, "123456789012"),
            (999_999_999_999.6, "1e+12"),
            (0.999_999_999_999_9, "1"),
            (0.1 + 0.2, "0.3"),
            (-2.5e-300, "-2.5e-300"),
        ] {
            assert_eq!(significant(value, 12), text);
        }
    }

    #[test]
    fn twelve_digits_are_preserved() {
        let mut value = 1.234_567_890_123_456_7e-20;
        while value < 1e20 {
            let back: f64 = significant(value, 12).parse().unwrap();
            // Half a unit of the twelfth digit is at most 5e-12 of the value.
            assert!((back - value).abs() <= 5.000_1e-12 * value, "{value:e}");
            value *= 3.7;
        }
    }
}
