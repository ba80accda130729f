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
/// Number of blocks for the standard error.
const BLOCKS: usize = 10;

/// An exponent and the evidence of its convergence.
#[derive(Clone, Debug, PartialEq)]
pub struct Exponent {
    /// Largest Lyapunov exponent, 1/s, or per iteration for a map.
    pub value: f64,
    /// Standard error of the mean over blocks of consecutive sections (10 blocks, or one per section if there are fewer),
    /// 1/s; infinite for fewer than two.
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
        }
    }

    /// Displaces a new twin in a generic direction.
    pub fn start<O: Orbit>(&mut self, orbit: &O, twin: &mut O) {
        self.difference.clear();
        self.difference.extend(offset(orbit.scales(), self.separation));
        self.place_twin(orbit, twin);
    }

    /// Starts accumulating growth.
    pub fn begin_counting(&mut self) {
        self.counting = true;
        self.parts.clear();
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
        if at_section || !(ratio < RENORMALISE_AT && ratio * RENORMALISE_AT > 1.0) {
            self.renormalise(orbit, twin, ratio);
        }
        if at_section {
            if self.aligning > 0 {
                self.aligning -= 1;
            } else if self.counting {
                self.parts.push((self.log_growth, self.uncounted));
            }
            (self.log_growth, self.uncounted) = (0.0, 0);
        }
        Ok(())
    }

    /// Records growth to `ratio` times the nominal separation, and rescales the twin to the nominal separation.
    fn renormalise<O: Orbit>(&mut self, orbit: &O, twin: &mut O, ratio: f64) {
        let separation = self.separation * if ratio.is_finite() { ratio.max(MIN_SEPARATION) } else { MIN_SEPARATION };
        self.log_growth += libm::log(separation / self.from);
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
        Some(Exponent { value, standard_error: standard_error(&self.parts) / self.interval, running })
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

/// Standard error of the mean growth per section, from block means because neighbouring sections are not independent.
fn standard_error(parts: &[(f64, usize)]) -> f64 {
    let blocks = parts.len().min(BLOCKS);
    if blocks < 2 {
        return f64::INFINITY;
    }
    let edge = |b: usize| b * parts.len() / blocks;
    let rate = |b: usize| {
        let part = &parts[edge(b)..edge(b + 1)];
        let sections: usize = part.iter().map(|(_, sections)| sections).sum();
        part.iter().map(|(log_growth, _)| log_growth).sum::<f64>() / sections as f64
    };
    let count = blocks as f64;
    let mean = (0..blocks).map(rate).sum::<f64>() / count;
    let square = (0..blocks).map(|b| (rate(b) - mean) * (rate(b) - mean));
    (square.sum::<f64>() / (count * (count - 1.0))).sqrt()
}
