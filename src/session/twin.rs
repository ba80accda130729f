//! A twin run, slightly displaced and never renormalised, and a renormalised one that yields the largest Lyapunov exponent as
//! in a sweep. Neither affects the run.

use super::companion::{Companion, CompanionState, drop_every_second};
use crate::analysis::drive::common_period;
use crate::analysis::exponent::{ALIGNMENT, Benettin, Exponent, offset, scaled_distance};
use crate::analysis::orbit::Orbit as _;
use crate::analysis::point::separation_of;
use crate::simulate::{Frame, Simulation, Stopped};

/// The displacement, in units of the scales of the state.
pub const DISPLACEMENT: f64 = 1e-9;
/// Largest number of stored distances; at this number every second one is dropped.
const MAX_DISTANCES: usize = 4096;
/// Interval between renormalisations of an undriven machine, s.
const UNDRIVEN_INTERVAL: f64 = 0.1;
/// Smallest number of intervals that yield an exponent: enough for its standard error.
const MIN_INTERVALS: usize = 20;
/// Rounding tolerance of the end of an interval, in intervals.
const TIME_TOLERANCE: f64 = 1e-9;
/// Initial capacity, intervals.
const INITIAL_CAPACITY: usize = 1024;

/// The renormalised twin and the growth of its separation.
#[derive(Clone)]
struct Growth {
    twin: Simulation,
    benettin: Benettin,
    /// Length of an interval, s, end of the current one, s, and number of completed ones.
    interval: f64,
    next: f64,
    completed: usize,
    /// Whether a step of the twin failed.
    has_failed: bool,
}

impl Growth {
    /// Measures the growth from the current state of `run` on.
    fn new(run: &Simulation) -> Self {
        let machine = &run.changed_machine();
        let interval = common_period(machine).ok().flatten().unwrap_or(UNDRIVEN_INTERVAL);
        let mut benettin = Benettin::new(separation_of(machine), interval, INITIAL_CAPACITY);
        let mut twin = run.twin();
        benettin.start(run, &mut twin);
        Self { twin, benettin, interval, next: run.time() + interval, completed: 0, has_failed: false }
    }

    /// Call after each step of `run`.
    fn follow(&mut self, run: &Simulation) {
        let at_end = run.time() >= self.next - TIME_TOLERANCE * self.interval;
        self.has_failed |= self.benettin.follow(run, &mut self.twin, at_end).is_err();
        if at_end {
            self.completed += 1;
            self.next += self.interval;
            if self.completed == ALIGNMENT {
                self.benettin.begin_counting();
            }
        }
    }
}

/// The twin and its distances so far.
#[derive(Clone)]
pub struct Twin {
    pub(super) motion: Companion,
    /// Steps of the run before its start. While the run retraces earlier time, the twin waits.
    steps_before: u64,
    /// Time in s, distance in units of the scales.
    distances: Vec<[f64; 2]>,
    /// Only every `stride`-th step is stored.
    stride: u64,
    /// Time that the run has reached, s, with its steps and its state; the twin catches up when it is displayed.
    goal: f64,
    goal_steps: u64,
    goal_state: Vec<f64>,
    /// `None` until the run reaches the start of the twin.
    growth: Option<Growth>,
}

impl Twin {
    /// A displaced copy of `run` in its current state.
    pub fn new(run: &Simulation) -> Self {
        let mut simulation = run.twin();
        let offsets: Vec<f64> = offset(run.scales(), DISPLACEMENT).collect();
        simulation.displace(&offsets);
        let steps = run.statistics().steps;
        let mut twin = Self {
            motion: Companion::new(simulation),
            steps_before: steps,
            distances: Vec::with_capacity(MAX_DISTANCES),
            stride: 1,
            goal: run.time(),
            goal_steps: steps,
            goal_state: run.state_vector().to_vec(),
            growth: Some(Growth::new(run)),
        };
        twin.measure();
        twin
    }

    /// Restarts from the current state of `run`. Keeps the known distances if the start is the same.
    pub fn restart(&mut self, run: &Simulation) {
        let before = std::mem::replace(self, Self::new(run));
        if before.start_time() == self.start_time() {
            (self.distances, self.stride) = (before.distances, before.stride);
        }
    }

    /// Start time, s.
    pub fn start_time(&self) -> f64 {
        self.motion.start_time()
    }

    /// Goes back with `run`, which was just restored to the instant of `state`. Without a state of this twin it waits for its
    /// start, or restarts if that has passed.
    pub fn go_back(&mut self, state: Option<&CompanionState>, run: &Simulation) {
        if !self.motion.restore(state) && self.start_time() < run.time() {
            return self.restart(run);
        }
        self.set_goal(run, self.start_time().max(run.time()));
        self.growth = None;
    }

    /// Drops the distances after `time`, s, for a new branch.
    pub fn truncate(&mut self, time: f64) {
        let time = time.max(self.start_time());
        self.distances.retain(|[at, _]| *at <= time);
    }

    /// Whether [`Self::move_to`] can sample `time`, s, without going back.
    pub fn reaches(&self, time: f64) -> bool {
        time <= self.start_time() || self.motion.simulation.step_start() < time
    }

    /// Call after each step of `run`: the twin advances to the start of that step.
    pub fn follow(&mut self, run: &Simulation) {
        if run.time() <= self.start_time() {
            return;
        }
        self.advance_to_within_step(self.goal);
        self.set_goal(run, run.time());
        match &mut self.growth {
            Some(growth) => growth.follow(run),
            None => self.growth = Some(Growth::new(run)),
        }
    }

    /// Sets the instant that the twin advances to: `time`, s, which `run` has reached.
    fn set_goal(&mut self, run: &Simulation, time: f64) {
        (self.goal, self.goal_steps) = (time, run.statistics().steps);
        self.goal_state.copy_from_slice(run.state_vector());
    }

    /// Steps until `time`, s, lies within the latest step; the steps end where those of the run do.
    fn advance_to_within_step(&mut self, time: f64) {
        let (before, goal) = (self.motion.simulation.time(), self.goal);
        self.motion.advance(time.min(goal), |_| Some(goal));
        let steps = self.goal_steps.saturating_sub(self.steps_before);
        if before < goal && self.motion.simulation.time() == goal && steps.is_multiple_of(self.stride) {
            self.measure();
        }
    }

    /// Records the distance from the run, unless it is already known.
    fn measure(&mut self) {
        if self.distances.last().is_some_and(|[at, _]| *at >= self.goal) {
            return;
        }
        let twin = &self.motion.simulation;
        let distance = scaled_distance(&self.goal_state, twin.state_vector(), twin.scales());
        if self.distances.len() == MAX_DISTANCES {
            drop_every_second(&mut self.distances);
            self.stride *= 2;
        }
        // Identical states have no logarithm of their distance.
        if distance > 0.0 && distance.is_finite() {
            self.distances.push([self.goal, distance]);
        }
    }

    /// Samples the state at `time`, s, into [`Self::frame`], clamped to the twin's start and end.
    pub fn move_to(&mut self, time: f64) {
        self.advance_to_within_step(time);
        self.motion.sample(time);
    }

    /// The displayed state.
    pub fn frame(&self) -> &Frame {
        &self.motion.frame
    }

    /// Time in s and distance in units of the scales, in order.
    pub fn distances(&self) -> &[[f64; 2]] {
        &self.distances
    }

    /// Why it ended before the run.
    pub fn stopped(&self) -> Option<&Stopped> {
        self.motion.stopped.as_ref()
    }

    /// Largest Lyapunov exponent of the run since this twin began, or since the run last went back.
    ///
    /// # Errors
    /// Too few intervals so far: how many more are needed, and their length, s.
    pub fn exponent(&self) -> Result<Exponent, (usize, f64)> {
        let growth = self.growth.as_ref().filter(|growth| !growth.has_failed);
        let Some(growth) = growth else {
            return Err((ALIGNMENT + MIN_INTERVALS, UNDRIVEN_INTERVAL));
        };
        let exponent = growth.benettin.result().filter(|exponent| exponent.running.len() >= MIN_INTERVALS);
        exponent.ok_or_else(|| {
            let counted = growth.benettin.result().map_or(0, |exponent| exponent.running.len());
            let missing = ALIGNMENT.saturating_sub(growth.completed) + MIN_INTERVALS - counted;
            (missing, growth.interval)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::point::{Plan, PointRun};
    use crate::scene::Scene;

    #[test]
    fn a_twin_starts_displaced_by_a_billionth_and_its_record_is_thinned() {
        let changes = [("contact.friction".to_owned(), "0".to_owned())];
        let scene = Scene::load("spcmm", &changes).expect("built in");
        let mut run = Simulation::new(&scene.machine).expect("starts");
        let mut twin = Twin::new(&run);
        let start = twin.distances()[0];
        assert!((start[1] / DISPLACEMENT - 1.0).abs() < 1e-6, "{start:?}");
        for _ in 0..3 * MAX_DISTANCES {
            run.step().expect("runs");
            let start = run.step_start();
            twin.follow(&run);
            // The twin can be sampled at any instant of the step.
            for part in [0.3, 0.9, 1.0] {
                let time = start + part * (run.time() - start);
                twin.move_to(time);
                assert_eq!(twin.frame().time, time);
            }
        }
        assert!(twin.distances().len() <= MAX_DISTANCES && twin.stride > 1);
        assert!(twin.distances().is_sorted_by(|a, b| a[0] < b[0]));
    }

    #[test]
    fn the_exponent_equals_that_of_a_sweep() {
        let scene = Scene::load("slider-crank-driven", &[]).expect("built in");
        let period = crate::analysis::drive::drive_period(&scene).expect("driven");
        let (discard, kept) = (ALIGNMENT, MIN_INTERVALS);
        let plan = Plan { periods: discard + kept, discard, phase: 0.0, exponent: true };
        let mut point = PointRun::cold(&scene, &plan.into(), period).expect("starts");
        while !point.is_done() {
            point.step().expect("runs");
        }
        let swept = point.finish().0.evidence.exponent.expect("a twin");
        let mut run = Simulation::new(&scene.machine).expect("starts");
        let mut twin = Twin::new(&run);
        assert_eq!(twin.exponent(), Err((discard + kept, period)));
        for k in 1..=discard + kept {
            let end = period + (k - 1) as f64 * period;
            while run.time() < end {
                run.step_until(end).expect("runs");
                twin.follow(&run);
            }
        }
        let shown = twin.exponent().expect("enough is known");
        assert!((shown.value - swept.value).abs() <= 1e-9 * swept.value.abs(), "{} {}", shown.value, swept.value);
        assert_eq!(shown.running.len(), kept);
    }
}
