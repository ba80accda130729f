//! External force and torque on a body, constant or times a function of time, in world or body axes.

use std::sync::Arc;

use super::bushing::rotation_vector;
use super::{At, ElementReport, ForceElement, Loads, point_of, push};
use crate::machine::{self, LoadAxes, Vec3};
use crate::mechanism::Powers;
use crate::mechanism::drives::Law;
use crate::mechanism::kinematics::Kinematics;
use crate::mechanism::model::Anchor;

pub(super) struct Load {
    pub load: machine::Load,
    pub on: Anchor,
    pub factor: Option<Arc<dyn Law>>,
}

impl Load {
    /// Force and torque at `t`, world axes.
    fn at(&self, t: f64, motion: &[Kinematics]) -> (Vec3, Vec3) {
        let factor = self.factor.as_ref().map_or(1.0, |law| law.at(t).value);
        let (force, torque) = (self.load.force * factor, self.load.torque * factor);
        if self.load.axes == LoadAxes::Body {
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

    fn work(&self, t: f64, [from, to]: [&[Kinematics]; 2]) -> f64 {
        let [(force, torque), (force_at_end, torque_at_end)] = [from, to].map(|motion| self.at(t, motion));
        let moved = point_of(&self.on, to).0 - point_of(&self.on, from).0;
        let turn = rotation_vector(&(to[self.on.body].rotation * from[self.on.body].rotation.transpose()));
        0.5 * ((force + force_at_end).dot(&moved) + (torque + torque_at_end).dot(&turn))
    }

    fn add_powers(&self, t: f64, motion: &[Kinematics], powers: &mut Powers) {
        let (force, torque) = self.at(t, motion);
        let (_, velocity, _) = point_of(&self.on, motion);
        let spin = &motion[self.on.body].angular_velocity;
        powers.external += force.dot(&velocity) + torque.dot(spin);
    }

    fn report(&self, t: f64, motion: &[Kinematics]) -> ElementReport {
        let (force, torque) = self.at(t, motion);
        let (point, ..) = point_of(&self.on, motion);
        ElementReport { points: [point; 2], force, torque: Some(torque), ..ElementReport::default() }
    }
}
