//! Steps of the discrete-gradient method: a number of them while a ball strikes its wall, longer ones otherwise.
//!
//! A step is no longer than
//! - the Hertz time of an impact over `steps_per_impact`, while a ball strikes; over [`SLOW_STEPS`] if it strikes slower than
//!   [`SLOW`], and without regard to its duration below the floor of the approach speed;
//! - the arrival of a ball at its wall, or that part of its Hertz time if it arrives sooner;
//! - a period of the ringing of a ball on its wall ([`RINGING`]), as longer steps alternate instead of following it;
//! - that part of the time in which the film of a joint would be squeezed out ([`SQUEEZED`]);
//! - the step at which forces other than contact forces move the mechanism by [`SMOOTH`] of its scales more or less than the
//!   midpoint rule says, from their change since the step before;
//! - [`LONGEST`].
//!
//! Beyond [`COARSE`] steps per impact the last four shrink, too, so that the motion converges.

use super::{ContactMemory, DiscreteControl, NEARLY, State, StepEnd, Stepping, store_gaps};
use crate::contact::{ContactPhase, ElasticLaw};
use crate::mechanism::{ActiveSet, ContactId, Counts, Mechanism, StepStart};
use crate::simulate::peaks::PenetrationCubic;
use crate::simulate::{StopAdvice, StopFault, Stopped};

/// Steps per impact beyond which all steps shrink.
const COARSE: f64 = 16.0;
/// Longest step, s.
const LONGEST: f64 = 0.4e-3;
/// Shortest step, s, unless an iteration does not converge.
const SHORTEST: f64 = 2e-7;
/// Largest growth from one step to the next, and largest shrinkage for the sake of other forces.
const GROWTH: f64 = 4.0;
const SHRINKAGE: f64 = 0.3;
/// Attempts of one step.
const ATTEMPTS: u32 = 12;
/// Shortest repeated step, relative to the step repeated.
const LEAST_PART: f64 = 0.05;
/// Speed of an impact below which it takes only [`SLOW_STEPS`], m/s: its force is small.
const SLOW: f64 = 3e-3;
/// Steps in a slow impact: the fewest for which a rebound by [`crate::contact::Coefficients::rebound`] is at most that of the law.
const SLOW_STEPS: u32 = 3;
/// Steps per impact below which the ball rebounds by its energy.
const FEW_STEPS: f64 = 8.0;
/// Half periods of ringing in a step.
const RINGING: f64 = 2.0;
/// Largest error of the place of a part in a step, over the thickness of its film.
const MISPLACED: f64 = 0.01;
/// Part of a film that a step squeezes out.
const SQUEEZED: f64 = 0.5;
/// Error of a step due to forces other than contact forces, relative to the scales of the positions.
const SMOOTH: f64 = 3e-8;
/// Scales of the velocities are those of the positions in this time, s.
const SCALE_TIME: f64 = 0.1;

impl DiscreteControl {
    /// At the start.
    pub(super) fn new(mechanism: &Mechanism) -> Self {
        Self { h: 0.0, acceleration: vec![0.0; mechanism.velocities()], smooth: LONGEST }
    }

    /// Records the step just accepted, of size `h`, that ends at `now`; with `finer` times the steps of the coarse ones.
    fn record(&mut self, mechanism: &Mechanism, h: f64, contacts: &mut [ContactMemory], now: &StepEnd, finer: f64) {
        for (c, contact) in contacts.iter_mut().enumerate() {
            let touches = now.contact_states[c].active;
            contact.phase = if touches { contact.phase.after(now.gaps[c].rate) } else { ContactPhase::default() };
            if let Some(found) = mechanism.contact_mobility(c) {
                contact.mobility = found;
            }
        }
        // The midpoint rule errs by h^3 / 12 times the rate at which the acceleration changes.
        let scale = mechanism.scale()[mechanism.velocity_range()].iter();
        let accelerations = self.acceleration.iter_mut().zip(mechanism.contact_free_acceleration());
        let mut error = 0.0_f64;
        for ((old, new), scale) in accelerations.zip(scale) {
            error = error.max((new - *old).abs() / (SCALE_TIME * scale));
            *old = *new;
        }
        error *= h * h * h / (6.0 * (h + self.h));
        let compares = self.h > 0.0 && error > 0.0;
        self.smooth = if compares { h * libm::cbrt(SMOOTH / (finer * finer * error)).max(SHRINKAGE) } else { LONGEST };
        self.h = h;
    }
}

/// Elastic law of contact `c`. Samples leave the mechanism at other instants, so that its own may be another.
fn elastic(state: &State, mechanism: &Mechanism, c: ContactId) -> ElasticLaw {
    let j = mechanism.contacts.joint_of(c);
    ElasticLaw::of_joint(&state.conditions.joints[j], state.clearance(j))
}

/// Longest step in an impact of contact `c` at `speed`, m/s, in s: a part of the Hertz time.
fn step_in_impact(state: &State, mechanism: &Mechanism, c: ContactId, speed: f64) -> f64 {
    let mass = 1.0 / state.contacts[c].mobility;
    let steps = state.conditions.solver.steps_per_impact;
    let steps = if speed > SLOW { steps } else { steps.min(SLOW_STEPS) };
    elastic(state, mechanism, c).impact_duration(0.0, mass, speed) / f64::from(steps)
}

/// Force over elastic force with which each ball rebounds in a step of `h` seconds, for those that need one.
fn set_rebounds(state: &State, mechanism: &Mechanism, h: f64, rebounds: &mut [Option<f64>]) {
    for (c, rebound) in rebounds.iter_mut().enumerate() {
        let gap = state.now.gaps[c];
        let rises = gap.penetration > 0.0 && state.contacts[c].phase == ContactPhase::Restitution;
        let law = mechanism.contacts.coefficients(c);
        let speeds = state.record.impacts.speeds_under_way(c, law.speed_floor);
        // A film takes up energy that the rebound by energy would give back.
        let is_dry = !mechanism.has_film(mechanism.contacts.joint_of(c));
        let Some([approach, separation]) = speeds.filter(|_| rises && is_dry) else {
            *rebound = None;
            continue;
        };
        let mass = 1.0 / state.contacts[c].mobility;
        let few = h * FEW_STEPS > elastic(state, mechanism, c).impact_duration(0.0, mass, approach);
        *rebound = few.then(|| law.rebound(mass, gap.penetration, gap.rate, separation));
    }
}

/// Half a period of the ringing of contact `c` about `penetration`, m, in s.
fn half_period(state: &State, mechanism: &Mechanism, c: ContactId, penetration: f64) -> f64 {
    elastic(state, mechanism, c).half_period_at(penetration, state.contacts[c].mobility)
}

/// Steps of a run over those of the coarse ones, at least 1.
fn finer(state: &State) -> f64 {
    (f64::from(state.conditions.solver.steps_per_impact) / COARSE).max(1.0)
}

/// Size of the next step, s.
pub(super) fn discrete_size(state: &State, mechanism: &Mechanism) -> f64 {
    let control = &state.control.discrete;
    let (longest, periods) = (LONGEST / finer(state), RINGING / finer(state));
    let mut h = longest.min(control.smooth);
    let floor = |c: ContactId| mechanism.contacts.coefficients(c).speed_floor;
    for (c, (gap, contact_state)) in state.now.gaps.iter().zip(&state.now.contact_states).enumerate() {
        if contact_state.active && gap.penetration > 0.0 {
            let lasts = state.contacts[c].phase == ContactPhase::Lasting;
            // A ball at its wall may be struck again.
            let speed = if lasts { gap.rate.abs() } else { contact_state.approach_speed.max(gap.rate.abs()) };
            if speed > SLOW || (speed > floor(c) && !lasts) {
                h = h.min(step_in_impact(state, mechanism, c, speed));
            }
            h = h.min(periods * half_period(state, mechanism, c, gap.penetration));
        } else if gap.rate > floor(c) {
            let arrival = -gap.penetration / gap.rate;
            if arrival < h {
                h = h.min(arrival.max(step_in_impact(state, mechanism, c, gap.rate)));
            }
        }
    }
    for (_, film) in mechanism.films() {
        for c in mechanism.contacts.of_play(film.joint, 0) {
            let gap = state.now.gaps[c];
            if gap.rate > 0.0 {
                h = h.min(SQUEEZED / finer(state) * (film.law.thickness - gap.penetration.min(0.0)) / gap.rate);
            }
        }
    }
    h.min(GROWTH * state.control.h_next).max(SHORTEST)
}

impl Stepping<'_> {
    /// Takes a step that ends no later than `limit`, s.
    pub(super) fn discrete_step(&mut self, limit: f64) -> Result<(), Stopped> {
        self.attempt.counts = Counts::default();
        let t = self.state.now.t;
        let mut h = discrete_size(self.state, self.mechanism);
        let mut all = false;
        for attempt in 1.. {
            let t_end = if t + h >= limit - NEARLY * h { limit } else { t + h };
            let size = t_end - t;
            set_rebounds(self.state, self.mechanism, size, &mut self.attempt.rebounds);
            let (now, rebounds) = (&self.state.now, &self.attempt.rebounds);
            let from = StepStart { t, h: size, y: &now.y, k: &now.k, contact_states: &now.contact_states, rebounds };
            let mut evaluator = self.mechanism.evaluator(ActiveSet::by(false, &now.contact_states));
            let converged = evaluator.discrete_step(&from, all, &mut self.attempt.end.y);
            self.attempt.counts += evaluator.counts;
            let mut open = 0.0;
            let part = if converged {
                open = self.mechanism.project(t_end, &mut self.attempt.end.y);
                self.part_to_repeat(t_end, size, &mut all)
            } else {
                Some(0.5)
            };
            match part {
                Some(part) if attempt < ATTEMPTS => {
                    h = size * part;
                    self.state.record.statistics.rejected += 1;
                }
                _ if !converged => {
                    return Err(self.stopped(StopFault::NoForces { shortest: size }, StopAdvice::OtherMethod));
                }
                _ => {
                    self.accept_closed(t_end, size, open)?;
                    let finer = finer(self.state);
                    let State { now, control, contacts, .. } = &mut *self.state;
                    control.h_next = if t_end == limit { h } else { size };
                    control.discrete.record(self.mechanism, size, contacts, now, finer);
                    return Ok(());
                }
            }
        }
        Ok(())
    }

    /// The part of the step of size `h` just attempted that must be taken in its place, if any: an impact began in it that it
    /// does not resolve. Sets `all` if the step left out a contact that touches.
    fn part_to_repeat(&mut self, t_end: f64, h: f64, all: &mut bool) -> Option<f64> {
        let rounding = self.rounding();
        let Self { mechanism, state, attempt, .. } = self;
        let end = &mut attempt.end;
        mechanism.measure_step_end(t_end, &end.y);
        store_gaps(mechanism, &mut end.gaps);
        let mut part = 1.0_f64;
        for (c, (start, end)) in state.now.gaps.iter().zip(&end.gaps).enumerate() {
            if start.penetration > 0.0 || end.penetration <= 0.0 {
                continue;
            }
            if mechanism.contact_mobility(c).is_none() {
                *all = true;
                return Some(1.0);
            }
            let cubic = PenetrationCubic::new(*start, *end, h, rounding);
            let theta = cubic.crossing();
            let speed = cubic.at(theta).1;
            if speed > mechanism.contacts.coefficients(c).speed_floor {
                let longest = step_in_impact(state, mechanism, c, speed);
                if h - theta * h > longest {
                    part = part.min((theta * h).max(longest) / h);
                }
            }
        }
        let misplacement = mechanism.largest_misplacement() * finer(state);
        if misplacement > MISPLACED {
            part = part.min(MISPLACED / misplacement);
        }
        (part < 1.0).then(|| part.max(LEAST_PART))
    }
}
