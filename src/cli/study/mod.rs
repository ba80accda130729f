//! Runs of the studies in `crate::analysis::study` on several threads, stored in files so that an interrupted study resumes.

mod report;
mod rows;

pub use report::{axis_value, display_value, display_value_digits, distinguishing_digits, estimate, number, value_of};
pub use rows::{Row, rows};

use std::path::{Path, PathBuf};

use serde_json::{Map, json};

use super::args::StudyArguments;
use super::sweep::{Partial, Source as _, compute, meta};
use super::{Failure, progress, quantity, start, threads, warn};
use crate::analysis::study::{self, Input, Output, RunSpan, StudyError, StudyRunner, StudyRuns, Uncertainty};
use crate::scene::Scene;
use crate::units::format_quantity;

impl From<StudyError> for Failure {
    fn from(error: StudyError) -> Self {
        Self::usage(error.to_string())
    }
}

/// The parameters of the file `--tolerances`, then those of the options `--over KEY[=DISTRIBUTION]`.
///
/// # Errors
/// Usage: as [`study::inputs`], or a malformed file, with its line. Input/output: an unreadable file.
pub fn inputs(scene: &Scene, tolerances: Option<&Path>, over: &[String]) -> Result<Vec<Input>, Failure> {
    let mut requested = Vec::new();
    if let Some(path) = tolerances {
        let rows = rows("--tolerances", path, ["parameter", "distribution"])?.into_iter();
        requested.extend(rows.map(|Row { place, cells: [pattern, text] }| Uncertainty {
            place,
            pattern,
            distribution: Some(text),
        }));
    }
    requested.extend(over.iter().map(|option| Uncertainty::parse("--over", option)));
    Ok(study::inputs(scene, &requested)?)
}

/// The outputs that `option` names.
///
/// # Errors
/// Usage: as [`study::outputs`].
pub fn outputs(scene: &Scene, option: &str, text: &str) -> Result<Vec<Output>, Failure> {
    study::outputs(scene, text).map_err(|error| Failure::usage(format!("{option} {error}")))
}

/// A run.
pub struct Run {
    /// Stage of the study.
    pub stage: String,
    /// Values of the inputs, SI.
    pub values: Vec<f64>,
    /// Outputs, SI; NaN if it did not start or diverged.
    pub outputs: Vec<f64>,
}

/// The runs of one command.
pub struct Study {
    scene: Scene,
    inputs: Vec<Input>,
    outputs: Vec<Output>,
    span: RunSpan,
    out: PathBuf,
    seed: u64,
    threads: usize,
    quiet: bool,
    runs: Vec<Run>,
    /// Files of the finished stages, removed once the results are written.
    partials: Vec<Partial>,
}

impl Study {
    /// A study of the `outputs` of `scene` over its `inputs`. Files of an interrupted command are beside its folder.
    ///
    /// # Errors
    /// Usage: an invalid duration, or a scene that cannot start.
    pub fn new(
        scene: Scene,
        inputs: Vec<Input>,
        outputs: Vec<Output>,
        arguments: &StudyArguments,
    ) -> Result<Self, Failure> {
        let span = match &arguments.duration {
            Some(text) => {
                let (duration, from) = quantity::span(text, arguments.from.as_deref())?;
                RunSpan { duration, from }
            }
            None => RunSpan::of(&scene),
        };
        start(&scene)?;
        Ok(Self {
            scene,
            inputs,
            outputs,
            span,
            out: arguments.out.clone(),
            seed: arguments.seed,
            threads: threads(arguments.threads),
            quiet: arguments.quiet,
            runs: Vec::new(),
            partials: Vec::new(),
        })
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// All runs so far, in order.
    pub fn runs(&self) -> &[Run] {
        &self.runs
    }

    /// The observed part of every run.
    pub fn span(&self) -> RunSpan {
        self.span
    }

    /// Removes the files of the finished stages, once the results are written.
    pub fn finish(self) {
        self.partials.into_iter().for_each(Partial::remove);
    }

    /// One line about the runs.
    pub fn describe(&self) -> String {
        let RunSpan { duration, from } = self.span;
        let observed = format_quantity(duration, "s");
        if from > 0.0 { format!("{observed}, observed from {} on", format_quantity(from, "s")) } else { observed }
    }
}

impl StudyRunner for Study {
    type Error = Failure;

    fn inputs(&self) -> &[Input] {
        &self.inputs
    }

    fn outputs(&self) -> &[Output] {
        &self.outputs
    }

    /// `stage` also names the file from which an interrupted command resumes. Ctrl-C and the file system also cause errors.
    fn run(&mut self, stage: &str, rows: Vec<Vec<f64>>) -> Result<Vec<Vec<f64>>, Failure> {
        let keys: Vec<String> = self.inputs.iter().map(|input| input.key.clone()).collect();
        let study = StudyRuns::new(&self.scene, &keys, &self.outputs, self.span, &rows)?;
        let sweep = study.sweep();
        let blocks: Vec<usize> = (0..sweep.design().blocks()).collect();
        let beside = self.out.with_added_extension(stage);
        // First, because another seed also changes the values.
        let mut settings = Map::from_iter([("seed".to_owned(), json!(self.seed))]);
        settings.extend(meta(sweep));
        let mut partial = Partial::open(&beside, &settings, sweep, &blocks)?;
        let todo: Vec<usize> = blocks.iter().copied().filter(|b| !partial.has(*b)).collect();
        let done = blocks.len() - todo.len();
        if done > 0 && !self.quiet {
            warn(&format!(
                "resuming where {} stopped: {done} of {} runs are done",
                partial.path().display(),
                blocks.len()
            ));
        }
        let bar = progress::bar(!self.quiet, blocks.len() as u64);
        bar.set_position(done as u64);
        bar.reset_eta();
        let outcome = compute(sweep, &todo, self.threads, &mut partial, &bar);
        bar.finish_and_clear();
        outcome?;
        if blocks.iter().any(|b| !partial.has(*b)) {
            return Err(Failure::new(
                Failure::INTERRUPTED,
                format!("interrupted; the same command resumes from {}", partial.path().display()),
            ));
        }
        let length = sweep.layout().record_length();
        let mut records = vec![f64::NAN; rows.len() * length];
        partial.gather(0, length, &mut records)?;
        self.partials.push(partial);
        let results: Vec<Vec<f64>> = records.chunks_exact(length).map(|record| study.outputs_of(record)).collect();
        let runs = rows.into_iter().zip(&results);
        self.runs.extend(runs.map(|(values, outputs)| Run {
            stage: stage.to_owned(),
            values,
            outputs: outputs.clone(),
        }));
        Ok(results)
    }
}
