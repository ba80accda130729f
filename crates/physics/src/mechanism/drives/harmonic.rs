//! mean + amplitude sin(2 pi frequency t + phase), and sums of such terms.

use std::sync::Arc;

use super::{Law, period_if};
use crate::jet::Jet;
use crate::scene::{Drive, DriveData};

/// Frequencies whose ratio misses one of whole numbers by more than this have no common period.
const IN_STEP: f64 = 1e-6;
/// The largest such number.
const MOST_SWINGS: f64 = 1000.0;

#[derive(Debug)]
struct Harmonic {
    mean: f64,
    amplitude: f64,
    frequency: f64,
    phase: f64,
}

pub(super) fn make(drive: &Drive, _turns: bool) -> Arc<dyn Law> {
    Arc::new(Harmonic {
        mean: drive.number("mean"),
        amplitude: drive.number("amplitude"),
        frequency: drive.number("frequency"),
        phase: drive.number("phase"),
    })
}

impl Law for Harmonic {
    fn at(&self, t: f64) -> Jet {
        Jet::constant(self.mean) + swing(self.amplitude, self.frequency, self.phase, t)
    }

    fn period(&self) -> f64 {
        period_if(&[self.amplitude], self.frequency)
    }
}

fn swing(amplitude: f64, frequency: f64, phase: f64, t: f64) -> Jet {
    let omega = std::f64::consts::TAU * frequency;
    amplitude * Jet::new(omega * t + phase, omega, 0.0).sin_cos().0
}

#[derive(Debug)]
struct Harmonics {
    mean: f64,
    /// Amplitude, frequency, phase; those with an amplitude.
    terms: Vec<[f64; 3]>,
}

pub(super) fn make_sum(drive: &Drive, _turns: bool) -> Arc<dyn Law> {
    let DriveData::Terms(terms) = &drive.data else { unreachable!("harmonics are read with their terms") };
    Arc::new(Harmonics {
        mean: drive.number("mean"),
        terms: terms.iter().copied().filter(|term| term[0] != 0.0).collect(),
    })
}

impl Law for Harmonics {
    fn at(&self, t: f64) -> Jet {
        let terms = self.terms.iter();
        terms.fold(Jet::constant(self.mean), |sum, &[amplitude, frequency, phase]| {
            sum + swing(amplitude, frequency, phase, t)
        })
    }

    fn period(&self) -> f64 {
        let frequencies = self.terms.iter().map(|term| term[1]);
        let lowest = frequencies.clone().fold(f64::INFINITY, f64::min);
        let base = frequencies.reduce(common).unwrap_or(0.0);
        if base * MOST_SWINGS >= lowest { 1.0 / base } else { f64::INFINITY }
    }

    fn swing(&self) -> f64 {
        let frequencies = self.terms.iter().map(|term| term[1]);
        1.0 / frequencies.fold(0.0, f64::max)
    }
}

/// The largest frequency of which both are multiples, up to rounding: by Euclid's algorithm. 0 if there is none.
fn common(a: f64, b: f64) -> f64 {
    let (mut high, mut low) = (a.max(b), a.min(b));
    let least = IN_STEP * low;
    while low > least {
        let rest = high % low;
        // A rest just below a whole multiple is rounding, too.
        let rest = rest.min(low - rest);
        (high, low) = (low, rest);
    }
    high
}
