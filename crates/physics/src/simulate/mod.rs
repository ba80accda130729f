//! A running simulation: state, stepping, live changes, recorded channels, divergence guard.

mod angles;
mod channels;
mod doubt;
mod frame;
mod history;
mod impacts;
mod ledger;
mod load_peaks;
mod pace;
mod peaks;
mod report;
mod simulation;
mod stepper;
mod stopped;
mod wear;

pub use angles::angles_of;
pub use channels::*;
pub use doubt::{Doubt, Joints, LedgerTerm};
pub use frame::*;
pub use history::{Bin, History, Mark};
pub use impacts::Impact;
pub use ledger::Ledger;
pub use load_peaks::{LoadPeak, LoadPeaks};
pub use pace::{LONGEST_FRAME, Limit, Pacer, REST, SCALE_RANGE, SPELL};
pub use simulation::ideal::{ProbeFault, closed};
pub use simulation::live::{ChangeError, differs_in_conditions_alone};
pub use simulation::saved::{Misfit, SavedState};
pub use simulation::{CLEARANCE_SPEED, Simulation};
pub use stopped::{StopAdvice, StopFault, Stopped};
pub use wear::{Cell, Edges, Grid, Wear};

use serde::{Deserialize, Serialize};

use std::sync::Arc;

pub use crate::mechanism::Pull;
use crate::mechanism::{CostOf, Counts, MechanismError, Structure};
use crate::scene::{Scene, SceneError};

/// The longest run, s: at its end a double still resolves 0.1 ns.
pub const LONGEST_RUN: f64 = 1e6;

/// Why a simulation could not start.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct StartError(#[from] pub MechanismError);

impl StartError {
    /// The same error, with the line of `scene`'s file and the change that it concerns.
    pub fn located(&self, scene: &Scene) -> SceneError {
        let one = |joint: &str, parts: &[&str]| {
            let mut keys = ["spcmm.", "parameter.", "formulation", "start"].map(str::to_owned).to_vec();
            for part in parts {
                keys.push(format!("contact.{part}"));
                keys.push(format!("joint.{joint}.{part}"));
            }
            (format!("joint.{joint}"), keys)
        };
        let (title, keys) = match &self.0 {
            MechanismError::Unreachable(_) | MechanismError::OtherBranch | MechanismError::Singular => {
                ("spcmm".to_owned(), vec!["spcmm.".to_owned()])
            }
            MechanismError::Open { given: gap }
            | MechanismError::NoClosure { given: gap, .. }
            | MechanismError::InconsistentDrives { rate: gap } => one(&gap.joint, &["clearance"]),
            MechanismError::OutsideSocket { joint, .. } => one(joint, &["clearance", "ball_radius"]),
            MechanismError::TooLarge { .. } | MechanismError::TooCostly { .. } => {
                let keys = ["solver.method", "chain.links", "formulation"];
                let of_form = matches!(self.0, MechanismError::TooCostly { of: CostOf::Formulation(_), .. });
                let title = if of_form { keys[2] } else { keys[0] };
                (title.to_owned(), keys.map(str::to_owned).to_vec())
            }
            MechanismError::Branching { joints } => one(joints.first().map_or("", String::as_str), &["clearance"]),
        };
        scene.start_error(&title, &keys, self.to_string())
    }
}

/// When a changed parameter takes effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    /// From the next step on.
    Now,
    /// At the next reset.
    AtReset,
}

/// Forces that the motion does not determine, because ideal joints constrain a direction redundantly: the values reported
/// are the least-squares reactions and what follows from them.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct NotUnique {
    /// Ball joints, by index; joints that close loops count after them.
    pub reactions: Vec<usize>,
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
    /// Rejected steps.
    pub rejected: u64,
    /// Steps that ended at a corner of the friction law.
    pub corners: u64,
    /// Contacts begun, per ball joint.
    pub impacts: Vec<u64>,
    /// Contacts that ended and had begun slower than the scene's `impact_speed_floor` or existed at the start, per ball joint:
    /// they rebounded higher than asked.
    pub floored: Vec<u64>,
    /// Contacts that ended after fewer fixed steps than needed to resolve one, per ball joint; 0 with an adaptive method.
    pub coarse: Vec<u64>,
    /// Deepest penetration at which a contact was found whose beginning should have been located, per ball joint, m; 0 if all
    /// were, or with fixed steps.
    pub late: Vec<f64>,
    /// The undisturbed impact whose restitution exceeds that of its law most, if any does, per ball joint.
    pub astray: Vec<Option<Impact>>,
    /// Largest continuous-time normal force (reaction of an ideal joint), per ball joint, N.
    pub peak_normal: Vec<f64>,
    /// When it occurred, per ball joint, s.
    pub peak_time: Vec<f64>,
    /// Time of the last separation, if any, per ball joint, s.
    pub last_separation: Vec<Option<f64>>,
    /// Simulated time that an explicit adaptive method spent in steps limited by stability, s.
    pub stability_limited_time: f64,
    /// Largest ratio of damping to elastic force in any contact, per ball joint.
    pub damping: Vec<f64>,
    /// When it occurred, per ball joint, s.
    pub damping_time: Vec<f64>,
    /// Largest constraint violation of the `lagrange` form so far, m (rad for orientation rows).
    pub constraint_drift: f64,
}

impl Statistics {
    fn new(joints: usize) -> Self {
        Self {
            impacts: vec![0; joints],
            floored: vec![0; joints],
            coarse: vec![0; joints],
            late: vec![0.0; joints],
            astray: vec![None; joints],
            peak_normal: vec![0.0; joints],
            peak_time: vec![0.0; joints],
            last_separation: vec![None; joints],
            damping: vec![0.0; joints],
            damping_time: vec![0.0; joints],
            ..Self::default()
        }
    }

    /// Whether they are of a scene with `joints` ball joints.
    fn fits(&self, joints: usize) -> bool {
        self.impacts.len() == joints
            && self.floored.len() == joints
            && self.coarse.len() == joints
            && self.late.len() == joints
            && self.astray.len() == joints
            && self.peak_normal.len() == joints
            && self.peak_time.len() == joints
            && self.last_separation.len() == joints
            && self.damping.len() == joints
            && self.damping_time.len() == joints
    }

    fn count(&mut self, counts: Counts) {
        self.evaluations += counts.equations;
        self.contact_evaluations += counts.contacts;
        self.friction_evaluations += counts.friction;
    }
}

/// The whole state of a simulation: resuming from it reproduces the same bits.
#[derive(Debug, Clone)]
pub struct Snapshot {
    scene: Arc<Scene>,
    running: Arc<Scene>,
    structure: Structure,
    state: simulation::State,
    polynomial: Option<crate::integrate::Polynomial>,
    reference: simulation::ideal::Reference<simulation::ideal::Kept>,
}

impl Snapshot {
    /// Time of the state, s.
    pub fn time(&self) -> f64 {
        self.state.time()
    }

    /// Accepted steps up to it.
    pub fn steps(&self) -> u64 {
        self.state.steps()
    }

    /// Approximate size in bytes, without the shared scene.
    pub fn bytes(&self) -> usize {
        self.state.bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::built_in_text;

    fn start_error(text: &str, changes: &[(&str, &str)]) -> SceneError {
        let own = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
        let changes: Vec<(String, String)> = changes.iter().map(own).collect();
        let scene = Scene::parse(text, Some("mine.toml"), &changes).expect("reads");
        let error = Simulation::new(&scene).err().expect("cannot start");
        error.located(&scene)
    }

    #[test]
    fn a_start_error_points_to_its_line_and_names_the_change() {
        let text = built_in_text("spcmm").expect("built in");
        let line_of = |text: &str, what: &str| {
            let at = text.lines().position(|line| line == what);
            at.map(|at| at as u32 + 1)
        };
        let far = text.replace("amplitude_x = \"25 mm\"", "amplitude_x = \"200 mm\"");
        let error = start_error(&far, &[]);
        assert_eq!(error.position.map(|p| p.0), line_of(text, "[spcmm]"));
        assert_eq!(error.line_text.as_deref(), Some("[spcmm]"));
        let error = start_error(text, &[("spcmm.amplitude_x", "200 mm")]);
        assert_eq!(error.key.as_deref(), Some("spcmm.amplitude_x"));
        assert!(error.to_string().starts_with("mine.toml:"), "{error}");

        let text = built_in_text("slider-crank").expect("built in");
        let open = text.replace("at = \"0 0 80 mm\"", "at = \"0 0 380 mm\"");
        let error = start_error(&open, &[]);
        assert_eq!(error.position.map(|p| p.0), line_of(text, "[[ball_joint]]"));
        assert!(error.to_string().contains("ball joint B"), "{error}");
    }

    #[test]
    fn values_as_given_are_not_turned_to_the_closed_form() {
        let text = built_in_text("spcmm").expect("built in");
        let given = text
            .replace("start = \"ideal\"", "start = \"as-given\"")
            .replace("0.4106585548949 rad", "0.4111585548949 rad");
        let scene = Scene::parse(&given, None, &[]).expect("reads");
        let mut simulation = Simulation::new(&scene).expect("starts");
        let mut frame = Frame::default();
        simulation.sample(0.0, &mut frame);
        let eccentricities = frame.joints.iter().map(|joint| joint.eccentricity.norm());
        let most = eccentricities.fold(0.0, f64::max);
        // Half a milliradian at the end of a rod of 200 mm.
        assert!((most / 0.1e-3 - 1.0).abs() < 0.01, "{most}");
    }
}
