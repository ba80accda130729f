//! mean + amplitude sin(2 pi frequency t + phase), and sums of such terms.

use super::Law;
use crate::jet::Jet;
use crate::machine::Harmonic;

/// Relative deviation from a ratio of integers beyond which two frequencies have no common period.
const RATIO_TOLERANCE: f64 = 1e-6;
/// Largest integer in such a ratio.
const MAX_PERIODS: f64 = 1000.0;

/// A harmonic at `t`.
fn at(term: &Harmonic, t: f64) -> Jet {
    let omega = std::f64::consts::TAU * term.frequency;
    term.amplitude * Jet::new(omega * t + term.phase, omega, 0.0).sin_cos().0
}

#[derive(Debug)]
pub(super) struct Harmonics {
    mean: f64,
    /// Terms with nonzero amplitude.
    terms: Vec<Harmonic>,
}

impl Harmonics {
    /// `mean` and the sum of `terms`.
    pub fn new(mean: f64, terms: &[Harmonic]) -> Self {
        Self { mean, terms: terms.iter().copied().filter(|term| term.amplitude != 0.0).collect() }
    }
}

impl Law for Harmonics {
    fn at(&self, t: f64) -> Jet {
        let terms = self.terms.iter();
        terms.fold(Jet::constant(self.mean), |sum, term| sum + at(term, t))
    }

    fn period(&self) -> f64 {
        let frequencies = self.terms.iter().map(|term| term.frequency);
        let lowest = frequencies.clone().fold(f64::INFINITY, f64::min);
        let base = frequencies.reduce(common_divisor).unwrap_or(0.0);
        if base * MAX_PERIODS >= lowest { 1.0 / base } else { f64::INFINITY }
    }

    fn shortest_period(&self) -> f64 {
        let frequencies = self.terms.iter().map(|term| term.frequency);
        1.0 / frequencies.fold(0.0, f64::max)
    }
}

/// Greatest common divisor of two frequencies up to rounding, by Euclid's algorithm; 0 if there is none.
fn common_divisor(a: f64, b: f64) -> f64 {
    let (mut high, mut low) = (a.max(b), a.min(b));
    let least = RATIO_TOLERANCE * low;
    while low > least {
        let rest = high % low;
        // A remainder just below the divisor is rounding, too.
        let rest = rest.min(low - rest);
        (high, low) = (low, rest);
    }
    high
}
