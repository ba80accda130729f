//! A running simulation: state, stepping, live changes, recorded channels, divergence guard.

mod channels;
mod frame;
mod history;
mod pace;

pub use channels::*;
pub use frame::*;
pub use history::History;
pub use pace::{LARGEST_BUDGET, LONGEST_FRAME, Pacer, SCALE_RANGE};

use crate::scene::Scene;

/// A scene in motion.
///
/// Depends on no clock: the same scene and the same calls give the same bits.
pub struct Simulation {
    scene: Scene,
}

/// Why a simulation could not start.
#[derive(Debug, Clone, thiserror::Error)]
#[error("{0}")]
pub struct StartError(pub String);

/// Why a simulation stopped: the divergence guard. The state is the last good one.
#[derive(Debug, Clone, thiserror::Error)]
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
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Statistics {
    /// Accepted steps.
    pub steps: u64,
    /// Evaluations of the equations of motion.
    pub evaluations: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Contacts begun, per ball joint.
    pub impacts: Vec<u64>,
    /// Largest continuous-time normal force (reaction of an ideal joint), per ball joint, N.
    pub peak_normal: Vec<f64>,
    /// When it occurred, per ball joint, s.
    pub peak_time: Vec<f64>,
    /// Time of the last separation, per ball joint, s; NaN if none.
    pub last_separation: Vec<f64>,
    /// Largest constraint drift seen, m (rad for orientation rows); 0 where the scene has no constraint.
    pub constraint_drift: f64,
}

/// The whole state: restoring it resumes with the same bits.
#[derive(Debug, Clone, PartialEq)]
pub struct Snapshot {
    // filled by the simulation core
}

impl Simulation {
    /// Starts `scene` at t = 0.
    ///
    /// # Errors
    /// Ball joints that do not close, a trajectory that the rods cannot reach, a scene the formulation cannot hold.
    pub fn new(_scene: &Scene) -> Result<Self, StartError> {
        todo!()
    }

    /// The scene as it runs, live changes applied.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Time of the latest state, s.
    pub fn time(&self) -> f64 {
        todo!()
    }

    /// Time at the start of the latest step, s: [`Self::sample`] accepts times from here to [`Self::time`].
    pub fn step_start(&self) -> f64 {
        todo!()
    }

    /// One accepted step.
    ///
    /// # Errors
    /// The divergence guard; the state is then the last good one.
    pub fn step(&mut self) -> Result<(), Stopped> {
        todo!()
    }

    /// Steps until [`Self::time`] is at least `time`, never shortening a step.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn advance_to(&mut self, _time: f64) -> Result<(), Stopped> {
        todo!()
    }

    /// One step that ends at `end` at the latest, exactly there if it would pass it.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn step_until(&mut self, _end: f64) -> Result<(), Stopped> {
        todo!()
    }

    /// Everything at `time`, interpolated within the latest step; forces come from the interpolated state.
    /// Allocates only while `out` is too small.
    pub fn sample(&mut self, _time: f64, _out: &mut Frame) {
        todo!()
    }

    /// Peaks per ball joint since the last call, written to `out` in joint order, and forgotten here.
    pub fn take_peaks(&mut self, _out: &mut Vec<Peak>) {
        todo!()
    }

    /// Changes a parameter (`contact.clearance`, `joint.S1.friction`, …) to a value as a user writes it.
    ///
    /// # Errors
    /// Unknown key, bad unit, out of range: the running simulation is unchanged.
    pub fn set(&mut self, _key: &str, _value: &str) -> Result<Effect, crate::scene::SceneError> {
        todo!()
    }

    /// Back to t = 0 with the parameters as they are now, those that wait for a reset included.
    ///
    /// # Errors
    /// As [`Self::new`]; the simulation is then unchanged.
    pub fn reset(&mut self) -> Result<(), StartError> {
        todo!()
    }

    /// The whole state.
    pub fn snapshot(&self) -> Snapshot {
        todo!()
    }

    /// Goes back to a state of this scene.
    pub fn restore(&mut self, _snapshot: &Snapshot) {
        todo!()
    }

    /// Counters since the last reset.
    pub fn statistics(&self) -> &Statistics {
        todo!()
    }

    /// FNV-1a (64 bit) over the bits of the whole state, contact memory included.
    pub fn state_hash(&self) -> u64 {
        todo!()
    }
}
