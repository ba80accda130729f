//! A target instant of a run, and why the run may not reach it.

use crate::scene::SetError;
use crate::simulate::{Simulation, Stopped};

/// An instant of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// Accepted steps before it; `None` if only its time determines them.
    pub steps: Option<u64>,
    /// Time within the last of these steps, s; infinite for the end of the step.
    pub time: f64,
}

impl Goal {
    /// The instant `time`, s.
    pub fn at(time: f64) -> Self {
        Self { steps: None, time }
    }

    /// The end of step number `steps`.
    pub fn after(steps: u64) -> Self {
        Self { steps: Some(steps), time: f64::INFINITY }
    }

    /// Whether `run` has taken all steps before it.
    pub fn is_reached(&self, run: &Simulation) -> bool {
        self.steps.map_or(run.time() >= self.time, |steps| run.statistics().steps >= steps)
    }

    /// Whether the goal is at or after the state at `time`, s, that `steps` steps led to.
    pub fn is_ahead_of(&self, steps: u64, time: f64) -> bool {
        self.steps.map_or(time <= self.time, |goal| steps <= goal)
    }
}

/// Why a run does not reach an instant.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Obstacle {
    /// The divergence guard stopped the run.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// A logged event is not accepted.
    #[error(transparent)]
    Refused(#[from] SetError),
    /// A step was accepted, although the log records that it was refused.
    #[error("the run does not stop where the link's run did")]
    MissedStop,
}
