//! Data of the running scene for the chaos bench: the orbit of the last periods, and its Poincaré section at the drive phase.

use std::collections::VecDeque;

use crate::analysis::drive::{OBSERVABLES, drive_period, observed};
use crate::scene::Scene;
use crate::simulate::{Frame, Simulation};

/// Largest number of instants stored per drive period.
const SAMPLES_PER_PERIOD: f64 = 1000.0;
/// Length of the stored orbit, periods.
pub const PERIODS: usize = 6;
/// Largest number of stored sections; beyond that the oldest are dropped.
const MAX_SECTIONS: usize = 20_000;
/// Substitute for the period of a scene without one, s.
const FALLBACK_PERIOD: f64 = 1.0;

/// Pose of the output body and its rates, in the order of [`OBSERVABLES`].
pub type Observed = [f64; OBSERVABLES.len()];

/// The orbit and the section of one run.
#[derive(Clone)]
pub struct RunWatch {
    period: Result<f64, String>,
    phase: f64,
    /// Number of the next section, which is at (next + phase) T.
    next: u64,
    /// The displayed instant, s: later samples stay hidden until their time.
    shown: f64,
    orbit: VecDeque<(f64, Observed)>,
    sections: VecDeque<(f64, Observed)>,
    frame: Frame,
}

impl RunWatch {
    /// Watches a new run of `scene`; its start is not a section.
    pub fn new(scene: &Scene) -> Self {
        let mut watch = Self {
            period: drive_period(scene).map_err(|why| why.to_string()),
            phase: 0.0,
            next: 0,
            shown: 0.0,
            orbit: VecDeque::new(),
            sections: VecDeque::new(),
            frame: Frame::default(),
        };
        watch.seek(0.0);
        watch
    }

    /// Period of the drives, s, or why there is none.
    pub fn period(&self) -> Result<f64, &str> {
        self.period.as_ref().copied().map_err(String::as_str)
    }

    /// Drive phase of the sections, 0 <= phase < 1.
    pub fn phase(&self) -> f64 {
        self.phase
    }

    /// Sets another drive phase: sections at the old one are dropped.
    pub fn set_phase(&mut self, phase: f64, now: f64) {
        if phase != self.phase && (0.0..1.0).contains(&phase) {
            self.phase = phase;
            self.sections.clear();
            self.seek(now);
        }
    }

    /// The orbit of the last periods, oldest first: time in s, state.
    pub fn orbit(&self) -> impl DoubleEndedIterator<Item = &(f64, Observed)> {
        self.orbit.range(..count_until(&self.orbit, self.shown))
    }

    /// The sections, oldest first: time in s, state.
    pub fn sections(&self) -> impl ExactSizeIterator<Item = &(f64, Observed)> {
        self.sections.range(..count_until(&self.sections, self.shown))
    }

    /// Sets the displayed instant, s.
    pub fn set_shown(&mut self, shown: f64) {
        self.shown = shown;
    }

    /// Restarts after a change at `now`, s: earlier data belong to another motion.
    pub fn restart(&mut self, scene: &Scene, now: f64) {
        self.period = drive_period(scene).map_err(|why| why.to_string());
        self.orbit.clear();
        self.sections.clear();
        self.seek(now);
    }

    /// Drops data after `now`, s, for a new branch.
    pub fn truncate(&mut self, now: f64) {
        for list in [&mut self.orbit, &mut self.sections] {
            list.truncate(count_until(list, now));
        }
        self.seek(now);
    }

    /// The run continues from `now`, s, after going back. Known data stay, except an orbit that would have a gap.
    pub fn go_to(&mut self, now: f64) {
        let ends = self.orbit.front().zip(self.orbit.back());
        if ends.is_some_and(|((first, _), (last, _))| !(*first..=*last).contains(&now)) {
            self.orbit.clear();
        }
        self.seek(now);
    }

    /// Makes the section after `now`, s, the next.
    fn seek(&mut self, now: f64) {
        if let Ok(period) = self.period {
            let passed = (now / period - self.phase).floor() + 1.0;
            self.next = passed.max(0.0) as u64;
        }
    }

    fn next_time(&self) -> Option<f64> {
        let period = *self.period.as_ref().ok()?;
        Some((self.next as f64 + self.phase) * period)
    }

    /// Records an instant, unless it is too close to the one before.
    pub fn record(&mut self, frame: &Frame) {
        let period = self.period.as_ref().copied().unwrap_or(FALLBACK_PERIOD);
        let before = self.orbit.back().map(|(time, _)| *time);
        // This also skips instants recorded before the run went back.
        if before.is_some_and(|before| frame.time - before < period / SAMPLES_PER_PERIOD) {
            return;
        }
        let oldest = frame.time - PERIODS as f64 * period;
        while self.orbit.front().is_some_and(|(time, _)| *time < oldest) {
            self.orbit.pop_front();
        }
        self.orbit.push_back((frame.time, observed(&frame.pose)));
    }

    /// Adds the sections of the latest step up to `until`, s, by interpolation. Sampling never changes a run.
    pub fn step(&mut self, simulation: &mut Simulation, until: f64) {
        if let Ok(period) = self.period {
            // Earlier ones would be dropped again: a step may be much longer than the period.
            let kept = (until / period - self.phase).floor() - MAX_SECTIONS as f64;
            self.next = self.next.max(kept.max(0.0) as u64);
        }
        while let Some(time) = self.next_time().filter(|time| *time <= until) {
            self.next += 1;
            if self.sections.back().is_some_and(|(last, _)| time <= *last) {
                continue;
            }
            simulation.sample(time, &mut self.frame);
            if self.sections.len() == MAX_SECTIONS {
                self.sections.pop_front();
            }
            self.sections.push_back((time, observed(&self.frame.pose)));
        }
    }
}

/// Number of entries of `list` up to `now`, s.
fn count_until(list: &VecDeque<(f64, Observed)>, now: f64) -> usize {
    list.partition_point(|(time, _)| *time <= now)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(watch: &mut RunWatch, simulation: &mut Simulation, to: f64) {
        let mut frame = Frame::default();
        while simulation.time() < to {
            simulation.step().expect("runs");
            watch.step(simulation, simulation.time());
            simulation.sample(simulation.time(), &mut frame);
            watch.record(&frame);
            watch.set_shown(frame.time);
        }
    }

    #[test]
    fn sections_lie_at_the_drive_phase_and_the_orbit_covers_the_stated_periods() {
        let changes = [("spcmm.frequency".to_owned(), "5 Hz".to_owned())];
        let scene = Scene::load("spcmm", &changes).expect("built in");
        let mut simulation = Simulation::new(&scene.machine).expect("starts");
        let mut watch = RunWatch::new(&scene);
        assert_eq!(watch.period(), Ok(0.2));
        // The start itself is not a section.
        run(&mut watch, &mut simulation, 0.21);
        assert_eq!(watch.sections().len(), 1);
        simulation = Simulation::new(&scene.machine).expect("starts");
        watch.restart(&scene, 0.0);
        watch.set_phase(0.25, 0.0);
        run(&mut watch, &mut simulation, 0.7);
        let times = |watch: &RunWatch| watch.sections().map(|(time, _)| *time).collect::<Vec<_>>();
        let near = |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(near(&times(&watch), &[0.05, 0.25, 0.45, 0.65]));
        watch.set_shown(0.5);
        assert!(near(&times(&watch), &[0.05, 0.25, 0.45]));
        // Retraced sections are unchanged; a new branch cuts them.
        watch.set_shown(0.7);
        assert_eq!(watch.sections().len(), 4);
        watch.truncate(0.5);
        assert!(near(&times(&watch), &[0.05, 0.25, 0.45]));
        run(&mut watch, &mut simulation, 0.9);
        watch.set_phase(0.75, simulation.time());
        run(&mut watch, &mut simulation, 2.0);
        assert!(near(&times(&watch), &[0.95, 1.15, 1.35, 1.55, 1.75, 1.95]));
        let first = watch.orbit().next().expect("recorded").0;
        assert!((0.7..0.9).contains(&first), "{first}");
        assert!(watch.orbit().count() <= PERIODS * 1000 + 1);
        watch.restart(&scene, simulation.time());
        assert_eq!((watch.sections().len(), watch.orbit().count()), (0, 0));
    }

    #[test]
    fn a_scene_without_a_drive_has_an_orbit_and_no_sections() {
        let scene = Scene::load("pendulum", &[]).expect("built in");
        let mut simulation = Simulation::new(&scene.machine).expect("starts");
        let mut watch = RunWatch::new(&scene);
        assert!(watch.period().expect_err("no drive").contains("no drive that repeats"));
        run(&mut watch, &mut simulation, 0.1);
        assert!(watch.orbit().count() > 20 && watch.sections().len() == 0);
    }
}
