//! Classification of a motion from its sections, with the evidence.
//!
//! The rules, in order: sections that return to themselves within the resolution are periodic, or unclear if an exponent
//! clearly above 0 contradicts them. Otherwise an exponent clearly above 0 means chaos, or an unclear motion if the 0-1 test
//! clearly indicates a regular one. An exponent clearly below 0 means a cycle if the sections stay near one, and an unfinished
//! transient otherwise. An exponent indistinguishable from 0 with a regular result of the 0-1 test means quasi-periodic motion,
//! unless the sections still converge to a cycle. Anything else is unclear.

use super::exponent::Exponent;

/// A kind of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Regime {
    /// The evidence is insufficient or contradictory.
    Unclear,
    /// The motion repeats after this many intervals; a machine at rest repeats after one.
    Periodic(usize),
    /// The motion is regular but never repeats.
    QuasiPeriodic,
    /// Neighbouring motions diverge exponentially.
    Chaotic,
    /// Neighbouring motions converge, but the sections have not settled yet; more of them need to be discarded.
    NotSettled,
}

impl Regime {
    /// Every regime in the order of its code; the periodic one has period 1.
    pub const ALL: [Self; 5] = [Self::Unclear, Self::Periodic(1), Self::QuasiPeriodic, Self::Chaotic, Self::NotSettled];

    /// Name for users and files.
    pub fn word(self) -> &'static str {
        match self {
            Self::Unclear => "unclear",
            Self::Periodic(_) => "periodic",
            Self::QuasiPeriodic => "quasi-periodic",
            Self::Chaotic => "chaotic",
            Self::NotSettled => "not settled",
        }
    }

    /// Code in files.
    pub fn code(self) -> i64 {
        match self {
            Self::Unclear => 0,
            Self::Periodic(_) => 1,
            Self::QuasiPeriodic => 2,
            Self::Chaotic => 3,
            Self::NotSettled => 4,
        }
    }

    /// Number of intervals after which the motion repeats; 0 if it does not.
    pub fn period(self) -> usize {
        match self {
            Self::Periodic(n) => n,
            _ => 0,
        }
    }
}

impl std::fmt::Display for Regime {
    /// Writes the name, with the period if there is one.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.word())?;
        match self {
            Self::Periodic(n) => write!(f, " {n}"),
            _ => Ok(()),
        }
    }
}

/// The evidence for a regime.
#[derive(Clone, Debug, PartialEq)]
pub struct Evidence {
    /// Number of examined sections: the second half of the kept sections, but at least 32 if there are that many.
    pub sections: usize,
    /// Largest distance between two of these sections that should coincide, in units of the resolution, for the detected
    /// period, or for period 1 if there is none.
    pub return_distance: f64,
    /// Number of sections that the resolution distinguishes.
    pub distinct: usize,
    /// Median correlation of the 0-1 test, near 0 for regular motion and near 1 for chaos; NaN for fewer than 40 sections.
    pub zero_one: f64,
    /// Magnitude below which an exponent may still be zero, 1/s: a separation that grows linearly with time shows ln(n) over n
    /// intervals.
    pub exponent_bound: f64,
    /// Largest Lyapunov exponent, if there was a twin run.
    pub exponent: Option<Exponent>,
}

/// Fewest sections that allow a classification.
pub const MIN_SECTIONS: usize = 8;
/// Least number of examined sections, if there are that many.
const MIN_EXAMINED: usize = 32;
/// Largest spread that step errors cause in the sections of an attracting cycle, in units of the resolution.
const MAX_CYCLE_SPREAD: f64 = 100.0;
/// Number of times that such a cycle must occur.
const CYCLE_RETURNS: usize = 8;
/// Largest drift of the cycle's points as a fraction of their spread: step errors fluctuate but do not drift.
const MAX_DRIFT: f64 = 0.3;
/// Number of times that a period must occur.
const MIN_RETURNS: usize = 3;
/// Fraction of the earlier spread; sections whose spread falls below it are converging to a cycle.
const CONVERGENCE_RATIO: f64 = 0.7;
/// Result of the 0-1 test above which a motion without a measured exponent counts as chaotic.
const CHAOTIC_ABOVE: f64 = 0.8;
/// Result of the 0-1 test below which it clearly indicates a regular motion.
const REGULAR_BELOW: f64 = 0.2;

/// Classifies `sections` (concatenated, each as long as `resolution`), taken every `interval` seconds; `resolution` is
/// the smallest difference that distinguishes two values.
pub fn classify(sections: &[f64], resolution: &[f64], interval: f64, exponent: Option<Exponent>) -> (Regime, Evidence) {
    let width = resolution.len();
    let all: Vec<&[f64]> = sections.chunks_exact(width).collect();
    let from = all.len() - (all.len() / 2).max(MIN_EXAMINED).min(all.len());
    let used = &all[from..];
    let period = (1..=used.len() / MIN_RETURNS).find(|&n| spread(used, n, resolution) <= 1.0);
    let count = all.len().max(2) as f64;
    let evidence = Evidence {
        sections: used.len(),
        return_distance: spread(used, period.unwrap_or(1), resolution),
        distinct: distinct(used, resolution),
        zero_one: zero_one(&all, most_varying(used, resolution)),
        exponent_bound: libm::log(count) / (count * interval),
        exponent,
    };
    let regime = match decide(period, &evidence) {
        // Close to a bifurcation a cycle attracts so weakly that its exponent is indistinguishable from 0.
        Regime::QuasiPeriodic if is_converging(used, resolution) => Regime::NotSettled,
        // Step errors prevent the sections of an attracting cycle from returning within the resolution, but the sections stay
        // near.
        Regime::NotSettled if !is_converging(used, resolution) => {
            let is_cycle = |n: &usize| {
                let spread = spread(used, *n, resolution);
                spread <= MAX_CYCLE_SPREAD && drift(used, *n, resolution) <= MAX_DRIFT * spread
            };
            let near = (1..=used.len() / CYCLE_RETURNS).find(is_cycle);
            near.map_or(Regime::NotSettled, Regime::Periodic)
        }
        regime => regime,
    };
    (regime, evidence)
}

/// Whether the sections of the best-fitting period are still approaching each other.
fn is_converging(sections: &[&[f64]], resolution: &[f64]) -> bool {
    let (first, second) = sections.split_at(sections.len() / 2);
    let by_spread = |&a: &usize, &b: &usize| {
        let spread = |n| spread(sections, n, resolution);
        spread(a).total_cmp(&spread(b))
    };
    let best = (1..=second.len() / MIN_RETURNS).min_by(by_spread);
    best.is_some_and(|n| spread(second, n, resolution) < CONVERGENCE_RATIO * spread(first, n, resolution))
}

fn decide(period: Option<usize>, evidence: &Evidence) -> Regime {
    if evidence.sections < MIN_SECTIONS {
        return Regime::Unclear;
    }
    let is_regular = evidence.zero_one < 0.5;
    let diverges = |e: &Exponent| e.value - 2.0 * e.standard_error > evidence.exponent_bound;
    if let Some(n) = period {
        // The sections indicate a repetition that the twin excludes: one of the two is wrong.
        let is_contradicted = evidence.exponent.as_ref().is_some_and(diverges);
        return if is_contradicted { Regime::Unclear } else { Regime::Periodic(n) };
    }
    let Some(exponent) = &evidence.exponent else {
        return match evidence.zero_one {
            k if k > CHAOTIC_ABOVE => Regime::Chaotic,
            k if k < REGULAR_BELOW => Regime::QuasiPeriodic,
            _ => Regime::Unclear,
        };
    };
    let (bound, doubt) = (evidence.exponent_bound, 2.0 * exponent.standard_error);
    if diverges(exponent) {
        // Neighbours diverge, yet the sections wander like those of a regular motion: one of the two is wrong.
        if evidence.zero_one < REGULAR_BELOW { Regime::Unclear } else { Regime::Chaotic }
    } else if exponent.value + doubt < -bound {
        Regime::NotSettled
    } else if exponent.value.abs() <= bound + doubt && is_regular {
        Regime::QuasiPeriodic
    } else {
        Regime::Unclear
    }
}

/// Largest extent, in units of the resolution, of the sections that would coincide if the motion repeated after `n` intervals.
fn spread(sections: &[&[f64]], n: usize, resolution: &[f64]) -> f64 {
    let mut largest: f64 = 0.0;
    for first in 0..n.min(sections.len()) {
        for (i, resolution) in resolution.iter().enumerate() {
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for section in sections[first..].iter().step_by(n) {
                low = low.min(section[i]);
                high = high.max(section[i]);
            }
            largest = largest.max((high - low) / resolution);
        }
    }
    largest
}

/// Drift, from the first half to the second and in units of the resolution, of the sections that would coincide if the motion
/// repeated after `n` intervals.
fn drift(sections: &[&[f64]], n: usize, resolution: &[f64]) -> f64 {
    let mut largest: f64 = 0.0;
    for first in 0..n.min(sections.len()) {
        let places: Vec<&&[f64]> = sections[first..].iter().step_by(n).collect();
        let (before, after) = places.split_at(places.len() / 2);
        for (i, resolution) in resolution.iter().enumerate() {
            let mean = |half: &[&&[f64]]| half.iter().map(|section| section[i]).sum::<f64>() / half.len() as f64;
            largest = largest.max((mean(after) - mean(before)).abs() / resolution);
        }
    }
    largest
}

/// Number of mutually distinguishable sections, selected greedily.
fn distinct(sections: &[&[f64]], resolution: &[f64]) -> usize {
    let mut kept: Vec<&[f64]> = Vec::new();
    for section in sections {
        let near = |other: &&[f64]| {
            let pairs = section.iter().zip(other.iter()).zip(resolution);
            let mut far = pairs.map(|((a, b), r)| (a - b).abs() > *r);
            !far.any(|far| far)
        };
        if !kept.iter().any(near) {
            kept.push(section);
        }
    }
    kept.len()
}

/// Index of the observable with the largest extent in units of its resolution.
fn most_varying(sections: &[&[f64]], resolution: &[f64]) -> usize {
    let extent = |i: usize| {
        let values = sections.iter().map(|section| section[i]);
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        (high - low) / resolution[i]
    };
    let by_extent = |&a: &usize, &b: &usize| extent(a).total_cmp(&extent(b));
    (0..resolution.len()).max_by(by_extent).unwrap_or(0)
}

/// The 0-1 test for chaos of one observable: median over frequencies of the correlation of the mean square displacement
/// with time (Gottwald & Melbourne, SIAM J. Appl. Dyn. Syst. 8 (2009) 129, section 3).
fn zero_one(sections: &[&[f64]], observable: usize) -> f64 {
    const FREQUENCIES: usize = 61;
    let n = sections.len();
    let max_shift = n / 10;
    if max_shift < 4 {
        return f64::NAN;
    }
    let mean = sections.iter().map(|s| s[observable]).sum::<f64>() / n as f64;
    let mut correlations: Vec<f64> = (0..FREQUENCIES)
        .map(|m| {
            // Frequencies in (pi/5, 4 pi/5) avoid resonances with the sampling.
            let part = (m as f64 + 0.5) / FREQUENCIES as f64;
            let c = std::f64::consts::PI * (0.2 + 0.6 * part);
            let (mut p, mut q) = (0.0, 0.0);
            let walk: Vec<(f64, f64)> = (0..n)
                .map(|j| {
                    let (sine, cosine) = libm::sincos((j + 1) as f64 * c);
                    // Removing the mean makes it unnecessary to subtract an oscillating term.
                    let value = sections[j][observable] - mean;
                    p += value * cosine;
                    q += value * sine;
                    (p, q)
                })
                .collect();
            let displacement = |lag: usize| {
                let squares = (0..n - max_shift).map(|j| {
                    let (dp, dq) = (walk[j + lag].0 - walk[j].0, walk[j + lag].1 - walk[j].1);
                    dp * dp + dq * dq
                });
                squares.sum::<f64>() / (n - max_shift) as f64
            };
            correlation_with_time(&(1..=max_shift).map(displacement).collect::<Vec<_>>())
        })
        .collect();
    correlations.sort_by(f64::total_cmp);
    correlations[FREQUENCIES / 2]
}

/// Correlation of `values` with 1, 2, 3, …; 0 if they do not vary.
fn correlation_with_time(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let (mean_t, mean) = (0.5 * (n + 1.0), values.iter().sum::<f64>() / n);
    let (mut tt, mut tv, mut vv) = (0.0, 0.0, 0.0);
    for (k, value) in values.iter().enumerate() {
        let (t, v) = ((k + 1) as f64 - mean_t, value - mean);
        tt += t * t;
        tv += t * v;
        vv += v * v;
    }
    if vv > 0.0 { tv / (tt * vv).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exponent(value: f64) -> Option<Exponent> {
        Some(Exponent { value, standard_error: 0.01, running: vec![value] })
    }

    #[test]
    fn a_state_at_rest_has_period_one_and_a_cycle_its_length() {
        let rest = [0.25; 40];
        assert_eq!(classify(&rest, &[1e-9], 1.0, None).0, Regime::Periodic(1));
        let cycle: Vec<f64> = (0..60).map(|k| [0.1, 0.7, 0.4][k % 3]).collect();
        let (regime, evidence) = classify(&cycle, &[1e-9], 1.0, exponent(-1.0));
        assert_eq!(regime, Regime::Periodic(3));
        assert_eq!(evidence.distinct, 3);
        assert_eq!(evidence.return_distance, 0.0);
    }

    #[test]
    fn too_few_sections_give_an_unclear_regime() {
        assert_eq!(classify(&[0.5; 7], &[1e-9], 1.0, None).0, Regime::Unclear);
        assert_eq!(classify(&[], &[1e-9], 1.0, None).0, Regime::Unclear);
    }

    #[test]
    fn a_drift_is_classified_as_not_settled_and_never_as_periodic() {
        let drift: Vec<f64> = (0..60).map(|k| 1e-3 * f64::from(k)).collect();
        let (regime, evidence) = classify(&drift, &[1.5e-3], 1.0, exponent(-0.5));
        // Neighbouring sections are within the resolution; the whole set is not.
        assert_eq!(regime, Regime::NotSettled);
        assert!(evidence.return_distance > 10.0);
    }

    #[test]
    fn contradicting_evidence_gives_an_unclear_regime() {
        let turn = 0.618_033_988_749_894_9;
        let torus: Vec<f64> = (0..400).map(|k| libm::cos(std::f64::consts::TAU * turn * f64::from(k))).collect();
        assert_eq!(classify(&torus, &[1e-9], 1.0, exponent(0.0)).0, Regime::QuasiPeriodic);
        assert_eq!(classify(&torus, &[1e-9], 1.0, exponent(5.0)).0, Regime::Unclear);
        let cycle: Vec<f64> = (0..60).map(|k| [0.1, 0.7, 0.4][k % 3]).collect();
        assert_eq!(classify(&cycle, &[1e-9], 1.0, exponent(5.0)).0, Regime::Unclear);
    }

    #[test]
    fn without_an_exponent_the_zero_one_test_decides() {
        let mut x = 0.3;
        let chaos: Vec<f64> = (0..400)
            .map(|_| {
                x = 4.0 * x * (1.0 - x);
                x
            })
            .collect();
        assert_eq!(classify(&chaos, &[1e-9], 1.0, None).0, Regime::Chaotic);
        let turn = 0.618_033_988_749_894_9;
        let torus: Vec<f64> = (0..400).map(|k| libm::cos(std::f64::consts::TAU * turn * f64::from(k))).collect();
        assert_eq!(classify(&torus, &[1e-9], 1.0, None).0, Regime::QuasiPeriodic);
    }
}
