//! Contact memory and continuous-time peaks of the step just accepted.

use super::Simulation;
use crate::mechanism::{Memory, Switching};
use crate::simulate::peaks::Course;

impl Simulation {
    /// Starts and ends contacts whose penetration changed sign over the step just accepted.
    pub(super) fn switch_contacts(&mut self, h: f64) -> bool {
        let located = self.located.take();
        let Self {
            mechanism,
            running,
            state,
            peaks,
            ..
        } = self;
        let mut switched = false;
        for j in 0..state.gaps.len() {
            if !mechanism.contacts.has_clearance(j) {
                continue;
            }
            let (start, end) = (state.gaps0[j], state.gaps[j]);
            let coefficients = mechanism.contacts.coefficients(j);
            if state.memory[j].active {
                let course = Course::new(start, end, h);
                state.impacts.follow(j, &course, coefficients);
            }
            // A located switch ends within rounding of the wall, on either side; but the step taken again may show that a
            // ball that was about to separate turned around before.
            let turned = state.memory[j].active && end.penetration > 0.0 && end.rate > 0.0;
            let touching = if located == Some(j) {
                !state.memory[j].active || turned
            } else {
                end.penetration > 0.0
            };
            if touching == state.memory[j].active {
                continue;
            }
            switched = true;
            if touching {
                let course = Course::new(start, end, h);
                let crosses = start.penetration < 0.0 && end.penetration > 0.0;
                let theta = if crosses { course.crossing() } else { 1.0 };
                let rate = if crosses {
                    course.at(theta).1
                } else {
                    end.rate
                };
                let floor = coefficients.speed_floor;
                let time = state.t0 + theta * h;
                let asked = running.ball_joints[j].contact.restitution;
                let touching = state.memory.iter().any(|m| m.active);
                state
                    .impacts
                    .begin(j, time, rate, asked, coefficients, touching);
                // A located one begins where the step ends.
                if mechanism.contacts.switching == Switching::Immediate {
                    state.impacts.follow(j, &course, coefficients);
                }
                state.memory[j] = Memory {
                    active: true,
                    approach_speed: rate.max(floor),
                    floored: rate < floor,
                };
                state.statistics.impacts[j] += 1;
                state.statistics.floored[j] += u64::from(rate < floor);
                peaks[j].impacts += 1;
                peaks[j].approach_speed = peaks[j].approach_speed.max(rate);
                state.contact_began = true;
                state.h_next = state.h_next.min(state.h_contact);
            } else {
                let crosses = start.penetration > 0.0 && end.penetration < 0.0;
                let (time, rate) = if crosses && located != Some(j) {
                    let course = Course::new(start, end, h);
                    let theta = course.crossing();
                    (state.t0 + theta * h, course.at(theta).1)
                } else {
                    (state.t, end.rate)
                };
                state.impacts.end(j, time, rate);
                state.memory[j] = Memory::default();
                state.statistics.last_separation[j] = state.t;
            }
        }
        switched
    }

    /// Largest forces of the step just accepted, in continuous time.
    pub(super) fn track_peaks(&mut self, h: f64) {
        let Self {
            mechanism,
            state,
            peaks,
            ..
        } = self;
        for j in 0..state.gaps.len() {
            if !mechanism.contacts.has_clearance(j) {
                if let Some(reaction) = mechanism.reaction(j) {
                    let force = state.reactions[j].rise(state.t, reaction.norm());
                    if force > state.statistics.peak_normal[j] {
                        state.statistics.peak_normal[j] = force;
                        state.statistics.peak_time[j] = state.t;
                    }
                    if force > peaks[j].normal {
                        peaks[j].normal = force;
                        peaks[j].time = state.t;
                        peaks[j].normal_force = reaction;
                    }
                }
                continue;
            }
            let (start, end) = (state.gaps0[j], state.gaps[j]);
            if start.penetration <= 0.0 && end.penetration <= 0.0 {
                continue;
            }
            let coefficients = mechanism.contacts.coefficients(j);
            let approach = if state.memory0[j].active {
                state.memory0[j].approach_speed
            } else if state.memory[j].active {
                state.memory[j].approach_speed
            } else {
                start.rate.max(end.rate).max(coefficients.speed_floor)
            };
            let (force, theta) = Course::new(start, end, h).strongest(coefficients, approach);
            let time = state.t0 + theta * h;
            if force > state.statistics.peak_normal[j] {
                state.statistics.peak_normal[j] = force;
                state.statistics.peak_time[j] = time;
            }
            if force > peaks[j].normal {
                let gap = &mechanism.contacts.gaps()[j];
                let n = if gap.eccentricity.norm() > 0.0 {
                    gap.eccentricity.normalize()
                } else {
                    gap.eccentricity
                };
                peaks[j].normal = force;
                peaks[j].time = time;
                peaks[j].normal_force = n * -force;
                // Friction follows the normal force within a step: its ratio at the step's end serves for the peak.
                peaks[j].friction_force = if gap.normal_force > 0.0 {
                    gap.friction * (force / gap.normal_force)
                } else {
                    gap.friction
                };
            }
        }
    }
}
