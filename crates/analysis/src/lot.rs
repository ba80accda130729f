//! A lot of units, each represented by a run: which of them are within their limits, and how their outputs are distributed.

use super::yields::{Capability, Estimate, YieldsError, capability, mean_and_deviation, percentile, yield_fraction};

/// Confidence level of all intervals.
const CONFIDENCE: f64 = 0.95;
/// Percentiles of each output.
pub const PERCENTILES: [f64; 3] = [0.5, 0.95, 0.99];

/// Limits of an output, SI; at least one is set.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    /// Lower limit.
    pub lower: Option<f64>,
    /// Upper limit.
    pub upper: Option<f64>,
}

impl Limit {
    /// Whether `value` is within the limits; NaN is not.
    pub fn holds(&self, value: f64) -> bool {
        !value.is_nan()
            && self.lower.is_none_or(|lower| value >= lower)
            && self.upper.is_none_or(|upper| value <= upper)
    }
}

/// A lot of units with their outputs.
#[derive(Clone, Debug, PartialEq)]
pub struct Lot {
    /// Outputs of each unit, in the order of the limits, SI; NaN if the run has no result.
    pub outputs: Vec<Vec<f64>>,
    /// Whether each unit is within all limits.
    pub accepted: Vec<bool>,
    /// Yield: fraction of the units within all limits.
    pub yield_estimate: Estimate,
}

/// Statistics of a limited output.
#[derive(Clone, Debug, PartialEq)]
pub struct Quality {
    /// Fraction of all units within this output's limits.
    pub yield_estimate: Estimate,
    /// Mean of the units with a result, SI.
    pub mean: f64,
    /// Standard deviation of these units, SI.
    pub deviation: f64,
    /// Estimates of the [`PERCENTILES`], SI; `None` without results.
    pub percentiles: Vec<Option<Estimate>>,
    /// Process capability; `None` without spread.
    pub capability: Option<Capability>,
}

impl Lot {
    /// A lot from the outputs of its units, each in the order of `limits`.
    ///
    /// # Errors
    /// No units.
    pub fn new(outputs: Vec<Vec<f64>>, limits: &[Limit]) -> Result<Self, YieldsError> {
        let holds_all = |outputs: &Vec<f64>| limits.iter().zip(outputs).all(|(limit, &value)| limit.holds(value));
        let accepted: Vec<bool> = outputs.iter().map(holds_all).collect();
        Ok(Self { yield_estimate: fraction_of(&accepted)?, outputs, accepted })
    }

    /// Statistics of output `o` with its limits `limit`.
    ///
    /// # Errors
    /// No units.
    pub fn quality(&self, o: usize, limit: &Limit) -> Result<Quality, YieldsError> {
        let accepted: Vec<bool> = self.outputs.iter().map(|outputs| limit.holds(outputs[o])).collect();
        let values = self.outputs.iter().map(|outputs| outputs[o]);
        let values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
        let (mean, deviation) = mean_and_deviation(&values);
        Ok(Quality {
            yield_estimate: fraction_of(&accepted)?,
            mean,
            deviation,
            percentiles: PERCENTILES.iter().map(|&p| percentile(&values, p, CONFIDENCE).ok()).collect(),
            capability: capability(&values, limit.lower, limit.upper, CONFIDENCE).ok(),
        })
    }
}

fn fraction_of(accepted: &[bool]) -> Result<Estimate, YieldsError> {
    yield_fraction(accepted.iter().filter(|accepted| **accepted).count(), accepted.len(), CONFIDENCE)
}
