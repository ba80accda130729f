//! Clock and progress callback supplied by the caller of an analysis.

use std::ops::ControlFlow;

use jointplay_physics::simulate::{ChangeError, StartError, Stopped};
use jointplay_scene::SceneError;

/// Clock and progress callback from the caller of an analysis: the command line, a background thread or a worker in a browser.
pub struct RunContext<'a> {
    clock: &'a mut dyn FnMut() -> f64,
    progress: &'a mut dyn FnMut(f64) -> ControlFlow<()>,
    /// Start of the current part, as a fraction of the whole.
    from: f64,
    /// End of the current part, as a fraction of the whole.
    to: f64,
}

impl<'a> RunContext<'a> {
    /// `clock` returns seconds from any origin; `progress` receives the fraction done, 0 to 1, some thousand times, and
    /// may cancel.
    pub fn new(clock: &'a mut dyn FnMut() -> f64, progress: &'a mut dyn FnMut(f64) -> ControlFlow<()>) -> Self {
        Self { clock, progress, from: 0.0, to: 1.0 }
    }

    /// Seconds on the clock.
    pub(super) fn now(&mut self) -> f64 {
        (self.clock)()
    }

    /// Reports `fraction` of the current part as done; the caller receives the fraction of the whole.
    ///
    /// # Errors
    /// [`AnalysisError::Cancelled`] if the caller cancelled.
    pub(super) fn report_progress(&mut self, fraction: f64) -> Result<(), AnalysisError> {
        let fraction = self.from + (self.to - self.from) * fraction.clamp(0.0, 1.0);
        match (self.progress)(fraction) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(AnalysisError::Cancelled),
        }
    }

    /// The context of one of `parts` equal parts of the current one.
    pub fn part(&mut self, index: usize, parts: usize) -> RunContext<'_> {
        let share = (self.to - self.from) / parts.max(1) as f64;
        let from = self.from + share * index as f64;
        RunContext { clock: &mut *self.clock, progress: &mut *self.progress, from, to: from + share }
    }
}

/// Reasons why an analysis has no result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum AnalysisError {
    /// The caller cancelled the analysis.
    #[error("cancelled")]
    Cancelled,
    /// The scene does not start.
    #[error(transparent)]
    Start(#[from] StartError),
    /// A parameter that the scene does not accept.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A setting that the simulation does not accept.
    #[error(transparent)]
    Setting(#[from] ChangeError),
    /// The divergence guard stopped the reference run.
    #[error("cannot compute the reference run: {0}")]
    Stopped(#[from] Stopped),
    /// The reference run reached the work limit.
    #[error(
        "the reference run costs more than {cost:e} evaluations of the equations: the scene is too large to be measured"
    )]
    TooLong {
        /// The limit.
        cost: f64,
    },
}
