//! The elastic law of a contact: the force between penetration and rebound without damping, its slope, and its energy. Nothing
//! outside this file knows that the force grows with the power 1.5 of the penetration.

use super::{Parameters, ShownLaw};

/// Power of the penetration in Hertz's theory of spheres.
const EXPONENT: f64 = 1.5;

/// The force as the formulas of the normal laws show it.
macro_rules! elastic_force {
    () => {
        "K d^1.5"
    };
}
pub(super) use elastic_force;

/// Hertz's law of a ball in its socket, paper eq. (19): F = K d^1.5, K = 4 / (3 (s + s)) sqrt(R r / (R - r)).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ElasticLaw {
    /// Stiffness K, N/m^1.5.
    pub stiffness: f64,
}

impl ElasticLaw {
    /// The stiffness as a tooltip shows it.
    pub const SHOWN: ShownLaw = ShownLaw {
        law: "Stiffness of the contact",
        formula: "K = 4 / (3 (s + s)) · √(R r / (R - r)), s = (1 - ν²) / E, R = r + c",
        elsewhere: None,
    };

    /// Law of a ball of radius `r` in a socket of radius `r + c`, both of the material of `parameters`, for a clearance c > 0, m:
    /// s = (1 - nu^2) / E.
    pub fn of_ball(parameters: &Parameters, clearance: f64) -> Self {
        let r = parameters.ball_radius;
        let s = (1.0 - parameters.poisson_ratio * parameters.poisson_ratio) / parameters.youngs_modulus;
        Self { stiffness: 4.0 / (6.0 * s) * ((r + clearance) * r / clearance).sqrt() }
    }

    /// Law that exerts `force` (N) at the penetration `depth` > 0, m.
    pub fn through(depth: f64, force: f64) -> Self {
        Self { stiffness: force / (depth * depth.sqrt()) }
    }

    /// Force at the penetration `d`, N. Continued as an odd function to negative `d`, m: callers that have lost contact ask for 0.
    #[inline]
    pub fn force(&self, d: f64) -> f64 {
        self.stiffness * d * d.abs().sqrt()
    }

    /// Derivative of [`Self::force`], N/m.
    #[inline]
    pub fn slope(&self, d: f64) -> f64 {
        EXPONENT * self.stiffness * d.abs().sqrt()
    }

    /// Energy stored at the penetration `d` (m), J; 0 without contact.
    #[inline]
    pub fn energy(&self, d: f64) -> f64 {
        if d <= 0.0 {
            return 0.0;
        }
        0.4 * self.stiffness * d * d * d.sqrt()
    }

    /// Derivative of the energy by the clearance at the same penetration `d` (m) over the energy, 1/m, for a ball of `radius` (m) in
    /// a gap of `clearance`, m: K ~ sqrt((r + c) / c).
    pub(crate) fn relative_stiffening(radius: f64, clearance: f64) -> f64 {
        0.5 * (1.0 / (radius + clearance) - 1.0 / clearance)
    }

    /// d F'(d) / F(d): the power with which the force grows at any penetration.
    #[inline]
    pub fn exponent(&self) -> f64 {
        EXPONENT
    }

    /// Penetration at which the law balances `force` (N), m: the rest position of a settled contact.
    pub fn depth(&self, force: f64) -> f64 {
        libm::cbrt((force / self.stiffness) * (force / self.stiffness))
    }

    /// [`Self::slope`] where the law balances `force` (N), N/m.
    fn slope_under(&self, force: f64) -> f64 {
        EXPONENT * libm::cbrt(self.stiffness * self.stiffness * force)
    }

    /// Energy of a law of this kind that exerts `force` (N) at the penetration `d` (m), J, whatever its stiffness.
    pub fn energy_at(d: f64, force: f64) -> f64 {
        0.4 * force * d
    }

    /// Estimated duration of an impact of a mass `mass` (kg) at `speed` (m/s) with the damping factor `damping`, s: 2.94 d / v
    /// with the maximum penetration of Hertz's theory (K. L. Johnson, Contact Mechanics, section 11.4), reduced for strong damping.
    pub(crate) fn impact_duration(&self, damping: f64, mass: f64, speed: f64) -> f64 {
        2.94 * self.deepest(damping, mass, speed) / speed
    }

    /// Largest penetration of that impact, m.
    pub fn deepest(&self, damping: f64, mass: f64, speed: f64) -> f64 {
        let effective = self.stiffness * (1.0 + 0.5 * damping);
        libm::pow(1.25 * mass * speed * speed / effective, 0.4)
    }

    /// Half the oscillation period of a mass `mass` (kg) that rests on the contact under `force` (N), s; infinite without force.
    pub(crate) fn half_period_under(&self, mass: f64, force: f64) -> f64 {
        std::f64::consts::PI * (mass / self.slope_under(force)).sqrt()
    }

    /// Half the oscillation period about the penetration `d` (m) of a mass whose inverse is `mobility` (1/kg), s.
    pub(crate) fn half_period_at(&self, d: f64, mobility: f64) -> f64 {
        std::f64::consts::PI / (self.slope(d) * mobility).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stiffness_at_a_clearance_of_0_3_mm_has_its_reference_value() {
        let k = ElasticLaw::of_ball(&Parameters::default(), 0.3e-3).stiffness;
        assert!((k / 8.84e10 - 1.0).abs() < 1e-3, "{k:e}");
    }

    #[test]
    fn slope_and_force_are_the_derivatives_of_the_energy_and_depth_is_the_inverse() {
        let law = ElasticLaw::of_ball(&Parameters::default(), 0.3e-3);
        for d in [1e-8, 3e-6, 2e-4] {
            let step = 1e-5 * d;
            let by_depth = |f: &dyn Fn(f64) -> f64| (f(d + step) - f(d - step)) / (2.0 * step);
            assert!((by_depth(&|d| law.energy(d)) / law.force(d) - 1.0).abs() < 1e-9, "{d}");
            assert!((by_depth(&|d| law.force(d)) / law.slope(d) - 1.0).abs() < 1e-9, "{d}");
            assert!((law.depth(law.force(d)) / d - 1.0).abs() < 1e-14, "{d}");
            assert!((law.slope_under(law.force(d)) / law.slope(d) - 1.0).abs() < 1e-14, "{d}");
            assert!((law.exponent() * law.force(d) / (d * law.slope(d)) - 1.0).abs() < 1e-14, "{d}");
            assert!((ElasticLaw::energy_at(d, law.force(d)) / law.energy(d) - 1.0).abs() < 1e-14, "{d}");
            assert!((ElasticLaw::through(d, 7.0).force(d) - 7.0).abs() < 1e-14, "{d}");
            assert_eq!((law.force(-d), law.energy(-d)), (-law.force(d), 0.0));
        }
    }

    #[test]
    fn a_growing_gap_softens_the_contact_as_stated() {
        let parameters = Parameters::default();
        let energy = |c: f64| ElasticLaw::of_ball(&parameters, c).energy(2e-6);
        let (c, step) = (3e-4, 3e-9);
        let relative = (energy(c + step) - energy(c - step)) / (2.0 * step * energy(c));
        let stated = ElasticLaw::relative_stiffening(parameters.ball_radius, c);
        assert!((relative / stated - 1.0).abs() < 1e-8, "{relative} {stated}");
    }

    #[test]
    fn an_elastic_impact_lasts_as_long_and_goes_as_deep_as_estimated() {
        let (law, mass, speed) = (ElasticLaw { stiffness: 8.84e10 }, 0.3, 0.077);
        let (mut x, mut v, mut t, mut deepest, h) = (0.0_f64, speed, 0.0, 0.0_f64, 1e-9);
        while x >= 0.0 {
            v -= h * law.force(x) / mass;
            x += h * v;
            t += h;
            deepest = deepest.max(x);
        }
        assert!((t / law.impact_duration(0.0, mass, speed) - 1.0).abs() < 2e-3, "{t:e}");
        assert!((deepest / law.deepest(0.0, mass, speed) - 1.0).abs() < 1e-4, "{deepest:e}");
    }

    #[test]
    fn a_settled_ball_rings_with_the_stated_period() {
        let (law, mass, force) = (ElasticLaw { stiffness: 8.84e10 }, 0.3, 20.0);
        let rest = law.depth(force);
        let (mut x, mut v, mut t, h) = (1.0001 * rest, 0.0_f64, 0.0, 1e-9);
        loop {
            v += h * (force - law.force(x)) / mass;
            x += h * v;
            t += h;
            if v >= 0.0 {
                break;
            }
        }
        assert!((t / law.half_period_under(mass, force) - 1.0).abs() < 1e-3, "{t:e}");
        assert!((t / law.half_period_at(rest, 1.0 / mass) - 1.0).abs() < 1e-3, "{t:e}");
    }
}
