//! Contact memory and continuous-time peaks of the step just accepted.

use super::search::NEAR_PEAK;
use super::{Simulation, State};
use crate::contact::{Coefficients, Memory};
use crate::scene::least_impact_steps;
use crate::simulate::peaks::PenetrationCubic;

/// What the end of a step changed in the contact memory.
#[derive(Clone, Copy)]
pub(super) struct Switched {
    /// A contact began or ended.
    pub contacts: bool,
    /// The force at the step's end changes with the approach speed just found.
    pub forces: bool,
}

impl State {
    /// Records a step of contact `j`, from fraction `from` on, with the largest normal force `force` (N).
    fn follow(
        &mut self,
        j: usize,
        course: &PenetrationCubic,
        c: &Coefficients,
        force: f64,
        memory: &Memory,
        from: f64,
    ) {
        let (damping, theta) = course.most_damped(c, memory, from);
        self.record.impacts.follow(j, course, force, damping);
        if damping > self.record.statistics.damping[j] {
            self.record.statistics.damping[j] = damping;
            self.record.statistics.damping_time[j] = self.before.t + theta * (self.now.t - self.before.t);
        }
    }
}

impl Simulation {
    /// Starts and ends contacts whose penetration changed sign over the step just accepted.
    pub(super) fn switch_contacts(&mut self, h: f64) -> Switched {
        let located = self.attempt.located.take();
        let fixed = !self.locates();
        let Self { mechanism, running, state, attempt, .. } = self;
        let strongest = &attempt.strongest;
        let least = least_impact_steps(running.solver.method);
        let mut switched = Switched { contacts: false, forces: false };
        for j in 0..state.now.gaps.len() {
            if !mechanism.contacts.has_clearance(j) {
                continue;
            }
            let (start, end) = (state.before.gaps[j], state.now.gaps[j]);
            let coefficients = mechanism.contacts.coefficients(j);
            if state.now.memory[j].active {
                let course = PenetrationCubic::new(start, end, h);
                let memory = state.now.memory[j].unsplit();
                state.follow(j, &course, coefficients, strongest[j].0, &memory, 0.0);
            }
            // A located switch ends within rounding of the wall, on either side; but the repeated step may show that a ball
            // about to separate turned around before.
            let turned = state.now.memory[j].active && end.penetration > 0.0 && end.rate > 0.0;
            let touching =
                if located == Some(j) { !state.now.memory[j].active || turned } else { end.penetration > 0.0 };
            state.record.contact_steps[j] += 1;
            if touching == state.now.memory[j].active {
                if touching {
                    let fastest = || PenetrationCubic::new(start, end, h).fastest(0.0).0;
                    let memory = &mut state.now.memory[j];
                    switched.forces |= memory.rise(coefficients, end.rate, fastest);
                }
                continue;
            }
            switched.contacts = true;
            switched.forces |= fixed;
            let steps = std::mem::replace(&mut state.record.contact_steps[j], 0);
            if touching {
                let course = PenetrationCubic::new(start, end, h);
                let crosses = start.penetration < 0.0 && end.penetration > 0.0;
                let theta = if crosses { course.crossing() } else { 1.0 };
                let rate = if crosses { course.at(theta).1 } else { end.rate };
                let time = state.before.t + theta * h;
                let asked = running.ball_joints[j].contact.restitution;
                let among_others = state.now.memory.iter().any(|m| m.active);
                state.record.impacts.begin(j, time, rate, asked, coefficients, among_others);
                let mut memory = Memory::begun(coefficients, rate);
                // A located contact begins where the step ends.
                if fixed {
                    memory.rise(coefficients, end.rate, || course.fastest(theta).0);
                    let (force, _) = course.strongest(coefficients, &memory);
                    state.follow(j, &course, coefficients, force, &memory, theta);
                }
                state.now.memory[j] = memory;
                state.record.statistics.impacts[j] += 1;
                state.record.statistics.floored[j] += u64::from(memory.floored);
                state.record.peaks[j].impacts += 1;
                state.record.peaks[j].approach_speed = state.record.peaks[j].approach_speed.max(rate);
                state.control.contact_began = true;
                state.control.h_next = state.control.h_next.min(state.control.h_contact);
            } else {
                let crosses = start.penetration > 0.0 && end.penetration < 0.0;
                let (time, rate) = if crosses && located != Some(j) {
                    let course = PenetrationCubic::new(start, end, h);
                    let theta = course.crossing();
                    (state.before.t + theta * h, course.at(theta).1)
                } else {
                    (state.now.t, end.rate)
                };
                state.record.impacts.end(j, time, rate);
                let coarse = fixed && steps < least;
                state.record.statistics.coarse[j] += u64::from(coarse);
                state.now.memory[j] = Memory::default();
                state.record.statistics.last_separation[j] = Some(state.now.t);
            }
        }
        switched
    }

    /// Largest contact forces of the step just accepted, in continuous time.
    pub(super) fn track_peaks(&mut self, h: f64) {
        let immediate = !self.locates();
        let Self { mechanism, state, attempt, .. } = self;
        for j in 0..state.now.gaps.len() {
            if !mechanism.contacts.has_clearance(j) {
                continue;
            }
            let (start, end) = (state.before.gaps[j], state.now.gaps[j]);
            let grazes = immediate && start.rate > 0.0 && end.rate < 0.0;
            if start.penetration <= 0.0 && end.penetration <= 0.0 && !grazes {
                continue;
            }
            let coefficients = mechanism.contacts.coefficients(j);
            let course = PenetrationCubic::new(start, end, h);
            let (force, theta) = if state.before.memory[j].active {
                attempt.strongest[j]
            } else if state.now.memory[j].active {
                course.strongest(coefficients, &state.now.memory[j].unsplit())
            } else {
                course.strongest(coefficients, &Memory::passing(coefficients))
            };
            let time = state.before.t + theta * h;
            attempt.near_peak |= force > NEAR_PEAK * state.record.statistics.peak_normal[j];
            if force > state.record.statistics.peak_normal[j] {
                state.record.statistics.peak_normal[j] = force;
                state.record.statistics.peak_time[j] = time;
            }
            if force > state.record.peaks[j].normal {
                let gap = mechanism.contacts.gap(j);
                let peak = &mut state.record.peaks[j];
                peak.normal = force;
                peak.time = time;
                peak.normal_force = gap.separation.normal * -force;
                // Friction follows the normal force within a step: the ratio at the step's end is used for the peak.
                peak.friction_force =
                    if gap.normal_force > 0.0 { gap.friction * (force / gap.normal_force) } else { gap.friction };
            }
        }
    }
}
