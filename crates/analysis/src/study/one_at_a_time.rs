//! One-at-a-time runs: the effect of each parameter alone.

use super::StudyError;
use super::inputs::{Input, check_count, check_end, real_parameter};
use super::runner::StudyRunner;
use crate::distribution::Distribution;
use jointplay_scene::Scene;

/// Probabilities whose quantiles serve as the ends of a distribution without limits.
pub const ENDS: [f64; 2] = [0.025, 0.975];

/// Plan of the one-at-a-time runs: each input at the lower and at the upper end of its distribution, with all others at their
/// values in the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct OneAtATimePlan {
    nominal: Vec<f64>,
    ends: Vec<[f64; 2]>,
}

impl OneAtATimePlan {
    /// A plan for `inputs`. Its ends are the limits of each distribution, or the [`ENDS`] quantiles where there is no limit.
    pub fn new(inputs: &[Input]) -> Self {
        let ends = inputs.iter().map(|input| {
            let (low, high) = input.distribution.support();
            let [lower, upper] = ENDS.map(|u| input.at(u));
            [if low.is_finite() { low } else { lower }, if high.is_finite() { high } else { upper }]
        });
        Self { nominal: inputs.iter().map(|input| input.nominal).collect(), ends: ends.collect() }
    }

    /// A plan for parameters of `scene`, given by key with lower and upper end, SI. It does not parse distributions, so that
    /// the web page need not contain the parser.
    ///
    /// # Errors
    /// With the key: no such real parameter, an end that the parameter does not accept, or a lower end that is not below the
    /// upper one. More than 64 parameters.
    pub fn between(scene: &Scene, ranges: &[(String, [f64; 2])]) -> Result<Self, StudyError> {
        check_count(ranges.len())?;
        let nominal = ranges.iter().map(|(key, [low, high])| {
            let checked = || {
                let (parameter, nominal) = real_parameter(scene, key)?;
                Distribution::uniform(*low, *high)?;
                check_end(parameter, *low)?;
                check_end(parameter, *high)?;
                Ok(nominal)
            };
            checked().map_err(|error: StudyError| error.at(key))
        });
        Ok(Self { nominal: nominal.collect::<Result<_, _>>()?, ends: ranges.iter().map(|(_, ends)| *ends).collect() })
    }

    /// Value of each input in the scene, SI.
    pub fn nominal(&self) -> &[f64] {
        &self.nominal
    }

    /// Lower and upper end of each input, SI.
    pub fn ends(&self) -> &[[f64; 2]] {
        &self.ends
    }

    /// Values of all inputs in each run, SI. The first run has the values of the scene; two runs for each input follow, at its
    /// lower and at its upper end.
    pub fn rows(&self) -> Vec<Vec<f64>> {
        let mut rows = vec![self.nominal.clone()];
        for (i, ends) in self.ends.iter().enumerate() {
            for end in ends {
                let mut row = self.nominal.clone();
                row[i] = *end;
                rows.push(row);
            }
        }
        rows
    }
}

/// Outputs of the one-at-a-time runs, SI.
#[derive(Clone, Debug, PartialEq)]
pub struct OneAtATimeOutputs {
    /// Outputs with the values of the scene.
    pub nominal: Vec<f64>,
    /// Lower and upper end of each parameter, with the outputs of these runs.
    pub ends: Vec<[(f64, Vec<f64>); 2]>,
    /// Outputs with all parameters at their lower ends, and at their upper ends.
    pub together: [Vec<f64>; 2],
}

impl OneAtATimeOutputs {
    /// Executes the runs.
    ///
    /// # Errors
    /// As [`StudyRunner::run`].
    pub(super) fn compute<R: StudyRunner>(runner: &mut R) -> Result<Self, R::Error> {
        let plan = OneAtATimePlan::new(runner.inputs());
        let mut rows = plan.rows();
        rows.extend([0, 1].map(|end| plan.ends().iter().map(|ends| ends[end]).collect()));
        let mut results = runner.run("alone", rows)?.into_iter();
        let mut next = || results.next().unwrap_or_default();
        let nominal = next();
        let ends = plan.ends().iter().map(|ends| ends.map(|end| (end, next()))).collect();
        Ok(Self { nominal, ends, together: [next(), next()] })
    }
}
