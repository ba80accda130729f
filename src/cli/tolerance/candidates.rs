//! Candidate distributions of parameters, with costs.

use std::path::Path;

use crate::analysis::distribution::Distribution;
use crate::analysis::study::{Input, matching};
use crate::cli::Failure;
use crate::cli::study::{Row, rows};
use crate::scene::Scene;

/// A candidate.
pub struct Candidate {
    /// As written: `H7/g6`.
    pub text: String,
    pub distribution: Distribution,
    pub cost: f64,
}

/// The candidates of a parameter.
pub struct Candidates {
    /// Index of the parameter.
    pub input: usize,
    /// Loosest first.
    pub list: Vec<Candidate>,
}

/// Widths that differ less, relatively, are the same.
const ROUNDING: f64 = 1e-9;

/// Reads the file `--cost`: in each row a key or pattern, a distribution and its cost.
///
/// # Errors
/// Usage, with the line: a parameter that is none of `inputs`, a distribution that it does not accept, no cost, or a candidate
/// wider than the one before it. Input/output: an unreadable file.
pub fn read(scene: &Scene, inputs: &[Input], path: &Path) -> Result<Vec<Candidates>, Failure> {
    let mut all: Vec<Candidates> = Vec::new();
    for Row { place, cells: [pattern, text, cost] } in rows("--cost", path, ["parameter", "fit", "cost"])? {
        let wrong = |what: String| Failure::usage(format!("{place}: {what}"));
        let is_cost = |cost: &f64| cost.is_finite() && *cost >= 0.0;
        let cost = cost.parse::<f64>().ok().filter(is_cost);
        let cost = cost.ok_or_else(|| wrong(format!("{pattern}: expected a cost, a finite number of at least 0")))?;
        for key in matching(scene, &pattern).map_err(|error| wrong(error.to_string()))? {
            let none = || wrong(format!("{key}: give the parameter a distribution in --tolerances or --over, too"));
            let input = inputs.iter().position(|input| input.key == key).ok_or_else(none)?;
            let of_key = Input::new(scene, &key, Some(&text)).map_err(|error| wrong(format!("{key}: {error}")))?;
            let candidate = Candidate { text: text.clone(), distribution: of_key.distribution, cost };
            let Some(own) = all.iter_mut().find(|own| own.input == input) else {
                all.push(Candidates { input, list: vec![candidate] });
                continue;
            };
            let looser = own.list.last().and_then(Candidate::width).zip(candidate.width());
            if looser.is_some_and(|(before, width)| width > before * (1.0 + ROUNDING)) {
                let order = "list the candidates of a parameter from the loosest to the tightest";
                return Err(wrong(format!("{key}: {text} is wider than the candidate before it; {order}")));
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
