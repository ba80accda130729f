//! Friction that sticks: elastic bristles between the surfaces, which slide over one another where they are bent to their limit.
//!
//! A contact carries the deflection z of its bristles, a vector in the tangent plane. With the normal force N, the sliding velocity
//! v, the stiffness k and the damping d of the bristles, the friction force on the ball is
//!
//! ```text
//! F = -k P(z + (d / k) v),   dz/dt = v inside the disc |z| <= s,   s = mu(v) N / k
//! mu(v) = mu_kinetic + (mu_static - mu_kinetic) exp(-(v / v_s)^2)
//! ```
//!
//! where P projects onto that disc, and z leaves it neither by sliding nor as N falls. Below the limit z is the displacement of the
//! surfaces and nothing slides: a load that the limit bears moves the contact by nanometres, and then not at all. This is the bristle
//! model of Gonthier, McPhee, Lange & Piedboeuf (2004), with the elastic range of Dupont, Hayward, Armstrong & Altpeter (2002, their
//! condition for presliding without drift) and the stiffness of the bristles, instead of their length, independent of N. As P projects
//! onto a convex set that contains z, v . (P(z + d/k v) - z) >= 0: power -F . v and the rate of the stored energy k z^2 / 2 differ by a
//! dissipation that is never negative, however N and v change.
//!
//! Within a step, the state vector carries the displacement since the start of the step without its limit, a plain integral of v that
//! every method takes to its full order; the limit is applied to it at every evaluation, and to the state at the end of the step. The
//! direction in which bristles at their limit point is that of z + (v t - path), t the time since the start of the step, where the
//! surfaces have slid many limits: it follows a velocity that turns, up to an angle of about s over the radius of the path.

use super::{Coefficients, ContactStep, FrictionBranch, FrictionLaw, Mat3, Parameters, Vec3};

/// Limits slid within a step up to which, and from which, the direction of sliding is that of the displacement, or of the velocity.
const BY_DISPLACEMENT: f64 = 2.0;
const BY_VELOCITY: f64 = 20.0;

/// Sliding speed that is small for bristles, m/s.
const SLOW_SLIDING: f64 = 1e-6;

/// Coefficients of the bristles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bristles {
    /// k, N/m.
    pub stiffness: f64,
    /// d / k, s.
    pub(crate) lag: f64,
    kinetic: f64,
    /// At rest; at least the kinetic coefficient.
    pub static_coefficient: f64,
    /// v_s, m/s.
    stribeck_speed: f64,
}

/// Bristles of a contact at one instant within a step; world axes, in the tangent plane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deflection {
    /// At the start of the step, m.
    pub start: Vec3,
    /// That plus the displacement of the surfaces since, m.
    pub displaced: Vec3,
    /// Time since the start of the step, s.
    pub elapsed: f64,
}

/// The friction of bristles, and its derivatives.
#[derive(Clone, Copy, Debug, Default)]
pub struct BristleForce {
    /// On the ball, N.
    pub force: Vec3,
    /// How far z + d/k v lies beyond the branch of the law, m; negative inside.
    pub excess: f64,
    /// dF/dz and dF/dv, N/m and N s/m.
    pub(crate) by_deflection: Mat3,
    pub(crate) by_slip: Mat3,
    /// dF/dN.
    pub(crate) by_normal_force: Vec3,
}

/// 0 up to `low`, 1 from `high`, with two continuous derivatives.
fn smooth_step(x: f64, low: f64, high: f64) -> f64 {
    let u = ((x - low) / (high - low)).clamp(0.0, 1.0);
    u * u * u * (10.0 - u * (15.0 - 6.0 * u))
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

    /// The deflection before its limit, and the share of it that follows the velocity.
    fn unlimited(&self, at: &Deflection, slip: &Vec3, limit: f64) -> (Vec3, f64) {
        let path = at.displaced - at.start;
        let slid = path.norm();
        if slid <= BY_DISPLACEMENT * limit {
            return (at.displaced, 0.0);
        }
        let share = smooth_step(slid, BY_DISPLACEMENT * limit, BY_VELOCITY * limit);
        (at.displaced + (slip * at.elapsed - path) * share, share)
    }

    /// The deflection within its limit, m: the state with which the next step starts.
    pub fn settled(&self, at: &Deflection, slip: &Vec3, normal_force: f64) -> Vec3 {
        let limit = self.limit(normal_force, slip.norm());
        shorten(self.unlimited(at, slip, limit).0, limit)
    }

    /// Friction on the ball under the normal force `normal_force`, N, at the sliding velocity `slip`, m/s, both in the tangent plane.
    pub fn force(&self, branch: FrictionBranch, at: &Deflection, slip: &Vec3, normal_force: f64) -> BristleForce {
        let (k, speed) = (self.stiffness, slip.norm());
        let limit = self.limit(normal_force, speed);
        let (bent, share) = match branch {
            FrictionBranch::Sticking => (at.displaced, 0.0),
            _ => self.unlimited(at, slip, limit),
        };
        let bent = bent + slip * self.lag;
        let length = bent.norm();
        let slides = match branch {
            FrictionBranch::Sticking => false,
            FrictionBranch::Sliding => length > 0.0,
            _ => length > limit,
        };
        let excess = match branch {
            FrictionBranch::Sticking => length - limit,
            FrictionBranch::Sliding => limit - length,
            _ => f64::NEG_INFINITY,
        };
        let [by_deflection, by_bending] = [1.0 - share, share * at.elapsed + self.lag];
        if !slides {
            return BristleForce {
                force: bent * -k,
                excess,
                by_deflection: Mat3::identity() * (-k * by_deflection),
                by_slip: Mat3::identity() * (-k * by_bending),
                by_normal_force: Vec3::zeros(),
            };
        }
        let direction = bent / length;
        let turning = (Mat3::identity() - direction * direction.transpose()) * (-k * limit / length);
        let stribeck = direction * slip.transpose() * (-normal_force * self.coefficient_slope_per_speed(speed));
        BristleForce {
            force: direction * (-k * limit),
            excess,
            by_deflection: turning * by_deflection,
            by_slip: turning * by_bending + stribeck,
            by_normal_force: direction * -self.coefficient(speed),
        }
    }

    /// Energy stored in bristles with this deflection, m; in J.
    pub fn energy(&self, deflection: &Vec3) -> f64 {
        0.5 * self.stiffness * deflection.norm_squared()
    }

    /// Friction over a whole step that begins with the deflection [`ContactStep::deflection`], at the mean sliding velocity `slip` and
    /// with the velocity `end` at its end, m/s, in the tangent plane: that of the bristles as they would be bent at that velocity, so
    /// that friction can stop a motion and does not reverse it. Returns it over the stiffness, and the deflection at the end, m.
    pub(super) fn step(&self, step: &ContactStep, slip: &Vec3, end: &Vec3, normal_force: f64) -> [Vec3; 2] {
        let limit = self.limit(normal_force, end.norm());
        let bent = shorten(step.deflection + end * (step.h + self.lag), limit);
        [bent, shorten(step.deflection + slip * step.h, limit)]
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
    pub(crate) fn deflection_after(&self, step: &ContactStep, normal: &Vec3, slip: &Vec3, normal_force: f64) -> Vec3 {
        let tangent = Mat3::identity() - normal * normal.transpose();
        let end = tangent * (slip * 2.0 - step.slip);
        self.bristles.map_or_else(Vec3::zeros, |bristles| bristles.step(step, &(tangent * slip), &end, normal_force)[1])
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
        for ratio in [1.0, 1.5] {
            let law = bristles(ratio);
            for _ in 0..20_000 {
                let normal_force = 100.0 * (1.0 + next());
                let slip = Vec3::new(next(), next(), 0.0) * libm::exp(6.0 * next()) * 1e-3;
                let limit = law.limit(normal_force, slip.norm());
                let z = shorten(Vec3::new(next(), next(), 0.0) * 1.2 * limit, limit);
                let at = Deflection { start: z, displaced: z, elapsed: 0.0 };
                let force = law.force(FrictionBranch::Unfrozen, &at, &slip, normal_force).force;
                assert!(force.norm() <= law.coefficient(slip.norm()) * normal_force * (1.0 + 1e-12));
                // Inside the disc the stored energy grows at k z . v; at its edge at no more.
                let dissipated = -force.dot(&slip) - law.stiffness * z.dot(&slip);
                assert!(dissipated >= -1e-12 * force.norm() * slip.norm(), "{dissipated:e}");
            }
        }
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
            let at = |z: Vec3| Deflection { start: z, displaced: z, elapsed: 1e-4 };
            let found = law.force(branch, &at(z), &slip, normal_force);
            for k in 0..2 {
                let unit = Vec3::ith(k, 1.0);
                let d = 1e-6 * limit;
                let force = |z| law.force(branch, &at(z), &slip, normal_force).force;
                let difference = (force(z + unit * d) - force(z - unit * d)) / (2.0 * d);
                let off = (difference - found.by_deflection.column(k)).norm() / law.stiffness;
                assert!(off < 1e-7, "{branch:?} z{k}: {off:e}");
                let d = 1e-9;
                let force = |v| law.force(branch, &at(z), &v, normal_force).force;
                let difference = (force(slip + unit * d) - force(slip - unit * d)) / (2.0 * d);
                let off = (difference - found.by_slip.column(k)).norm() / (law.stiffness * law.lag);
                assert!(off < 1e-5, "{branch:?} v{k}: {off:e}");
            }
            let force = |n| law.force(branch, &at(z), &slip, n).force;
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
        // Between -x and x: 4 (x - s) mu N for a limit s < x, whatever the size of the steps.
        let law = Bristles { lag: 0.0, ..bristles(1.0) };
        let (normal_force, amplitude) = (100.0, 5e-6);
        let limit = law.limit(normal_force, 0.0);
        assert!(limit < amplitude);
        let (steps, speed) = (4000, 1e-3);
        let mut z = Vec3::zeros();
        let mut work = 0.0;
        let mut first = Vec3::zeros();
        for cycle in 0..3 {
            work = 0.0;
            for n in 0..4 * steps {
                let sign = if (n + steps) / (2 * steps) % 2 == 0 { 1.0 } else { -1.0 };
                let h = amplitude / f64::from(steps) / speed;
                let slip = Vec3::x() * (sign * speed);
                let at = Deflection { start: z, displaced: z + slip * h, elapsed: h };
                let middle = Deflection { start: z, displaced: z + slip * (0.5 * h), elapsed: 0.5 * h };
                work -= law.force(FrictionBranch::Unfrozen, &middle, &slip, normal_force).force.dot(&slip) * h;
                z = law.settled(&at, &slip, normal_force);
            }
            if cycle == 1 {
                first = z;
            }
        }
        assert!((z - first).norm() < 1e-12 * limit, "the loop closes");
        let area = 4.0 * (amplitude - limit) * 0.15 * normal_force;
        assert!((work / area - 1.0).abs() < 1e-3, "{work:e} {area:e}");
    }
}
