//! Line contact of a round pin in its bore after K. L. Johnson, Contact Mechanics, section 5.6: the depth d under the force F of a pin of
//! the length L in a gap c,
//!
//! ```text
//! d = f (ln(4 c / f) - 1),   f = F / A,   A = pi E* L.
//! ```
//!
//! With w = ln(4 c / f) - 1 it is d = f w, so that w exp(-w) = e d / (4 c): w is minus the lower branch of Lambert's function, and
//! force, slope and energy follow from it in closed form,
//!
//! ```text
//! F / A = d / w,   F' / A = 1 / (w - 1),   U / A = d^2 (2 w - 1) / (4 w^2).
//! ```
//!
//! Force and slope are 0 at d = 0 and continuous there; w grows like ln(4 c / d). At w = 1, F = 4 pi E* L c / e^2, the slope is infinite:
//! the theory has no meaning long before. From [`LAST`] on the force continues along its tangent.

use std::f64::consts::PI;

use super::Parameters;

/// The w at which the tangent takes over: there the slope is 4 A, and the force 0.78 of the largest that has a depth.
const LAST: f64 = 1.25;
/// Its depth over 4 c: LAST exp(-1 - LAST).
const LAST_DEPTH: f64 = 0.131_749_030_702_330_4;
/// Its U / A over (4 c)^2: exp(-2 - 2 LAST) (2 LAST - 1) / 4.
const LAST_ENERGY: f64 = 0.004_165_873_701_840_865;

/// The law of one gap. Forces are over A, and so in m, slopes without unit, energies in m^2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Line {
    /// Clearance c, m.
    clearance: f64,
}

/// A depth, divided where the tangent takes over.
struct Depth {
    /// Up to there, m, and its w.
    law: f64,
    w: f64,
    /// Beyond, m.
    tangent: f64,
}

/// A = pi E* L of a pin over the length `length`, m, both parts of the material of `parameters`, N/m.
pub(super) fn modulus(parameters: &Parameters, length: f64) -> f64 {
    let s = (1.0 - parameters.poisson_ratio * parameters.poisson_ratio) / parameters.youngs_modulus;
    PI * length / (2.0 * s)
}

/// The largest force that has a depth over A, m: 4 c / e^2.
pub(super) fn largest(clearance: f64) -> f64 {
    4.0 * clearance * libm::exp(-2.0)
}

/// The w > 1 with w - ln w = `q` > 1, by two steps of fourth order (Fritsch, Shafer & Crowley 1973) from a start within 0.6 %: exact to
/// rounding.
fn root(q: f64) -> f64 {
    let beyond = (0.5 * (q - 1.0)).sqrt();
    let mut w = q + 2.0 * beyond / (1.0 + 0.3361 * beyond);
    for _ in 0..2 {
        let missing = q - w + libm::log(w);
        let s = 2.0 * (w - 1.0) * (w - 1.0 + 2.0 / 3.0 * missing);
        w += w * missing / (w - 1.0) * (s + missing) / (s + 2.0 * missing);
    }
    w
}

impl Line {
    pub(super) fn new(clearance: f64) -> Self {
        Self { clearance }
    }

    fn scale(&self) -> f64 {
        4.0 * self.clearance
    }

    /// `d` > 0, m.
    fn at(&self, d: f64) -> Depth {
        let last = LAST_DEPTH * self.scale();
        if d < last {
            Depth { law: d, w: root(-1.0 - libm::log(d / self.scale())), tangent: 0.0 }
        } else {
            Depth { law: last, w: LAST, tangent: d - last }
        }
    }

    /// Force at the depth `d` > 0, m.
    pub(super) fn force(&self, d: f64) -> f64 {
        let Depth { law, w, tangent } = self.at(d);
        law / w + tangent / (w - 1.0)
    }

    /// Slope at the depth `d` > 0, m.
    pub(super) fn slope(&self, d: f64) -> f64 {
        1.0 / (self.at(d).w - 1.0)
    }

    /// Energy at the depth `d` > 0, m.
    pub(super) fn energy(&self, d: f64) -> f64 {
        let Depth { law, w, tangent } = self.at(d);
        law * law * (2.0 * w - 1.0) / (4.0 * w * w) + tangent * (law / w + 0.5 * tangent / (w - 1.0))
    }

    /// Derivative of the energy with respect to the clearance at the same depth `d` > 0 (m), m: -f^2 / (2 c).
    pub(super) fn energy_by_clearance(&self, d: f64) -> f64 {
        let Depth { law, w, tangent } = self.at(d);
        let force = law / w;
        -(0.5 * force * force + tangent * (law / (w - 1.0) - force)) / self.clearance
    }

    /// Johnson's depth under the force `f` > 0 below [`largest`], m.
    pub(super) fn johnson(&self, f: f64) -> f64 {
        f * (libm::log(self.scale() / f) - 1.0)
    }

    /// Depth under the force `f` > 0, m.
    pub(super) fn depth(&self, f: f64) -> f64 {
        let last = LAST_DEPTH * self.scale();
        let beyond = f - last / LAST;
        if beyond < 0.0 { self.johnson(f) } else { last + beyond * (LAST - 1.0) }
    }

    /// Depth at which the energy is `u` > 0, m^2: with v = 2 w - 1 it is v exp(-v) = 4 e^3 u / (4 c)^2.
    pub(super) fn depth_of_energy(&self, u: f64) -> f64 {
        let scale = self.scale();
        let share = u / (scale * scale);
        if share < LAST_ENERGY {
            let w = 0.5 * (1.0 + root(-3.0 - libm::log(4.0 * share)));
            return scale * w * libm::exp(-1.0 - w);
        }
        // f t + s t^2 / 2 = the rest.
        let (last, slope) = (LAST_DEPTH * scale, 1.0 / (LAST - 1.0));
        let (force, rest) = (last / LAST, u - LAST_ENERGY * scale * scale);
        last + 2.0 * rest / (force + (force * force + 2.0 * slope * rest).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const C: f64 = 1e-4;

    /// Johnson's depth under the force `f`, m.
    fn johnson(f: f64) -> f64 {
        f * (libm::log(4.0 * C / f) - 1.0)
    }

    /// Depths from far below an atom to twice the clearance, m.
    fn depths() -> impl Iterator<Item = f64> {
        (0..500).map(|i| 2e-4 * libm::exp(-0.08 * f64::from(i)))
    }

    #[test]
    fn the_force_is_the_inverse_of_the_depth_to_rounding() {
        let line = Line::new(C);
        let largest = largest(C);
        for i in 0..4000 {
            // The force follows the depth with the power w / (w - 1) <= 5, and so do the errors of both.
            let f = 0.77 * largest * libm::exp(-0.01 * f64::from(i));
            let error = (line.force(johnson(f)) / f - 1.0).abs();
            assert!(error < 5e-15, "{f:e}: {error:e}");
            assert!((line.depth(f) / johnson(f) - 1.0).abs() < 1e-15, "{f:e}");
        }
        // Down to the least number.
        for f in [1e-100, 1e-300] {
            assert!((line.force(johnson(f)) / f - 1.0).abs() < 1e-14, "{f:e}");
        }
    }

    #[test]
    fn the_equation_of_w_is_solved_to_rounding() {
        for i in 0..4000 {
            let w = 1.25 * libm::exp(0.0016 * f64::from(i));
            let found = root(w - libm::log(w));
            assert!((found / w - 1.0).abs() < 2e-15, "{w}: {found}");
        }
    }

    #[test]
    fn slope_force_and_energy_are_derivatives_of_one_another() {
        let line = Line::new(C);
        for d in depths() {
            let step = 1e-5 * d;
            let by_depth = |f: &dyn Fn(f64) -> f64| (f(d + step) - f(d - step)) / (2.0 * step);
            assert!((by_depth(&|d| line.energy(d)) / line.force(d) - 1.0).abs() < 1e-8, "{d:e}");
            assert!((by_depth(&|d| line.force(d)) / line.slope(d) - 1.0).abs() < 1e-4, "{d:e}");
            assert!((line.depth(line.force(d)) / d - 1.0).abs() < 1e-13, "{d:e}");
            assert!((line.depth_of_energy(line.energy(d)) / d - 1.0).abs() < 1e-13, "{d:e}");
            let (wide, narrow) = (Line::new(C * (1.0 + 1e-5)), Line::new(C * (1.0 - 1e-5)));
            let by_clearance = (wide.energy(d) - narrow.energy(d)) / (2e-5 * C);
            let stated = line.energy_by_clearance(d);
            assert!((by_clearance / stated - 1.0).abs() < 1e-6, "{d:e}: {by_clearance:e} {stated:e}");
        }
    }

    #[test]
    fn the_tangent_continues_force_slope_and_energy() {
        let line = Line::new(C);
        let last = LAST_DEPTH * 4.0 * C;
        for (below, above) in [(1.0 - 1e-15, 1.0 + 1e-15), (0.99, 1.01), (0.9, 1.1)] {
            let [below, above] = [below * last, above * last];
            let rise = above - below;
            let apart = [
                line.force(above) - line.force(below) - line.slope(above) * rise,
                (line.energy(above) - line.energy(below)) / last - line.force(last) * rise / last,
            ];
            let most = 20.0 * rise * rise / last + 4e-15 * last;
            assert!(apart.iter().all(|apart| apart.abs() < most), "{rise:e}: {apart:?}");
        }
        assert!((line.slope(last) - 4.0).abs() < 1e-14 && (line.slope(last * (1.0 - 1e-15)) - 4.0).abs() < 1e-12);
        assert!((line.force(last) / largest(C) - 0.778_800_783).abs() < 1e-9);
    }

    #[test]
    fn a_contact_begins_without_force_and_without_slope() {
        let line = Line::new(C);
        // Like 1 / ln: from a hundredth of a nanometre to nothing.
        let slopes = [1e-11, 1e-20, 1e-60, 1e-300].map(|d| line.slope(d));
        assert!(slopes.windows(2).all(|pair| pair[1] < pair[0]), "{slopes:?}");
        assert!(slopes[0] < 0.06 && slopes[3] < 0.0015, "{slopes:?}");
    }
}
