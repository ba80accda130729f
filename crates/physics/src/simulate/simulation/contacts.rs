//! Contact states and continuous-time peaks of the step just accepted.

use super::search::NEAR_PEAK;
use super::{State, Stepping};
use crate::contact::{ContactState, Separation};
use crate::integrate::StepControl;
use crate::machine::MIN_IMPACT_STEPS;
use crate::mechanism::{ContactId, Contacts};
use crate::simulate::Overdamped;
use crate::simulate::impacts::{ImpactEvents, Onset};
use crate::simulate::peaks::PenetrationCubic;

/// Largest penetration, as a fraction of the clearance, of a ball that is at its wall to within rounding.
const AT_WALL: f64 = 1e-9;

/// Push on a ball whose motion before the contact is unknown, m/s^2.
const UNKNOWN_PUSH: f64 = f64::MAX;
/// Time over which the change of a rate says nothing about the push, s: it is rounding error.
const TOO_SHORT_FOR_PUSH: f64 = 1e-9;

/// Changes in the contact state at the end of a step.
#[derive(Clone, Copy)]
pub(super) struct ContactChanges {
    /// A contact began or ended.
    pub contacts: bool,
    /// The force at the step's end changes with the approach speed just found.
    pub forces: bool,
}

impl State {
    /// Records that contact `c` begins at `time` with penetration rate `rate` (m/s), which was changing at `push` (m/s^2);
    /// returns its contact state.
    fn begin(
        &mut self,
        c: ContactId,
        (time, rate, push): (f64, f64, f64),
        contacts: &Contacts,
        events: &mut ImpactEvents,
    ) -> ContactState {
        let j = contacts.joint_of(c);
        let coefficients = contacts.coefficients(c);
        let interacts = |other: ContactId| contacts.interact(c, other);
        let mut active = self.now.contact_states.iter().enumerate().filter(|(_, m)| m.active);
        let among_others = active.any(|(other, _)| interacts(other));
        let place = contacts.place(c);
        let onset = Onset { contact: c, joint: j, place, time, speed: rate, push, among_others };
        self.record.impacts.begin(&onset, coefficients, interacts, events);
        let contact_state = ContactState::at_onset(coefficients, rate);
        self.record.statistics.joints[j].impacts += 1;
        let peak = &mut self.joints[j].peak;
        peak.impacts += 1;
        peak.approach_speed = peak.approach_speed.max(rate);
        self.control.contact_began = true;
        self.control.h_next = self.control.h_next.min(self.control.h_contact);
        contact_state
    }

    /// Ends contact `c`, of joint `j`, at `time`, s, with the penetration rate `rate`, m/s.
    pub(super) fn end(&mut self, (c, j): (ContactId, usize), time: f64, rate: f64) {
        let steps = std::mem::replace(&mut self.contacts[c].steps, 0);
        let coarse = self.conditions.solver.method.control() == StepControl::Fixed && steps < MIN_IMPACT_STEPS;
        let statistics = &mut self.record.statistics.joints[j];
        statistics.coarse += u64::from(coarse);
        statistics.below_speed_floor += u64::from(self.now.contact_states[c].below_speed_floor);
        statistics.last_separation = Some(self.now.t);
        if let Some(impact) = self.record.impacts.end(c, time, rate) {
            let farthest = statistics.excessive_rebound.map_or(0.0, |impact| impact.restitution_excess());
            if impact.restitution_excess() > farthest {
                statistics.excessive_rebound = Some(*impact);
            }
        }
        self.now.contact_states[c] = ContactState::default();
    }

    /// Records a step of contact `c` that began at `start` (s), from fraction `from` on.
    fn record_contact_step(
        &mut self,
        (c, contacts): (ContactId, &Contacts),
        start: f64,
        cubic: &PenetrationCubic,
        contact_state: &ContactState,
        from: f64,
    ) {
        let (j, law) = (contacts.joint_of(c), contacts.coefficients(c));
        let (damping, theta) = cubic.most_damped(law, contact_state, from);
        self.record.impacts.update(c, &law.elastic, cubic, damping);
        let statistics = &mut self.record.statistics.joints[j];
        statistics.damping = statistics.damping.max(damping);
        // Where parts yield, the usual ratio is higher still.
        if damping > law.damping {
            let usual = law.damping_at(contact_state.approach_speed);
            let now = Overdamped { time: start + theta * (self.now.t - start), ratio: damping, usual };
            if now.excess() > statistics.overdamped.excess() {
                statistics.overdamped = now;
            }
        }
    }
}

impl Stepping<'_> {
    /// Initialises the contacts that exist at the start. Their onset is unknown, so the floor serves as approach speed; a ball at
    /// its wall to within rounding begins its contact there, at its current rate.
    pub(super) fn begin_contacts_at_start(&mut self) {
        let Self { mechanism, state, attempt, .. } = self;
        mechanism.measure(state.now.t, &state.now.y);
        for c in 0..state.now.gaps.len() {
            let j = mechanism.contacts.joint_of(c);
            let Separation { penetration, rate, .. } = mechanism.contacts.gap(c).separation;
            let coefficients = mechanism.contacts.coefficients(c);
            if !(penetration > 0.0) {
                continue;
            }
            if penetration <= AT_WALL * mechanism.contacts.clearance(c) && rate > 0.0 {
                state.now.contact_states[c] =
                    state.begin(c, (0.0, rate, UNKNOWN_PUSH), &mechanism.contacts, &mut attempt.events);
            } else {
                state.now.contact_states[c] = ContactState::at_onset(coefficients, f64::NEG_INFINITY);
                state.record.statistics.joints[j].impacts += 1;
            }
        }
    }

    /// Begins the contacts of balls that are exactly at their walls and move into them: the next step would show no sign change.
    /// The force is still 0.
    pub(super) fn begin_contacts_at_walls(&mut self) {
        let Self { mechanism, state, attempt, .. } = self;
        let mut begins = false;
        for c in 0..state.now.gaps.len() {
            let gap = state.now.gaps[c];
            if gap.is_arriving() && !state.now.contact_states[c].active {
                let onset = (state.now.t, gap.rate, UNKNOWN_PUSH);
                state.now.contact_states[c] = state.begin(c, onset, &mechanism.contacts, &mut attempt.events);
                state.contacts[c].steps = 0;
                begins = true;
            }
        }
        if begins {
            self.freeze_branches(false);
        }
    }

    /// Starts and ends contacts whose penetration changed sign over the step just accepted.
    pub(super) fn switch_contacts(&mut self, h: f64) -> ContactChanges {
        let located = self.attempt.located_contact.take();
        let (fixed, rounding) = (!self.locates(), self.rounding());
        let Self { mechanism, state, before, attempt, .. } = self;
        let mut changes = ContactChanges { contacts: false, forces: false };
        // What is as close to its wall as the located ball, which is there but for the error of the step, switches in the same
        // instant.
        let at_wall = located.map_or(0.0, |c| state.now.gaps[c].penetration.abs()) + rounding;
        for c in 0..state.now.gaps.len() {
            let j = mechanism.contacts.joint_of(c);
            let (start, end) = (before.gaps[c], state.now.gaps[c]);
            let coefficients = mechanism.contacts.coefficients(c);
            if state.now.contact_states[c].active {
                let cubic = PenetrationCubic::new(start, end, h, rounding);
                let contact_state = state.now.contact_states[c].unfrozen();
                state.record_contact_step((c, &mechanism.contacts), before.t, &cubic, &contact_state, 0.0);
                let (force, theta) = attempt.peak_forces[c];
                state.record.impacts.raise_peak(c, force, mechanism.contacts.push(c), before.t + theta * h);
            }
            // A located switch ends within rounding of the wall, on either side. The repeated step may still show that a ball
            // about to separate has turned back.
            let active = state.now.contact_states[c].active;
            let turned_back = active && end.penetration > 0.0 && end.rate > 0.0;
            let at_wall = end.penetration.abs() <= at_wall && end.rate != 0.0 && active == (end.rate < 0.0);
            let switches = located.is_some_and(|located| located == c || at_wall);
            let in_contact = if switches { !active || turned_back } else { end.penetration > 0.0 || end.is_arriving() };
            state.contacts[c].steps += 1;
            if in_contact == state.now.contact_states[c].active {
                if in_contact {
                    let fastest = || PenetrationCubic::new(start, end, h, rounding).fastest(0.0).0;
                    let contact_state = &mut state.now.contact_states[c];
                    changes.forces |= contact_state.update_largest_rate(coefficients, end.rate, fastest);
                }
                continue;
            }
            changes.contacts = true;
            changes.forces |= fixed;
            if in_contact {
                state.contacts[c].steps = 0;
                let cubic = PenetrationCubic::new(start, end, h, rounding);
                let crosses = start.penetration <= 0.0 && end.penetration > 0.0;
                let theta = if crosses { cubic.crossing() } else { 1.0 };
                let rate = if crosses { cubic.at(theta).1 } else { end.rate };
                let time = before.t + theta * h;
                let approach_time = theta * h;
                let is_known = approach_time > TOO_SHORT_FOR_PUSH;
                let push = if is_known { (rate - start.rate) / approach_time } else { UNKNOWN_PUSH };
                let mut contact_state = state.begin(c, (time, rate, push), &mechanism.contacts, &mut attempt.events);
                if !fixed && !switches && end.penetration > AT_WALL * mechanism.contacts.clearance(c) {
                    let late = &mut state.record.statistics.joints[j].late;
                    *late = late.max(end.penetration);
                }
                // A located contact begins where the step ends.
                if fixed {
                    contact_state.update_largest_rate(coefficients, end.rate, || cubic.fastest(theta).0);
                    let (force, at) = cubic.strongest(coefficients, &contact_state);
                    state.record_contact_step((c, &mechanism.contacts), before.t, &cubic, &contact_state, theta);
                    state.record.impacts.raise_peak(c, force, mechanism.contacts.push(c), before.t + at * h);
                }
                state.now.contact_states[c] = contact_state;
            } else {
                let crosses = start.penetration > 0.0 && end.penetration < 0.0;
                let (time, rate) = if crosses && !switches {
                    let cubic = PenetrationCubic::new(start, end, h, rounding);
                    let theta = cubic.crossing();
                    (before.t + theta * h, cubic.at(theta).1)
                } else {
                    (state.now.t, end.rate)
                };
                state.end((c, j), time, rate);
            }
        }
        changes
    }

    /// Largest contact forces of the step just accepted, in continuous time.
    pub(super) fn track_peaks(&mut self, h: f64) {
        let (immediate, rounding) = (!self.locates(), self.rounding());
        let Self { mechanism, state, before, attempt, .. } = self;
        for c in 0..state.now.gaps.len() {
            let j = mechanism.contacts.joint_of(c);
            let (start, end) = (before.gaps[c], state.now.gaps[c]);
            let grazes = immediate && start.rate > 0.0 && end.rate < 0.0;
            if start.penetration <= 0.0 && end.penetration <= 0.0 && !grazes {
                continue;
            }
            let coefficients = mechanism.contacts.coefficients(c);
            let cubic = PenetrationCubic::new(start, end, h, rounding);
            let (force, theta) = if before.contact_states[c].active {
                attempt.peak_forces[c]
            } else if state.now.contact_states[c].active {
                cubic.strongest(coefficients, &state.now.contact_states[c].unfrozen())
            } else {
                cubic.strongest(coefficients, &ContactState::within_step(coefficients))
            };
            let time = before.t + theta * h;
            attempt.may_contain_peak |= force > NEAR_PEAK * state.record.statistics.joints[j].peak_normal;
            if force > state.record.statistics.joints[j].peak_normal {
                state.record.statistics.joints[j].peak_normal = force;
                state.record.statistics.joints[j].peak_time = time;
            }
            if force > state.joints[j].peak.normal {
                let peak = &mut state.joints[j].peak;
                peak.normal = force;
                peak.time = time;
                peak.normal_force = mechanism.contacts.push(c) * force;
            }
        }
    }
}
