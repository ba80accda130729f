//! Runs of a scene at points with many uncertain parameters, and the outputs of each.

mod inputs;
mod outputs;
mod report;
mod rows;

pub use inputs::{Input, inputs, matching};
pub use outputs::{Output, outputs};
pub use report::{drawn, estimate, number, shown};
pub use rows::{Row, rows};

use std::path::PathBuf;

use super::args::StudyArguments;
use super::sweep::{Partial, Source as _, compute, meta};
use super::{Failure, interrupt, progress, quantity, start, threads, warn};
use crate::analysis::design::{Design, Start};
use crate::analysis::drive::common_period;
use crate::analysis::point::{Protocol, Span};
use crate::analysis::sweep::Sweep;
use crate::scene::{Scene, Value};
use crate::units::format_quantity;

/// Observed periods of a driven scene, and time of another, s, if no duration is given.
const PERIODS: f64 = 2.0;
const UNDRIVEN: f64 = 1.0;

/// A run.
pub struct Run {
    /// Stage that made it.
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
    protocol: Protocol,
    out: PathBuf,
    seed: u64,
    threads: usize,
    quiet: bool,
    runs: Vec<Run>,
    /// Finished stages, kept until the results are written.
    partials: Vec<Partial>,
}

impl Study {
    /// The runs of `inputs` of `scene`, of which `outputs` are kept. Files of an interrupted command lie beside its folder.
    ///
    /// # Errors
    /// Usage: an invalid duration, or a scene that cannot start.
    pub fn new(
        scene: Scene,
        inputs: Vec<Input>,
        outputs: Vec<Output>,
        arguments: &StudyArguments,
    ) -> Result<Self, Failure> {
        let (duration, from) = match &arguments.duration {
            Some(text) => quantity::span(text, arguments.from.as_deref())?,
            None => default_span(&scene),
        };
        start(&scene)?;
        let protocol = outputs::protocol(&outputs, Span::Duration { duration, from });
        interrupt::listen();
        Ok(Self {
            scene,
            inputs,
            outputs,
            protocol,
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

    /// Varied parameters.
    pub fn inputs(&self) -> &[Input] {
        &self.inputs
    }

    /// Kept numbers.
    pub fn outputs(&self) -> &[Output] {
        &self.outputs
    }

    /// All runs so far, in order.
    pub fn runs(&self) -> &[Run] {
        &self.runs
    }

    /// Length of each run and end of its transient, s.
    pub fn span(&self) -> (f64, f64) {
        match self.protocol.span {
            Span::Duration { duration, from } => (duration, from),
            Span::Sections { .. } | Span::Crossings { .. } => (0.0, 0.0),
        }
    }

    /// The outputs at each of `rows`, which give every input a value, SI. NaN where a run does not start or diverges. `stage`
    /// names the runs for the user, and the file from which an interrupted command resumes.
    ///
    /// # Errors
    /// A row that the scene does not accept; Ctrl-C; the file system.
    pub fn run(&mut self, stage: &str, rows: Vec<Vec<f64>>) -> Result<Vec<Vec<f64>>, Failure> {
        let usage = |error: &dyn std::fmt::Display| Failure::usage(error.to_string());
        self.check(&rows)?;
        let keys: Vec<String> = self.inputs.iter().map(|input| input.key.clone()).collect();
        let values: Vec<Vec<Value>> = rows.iter().map(|row| row.iter().copied().map(Value::Number).collect()).collect();
        let design = Design::table(&self.scene, &keys, &values, &[Start::Cold]).map_err(|error| usage(&error))?;
        let sweep = Sweep::untried(self.scene.clone(), design, self.protocol.clone()).map_err(|error| usage(&error))?;
        let blocks: Vec<usize> = (0..sweep.design().blocks()).collect();
        let beside = self.out.with_added_extension(stage);
        let mut partial = Partial::open(&beside, &meta(&sweep), &sweep, &blocks)?;
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
        let outcome = compute(&sweep, &todo, self.threads, &mut partial, &bar);
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
        let names: Vec<&str> = sweep.layout().columns().iter().map(|column| &column.name[..]).collect();
        let columns: Vec<Vec<usize>> = self.outputs.iter().map(|output| output.columns(&names)).collect();
        let results = records.chunks_exact(length).map(|record| {
            let outputs = self.outputs.iter().zip(&columns);
            outputs.map(|(output, columns)| output.value(columns.iter().map(|&at| record[at]))).collect()
        });
        let results: Vec<Vec<f64>> = results.collect();
        let runs = rows.into_iter().zip(&results);
        self.runs.extend(runs.map(|(values, outputs)| Run {
            stage: stage.to_owned(),
            values,
            outputs: outputs.clone(),
        }));
        Ok(results)
    }

    /// Requires values that the parameters accept, which a distribution without limits does not grant.
    fn check(&self, rows: &[Vec<f64>]) -> Result<(), Failure> {
        for (i, input) in self.inputs.iter().enumerate() {
            let parameter = self.scene.parameter(&input.key)?;
            let refused = rows.iter().find_map(|row| {
                let value = Value::Number(row[i]);
                parameter.check(&value).err().map(|error| format!("{}: {error}", parameter.show(&value)))
            });
            if let Some(error) = refused {
                let advice = "a distribution with limits, such as normal(MEAN, SD, LOW..HIGH), draws no such value";
                return Err(Failure::usage(format!("{}: {error}; {advice}", input.key)));
            }
        }
        Ok(())
    }

    /// Removes the files of the finished stages, once the results are written.
    pub fn finish(self) {
        self.partials.into_iter().for_each(Partial::remove);
    }

    /// One line about the runs.
    pub fn describe(&self) -> String {
        let (duration, from) = self.span();
        let observed = format_quantity(duration, "s");
        if from > 0.0 { format!("{observed}, observed from {} on", format_quantity(from, "s")) } else { observed }
    }
}

/// After one period, so many periods; or so long from the start.
fn default_span(scene: &Scene) -> (f64, f64) {
    match common_period(&scene.machine) {
        Ok(Some(period)) => ((1.0 + PERIODS) * period, period),
        _ => (UNDRIVEN, 0.0),
    }
}
