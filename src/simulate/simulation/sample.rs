//! Everything at an instant within the latest step.

use super::Simulation;
use crate::integrate::hermite;
use crate::mechanism::Switching;
use crate::simulate::ideal::Reference;
use crate::simulate::{Frame, report};

impl Simulation {
    /// Largest normal force of ball joint `j` (reaction, where it is ideal) since the last reset and when, (N, s): that of
    /// [`Statistics`](crate::simulate::Statistics), which is found from the ends of steps, or a larger one that a sample met.
    pub fn peak(&self, j: usize) -> (f64, f64) {
        let statistics = self.statistics();
        let found = (statistics.peak_normal[j], statistics.peak_time[j]);
        if self.sampled[j].0 > found.0 {
            self.sampled[j]
        } else {
            found
        }
    }

    /// Everything at `time`, interpolated within the latest step; forces come from the interpolated state.
    /// Allocates only while `out` is too small.
    pub fn sample(&mut self, time: f64, out: &mut Frame) {
        let time = time.clamp(self.state.t0, self.state.t);
        self.look(time);
        report::fill(&mut self.mechanism, &self.running, time, out);
        for (sampled, report) in self.sampled.iter_mut().zip(&out.joints) {
            let force = report.normal_force.norm();
            if force > sampled.0 {
                *sampled = (force, time);
            }
        }
        out.ledger = self.ledger_of(out);
        if !matches!(self.reference, Reference::Elsewhere) {
            out.probe_error = self.reference.error(out);
        }
    }

    /// Evaluates everything at `time` within the latest step, for the mechanism to be read; counts as no evaluation.
    pub(super) fn look(&mut self, time: f64) {
        let h = self.state.t - self.state.t0;
        let inside = h > 0.0 && time < self.state.t;
        if inside {
            let theta = (time - self.state.t0) / h;
            self.interpolate(theta, h);
        } else {
            self.scratch_y.copy_from_slice(&self.state.y);
        }
        let Self {
            mechanism,
            state,
            scratch_y,
            scratch_k,
            scratch_memory,
            ..
        } = self;
        let counts = (mechanism.evaluations, mechanism.contacts.evaluations);
        if inside {
            mechanism.project(time, scratch_y);
        }
        // A contact that began within a fixed step has its approach speed from there on.
        let immediate = mechanism.contacts.switching == Switching::Immediate;
        for (j, memory) in scratch_memory.iter_mut().enumerate() {
            let known = !inside || (immediate && !state.memory0[j].active);
            *memory = if known {
                state.memory[j]
            } else {
                state.memory0[j]
            };
        }
        mechanism
            .contacts
            .memory_mut()
            .copy_from_slice(scratch_memory);
        mechanism.evaluate_fully(time, scratch_y, scratch_k);
        (mechanism.evaluations, mechanism.contacts.evaluations) = counts;
    }

    /// State at the part `theta` of the latest step, of size `h`, into the scratch state, as the method interpolates it.
    pub(super) fn interpolate(&mut self, theta: f64, h: f64) {
        let Self {
            mechanism,
            stepper,
            state,
            scratch_y,
            ..
        } = self;
        let (y0, k0, y, k) = (&state.y0, &state.k0, &state.y, &state.k);
        if mechanism.is_kinematic() {
            hermite(theta, h, y0, k0, y, k, scratch_y);
        } else {
            stepper.interpolate(theta, h, y0, k0, y, k, scratch_y);
        }
    }
}
