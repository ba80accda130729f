//! A simulation that accompanies the run: it is stepped up to the displayed instant, sampled at the same instants, and rewound
//! with the run. It never affects the run. The twin and the ideal motion are companions. The run from before a change has its own record,
//! so it is a copy of the player (`player/before_change.rs`).

use crate::simulate::{Frame, Simulation, Snapshot, Stopped};

/// Largest number of saved states; at this number every second one is dropped.
pub(super) const MAX_STATES: usize = 32;
/// Initial interval between them, s.
const INITIAL_INTERVAL: f64 = 1e-2;

/// A saved state of a companion. It restores only the companion that saved it, which its start time identifies.
pub struct CompanionState {
    /// Start of the companion, s.
    start_time: f64,
    /// The state.
    pub state: Snapshot,
}

/// Drops the second, fourth, sixth entry and so on.
pub(super) fn drop_every_second<T>(list: &mut Vec<T>) {
    let mut keep = false;
    list.retain(|_| {
        keep = !keep;
        keep
    });
}

/// A simulation that accompanies the run.
#[derive(Clone)]
pub struct Companion {
    /// May be ahead of the displayed instant by part of its latest step.
    pub(super) simulation: Simulation,
    /// The latest displayed instant.
    pub(super) frame: Frame,
    /// Saved states in order of time; the first is the start.
    pub(super) states: Vec<Snapshot>,
    interval: f64,
    /// Why it ended before the run.
    pub(super) stopped: Option<Stopped>,
}

impl Companion {
    /// Starts from the current state of `simulation`.
    pub fn new(mut simulation: Simulation) -> Self {
        let mut frame = Frame::default();
        simulation.sample(simulation.time(), &mut frame);
        Self { states: vec![simulation.snapshot()], simulation, frame, interval: INITIAL_INTERVAL, stopped: None }
    }

    /// Start time, s.
    pub fn start_time(&self) -> f64 {
        self.states[0].time()
    }

    /// Steps until `time`, s, lies in the latest step. `prepare_step` returns the latest end of each step, s, or `None` to pause.
    /// Returns whether `time` is reached.
    pub fn advance(&mut self, time: f64, mut prepare_step: impl FnMut(&mut Self) -> Option<f64>) -> bool {
        while self.simulation.time() < time {
            let Some(end) = self.stopped.is_none().then(|| prepare_step(self)).flatten() else {
                return false;
            };
            self.stopped = self.simulation.step_until(end).err();
        }
        true
    }

    /// Samples `time`, s, into [`Self::frame`].
    pub fn sample(&mut self, time: f64) {
        self.simulation.sample(time, &mut self.frame);
    }

    /// The current state.
    pub fn state(&self) -> CompanionState {
        CompanionState { start_time: self.start_time(), state: self.simulation.snapshot() }
    }

    /// Restores a state, or the start if there is none. Returns false if the state belongs to another companion.
    pub fn restore(&mut self, state: Option<&CompanionState>) -> bool {
        let own_state = state.filter(|state| state.start_time == self.start_time());
        self.simulation.restore(own_state.map_or(&self.states[0], |state| &state.state));
        self.stopped = None;
        own_state.is_some()
    }

    /// Saves the current state if at least one interval has passed since the last saved state.
    pub fn save_state(&mut self) {
        let newest = self.states.last().map_or(f64::NEG_INFINITY, |state| state.time());
        if self.simulation.time() < newest + self.interval {
            return;
        }
        if self.states.len() == MAX_STATES {
            drop_every_second(&mut self.states);
            self.interval *= 2.0;
        }
        self.states.push(self.simulation.snapshot());
    }

    /// Restores the latest saved state at or before `time`, s.
    pub fn go_back(&mut self, time: f64) {
        let known = self.states.partition_point(|state| state.time() <= time);
        self.simulation.restore(&self.states[known.max(1) - 1]);
        self.stopped = None;
    }

    /// Drops the saved states after `time`, s, and goes back if the companion is ahead of `time`.
    pub fn forget_after(&mut self, time: f64) {
        self.states.retain(|state| state.time() <= time);
        if self.simulation.time() > time {
            self.go_back(time);
        }
    }
}
