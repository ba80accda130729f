//! External force and torque on a body, constant or harmonic, in world or body axes.

use super::{At, ElementReport, ForceElement, Loads, SceneElement, point_of, push};
use crate::machine::{self, LoadAxes, Vec3};
use crate::mechanism::Powers;
use crate::mechanism::kinematics::Kinematics;
use crate::mechanism::model::Anchor;

struct Load {
    on: Anchor,
    force: Vec3,
    torque: Vec3,
    turns: bool,
    /// Angular frequency, rad/s; 0 for a constant load.
    omega: f64,
    phase: f64,
}

pub(super) fn make(load: &machine::Load, on: Anchor) -> Box<dyn SceneElement> {
    Box::new(Load {
        on,
        force: load.force,
        torque: load.torque,
        turns: load.axes == LoadAxes::Body,
        omega: std::f64::consts::TAU * load.frequency,
        phase: load.phase,
    })
}

impl Load {
    /// Force and torque at `t`, world axes.
    fn at(&self, t: f64, motion: &[Kinematics]) -> (Vec3, Vec3) {
        let size = if self.omega > 0.0 { libm::sin(self.omega * t + self.phase) } else { 1.0 };
        let (force, torque) = (self.force * size, self.torque * size);
        if self.turns {
            let rotation = &motion[self.on.body].rotation;
            (rotation * force, rotation * torque)
        } else {
            (force, torque)
        }
    }
}

impl ForceElement for Load {
    fn load(&mut self, at: &At<'_>, loads: &mut Loads<'_>) {
        let (force, torque) = self.at(at.t, at.motion);
        let (_, _, arm) = point_of(&self.on, at.motion);
        let wrench = &mut loads.wrench[self.on.body];
        push(wrench, &arm, &force);
        wrench.torque += torque;
    }

    fn add_powers(&self, t: f64, motion: &[Kinematics], powers: &mut Powers) {
        let (force, torque) = self.at(t, motion);
        let (_, velocity, _) = point_of(&self.on, motion);
        let spin = &motion[self.on.body].angular_velocity;
        powers.external += force.dot(&velocity) + torque.dot(spin);
    }
}

impl SceneElement for Load {
    fn period(&self) -> f64 {
        std::f64::consts::TAU / self.omega
    }

    fn report(&self, t: f64, motion: &[Kinematics]) -> ElementReport {
        let (force, torque) = self.at(t, motion);
        let (point, ..) = point_of(&self.on, motion);
        ElementReport { points: [point; 2], force, torque: Some(torque), ..ElementReport::default() }
    }
}
