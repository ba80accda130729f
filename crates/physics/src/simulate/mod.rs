//! Simulation: a constant [`Model`], a [`State`] and a [`Workspace`]; stepping, live changes, recorded channels, divergence
//! guard.

mod angles;
mod channels;
mod doubt;
mod frame;
mod impacts;
mod ledger;
mod load_peaks;
mod peaks;
mod report;
mod simulation;
mod stepper;
mod stopped;
mod wear;

pub use angles::angles_of;
pub use channels::*;
pub use doubt::{AffectedJoints, Doubt, LedgerTerm};
pub use frame::*;
pub use impacts::{ForcePeak, Impact, ImpactEvent};
pub use ledger::Ledger;
pub use load_peaks::{LoadPeak, LoadPeaks};
pub use simulation::{
    CLEARANCE_SPEED, ChangeError, Linearisation, Model, ProbeFault, RestartError, Simulation, Snapshot, State,
    StateMismatch, Workspace, closed,
};
pub use stopped::{StopAdvice, StopFault, Stopped};
pub use wear::{Cell, Wear};

use serde::{Deserialize, Serialize};

use crate::machine::Vec3;
pub use crate::mechanism::Coordinate;
use crate::mechanism::{Counts, MechanismError};
pub use crate::mechanism::{Division, Edges, Grid, Part, Pull, Shape, Spot};

/// The longest run, s: at its end a double still resolves 0.1 ns.
pub const MAX_RUN_DURATION: f64 = 1e6;

/// Error in starting a simulation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct StartError(#[from] pub MechanismError);

/// When a changed parameter takes effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    /// From the next step on.
    Now,
    /// At the next reset.
    AtReset,
}

/// Forces that the motion does not determine, because ideal joints constrain a direction redundantly. The values reported are the
/// least-squares reactions and the forces that follow from them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Indeterminate {
    /// Joints with play, by index; joints that close loops count after them.
    pub reactions: Vec<usize>,
    /// For each of these, the directions in which its force, and about which its torque, is indeterminate: orthogonal unit vectors,
    /// world axes. Across them the load is unique.
    pub directions: Vec<[Vec<Vec3>; 2]>,
    /// Actuators, by index among the driven joints.
    pub actuators: Vec<usize>,
}

/// Counters since the last reset.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Statistics {
    /// Accepted steps.
    pub steps: u64,
    /// Evaluations of the equations of motion.
    pub evaluations: u64,
    /// Evaluations of all contacts at one instant; 0 in a scene without clearance.
    pub contact_evaluations: u64,
    /// Evaluations of the friction of one contact; 0 in a scene without friction.
    pub friction_evaluations: u64,
    /// Linear algebra of implicit steps and of coupled contacts, in ns of a standard processor: counted, not measured.
    pub algebra: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Steps that ended at a corner of the friction law.
    pub corners: u64,
    /// Simulated time that an explicit adaptive method spent in steps limited by stability, s.
    pub stability_limited_time: f64,
    /// Largest constraint violation of the `lagrange` form so far, m (rad for orientation rows).
    pub constraint_drift: f64,
    /// Of each joint with play.
    pub joints: Vec<JointStatistics>,
}

/// What has happened in one joint with play since the last reset.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct JointStatistics {
    /// Contacts begun.
    pub impacts: u64,
    /// Finished contacts that began slower than the scene's `impact_speed_floor` or existed at the start: they rebounded higher than
    /// requested.
    pub below_speed_floor: u64,
    /// Contacts that lasted fewer fixed steps than needed to resolve one; 0 with an adaptive method.
    pub coarse: u64,
    /// Deepest penetration at which a contact was found although its beginning should have been located, m; 0 if all were, or with
    /// fixed steps.
    pub late: f64,
    /// The undisturbed impact whose restitution most exceeds its law's prediction, if any does.
    pub excessive_rebound: Option<Impact>,
    /// Largest continuous-time normal force (reaction, if the joint is ideal), N.
    pub peak_normal: f64,
    /// When it occurred, s.
    pub peak_time: f64,
    /// Time of the last separation, if any, s.
    pub last_separation: Option<f64>,
    /// Largest ratio of damping to elastic force in any contact.
    pub damping: f64,
    /// Where that ratio most exceeded the one of an undisturbed impact.
    pub overdamped: Overdamped,
    /// Largest displacement along the axis of a pin with a travel, m.
    pub axial: f64,
}

/// Ratio of damping to elastic force at an instant of a contact.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Overdamped {
    /// s.
    pub time: f64,
    /// The ratio.
    pub ratio: f64,
    /// Its largest value in an undisturbed impact at the approach speed of the contact.
    pub usual: f64,
}

impl Overdamped {
    /// How far the ratio is above the usual one.
    pub(crate) fn excess(&self) -> f64 {
        self.ratio - self.usual
    }
}

impl Statistics {
    fn new(joints: usize) -> Self {
        Self { joints: vec![JointStatistics::default(); joints], ..Self::default() }
    }

    /// Contacts begun in all joints.
    pub fn impacts(&self) -> u64 {
        self.joints.iter().map(|joint| joint.impacts).sum()
    }

    fn count(&mut self, counts: Counts) {
        self.evaluations += counts.equations;
        self.contact_evaluations += counts.contacts;
        self.friction_evaluations += counts.friction;
        self.algebra += counts.algebra;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::{Attachment, Body, Joint, LooseJoint, Machine, MachineFault, Mat3, Vec3};

    #[test]
    fn an_inconsistent_machine_does_not_start() {
        let fault = |machine: &Machine| Simulation::new(machine).err().map(|error| error.0);
        assert_eq!(fault(&Machine::default()), Some(MechanismError::Machine(MachineFault::Empty)));
        let mut machine = Machine::default();
        machine.add_body(Body::new("bob", 0.4, Mat3::identity() * 1e-3), Joint::free(0));
        assert_eq!(fault(&machine), None);
        let [socket, ball] = [Attachment::on(0, Vec3::zeros()), Attachment::on(7, Vec3::zeros())];
        machine.loose_joints.push(LooseJoint::ball("S2", socket, ball));
        let beyond = MachineFault::NoBody { what: "S2".to_owned(), body: 7, bodies: 1 };
        assert_eq!(fault(&machine), Some(MechanismError::Machine(beyond)));
    }
}
