//! Pulling hand: a spring and damper between a point of a body and the hand. The hand is outside the scene, so all its work is
//! external.

use serde::{Deserialize, Serialize};

use super::{At, ElementReport, ForceElement, Loads, Powers, point_of, push};
use crate::machine::{Machine, Vec3};
use crate::mechanism::kinematics::Kinematics;
use crate::mechanism::model::Anchor;

/// Natural frequency of the total moving mass on the spring, Hz: soft enough for every method, yet a hand movement yields a few
/// times the weight.
const FREQUENCY: f64 = 3.0;
/// Damping ratio of that oscillation.
const DAMPING: f64 = 0.3;

/// A pull of the hand on a body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pull {
    /// Body, by its index in the scene.
    pub body: usize,
    /// Point on the body, in its scene frame, m.
    pub point: Vec3,
    /// Position of the hand, world axes, m.
    pub hand: Vec3,
    /// Spring stiffness, N/m.
    pub stiffness: f64,
    /// Damping of the point's absolute velocity, N s/m.
    pub damping: f64,
}

pub(super) struct Hand {
    pub on: Anchor,
    pub pull: Pull,
}

impl Pull {
    /// A pull on `point` (m, scene frame) of body `body` by the hand at `hand` (m, world), with stiffness and damping from the
    /// total mass.
    pub fn with_soft_spring(machine: &Machine, body: usize, point: Vec3, hand: Vec3) -> Self {
        let mass: f64 = machine.bodies.iter().map(|body| body.mass).sum();
        let rate = std::f64::consts::TAU * FREQUENCY;
        Self { body, point, hand, stiffness: mass * rate * rate, damping: 2.0 * DAMPING * mass * rate }
    }

    /// Report for a given position (m) and velocity (m/s) of the point, drawn from the hand to the point.
    pub fn report(&self, point: Vec3, velocity: Vec3) -> ElementReport {
        ElementReport {
            points: [self.hand, point],
            force: self.stiffness * (self.hand - point) - self.damping * velocity,
            ..ElementReport::default()
        }
    }
}

impl Hand {
    /// Report, velocity of the point, and its arm from the centroid.
    fn at(&self, motion: &[Kinematics]) -> (ElementReport, Vec3, Vec3) {
        let (point, velocity, arm) = point_of(&self.on, motion);
        (self.pull.report(point, velocity), velocity, arm)
    }
}

// Soft by design: there is nothing for an implicit method to linearise.
impl ForceElement for Hand {
    fn load(&mut self, at: &At<'_>, loads: &mut Loads<'_>) {
        let (report, _, arm) = self.at(at.motion);
        push(&mut loads.wrench[self.on.body], &arm, &report.force);
    }

    fn add_powers(&self, _: f64, motion: &[Kinematics], powers: &mut Powers) {
        let (report, velocity, _) = self.at(motion);
        powers.external += report.force.dot(&velocity);
    }

    fn report(&self, _: f64, motion: &[Kinematics]) -> ElementReport {
        self.at(motion).0
    }
}
