//! Candidate distributions of parameters, with their costs.

use super::{Input, StudyError, matching};
use crate::distribution::Distribution;
use jointplay_scene::Scene;

/// Relative difference below which two widths are equal.
const ROUNDING: f64 = 1e-9;

/// A candidate as requested.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CandidateRequest {
    /// Option, or file with line, for messages.
    pub place: String,
    /// A key, or a pattern for all numeric parameters that it matches.
    pub pattern: String,
    /// The distribution as given, such as `H7/g6`.
    pub distribution: String,
    /// The cost as given.
    pub cost: String,
}

/// A distribution that a parameter may have.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Text as given, such as `H7/g6`.
    pub text: String,
    /// Distribution, SI.
    pub distribution: Distribution,
    /// Cost in any currency, at least 0.
    pub cost: f64,
}

/// The candidates of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidates {
    /// Index of the parameter.
    pub input: usize,
    /// The candidates, loosest first.
    pub list: Vec<Candidate>,
}

/// Resolves the `requested` candidates, in order, for those parameters of `scene` that are among `inputs`.
///
/// # Errors
/// With the place: a parameter that is not among `inputs`, a distribution that it does not accept, no cost, or a candidate
/// wider than the previous one.
pub fn candidates(
    scene: &Scene,
    inputs: &[Input],
    requested: &[CandidateRequest],
) -> Result<Vec<Candidates>, StudyError> {
    let mut all: Vec<Candidates> = Vec::new();
    for CandidateRequest { place, pattern, distribution: text, cost } in requested {
        let at_place = |error: StudyError| error.at(place);
        let is_cost = |cost: &f64| cost.is_finite() && *cost >= 0.0;
        let cost = cost.parse::<f64>().ok().filter(is_cost);
        let cost = cost.ok_or_else(|| at_place(StudyError::NoCost.at(pattern)))?;
        for key in matching(scene, pattern).map_err(at_place)? {
            let at_key = |error: StudyError| at_place(error.at(&key));
            let input = inputs.iter().position(|input| input.key == key);
            let input = input.ok_or_else(|| at_key(StudyError::NoDistribution))?;
            let distribution = Input::new(scene, &key, Some(text)).map_err(at_key)?.distribution;
            let candidate = Candidate { text: text.clone(), distribution, cost };
            let Some(candidates) = all.iter_mut().find(|candidates| candidates.input == input) else {
                all.push(Candidates { input, list: vec![candidate] });
                continue;
            };
            let looser = candidates.list.last().and_then(Candidate::width).zip(candidate.width());
            if looser.is_some_and(|(before, width)| width > before * (1.0 + ROUNDING)) {
                return Err(at_key(StudyError::Wider { text: text.clone() }));
            }
            candidates.list.push(candidate);
        }
    }
    Ok(all)
}

impl Candidate {
    /// Distance between the limits of the distribution; `None` without limits.
    fn width(&self) -> Option<f64> {
        let (low, high) = self.distribution.support();
        Some(high - low).filter(|width| width.is_finite())
    }
}

impl Candidates {
    /// Whether all candidates are known to be in order of width.
    pub fn is_ordered(&self) -> bool {
        self.list.len() < 2 || self.list.iter().all(|candidate| candidate.width().is_some())
    }
}
