//! Sampling of a motion at equal time intervals (the Poincaré section of a driven system), with a twin run that measures how
//! fast neighbouring motions diverge.

use super::exponent::{ALIGNMENT, Benettin};
use super::orbit::Orbit;

/// Times of the sections, and how many are discarded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Schedule {
    /// Time of the first section, s.
    pub first: f64,
    /// Time from one section to the next, s.
    pub interval: f64,
    /// Number of sections, including discarded ones.
    pub sections: usize,
    /// Initial sections, discarded as a transient.
    pub discard: usize,
}

impl Schedule {
    /// Time of section `k`, counted from 0, s.
    pub fn time(&self, k: usize) -> f64 {
        self.first + k as f64 * self.interval
    }

    /// Number of kept sections.
    pub fn kept(&self) -> usize {
        self.sections - self.discard
    }

    /// Number of sections up to `now`, s.
    pub fn passed(&self, now: f64) -> usize {
        let guess = ((now - self.first) / self.interval).floor();
        // Rounding can make the guess wrong by one; the cast turns a negative guess into 0.
        let mut k = (guess as usize).saturating_sub(1).min(self.sections);
        while k < self.sections && self.time(k) <= now {
            k += 1;
        }
        k
    }

    /// Time of the next section after `now`, s; infinite after the last.
    pub fn next(&self, now: f64) -> f64 {
        let k = self.passed(now);
        if k < self.sections { self.time(k) } else { f64::INFINITY }
    }
}

/// A motion and its sections so far.
pub struct SectionsSoFar<O> {
    /// The motion.
    pub orbit: O,
    /// Number of sections taken, including discarded ones.
    pub taken: usize,
    /// Number of initial sections, discarded as a transient.
    pub discard: usize,
    /// Kept sections, concatenated, each as long as [`Orbit::observables`].
    pub kept: Vec<f64>,
}

/// A motion on its way through its sections.
pub struct SectionRun<O: Orbit> {
    /// The motion, and its sections.
    pub so_far: SectionsSoFar<O>,
    pub(super) schedule: Schedule,
    twin: Twin<O>,
    /// Requested separation in units of the scales; `None` measures no exponent.
    separation: Option<f64>,
}

enum Twin<O> {
    None,
    Running(Box<O>, Box<Benettin>),
}

impl<O: Orbit> SectionRun<O> {
    /// Observes `orbit` from now on. `separation` is the separation of the twin in units of the scales of the state. It should
    /// be well above the error of a step and well below the amplitude of the motion; `None` runs no twin.
    pub fn new(orbit: O, schedule: Schedule, separation: Option<f64>) -> Self {
        let mut run = Self {
            so_far: SectionsSoFar {
                kept: Vec::with_capacity(schedule.kept() * orbit.observables()),
                orbit,
                taken: 0,
                discard: schedule.discard,
            },
            schedule,
            twin: Twin::None,
            separation,
        };
        run.maybe_start_twin();
        run
    }

    /// Whether all sections are taken.
    pub fn is_done(&self) -> bool {
        self.so_far.taken >= self.schedule.sections
    }

    /// Growth of the twin's separation so far; `None` without a twin, or after the twin failed.
    pub fn exponent(&self) -> Option<&Benettin> {
        match &self.twin {
            Twin::Running(_, benettin) => Some(benettin),
            Twin::None => None,
        }
    }

    /// Takes one step of the motion; returns `true` if it ended at a section.
    ///
    /// # Errors
    /// The motion cannot continue.
    pub fn step(&mut self) -> Result<bool, O::Stop> {
        if self.is_done() {
            return Ok(false);
        }
        let end = self.schedule.time(self.so_far.taken);
        self.so_far.orbit.step_until(end)?;
        let at_section = self.so_far.orbit.time() >= end;
        self.follow(at_section);
        if at_section {
            self.so_far.taken += 1;
            if self.so_far.taken > self.so_far.discard {
                let (start, n) = (self.so_far.kept.len(), self.so_far.orbit.observables());
                self.so_far.kept.resize(start + n, 0.0);
                self.so_far.orbit.observe(&mut self.so_far.kept[start..]);
            }
            self.maybe_start_twin();
        }
        Ok(at_section)
    }

    fn maybe_start_twin(&mut self) {
        let Some(separation) = self.separation else {
            return;
        };
        let start = self.schedule.discard.saturating_sub(ALIGNMENT);
        if self.so_far.taken == start {
            let mut twin = self.so_far.orbit.twin();
            let mut benettin = Benettin::new(separation, self.schedule.interval, self.schedule.kept());
            benettin.start(&self.so_far.orbit, &mut twin);
            self.twin = Twin::Running(Box::new(twin), Box::new(benettin));
        }
        if self.so_far.taken == self.schedule.discard
            && let Twin::Running(_, benettin) = &mut self.twin
        {
            benettin.begin_counting();
        }
    }

    /// Advances the twin to the time of the motion, which never depends on its twin.
    fn follow(&mut self, at_section: bool) {
        if let Twin::Running(twin, benettin) = &mut self.twin
            && benettin.follow(&self.so_far.orbit, twin, at_section).is_err()
        {
            // If the twin fails, only the exponent is lost, not the sections.
            self.twin = Twin::None;
            self.separation = None;
        }
    }
}
