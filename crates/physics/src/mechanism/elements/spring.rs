//! Spring and damper along the line between two points: tension T = preload + stiffness (l - length) + damping dl/dt. A curve
//! over l - length may replace the first two terms, and the spring may act only in compression or only in tension.

use super::elastic::Elastic;
use super::{At, Coupling, ElementReport, ForceElement, Loads, SceneElement, point_of, push};
use crate::machine::{self, Mat3, SpringSide, Vec3};
use crate::mechanism::Powers;
use crate::mechanism::kinematics::Kinematics;
use crate::mechanism::model::Anchor;

struct Spring {
    from: Anchor,
    to: Anchor,
    length: f64,
    elastic: Elastic,
    damping: f64,
    side: SpringSide,
    /// State of a one-sided spring frozen over a step, if any.
    frozen: Option<bool>,
}

/// State at one instant.
struct State {
    arms: [Vec3; 2],
    points: [Vec3; 2],
    /// Velocity of `to` relative to `from`, m/s.
    velocity: Vec3,
    /// Distance between the points, m, and unit vector from `from` to `to`; zero if they coincide.
    length: f64,
    along: Vec3,
    rate: f64,
    /// Elastic tension, N, ignoring one-sidedness.
    elastic: f64,
    /// Total tension, N.
    tension: f64,
    /// Whether a one-sided spring is slack.
    slack: bool,
}

pub(super) fn make(spring: &machine::Spring, [from, to]: [Anchor; 2]) -> Box<dyn SceneElement> {
    Box::new(Spring {
        from,
        to,
        length: spring.length,
        elastic: Elastic::new(&spring.elastic, spring.side),
        damping: spring.damping,
        side: spring.side,
        frozen: None,
    })
}

impl Spring {
    fn state(&self, motion: &[Kinematics]) -> State {
        let (start, start_velocity, start_arm) = point_of(&self.from, motion);
        let (end, end_velocity, end_arm) = point_of(&self.to, motion);
        let distance = end - start;
        let length = distance.norm();
        let along = if length > 0.0 { distance / length } else { Vec3::zeros() };
        let velocity = end_velocity - start_velocity;
        let rate = along.dot(&velocity);
        let elastic = self.elastic.tension(length - self.length);
        let total = elastic + self.damping * rate;
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
            tension,
            slack: tension != total,
        }
    }
}

impl ForceElement for Spring {
    fn load(&mut self, at: &At<'_>, loads: &mut Loads<'_>) {
        let s = self.state(at.motion);
        let pull = s.along * s.tension;
        push(&mut loads.wrench[self.from.body], &s.arms[0], &pull);
        push(&mut loads.wrench[self.to.body], &s.arms[1], &-pull);
    }

    fn ends(&self, _: &[Kinematics]) -> Option<[Anchor; 2]> {
        Some([self.from, self.to])
    }

    fn coupling(&self, at: &At<'_>) -> Option<Coupling> {
        let (s, ends) = (self.state(at.motion), [self.from, self.to]);
        if s.slack {
            return None;
        }
        let stiffness = self.elastic.stiffness(s.length - self.length);
        if s.length == 0.0 {
            // A bushing resists separation in any direction; otherwise the direction, and hence the force, is discontinuous here.
            let is_bushing = self.length == 0.0 && s.elastic == 0.0;
            let by_displacement = Mat3::identity() * -stiffness;
            return is_bushing.then(|| Coupling::between_points(ends, by_displacement, Mat3::zeros()));
        }
        // F = -T u with u = e / |e|: dT = (k u + c P e_dot / l) . de + c u . de_dot, du = P de / l, P = 1 - u u'.
        let u = s.along;
        let turning = (Mat3::identity() - u * u.transpose()) / s.length;
        let gradient = u * stiffness + turning * s.velocity * self.damping;
        let by_displacement = -u * gradient.transpose() - turning * s.tension;
        let by_rate = -u * (u * self.damping).transpose();
        Some(Coupling::between_points(ends, by_displacement, by_rate))
    }

    fn stored(&self, _: f64, motion: &[Kinematics]) -> f64 {
        self.elastic.stored(self.state(motion).length - self.length)
    }

    fn add_powers(&self, _: f64, motion: &[Kinematics], powers: &mut Powers) {
        let s = self.state(motion);
        powers.damping += match self.side {
            SpringSide::Both => self.damping * s.rate * s.rate,
            _ => (s.tension - self.side.of(s.elastic)) * s.rate,
        };
    }
}

impl SceneElement for Spring {
    /// For a one-sided spring: its elastic force, and the smaller of that and the total force with the damper.
    fn contact_indicators(&self, _: f64, motion: &[Kinematics]) -> Option<[f64; 2]> {
        let sign = match self.side {
            SpringSide::Both => return None,
            SpringSide::Pull => 1.0,
            SpringSide::Push => -1.0,
        };
        let s = self.state(motion);
        let [elastic, both] = [s.elastic, s.elastic + self.damping * s.rate].map(|tension| sign * tension);
        Some([elastic, elastic.min(both)])
    }

    fn freeze_contact(&mut self, in_contact: Option<bool>) {
        self.frozen = in_contact;
    }

    fn segment(&self, _: f64, motion: &[Kinematics]) -> Option<f64> {
        self.elastic.has_kinks().then(|| self.elastic.segment(self.state(motion).length - self.length))
    }

    fn freeze_segment(&mut self, segment: Option<usize>) {
        self.elastic.freeze(segment);
    }

    fn report(&self, _: f64, motion: &[Kinematics]) -> ElementReport {
        let s = self.state(motion);
        ElementReport { points: s.points, force: s.along * -s.tension, ..ElementReport::default() }
    }
}
