//! A hand that pulls on a body: a spring and a damper from a point of it to a place that the hand holds. To the scene it is
//! something outside, so all that it does is work from outside.

use super::{
    At, Coupling, ElementReport, ForceElement, Loads, Powers, SceneElement, point_of, push,
};
use crate::mechanism::kinematics::Kinematics;
use crate::mechanism::model::Anchor;
use crate::scene::Vec3;

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

impl Hand {
    fn force(&self, motion: &[Kinematics]) -> (Vec3, Vec3, Vec3, Vec3) {
        let (point, velocity, arm) = point_of(&self.on, motion);
        let pull = &self.pull;
        let force = pull.stiffness * (pull.hand - point) - pull.damping * velocity;
        (force, point, velocity, arm)
    }
}

impl ForceElement for Hand {
    fn load(&mut self, at: &At<'_>, loads: &mut Loads<'_>) {
        let (force, _, _, arm) = self.force(at.motion);
        push(&mut loads.wrench[self.on.body], &arm, &force);
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
        let (force, _, velocity, _) = self.force(motion);
        powers.external += force.dot(&velocity);
    }
}

impl SceneElement for Hand {
    fn report(&self, _: f64, motion: &[Kinematics]) -> ElementReport {
        let (force, point, ..) = self.force(motion);
        ElementReport {
            points: [self.pull.hand, point],
            force,
            torque: None,
        }
    }
}
