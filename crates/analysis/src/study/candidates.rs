//! Candidate distributions of parameters, with costs.

use super::{Input, StudyError, matching};
use crate::distribution::Distribution;
use jointplay_scene::Scene;

/// Widths that differ less, relatively, are the same.
const ROUNDING: f64 = 1e-9;

/// A candidate as requested.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CandidateRequest {
    /// Option, or file with line, for messages.
    pub place: String,
    /// A key, or a pattern that stands for all numeric parameters that it matches.
    pub pattern: String,
    /// The distribution, as written: `H7/g6`.
    pub distribution: String,
    /// Its cost, as written.
    pub cost: String,
}

/// A distribution that a parameter may have.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// As written: `H7/g6`.
    pub text: String,
    /// SI.
    pub distribution: Distribution,
    /// In any currency, at least 0.
    pub cost: f64,
}

/// The candidates of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidates {
    /// Index of the parameter.
    pub input: usize,
    /// Loosest first.
    pub list: Vec<Candidate>,
}

/// The candidates of `requested`, in order, for parameters of `scene` that `inputs` has.
///
/// # Errors
/// With its place: a parameter that is none of `inputs`, a distribution that it does not accept, no cost, or a candidate wider than
/// the one before it.
pub fn candidates(
    scene: &Scene,
    inputs: &[Input],
    requested: &[CandidateRequest],
) -> Result<Vec<Candidates>, StudyError> {
    let mut all: Vec<Candidates> = Vec::new();
    for CandidateRequest { place, pattern, distribution: text, cost } in requested {
        let wrong = |error: StudyError| error.at(place);
        let is_cost = |cost: &f64| cost.is_finite() && *cost >= 0.0;
        let cost = cost.parse::<f64>().ok().filter(is_cost);
        let cost = cost.ok_or_else(|| wrong(StudyError::NoCost.at(pattern)))?;
        for key in matching(scene, pattern).map_err(wrong)? {
            let of_key = |error: StudyError| wrong(error.at(&key));
            let input = inputs.iter().position(|input| input.key == key);
            let input = input.ok_or_else(|| of_key(StudyError::NoDistribution))?;
            let own = Input::new(scene, &key, Some(text)).map_err(of_key)?;
            let candidate = Candidate { text: text.clone(), distribution: own.distribution, cost };
            let Some(own) = all.iter_mut().find(|own| own.input == input) else {
                all.push(Candidates { input, list: vec![candidate] });
                continue;
            };
            let looser = own.list.last().and_then(Candidate::width).zip(candidate.width());
            if looser.is_some_and(|(before, width)| width > before * (1.0 + ROUNDING)) {
                return Err(of_key(StudyError::Wider { text: text.clone() }));
            }
            own.list.push(candidate);
        }
    }
    Ok(all)
}

impl Candidate {
    /// Distance of its limits; `None` without limits.
    fn width(&self) -> Option<f64> {
        let (low, high) = self.distribution.support();
        Some(high - low).filter(|width| width.is_finite())
    }
}

impl Candidates {
    /// Whether the widths of all candidates are known to be in order.
    pub fn is_ordered(&self) -> bool {
        self.list.len() < 2 || self.list.iter().all(|candidate| candidate.width().is_some())
    }
}
