//! A hand that pulls on a body: a spring and a damper between a point of the body and the hand. It is external to the
//! scene, so all its work is external.

use serde::{Deserialize, Serialize};

use super::{At, ElementReport, ForceElement, Loads, Powers, SceneElement, point_of, push};
use crate::machine::{Machine, Vec3};
use crate::mechanism::kinematics::Kinematics;
use crate::mechanism::model::Anchor;

/// Natural frequency of all moving bodies together on the spring, Hz: soft enough for every method, and a few times the
/// weight over the length of a hand movement.
const FREQUENCY: f64 = 3.0;
/// Damping ratio of that oscillation.
const DAMPING: f64 = 0.3;

/// Where the hand pulls, and how.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pull {
    /// Body, by its index in the scene.
    pub body: usize,
    /// Point of it, in its scene frame, m.
    pub point: Vec3,
    /// Where the hand is, world axes, m.
    pub hand: Vec3,
    /// N/m.
    pub stiffness: f64,
    /// Against the point's velocity, N s/m.
    pub damping: f64,
}

pub(super) struct Hand {
    pub on: Anchor,
    pub pull: Pull,
}

impl Pull {
    /// On `point` (m, scene frame) of body `body` of `scene`, as softly as suits the scene's masses; the hand is at `hand`, m.
    pub fn softly(machine: &Machine, body: usize, point: Vec3, hand: Vec3) -> Self {
        let mass: f64 = machine.bodies.iter().map(|body| body.mass).sum();
        let rate = std::f64::consts::TAU * FREQUENCY;
        Self { body, point, hand, stiffness: mass * rate * rate, damping: 2.0 * DAMPING * mass * rate }
    }

    /// Its report for a given position, m, and velocity, m/s, of the point: from the hand to the point.
    pub fn report(&self, point: Vec3, velocity: Vec3) -> ElementReport {
        ElementReport {
            points: [self.hand, point],
            force: self.stiffness * (self.hand - point) - self.damping * velocity,
            ..ElementReport::default()
        }
    }
}

impl Hand {
    /// Its report, the velocity of the point and its arm from the centroid.
    fn at(&self, motion: &[Kinematics]) -> (ElementReport, Vec3, Vec3) {
        let (point, velocity, arm) = point_of(&self.on, motion);
        (self.pull.report(point, velocity), velocity, arm)
    }
}

// Soft by design: nothing that an implicit method has to linearise.
impl ForceElement for Hand {
    fn load(&mut self, at: &At<'_>, loads: &mut Loads<'_>) {
        let (report, _, arm) = self.at(at.motion);
        push(&mut loads.wrench[self.on.body], &arm, &report.force);
    }

    fn add_powers(&self, _: f64, motion: &[Kinematics], powers: &mut Powers) {
        let (report, velocity, _) = self.at(motion);
        powers.external += report.force.dot(&velocity);
    }
}

impl SceneElement for Hand {
    fn report(&self, _: f64, motion: &[Kinematics]) -> ElementReport {
        self.at(motion).0
    }
}
