//! Spring and damper along the line between two points: tension T = elastic(l - length) + damping(dl/dt), each a line or a curve. The
//! spring may act only in compression or only in tension.

use super::characteristic::SpringDamper;
use super::{At, Coupling, EdgeIndicator, Edges, ElementReport, ForceElement, Loads, point_of, push};
use crate::machine::{self, Mat3, SpringSide, Vec3};
use crate::mechanism::Powers;
use crate::mechanism::kinematics::Kinematics;
use crate::mechanism::model::Anchor;

pub(super) struct Spring {
    ends: [Anchor; 2],
    length: f64,
    law: SpringDamper,
    side: SpringSide,
    /// State of a one-sided spring frozen over a step, if any.
    frozen: Option<bool>,
}

/// State at one instant.
struct State {
    arms: [Vec3; 2],
    points: [Vec3; 2],
    /// Velocity of the second point relative to the first, m/s.
    velocity: Vec3,
    /// Distance between the points, m, and unit vector from the first to the second; zero if they coincide.
    length: f64,
    along: Vec3,
    rate: f64,
    /// Elastic and damping tension, N, ignoring one-sidedness.
    elastic: f64,
    damping: f64,
    /// Total tension, N.
    tension: f64,
    /// Whether a one-sided spring is slack.
    slack: bool,
}

impl Spring {
    pub fn new(spring: &machine::Spring, ends: [Anchor; 2]) -> Self {
        let law = SpringDamper::new(&spring.elastic, &spring.damping, spring.side);
        Self { ends, length: spring.length, law, side: spring.side, frozen: None }
    }

    fn state(&self, motion: &[Kinematics]) -> State {
        let [from, to] = &self.ends;
        let (start, start_velocity, start_arm) = point_of(from, motion);
        let (end, end_velocity, end_arm) = point_of(to, motion);
        let distance = end - start;
        let length = distance.norm();
        let along = if length > 0.0 { distance / length } else { Vec3::zeros() };
        let velocity = end_velocity - start_velocity;
        let rate = along.dot(&velocity);
        let [elastic, damping] = self.law.at([length - self.length, rate]).map(|force| force.value);
        let total = elastic + damping;
        let tension = match self.frozen {
            Some(true) => total,
            // A slack spring has no damping force either.
            None if self.side.of(elastic) == elastic => self.side.of(total),
            _ => 0.0,
        };
        State {
            arms: [start_arm, end_arm],
            points: [start, end],
            velocity,
            length,
            along,
            rate,
            elastic,
            damping,
            tension,
            slack: tension != total,
        }
    }
}

impl ForceElement for Spring {
    fn load(&mut self, at: &At<'_>, loads: &mut Loads<'_>) {
        let s = self.state(at.motion);
        let pull = s.along * s.tension;
        let [from, to] = self.ends.map(|end| end.body);
        push(&mut loads.wrench[from], &s.arms[0], &pull);
        push(&mut loads.wrench[to], &s.arms[1], &-pull);
    }

    fn ends(&self, _: &[Kinematics]) -> Option<[Anchor; 2]> {
        Some(self.ends)
    }

    fn coupling(&self, at: &At<'_>) -> Option<Coupling> {
        let s = self.state(at.motion);
        if s.slack {
            return None;
        }
        let [stiffness, damping] = self.law.at([s.length - self.length, s.rate]).map(|force| force.rate);
        if s.length == 0.0 {
            // A bushing resists separation in any direction; otherwise the direction, and hence the force, is discontinuous here.
            let is_bushing = self.length == 0.0 && s.elastic == 0.0;
            let by_displacement = Mat3::identity() * -stiffness;
            return is_bushing.then(|| Coupling::between_points(self.ends, by_displacement, Mat3::zeros()));
        }
        // F = -T u with u = e / |e|: dT = (k u + c P e_dot / l) . de + c u . de_dot, du = P de / l, P = 1 - u u'.
        let u = s.along;
        let turning = (Mat3::identity() - u * u.transpose()) / s.length;
        let gradient = u * stiffness + turning * s.velocity * damping;
        let by_displacement = -u * gradient.transpose() - turning * s.tension;
        let by_rate = -u * (u * damping).transpose();
        Some(Coupling::between_points(self.ends, by_displacement, by_rate))
    }

    fn stored(&self, _: f64, motion: &[Kinematics]) -> f64 {
        self.law.stored(self.state(motion).length - self.length)
    }

    fn add_powers(&self, _: f64, motion: &[Kinematics], powers: &mut Powers) {
        let s = self.state(motion);
        powers.damping += match self.side {
            SpringSide::Both => s.damping * s.rate,
            _ => (s.tension - self.side.of(s.elastic)) * s.rate,
        };
    }

    /// For a one-sided spring: its elastic force, and the smaller of that and the total force with the damper.
    fn edges(&self, _: f64, motion: &[Kinematics]) -> Edges {
        if self.side == SpringSide::Both && !self.law.has_kinks() {
            return Edges::default();
        }
        let s = self.state(motion);
        let sign = if self.side == SpringSide::Pull { 1.0 } else { -1.0 };
        let [elastic, both] = [s.elastic, s.elastic + s.damping].map(|tension| sign * tension);
        let contact = |value| (self.side != SpringSide::Both).then_some(EdgeIndicator::Contact(value));
        let [of_elastic, of_damping] = self.law.edges([s.length - self.length, s.rate]);
        [contact(elastic), contact(elastic.min(both)), of_elastic, of_damping]
    }

    fn freeze(&mut self, [_, contact, of_elastic, of_damping]: Edges) {
        self.frozen = contact.map(EdgeIndicator::presses);
        self.law.freeze([of_elastic, of_damping]);
    }

    fn report(&self, _: f64, motion: &[Kinematics]) -> ElementReport {
        let s = self.state(motion);
        ElementReport { points: s.points, force: s.along * -s.tension, ..ElementReport::default() }
    }
}
