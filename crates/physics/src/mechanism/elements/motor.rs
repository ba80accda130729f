//! Motor on a slide or hinge. Its force or torque is F + k (target - q) + d (target' - q'), clamped to a limit, where q is the
//! joint's coordinate. Its work counts as drive work.

use super::coordinate::{AngleReference, Coordinate, CoordinateState, Slopes};
use super::{At, Coupling, ElementReport, ForceElement, Loads, SceneElement, law_of};
use crate::jet::Jet;
use crate::machine;
use crate::mechanism::Powers;
use crate::mechanism::drives::Law;
use crate::mechanism::kinematics::Kinematics;
use crate::mechanism::model::Anchor;
use std::sync::Arc;

struct Motor {
    on: Coordinate,
    force: f64,
    stiffness: f64,
    damping: f64,
    limit: f64,
    target: Option<Arc<dyn Law>>,
}

pub(super) fn make(motor: &machine::Motor, on: Coordinate) -> Box<dyn SceneElement> {
    Box::new(Motor {
        on,
        force: motor.force,
        stiffness: motor.stiffness,
        damping: motor.damping,
        limit: motor.limit,
        target: law_of(motor.target.as_ref(), motor.on.freedom.turns()),
    })
}

impl Motor {
    /// Reference motion at `t`.
    fn target(&self, t: f64) -> Jet {
        let value = |law: &Arc<dyn Law>| law.at(t);
        self.target.as_ref().map_or_else(Jet::default, value)
    }

    /// The coordinate relative to the target, and the unclamped force or torque on the child.
    fn at(&self, t: f64, motion: &[Kinematics]) -> (CoordinateState, f64) {
        let target = self.target(t);
        let state = self.on.measure(target.value, t, motion);
        let ahead = self.stiffness * state.deviation + self.damping * (state.rate - target.rate);
        (state, self.force - ahead)
    }

    /// The same with the force or torque clamped.
    fn clamped(&self, t: f64, motion: &[Kinematics]) -> (CoordinateState, f64) {
        let (state, force) = self.at(t, motion);
        (state, force.clamp(-self.limit, self.limit))
    }
}

impl ForceElement for Motor {
    fn load(&mut self, at: &At<'_>, loads: &mut Loads<'_>) {
        let (state, force) = self.clamped(at.t, at.motion);
        self.on.apply_force(&state, force, loads.wrench);
    }

    fn ends(&self, motion: &[Kinematics]) -> Option<[Anchor; 2]> {
        let is_stiff = self.stiffness > 0.0 || self.damping > 0.0;
        is_stiff.then(|| self.on.ends(motion))
    }

    fn coupling(&self, at: &At<'_>) -> Option<Coupling> {
        let (state, force) = self.at(at.t, at.motion);
        if force.abs() > self.limit || (self.stiffness == 0.0 && self.damping == 0.0) {
            return None;
        }
        let slopes = Slopes { by_position: -self.stiffness, by_rate: -self.damping };
        Some(self.on.coupling(&state, &slopes, at.motion))
    }

    fn work(&self, t: f64, poses: [&[Kinematics]; 2]) -> f64 {
        let [(from, force), (to, force_at_end)] = poses.map(|motion| self.clamped(t, motion));
        0.5 * (force + force_at_end) * (to.deviation - from.deviation)
    }

    fn add_powers(&self, t: f64, motion: &[Kinematics], powers: &mut Powers) {
        let (state, force) = self.clamped(t, motion);
        powers.drive += force * state.rate;
    }
}

impl SceneElement for Motor {
    fn law(&self) -> Option<&Arc<dyn Law>> {
        self.target.as_ref()
    }

    fn set_angle_reference(&mut self, reference: AngleReference) {
        self.on.set_reference(reference);
    }

    fn report(&self, t: f64, motion: &[Kinematics]) -> ElementReport {
        let (state, force) = self.clamped(t, motion);
        self.on.report(&state, force, motion)
    }
}
