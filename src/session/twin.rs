//! A second run beside the first, minimally displaced, whose distance is never renormalised; and a third, which is, and so tells the
//! largest Lyapunov exponent as a sweep does. Neither affects the run.

use crate::analysis::drive::common_period;
use crate::analysis::exponent::{ALIGNMENT, Benettin, Exponent, offset, scaled_distance};
use crate::analysis::orbit::Orbit as _;
use crate::analysis::point::separation_of;
use crate::simulate::{Frame, Simulation, Snapshot};

/// The displacement, in units of the scales of the state.
pub const DISPLACEMENT: f64 = 1e-9;
/// Distances kept; at this number every second one is dropped.
const KEPT: usize = 4096;
/// Interval at which the growth of a machine that nothing drives is taken, s.
const UNDRIVEN: f64 = 0.1;
/// Intervals of which growth must be known for an exponent: two in each block of its error.
const FEWEST: usize = 20;
/// A step that ends this much of an interval before its end, by rounding, ends it.
const NEARLY: f64 = 1e-9;
/// Intervals for which there is room from the start.
const ROOM: usize = 1024;

/// The renormalised run beside the run, and what its separation has grown by.
struct Growth {
    twin: Simulation,
    benettin: Benettin,
    /// Time from one interval to the next, s, when the one under way ends, and how many have ended.
    interval: f64,
    next: f64,
    ended: usize,
    /// It could not go on.
    lost: bool,
}

impl Growth {
    /// Of neighbours of `run` from now on.
    fn new(run: &Simulation) -> Self {
        let machine = run.machine();
        let interval = common_period(machine).ok().flatten().unwrap_or(UNDRIVEN);
        let mut benettin = Benettin::new(separation_of(machine), interval, ROOM);
        let mut twin = run.twin();
        benettin.start(run, &mut twin);
        Self { twin, benettin, interval, next: run.time() + interval, ended: 0, lost: false }
    }

    /// To be called after a step of `run`.
    fn follow(&mut self, run: &Simulation) {
        let at_end = run.time() >= self.next - NEARLY * self.interval;
        self.lost |= self.benettin.follow(run, &mut self.twin, at_end).is_err();
        if at_end {
            self.ended += 1;
            self.next += self.interval;
            if self.ended == ALIGNMENT {
                self.benettin.begin_counting();
            }
        }
    }
}

/// Where a twin was, to take it back there.
pub struct TwinMark {
    /// When that twin began, s: no other can be taken there.
    begins: f64,
    state: Snapshot,
    steps: u64,
}

impl TwinMark {
    /// Approximate memory, bytes.
    pub fn bytes(&self) -> usize {
        self.state.bytes()
    }
}

/// The twin and its distances so far.
pub struct Twin {
    simulation: Simulation,
    /// When it began, s, and its displaced state then. While the run is taken again from before that, the twin waits.
    begins: f64,
    origin: Snapshot,
    frame: Frame,
    /// Time in s, distance in units of the scales.
    distances: Vec<[f64; 2]>,
    /// Every `stride`-th step is kept.
    stride: u64,
    steps: u64,
    /// Time that the run has reached, s, and its state there: the twin catches up when that is displayed.
    goal: f64,
    goal_state: Vec<f64>,
    /// `None` until the run comes to where the twin began.
    growth: Option<Growth>,
    ended: Option<String>,
}

impl Twin {
    /// Displaces a copy of `run` as it is now.
    pub fn new(run: &Simulation) -> Self {
        let mut simulation = Simulation::of(&run.snapshot());
        let away: Vec<f64> = offset(run.scales(), DISPLACEMENT).collect();
        simulation.displace(&away);
        let mut twin = Self {
            begins: run.time(),
            origin: simulation.snapshot(),
            simulation,
            frame: Frame::default(),
            distances: Vec::with_capacity(KEPT),
            stride: 1,
            steps: 0,
            goal: run.time(),
            goal_state: run.state().to_vec(),
            growth: Some(Growth::new(run)),
            ended: None,
        };
        twin.measure();
        twin.place(run.time());
        twin
    }

    /// Begins anew from the present state of `run`. What a twin that began at the same instant knew of its distances stays.
    pub fn restart(&mut self, run: &Simulation) {
        let before = std::mem::replace(self, Self::new(run));
        if before.begins == self.begins {
            (self.distances, self.stride) = (before.distances, before.stride);
        }
    }

    /// When it began, s.
    pub fn begins(&self) -> f64 {
        self.begins
    }

    /// Where it is now.
    pub fn mark(&self) -> TwinMark {
        TwinMark { begins: self.begins, state: self.simulation.snapshot(), steps: self.steps }
    }

    /// Goes back with `run`, which has just been taken to where it was when `mark` was set. Without a mark of this twin it
    /// waits for its beginning, or begins anew where that has passed.
    pub fn go_back(&mut self, mark: Option<&TwinMark>, run: &Simulation) {
        let mark = mark.filter(|mark| mark.begins == self.begins);
        if mark.is_none() && self.begins < run.time() {
            return self.restart(run);
        }
        let (state, steps) = mark.map_or((&self.origin, 0), |mark| (&mark.state, mark.steps));
        self.simulation.restore(state);
        (self.steps, self.ended) = (steps, None);
        self.goal = self.begins.max(run.time());
        self.goal_state.copy_from_slice(run.state());
        self.growth = None;
    }

    /// Forgets the distances after `time`, s: another future begins.
    pub fn cut(&mut self, time: f64) {
        let time = time.max(self.begins);
        self.distances.retain(|[at, _]| *at <= time);
    }

    /// Whether [`Self::place`] can show it at `time`, s, without being taken back.
    pub fn reaches(&self, time: f64) -> bool {
        time <= self.begins || self.simulation.step_start() < time
    }

    /// To be called after a step of `run`: the twin advances to where the run was before that step.
    pub fn follow(&mut self, run: &Simulation) {
        if run.time() <= self.begins {
            return;
        }
        self.come_to(self.goal);
        self.goal = run.time();
        self.goal_state.copy_from_slice(run.state());
        match &mut self.growth {
            Some(growth) => growth.follow(run),
            None => self.growth = Some(Growth::new(run)),
        }
    }

    /// Steps until `time`, s, lies within the latest step.
    fn come_to(&mut self, time: f64) {
        while self.ended.is_none() && self.simulation.time() < time.min(self.goal) {
            if let Err(stopped) = self.simulation.step_until(self.goal) {
                self.ended = Some(stopped.to_string());
                return;
            }
            if self.simulation.time() == self.goal {
                self.steps += 1;
                if self.steps.is_multiple_of(self.stride) {
                    self.measure();
                }
            }
        }
    }

    /// Records its distance from the run, where that is not known from before.
    fn measure(&mut self) {
        if self.distances.last().is_some_and(|[at, _]| *at >= self.goal) {
            return;
        }
        let scales = self.simulation.scales();
        let distance = scaled_distance(&self.goal_state, self.simulation.state(), scales);
        if self.distances.len() == KEPT {
            let mut keep = false;
            self.distances.retain(|_| {
                keep = !keep;
                keep
            });
            self.stride *= 2;
        }
        // Motions identical to the last bit have no logarithm of their distance.
        if distance > 0.0 && distance.is_finite() {
            self.distances.push([self.goal, distance]);
        }
    }

    /// Samples the state at `time`, s, into [`Self::frame`], limited to the twin's start and to where it ended.
    pub fn place(&mut self, time: f64) {
        self.come_to(time);
        self.simulation.sample(time, &mut self.frame);
    }

    /// The displayed state.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Time in s and distance in units of the scales, in order.
    pub fn distances(&self) -> &[[f64; 2]] {
        &self.distances
    }

    /// Why it ended before the run.
    pub fn ended(&self) -> Option<&str> {
        self.ended.as_deref()
    }

    /// Largest Lyapunov exponent of the run since this twin began, or since the run was last taken back, once enough of it is known;
    /// before, how many more intervals that takes, and their length, s.
    ///
    /// # Errors
    /// Not yet.
    pub fn exponent(&self) -> Result<Exponent, (usize, f64)> {
        let growth = self.growth.as_ref().filter(|growth| !growth.lost);
        let Some(growth) = growth else {
            return Err((ALIGNMENT + FEWEST, UNDRIVEN));
        };
        let known = growth.benettin.result().filter(|exponent| exponent.running.len() >= FEWEST);
        known.ok_or_else(|| {
            let counted = growth.benettin.result().map_or(0, |exponent| exponent.running.len());
            let waits = ALIGNMENT.saturating_sub(growth.ended) + FEWEST - counted;
            (waits, growth.interval)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::point::{Plan, PointRun};
    use crate::scene::Scene;

    #[test]
    fn a_twin_starts_a_billionth_away_and_thins_its_record() {
        let changes = [("contact.friction".to_owned(), "0".to_owned())];
        let scene = Scene::load("spcmm", &changes).expect("built in");
        let mut run = Simulation::new(&scene.machine).expect("starts");
        let mut twin = Twin::new(&run);
        let start = twin.distances()[0];
        assert!((start[1] / DISPLACEMENT - 1.0).abs() < 1e-6, "{start:?}");
        for _ in 0..3 * KEPT {
            run.step().expect("runs");
            let start = run.step_start();
            twin.follow(&run);
            // Whatever instant of the step is displayed, the twin is there.
            for part in [0.3, 0.9, 1.0] {
                let time = start + part * (run.time() - start);
                twin.place(time);
                assert_eq!(twin.frame().time, time);
            }
        }
        assert!(twin.distances().len() <= KEPT && twin.stride > 1);
        assert!(twin.distances().is_sorted_by(|a, b| a[0] < b[0]));
    }

    #[test]
    fn its_exponent_is_that_of_a_sweep() {
        let scene = Scene::load("slider-crank-driven", &[]).expect("built in");
        let period = crate::analysis::drive::drive_period(&scene).expect("driven");
        let (discard, kept) = (ALIGNMENT, FEWEST);
        let plan = Plan { periods: discard + kept, discard, phase: 0.0, exponent: true };
        let mut point = PointRun::cold(&scene, plan, period).expect("starts");
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
