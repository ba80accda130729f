//! Changes of parameters that bring an output down to a target.

use super::{OneAtATimeOutputs, StudyRunner};
use crate::indices::SensitivityIndices;

/// Number of steps from the value in the scene to the better end.
const STEPS: usize = 8;

/// A changed parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// Index of the parameter.
    pub input: usize,
    /// Its value, SI.
    pub value: f64,
}

/// Changes after which the first output is at most the target, each confirmed by a run. Outputs are SI.
#[derive(Clone, Debug, PartialEq)]
pub struct TargetAnswer {
    /// The target.
    pub target: f64,
    /// Single changes that suffice, each the smallest that was tried, with the resulting output.
    pub single: Vec<(Change, f64)>,
    /// If no single change suffices: changes that suffice together, in order of effect, with the resulting output.
    pub together: Option<(Vec<Change>, f64)>,
}

/// Moves each parameter alone in equal steps towards its better end. If no single change suffices, it moves the parameters to
/// their better ends one after another, and the last one only as far as needed. Their order is that of their total indices in
/// `indices`, whose parameters are `kept`, or without indices that of their effects alone.
///
/// # Errors
/// As [`StudyRunner::run`].
pub(super) fn answer<R: StudyRunner>(
    runner: &mut R,
    alone: &OneAtATimeOutputs,
    indices: Option<&SensitivityIndices>,
    kept: &[usize],
    target: f64,
) -> Result<TargetAnswer, R::Error> {
    let nominal: Vec<f64> = runner.inputs().iter().map(|input| input.nominal).collect();
    let inputs = nominal.len();
    let better = |i: usize| {
        let [(low, at_low), (high, at_high)] = &alone.ends[i];
        if at_high[0] < at_low[0] { (*high, at_high[0]) } else { (*low, at_low[0]) }
    };
    let towards = |i: usize, step: usize| nominal[i] + (better(i).0 - nominal[i]) * step as f64 / STEPS as f64;
    if alone.nominal[0] <= target {
        return Ok(TargetAnswer { target, single: Vec::new(), together: Some((Vec::new(), alone.nominal[0])) });
    }
    let mut rows = Vec::new();
    for i in 0..inputs {
        for step in 1..=STEPS {
            let mut row = nominal.clone();
            row[i] = towards(i, step);
            rows.push(row);
        }
    }
    let results = runner.run("target", rows.clone())?;
    let mut single = Vec::new();
    for i in 0..inputs {
        let first = (0..STEPS).map(|step| i * STEPS + step).find(|&run| results[run][0] <= target);
        if let Some(run) = first {
            single.push((Change { input: i, value: rows[run][i] }, results[run][0]));
        }
    }
    if !single.is_empty() {
        return Ok(TargetAnswer { target, single, together: None });
    }
    let effect = |i: usize| alone.nominal[0] - better(i).1;
    let total = |i: usize| match indices {
        Some(indices) => kept.iter().position(|&k| k == i).map_or(0.0, |position| indices.total[position].value),
        None => effect(i),
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
    let results = if rows.is_empty() { Vec::new() } else { runner.run("target-together", rows.clone())? };
    let together = results.iter().position(|outputs| outputs[0] <= target).map(|run| {
        let changed = order.iter().filter(|&&i| rows[run][i] != nominal[i]);
        let changes = changed.map(|&input| Change { input, value: rows[run][input] }).collect();
        (changes, results[run][0])
    });
    Ok(TargetAnswer { target, single, together })
}
