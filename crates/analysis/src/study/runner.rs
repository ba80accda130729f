//! Interface for executing the runs of a study.

use super::{Input, Output, StudyError};

/// Executes the runs of a study, stage by stage.
pub trait StudyRunner {
    /// Reason why a stage ended early.
    type Error: From<StudyError>;

    /// Varied parameters.
    fn inputs(&self) -> &[Input];

    /// Scalar results of a run.
    fn outputs(&self) -> &[Output];

    /// The outputs for each of `rows`, which hold a value for every input, SI. NaN where a run does not start or diverges.
    ///
    /// # Errors
    /// A row that the scene does not accept, or another reason that ends the runs early.
    fn run(&mut self, stage: &str, rows: Vec<Vec<f64>>) -> Result<Vec<Vec<f64>>, Self::Error>;
}
