//! Stops of a slide or a hinge: F = K d^1.5 (1 + a dd/dt), never below 0, d the depth of the coordinate beyond a limit.
//!
//! This is the contact law of a joint with one difference. There the damping term divides the rate by the approach speed, which
//! needs a contact state; here it divides by a given speed, a = chi / speed. An undisturbed impact at that speed rebounds with
//! the requested restitution, whatever the masses; a slower one rebounds with more.

use super::coordinate::{CoordinateLaw, Slopes};
use super::{EdgeIndicator, Edges};
use crate::contact::{ElasticLaw, NormalLaw};
use crate::jet::Jet;
use crate::machine;
use crate::mechanism::Powers;

pub(super) struct Stop {
    /// Midpoint of the limits, or the only limit.
    middle: f64,
    /// Limits relative to `middle`, m or rad; infinite if absent.
    lower: f64,
    upper: f64,
    /// Depth at which the stop exerts the given force, m or rad.
    depth: f64,
    /// Force, or moment, by depth.
    elastic: ElasticLaw,
    /// a, s/m or s/rad.
    damping: f64,
    /// Contact state frozen over a step, if any.
    frozen: Option<bool>,
}

/// A stop in contact.
struct StopContact {
    /// 1 at the upper limit, -1 at the lower.
    side: f64,
    /// d, m or rad, and its rate.
    depth: f64,
    rate: f64,
    /// Elastic part and force, N or N m.
    elastic: f64,
    force: f64,
}

impl Stop {
    pub fn new(stop: &machine::Stop) -> Self {
        let machine::Stop { lower, upper, depth, .. } = *stop;
        let middle = match (lower.is_finite(), upper.is_finite()) {
            (true, true) => 0.5 * (lower + upper),
            (true, false) => lower,
            _ => upper,
        };
        let chi = NormalLaw::Gonthier.damping_factor(stop.restitution);
        Self {
            middle,
            lower: lower - middle,
            upper: upper - middle,
            depth,
            elastic: ElasticLaw::through(depth, stop.force),
            damping: if chi > 0.0 { chi / stop.speed } else { 0.0 },
            frozen: None,
        }
    }

    /// The stop in contact, if any.
    fn touching(&self, deviation: [f64; 2]) -> Option<StopContact> {
        let contact = self.nearest(deviation);
        self.frozen.unwrap_or(contact.depth > 0.0).then_some(contact)
    }

    /// The nearer stop as if in contact.
    fn nearest(&self, [x, v]: [f64; 2]) -> StopContact {
        let [above, below] = [x - self.upper, self.lower - x];
        let (side, depth) = if above > below { (1.0, above) } else { (-1.0, below) };
        let rate = side * v;
        let elastic = self.elastic.force(depth);
        let force = elastic * (1.0 + self.damping * rate);
        // A frozen stop follows its law smoothly beyond the edge, where the step then ends.
        let force = if self.frozen.is_some() { force } else { force.max(0.0) };
        StopContact { side, depth, rate, elastic, force }
    }
}

impl CoordinateLaw for Stop {
    fn target(&self, _: f64) -> Jet {
        Jet::constant(self.middle)
    }

    fn force(&self, deviation: [f64; 2]) -> f64 {
        self.touching(deviation).map_or(0.0, |contact| -contact.side * contact.force)
    }

    fn slopes(&self, deviation: [f64; 2]) -> Option<Slopes> {
        let contact = self.touching(deviation);
        let contact = contact.filter(|contact| contact.force > 0.0 || self.frozen.is_some())?;
        Some(Slopes {
            by_position: -self.elastic.slope(contact.depth) * (1.0 + self.damping * contact.rate),
            by_rate: -contact.elastic * self.damping,
        })
    }

    fn stored(&self, x: f64) -> f64 {
        self.touching([x, 0.0]).map_or(0.0, |contact| self.elastic.energy(contact.depth))
    }

    fn add_powers(&self, deviation: [f64; 2], _: f64, powers: &mut Powers) {
        let (contact, nearest) = (self.touching(deviation), self.nearest(deviation));
        // Energy stored when contact is lost is dissipated as the stop recovers.
        let separates = nearest.depth > 0.0 && 1.0 + self.damping * nearest.rate <= 0.0;
        let elastic = if separates || contact.is_some() { nearest.elastic } else { 0.0 };
        powers.damping += (contact.map_or(0.0, |contact| contact.force) - elastic) * nearest.rate;
    }

    /// Contact is lost where d (1 + a dd/dt) falls to 0.
    fn edges(&self, deviation: impl FnOnce() -> [f64; 2]) -> Edges {
        let StopContact { depth, rate, .. } = self.nearest(deviation());
        let pressing = depth.min(depth * (1.0 + self.damping * rate));
        [Some(EdgeIndicator::Contact(depth)), Some(EdgeIndicator::VerticalOnset(pressing)), None, None]
    }

    fn freeze(&mut self, sides: Edges) {
        self.frozen = sides[1].map(EdgeIndicator::presses);
    }

    fn depth(&self, x: f64) -> Option<[f64; 2]> {
        self.touching([x, 0.0]).map(|contact| [contact.depth, self.depth])
    }
}
