//! Distributions of uncertain parameters, as quantile functions.

use std::fmt::Display;

use jointplay_physics::suggest::brief;

use crate::normal::{cumulative, quantile};
use crate::yields::interpolated_quantile;

/// Smallest probability that the limits of a truncated normal distribution may enclose.
const MIN_MASS: f64 = 1e-200;
const FORMS: &str = "a value, `uniform(LOW, HIGH)`, `normal(MEAN, SD)`, `normal(MEAN, SD, LOW..HIGH)`, \
                     `triangular(LOW, MODE, HIGH)`, `measured(VALUE, VALUE, …)` or a fit such as `H7/g6`";

/// The distribution of one parameter, in its SI unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Distribution(Law);

#[derive(Clone, Debug, PartialEq)]
enum Law {
    Constant(f64),
    Uniform {
        low: f64,
        high: f64,
    },
    Normal {
        mean: f64,
        deviation: f64,
    },
    Truncated {
        mean: f64,
        deviation: f64,
        low: f64,
        high: f64,
    },
    Triangular {
        low: f64,
        mode: f64,
        high: f64,
    },
    /// The values in ascending order.
    Measured(Vec<f64>),
}

/// Reasons why a distribution is invalid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DistributionError {
    /// A text of unknown form.
    #[error("`{}` is not a distribution: expected {FORMS}", brief(text))]
    Form {
        /// The given text.
        text: String,
    },
    /// A number that the parameter does not accept.
    #[error("`{}`: {}: {reason}", brief(text), brief(part))]
    Number {
        /// The given text.
        text: String,
        /// The invalid number.
        part: String,
        /// Message of the number parser.
        reason: String,
    },
    /// A fit that does not exist or that the parameter does not accept.
    #[error("`{}`: {reason}", brief(text))]
    Fit {
        /// The given text.
        text: String,
        /// Message of the fit parser.
        reason: String,
    },
    /// Values that do not define a distribution.
    #[error("{0}")]
    Values(&'static str),
}

impl Distribution {
    /// The constant `value`.
    ///
    /// # Errors
    /// A value that is not finite.
    pub fn constant(value: f64) -> Result<Self, DistributionError> {
        check_finite(&[value])?;
        Ok(Self(Law::Constant(value)))
    }

    /// Uniform distribution between two limits.
    ///
    /// # Errors
    /// Limits that are not finite or not in ascending order.
    pub fn uniform(low: f64, high: f64) -> Result<Self, DistributionError> {
        check_finite(&[low, high])?;
        check(low < high, "the lower limit of a uniform distribution must be below the upper one")?;
        Ok(Self(Law::Uniform { low, high }))
    }

    /// Normal distribution.
    ///
    /// # Errors
    /// Values that are not finite, or a standard deviation that is not above 0.
    pub fn normal(mean: f64, deviation: f64) -> Result<Self, DistributionError> {
        check_finite(&[mean, deviation])?;
        check(deviation > 0.0, "the standard deviation of a normal distribution must be above 0")?;
        Ok(Self(Law::Normal { mean, deviation }))
    }

    /// Normal distribution truncated at two limits. `mean` and `deviation` are those before truncation.
    ///
    /// # Errors
    /// As [`Self::normal`] and [`Self::uniform`]; limits so far from the mean that they enclose almost no probability.
    pub fn truncated_normal(mean: f64, deviation: f64, low: f64, high: f64) -> Result<Self, DistributionError> {
        Self::normal(mean, deviation)?;
        check_finite(&[low, high])?;
        check(low < high, "the lower limit of a truncated normal distribution must be below the upper one")?;
        // Evaluated in the lower tail, where small probabilities keep their relative precision.
        let (z_low, z_high) = ((low - mean) / deviation, (high - mean) / deviation);
        let mass =
            if z_low > 0.0 { cumulative(-z_low) - cumulative(-z_high) } else { cumulative(z_high) - cumulative(z_low) };
        check(
            mass > MIN_MASS,
            "the limits of a truncated normal distribution are too many standard deviations from its mean",
        )?;
        Ok(Self(Law::Truncated { mean, deviation, low, high }))
    }

    /// Triangular distribution with its most frequent value at `mode`.
    ///
    /// # Errors
    /// Values that are not finite, equal limits, or a mode outside them.
    pub fn triangular(low: f64, mode: f64, high: f64) -> Result<Self, DistributionError> {
        check_finite(&[low, mode, high])?;
        let ordered = low <= mode && mode <= high && low < high;
        check(ordered, "a triangular distribution takes LOW, MODE and HIGH in ascending order, with LOW below HIGH")?;
        Ok(Self(Law::Triangular { low, mode, high }))
    }

    /// Distribution of measured values. Its quantile function is linear between the values in ascending order: value k of n has
    /// the probability (k - 1) / (n - 1) (Hyndman & Fan 1996, "Sample quantiles in statistical packages", definition 7). Its
    /// support is the measured range.
    ///
    /// # Errors
    /// No values, or a value that is not finite.
    pub fn measured(values: &[f64]) -> Result<Self, DistributionError> {
        check(!values.is_empty(), "a measured distribution needs at least one value")?;
        check_finite(values)?;
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        Ok(Self(Law::Measured(sorted)))
    }

    /// Parses a value, `uniform(LOW, HIGH)`, `normal(MEAN, SD)`, `normal(MEAN, SD, LOW..HIGH)`, `triangular(LOW, MODE, HIGH)`,
    /// `measured(VALUE, …)` or a fit such as `H7/g6`. `number` parses a value with its unit and returns it in SI. `parse_fit`
    /// parses a fit and returns the resulting distribution of the parameter ([`crate::iso286::Fit::radial_clearance`]), because
    /// only the caller knows the nominal size.
    ///
    /// # Errors
    /// A text of another form, a number or fit that the caller rejects, or numbers that do not define a distribution.
    pub fn parse<E: Display>(
        text: &str,
        number: impl Fn(&str) -> Result<f64, E>,
        parse_fit: impl FnOnce(&str) -> Result<Self, E>,
    ) -> Result<Self, DistributionError> {
        let given = || text.to_owned();
        let read = |part: &str| {
            let part = part.trim();
            number(part).map_err(|reason| DistributionError::Number {
                text: given(),
                part: part.to_owned(),
                reason: reason.to_string(),
            })
        };
        let invalid_form = || DistributionError::Form { text: given() };
        let trimmed = text.trim();
        let Some((name, rest)) = trimmed.split_once('(') else {
            if trimmed.contains('/') && !trimmed.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) {
                return parse_fit(trimmed)
                    .map_err(|reason| DistributionError::Fit { text: given(), reason: reason.to_string() });
            }
            // A word without parentheses is a form whose numbers are missing, not a number.
            return if trimmed.starts_with(char::is_alphabetic) || trimmed.is_empty() {
                Err(invalid_form())
            } else {
                Self::constant(read(trimmed)?)
            };
        };
        let inside = rest.strip_suffix(')').ok_or_else(invalid_form)?;
        let parts: Vec<&str> = inside.split(',').map(str::trim).collect();
        match (name.trim(), parts.as_slice()) {
            ("uniform", [low, high]) => Self::uniform(read(low)?, read(high)?),
            ("normal", [mean, deviation]) => Self::normal(read(mean)?, read(deviation)?),
            ("normal", [mean, deviation, limits]) => {
                let (low, high) = limits.split_once("..").ok_or_else(invalid_form)?;
                Self::truncated_normal(read(mean)?, read(deviation)?, read(low)?, read(high)?)
            }
            ("triangular", [low, mode, high]) => Self::triangular(read(low)?, read(mode)?, read(high)?),
            ("measured", values) => {
                let values: Result<Vec<f64>, _> = values.iter().map(|value| read(value)).collect();
                Self::measured(&values?)
            }
            _ => Err(invalid_form()),
        }
    }

    /// The value below which the fraction `u` of all values lies, for `u` in (0, 1). At 0 and 1 the quantile of an unbounded
    /// distribution is infinite.
    pub fn quantile(&self, u: f64) -> f64 {
        match self.0 {
            Law::Constant(value) => value,
            Law::Uniform { low, high } => (low * (1.0 - u) + high * u).clamp(low, high),
            Law::Normal { mean, deviation } => mean + deviation * quantile(u),
            Law::Truncated { mean, deviation, low, high } => {
                let (z_low, z_high) = ((low - mean) / deviation, (high - mean) / deviation);
                // Limits above the mean are mirrored to the lower tail, where small probabilities keep their relative
                // precision.
                let z = if z_low > 0.0 {
                    let (upper, lower) = (cumulative(-z_low), cumulative(-z_high));
                    -quantile(upper - (upper - lower) * u)
                } else {
                    let (lower, upper) = (cumulative(z_low), cumulative(z_high));
                    quantile(lower + (upper - lower) * u)
                };
                (mean + deviation * z).clamp(low, high)
            }
            Law::Triangular { low, mode, high } => {
                let (rising, falling, width) = (mode - low, high - mode, high - low);
                if u * width < rising {
                    low + (u * width * rising).sqrt()
                } else {
                    high - ((1.0 - u) * width * falling).max(0.0).sqrt()
                }
            }
            Law::Measured(ref sorted) => interpolated_quantile(sorted, u),
        }
    }

    /// Smallest and largest possible value; infinite for a normal distribution.
    pub fn support(&self) -> (f64, f64) {
        match self.0 {
            Law::Constant(value) => (value, value),
            Law::Normal { .. } => (f64::NEG_INFINITY, f64::INFINITY),
            Law::Uniform { low, high } | Law::Truncated { low, high, .. } | Law::Triangular { low, high, .. } => {
                (low, high)
            }
            Law::Measured(ref sorted) => (sorted[0], sorted[sorted.len() - 1]),
        }
    }
}

fn check(is_valid: bool, message: &'static str) -> Result<(), DistributionError> {
    if is_valid { Ok(()) } else { Err(DistributionError::Values(message)) }
}

fn check_finite(values: &[f64]) -> Result<(), DistributionError> {
    check(values.iter().all(|value| value.is_finite()), "a distribution takes finite numbers")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parses a number of micrometres.
    fn number(text: &str) -> Result<f64, String> {
        let bare = text.strip_suffix("um").ok_or("needs the unit um")?;
        bare.trim().parse().map_err(|_| "not a number".to_owned())
    }

    fn parse(text: &str) -> Result<Distribution, DistributionError> {
        Distribution::parse(text, number, |fit| match fit {
            "H7/g6" => Distribution::uniform(7.0, 41.0).map_err(|error| error.to_string()),
            _ => Err("unknown fit".to_owned()),
        })
    }

    #[test]
    fn texts_are_parsed_as_the_distributions_they_name() {
        assert_eq!(parse(" 20 um").unwrap(), Distribution::constant(20.0).unwrap());
        assert_eq!(parse("uniform(10 um, 30 um)").unwrap(), Distribution::uniform(10.0, 30.0).unwrap());
        assert_eq!(parse("normal(20um,3um)").unwrap(), Distribution::normal(20.0, 3.0).unwrap());
        let truncated = Distribution::truncated_normal(20.0, 3.0, 10.0, 30.0).unwrap();
        assert_eq!(parse("normal(20 um, 3 um, 10 um..30 um)").unwrap(), truncated);
        assert_eq!(parse("triangular(1 um, 2 um, 4 um)").unwrap(), Distribution::triangular(1.0, 2.0, 4.0).unwrap());
        assert_eq!(parse("measured(3 um, 1 um, 2 um)").unwrap(), Distribution::measured(&[1.0, 2.0, 3.0]).unwrap());
        assert_eq!(parse(" H7/g6 ").unwrap(), Distribution::uniform(7.0, 41.0).unwrap());
    }

    #[test]
    fn errors_quote_the_text_and_the_invalid_part() {
        let error = |text| parse(text).unwrap_err().to_string();
        assert_eq!(error("uniform(10 um, 30)"), "`uniform(10 um, 30)`: 30: needs the unit um");
        assert!(error("uniform(10 um)").starts_with("`uniform(10 um)` is not a distribution: expected a value"));
        assert!(error("normal(1 um, 2 um, 3 um)").contains("is not a distribution"));
        for text in ["uniform", "uniform(1 um, 2 um", "gauss(1 um)", "", "measured()", "(1 um)"] {
            assert!(parse(text).is_err(), "{text}");
        }
        assert!(error("uniform(3 um, 1 um)").contains("must be below"));
        assert!(error("normal(3 um, 0 um)").contains("above 0"));
        assert!(error("normal(0 um, 1 um, 40 um..41 um)").contains("too many standard deviations"));
        assert_eq!(error("H7/y99"), "`H7/y99`: unknown fit");
        assert!(Distribution::uniform(f64::NAN, 1.0).is_err());
    }

    /// Mean and standard deviation by the midpoint rule over 200 000 quantiles.
    fn moments(distribution: &Distribution) -> (f64, f64) {
        let n = 200_000;
        let values = || (0..n).map(|i| distribution.quantile((f64::from(i) + 0.5) / f64::from(n)));
        let mean = values().sum::<f64>() / f64::from(n);
        (mean, (values().map(|x| (x - mean).powi(2)).sum::<f64>() / f64::from(n)).sqrt())
    }

    #[test]
    fn quantiles_reproduce_the_moments_of_their_distribution() {
        let density = |z: f64| libm::exp(-0.5 * z * z) / (2.0 * std::f64::consts::PI).sqrt();
        // Truncated to two standard deviations below and one above (Johnson, Kotz & Balakrishnan 1994, section 13.10.1).
        let mass = cumulative(1.0) - cumulative(-2.0);
        let shift = (density(-2.0) - density(1.0)) / mass;
        let variance = 1.0 + (-2.0 * density(-2.0) - density(1.0)) / mass - shift * shift;
        let cases = [
            (Distribution::uniform(1.0, 3.0), 2.0, 2.0 / 12_f64.sqrt()),
            (Distribution::normal(20.0, 3.0), 20.0, 3.0),
            (Distribution::truncated_normal(20.0, 3.0, 14.0, 23.0), 20.0 + 3.0 * shift, 3.0 * variance.sqrt()),
            (Distribution::triangular(0.0, 1.0, 5.0), 2.0, (21.0_f64 / 18.0).sqrt()),
            (Distribution::triangular(0.0, 0.0, 3.0), 1.0, 0.5_f64.sqrt()),
            (Distribution::measured(&[0.0, 1.0]), 0.5, 1.0 / 12_f64.sqrt()),
            (Distribution::constant(4.0), 4.0, 0.0),
        ];
        for (distribution, mean, deviation) in cases {
            let distribution = distribution.unwrap();
            let (computed_mean, computed_deviation) = moments(&distribution);
            // The midpoint rule misses the outermost tails of the normal distribution.
            assert!(
                (computed_mean - mean).abs() < 1e-5 && (computed_deviation - deviation).abs() < 2e-3,
                "{distribution:?}"
            );
        }
    }

    #[test]
    fn quantiles_increase_within_the_support_even_in_a_far_tail() {
        for (low, high) in [(30.0, 31.0), (-31.0, -30.0), (-1.0, 8.0)] {
            let distribution = Distribution::truncated_normal(0.0, 1.0, low, high).unwrap();
            let values: Vec<f64> = (1..1000).map(|i| distribution.quantile(f64::from(i) / 1000.0)).collect();
            assert!(values.windows(2).all(|pair| pair[0] < pair[1]) && values[0] >= low && values[998] <= high);
        }
        let measured = Distribution::measured(&[5.0, 1.0, 3.0]).unwrap();
        assert_eq!([0.0, 0.25, 0.5, 0.75, 1.0].map(|u| measured.quantile(u)), [1.0, 2.0, 3.0, 4.0, 5.0]);
    }
}
