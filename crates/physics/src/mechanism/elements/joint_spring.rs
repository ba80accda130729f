//! Spring and damper on a slide or hinge. The force or torque on the child is -(preload + stiffness s + damping ds/dt), where s
//! is the joint's coordinate measured from `position`; a curve over s may replace the first two terms.

use super::coordinate::{AngleReference, Coordinate, CoordinateState, Slopes};
use super::elastic::Elastic;
use super::{At, Coupling, ElementReport, ForceElement, Loads, SceneElement};
use crate::machine::{self, SpringSide};
use crate::mechanism::Powers;
use crate::mechanism::kinematics::Kinematics;
use crate::mechanism::model::Anchor;

struct JointSpring {
    on: Coordinate,
    position: f64,
    elastic: Elastic,
    damping: f64,
}

pub(super) fn make(spring: &machine::JointSpring, on: Coordinate) -> Box<dyn SceneElement> {
    Box::new(JointSpring {
        on,
        position: spring.position,
        elastic: Elastic::new(&spring.elastic, SpringSide::Both),
        damping: spring.damping,
    })
}

impl JointSpring {
    /// The coordinate, and the force or torque on the child, N or N m.
    fn at(&self, t: f64, motion: &[Kinematics]) -> (CoordinateState, f64) {
        let state = self.on.measure(self.position, t, motion);
        let back = self.elastic.tension(state.deviation) + self.damping * state.rate;
        (state, -back)
    }
}

impl ForceElement for JointSpring {
    fn load(&mut self, at: &At<'_>, loads: &mut Loads<'_>) {
        let (state, force) = self.at(at.t, at.motion);
        self.on.apply_force(&state, force, loads.wrench);
    }

    fn ends(&self, motion: &[Kinematics]) -> Option<[Anchor; 2]> {
        Some(self.on.ends(motion))
    }

    fn coupling(&self, at: &At<'_>) -> Option<Coupling> {
        let (state, _) = self.at(at.t, at.motion);
        let slopes = Slopes { by_position: -self.elastic.stiffness(state.deviation), by_rate: -self.damping };
        Some(self.on.coupling(&state, &slopes, at.motion))
    }

    fn stored(&self, t: f64, motion: &[Kinematics]) -> f64 {
        self.elastic.stored(self.on.measure(self.position, t, motion).deviation)
    }

    fn add_powers(&self, t: f64, motion: &[Kinematics], powers: &mut Powers) {
        let rate = self.on.measure(self.position, t, motion).rate;
        powers.damping += self.damping * rate * rate;
    }
}

impl SceneElement for JointSpring {
    fn set_angle_reference(&mut self, reference: AngleReference) {
        self.on.set_reference(reference);
    }

    fn segment(&self, t: f64, motion: &[Kinematics]) -> Option<f64> {
        let stretch = || self.on.measure(self.position, t, motion).deviation;
        self.elastic.has_kinks().then(|| self.elastic.segment(stretch()))
    }

    fn freeze_segment(&mut self, segment: Option<usize>) {
        self.elastic.freeze(segment);
    }

    fn report(&self, t: f64, motion: &[Kinematics]) -> ElementReport {
        let (state, force) = self.at(t, motion);
        self.on.report(&state, force, motion)
    }
}
