//! Runs that show the effect of each parameter alone.

use super::Input;

/// Fractions of all values taken for the ends of a distribution without limits.
pub const ENDS: [f64; 2] = [0.025, 0.975];

/// Every input at the lower and at the upper end of its distribution, the others at their values in the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Alone {
    nominal: Vec<f64>,
    ends: Vec<[f64; 2]>,
}

impl Alone {
    /// The ends of `inputs`: the limits of each distribution, or its [`ENDS`] quantiles where it has none.
    pub fn new(inputs: &[Input]) -> Self {
        let ends = inputs.iter().map(|input| {
            let (low, high) = input.distribution.support();
            let [lower, upper] = ENDS.map(|u| input.at(u));
            [if low.is_finite() { low } else { lower }, if high.is_finite() { high } else { upper }]
        });
        Self { nominal: inputs.iter().map(|input| input.nominal).collect(), ends: ends.collect() }
    }

    /// Lower and upper end of each input, SI.
    pub fn ends(&self) -> &[[f64; 2]] {
        &self.ends
    }

    /// Values of all inputs in each run, SI: the values in the scene, then for each input its lower and its upper end.
    pub fn rows(&self) -> Vec<Vec<f64>> {
        let mut rows = vec![self.nominal.clone()];
        for (i, own) in self.ends.iter().enumerate() {
            for end in own {
                let mut row = self.nominal.clone();
                row[i] = *end;
                rows.push(row);
            }
        }
        rows
    }
}
