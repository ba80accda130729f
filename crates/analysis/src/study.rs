//! Studies of uncertain parameters: the varied parameters, the scalar results of a run ([`Output`]), the runs at given values
//! ([`StudyRuns`]), and the rows in which each parameter varies alone ([`OneAtATimePlan`]). The caller schedules the runs, as in
//! any [`Sweep`]. Distributions, sensitivity indices and yields are the Python package's.

mod inputs;
mod one_at_a_time;
mod outputs;

pub use inputs::{matching, read_unchecked, real_parameter};
pub use one_at_a_time::OneAtATimePlan;
pub use outputs::{NAMED, NamedOutput, Output, outputs};

use std::fmt::Formatter;

use serde::{Deserialize, Serialize};

use crate::axis::RangeError;
use crate::design::{Design, Start};
use crate::drive::common_period;
use crate::point::{Protocol, Span};
use crate::statistic::StatisticError;
use crate::sweep::{Sweep, SweepError};
use jointplay_scene::{Scene, SceneError, Value, ValueError};

/// Default number of observed periods of a driven scene.
const PERIODS: f64 = 2.0;
/// Default duration of a run without a common drive period, s.
const UNDRIVEN_DURATION: f64 = 1.0;

/// Reasons why a study cannot be set up or evaluated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StudyError {
    /// An error with its place in the request.
    #[error("{place}: {error}")]
    At {
        /// Key of the parameter.
        place: String,
        /// The error at that place.
        error: Box<Self>,
    },
    /// An unknown key.
    #[error(transparent)]
    Scene(Box<SceneError>),
    /// A pattern without a match.
    #[error("no number of the scene matches {pattern}{nearest}")]
    NoMatch {
        /// The pattern.
        pattern: String,
        /// Suggestion of the nearest key, in words; empty if there is none.
        nearest: String,
    },
    /// A parameter whose values are words or whole numbers.
    #[error("its values are not real numbers")]
    NotReal,
    /// A text that is not a value of the parameter.
    #[error(transparent)]
    Read(#[from] ValueError),
    /// An end of a range that the parameter does not accept.
    #[error("{value}: {error}")]
    End {
        /// The end, with unit.
        value: String,
        /// What is allowed.
        error: ValueError,
    },
    /// A range that runs downwards.
    #[error("the lower limit must not be above the upper one")]
    Order,
    /// More parameters than a study varies.
    #[error("{found} uncertain parameters; expected at most {most}")]
    TooMany {
        /// Number of requested parameters.
        found: usize,
        /// Largest allowed number.
        most: usize,
    },
    /// An unknown output, channel or statistic.
    #[error(fmt = write_output_error)]
    Output {
        /// The given entry.
        entry: String,
        /// The error.
        error: StatisticError,
    },
    /// An output that is requested twice.
    #[error("{name}: given twice ({position} and before)")]
    DuplicateOutput {
        /// Name of the output.
        name: String,
        /// Position of the repetition, from 1.
        position: usize,
    },
    /// A value of a run that the parameter does not accept.
    #[error("{key}: {value}: {error}")]
    RunValue {
        /// Key of the parameter.
        key: String,
        /// The value, with unit.
        value: String,
        /// What is allowed.
        error: ValueError,
    },
    /// Values that do not define runs.
    #[error(transparent)]
    Range(#[from] RangeError),
    /// Runs that do not define a sweep.
    #[error(transparent)]
    Sweep(#[from] SweepError),
}

fn write_output_error(entry: &str, error: &StatisticError, f: &mut Formatter<'_>) -> std::fmt::Result {
    // An error about the entry itself begins with the entry; an error about the statistics behind a name does not.
    if error.text() != Some(entry) {
        write!(f, "{entry}: ")?;
    }
    write!(f, "{error}; outputs by name: {}", NAMED.map(|named| named.name).join(", "))
}

impl StudyError {
    /// Adds the place of the error.
    pub(crate) fn at(self, place: &str) -> Self {
        Self::At { place: place.to_owned(), error: Box::new(self) }
    }
}

impl From<SceneError> for StudyError {
    fn from(error: SceneError) -> Self {
        Self::Scene(Box::new(error))
    }
}

/// The observed part of every run of a study.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunSpan {
    /// Length of the run, s.
    pub duration: f64,
    /// End of the transient, s, 0 <= from < duration.
    pub from: f64,
}

impl RunSpan {
    /// Three drive periods of `scene`, of which the first is the transient; one second from the start if there is no common
    /// period.
    pub fn of(scene: &Scene) -> Self {
        match common_period(&scene.machine) {
            Ok(Some(period)) => Self { duration: (1.0 + PERIODS) * period, from: period },
            _ => Self { duration: UNDRIVEN_DURATION, from: 0.0 },
        }
    }
}

/// The runs of a scene at given values of its inputs.
#[derive(Clone, Debug)]
pub struct StudyRuns {
    sweep: Sweep,
    outputs: Vec<Output>,
    /// Columns of a record that determine each output.
    columns: Vec<Vec<usize>>,
}

impl StudyRuns {
    /// One run for each of `rows`, which hold a value for each of `keys`, SI. All runs start cold from the scene's initial
    /// state.
    ///
    /// # Errors
    /// A value that its parameter does not accept.
    pub fn new(
        scene: &Scene,
        keys: &[String],
        outputs: &[Output],
        span: RunSpan,
        rows: &[Vec<f64>],
    ) -> Result<Self, StudyError> {
        for (i, key) in keys.iter().enumerate() {
            let parameter = scene.parameter(key)?;
            for row in rows {
                let value = Value::Number(row[i]);
                parameter.check(&value).map_err(|error| StudyError::RunValue {
                    key: key.clone(),
                    value: parameter.show(&value),
                    error,
                })?;
            }
        }
        let values: Vec<Vec<Value>> = rows.iter().map(|row| row.iter().copied().map(Value::Number).collect()).collect();
        let design = Design::table(scene, keys, &values, &[Start::Cold])?;
        let span = Span::Duration { duration: span.duration, from: span.from };
        let sweep = Sweep::untried(scene.clone(), design, protocol(outputs, span))?;
        let names: Vec<&str> = sweep.layout().columns().iter().map(|column| &column.name[..]).collect();
        let columns = outputs.iter().map(|output| output.columns(&names)).collect();
        Ok(Self { outputs: outputs.to_vec(), columns, sweep })
    }

    /// The runs as a sweep with one block for each row.
    pub fn sweep(&self) -> &Sweep {
        &self.sweep
    }

    /// The outputs of a run from its record, SI; NaN if the run did not start or diverged.
    pub fn outputs_of(&self, record: &[f64]) -> Vec<f64> {
        let outputs = self.outputs.iter().zip(&self.columns);
        outputs.map(|(output, columns)| output.value(columns.iter().map(|&column| record[column]))).collect()
    }

    /// How a run ended, from its record: the code of its [`Status`](crate::layout::Status), with which every record begins.
    pub fn status_of(&self, record: &[f64]) -> f64 {
        record[0]
    }
}

/// The protocol that records the quantities behind `outputs`.
fn protocol(outputs: &[Output], span: Span) -> Protocol {
    let mut keep = Vec::new();
    for statistic in outputs.iter().flat_map(Output::statistics) {
        if !keep.contains(statistic) {
            keep.push(statistic.clone());
        }
    }
    let joints = outputs.iter().any(|output| output.statistics().is_empty());
    Protocol { span, keep, joints }
}
