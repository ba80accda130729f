//! Which parameters influence an output most: one at a time, by screening, and by variance-based indices.

use super::target::{self, TargetAnswer};
use super::{ENDS, OneAtATimeOutputs, StudyError, StudyRunner};
use crate::argument::Argument;
use crate::indices::{Bootstrap, IndicesError, MIN_ROWS, SaltelliDesign, SensitivityIndices};
use crate::morris::{ElementaryEffects, MorrisPlan};
use crate::sampling::Sampling;

/// Largest number of parameters for indices; more are screened first.
const UNSCREENED: usize = 8;
/// Default number of trajectories of a screening.
const TRAJECTORIES: usize = 10;
/// Levels of each parameter in a screening.
const LEVELS: usize = 4;
/// Mean magnitude of an effect, relative to the largest, below which a parameter is screened out.
const NEGLIGIBLE: f64 = 0.05;

/// What a sensitivity study computes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensitivityOptions {
    /// Rows of the design for the indices; 0 for no indices.
    pub rows: usize,
    /// Trajectories of the screening; `None` for 10 if more than 8 parameters vary, and no screening otherwise.
    pub screen: Option<usize>,
    /// Largest allowed value of the first output, SI.
    pub target: Option<f64>,
    /// Seed of the samples.
    pub seed: u64,
}

impl SensitivityOptions {
    /// Requires enough rows for indices, or none.
    ///
    /// # Errors
    /// Too few rows.
    pub fn check(&self) -> Result<(), StudyError> {
        if (1..MIN_ROWS).contains(&self.rows) {
            return Err(StudyError::argument(Argument::Rows, self.rows, StudyError::TooFewRows));
        }
        Ok(())
    }
}

/// Elementary effects of each parameter on the first output, and the parameters that remain for the indices.
#[derive(Clone, Debug, PartialEq)]
pub struct Screening {
    /// Effects of each parameter; `None` without results.
    pub effects: Vec<Option<ElementaryEffects>>,
    /// Indices of the parameters that remain, ascending.
    pub kept: Vec<usize>,
}

/// Results of a sensitivity study. All values are SI, and NaN where a run did not start or diverged.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensitivity {
    /// Effects of each parameter alone.
    pub alone: OneAtATimeOutputs,
    /// Screening, if there was one.
    pub screening: Option<Screening>,
    /// Indices of the parameters that remain, ascending.
    pub kept: Vec<usize>,
    /// Sensitivity indices of each output; `None` if none were requested.
    pub indices: Vec<Option<Result<SensitivityIndices, IndicesError>>>,
    /// Changes that reach the target; `None` without a target.
    pub target: Option<TargetAnswer>,
}

impl Sensitivity {
    /// Indices of output `o`, if there are any.
    pub fn indices_of(&self, o: usize) -> Option<&SensitivityIndices> {
        self.indices[o].as_ref().and_then(|indices| indices.as_ref().ok())
    }

    /// Position of parameter `i` in [`Self::kept`].
    pub fn index_of(&self, i: usize) -> Option<usize> {
        self.kept.iter().position(|&kept| kept == i)
    }
}

/// Runs a sensitivity study in the stages `alone`, `screening`, `indices`, `target` and `target-together`, skipping those that
/// are not needed.
///
/// # Errors
/// Too few rows, before anything runs; a design that is too large; an error of `runner`.
pub fn sensitivity<R: StudyRunner>(runner: &mut R, options: &SensitivityOptions) -> Result<Sensitivity, R::Error> {
    options.check()?;
    let alone = OneAtATimeOutputs::compute(runner)?;
    let screening = screening(runner, options)?;
    let kept = screening.as_ref().map_or_else(|| (0..runner.inputs().len()).collect(), |s| s.kept.clone());
    let indices = indices(runner, &kept, options)?;
    let mut found = Sensitivity { alone, screening, kept, indices, target: None };
    if let Some(target) = options.target {
        let answer = target::answer(runner, &found.alone, found.indices_of(0), &found.kept, target)?;
        found.target = Some(answer);
    }
    Ok(found)
}

/// Elementary effects, if requested or if there are many parameters.
fn screening<R: StudyRunner>(runner: &mut R, options: &SensitivityOptions) -> Result<Option<Screening>, R::Error> {
    let inputs = runner.inputs().len();
    let trajectories = options.screen.unwrap_or(if inputs > UNSCREENED { TRAJECTORIES } else { 0 });
    if trajectories == 0 {
        return Ok(None);
    }
    let is_bounded = |(low, high): (f64, f64)| low.is_finite() && high.is_finite();
    let margin =
        if runner.inputs().iter().all(|input| is_bounded(input.distribution.support())) { 0.0 } else { ENDS[0] };
    let plan = MorrisPlan::new(inputs, trajectories, LEVELS, margin, options.seed)
        .map_err(|error| StudyError::argument(Argument::Screen, trajectories, error))?;
    let rows = (0..plan.points()).map(|index| row(runner, plan.point(index), &[])).collect();
    let results = runner.run("screening", rows)?;
    let first: Vec<f64> = results.iter().map(|outputs| outputs[0]).collect();
    let effects = plan.effects(&first).map_err(StudyError::from)?;
    let influence = |i: usize| effects[i].map_or(0.0, |effects| effects.mean_magnitude);
    let mut kept: Vec<usize> = (0..inputs).collect();
    kept.sort_by(|&a, &b| influence(b).total_cmp(&influence(a)));
    let largest = influence(kept[0]);
    kept.retain(|&i| influence(i) >= NEGLIGIBLE * largest);
    kept.truncate(UNSCREENED);
    kept.sort_unstable();
    Ok(Some(Screening { effects, kept }))
}

/// First-order and total indices of the parameters `kept` for each output; all others stay at their values in the scene.
fn indices<R: StudyRunner>(
    runner: &mut R,
    kept: &[usize],
    &SensitivityOptions { rows, seed, .. }: &SensitivityOptions,
) -> Result<Vec<Option<Result<SensitivityIndices, IndicesError>>>, R::Error> {
    if rows == 0 {
        return Ok(runner.outputs().iter().map(|_| None).collect());
    }
    let design = SaltelliDesign::new(Sampling::Sobol, kept.len(), rows, seed)
        .map_err(|error| StudyError::argument(Argument::Rows, rows, error))?;
    let points = (0..design.points()).map(|index| row(runner, design.point(index), kept)).collect();
    let results = runner.run("indices", points)?;
    let bootstrap = Bootstrap { seed, ..Bootstrap::default() };
    let of_output = |o: usize| {
        let values: Vec<f64> = results.iter().map(|outputs| outputs[o]).collect();
        Some(design.indices(&values, bootstrap))
    };
    Ok((0..runner.outputs().len()).map(of_output).collect())
}

/// Values of all parameters at a point of the unit cube, whose coordinates belong to the parameters `kept`, or to all
/// parameters if `kept` is empty.
fn row(runner: &impl StudyRunner, point: Option<Vec<f64>>, kept: &[usize]) -> Vec<f64> {
    let mut row: Vec<f64> = runner.inputs().iter().map(|input| input.nominal).collect();
    for (j, u) in point.unwrap_or_default().into_iter().enumerate() {
        let i = if kept.is_empty() { j } else { kept[j] };
        row[i] = runner.inputs()[i].at(u);
    }
    row
}
