//! Largest Lyapunov exponent from two nearby runs with renormalisation.
//!
//! Benettin, Galgani & Strelcyn, Phys. Rev. A 14 (1976) 2338. The twin starts at a small separation d0. It is rescaled to d0 at
//! every section, and also between sections when the separation has grown or shrunk by more than a given factor. The exponent
//! is the sum of the logarithms of the growth factors divided by the time. The twin repeats the steps of the run, so that the
//! two differ by their motion and not by the errors of different steps.

use super::orbit::Orbit;

/// Between sections the twin is rescaled once its separation has changed by more than this factor.
const RENORMALISE_AT: f64 = 100.0;
/// Largest multiple of the nominal separation at which the separation still counts as small.
const MAX_GROWTH: f64 = 1e5;
/// A separation lost in rounding counts as this fraction of the nominal separation.
const MIN_SEPARATION: f64 = 1e-9;
/// Sections that pass before the growth of a new twin is counted, so that its offset aligns with the fastest-growing direction.
pub const ALIGNMENT: usize = 5;
/// Largest number of blocks for the standard error, and the smallest.
const MAX_BLOCKS: usize = 512;
const MIN_BLOCKS: usize = 3;
/// Largest correlation of neighbouring blocks that count as independent.
const MAX_CORRELATION: f64 = 0.1;
/// Multiple of its own standard error beyond which a negative correlation of neighbouring blocks counts.
const ANTICORRELATED: f64 = 2.0;

/// An exponent and the evidence of its convergence.
#[derive(Clone, Debug, PartialEq)]
pub struct Exponent {
    /// Largest Lyapunov exponent, 1/s, or per iteration for a map.
    pub value: f64,
    /// Standard error, 1/s: of the mean over blocks of consecutive sections that are as long as their growth is correlated, and of
    /// the twin's change of direction from the first section to the last. Twice this is an interval of 95 %; infinite for fewer
    /// than three sections.
    pub standard_error: f64,
    /// Estimate after each kept section, 1/s.
    pub running: Vec<f64>,
}

/// Estimator of the exponent: separation of the twin and its growth.
///
/// Growth of a small separation is meaningful only while both runs have the same contacts. While a ball is in contact and its
/// counterpart in the twin is not yet, their velocities differ as before and after an impact, however small the separation. So
/// growth is measured, and the twin rescaled, only where [`Orbit::is_comparable`] holds. A section at which the runs are not
/// comparable is counted together with the next. A twin that has separated too far by then is restarted, and its growth since
/// the latest counted section is discarded.
#[derive(Clone, Debug)]
pub struct Benettin {
    separation: f64,
    interval: f64,
    /// Separation after the latest renormalisation.
    from: f64,
    /// Logarithm of the growth since the latest counted section.
    log_growth: f64,
    /// Number of sections since then.
    uncounted: usize,
    /// Remaining sections of alignment before growth counts.
    aligning: usize,
    counting: bool,
    /// Growth and number of sections of each interval between counted sections.
    parts: Vec<(f64, usize)>,
    /// Separation of the twin, and its direction when the two were last comparable.
    difference: Vec<f64>,
    /// The same at the start of counting.
    initial_difference: Vec<f64>,
    /// Distance between the unit vectors of the two directions, or their opposites, at the latest counted section.
    turned: f64,
    swing: Swing,
}

/// Variation of the separation's length between sections: a steadily growing separation that turns in a norm that is not its
/// own grows unevenly, and the mean growth depends on the directions at its two ends.
#[derive(Clone, Debug, Default)]
struct Swing {
    /// Time of the latest section, s, and the mean growth rate up to it, 1/s, once there was a section before it.
    begin: f64,
    rate: Option<f64>,
    /// Smallest and largest logarithm of the growth since then, less that at the mean rate.
    extremes: [f64; 2],
    /// Sum of their differences over counted sections, and the number of these.
    sum: f64,
    count: usize,
}

impl Swing {
    /// Records the logarithm of the growth since the latest section at `time`, s.
    fn record(&mut self, time: f64, log_growth: f64) {
        let excess = log_growth - self.rate.unwrap_or_default() * (time - self.begin);
        self.extremes = [self.extremes[0].min(excess), self.extremes[1].max(excess)];
    }

    /// Ends the interval at a section at `time`, s, before which the separation grew by `log_growth`.
    fn end_interval(&mut self, time: f64, log_growth: f64, counts: bool) {
        if counts && self.rate.is_some() {
            self.sum += self.extremes[1] - self.extremes[0];
            self.count += 1;
        }
        let rate = log_growth / (time - self.begin);
        *self = Self { begin: time, rate: Some(rate).filter(|rate| rate.is_finite()), extremes: [0.0; 2], ..*self };
    }

    /// Mean logarithm of the ratio of the longest to the shortest separation between two sections.
    fn mean(&self) -> f64 {
        self.sum / self.count.max(1) as f64
    }
}

impl Benettin {
    /// Estimator for a twin at `separation` (in units of the scales) and at most `sections` sections, `interval` apart.
    pub fn new(separation: f64, interval: f64, sections: usize) -> Self {
        Self {
            separation,
            interval,
            from: separation,
            log_growth: 0.0,
            uncounted: 0,
            aligning: 0,
            counting: false,
            parts: Vec::with_capacity(sections),
            difference: Vec::new(),
            initial_difference: Vec::new(),
            turned: 0.0,
            swing: Swing::default(),
        }
    }

    /// Displaces a new twin in a generic direction.
    pub fn start<O: Orbit>(&mut self, orbit: &O, twin: &mut O) {
        self.difference.clear();
        self.difference.extend(offset(orbit.scales(), self.separation));
        self.place_twin(orbit, twin);
        self.swing = Swing { begin: orbit.time(), ..Swing::default() };
    }

    /// Starts accumulating growth.
    pub fn begin_counting(&mut self) {
        self.counting = true;
        self.parts.clear();
        self.initial_difference.clone_from(&self.difference);
        (self.swing.sum, self.swing.count) = (0.0, 0);
    }

    /// Advances the twin to the orbit's time, after a step of the orbit, and measures the separation.
    ///
    /// # Errors
    /// The twin cannot continue.
    pub fn follow<O: Orbit>(&mut self, orbit: &O, twin: &mut O, at_section: bool) -> Result<(), O::Stop> {
        twin.reproduce_step(orbit)?;
        self.uncounted += usize::from(at_section);
        let ratio = distance(orbit, twin) / self.separation;
        if !orbit.is_comparable(twin) {
            if at_section && !(ratio < MAX_GROWTH) {
                *twin = orbit.twin();
                self.place_twin(orbit, twin);
                self.aligning = ALIGNMENT;
            }
            return Ok(());
        }
        twin.adopt_step_control(orbit);
        self.swing.record(orbit.time(), self.log_growth + self.log_growth_to(ratio));
        if at_section || !(ratio < RENORMALISE_AT && ratio * RENORMALISE_AT > 1.0) {
            self.renormalise(orbit, twin, ratio);
        }
        if at_section {
            let counts = self.counting && self.aligning == 0;
            self.aligning = self.aligning.saturating_sub(1);
            if counts {
                self.parts.push((self.log_growth, self.uncounted));
                self.turned = self.turn_since_counting(orbit.scales());
            }
            self.swing.end_interval(orbit.time(), self.log_growth, counts);
            (self.log_growth, self.uncounted) = (0.0, 0);
        }
        Ok(())
    }

    /// A separation of `ratio` times the nominal one; one that is lost in rounding is bounded below.
    fn bounded_separation(&self, ratio: f64) -> f64 {
        self.separation * if ratio.is_finite() { ratio.max(MIN_SEPARATION) } else { MIN_SEPARATION }
    }

    /// Logarithm of the growth since the latest renormalisation to `ratio` times the nominal separation.
    fn log_growth_to(&self, ratio: f64) -> f64 {
        libm::log(self.bounded_separation(ratio) / self.from)
    }

    /// As [`Self::turned`], for a state with these `scales`.
    fn turn_since_counting(&self, scales: &[f64]) -> f64 {
        let pairs = self.difference.iter().zip(&self.initial_difference).zip(scales);
        let product: f64 = pairs.map(|((now, initial), scale)| (now / scale) * (initial / scale)).sum();
        let cosine = product.abs() / (self.separation * self.separation);
        (2.0 - 2.0 * cosine).max(0.0).sqrt()
    }

    /// Records growth to `ratio` times the nominal separation, and rescales the twin to the nominal separation.
    fn renormalise<O: Orbit>(&mut self, orbit: &O, twin: &mut O, ratio: f64) {
        self.log_growth += self.log_growth_to(ratio);
        if ratio > MIN_SEPARATION && ratio.is_finite() {
            self.difference.clear();
            let pairs = orbit.state().iter().zip(twin.state());
            self.difference.extend(pairs.map(|(a, b)| (b - a) / ratio));
            // The onset history of a settled contact has no effect and does not decay, so it must not be amplified.
            twin.blend_approach_speeds(orbit, (1.0 - 1.0 / ratio).max(0.0));
        }
        self.place_twin(orbit, twin);
    }

    /// Moves the twin to the orbit's state displaced by `difference`.
    fn place_twin<O: Orbit>(&mut self, orbit: &O, twin: &mut O) {
        let states = orbit.state().iter().zip(twin.state());
        let offset: Vec<f64> = self.difference.iter().zip(states).map(|(d, (a, b))| d + (a - b)).collect();
        twin.displace(&offset);
        // The actual separation differs from the requested one because the displaced loops are closed again.
        self.from = distance(orbit, twin).max(MIN_SEPARATION * self.separation);
    }

    /// The exponent so far; `None` before the first section that counts.
    pub fn result(&self) -> Option<Exponent> {
        let (mut growth, mut sections) = (0.0, 0);
        let running: Vec<f64> = self
            .parts
            .iter()
            .map(|(log_growth, uncounted)| {
                growth += log_growth;
                sections += uncounted;
                growth / (sections as f64 * self.interval)
            })
            .collect();
        let value = *running.last()?;
        // The two ends of a separation that has turned by a radian may be anywhere between its shortest and its longest.
        let of_ends = 0.5 * self.swing.mean() * (2.0 * self.turned).min(1.0) / sections as f64;
        let of_blocks = standard_error(&self.parts);
        let standard_error = (of_blocks * of_blocks + of_ends * of_ends).sqrt() / self.interval;
        Some(Exponent { value, standard_error, running })
    }
}

/// An offset of length `separation` in units of `scales`, in a generic direction.
pub fn offset(scales: &[f64], separation: f64) -> impl Iterator<Item = f64> {
    // A Weyl sequence is deterministic, well spread and not aligned with any coordinate.
    let part = |i: usize| (0.618_033_988_749_894_9 * (i + 1) as f64).fract() - 0.5;
    let square: f64 = (0..scales.len()).map(|i| part(i) * part(i)).sum();
    let factor = separation / square.sqrt();
    let scales = scales.iter().enumerate();
    scales.map(move |(i, scale)| factor * scale * part(i))
}

fn distance<O: Orbit>(a: &O, b: &O) -> f64 {
    scaled_distance(a.state(), b.state(), a.scales())
}

/// Euclidean distance between two states in units of their scales.
pub fn scaled_distance(a: &[f64], b: &[f64], scales: &[f64]) -> f64 {
    let pairs = a.iter().zip(b).zip(scales);
    let square: f64 = pairs
        .map(|((a, b), scale)| {
            let d = (a - b) / scale;
            d * d
        })
        .sum();
    square.sqrt()
}

/// Standard error of the mean growth per section, from the sums over blocks of sections. The blocks are doubled until neighbours are
/// uncorrelated (Fishman, Management Science 24 (1978) 510), and few blocks widen the error as Student's distribution does.
fn standard_error(parts: &[(f64, usize)]) -> f64 {
    if parts.len() < MIN_BLOCKS {
        return f64::INFINITY;
    }
    let sections: usize = parts.iter().map(|(_, sections)| sections).sum();
    let mean = parts.iter().map(|(log_growth, _)| log_growth).sum::<f64>() / sections as f64;
    let sum = |parts: &[(f64, usize)]| -> f64 {
        parts.iter().map(|(log_growth, sections)| log_growth - mean * *sections as f64).sum()
    };
    let mut blocks = parts.len().min(MAX_BLOCKS);
    let variance = loop {
        let edge = |b: usize| b * parts.len() / blocks;
        let sums: Vec<f64> = (0..blocks).map(|b| sum(&parts[edge(b)..edge(b + 1)])).collect();
        let variance: f64 = sums.iter().map(|sum| sum * sum).sum();
        let covariance: f64 = sums.windows(2).map(|pair| pair[0] * pair[1]).sum();
        let correlation = if variance > 0.0 { covariance / variance } else { 0.0 };
        let independent = -ANTICORRELATED / (blocks as f64).sqrt()..=MAX_CORRELATION;
        if blocks / 2 < MIN_BLOCKS || independent.contains(&correlation) {
            break variance;
        }
        blocks /= 2;
    };
    let freedoms = (blocks - 1) as f64;
    student_factor(freedoms) * (variance * (1.0 + 1.0 / freedoms)).sqrt() / sections as f64
}

/// Quantile of 97.5 % of Student's distribution over that of the normal distribution, within 4 % from two degrees of freedom on
/// (Abramowitz & Stegun 26.7.5).
fn student_factor(freedoms: f64) -> f64 {
    1.0 + (1.210 + (1.440 + 1.304 / freedoms) / freedoms) / freedoms
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fraction of series of `length` numbers, each `memory` times the one before plus a random number, whose mean is within two
    /// standard errors of 0, and the mean standard error.
    fn coverage(length: usize, memory: f64) -> (f64, f64) {
        const SERIES: u64 = 400;
        let (mut within, mut errors) = (0.0, 0.0);
        for seed in 0..SERIES {
            // Knuth's linear congruential generator, of which the upper bits are random enough.
            let mut state = seed;
            let mut x = 0.0;
            let numbers = (0..length + 100).map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                x = memory * x + (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
                x
            });
            let parts: Vec<(f64, usize)> = numbers.skip(100).map(|number| (number, 1)).collect();
            let mean = parts.iter().map(|part| part.0).sum::<f64>() / length as f64;
            let error = standard_error(&parts);
            within += f64::from(mean.abs() < 2.0 * error);
            errors += error;
        }
        (within / SERIES as f64, errors / SERIES as f64)
    }

    #[test]
    fn two_standard_errors_cover_the_mean_of_correlated_series() {
        for (length, memory) in
            [(20, 0.0), (200, 0.0), (2000, 0.0), (200, 0.5), (2000, 0.5), (200, 0.9), (2000, 0.9), (200, -0.5)]
        {
            let (covered, error) = coverage(length, memory);
            // A uniform number has the variance 1/12.
            let exact = 1.0 / ((12.0 * length as f64).sqrt() * (1.0 - memory));
            println!("{length} {memory}: {covered} {}", error / exact);
            assert!(covered > 0.9, "{length} {memory}: {covered}");
            assert!((0.9..1.6).contains(&(error / exact)), "{length} {memory}: {error} {exact}");
        }
    }

    #[test]
    fn few_blocks_widen_the_error_as_students_distribution_does() {
        for (freedoms, quantile) in [(2.0, 4.303), (3.0, 3.182), (5.0, 2.571), (10.0, 2.228), (30.0, 2.042)] {
            let ratio = student_factor(freedoms) * 1.95996 / quantile;
            assert!((0.96..1.001).contains(&ratio), "{freedoms}: {ratio}");
        }
        assert!(standard_error(&[(1.0, 1), (2.0, 1)]).is_infinite());
        assert_eq!(standard_error(&[(1.0, 1), (2.0, 2), (1.0, 1)]), 0.0);
    }
}
