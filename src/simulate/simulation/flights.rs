//! Bodies in free flight: while nothing touches a free body its motion is known in advance, and the steps that impacts
//! elsewhere need do not evaluate it.

use super::Simulation;
use crate::integrate::{Method, System as _};
use crate::mechanism::{Flight, Touching};

/// With fewer free bodies than this, leaving some out saves less than it costs.
const FEWEST_FLYERS: usize = 3;

impl Simulation {
    /// Decides before a step which bodies it leaves out: free ones that touch nothing and whose flight is known until well
    /// after it.
    pub(super) fn choose_flights(&mut self, limit: f64) {
        let flyers = self.mechanism.flyers().len();
        if self.running.solver.method != Method::Automatic || flyers < FEWEST_FLYERS {
            return;
        }
        let (mut lands, mut starts) = (false, false);
        let Self {
            mechanism, state, ..
        } = self;
        let now = &mut state.now;
        let longest = super::LONGEST_STEP;
        let until = limit.min(now.t + state.control.h_next.min(longest));
        for (flyer, flight) in mechanism.flyers().iter().zip(&mut state.flights) {
            let held = state.pull.is_some_and(|pull| pull.body == flyer.body);
            let touches = flyer.joints.iter().any(|&j| now.memory[j].active);
            if held || touches {
                lands |= flight.take().is_some();
                continue;
            }
            if flight
                .as_ref()
                .is_some_and(|flight| flight.lasts_until(until))
            {
                continue;
            }
            let flies = flight.is_some();
            let next = mechanism.flight(flyer, now.t, &now.y);
            *flight = next.lasts_until(until).then_some(next);
            if flight.is_some() {
                for part in flyer.parts() {
                    now.k[part].fill(0.0);
                }
                starts |= !flies;
            } else {
                lands |= flies;
            }
        }
        if !lands && !starts {
            return;
        }
        self.leave_out_flights();
        self.stepper.invalidate();
        if lands {
            let located = self.locates();
            let Self {
                mechanism, state, ..
            } = self;
            let super::StepEnd {
                t, y, k, memory, ..
            } = &mut state.now;
            let mut evaluator = mechanism.evaluator(Touching::by(located, memory));
            evaluator.derivative(*t, y, k);
            let counts = evaluator.counts;
            state.record.statistics.count(counts);
        }
    }

    /// Lets evaluations leave out what flies.
    pub(super) fn leave_out_flights(&mut self) {
        let flights = &self.state.flights;
        self.mechanism
            .put_to_sleep(|flyer| flights[flyer].is_some());
    }

    pub(super) fn any_flight(&self) -> bool {
        self.state.flights.iter().any(Option::is_some)
    }

    /// Lets nothing fly any more: the state is no longer the one that the flights continue.
    pub(super) fn end_flights(&mut self) {
        self.look_at_all();
        self.state.flights.fill(None);
    }

    /// Lets evaluations look at everything, for reading the mechanism; [`Self::leave_out_flights`] goes back.
    pub(super) fn look_at_all(&mut self) {
        if self.any_flight() {
            self.mechanism.put_to_sleep(|_| false);
        }
    }
}

/// Writes the bodies in flight at `t` to the state `y`.
pub(super) fn put_flights(
    mechanism: &crate::mechanism::Mechanism,
    flights: &[Option<Flight>],
    t: f64,
    y: &mut [f64],
) {
    for (flyer, flight) in mechanism.flyers().iter().zip(flights) {
        if let Some(flight) = flight {
            flight.put(flyer, t, y);
        }
    }
}
