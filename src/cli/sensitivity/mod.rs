//! `sensitivity`: which parameters move an output most, each alone and all together, and how far one must go to reach a target.

mod picture;
mod report;
mod target;

use super::args::{SensitivityArguments, SummaryForm};
use super::study::{Study, inputs, outputs};
use super::{Failure, load, print, warn};
use crate::analysis::indices::{Bootstrap, IndicesError, LEAST_ROWS, SaltelliDesign, SensitivityIndices};
use crate::analysis::morris::{ElementaryEffects, MorrisPlan};
use crate::analysis::sampling::Sampling;
use crate::analysis::study::{self, ENDS};
use crate::files::Folder;

use self::target::Answer;

/// Largest number of parameters without a screening, and of those that it leaves over.
const UNSCREENED: usize = 8;
/// Trajectories of a screening that was not asked for, and levels of each parameter.
const TRAJECTORIES: usize = 10;
const LEVELS: usize = 4;
/// Least mean magnitude of an effect, over the largest, that leaves a parameter to the indices.
const NEGLIGIBLE: f64 = 0.05;

/// Outputs with one parameter at an end of its distribution and the others at their values in the scene.
struct Alone {
    nominal: Vec<f64>,
    /// For each parameter the values at its ends, and the outputs there.
    ends: Vec<[(f64, Vec<f64>); 2]>,
    /// Outputs with all parameters at their lower, or upper, ends.
    together: [Vec<f64>; 2],
}

/// Elementary effects of each parameter on the first output, and the parameters left to the indices.
struct Screening {
    effects: Vec<Option<ElementaryEffects>>,
    kept: Vec<usize>,
}

/// Everything found.
struct Found {
    alone: Alone,
    screening: Option<Screening>,
    /// Parameters of the indices.
    kept: Vec<usize>,
    /// For each output; `None` if none were asked for.
    indices: Vec<Option<Result<SensitivityIndices, IndicesError>>>,
    target: Option<Answer>,
}

/// Runs `sensitivity`.
///
/// # Errors
/// Bad input, before anything runs; later Ctrl-C or the file system.
pub fn sensitivity(arguments: &SensitivityArguments) -> Result<(), Failure> {
    let scene = load(&arguments.scene)?;
    let inputs = inputs(&scene, None, &arguments.over)?;
    let outputs = outputs(&scene, "--output", &arguments.output)?;
    let target = arguments.target.as_deref().map(|text| target::read(&outputs[0], text)).transpose()?;
    let rows = arguments.rows;
    if (1..LEAST_ROWS).contains(&(rows as usize)) {
        return Err(Failure::usage(format!("--rows {rows}: allowed at least {LEAST_ROWS}, or 0 for no indices")));
    }
    let folder = Folder::claim(&arguments.study.out, arguments.study.force)?;
    let mut study = Study::new(scene, inputs, outputs, &arguments.study)?;
    let found = find(&mut study, arguments, target)?;
    let manifest = report::fill(&folder, &study, &found, arguments)?;
    folder.finish(manifest)?;
    print(&match arguments.study.summary {
        SummaryForm::Text => report::text(&study, &found, &arguments.study.out),
        SummaryForm::Json => format!("{:#}\n", report::json(&study, &found)),
    })?;
    study.finish();
    Ok(())
}

fn find(study: &mut Study, arguments: &SensitivityArguments, target: Option<f64>) -> Result<Found, Failure> {
    let alone = alone(study)?;
    let screening = screening(study, arguments)?;
    let kept = screening.as_ref().map_or_else(|| (0..study.inputs().len()).collect(), |s| s.kept.clone());
    let indices = indices(study, &kept, arguments)?;
    let target = match target {
        Some(target) => Some(target::answer(study, &alone, &indices, &kept, target)?),
        None => None,
    };
    Ok(Found { alone, screening, kept, indices, target })
}

fn alone(study: &mut Study) -> Result<Alone, Failure> {
    let plan = study::Alone::new(study.inputs());
    let mut rows = plan.rows();
    rows.extend([0, 1].map(|end| plan.ends().iter().map(|own| own[end]).collect()));
    let mut results = study.run("alone", rows)?.into_iter();
    let mut next = || results.next().unwrap_or_default();
    let nominal = next();
    let ends = plan.ends().iter().map(|own| own.map(|end| (end, next()))).collect();
    Ok(Alone { nominal, ends, together: [next(), next()] })
}

/// Elementary effects, if asked for or if there are many parameters.
fn screening(study: &mut Study, arguments: &SensitivityArguments) -> Result<Option<Screening>, Failure> {
    let inputs = study.inputs().len();
    let default = if inputs > UNSCREENED { TRAJECTORIES } else { 0 };
    let trajectories = arguments.screen.map_or(default, |asked| asked as usize);
    if trajectories == 0 {
        return Ok(None);
    }
    let limited = |(low, high): (f64, f64)| low.is_finite() && high.is_finite();
    let margin = if study.inputs().iter().all(|input| limited(input.distribution.support())) { 0.0 } else { ENDS[0] };
    let plan = MorrisPlan::new(inputs, trajectories, LEVELS, margin, arguments.study.seed)
        .map_err(|error| Failure::usage(format!("--screen: {error}")))?;
    let rows = (0..plan.points()).map(|index| row(study, plan.point(index), &[]));
    let results = study.run("screening", rows.collect())?;
    let first: Vec<f64> = results.iter().map(|outputs| outputs[0]).collect();
    let effects = plan.effects(&first).map_err(|error| Failure::usage(error.to_string()))?;
    let size = |i: usize| effects[i].map_or(0.0, |effects| effects.mean_magnitude);
    let mut kept: Vec<usize> = (0..inputs).collect();
    kept.sort_by(|&a, &b| size(b).total_cmp(&size(a)));
    let largest = size(kept[0]);
    kept.retain(|&i| size(i) >= NEGLIGIBLE * largest);
    kept.truncate(UNSCREENED);
    kept.sort_unstable();
    Ok(Some(Screening { effects, kept }))
}

/// First-order and total indices of the parameters `kept` on each output; the others stay at their values in the scene.
fn indices(
    study: &mut Study,
    kept: &[usize],
    arguments: &SensitivityArguments,
) -> Result<Vec<Option<Result<SensitivityIndices, IndicesError>>>, Failure> {
    if arguments.rows == 0 {
        return Ok(study.outputs().iter().map(|_| None).collect());
    }
    let seed = arguments.study.seed;
    let design = SaltelliDesign::new(Sampling::Sobol, kept.len(), arguments.rows as usize, seed)
        .map_err(|error| Failure::usage(format!("--rows {}: {error}", arguments.rows)))?;
    if !arguments.study.quiet && !arguments.rows.is_power_of_two() {
        warn(&format!("--rows {}: a Sobol sequence is even only at a power of two", arguments.rows));
    }
    let rows = (0..design.points()).map(|index| row(study, design.point(index), kept));
    let results = study.run("indices", rows.collect())?;
    let bootstrap = Bootstrap { seed, ..Bootstrap::default() };
    let of_output = |o: usize| {
        let values: Vec<f64> = results.iter().map(|outputs| outputs[o]).collect();
        Some(design.indices(&values, bootstrap))
    };
    Ok((0..study.outputs().len()).map(of_output).collect())
}

/// Values of all parameters at a point of the unit cube, whose coordinates belong to the parameters `kept`, or to all if it is empty.
fn row(study: &Study, point: Option<Vec<f64>>, kept: &[usize]) -> Vec<f64> {
    let mut row: Vec<f64> = study.inputs().iter().map(|input| input.nominal).collect();
    for (j, u) in point.unwrap_or_default().into_iter().enumerate() {
        let i = if kept.is_empty() { j } else { kept[j] };
        row[i] = study.inputs()[i].at(u);
    }
    row
}
