//! What an analysis needs from outside: a clock, and leave to go on.

use std::ops::ControlFlow;

use crate::scene::SceneError;
use crate::simulate::{StartError, Stopped};

/// Clock and progress of whoever asked for an analysis: the command line, a background thread, a worker in a browser.
pub struct RunContext<'a> {
    clock: &'a mut dyn FnMut() -> f64,
    progress: &'a mut dyn FnMut(f64) -> ControlFlow<()>,
    /// Part of the whole that is being done, as fractions of it.
    from: f64,
    to: f64,
}

impl<'a> RunContext<'a> {
    /// `clock` gives seconds from any start; `progress` takes the fraction done, 0 to 1, some thousand times, and may break
    /// off.
    pub fn new(
        clock: &'a mut dyn FnMut() -> f64,
        progress: &'a mut dyn FnMut(f64) -> ControlFlow<()>,
    ) -> Self {
        Self {
            clock,
            progress,
            from: 0.0,
            to: 1.0,
        }
    }

    /// Seconds by the clock.
    pub(super) fn now(&mut self) -> f64 {
        (self.clock)()
    }

    /// Reports how much of the current part is done.
    ///
    /// # Errors
    /// [`AnalysisError::Cancelled`] where it may not go on.
    pub(super) fn go_on(&mut self, done: f64) -> Result<(), AnalysisError> {
        let fraction = self.from + (self.to - self.from) * done.clamp(0.0, 1.0);
        match (self.progress)(fraction) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(AnalysisError::Cancelled),
        }
    }

    /// The same for one of `parts` equal parts of the current one.
    pub fn part(&mut self, index: usize, parts: usize) -> RunContext<'_> {
        let share = (self.to - self.from) / parts.max(1) as f64;
        let from = self.from + share * index as f64;
        RunContext {
            clock: &mut *self.clock,
            progress: &mut *self.progress,
            from,
            to: from + share,
        }
    }
}

/// Why an analysis has no result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum AnalysisError {
    /// Whoever asked for it broke it off.
    #[error("cancelled")]
    Cancelled,
    /// The scene does not start.
    #[error(transparent)]
    Start(#[from] StartError),
    /// A setting that the scene does not take.
    #[error(transparent)]
    Setting(#[from] SceneError),
    /// The run that all others are measured against was stopped by the divergence guard.
    #[error("the reference run cannot be made: {0}")]
    Stopped(#[from] Stopped),
    /// The same, within the cap on work.
    #[error(
        "the reference run takes more than {evaluations} evaluations of the equations: the scene is too large to be measured"
    )]
    TooLong {
        /// The cap.
        evaluations: u64,
    },
}
