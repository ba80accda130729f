//! The divergence guard: what no accepted step may show.

use super::{OPEN_LOOP, Simulation};
use crate::scene::Formulation;

/// Speed beyond which a state is absurd, m/s and rad/s.
const ABSURD_SPEED: f64 = 1e6;
/// Deeper in its wall than this many radii a ball has left its socket, and a contact patch is not small any more.
const LEFT_SOCKET: f64 = 0.1;
/// Energy of an impact's first step over that of the approach beyond which the step, not the motion, made it.
const MOST_OVERSHOOT: f64 = 4.0;
/// Constraints that are only stabilised and off by more than this hold nothing together, m.
const MOST_DRIFT: f64 = 1e-3;
/// Smallest pivot ratio of the constraints of the `lagrange` form: below, they fix the motion to less than four digits.
const LEAST_PIVOT: f64 = 1e-12;

impl Simulation {
    /// What is wrong with the step of size `h` just attempted, if anything.
    pub(super) fn objection(&self, open: f64, h: f64) -> Option<String> {
        if !(open <= OPEN_LOOP) {
            return Some(format!(
                "the loops through the ideal ball joints came apart by {open:.1e} m"
            ));
        }
        let drift = self.mechanism.constraint_drift();
        if !(drift <= MOST_DRIFT) {
            return Some(format!(
                "the constraints of the lagrange form are off by {drift:.1e} m"
            ));
        }
        if self.running.formulation == Formulation::Lagrange
            && !(self.mechanism.least_pivot() >= LEAST_PIVOT)
        {
            return Some("the constraints pass a singular pose".to_owned());
        }
        for j in 0..self.gaps_end.len() {
            if !self.mechanism.contacts.has_clearance(j) {
                continue;
            }
            let penetration = self.gaps_end[j].penetration;
            let radius = self.mechanism.contacts.coefficients(j).ball_radius;
            if !(penetration <= LEFT_SOCKET * radius) {
                let name = &self.running.ball_joints[j].name;
                return Some(format!(
                    "ball joint {name}: the ball is {penetration:.3e} m inside its socket wall, more than a tenth of its radius"
                ));
            }
            if !self.running.solver.method.is_adaptive()
                && let Some(times) = self.energy_of_overshoot(j, h)
            {
                let name = &self.running.ball_joints[j].name;
                return Some(format!(
                    "ball joint {name}: one step put the ball {penetration:.3e} m inside its socket wall, \
                     with {times:.1} times the energy that it can have arrived with"
                ));
            }
        }
        for (m, body) in self.mechanism.motion().iter().zip(&self.running.bodies) {
            let (v, w) = (m.velocity.norm(), m.angular_velocity.norm());
            let sane = v <= ABSURD_SPEED && w <= ABSURD_SPEED;
            if !(sane && m.position.iter().all(|x| x.is_finite())) {
                return Some(format!(
                    "body {}: speed {v:.3e} m/s, angular speed {w:.3e} rad/s",
                    body.name
                ));
            }
        }
        if self.k_end.iter().chain(&self.y_end).any(|x| !x.is_finite()) {
            return Some("the accelerations are not finite".to_owned());
        }
        None
    }

    /// Where a fixed step carried a free ball so far into the wall that it stores more energy there than any approach
    /// could bring: how many times more.
    fn energy_of_overshoot(&self, j: usize, h: f64) -> Option<f64> {
        let (start, end) = (self.state.gaps[j], self.gaps_end[j]);
        if start.penetration > 0.0 || end.penetration <= 0.0 {
            return None;
        }
        let coefficients = self.mechanism.contacts.coefficients(j);
        let mass: f64 = self.running.bodies.iter().map(|body| body.mass).sum();
        let speed = start.speed + self.running.gravity.norm() * h + coefficients.speed_floor;
        let times = coefficients.elastic_energy(end.penetration) / (0.5 * mass * speed * speed);
        (times > MOST_OVERSHOOT).then_some(times)
    }
}
