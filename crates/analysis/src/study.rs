//! Studies of uncertain parameters: the varied parameters ([`Input`]), the scalar results of a run ([`Output`]), the runs at
//! given values ([`StudyRuns`]), and their evaluation ([`sensitivity()`], [`tolerance()`]). The caller schedules the runs, as
//! in any [`Sweep`].

mod candidates;
mod inputs;
mod one_at_a_time;
mod outputs;
mod runner;
mod sensitivity;
mod target;
mod tolerance;

pub use candidates::{Candidate, CandidateRequest, Candidates, candidates};
pub use inputs::{Input, Uncertainty, inputs, matching};
pub use one_at_a_time::{ENDS, OneAtATimeOutputs, OneAtATimePlan};
pub use outputs::{NAMED, NamedOutput, Output, outputs};
pub use runner::StudyRunner;
pub use sensitivity::{Screening, Sensitivity, SensitivityOptions, sensitivity};
pub use target::{Change, TargetAnswer};
pub use tolerance::{CheapestFits, FitOptions, FitVerdict, Tolerance, ToleranceOptions, tolerance};

use std::fmt::{Display, Formatter};

use serde::{Deserialize, Serialize};

use crate::argument::Argument;
use crate::axis::RangeError;
use crate::design::{Design, Start};
use crate::distribution::DistributionError;
use crate::drive::common_period;
use crate::fits::FitSearchError;
use crate::indices::{IndicesError, MIN_ROWS};
use crate::morris::MorrisError;
use crate::point::{Protocol, Span};
use crate::sampling::SamplingError;
use crate::statistic::StatisticError;
use crate::sweep::{Sweep, SweepError};
use crate::yields::YieldsError;
use jointplay_scene::{Scene, SceneError, Value, ValueError};

/// Default number of observed periods of a driven scene.
const PERIODS: f64 = 2.0;
/// Default duration of a run without a common drive period, s.
const UNDRIVEN_DURATION: f64 = 1.0;

/// Reasons why a study cannot be set up or evaluated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StudyError {
    /// An error with its place in the request.
    #[error(fmt = write_at_place)]
    At {
        /// Option, or file with line.
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
    /// A parameter without a given distribution whose value yields no default range.
    #[error(
        "is {value} in the scene, so the default range, 0.5 to 1.5 times this value, is empty: give a range, KEY=A..B"
    )]
    NoRange {
        /// Value in the scene, with unit.
        value: String,
    },
    /// A text that is not a value of the parameter.
    #[error(transparent)]
    Read(#[from] ValueError),
    /// An invalid distribution.
    #[error(transparent)]
    Distribution(#[from] DistributionError),
    /// An end of a distribution that the parameter does not accept.
    #[error("{value}: {error}")]
    End {
        /// The end, with unit.
        value: String,
        /// What is allowed.
        error: ValueError,
    },
    /// An end of a distribution that the scene does not accept.
    #[error("{value}: {why}")]
    RejectedEnd {
        /// The end, with unit.
        value: String,
        /// The reason, and the allowed values.
        why: String,
    },
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
    /// A drawn value that the parameter does not accept; only a distribution without limits can draw one.
    #[error(
        "{key}: {value}: {error}; a distribution with limits, such as normal(MEAN, SD, LOW..HIGH), draws no such value"
    )]
    DrawnValue {
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
    /// A number that an argument does not accept.
    #[error(fmt = write_argument_error)]
    Argument {
        /// The argument.
        argument: Argument,
        /// The number.
        value: usize,
        /// The error.
        error: Box<Self>,
    },
    /// Fewer rows than the indices need.
    #[error("allowed at least {MIN_ROWS}, or 0 for no indices")]
    TooFewRows,
    /// An error of the design for indices.
    #[error(transparent)]
    Indices(#[from] IndicesError),
    /// An error of the screening.
    #[error(transparent)]
    Screening(#[from] MorrisError),
    /// An error of the sampling.
    #[error(transparent)]
    Sampling(#[from] SamplingError),
    /// An error of the statistics of a lot.
    #[error(transparent)]
    Yields(#[from] YieldsError),
    /// A candidate without a cost.
    #[error("expected a cost, a finite number of at least 0")]
    NoCost,
    /// A candidate for a parameter that does not vary.
    #[error("give the parameter a distribution of its own, too")]
    NoDistribution,
    /// Candidates in the wrong order.
    #[error(
        "{text} is wider than the candidate before it; list the candidates of a parameter from the loosest to the tightest"
    )]
    Wider {
        /// The wider candidate, as given.
        text: String,
    },
    /// An error of the search for the cheapest fits.
    #[error(fmt = write_fit_search_error)]
    Fits(FitSearchError),
}

fn write_at_place(place: &str, error: &StudyError, f: &mut Formatter<'_>) -> std::fmt::Result {
    write!(f, "{place}: ")?;
    error.fmt(f)
}

fn write_output_error(entry: &str, error: &StatisticError, f: &mut Formatter<'_>) -> std::fmt::Result {
    // An error about the entry itself begins with the entry; an error about the statistics behind a name does not.
    if error.text() != Some(entry) {
        write!(f, "{entry}: ")?;
    }
    write!(f, "{error}; outputs by name: {}", NAMED.map(|named| named.name).join(", "))
}

fn write_argument_error(
    argument: &Argument,
    value: &usize,
    error: &StudyError,
    f: &mut Formatter<'_>,
) -> std::fmt::Result {
    argument.write(value, f)?;
    f.write_str(": ")?;
    error.fmt(f)
}

fn write_fit_search_error(error: &FitSearchError, f: &mut Formatter<'_>) -> std::fmt::Result {
    Argument::Cost.fmt(f)?;
    write!(f, ": {error}")
}

impl StudyError {
    /// Adds the place of the error.
    pub(crate) fn at(self, place: &str) -> Self {
        Self::At { place: place.to_owned(), error: Box::new(self) }
    }

    /// An error about the number `value` given for `argument`.
    fn argument(argument: Argument, value: usize, error: impl Into<Self>) -> Self {
        Self::Argument { argument, value, error: Box::new(error.into()) }
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
                parameter.check(&value).map_err(|error| StudyError::DrawnValue {
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
