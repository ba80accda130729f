//! How far parameters must go from their values in the scene for an output to stay below a target.

use crate::analysis::indices::{IndicesError, SensitivityIndices};
use crate::analysis::study::Output;
use crate::cli::Failure;
use crate::cli::study::Study;

use super::Alone;

/// Values tried between that of the scene and the better end.
const STEPS: usize = 8;

/// A change that was run: parameter, value, SI, and the output there.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    pub input: usize,
    pub value: f64,
}

/// What was found.
pub struct Answer {
    pub target: f64,
    /// Single changes that suffice, each the smallest tried, with the output there.
    pub single: Vec<(Change, f64)>,
    /// Where none does: all of these changes together, in order of effect, and the output with them.
    pub together: Option<(Vec<Change>, f64)>,
}

/// Reads `--target` in the unit of `output`.
///
/// # Errors
/// Usage: no such quantity.
pub fn read(output: &Output, text: &str) -> Result<f64, Failure> {
    output.read(text).map_err(|error| Failure::usage(format!("--target {text}: {error}")))
}

/// Tries each parameter alone in equal steps towards its better end; if none suffices, all of them, one after the other to its
/// better end, in order of their total indices, or of their effects alone, and the last one only as far as needed.
///
/// # Errors
/// As [`Study::run`].
pub fn answer(
    study: &mut Study,
    alone: &Alone,
    indices: &[Option<Result<SensitivityIndices, IndicesError>>],
    kept: &[usize],
    target: f64,
) -> Result<Answer, Failure> {
    let nominal: Vec<f64> = study.inputs().iter().map(|input| input.nominal).collect();
    let inputs = nominal.len();
    let better = |i: usize| {
        let [(low, at_low), (high, at_high)] = &alone.ends[i];
        if at_high[0] < at_low[0] { (*high, at_high[0]) } else { (*low, at_low[0]) }
    };
    let towards = |i: usize, step: usize| nominal[i] + (better(i).0 - nominal[i]) * step as f64 / STEPS as f64;
    if alone.nominal[0] <= target {
        return Ok(Answer { target, single: Vec::new(), together: Some((Vec::new(), alone.nominal[0])) });
    }
    let mut rows = Vec::new();
    for i in 0..inputs {
        for step in 1..=STEPS {
            let mut row = nominal.clone();
            row[i] = towards(i, step);
            rows.push(row);
        }
    }
    let results = study.run("target", rows.clone())?;
    let mut single = Vec::new();
    for i in 0..inputs {
        let first = (0..STEPS).map(|step| i * STEPS + step).find(|&run| results[run][0] <= target);
        if let Some(run) = first {
            single.push((Change { input: i, value: rows[run][i] }, results[run][0]));
        }
    }
    if !single.is_empty() {
        return Ok(Answer { target, single, together: None });
    }
    let effect = |i: usize| alone.nominal[0] - better(i).1;
    let total = |i: usize| match &indices[0] {
        Some(Ok(found)) => kept.iter().position(|&k| k == i).map_or(0.0, |at| found.total[at].value),
        _ => effect(i),
    };
    let mut order: Vec<usize> = (0..inputs).filter(|&i| effect(i) > 0.0).collect();
    order.sort_by(|&a, &b| total(b).total_cmp(&total(a)).then(effect(b).total_cmp(&effect(a))));
    let mut rows = Vec::new();
    let mut moved = nominal.clone();
    for &i in &order {
        for step in 1..=STEPS {
            let mut row = moved.clone();
            row[i] = towards(i, step);
            rows.push(row);
        }
        moved[i] = towards(i, STEPS);
    }
    let results = if rows.is_empty() { Vec::new() } else { study.run("target-together", rows.clone())? };
    let together = results.iter().position(|outputs| outputs[0] <= target).map(|run| {
        let changed = order.iter().filter(|&&i| rows[run][i] != nominal[i]);
        let changes = changed.map(|&input| Change { input, value: rows[run][input] }).collect();
        (changes, results[run][0])
    });
    Ok(Answer { target, single, together })
}
