//! Bodies in free flight: while nothing touches a free body, its motion is known in advance, and the steps that resolve impacts
//! elsewhere exclude it.

use super::{LONGEST_STEP, StepEnd, Stepping};
use crate::integrate::{Method, System as _};
use crate::mechanism::{ActiveSet, Flight, Mechanism};

/// With fewer free bodies than this, excluding some saves less than it costs.
const MIN_FREE_BODIES: usize = 3;

impl Stepping<'_> {
    /// Chooses the bodies to exclude from a step that ends by `limit`: those that touch nothing and whose motion is known until
    /// then.
    pub(super) fn choose_flights(&mut self, limit: f64) {
        let free_flight_bodies = self.mechanism.free_flight_bodies().len();
        if self.state.conditions.solver.method != Method::Automatic || free_flight_bodies < MIN_FREE_BODIES {
            return;
        }
        let Self { mechanism, state, .. } = self;
        let now = &mut state.now;
        let until = limit.min(now.t + state.control.h_next.min(LONGEST_STEP));
        let (mut some_land, mut some_start) = (false, false);
        for (free_body, flight) in mechanism.free_flight_bodies().iter().zip(&mut state.flights) {
            let flew = flight.is_some();
            let held = state.pull.is_some_and(|pull| pull.body == free_body.body);
            if held || free_body.joints.iter().any(|&j| now.contact_states[j].active) {
                *flight = None;
                some_land |= flew;
                continue;
            }
            if flight.as_ref().is_some_and(|f| f.is_valid_at(until)) {
                continue;
            }
            let next = mechanism.flight(free_body, now.t, &now.y);
            *flight = next.is_valid_at(until).then_some(next);
            let flies = flight.is_some();
            some_start |= flies && !flew;
            some_land |= flew && !flies;
        }
        if !some_land && !some_start {
            return;
        }
        clear_flights(mechanism, &state.flights, &mut state.now.k);
        self.exclude_flights();
        self.invalidate();
        if some_land {
            // The derivative of a body that landed is still that of its flight.
            let located = self.locates();
            let Self { mechanism, state, .. } = self;
            let StepEnd { t, y, k, contact_states, .. } = &mut state.now;
            let mut evaluator = mechanism.evaluator(ActiveSet::by(located, contact_states));
            evaluator.derivative(*t, y, k);
            let counts = evaluator.counts;
            state.record.statistics.count(counts);
        }
    }

    /// Excludes bodies in flight from evaluations.
    pub(super) fn exclude_flights(&mut self) {
        let flights = &self.state.flights;
        self.mechanism.suspend(|free_body| flights[free_body].is_some());
    }

    /// Includes all bodies in evaluations until `exclude_flights`; returns whether any is in flight.
    pub(super) fn include_all_bodies(&mut self) -> bool {
        let any = self.state.flights.iter().any(Option::is_some);
        if any {
            self.mechanism.suspend(|_| false);
        }
        any
    }

    /// After a failed step: discards the previous step, because samples within it would miss the flights that ended with the
    /// failed step.
    pub(super) fn discard_step_with_flights(&mut self) {
        if self.state.flights.iter().any(Option::is_some) {
            self.discard_previous_step();
        }
    }

    /// Ends all flights, because the state from which they continue has changed.
    pub(super) fn end_flights(&mut self) {
        self.include_all_bodies();
        self.state.flights.fill(None);
    }
}

/// Writes 0 to the components of bodies in flight.
pub(super) fn clear_flights(mechanism: &Mechanism, flights: &[Option<Flight>], k: &mut [f64]) {
    for (free_body, flight) in mechanism.free_flight_bodies().iter().zip(flights) {
        if flight.is_some() {
            for part in free_body.parts() {
                k[part].fill(0.0);
            }
        }
    }
}

/// Writes the motion of bodies in flight at `t` to the state `y`.
pub(super) fn write_flights(mechanism: &Mechanism, flights: &[Option<Flight>], t: f64, y: &mut [f64]) {
    for (free_body, flight) in mechanism.free_flight_bodies().iter().zip(flights) {
        if let Some(flight) = flight {
            flight.write_state(free_body, t, y);
        }
    }
}
