//! The contact force over a whole step: the discrete gradient of the elastic potential, the law's damping, and friction at the
//! velocity with which the step ends.
//!
//! With F_el = (U(d1) - U(d0)) / (d1 - d0), U the energy of the elastic law, the elastic work over the step is the change of U exactly,
//! whatever the step, and a contact that begins or ends within the step is in U (Gonzalez 1996; McLachlan, Quispel & Robidoux
//! 1999).

use super::{Coefficients, FrictionBranch, Mat3, Vec3};

/// Change of penetration, relative to the larger one, below which Simpson's rule replaces the quotient.
const NEARLY_EQUAL: f64 = 1e-3;
/// Sliding speed over [`Coefficients::slip_high`] from which the derivative of friction may be the tangent.
const FAR_FROM_RAMP: f64 = 20.0;

/// A contact over one step: the quantities that stay constant while its force is solved for.
#[derive(Clone, Copy, Debug, Default)]
pub struct ContactStep {
    /// Step size, s.
    pub h: f64,
    /// Eccentricity at the start, m.
    pub start: Vec3,
    /// Clearance at the start and at the end, m.
    pub clearances: [f64; 2],
    /// Velocity used by friction at the start, m/s, not yet projected onto the tangent plane.
    pub slip: Vec3,
    /// Deflection of the bristles at the start, m, in the tangent plane.
    pub bent: Vec3,
    /// Approach speed in the damping term so far, m/s.
    pub approach: f64,
    /// Force over elastic force with which the ball rebounds, in place of the law's damping: see [`Coefficients::rebound`].
    pub rebound: Option<f64>,
}

/// The force of a contact over one step, and its derivatives.
#[derive(Clone, Copy, Debug, Default)]
pub struct StepForce {
    /// Force on the ball, N.
    pub force: Vec3,
    /// Mean normal n = (e0 + e1) / (|e0| + |e1|): |e1| - |e0| = n . (e1 - e0).
    pub normal: Vec3,
    /// dF/du for the mean velocity u of the centres, N s/m.
    pub(crate) by_velocity: Mat3,
    /// dF/ds for the mean velocity s used by friction, N s/m.
    pub(crate) by_slip: Mat3,
}

impl ContactStep {
    /// Mean of |e| at both ends for the mean velocity `velocity` of the centres (m/s), m.
    pub(crate) fn mean_distance(&self, velocity: &Vec3) -> f64 {
        0.5 * (self.start.norm() + (self.start + velocity * self.h).norm())
    }

    /// Mean normal for the mean velocity `velocity` of the centres, m/s; zero for a ball that stays centred.
    pub(crate) fn mean_normal(&self, velocity: &Vec3) -> Vec3 {
        let end = self.start + velocity * self.h;
        let sum = self.start.norm() + end.norm();
        if sum > 0.0 { (self.start + end) / sum } else { Vec3::zeros() }
    }
}

impl StepForce {
    /// No contact.
    fn none(normal: Vec3) -> Self {
        Self { force: Vec3::zeros(), normal, by_velocity: Mat3::zeros(), by_slip: Mat3::zeros() }
    }
}

impl Coefficients {
    /// Force over elastic force with which a ball of the effective mass `mass` (kg), `penetration` (m) deep at the penetration
    /// `rate` (m/s), leaves its wall at the speed `separation`, m/s. Few steps in an impact lose too little energy by the damping
    /// at their mean rates; this returns what the law leaves, and never creates any.
    pub fn rebound(&self, mass: f64, penetration: f64, rate: f64, separation: f64) -> f64 {
        let missing = 0.5 * mass * (separation * separation - rate * rate);
        (missing / self.elastic.energy(penetration)).clamp(0.0, 1.0)
    }

    /// Force over `step` for the mean velocity `velocity` of the centres (m/s), so that e1 = e0 + h u, and the mean velocity
    /// `slip` used by friction (m/s). `slip_change` is the change of `slip` by the latest iteration, m/s, infinite before the first:
    /// the derivatives depend on it, the force does not.
    pub(crate) fn step_force(&self, step: &ContactStep, velocity: &Vec3, slip: &Vec3, slip_change: f64) -> StepForce {
        let ContactStep { h, start, clearances, .. } = *step;
        let end = start + velocity * h;
        let (before, after) = (start.norm(), end.norm());
        let sum = before + after;
        if sum == 0.0 {
            return StepForce::none(Vec3::zeros());
        }
        let normal = (start + end) / sum;
        let (d0, d1) = (before - clearances[0], after - clearances[1]);
        if d0 <= 0.0 && d1 <= 0.0 {
            return StepForce::none(normal);
        }
        let (elastic, stiffness) = self.elastic_force(d0, d1);
        let rate = (d1 - d0) / h;
        let rising = self.uses_largest_rate && rate > step.approach;
        let approach = if rising { rate } else { step.approach };
        let damping = step.rebound.unwrap_or(1.0 + self.damping * rate / approach);
        if elastic <= 0.0 || damping <= 0.0 {
            return StepForce::none(normal);
        }
        let force = elastic * damping;
        let damping_slope = if rising || step.rebound.is_some() { 0.0 } else { elastic * self.damping / approach };
        let by_rate = h * stiffness * damping + damping_slope;
        let tangent = Mat3::identity() - normal * normal.transpose();
        let mut direction = -normal;
        let mut by_slip = Mat3::zeros();
        if self.friction > 0.0 {
            // The sliding velocity at the end: twice the mean less that at the start, as on a parabola.
            let sliding = tangent * (slip * 2.0 - step.slip);
            let speed = sliding.norm();
            let per_speed = self.friction_per_speed(FrictionBranch::Unfrozen, speed);
            direction -= sliding * per_speed;
            // Where friction is full, the secant: a correction can stop the sliding but not reverse it. It converges linearly, and
            // slowly where friction nearly stops the sliding. The tangent converges quadratically once the direction is known.
            // Within the dead band, the slope of the ramp.
            let full = per_speed.max(0.0);
            let direction_is_known = speed > 2.0 * slip_change && speed > FAR_FROM_RAMP * self.slip_high;
            let mut resistance = tangent * full;
            if speed < self.slip_low {
                resistance = tangent * (self.friction / (self.slip_high - self.slip_low));
            } else if speed < self.slip_high || direction_is_known {
                let along = sliding / speed;
                resistance += along * along.transpose() * (self.friction_slope(speed) - full);
            }
            by_slip = resistance * (-2.0 * force);
        }
        // How the force changes with the normal force: that of bristles below their limit does not.
        let mut per_force = direction;
        if let Some(bristles) = &self.bristles {
            let sliding = tangent * (slip * 2.0 - step.slip);
            let unlimited = step.bent + sliding * (step.h + bristles.lag);
            let (length, limit) = (unlimited.norm(), bristles.limit(force, sliding.norm()));
            let friction = bristles.step(step, &sliding, force) * (bristles.stiffness / force);
            direction -= friction;
            // As above: the secant unless the direction is known.
            let mut resistance = tangent;
            if length > limit {
                per_force -= friction;
                resistance *= limit / length;
                if length > 2.0 * slip_change * (step.h + bristles.lag) {
                    let along = unlimited / length;
                    resistance -= along * along.transpose() * (limit / length);
                }
            }
            by_slip = resistance * (-2.0 * bristles.stiffness * (step.h + bristles.lag));
        }
        let by_velocity = per_force * (end / after).transpose() * by_rate - tangent * (force * h / sum);
        StepForce { force: direction * force, normal, by_velocity, by_slip }
    }

    /// Elastic force over the step between the penetrations `d0` and `d1` (m), N, and its derivative with respect to `d1`, N/m.
    fn elastic_force(&self, d0: f64, d1: f64) -> (f64, f64) {
        let force = |d: f64| if d > 0.0 { self.elastic.force(d) } else { 0.0 };
        let slope = |d: f64| if d > 0.0 { self.elastic.slope(d) } else { 0.0 };
        let change = d1 - d0;
        if change.abs() < NEARLY_EQUAL * d0.abs().max(d1.abs()) {
            let middle = 0.5 * (d0 + d1);
            let mean = (force(d0) + 4.0 * force(middle) + force(d1)) / 6.0;
            (mean, (2.0 * slope(middle) + slope(d1)) / 6.0)
        } else {
            let mean = (self.elastic.energy(d1) - self.elastic.energy(d0)) / change;
            (mean, (force(d1) - mean) / change)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{ApproachSpeed, FrictionVelocity, Parameters};

    fn law(parameters: Parameters) -> Coefficients {
        Coefficients::new(&parameters, 3e-4)
    }

    fn step(h: f64, depth: f64) -> ContactStep {
        let normal = Vec3::new(2.0, -1.0, 2.0) / 3.0;
        ContactStep {
            h,
            start: normal * (3e-4 + depth),
            clearances: [3e-4; 2],
            slip: Vec3::new(0.01, 0.03, 0.0),
            bent: Vec3::zeros(),
            approach: 0.05,
            rebound: None,
        }
    }

    #[test]
    fn the_elastic_work_of_a_step_is_the_change_of_the_energy() {
        let elastic = law(Parameters { restitution: 1.0, friction: 0.0, ..Parameters::default() });
        for (depth, speed) in [(-1e-6, 0.1), (2e-6, -0.2), (2e-6, -0.05), (3e-6, 0.02), (3e-6, 1e-6)] {
            let step = step(2e-5, depth);
            let velocity = step.start.normalize() * speed + Vec3::new(0.01, 0.02, 0.0);
            let result = elastic.step_force(&step, &velocity, &Vec3::zeros(), 0.0);
            let end = (step.start + velocity * step.h).norm() - 3e-4;
            let gain = elastic.elastic.energy(end) - elastic.elastic.energy(depth);
            let work = result.force.dot(&velocity) * step.h;
            assert!((work + gain).abs() < 1e-9 * elastic.elastic.energy(3e-6), "{depth} {speed}: {work:e} {gain:e}");
        }
    }

    #[test]
    fn derivatives_are_those_of_central_differences() {
        for friction_velocity in FrictionVelocity::ALL {
            for approach_speed in ApproachSpeed::ALL {
                // On the ramp of friction, and in full sliding.
                let cases = [(-1e-6, 0.12), (2e-6, 0.03), (2e-6, -0.02), (3e-6, 1e-6)];
                for ((depth, speed), slip_speed_high) in cases.into_iter().flat_map(|case| [(case, 10.0), (case, 2e-6)])
                {
                    let law =
                        law(Parameters { friction_velocity, approach_speed, slip_speed_high, ..Parameters::default() });
                    let step = step(2e-5, depth);
                    let velocity = step.start.normalize() * speed + Vec3::new(0.01, 0.02, 0.0);
                    let slip = Vec3::new(0.05, -0.1, 0.2);
                    let result = law.step_force(&step, &velocity, &slip, 0.0);
                    assert!(result.force.norm() > 0.1);
                    for k in 0..3 {
                        let d = Vec3::ith(k, 1e-7);
                        let force = |u: Vec3, s: Vec3| law.step_force(&step, &u, &s, 0.0).force;
                        let by_velocity = (force(velocity + d, slip) - force(velocity - d, slip)) / 2e-7;
                        let by_slip = (force(velocity, slip + d) - force(velocity, slip - d)) / 2e-7;
                        let off = (by_velocity - result.by_velocity.column(k)).norm() / result.by_velocity.norm();
                        assert!(off < 2e-3, "{friction_velocity} {approach_speed} {depth} {speed} u{k}: {off:e}");
                        let off = (by_slip - result.by_slip.column(k)).norm() / result.by_slip.norm();
                        assert!(off < 1e-4, "{friction_velocity} {approach_speed} {depth} {speed} s{k}: {off:e}");
                    }
                }
            }
        }
    }
}
