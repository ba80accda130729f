//! The elastic law of a contact: the force between penetration and rebound without damping, its slope, its energy, and the patch
//! that carries it. Nothing outside this file and `line.rs` knows how the force grows with the penetration.

use super::line::{self, Line};
use super::{Elasticity, Parameters, ShownLaw};

/// How the force grows with the penetration. A new one is a variant; the compiler names what it needs, all here.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Form {
    /// F = K d^1.5, spheres after Hertz.
    Sphere {
        /// Derivative of K by the clearance over K, 1/m.
        stiffening: f64,
    },
    /// Johnson's line contact, F = A f(d).
    Line(Line),
}

/// The elastic force of a contact. By default Hertz's law of a ball in its socket, paper eq. (19): F = K d^1.5,
/// K = 4 / (3 (s + s)) sqrt(R r / (R - r)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElasticLaw {
    /// K, N/m^1.5; in line contact A = pi E* L, N/m. The force is proportional to it.
    pub stiffness: f64,
    form: Form,
}

impl ElasticLaw {
    /// The stiffness as a tooltip shows it.
    pub fn shown(elasticity: Elasticity) -> ShownLaw {
        let (formula, elsewhere) = match elasticity {
            Elasticity::Sphere => ("K = 4 / (3 (s + s)) · √(R r / (R - r)), s = (1 - ν²) / E, R = r + c", None),
            Elasticity::Stiffness(_) => ("K = the given stiffness", None),
            Elasticity::StiffnessAt { .. } => (
                "K = F0 / d0^1.5, d0 = F0 / A · (ln(4 A c / F0) - 1), A = π E* L, E* = E / (2 (1 - ν²))",
                Some("Johnson (1985)"),
            ),
            Elasticity::Line { .. } => {
                ("d = F / A · (ln(4 A c / F) - 1), A = π E* L, E* = E / (2 (1 - ν²))", Some("Johnson (1985)"))
            }
        };
        ShownLaw { law: "Stiffness of the contact", formula, elsewhere }
    }

    /// Law of a joint as a whole, both parts of the material of `parameters`, for a clearance c > 0, m: a ball of radius r in a socket of
    /// radius r + c, s = (1 - nu^2) / E, or what its parameters choose in its place. For c = 0 that of the collars, which alone can touch.
    pub fn of_joint(parameters: &Parameters, clearance: f64) -> Self {
        match parameters.elasticity {
            _ if clearance == 0.0 => Self::of_faces(parameters),
            Elasticity::Sphere => Self::of_ball(parameters, clearance),
            Elasticity::Stiffness(stiffness) => Self::constant(stiffness),
            Elasticity::StiffnessAt { force, length } => {
                let modulus = line::modulus(parameters, length);
                let depth = Line::new(clearance).johnson(force / modulus);
                // K ~ d^-1.5 at the given force, and dd/dc = F / (A c).
                let stiffening = -1.5 * force / (modulus * clearance * depth);
                Self { stiffness: force / (depth * depth.sqrt()), form: Form::Sphere { stiffening } }
            }
            Elasticity::Line { length } => {
                Self { stiffness: line::modulus(parameters, length), form: Form::Line(Line::new(clearance)) }
            }
        }
    }

    /// K ~ sqrt((r + c) / c).
    fn of_ball(parameters: &Parameters, clearance: f64) -> Self {
        let (radius, s) = (parameters.ball_radius, Self::compliance(parameters));
        let stiffness = 4.0 / (6.0 * s) * Self::effective_radius(radius, clearance).sqrt();
        let stiffening = 0.5 * (1.0 / (radius + clearance) - 1.0 / clearance);
        Self { stiffness, form: Form::Sphere { stiffening } }
    }

    /// Law of a corner of a block: a sphere of radius `radius`, m, on a plane, K = 4 E* sqrt(r) / 3, or the stiffness given.
    pub fn of_corner(parameters: &Parameters, radius: f64) -> Self {
        Self::constant(match parameters.elasticity {
            Elasticity::Stiffness(stiffness) => stiffness,
            _ => 4.0 / (6.0 * Self::compliance(parameters)) * radius.sqrt(),
        })
    }

    /// Law of the collars of a pin as a whole, whatever the play along the axis: that of a ball at its radial play, or the stiffness given.
    pub(crate) fn of_faces(parameters: &Parameters) -> Self {
        let [radial, axial] = parameters.clearances();
        Self::constant(match parameters.elasticity {
            Elasticity::Stiffness(stiffness) => stiffness,
            _ => Self::of_ball(parameters, if radial > 0.0 { radial } else { axial }).stiffness,
        })
    }

    /// F = K d^1.5 whatever the clearance.
    fn constant(stiffness: f64) -> Self {
        Self { stiffness, form: Form::Sphere { stiffening: 0.0 } }
    }

    /// s = (1 - nu^2) / E, 1/Pa.
    fn compliance(parameters: &Parameters) -> f64 {
        (1.0 - parameters.poisson_ratio * parameters.poisson_ratio) / parameters.youngs_modulus
    }

    /// Hertz's law that exerts `force` (N) at the penetration `depth` > 0, m.
    pub fn through(depth: f64, force: f64) -> Self {
        Self::constant(force / (depth * depth.sqrt()))
    }

    /// The force up to which Johnson's line contact over the length `length`, m, has a depth that grows, N: 4 pi E* L c / e^2.
    pub fn largest_line_force(parameters: &Parameters, length: f64, clearance: f64) -> f64 {
        line::modulus(parameters, length) * line::largest(clearance)
    }

    /// R r / (R - r) of a ball of the radius `r` in a gap of `clearance`, m: the gap grows as x^2 over twice that.
    pub fn effective_radius(r: f64, clearance: f64) -> f64 {
        (r + clearance) * r / clearance
    }

    /// Radius, or in line contact half the width, of the patch over which a ball or pin of the radius `r` in a gap of `clearance` touches
    /// at the penetration `d`, m: after Hertz, a = sqrt(R r d / (R - r)), and a = sqrt(4 F R r / (A (R - r))). `None` without contact.
    pub fn patch(&self, r: f64, clearance: f64, d: f64) -> Option<f64> {
        let depth = match self.form {
            Form::Sphere { .. } => d,
            Form::Line(line) if d > 0.0 => 4.0 * line.force(d),
            Form::Line(_) => 0.0,
        };
        (depth > 0.0).then(|| (Self::effective_radius(r, clearance) * depth).sqrt())
    }

    /// Force at the penetration `d`, N. Continued as an odd function to negative `d`, m: callers that have lost contact ask for 0.
    #[inline]
    pub fn force(&self, d: f64) -> f64 {
        match self.form {
            Form::Sphere { .. } => self.stiffness * d * d.abs().sqrt(),
            Form::Line(line) => self.of_line(line, d, Line::force).copysign(d),
        }
    }

    /// Derivative of [`Self::force`], N/m.
    #[inline]
    pub fn slope(&self, d: f64) -> f64 {
        match self.form {
            Form::Sphere { .. } => 1.5 * self.stiffness * d.abs().sqrt(),
            Form::Line(line) => self.of_line(line, d, Line::slope),
        }
    }

    /// Energy stored at the penetration `d` (m), J; 0 without contact.
    #[inline]
    pub fn energy(&self, d: f64) -> f64 {
        if d <= 0.0 {
            return 0.0;
        }
        match self.form {
            Form::Sphere { .. } => 0.4 * self.stiffness * d * d * d.sqrt(),
            Form::Line(line) => self.of_line(line, d, Line::energy),
        }
    }

    /// Derivative of the energy with respect to the clearance at the same penetration `d` > 0 (m), N.
    #[inline(never)]
    pub(crate) fn energy_by_clearance(&self, d: f64) -> f64 {
        match self.form {
            Form::Sphere { stiffening } => stiffening * self.energy(d),
            Form::Line(line) => self.of_line(line, d, Line::energy_by_clearance),
        }
    }

    /// A value of the line contact at the distance |`d`| (m) from 0, where it has a limit of 0. Apart, so that the sphere's stays short.
    #[cold]
    #[inline(never)]
    fn of_line(&self, line: Line, d: f64, value: fn(&Line, f64) -> f64) -> f64 {
        if d == 0.0 { 0.0 } else { self.stiffness * value(&line, d.abs()) }
    }

    /// d F'(d) / F(d) at the penetration `d` > 0, m: the power with which the force grows.
    #[inline]
    pub fn exponent(&self, d: f64) -> f64 {
        match self.form {
            Form::Sphere { .. } => 1.5,
            Form::Line(line) => d * self.of_line(line, d, Line::slope) / self.of_line(line, d, Line::force),
        }
    }

    /// Penetration at which the law balances `force` (N), m: the rest position of a settled contact.
    pub fn depth(&self, force: f64) -> f64 {
        let relative = force / self.stiffness;
        match self.form {
            Form::Sphere { .. } => libm::cbrt(relative * relative),
            Form::Line(line) if relative > 0.0 => line.depth(relative),
            Form::Line(_) => 0.0,
        }
    }

    /// Estimated duration of an impact of a mass `mass` (kg) at `speed` (m/s) with the damping factor `damping`, s: 2.94 d / v
    /// with the maximum penetration of Hertz's theory (K. L. Johnson, Contact Mechanics, section 11.4), reduced for strong damping; in
    /// line contact as if the force grew with the power that it has there.
    pub(crate) fn impact_duration(&self, damping: f64, mass: f64, speed: f64) -> f64 {
        let deepest = self.deepest(damping, mass, speed);
        let factor = match self.form {
            Form::Sphere { .. } => 2.94,
            Form::Line(_) => {
                // 2 B(1 / (n + 1), 1/2) / (n + 1) to 1e-3 for n = 1 to 1.7.
                let above = self.exponent(deepest) - 1.0;
                std::f64::consts::PI - above * (0.47 - 0.145 * above)
            }
        };
        factor * deepest / speed
    }

    /// Largest penetration of that impact, m.
    pub fn deepest(&self, damping: f64, mass: f64, speed: f64) -> f64 {
        let effective = self.stiffness * (1.0 + 0.5 * damping);
        match self.form {
            Form::Sphere { .. } => libm::pow(0.5 * 2.5 * mass * speed * speed / effective, 1.0 / 2.5),
            Form::Line(line) => line.depth_of_energy(0.5 * mass * speed * speed / effective),
        }
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

    const LENGTH: f64 = 0.024;

    /// Every elastic law.
    fn parameters() -> impl Iterator<Item = Parameters> {
        let all = [
            Elasticity::Sphere,
            Elasticity::Stiffness(2e10),
            Elasticity::StiffnessAt { force: 700.0, length: LENGTH },
            Elasticity::Line { length: LENGTH },
        ];
        all.into_iter().map(|elasticity| Parameters { elasticity, ..Parameters::default() })
    }

    /// The same at a clearance of 0.3 mm.
    fn laws() -> impl Iterator<Item = ElasticLaw> {
        parameters().map(|parameters| ElasticLaw::of_joint(&parameters, 0.3e-3))
    }

    #[test]
    fn the_stiffness_at_a_clearance_of_0_3_mm_has_its_reference_value() {
        let k = ElasticLaw::of_joint(&Parameters::default(), 0.3e-3).stiffness;
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
            assert!((law.exponent(d) * law.force(d) / (d * law.slope(d)) - 1.0).abs() < 1e-14, "{d}");
            assert!((ElasticLaw::through(d, 7.0).force(d) - 7.0).abs() < 1e-14, "{d}");
            assert_eq!((law.force(-d), law.energy(-d)), (-law.force(d), 0.0));
        }
    }

    #[test]
    fn a_growing_gap_softens_the_contact_as_stated() {
        for parameters in parameters() {
            let law = |c: f64| ElasticLaw::of_joint(&parameters, c);
            let energy = |c: f64| law(c).energy(2e-6);
            let (c, step) = (3e-4, 3e-9);
            let by_clearance = (energy(c + step) - energy(c - step)) / (2.0 * step);
            let stated = law(c).energy_by_clearance(2e-6);
            assert!((by_clearance - stated).abs() <= 1e-8 * stated.abs(), "{by_clearance} {stated}");
            assert_eq!(stated == 0.0, matches!(parameters.elasticity, Elasticity::Stiffness(_)));
        }
    }

    #[test]
    fn a_stiffness_matched_at_a_force_is_right_there_alone() {
        let parameters = |elasticity| Parameters { elasticity, ..Parameters::default() };
        let law = |elasticity| ElasticLaw::of_joint(&parameters(elasticity), 1e-4);
        let line = law(Elasticity::Line { length: LENGTH });
        for force in [10.0, 1e3, 1e4] {
            let chord = law(Elasticity::StiffnessAt { force, length: LENGTH });
            assert!((chord.depth(force) / line.depth(force) - 1.0).abs() < 1e-14);
            assert!(chord.depth(0.5 * force) > 1.05 * line.depth(0.5 * force));
            assert!(chord.depth(2.0 * force) < 0.95 * line.depth(2.0 * force));
        }
        assert_eq!(law(Elasticity::Stiffness(2e10)).stiffness, 2e10);
    }

    /// Ends of half the length, or of half the stiffness, carry half of the force each, at any depth.
    #[test]
    fn the_ends_of_a_pin_are_its_halves() {
        for parameters in parameters() {
            let whole = ElasticLaw::of_joint(&parameters, 1e-4);
            let halved = match parameters.elasticity {
                Elasticity::Line { length } => Elasticity::Line { length: 0.5 * length },
                Elasticity::StiffnessAt { force, length } => {
                    Elasticity::StiffnessAt { force: 0.5 * force, length: 0.5 * length }
                }
                _ => continue,
            };
            let half = ElasticLaw::of_joint(&Parameters { elasticity: halved, ..parameters }, 1e-4);
            for d in [1e-9, 1e-6, 7e-5] {
                assert!((2.0 * half.force(d) / whole.force(d) - 1.0).abs() < 1e-14, "{d}");
                assert!((2.0 * half.energy(d) / whole.energy(d) - 1.0).abs() < 1e-14, "{d}");
            }
        }
    }

    #[test]
    fn the_patch_carries_the_force_of_its_penetration() {
        // Hertz: F = 4/3 E* a³ / R, E* = E / (2 (1 - nu²)).
        let (parameters, c) = (Parameters::default(), 3e-4);
        let r = parameters.ball_radius;
        let law = ElasticLaw::of_joint(&parameters, c);
        let modulus = parameters.youngs_modulus / (2.0 * (1.0 - parameters.poisson_ratio.powi(2)));
        let patch = law.patch(r, c, 3e-6).expect("touches");
        let force = 4.0 / 3.0 * modulus * patch.powi(3) * (1.0 / r - 1.0 / (r + c));
        assert!((force / law.force(3e-6) - 1.0).abs() < 1e-12);
        assert_eq!(law.patch(r, c, 0.0), None);
        // In line contact: F = pi E* L a^2 (1 / r - 1 / R) / 4.
        let line = Parameters { elasticity: Elasticity::Line { length: LENGTH }, ..parameters };
        let law = ElasticLaw::of_joint(&line, c);
        let half_width = law.patch(r, c, 3e-6).expect("touches");
        let force = 0.25 * std::f64::consts::PI * modulus * LENGTH * half_width.powi(2) * (1.0 / r - 1.0 / (r + c));
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
            // That of a power is an estimate in line contact.
            assert!((t / law.impact_duration(0.0, mass, speed) - 1.0).abs() < 5e-3, "{t:e}");
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
