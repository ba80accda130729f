//! Tyre on a ground that moves up and down. The force at the wheel centre is F = k d + c dd/dt along `up`, never below 0, while
//! the deflection d = ground height + radius - centre height is positive. The work of the moving ground counts as drive work.

use std::sync::Arc;

use super::{At, Coupling, ElementReport, ForceElement, Loads, SceneElement, law_of, point_of, push};
use crate::jet::Jet;
use crate::machine::{self, Mat3, Vec3};
use crate::mechanism::Powers;
use crate::mechanism::drives::Law;
use crate::mechanism::kinematics::Kinematics;
use crate::mechanism::model::Anchor;

struct Tyre {
    /// Wheel centre.
    on: Anchor,
    up: Vec3,
    radius: f64,
    stiffness: f64,
    damping: f64,
    ground: Option<Arc<dyn Law>>,
    /// Coordinate along `up` at which `ground` is 0, m.
    height: f64,
    /// Contact state frozen over a step, if any.
    frozen: Option<bool>,
}

/// State at one instant.
struct State {
    centre: Vec3,
    arm: Vec3,
    /// Coordinate of the ground along `up`, m.
    ground: Jet,
    /// Deflection d, m, negative above the ground, and its rate, m/s.
    depth: f64,
    rate: f64,
    /// Force, N; zero or negative once contact is lost.
    force: f64,
}

pub(super) fn make(tyre: &machine::Tyre, on: Anchor) -> Box<dyn SceneElement> {
    Box::new(Tyre {
        on,
        up: tyre.up,
        radius: tyre.radius,
        stiffness: tyre.stiffness,
        damping: tyre.damping,
        ground: law_of(tyre.ground.as_ref(), false),
        height: tyre.height,
        frozen: None,
    })
}

impl Tyre {
    fn at(&self, t: f64, motion: &[Kinematics]) -> State {
        let (centre, velocity, arm) = point_of(&self.on, motion);
        let height = |law: &Arc<dyn Law>| law.at(t);
        let ground = self.ground.as_ref().map_or_else(Jet::default, height) + Jet::constant(self.height);
        let depth = ground.value + self.radius - self.up.dot(&centre);
        let rate = ground.rate - self.up.dot(&velocity);
        // A tyre off the ground has no damping force either.
        let force = self.stiffness * depth + self.damping * rate;
        let force = match self.frozen {
            Some(true) => force,
            None if depth > 0.0 => force.max(0.0),
            _ => 0.0,
        };
        State { centre, arm, ground, depth, rate, force }
    }
}

impl ForceElement for Tyre {
    fn load(&mut self, at: &At<'_>, loads: &mut Loads<'_>) {
        let s = self.at(at.t, at.motion);
        let force = self.up * s.force;
        push(&mut loads.wrench[self.on.body], &s.arm, &force);
    }

    fn ends(&self, motion: &[Kinematics]) -> Option<[Anchor; 2]> {
        // The reaction acts at the wheel centre's current position, but on the world, which is the last body.
        let world = Anchor { body: motion.len() - 1, offset: point_of(&self.on, motion).0 };
        Some([world, self.on])
    }

    fn coupling(&self, at: &At<'_>) -> Option<Coupling> {
        let s = self.at(at.t, at.motion);
        if !self.frozen.unwrap_or(s.force > 0.0) {
            return None;
        }
        let along = self.up * self.up.transpose();
        let ends = self.ends(at.motion)?;
        let by_height: [Mat3; 2] = [along * -self.stiffness, along * -self.damping];
        Some(Coupling::between_points(ends, by_height[0], by_height[1]))
    }

    fn stored(&self, t: f64, motion: &[Kinematics]) -> f64 {
        let depth = self.at(t, motion).depth.max(0.0);
        0.5 * self.stiffness * depth * depth
    }

    fn add_powers(&self, t: f64, motion: &[Kinematics], powers: &mut Powers) {
        let s = self.at(t, motion);
        powers.drive += s.force * s.ground.rate;
        powers.damping += (s.force - self.stiffness * s.depth.max(0.0)) * s.rate;
    }
}

impl SceneElement for Tyre {
    fn law(&self) -> Option<&Arc<dyn Law>> {
        self.ground.as_ref()
    }

    /// Contact is lost where k d + c dd/dt falls to 0.
    fn contact_indicators(&self, t: f64, motion: &[Kinematics]) -> Option<[f64; 2]> {
        let s = self.at(t, motion);
        Some([s.depth, s.depth.min(self.stiffness * s.depth + self.damping * s.rate)])
    }

    fn freeze_contact(&mut self, in_contact: Option<bool>) {
        self.frozen = in_contact;
    }

    /// From the ground below the wheel centre to the centre.
    fn report(&self, t: f64, motion: &[Kinematics]) -> ElementReport {
        let s = self.at(t, motion);
        let above = self.up.dot(&s.centre) - s.ground.value;
        ElementReport {
            points: [s.centre - self.up * above, s.centre],
            force: self.up * s.force,
            ..ElementReport::default()
        }
    }
}
