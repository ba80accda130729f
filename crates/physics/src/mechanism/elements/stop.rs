//! Stops of a slide or a hinge: F = K d^1.5 (1 + a dd/dt), never below 0, d the depth of the coordinate beyond a limit.
//!
//! This is the contact law of a joint with one difference. There the damping term divides the rate by the approach speed, which
//! needs a contact state; here it divides by a given speed, a = chi / speed. An undisturbed impact at that speed rebounds with
//! the requested restitution, whatever the masses; a slower one rebounds with more.

use super::coordinate::{AngleReference, Coordinate, CoordinateState, Slopes};
use super::{At, Coupling, ElementReport, ForceElement, Loads, SceneElement};
use crate::contact::{ElasticLaw, NormalLaw};
use crate::machine;
use crate::mechanism::Powers;
use crate::mechanism::kinematics::Kinematics;
use crate::mechanism::model::Anchor;

struct Stop {
    on: Coordinate,
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

pub(super) fn make(stop: &machine::Stop, on: Coordinate) -> Box<dyn SceneElement> {
    let machine::Stop { lower, upper, depth, .. } = *stop;
    let middle = match (lower.is_finite(), upper.is_finite()) {
        (true, true) => 0.5 * (lower + upper),
        (true, false) => lower,
        _ => upper,
    };
    let chi = NormalLaw::Gonthier.damping_factor(stop.restitution);
    Box::new(Stop {
        on,
        middle,
        lower: lower - middle,
        upper: upper - middle,
        depth,
        elastic: ElasticLaw::through(depth, stop.force),
        damping: if chi > 0.0 { chi / stop.speed } else { 0.0 },
        frozen: None,
    })
}

impl Stop {
    /// The coordinate, and the stop in contact, if any.
    fn at(&self, t: f64, motion: &[Kinematics]) -> (CoordinateState, Option<StopContact>) {
        let state = self.on.measure(self.middle, t, motion);
        let contact = self.nearest(&state);
        let touches = self.frozen.unwrap_or(contact.depth > 0.0);
        (state, touches.then_some(contact))
    }

    /// The nearer stop as if in contact.
    fn nearest(&self, state: &CoordinateState) -> StopContact {
        let [above, below] = [state.deviation - self.upper, self.lower - state.deviation];
        let (side, depth) = if above > below { (1.0, above) } else { (-1.0, below) };
        let rate = side * state.rate;
        let elastic = self.elastic.force(depth);
        let force = elastic * (1.0 + self.damping * rate);
        // A frozen stop follows its law smoothly beyond the edge, where the step then ends.
        let force = if self.frozen.is_some() { force } else { force.max(0.0) };
        StopContact { side, depth, rate, elastic, force }
    }
}

impl ForceElement for Stop {
    fn load(&mut self, at: &At<'_>, loads: &mut Loads<'_>) {
        if let (state, Some(contact)) = self.at(at.t, at.motion) {
            let force = -contact.side * contact.force;
            self.on.apply_force(&state, force, loads.wrench);
        }
    }

    fn ends(&self, motion: &[Kinematics]) -> Option<[Anchor; 2]> {
        Some(self.on.ends(motion))
    }

    fn coupling(&self, at: &At<'_>) -> Option<Coupling> {
        let (state, contact) = self.at(at.t, at.motion);
        let contact = contact.filter(|contact| contact.force > 0.0 || self.frozen.is_some())?;
        let slopes = Slopes {
            by_position: -self.elastic.slope(contact.depth) * (1.0 + self.damping * contact.rate),
            by_rate: -contact.elastic * self.damping,
        };
        Some(self.on.coupling(&state, &slopes, at.motion))
    }

    fn stored(&self, t: f64, motion: &[Kinematics]) -> f64 {
        let contact = self.at(t, motion).1;
        contact.map_or(0.0, |contact| self.elastic.energy(contact.depth))
    }

    fn add_powers(&self, t: f64, motion: &[Kinematics], powers: &mut Powers) {
        let (state, contact) = self.at(t, motion);
        let nearest = self.nearest(&state);
        // Energy stored when contact is lost is dissipated as the stop recovers.
        let separates = nearest.depth > 0.0 && 1.0 + self.damping * nearest.rate <= 0.0;
        let elastic = if separates || contact.is_some() { nearest.elastic } else { 0.0 };
        powers.damping += (contact.map_or(0.0, |contact| contact.force) - elastic) * nearest.rate;
    }
}

impl SceneElement for Stop {
    /// Contact is lost where d (1 + a dd/dt) falls to 0.
    fn contact_indicators(&self, t: f64, motion: &[Kinematics]) -> Option<[f64; 2]> {
        let StopContact { depth, rate, .. } = self.nearest(&self.on.measure(self.middle, t, motion));
        Some([depth, depth.min(depth * (1.0 + self.damping * rate))])
    }

    fn has_vertical_onset(&self) -> bool {
        true
    }

    fn set_angle_reference(&mut self, reference: AngleReference) {
        self.on.set_reference(reference);
    }

    fn freeze_contact(&mut self, in_contact: Option<bool>) {
        self.frozen = in_contact;
    }

    fn report(&self, t: f64, motion: &[Kinematics]) -> ElementReport {
        let (state, contact) = self.at(t, motion);
        let force = contact.as_ref().map_or(0.0, |contact| -contact.side * contact.force);
        let depth = contact.map(|contact| [contact.depth, self.depth]);
        ElementReport { depth, ..self.on.report(&state, force, motion) }
    }
}
