//! A simulation beside the run: it is stepped as far as the run is displayed, sampled at the same instants, and goes back with
//! it. It never affects the run. The twin and the ideal motion are companions. A run from before a change is more: it has a
//! record of its own, so that it is a copy of the player (`player/before_change.rs`).

use crate::simulate::{Frame, Simulation, State, Stopped};

/// Most states to go back to; at this number every second one is dropped.
pub(super) const MOST_STATES: usize = 32;
/// Initial interval between them, s.
const APART: f64 = 1e-2;

/// A saved state of a companion, and the start of that companion, s: no other can be restored from it.
pub struct CompanionState(f64, pub State);

/// Keeps the first, third, fifth and so on.
pub(super) fn drop_every_second<T>(list: &mut Vec<T>) {
    let mut keep = false;
    list.retain(|_| {
        keep = !keep;
        keep
    });
}

/// A simulation beside the run.
#[derive(Clone)]
pub struct Companion {
    /// May be ahead of the displayed instant by part of its latest step.
    pub(super) simulation: Simulation,
    /// The latest displayed instant.
    pub(super) frame: Frame,
    /// States to go back to, in order of time; the first is the start.
    pub(super) states: Vec<State>,
    apart: f64,
    /// Why it ended before the run.
    pub(super) stopped: Option<Stopped>,
}

impl Companion {
    /// Begins with the present state of `simulation`.
    pub fn new(mut simulation: Simulation) -> Self {
        let mut frame = Frame::default();
        simulation.sample(simulation.time(), &mut frame);
        Self { states: vec![simulation.state().clone()], simulation, frame, apart: APART, stopped: None }
    }

    /// Start, s.
    pub fn begins(&self) -> f64 {
        self.states[0].time()
    }

    /// Steps until `time`, s, lies in the latest step. `lead` prepares each step and returns its latest end, s, or `None` to
    /// pause. Returns whether it is there.
    pub fn advance(&mut self, time: f64, mut lead: impl FnMut(&mut Self) -> Option<f64>) -> bool {
        while self.simulation.time() < time {
            let Some(end) = self.stopped.is_none().then(|| lead(self)).flatten() else {
                return false;
            };
            self.stopped = self.simulation.step_until(end).err();
        }
        true
    }

    /// Samples `time`, s, into [`Self::frame`].
    pub fn show(&mut self, time: f64) {
        self.simulation.sample(time, &mut self.frame);
    }

    /// The present state.
    pub fn state(&self) -> CompanionState {
        CompanionState(self.begins(), self.simulation.state().clone())
    }

    /// Restores a state, or the start if there is none. Returns false if the state is that of another companion.
    pub fn restore(&mut self, state: Option<&CompanionState>) -> bool {
        let own = state.filter(|state| state.0 == self.begins());
        self.simulation.restore(own.map_or(&self.states[0], |state| &state.1));
        self.stopped = None;
        own.is_some()
    }

    /// Stores the present state to go back to, if the last one is old enough.
    pub fn save_state(&mut self) {
        let newest = self.states.last().map_or(f64::NEG_INFINITY, State::time);
        if self.simulation.time() < newest + self.apart {
            return;
        }
        if self.states.len() == MOST_STATES {
            drop_every_second(&mut self.states);
            self.apart *= 2.0;
        }
        self.states.push(self.simulation.state().clone());
    }

    /// Restores the latest of the stored states at or before `time`, s.
    pub fn go_back(&mut self, time: f64) {
        let known = self.states.partition_point(|state| state.time() <= time);
        self.simulation.restore(&self.states[known.max(1) - 1]);
        self.stopped = None;
    }

    /// Drops the states after `time`, s, and goes back if it is ahead of it.
    pub fn forget_after(&mut self, time: f64) {
        self.states.retain(|state| state.time() <= time);
        if self.simulation.time() > time {
            self.go_back(time);
        }
    }
}
