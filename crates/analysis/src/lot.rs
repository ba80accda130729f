//! A lot of units made alike, each with a run: which of them hold their limits, and how their outputs are distributed.

use super::yields::{Capability, Estimate, YieldsError, capability, mean_and_deviation, percentile, yield_fraction};

/// Probability of all confidence intervals.
const CONFIDENCE: f64 = 0.95;
/// Percentiles of each output.
pub const PERCENTILES: [f64; 3] = [0.5, 0.95, 0.99];

/// Limits of an output, SI; one of them at least.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    /// Lower limit.
    pub lower: Option<f64>,
    /// Upper limit.
    pub upper: Option<f64>,
}

impl Limit {
    /// Whether `value` is within; NaN is not.
    pub fn holds(&self, value: f64) -> bool {
        !value.is_nan()
            && self.lower.is_none_or(|lower| value >= lower)
            && self.upper.is_none_or(|upper| value <= upper)
    }
}

/// Units made alike: a run of each.
#[derive(Clone, Debug, PartialEq)]
pub struct Lot {
    /// Values of the limited outputs of each unit, SI; NaN without a result.
    pub outputs: Vec<Vec<f64>>,
    /// Whether each unit holds all limits.
    pub accepted: Vec<bool>,
    /// Part of the units that holds all limits.
    pub yielded: Estimate,
}

/// Statistics of a limited output.
#[derive(Clone, Debug, PartialEq)]
pub struct Quality {
    /// Part of all units that holds this limit.
    pub yielded: Estimate,
    /// Mean of the units with a result, SI.
    pub mean: f64,
    /// Their standard deviation, SI.
    pub deviation: f64,
    /// For each of [`PERCENTILES`], SI; `None` without results.
    pub percentiles: Vec<Option<Estimate>>,
    /// `None` without a spread.
    pub capability: Option<Capability>,
}

impl Lot {
    /// The lot with these outputs of each unit, in the order of `limits`.
    ///
    /// # Errors
    /// No units.
    pub fn new(outputs: Vec<Vec<f64>>, limits: &[Limit]) -> Result<Self, YieldsError> {
        let holds_all = |outputs: &Vec<f64>| limits.iter().zip(outputs).all(|(limit, &value)| limit.holds(value));
        let accepted: Vec<bool> = outputs.iter().map(holds_all).collect();
        Ok(Self { yielded: part(&accepted)?, outputs, accepted })
    }

    /// Statistics of output `o`, whose limit is `limit`.
    ///
    /// # Errors
    /// No units.
    pub fn quality(&self, o: usize, limit: &Limit) -> Result<Quality, YieldsError> {
        let held: Vec<bool> = self.outputs.iter().map(|outputs| limit.holds(outputs[o])).collect();
        let values = self.outputs.iter().map(|outputs| outputs[o]);
        let values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
        let (mean, deviation) = mean_and_deviation(&values);
        Ok(Quality {
            yielded: part(&held)?,
            mean,
            deviation,
            percentiles: PERCENTILES.iter().map(|&p| percentile(&values, p, CONFIDENCE).ok()).collect(),
            capability: capability(&values, limit.lower, limit.upper, CONFIDENCE).ok(),
        })
    }
}

fn part(accepted: &[bool]) -> Result<Estimate, YieldsError> {
    yield_fraction(accepted.iter().filter(|accepted| **accepted).count(), accepted.len(), CONFIDENCE)
}
