//! Tyre on a ground that moves up and down. The force at the wheel centre is F = k d + c dd/dt along `up`, never below 0, while
//! the deflection d = ground height + radius - centre height is positive. The work of the moving ground counts as drive work.

use std::sync::Arc;

use super::{At, Coupling, EdgeIndicator, Edges, ElementReport, ForceElement, Loads, point_of, push};
use crate::jet::Jet;
use crate::machine::{self, Mat3, Vec3};
use crate::mechanism::Powers;
use crate::mechanism::drives::Law;
use crate::mechanism::kinematics::Kinematics;
use crate::mechanism::model::Anchor;

pub(super) struct Tyre {
    tyre: machine::Tyre,
    /// Wheel centre.
    on: Anchor,
    ground: Option<Arc<dyn Law>>,
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

impl Tyre {
    pub fn new(tyre: &machine::Tyre, on: Anchor, ground: Option<Arc<dyn Law>>) -> Self {
        Self { tyre: tyre.clone(), on, ground, frozen: None }
    }

    fn at(&self, t: f64, motion: &[Kinematics]) -> State {
        let (centre, velocity, arm) = point_of(&self.on, motion);
        let ground = self.ground.as_ref().map_or_else(Jet::default, |law| law.at(t)) + Jet::constant(self.tyre.height);
        let depth = ground.value + self.tyre.radius - self.tyre.up.dot(&centre);
        let rate = ground.rate - self.tyre.up.dot(&velocity);
        // A tyre off the ground has no damping force either.
        let force = self.tyre.stiffness * depth + self.tyre.damping * rate;
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
        let force = self.tyre.up * s.force;
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
        let along = self.tyre.up * self.tyre.up.transpose();
        let ends = self.ends(at.motion)?;
        let by_height: [Mat3; 2] = [along * -self.tyre.stiffness, along * -self.tyre.damping];
        Some(Coupling::between_points(ends, by_height[0], by_height[1]))
    }

    fn stored(&self, t: f64, motion: &[Kinematics]) -> f64 {
        let depth = self.at(t, motion).depth.max(0.0);
        0.5 * self.tyre.stiffness * depth * depth
    }

    fn add_powers(&self, t: f64, motion: &[Kinematics], powers: &mut Powers) {
        let s = self.at(t, motion);
        powers.drive += s.force * s.ground.rate;
        powers.damping += (s.force - self.tyre.stiffness * s.depth.max(0.0)) * s.rate;
    }

    /// Contact is lost where k d + c dd/dt falls to 0.
    fn edges(&self, t: f64, motion: &[Kinematics]) -> Edges {
        let s = self.at(t, motion);
        let pressing = s.depth.min(self.tyre.stiffness * s.depth + self.tyre.damping * s.rate);
        [Some(EdgeIndicator::Contact(s.depth)), Some(EdgeIndicator::Contact(pressing)), None, None]
    }

    fn freeze(&mut self, sides: Edges) {
        self.frozen = sides[1].map(EdgeIndicator::presses);
    }

    /// From the ground below the wheel centre to the centre.
    fn report(&self, t: f64, motion: &[Kinematics]) -> ElementReport {
        let s = self.at(t, motion);
        let above = self.tyre.up.dot(&s.centre) - s.ground.value;
        ElementReport {
            points: [s.centre - self.tyre.up * above, s.centre],
            force: self.tyre.up * s.force,
            ..ElementReport::default()
        }
    }
}
