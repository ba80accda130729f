//! External force and torque on a body, constant or times a function of time, in world or body axes.

use std::sync::Arc;

use super::bushing::rotation_vector;
use super::{At, ElementReport, ForceElement, Loads, SceneElement, point_of, push};
use crate::machine::{self, LoadAxes, Vec3};
use crate::mechanism::Powers;
use crate::mechanism::drives::{Law, law_of_factor};
use crate::mechanism::kinematics::Kinematics;
use crate::mechanism::model::Anchor;

struct Load {
    on: Anchor,
    force: Vec3,
    torque: Vec3,
    turns: bool,
    factor: Option<Arc<dyn Law>>,
}

pub(super) fn make(load: &machine::Load, on: Anchor) -> Box<dyn SceneElement> {
    Box::new(Load {
        on,
        force: load.force,
        torque: load.torque,
        turns: load.axes == LoadAxes::Body,
        factor: load.factor.as_ref().and_then(law_of_factor),
    })
}

impl Load {
    /// Force and torque at `t`, world axes.
    fn at(&self, t: f64, motion: &[Kinematics]) -> (Vec3, Vec3) {
        let factor = self.factor.as_ref().map_or(1.0, |law| law.at(t).value);
        let (force, torque) = (self.force * factor, self.torque * factor);
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
}

impl SceneElement for Load {
    fn law(&self) -> Option<&Arc<dyn Law>> {
        self.factor.as_ref()
    }

    fn report(&self, t: f64, motion: &[Kinematics]) -> ElementReport {
        let (force, torque) = self.at(t, motion);
        let (point, ..) = point_of(&self.on, motion);
        ElementReport { points: [point; 2], force, torque: Some(torque), ..ElementReport::default() }
    }
}
