//! Friction that sticks: elastic bristles between the surfaces, which slide over one another where they are bent to their limit.
//!
//! A contact carries the deflection z of its bristles, a vector in the tangent plane that turns with the carrier. With the normal force
//! N, the sliding velocity v, and the stiffness k and damping d of the bristles, the friction force on the ball is
//!
//! ```text
//! F = -(k z + d dz/dt),   dz/dt = (P(z + T v) - z) / T,   T = d / k
//! mu(v) = mu_kinetic + (mu_static - mu_kinetic) exp(-(v / v_s)^2)
//! ```
//!
//! where P projects onto the disc of the radius s = mu(v) N / k. Below the limit dz/dt = v: the bristles bend as the surfaces move, and
//! nothing slides. A load that the limit bears moves the contact by nanometres, and then not at all. Beyond it F is mu(v) N, and z
//! follows in the time T. This is the bristle model of Gonthier, McPhee, Lange & Piedboeuf, *Multibody System Dynamics* 11, 2004, 209-233;
//! its elastic range is the condition for presliding without drift of Dupont, Hayward, Armstrong & Altpeter, *IEEE Transactions on
//! Automatic Control* 47, 2002, 787-792. Here the stiffness of the bristles, and not their length, is independent of N, because then
//! it is passive: with w = P(z + T v), and 0 in the disc, (z + T v - w) . w >= 0, so that
//!
//! ```text
//! -F . v - d/dt (k z^2 / 2) = (k / T) (w . T v - z . w + z^2) >= (k / T) |w - z|^2 >= 0
//! ```
//!
//! however N and v change.

use super::{Coefficients, ContactStep, FrictionBranch, FrictionLaw, Mat3, Parameters, Vec3};

/// Sliding speed that is small for bristles, m/s.
const SLOW_SLIDING: f64 = 1e-6;

/// Coefficients of the bristles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bristles {
    /// k, N/m.
    pub stiffness: f64,
    /// T, s.
    pub(crate) lag: f64,
    kinetic: f64,
    /// At rest; at least the kinetic coefficient.
    pub static_coefficient: f64,
    /// v_s, m/s.
    stribeck_speed: f64,
}

/// The friction of bristles.
#[derive(Clone, Copy, Debug, Default)]
pub struct BristleForce {
    /// On the ball, N.
    pub force: Vec3,
    /// dz/dt, m/s.
    pub rate: Vec3,
    /// How far z + T v lies beyond the branch of the law, m; negative inside.
    pub excess: f64,
    /// The derivative of P: the projection onto the plane across `along`, times `turning`; the identity where the bristles stick.
    pub(crate) turning: f64,
    /// Direction in which they slide; zero where they stick.
    pub(crate) along: Vec3,
    /// dF/dv beside that through P, N s/m.
    pub(crate) by_speed: Mat3,
    /// dF/dN.
    pub(crate) by_normal_force: Vec3,
}

impl BristleForce {
    /// The derivative of P.
    pub(crate) fn by_bending(&self) -> Mat3 {
        (Mat3::identity() - self.along * self.along.transpose()) * self.turning
    }
}

/// `vector` shortened to `limit`.
fn shorten(vector: Vec3, limit: f64) -> Vec3 {
    let length = vector.norm();
    if length > limit { vector * (limit / length) } else { vector }
}

impl Bristles {
    /// Those of a joint; `None` if its friction is of another law.
    pub(super) fn of(parameters: &Parameters) -> Option<Self> {
        (parameters.friction_law == FrictionLaw::Bristle).then(|| Self {
            stiffness: parameters.bristle_stiffness,
            lag: parameters.bristle_damping / parameters.bristle_stiffness,
            kinetic: parameters.friction,
            static_coefficient: parameters.friction * parameters.static_friction_ratio,
            stribeck_speed: parameters.stribeck_speed,
        })
    }

    /// Largest friction over the normal force at a sliding speed, m/s.
    pub fn coefficient(&self, speed: f64) -> f64 {
        let excess = self.static_coefficient - self.kinetic;
        if excess == 0.0 {
            return self.kinetic;
        }
        let x = speed / self.stribeck_speed;
        self.kinetic + excess * libm::exp(-x * x)
    }

    /// Derivative of [`Self::coefficient`] over the speed, s^2/m^2.
    fn coefficient_slope_per_speed(&self, speed: f64) -> f64 {
        -2.0 * (self.coefficient(speed) - self.kinetic) / (self.stribeck_speed * self.stribeck_speed)
    }

    /// Largest deflection s under a normal force, N, at a sliding speed, m/s; in m.
    pub fn limit(&self, normal_force: f64, speed: f64) -> f64 {
        self.coefficient(speed) * normal_force / self.stiffness
    }

    /// Friction on the ball of bristles with the deflection `bent`, m, under the normal force `normal_force`, N, at the sliding velocity
    /// `slip`, m/s, both in the tangent plane.
    pub fn force(&self, branch: FrictionBranch, bent: &Vec3, slip: &Vec3, normal_force: f64) -> BristleForce {
        let (k, speed) = (self.stiffness, slip.norm());
        let limit = self.limit(normal_force, speed);
        let unlimited = bent + slip * self.lag;
        let length = unlimited.norm();
        let (slides, excess) = match branch {
            FrictionBranch::Sticking => (false, length - limit),
            FrictionBranch::Sliding => (length > 0.0, limit - length),
            _ => (length > limit, f64::NEG_INFINITY),
        };
        if !slides {
            let force = unlimited * -k;
            return BristleForce { force, rate: *slip, excess, turning: 1.0, ..BristleForce::default() };
        }
        let along = unlimited / length;
        BristleForce {
            force: along * (-k * limit),
            rate: (along * limit - bent) / self.lag,
            excess,
            turning: limit / length,
            along,
            by_speed: along * slip.transpose() * (-normal_force * self.coefficient_slope_per_speed(speed)),
            by_normal_force: along * -self.coefficient(speed),
        }
    }

    /// Energy stored in bristles with this deflection, m; in J.
    pub fn energy(&self, bent: &Vec3) -> f64 {
        0.5 * self.stiffness * bent.norm_squared()
    }

    /// P(z + (h + T) v) for a whole step of h from the deflection z, [`ContactStep::bent`], at the sliding velocity v, `end`, of its end,
    /// m/s: the implicit rule, by which friction stops a motion and does not reverse it.
    pub(super) fn step(&self, step: &ContactStep, end: &Vec3, normal_force: f64) -> Vec3 {
        shorten(step.bent + end * (step.h + self.lag), self.limit(normal_force, end.norm()))
    }
}

impl Coefficients {
    /// Whether the law of friction exerts a force.
    pub(crate) fn has_friction(&self) -> bool {
        self.friction > 0.0 || self.bristles.is_some()
    }

    /// Sliding speed, m/s, that is small for the law of friction.
    pub(crate) fn slow_sliding(&self) -> f64 {
        if self.bristles.is_some() { SLOW_SLIDING } else { self.slip_high }
    }

    /// The deflection, m, with which a whole step ends at the mean sliding velocity `slip` (m/s, not yet projected), under the normal
    /// force `normal_force`, N, with the mean normal `normal`.
    pub(crate) fn bent_after(&self, step: &ContactStep, normal: &Vec3, slip: &Vec3, normal_force: f64) -> Vec3 {
        let tangent = Mat3::identity() - normal * normal.transpose();
        let end = tangent * (slip * 2.0 - step.slip);
        let Some(bristles) = &self.bristles else {
            return Vec3::zeros();
        };
        let limited = bristles.step(step, &end, normal_force);
        if (step.bent + end * (step.h + bristles.lag)).norm() > bristles.limit(normal_force, end.norm()) {
            (step.bent * bristles.lag + limited * step.h) / (bristles.lag + step.h)
        } else {
            step.bent + tangent * slip * step.h
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bristles(static_friction_ratio: f64) -> Bristles {
        let parameters = Parameters {
            friction_law: FrictionLaw::Bristle,
            static_friction_ratio,
            stribeck_speed: 1e-3,
            ..Parameters::DEFAULT
        };
        Bristles::of(&parameters).expect("of that law")
    }

    /// Numbers between -1 and 1 that look random.
    fn numbers() -> impl FnMut() -> f64 {
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }
    }

    #[test]
    fn the_power_never_exceeds_the_rate_of_the_stored_energy() {
        let mut next = numbers();
        let mut slides = 0;
        for ratio in [1.0, 1.5] {
            let law = bristles(ratio);
            for _ in 0..20_000 {
                let normal_force = 100.0 * (1.0 + next());
                let slip = Vec3::new(next(), next(), 0.0) * libm::exp(9.0 * next()) * 1e-4;
                // Also far beyond the limit, as after a fall of the normal force.
                let bent = Vec3::new(next(), next(), 0.0) * (3.0 * law.limit(normal_force, 0.0));
                let BristleForce { force, rate, along, .. } =
                    law.force(FrictionBranch::Unfrozen, &bent, &slip, normal_force);
                assert!(force.norm() <= law.coefficient(slip.norm()) * normal_force * (1.0 + 1e-12));
                let power = law.stiffness * bent.norm() * rate.norm() + force.norm() * slip.norm();
                let dissipated = -force.dot(&slip) - law.stiffness * bent.dot(&rate);
                assert!(dissipated >= -1e-12 * power, "{dissipated:e}");
                slides += u32::from(along != Vec3::zeros());
            }
        }
        assert!((10_000..39_000).contains(&slides), "{slides}");
    }

    #[test]
    fn derivatives_are_those_of_central_differences() {
        let law = bristles(1.4);
        let normal_force = 50.0;
        let slip = Vec3::new(3e-4, -5e-4, 0.0);
        let limit = law.limit(normal_force, slip.norm());
        for (branch, size) in [
            (FrictionBranch::Sticking, 0.5),
            (FrictionBranch::Sliding, 1.0),
            (FrictionBranch::Unfrozen, 0.2),
            (FrictionBranch::Unfrozen, 1.5),
        ] {
            let z = Vec3::new(0.8, 0.6, 0.0) * (size * limit);
            let found = law.force(branch, &z, &slip, normal_force);
            let [by_bent, by_slip] = [law.stiffness, law.stiffness * law.lag].map(|k| found.by_bending() * -k);
            for k in 0..2 {
                let unit = Vec3::ith(k, 1.0);
                let d = 1e-6 * limit;
                let force = |z| law.force(branch, &z, &slip, normal_force).force;
                let difference = (force(z + unit * d) - force(z - unit * d)) / (2.0 * d);
                let off = (difference - by_bent.column(k)).norm() / law.stiffness;
                assert!(off < 1e-7, "{branch:?} z{k}: {off:e}");
                let d = 1e-9;
                let force = |v| law.force(branch, &z, &v, normal_force).force;
                let difference = (force(slip + unit * d) - force(slip - unit * d)) / (2.0 * d);
                let off = (difference - (by_slip + found.by_speed).column(k)).norm() / (law.stiffness * law.lag);
                assert!(off < 1e-5, "{branch:?} v{k}: {off:e}");
            }
            let force = |n| law.force(branch, &z, &slip, n).force;
            let difference = (force(normal_force + 1e-4) - force(normal_force - 1e-4)) / 2e-4;
            assert!((difference - found.by_normal_force).norm() < 1e-8, "{branch:?}");
        }
    }

    #[test]
    fn the_static_coefficient_holds_at_rest_and_the_kinetic_one_far_above_the_stribeck_speed() {
        let law = bristles(1.5);
        assert!((law.coefficient(0.0) - 0.225).abs() < 1e-15);
        assert!((law.coefficient(1e-3) - (0.15 + 0.075 * libm::exp(-1.0))).abs() < 1e-15);
        assert!((law.coefficient(1.0) - 0.15).abs() < 1e-15);
    }

    #[test]
    fn a_loop_of_the_displacement_encloses_the_area_of_an_elastic_plastic_spring() {
        // Between -x and x: 4 (x - s) mu N for a limit s < x, if it is slow against the lag.
        let law = bristles(1.0);
        let (normal_force, amplitude, speed, steps) = (100.0, 4e-6, 1e-5, 100_000_u32);
        let limit = law.limit(normal_force, 0.0);
        assert!(limit < 0.1 * amplitude);
        let h = amplitude / f64::from(steps) / speed;
        let (mut z, mut work, mut ends) = (Vec3::zeros(), 0.0, Vec::new());
        for _ in 0..3 {
            work = 0.0;
            for n in 0..4 * steps {
                let sign = if (n + steps) / (2 * steps) % 2 == 0 { 1.0 } else { -1.0 };
                let slip = Vec3::x() * (sign * speed);
                let half = z + law.force(FrictionBranch::Unfrozen, &z, &slip, normal_force).rate * (0.5 * h);
                let middle = law.force(FrictionBranch::Unfrozen, &half, &slip, normal_force);
                work -= middle.force.dot(&slip) * h;
                z += middle.rate * h;
            }
            ends.push(z);
        }
        assert!((ends[2] - ends[1]).norm() < 1e-9 * limit, "the loop closes");
        let area = 4.0 * (amplitude - limit) * 0.15 * normal_force;
        assert!((work / area - 1.0).abs() < 1e-3, "{work:e} {area:e}");
    }
}
