//! Largest Lyapunov exponent from two nearby runs with renormalisation.
//!
//! Benettin, Galgani & Strelcyn, Phys. Rev. A 14 (1976) 2338. The twin starts at a small separation d0 and is rescaled to
//! it whenever the separation has grown or shrunk by more than a given factor; the exponent is the sum of the logarithms
//! of these factors divided by the time.

use super::orbit::Orbit;

/// The twin is rescaled once its separation has changed by more than this factor.
const RENORMALISE_AT: f64 = 4.0;
/// If a comparison finds a larger change than this, it came late: the interval to the next one is halved.
const LATE_AT: f64 = 16.0;
/// Time between comparisons over the section interval: the longest, which is also the initial one, and the shortest;
/// powers of two.
const FEWEST: f64 = 1.0 / 16.0;
const MOST: f64 = 1.0 / 65536.0;
/// A separation this many times the nominal one is renormalised even if the two runs differ in their contacts.
const FAR: f64 = 1e3;
/// A separation lost in rounding counts as this fraction of the nominal one.
const VANISHED: f64 = 1e-9;
/// Blocks for the standard error.
const BLOCKS: usize = 10;

/// An exponent and the evidence of its convergence.
#[derive(Clone, Debug, PartialEq)]
pub struct Exponent {
    /// Largest Lyapunov exponent, 1/s; for a map per iteration.
    pub value: f64,
    /// Standard error of the mean over blocks of consecutive sections (10 blocks, or one per section if there are fewer),
    /// 1/s; infinite for fewer than two.
    pub standard_error: f64,
    /// Estimate after each kept section, 1/s.
    pub running: Vec<f64>,
}

/// Separation of the twin and its history.
#[derive(Clone, Debug)]
pub struct Benettin {
    separation: f64,
    interval: f64,
    check: f64,
    next: f64,
    /// Separation after the latest renormalisation, and at the latest comparison.
    from: f64,
    latest: f64,
    /// Sum of the logarithms since counting began, without that of `latest` over `from`.
    sum: f64,
    counting: bool,
    /// ln of the growth from the start of counting to the end of each section.
    at_sections: Vec<f64>,
    /// To be subtracted: `ln(latest / from)` at the start of counting.
    offset: f64,
    difference: Vec<f64>,
}

impl Benettin {
    /// For a twin at `separation` (in units of the scales), with at most `sections` sections at every `interval`,
    /// starting at time `now`.
    pub fn new(separation: f64, interval: f64, now: f64, sections: usize) -> Self {
        let check = interval * FEWEST;
        Self {
            separation,
            interval,
            check,
            next: now + check,
            from: separation,
            latest: separation,
            sum: 0.0,
            counting: false,
            at_sections: Vec::with_capacity(sections),
            offset: 0.0,
            difference: Vec::new(),
        }
    }

    /// Displaces a new twin.
    pub fn start<O: Orbit>(&mut self, orbit: &O, twin: &mut O) {
        self.push_away(orbit, twin);
        self.from = distance(orbit, twin);
        self.latest = self.from;
    }

    /// Starts accumulating growth.
    pub fn begin_counting(&mut self) {
        self.counting = true;
        self.sum = 0.0;
        self.offset = ln_ratio(self.latest, self.from);
        self.at_sections.clear();
    }

    /// Whether the twin is due for comparison at `time`.
    pub fn is_due(&self, time: f64) -> bool {
        time >= self.next
    }

    /// Advances the twin to the orbit's time and measures the separation.
    ///
    /// # Errors
    /// The twin cannot continue.
    pub fn compare<O: Orbit>(&mut self, orbit: &O, twin: &mut O) -> Result<(), O::Stop> {
        let now = orbit.time();
        while twin.time() < now {
            twin.step_until(now)?;
        }
        if orbit.comparable(twin) {
            twin.step_like(orbit);
        }
        let before = self.latest;
        self.latest = distance(orbit, twin);
        if !self.latest.is_finite() || self.latest < VANISHED * self.separation {
            self.latest = VANISHED * self.separation;
            self.sum += ln_ratio(self.latest, self.from);
            self.push_away(orbit, twin);
            self.from = distance(orbit, twin);
            self.latest = self.from;
            self.next = now + self.check;
            return Ok(());
        }
        let change = self.latest / before;
        if change > LATE_AT || change * LATE_AT < 1.0 {
            self.check = (0.5 * self.check).max(self.interval * MOST);
        } else if change < RENORMALISE_AT && change * RENORMALISE_AT > 1.0 {
            self.check = (2.0 * self.check).min(self.interval * FEWEST);
        }
        self.next = now + self.check;
        let off = self.latest / self.separation;
        if off < RENORMALISE_AT && off * RENORMALISE_AT > 1.0 {
            return Ok(());
        }
        if !orbit.comparable(twin) && off < FAR {
            // After the orbit's next step both may be in contact.
            self.next = now;
            return Ok(());
        }
        self.difference.clear();
        // twin + (1 - f) (orbit - twin) = orbit + f (twin - orbit)
        let part = 1.0 - self.separation / self.latest;
        let pairs = orbit.state().iter().zip(twin.state());
        self.difference.extend(pairs.map(|(a, b)| part * (a - b)));
        self.sum += ln_ratio(self.latest, self.from);
        twin.displace(&self.difference);
        // The requested and the actual separation differ because loops are closed again.
        self.from = distance(orbit, twin).max(VANISHED * self.separation);
        self.latest = self.from;
        Ok(())
    }

    /// Records a section, at which the twin has been compared.
    pub fn end_section(&mut self) {
        if self.counting {
            let growth = self.sum + ln_ratio(self.latest, self.from) - self.offset;
            self.at_sections.push(growth);
        }
    }

    /// The exponent so far; `None` before the first counted section.
    pub fn result(&self) -> Option<Exponent> {
        let n = self.at_sections.len();
        let last = *self.at_sections.last()?;
        let running = self.at_sections.iter().enumerate();
        Some(Exponent {
            value: last / (n as f64 * self.interval),
            standard_error: standard_error(&self.at_sections) / self.interval,
            running: running.map(|(k, growth)| growth / ((k + 1) as f64 * self.interval)).collect(),
        })
    }

    /// Displaces the twin from the orbit in a generic direction.
    fn push_away<O: Orbit>(&mut self, orbit: &O, twin: &mut O) {
        let scales = orbit.scales();
        self.difference.clear();
        self.difference.extend(offset(scales, self.separation));
        let states = orbit.state().iter().zip(twin.state());
        for (d, (a, b)) in self.difference.iter_mut().zip(states) {
            *d += a - b;
        }
        twin.displace(&self.difference);
    }
}

/// An offset of length `separation` in units of `scales`, in a generic direction.
pub fn offset(scales: &[f64], separation: f64) -> impl Iterator<Item = f64> {
    // Weyl sequence: fixed, well spread, and aligned with no coordinate.
    let part = |i: usize| (0.618_033_988_749_894_9 * (i + 1) as f64).fract() - 0.5;
    let square: f64 = (0..scales.len()).map(|i| part(i) * part(i)).sum();
    let factor = separation / square.sqrt();
    let scales = scales.iter().enumerate();
    scales.map(move |(i, scale)| factor * scale * part(i))
}

fn distance<O: Orbit>(a: &O, b: &O) -> f64 {
    scaled_distance(a.state(), b.state(), a.scales())
}

/// Euclidean distance of two states in units of their scales.
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

fn ln_ratio(a: f64, b: f64) -> f64 {
    libm::log(a / b)
}

/// Standard error of the mean growth per section, from block means: neighbouring sections are not independent.
fn standard_error(cumulative: &[f64]) -> f64 {
    let blocks = cumulative.len().min(BLOCKS);
    if blocks < 2 {
        return f64::INFINITY;
    }
    let at = |n: usize| if n == 0 { 0.0 } else { cumulative[n - 1] };
    let edge = |b: usize| b * cumulative.len() / blocks;
    let rate = |b: usize| {
        let (from, to) = (edge(b), edge(b + 1));
        (at(to) - at(from)) / (to - from) as f64
    };
    let count = blocks as f64;
    let mean = (0..blocks).map(rate).sum::<f64>() / count;
    let square = (0..blocks).map(|b| (rate(b) - mean) * (rate(b) - mean));
    (square.sum::<f64>() / (count * (count - 1.0))).sqrt()
}
