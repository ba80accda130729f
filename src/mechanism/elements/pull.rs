//! A hand that pulls on a body: a spring and a damper from a point of it to a place that the hand holds. To the scene it is
//! something outside, so all that it does is work from outside.

use super::{
    At, Coupling, ElementReport, ForceElement, Loads, Powers, SceneElement, point_of, push,
};
use crate::mechanism::kinematics::Kinematics;
use crate::mechanism::model::Anchor;
use crate::scene::{Scene, Vec3};

/// Frequency at which all that moves would swing on the spring, Hz: soft enough for every method, and in the length of a hand's
/// move a few times the weight.
const FREQUENCY: f64 = 3.0;
/// Damping of that swinging, in parts of the critical one.
const DAMPING: f64 = 0.3;

/// Where somebody pulls, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
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
    /// On `point` of body `body` of `scene`, m in its scene frame, as softly as suits its masses; the hand is at `hand`, m.
    pub fn softly(scene: &Scene, body: usize, point: Vec3, hand: Vec3) -> Self {
        let mass: f64 = scene.bodies.iter().map(|body| body.mass).sum();
        let rate = std::f64::consts::TAU * FREQUENCY;
        Self {
            body,
            point,
            hand,
            stiffness: mass * rate * rate,
            damping: 2.0 * DAMPING * mass * rate,
        }
    }

    /// What it does with the point at a place, m, with a velocity, m/s: from the hand to the point.
    pub fn report(&self, point: Vec3, velocity: Vec3) -> ElementReport {
        ElementReport {
            points: [self.hand, point],
            force: self.stiffness * (self.hand - point) - self.damping * velocity,
            torque: None,
        }
    }
}

impl Hand {
    /// What it does, the velocity of the point and its arm from the centroid.
    fn at(&self, motion: &[Kinematics]) -> (ElementReport, Vec3, Vec3) {
        let (point, velocity, arm) = point_of(&self.on, motion);
        (self.pull.report(point, velocity), velocity, arm)
    }
}

impl ForceElement for Hand {
    fn load(&mut self, at: &At<'_>, loads: &mut Loads<'_>) {
        let (report, _, arm) = self.at(at.motion);
        push(&mut loads.wrench[self.on.body], &arm, &report.force);
    }

    // Soft by choice: nothing that an implicit method would have to know.
    fn ends(&self) -> Option<[Anchor; 2]> {
        None
    }

    fn coupling(&self, _: &At<'_>) -> Option<Coupling> {
        None
    }

    fn stored(&self, _: &[Kinematics]) -> f64 {
        0.0
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
