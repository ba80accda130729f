//! Studies of uncertain parameters: the parameters that vary ([`Input`]), the numbers that a run is reduced to ([`Output`]), the
//! runs at given values ([`StudyRuns`]), and what follows from them ([`sensitivity()`], [`tolerance()`]). The caller schedules the
//! runs, as it does those of any [`Sweep`].

mod alone;
mod candidates;
mod inputs;
mod outputs;
mod runner;
mod sensitivity;
mod target;
mod tolerance;

pub use alone::{Alone, AloneOutputs, ENDS};
pub use candidates::{Candidate, CandidateRequest, Candidates, candidates};
pub use inputs::{Input, Uncertainty, inputs, matching};
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

/// Observed periods of a driven scene, and time of another, s, if no duration is given.
const PERIODS: f64 = 2.0;
const UNDRIVEN: f64 = 1.0;

/// Why there is no such study.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StudyError {
    /// One of the requested parameters.
    #[error(fmt = at)]
    At {
        /// Option, or file with line.
        place: String,
        /// What is wrong there.
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
        /// The nearest key, in words; empty for none.
        nearest: String,
    },
    /// A parameter whose values are words or counts.
    #[error("its values are no real numbers")]
    NotReal,
    /// A parameter without a distribution, and whose value gives none.
    #[error("is {value} in the scene, and half to one and a half of that is no range: give one, KEY=A..B")]
    NoRange {
        /// Its value in the scene, with its unit.
        value: String,
    },
    /// Not a value of the parameter.
    #[error(transparent)]
    Read(#[from] ValueError),
    /// A distribution that does not exist.
    #[error(transparent)]
    Distribution(#[from] DistributionError),
    /// An end of a distribution that the parameter does not accept.
    #[error("{value}: {error}")]
    End {
        /// The end, with its unit.
        value: String,
        /// What is allowed.
        error: ValueError,
    },
    /// An end of a distribution that the scene does not accept.
    #[error("{value}: {why}")]
    NoEnd {
        /// The end, with its unit.
        value: String,
        /// What is wrong and what is allowed.
        why: String,
    },
    /// More parameters than a study varies.
    #[error("{found} uncertain parameters; at most {most} are possible")]
    TooMany {
        /// Requested parameters.
        found: usize,
        /// Most of them.
        most: usize,
    },
    /// An unknown output, channel or statistic.
    #[error(fmt = of_output)]
    Output {
        /// As written.
        entry: String,
        /// What is wrong.
        error: StatisticError,
    },
    /// An output that is requested twice.
    #[error("{name}: given twice ({position} and before)")]
    Twice {
        /// Its name.
        name: String,
        /// Position of the repetition, from 1.
        position: usize,
    },
    /// A drawn value that the parameter does not accept, which a distribution without limits does not exclude.
    #[error(
        "{key}: {value}: {error}; a distribution with limits, such as normal(MEAN, SD, LOW..HIGH), draws no such value"
    )]
    Drawn {
        /// Parameter.
        key: String,
        /// The value, with its unit.
        value: String,
        /// What is allowed.
        error: ValueError,
    },
    /// Values that define no runs.
    #[error(transparent)]
    Range(#[from] RangeError),
    /// Runs that define no sweep.
    #[error(transparent)]
    Sweep(#[from] SweepError),
    /// A number that an argument does not accept.
    #[error(fmt = of_argument)]
    Argument {
        /// The argument.
        argument: Argument,
        /// The number.
        value: usize,
        /// What is wrong.
        error: Box<Self>,
    },
    /// Fewer rows than indices need.
    #[error("allowed at least {MIN_ROWS}, or 0 for no indices")]
    TooFewRows,
    /// No design for indices.
    #[error(transparent)]
    Indices(#[from] IndicesError),
    /// No screening.
    #[error(transparent)]
    Screening(#[from] MorrisError),
    /// No sample.
    #[error(transparent)]
    Sampling(#[from] SamplingError),
    /// No statistics of a lot.
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
        /// The later one, as written.
        text: String,
    },
    /// No search of the cheapest fits.
    #[error(fmt = of_fits)]
    Fits(FitSearchError),
}

fn at(place: &str, error: &StudyError, f: &mut Formatter<'_>) -> std::fmt::Result {
    write!(f, "{place}: ")?;
    error.fmt(f)
}

fn of_output(entry: &str, error: &StatisticError, f: &mut Formatter<'_>) -> std::fmt::Result {
    // An error about the entry itself begins with it; one about what its name stands for does not.
    if error.text() != Some(entry) {
        write!(f, "{entry}: ")?;
    }
    write!(f, "{error}; outputs by name: {}", NAMED.map(|named| named.name).join(", "))
}

fn of_argument(argument: &Argument, value: &usize, error: &StudyError, f: &mut Formatter<'_>) -> std::fmt::Result {
    argument.write(value, f)?;
    f.write_str(": ")?;
    error.fmt(f)
}

fn of_fits(error: &FitSearchError, f: &mut Formatter<'_>) -> std::fmt::Result {
    Argument::Cost.fmt(f)?;
    write!(f, ": {error}")
}

impl StudyError {
    /// The same, with the place at fault.
    pub(crate) fn at(self, place: &str) -> Self {
        Self::At { place: place.to_owned(), error: Box::new(self) }
    }

    /// Of the number `value` that `argument` gives.
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
    /// Three periods of the drives of `scene`, the first a transient; or a second from the start, without a common period.
    pub fn of(scene: &Scene) -> Self {
        match common_period(&scene.machine) {
            Ok(Some(period)) => Self { duration: (1.0 + PERIODS) * period, from: period },
            _ => Self { duration: UNDRIVEN, from: 0.0 },
        }
    }
}

/// The runs of a scene at given values of its inputs.
#[derive(Clone, Debug)]
pub struct StudyRuns {
    sweep: Sweep,
    outputs: Vec<Output>,
    /// Columns of a record from which each output follows.
    columns: Vec<Vec<usize>>,
}

impl StudyRuns {
    /// A run for each of `rows`, which give each of `keys` a value, SI. All start cold from the scene's own start.
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
                parameter.check(&value).map_err(|error| StudyError::Drawn {
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

    /// The outputs of a run from its record, SI; NaN if it did not start or diverged.
    pub fn outputs_of(&self, record: &[f64]) -> Vec<f64> {
        let outputs = self.outputs.iter().zip(&self.columns);
        outputs.map(|(output, columns)| output.value(columns.iter().map(|&at| record[at]))).collect()
    }
}

/// The recorded quantities that `outputs` follow from.
fn protocol(outputs: &[Output], span: Span) -> Protocol {
    let mut keep = Vec::new();
    for one in outputs.iter().flat_map(Output::statistics) {
        if !keep.contains(one) {
            keep.push(one.clone());
        }
    }
    let joints = outputs.iter().any(|output| output.statistics().is_empty());
    Protocol { span, keep, joints }
}
