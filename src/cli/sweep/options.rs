//! Parsers for options of a sweep: `--shard 3/16`, `--phase 90deg`.

use crate::cli::Failure;
use crate::units::{Dimension, parse_quantity};

/// Part `number` of `of`, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Number of the part.
    pub number: usize,
    /// Number of parts.
    pub of: usize,
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

/// Reads `K/M`.
///
/// # Errors
/// Usage: no such part.
pub fn shard(text: &str) -> Result<Shard, Failure> {
    let parse = || {
        let (number, of) = text.split_once('/')?;
        let (number, of) = (number.trim().parse().ok()?, of.trim().parse().ok()?);
        (number >= 1 && number <= of).then_some(Shard { number, of })
    };
    parse().ok_or_else(|| Failure::usage(format!("--shard {text}: expected K/M with K from 1 to M, e.g. 3/16")))
}

/// Reads a drive phase: a fraction of the period, or an angle with its unit.
///
/// # Errors
/// Usage: neither, or outside one period.
pub fn phase(text: &str) -> Result<f64, Failure> {
    let fraction = match text.trim().parse::<f64>() {
        Ok(fraction) => fraction,
        Err(_) => {
            parse_quantity(text, Dimension::Angle)
                .map_err(|error| Failure::usage(format!("--phase {text}: {error}")))?
                / std::f64::consts::TAU
        }
    };
    if (0.0..1.0).contains(&fraction) {
        Ok(fraction)
    } else {
        Err(Failure::usage(format!(
            "--phase {text}: a drive phase is a fraction of the period, from 0 to below 1, or an angle, from 0 to below 360deg"
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phases_are_fractions_or_angles_of_one_period() {
        assert_eq!(phase("0"), Ok(0.0));
        assert_eq!(phase("0.25"), Ok(0.25));
        assert_eq!(phase("90deg"), Ok(0.25));
        for bad in ["1", "-0.1", "360deg", "2s", "", "nan", "soon"] {
            let failure = phase(bad).unwrap_err();
            assert_eq!(failure.code, Failure::USAGE, "{bad}");
            assert!(failure.message.starts_with("--phase"), "{}", failure.message);
        }
    }

    #[test]
    fn shards_count_from_one() {
        assert_eq!(shard("3/16"), Ok(Shard { number: 3, of: 16 }));
        for bad in ["0/4", "5/4", "3", "a/b", "1/0", "-1/4", ""] {
            assert_eq!(shard(bad).unwrap_err().code, Failure::USAGE, "{bad}");
        }
    }
}
