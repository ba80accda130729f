//! The divergence guard: checks that every accepted step must pass.

use super::{OPEN_LOOP, Stepping};
use crate::integrate::StepControl;
use crate::mechanism::ContactId;
use crate::simulate::StopFault;

/// Speed beyond which a state is absurd, m/s and rad/s.
const ABSURD_SPEED: f64 = 1e6;
/// Penetration in ball radii beyond which a ball has left its socket and its contact patch is no longer small.
const LEFT_SOCKET: f64 = 0.1;
/// Energy stored by an impact's first step, over that of the approach, beyond which the step, not the motion, created it.
const MAX_OVERSHOOT: f64 = 4.0;
/// Violation beyond which stabilised constraints no longer hold the mechanism together, m.
const MAX_DRIFT: f64 = 1e-3;

impl Stepping<'_> {
    /// Fault of the step of size `h` just attempted, if any.
    pub(super) fn divergence(&self, open: f64, h: f64) -> Option<StopFault> {
        if !(open <= OPEN_LOOP) {
            return Some(StopFault::OpenLoops { open });
        }
        let drift = self.mechanism.constraint_drift();
        if !(drift <= MAX_DRIFT) {
            return Some(StopFault::Drift { drift });
        }
        if self.mechanism.is_undetermined() {
            return Some(StopFault::SingularConstraints);
        }
        for c in 0..self.attempt.end.gaps.len() {
            let contacts = &self.mechanism.contacts;
            let site = || self.machine.loose_joints[contacts.joint_of(c)].site_name(contacts.place(c));
            let penetration = self.attempt.end.gaps[c].penetration;
            let radius = contacts.coefficients(c).ball_radius;
            if !(penetration <= LEFT_SOCKET * radius) {
                return Some(StopFault::LeftSocket { joint: site(), penetration });
            }
            if self.state.conditions.solver.method.control() == StepControl::Fixed
                && let Some(times) = self.overshoot_energy_ratio(c, h)
            {
                return Some(StopFault::Overshoot { joint: site(), penetration, times });
            }
        }
        for (m, body) in self.mechanism.motion().iter().zip(&self.machine.bodies) {
            let (v, w) = (m.velocity.norm(), m.angular_velocity.norm());
            let sane = v <= ABSURD_SPEED && w <= ABSURD_SPEED;
            if !(sane && m.position.iter().all(|x| x.is_finite())) {
                return Some(StopFault::AbsurdSpeed { body: body.name.clone(), speed: v, angular_speed: w });
            }
        }
        // All other components follow from the motion, checked above.
        let end = &self.attempt.end;
        let active_ranges = self.mechanism.active_ranges().iter();
        let sane = active_ranges.fold(true, |sane, part| {
            let both = end.k[part.clone()].iter().zip(&end.y[part.clone()]);
            both.fold(sane, |sane, (k, y)| sane & k.is_finite() & y.is_finite())
        });
        (!sane).then_some(StopFault::NotFinite)
    }

    /// Ratio of stored to approach energy, if a fixed step carried a free ball so far into the wall that it stores more than any
    /// approach could bring.
    fn overshoot_energy_ratio(&self, c: ContactId, h: f64) -> Option<f64> {
        let (start, end) = (self.state.now.gaps[c], self.attempt.end.gaps[c]);
        if start.penetration > 0.0 || end.penetration <= 0.0 {
            return None;
        }
        let coefficients = self.mechanism.contacts.coefficients(c);
        let mass: f64 = self.machine.bodies.iter().map(|body| body.mass).sum();
        let least = self.machine.bodies.iter().map(|body| body.mass).filter(|mass| *mass > 0.0);
        let pushed = self.mechanism.element_reports(self.state.now.t + h);
        let push: f64 = pushed.map(|element| element.force.norm()).sum();
        let least = least.fold(f64::INFINITY, f64::min);
        let pull = self.machine.max_acceleration([(push, least)]);
        let speed = start.speed + pull * h + coefficients.speed_floor;
        let times = coefficients.elastic.energy(end.penetration) / (0.5 * mass * speed * speed);
        (times > MAX_OVERSHOOT).then_some(times)
    }
}
