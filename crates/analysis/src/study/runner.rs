//! Who makes the runs of a study.

use super::{Input, Output, StudyError};

/// Makes the runs of a study, one stage after the other.
pub trait StudyRunner {
    /// Why a stage ended early.
    type Error: From<StudyError>;

    /// Varied parameters.
    fn inputs(&self) -> &[Input];

    /// Numbers to which a run is reduced.
    fn outputs(&self) -> &[Output];

    /// The outputs at each of `rows`, which give every input a value, SI. NaN where a run does not start or diverges.
    ///
    /// # Errors
    /// A row that the scene does not accept; whatever ends the runs.
    fn run(&mut self, stage: &str, rows: Vec<Vec<f64>>) -> Result<Vec<Vec<f64>>, Self::Error>;
}
