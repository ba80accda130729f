//! A running simulation: state, stepping, live changes, recorded channels, divergence guard.

mod angles;
mod channels;
mod frame;
mod history;
mod pace;
mod peaks;
mod report;
mod simulation;
mod stepper;

pub use angles::angles_of;
pub use channels::*;
pub use frame::*;
pub use history::History;
pub use pace::{LARGEST_BUDGET, LONGEST_FRAME, Pacer, SCALE_RANGE};
pub use simulation::{CLEARANCE_SPEED, Simulation};

use crate::mechanism::MechanismError;
use crate::scene::Scene;

/// Why a simulation could not start.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct StartError(#[from] pub MechanismError);

/// Why a simulation stopped: the divergence guard. The state is the last good one.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("stopped at t = {time:.6e} s: {what}; {advice}")]
pub struct Stopped {
    /// Time of the last good state, s.
    pub time: f64,
    /// Which body or joint, and what it did.
    pub what: String,
    /// What to try.
    pub advice: String,
}

/// When a changed parameter takes effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    /// From the next step on.
    Now,
    /// At the next reset.
    AtReset,
}

/// Counters since the last reset.
#[derive(Debug, Clone, Default)]
pub struct Statistics {
    /// Accepted steps.
    pub steps: u64,
    /// Evaluations of the equations of motion.
    pub evaluations: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Contacts begun, per ball joint.
    pub impacts: Vec<u64>,
    /// Contacts that began slower than the scene's `impact_speed_floor` or existed at the start, per ball joint: they
    /// rebound higher than asked.
    pub floored: Vec<u64>,
    /// Largest continuous-time normal force (reaction of an ideal joint), per ball joint, N.
    pub peak_normal: Vec<f64>,
    /// When it occurred, per ball joint, s.
    pub peak_time: Vec<f64>,
    /// Time of the last separation, per ball joint, s; NaN if none.
    pub last_separation: Vec<f64>,
    /// Largest constraint violation of the `lagrange` form so far, m (rad for orientation rows).
    pub constraint_drift: f64,
}

impl PartialEq for Statistics {
    /// Bit by bit, so that "no separation yet" equals itself.
    fn eq(&self, other: &Self) -> bool {
        let bits = |v: &[f64]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        (self.steps, self.evaluations, self.rejected)
            == (other.steps, other.evaluations, other.rejected)
            && self.impacts == other.impacts
            && self.floored == other.floored
            && bits(&self.peak_normal) == bits(&other.peak_normal)
            && bits(&self.peak_time) == bits(&other.peak_time)
            && bits(&self.last_separation) == bits(&other.last_separation)
            && self.constraint_drift.to_bits() == other.constraint_drift.to_bits()
    }
}

/// The whole state of a simulation: restoring it resumes with the same bits.
#[derive(Debug, Clone)]
pub struct Snapshot {
    scene: Scene,
    running: Scene,
    state: simulation::State,
    polynomial: Option<crate::integrate::Polynomial>,
}

impl Snapshot {
    /// The scene it belongs to, as it ran.
    pub fn running_scene(&self) -> &Scene {
        &self.running
    }
}
