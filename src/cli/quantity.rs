//! Quantities as options: `20ms`, `7.85 ms`, `0`, `30deg`, `500N`.

use super::Failure;
use crate::simulate::MAX_RUN_DURATION;
use crate::units::{Dimension, parse_quantity};

/// A time of a run, s: not negative, and not beyond the longest.
///
/// # Errors
/// Usage: no time, no unit, negative, or too long.
pub fn duration(option: &str, text: &str) -> Result<f64, Failure> {
    let seconds =
        parse_quantity(text, Dimension::Time).map_err(|error| Failure::usage(format!("{option} {text}: {error}")))?;
    if seconds < 0.0 {
        return Err(Failure::usage(format!("{option} {text}: the time must not be negative")));
    }
    if seconds > MAX_RUN_DURATION {
        return Err(Failure::usage(format!("{option} {text}: the time must be at most {MAX_RUN_DURATION:e} s")));
    }
    Ok(seconds)
}

/// An angle, rad.
///
/// # Errors
/// Usage: no angle, or no unit.
#[cfg(feature = "gui")]
pub fn angle(option: &str, text: &str) -> Result<f64, Failure> {
    parse_quantity(text, Dimension::Angle).map_err(|error| Failure::usage(format!("{option} {text}: {error}")))
}

/// A force greater than 0, N. No scene parameter is a force, so the unit table has none.
///
/// # Errors
/// Usage: no force, no unit, or not positive.
#[cfg(feature = "gui")]
pub fn force(option: &str, text: &str) -> Result<f64, Failure> {
    let wrong = || Failure::usage(format!("{option} {text}: expected a force greater than 0 in N or kN, e.g. 500N"));
    let number = text.trim().strip_suffix('N').ok_or_else(wrong)?;
    let (number, factor) = match number.strip_suffix('k') {
        Some(number) => (number, 1e3),
        None => (number, 1.0),
    };
    let force = factor * number.trim().parse::<f64>().map_err(|_| wrong())?;
    if force.is_finite() && force > 0.0 { Ok(force) } else { Err(wrong()) }
}

#[cfg(test)]
mod tests {
    use super::duration;

    #[cfg(feature = "gui")]
    #[test]
    fn forces_need_their_unit() {
        use super::force;
        assert_eq!(force("--arrow-reference", "500N"), Ok(500.0));
        assert_eq!(force("--arrow-reference", "1.5 kN"), Ok(1500.0));
        for bad in ["500", "-1N", "0N", "N", "nan N", "inf kN", "5mm"] {
            assert!(force("--arrow-reference", bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn times_need_a_unit_and_no_sign() {
        assert_eq!(duration("--duration", "20ms"), Ok(0.02));
        assert_eq!(duration("--at", "0"), Ok(0.0));
        assert_eq!(duration("--duration", "1e6s"), Ok(1e6));
        for bad in ["20", "-1ms", "20mm", "soon", "", "inf s", "nan", "1e300s", "1000001s"] {
            let failure = duration("--duration", bad).unwrap_err();
            assert_eq!(failure.code, crate::cli::Failure::USAGE, "{bad}");
            assert!(failure.message.starts_with("--duration"), "{}", failure.message);
        }
    }
}
