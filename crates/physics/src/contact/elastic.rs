//! The elastic law of a contact: the force between penetration and rebound without damping, its slope, its energy, and the patch
//! that carries it. Nothing outside this file knows with which power of the penetration the force grows.

use super::{NormalLaw, Parameters, ShownLaw};

/// A normal law on the elastic force of [`Power::Spheres`] as it is shown: what follows that force.
macro_rules! on_spheres {
    ($rest:literal) => {
        concat!("N = K d^1.5", $rest)
    };
}
pub(super) use on_spheres;

/// The power n of the penetration with which a force grows. A new one is a variant; the compiler names what it needs, all here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Power {
    /// 1.5: spheres after Hertz.
    Spheres,
}

impl Power {
    /// n, and the duration of an impact without damping times its speed over its depth: 2 B(1 / (n + 1), 1/2) / (n + 1).
    #[inline]
    const fn constants(self) -> (f64, f64) {
        match self {
            Self::Spheres => (1.5, 2.94),
        }
    }

    /// x^(n - 1) for x >= 0.
    #[inline]
    fn root(self, x: f64) -> f64 {
        match self {
            Self::Spheres => x.sqrt(),
        }
    }

    /// x^(1 / n) for x >= 0.
    fn inverse(self, x: f64) -> f64 {
        match self {
            Self::Spheres => libm::cbrt(x * x),
        }
    }
}

/// F = K d^n of a ball in its socket. Hertz's law, paper eq. (19): n = 1.5, K = 4 / (3 (s + s)) sqrt(R r / (R - r)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElasticLaw {
    /// Stiffness K, N/m^n.
    pub stiffness: f64,
    power: Power,
}

impl ElasticLaw {
    /// The stiffness under `law` as a tooltip shows it.
    pub fn shown(law: NormalLaw) -> ShownLaw {
        let formula = match law.power() {
            Power::Spheres => "K = 4 / (3 (s + s)) · √(R r / (R - r)), s = (1 - ν²) / E, R = r + c",
        };
        ShownLaw { law: "Stiffness of the contact", formula, elsewhere: None }
    }

    /// Law of a ball of radius `r` in a socket of radius `r + c`, both of the material of `parameters`, for a clearance c > 0, m:
    /// s = (1 - nu^2) / E.
    pub fn of_ball(parameters: &Parameters, clearance: f64) -> Self {
        let power = parameters.normal_law.power();
        let s = (1.0 - parameters.poisson_ratio * parameters.poisson_ratio) / parameters.youngs_modulus;
        let stiffness = match power {
            Power::Spheres => 4.0 / (6.0 * s) * Self::effective_radius(parameters.ball_radius, clearance).sqrt(),
        };
        Self { stiffness, power }
    }

    /// Law of a sphere of radius `radius`, m, on a plane, both of the material of `parameters`: K = 4 E* sqrt(r) / 3.
    pub fn of_corner(parameters: &Parameters, radius: f64) -> Self {
        let power = parameters.normal_law.power();
        let s = (1.0 - parameters.poisson_ratio * parameters.poisson_ratio) / parameters.youngs_modulus;
        let stiffness = match power {
            Power::Spheres => 4.0 / (6.0 * s) * radius.sqrt(),
        };
        Self { stiffness, power }
    }

    /// Hertz's law that exerts `force` (N) at the penetration `depth` > 0, m.
    pub fn through(depth: f64, force: f64) -> Self {
        let power = Power::Spheres;
        Self { stiffness: force / (depth * power.root(depth)), power }
    }

    /// R r / (R - r) of a ball of the radius `r` in a gap of `clearance`, m: the gap grows as x^2 over twice that.
    pub fn effective_radius(r: f64, clearance: f64) -> f64 {
        (r + clearance) * r / clearance
    }

    /// Radius of the patch over which a ball of the radius `r` in a gap of `clearance` touches at the penetration `d`, m: after Hertz,
    /// a = sqrt(R r d / (R - r)). `None` without contact, and under a law that knows none.
    pub fn patch(&self, r: f64, clearance: f64, d: f64) -> Option<f64> {
        match self.power {
            Power::Spheres => (d > 0.0).then(|| (Self::effective_radius(r, clearance) * d).sqrt()),
        }
    }

    /// Force at the penetration `d`, N. Continued as an odd function to negative `d`, m: callers that have lost contact ask for 0.
    #[inline]
    pub fn force(&self, d: f64) -> f64 {
        self.stiffness * d * self.power.root(d.abs())
    }

    /// Derivative of [`Self::force`], N/m.
    #[inline]
    pub fn slope(&self, d: f64) -> f64 {
        self.exponent() * self.stiffness * self.power.root(d.abs())
    }

    /// Energy stored at the penetration `d` (m), J; 0 without contact.
    #[inline]
    pub fn energy(&self, d: f64) -> f64 {
        if d <= 0.0 {
            return 0.0;
        }
        1.0 / (self.exponent() + 1.0) * self.stiffness * d * d * self.power.root(d)
    }

    /// Derivative of the energy by the clearance at the same penetration `d` (m) over the energy, 1/m, for a ball of `radius` (m) in
    /// a gap of `clearance`, m: K ~ sqrt((r + c) / c).
    pub(crate) fn relative_stiffening(&self, radius: f64, clearance: f64) -> f64 {
        match self.power {
            Power::Spheres => 0.5 * (1.0 / (radius + clearance) - 1.0 / clearance),
        }
    }

    /// d F'(d) / F(d): the power with which the force grows at any penetration.
    #[inline]
    pub fn exponent(&self) -> f64 {
        self.power.constants().0
    }

    /// Penetration at which the law balances `force` (N), m: the rest position of a settled contact.
    pub fn depth(&self, force: f64) -> f64 {
        self.power.inverse(force / self.stiffness)
    }

    /// Estimated duration of an impact of a mass `mass` (kg) at `speed` (m/s) with the damping factor `damping`, s: 2.94 d / v
    /// with the maximum penetration of Hertz's theory (K. L. Johnson, Contact Mechanics, section 11.4), reduced for strong damping.
    pub(crate) fn impact_duration(&self, damping: f64, mass: f64, speed: f64) -> f64 {
        self.power.constants().1 * self.deepest(damping, mass, speed) / speed
    }

    /// Largest penetration of that impact, m.
    pub fn deepest(&self, damping: f64, mass: f64, speed: f64) -> f64 {
        let effective = self.stiffness * (1.0 + 0.5 * damping);
        let next = self.exponent() + 1.0;
        libm::pow(0.5 * next * mass * speed * speed / effective, 1.0 / next)
    }

    /// Half the oscillation period of a mass `mass` (kg) that rests on the contact under `force` (N), s; infinite without force.
    pub(crate) fn half_period_under(&self, mass: f64, force: f64) -> f64 {
        self.half_period_at(self.depth(force), 1.0 / mass)
    }

    /// Half the oscillation period about the penetration `d` (m) of a mass whose inverse is `mobility` (1/kg), s.
    pub(crate) fn half_period_at(&self, d: f64, mobility: f64) -> f64 {
        std::f64::consts::PI / (self.slope(d) * mobility).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The law of every normal law, at a clearance of 0.3 mm.
    fn laws() -> impl Iterator<Item = ElasticLaw> {
        let parameters = |normal_law| Parameters { normal_law, ..Parameters::default() };
        NormalLaw::ALL.into_iter().map(move |law| ElasticLaw::of_ball(&parameters(law), 0.3e-3))
    }

    #[test]
    fn the_stiffness_at_a_clearance_of_0_3_mm_has_its_reference_value() {
        let k = ElasticLaw::of_ball(&Parameters::default(), 0.3e-3).stiffness;
        assert!((k / 8.84e10 - 1.0).abs() < 1e-3, "{k:e}");
    }

    #[test]
    fn slope_and_force_are_the_derivatives_of_the_energy_and_depth_is_the_inverse() {
        for (law, d) in laws().flat_map(|law| [1e-8, 3e-6, 2e-4].map(|d| (law, d))) {
            let step = 1e-5 * d;
            let by_depth = |f: &dyn Fn(f64) -> f64| (f(d + step) - f(d - step)) / (2.0 * step);
            assert!((by_depth(&|d| law.energy(d)) / law.force(d) - 1.0).abs() < 1e-9, "{d}");
            assert!((by_depth(&|d| law.force(d)) / law.slope(d) - 1.0).abs() < 1e-9, "{d}");
            assert!((law.depth(law.force(d)) / d - 1.0).abs() < 1e-14, "{d}");
            assert!((law.exponent() * law.force(d) / (d * law.slope(d)) - 1.0).abs() < 1e-14, "{d}");
            assert!((ElasticLaw::through(d, 7.0).force(d) - 7.0).abs() < 1e-14, "{d}");
            assert_eq!((law.force(-d), law.energy(-d)), (-law.force(d), 0.0));
        }
    }

    #[test]
    fn a_growing_gap_softens_the_contact_as_stated() {
        for normal_law in NormalLaw::ALL {
            let parameters = Parameters { normal_law, ..Parameters::default() };
            let law = |c: f64| ElasticLaw::of_ball(&parameters, c);
            let energy = |c: f64| law(c).energy(2e-6);
            let (c, step) = (3e-4, 3e-9);
            let relative = (energy(c + step) - energy(c - step)) / (2.0 * step * energy(c));
            let stated = law(c).relative_stiffening(parameters.ball_radius, c);
            assert!((relative / stated - 1.0).abs() < 1e-8, "{relative} {stated}");
        }
    }

    #[test]
    fn the_patch_carries_the_force_of_its_penetration() {
        // Hertz: F = 4/3 E* a³ / R, E* = E / (2 (1 - nu²)).
        let (parameters, c) = (Parameters::default(), 3e-4);
        let r = parameters.ball_radius;
        let law = ElasticLaw::of_ball(&parameters, c);
        let modulus = parameters.youngs_modulus / (2.0 * (1.0 - parameters.poisson_ratio.powi(2)));
        let patch = law.patch(r, c, 3e-6).expect("touches");
        let force = 4.0 / 3.0 * modulus * patch.powi(3) * (1.0 / r - 1.0 / (r + c));
        assert!((force / law.force(3e-6) - 1.0).abs() < 1e-12);
        assert_eq!(law.patch(r, c, 0.0), None);
    }

    #[test]
    fn an_elastic_impact_lasts_as_long_and_goes_as_deep_as_estimated() {
        let (mass, speed) = (0.3, 0.077);
        for law in laws() {
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
    }

    #[test]
    fn a_settled_ball_rings_with_the_stated_period() {
        let (mass, force) = (0.3, 20.0);
        for law in laws() {
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
}
