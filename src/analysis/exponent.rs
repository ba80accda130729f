//! Largest Lyapunov exponent from two nearby runs with renormalisation.
//!
//! Benettin, Galgani & Strelcyn, Phys. Rev. A 14 (1976) 2338. The twin starts at a small separation d0 and is brought back
//! to it whenever it has grown or shrunk by more than a factor; the exponent is the sum of the logarithms of these
//! factors over the time.

use super::orbit::Orbit;

/// The twin is brought back to its separation once that has changed by more than this factor.
const RENORMALISE_AT: f64 = 4.0;
/// A comparison that finds a larger change than this came late: the next ones come twice as often.
const LATE_AT: f64 = 16.0;
/// Comparisons in one interval between sections, at first and at most; of these powers of two.
const FEWEST: f64 = 1.0 / 16.0;
const MOST: f64 = 1.0 / 65536.0;
/// A separation this many times the wanted one is renormalised even if the two runs differ in their contacts.
const FAR: f64 = 1e3;
/// A separation that vanished in rounding counts as this fraction of the wanted one.
const VANISHED: f64 = 1e-9;
/// Blocks for the standard error.
const BLOCKS: usize = 10;

/// An exponent with what its convergence shows.
#[derive(Clone, Debug, PartialEq)]
pub struct Exponent {
    /// Largest Lyapunov exponent, 1/s; for a map per iteration.
    pub value: f64,
    /// Standard error of the mean over blocks of consecutive sections (10, or one a section where there are fewer),
    /// 1/s; infinite for less than two.
    pub standard_error: f64,
    /// Estimate after each kept section, 1/s.
    pub running: Vec<f64>,
}

/// The twin's separation and its history.
#[derive(Clone, Debug)]
pub struct Benettin {
    separation: f64,
    interval: f64,
    check: f64,
    next: f64,
    /// Separation after the latest renormalisation, and at the latest comparison.
    from: f64,
    latest: f64,
    /// Sum of logarithms since counting began, without that of `latest` over `from`.
    sum: f64,
    counting: bool,
    /// ln of the growth from counting's beginning to the end of each section.
    at_sections: Vec<f64>,
    /// What is subtracted: `ln(latest / from)` when counting began.
    offset: f64,
    renormalisations: u64,
    difference: Vec<f64>,
}

impl Benettin {
    /// For a twin at `separation` (in units of the scales), sections every `interval`, from time `now`, at most
    /// `sections` of them.
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
            renormalisations: 0,
            difference: Vec::new(),
        }
    }

    /// Displaces a fresh twin.
    pub fn start<O: Orbit>(&mut self, orbit: &O, twin: &mut O) {
        self.push_away(orbit, twin);
        self.from = distance(orbit, twin);
        self.latest = self.from;
    }

    /// From now on growth counts.
    pub fn begin_counting(&mut self) {
        self.counting = true;
        self.sum = 0.0;
        self.offset = ln_ratio(self.latest, self.from);
        self.at_sections.clear();
    }

    /// Whether the twin is to be compared at `time`.
    pub fn is_due(&self, time: f64) -> bool {
        time >= self.next
    }

    /// Times the twin was brought back.
    pub fn renormalisations(&self) -> u64 {
        self.renormalisations
    }

    /// Brings the twin to the orbit's time and looks how far it is.
    ///
    /// # Errors
    /// The twin cannot go on.
    pub fn compare<O: Orbit>(&mut self, orbit: &O, twin: &mut O) -> Result<(), O::Stop> {
        let now = orbit.time();
        while twin.time() < now {
            twin.step_until(now)?;
        }
        let before = self.latest;
        self.latest = distance(orbit, twin);
        if !self.latest.is_finite() || self.latest < VANISHED * self.separation {
            self.latest = VANISHED * self.separation;
            self.sum += ln_ratio(self.latest, self.from);
            self.push_away(orbit, twin);
            self.from = distance(orbit, twin);
            self.latest = self.from;
            self.renormalisations += 1;
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
            // At the next step of the orbit both may have the contact.
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
        // What was asked for and what came out differ where loops are closed again.
        self.from = distance(orbit, twin).max(VANISHED * self.separation);
        self.latest = self.from;
        self.renormalisations += 1;
        Ok(())
    }

    /// A section was reached; the comparison there was made.
    pub fn end_section(&mut self) {
        if self.counting {
            let growth = self.sum + ln_ratio(self.latest, self.from) - self.offset;
            self.at_sections.push(growth);
        }
    }

    /// The exponent so far; `None` before the first section that counts.
    pub fn result(&self) -> Option<Exponent> {
        let n = self.at_sections.len();
        let last = *self.at_sections.last()?;
        let running = self.at_sections.iter().enumerate();
        Some(Exponent {
            value: last / (n as f64 * self.interval),
            standard_error: standard_error(&self.at_sections) / self.interval,
            running: running
                .map(|(k, growth)| growth / ((k + 1) as f64 * self.interval))
                .collect(),
        })
    }

    /// Moves the twin away from the orbit in a direction that is nobody's own.
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

/// An offset of length `separation` in units of `scales`, in a direction that is nobody's own.
pub fn offset(scales: &[f64], separation: f64) -> impl Iterator<Item = f64> {
    // Weyl's sequence: fixed, spread, and aligned with no coordinate.
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

/// Standard error of the mean growth per section, from the means of blocks: neighbouring sections are not independent.
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
