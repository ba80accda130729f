//! Sampling of an instant within the latest step.

use super::flights::write_flights;
use super::{IdealSource, Stepping};
use crate::integrate::hermite;
use crate::machine::Vec3;
use crate::mechanism::ActiveSet;
use crate::simulate::{Frame, report};

impl Stepping<'_> {
    /// As [`Model::sample`](crate::simulate::Model::sample).
    pub(in crate::simulate) fn sample(&mut self, time: f64, out: &mut Frame) {
        let time = time.clamp(self.before.t, self.state.now.t);
        self.evaluate_at(time);
        let (contact_state, at) = (&*self.scratch_contacts, (time, &*self.scratch_y));
        report::fill(self.mechanism, self.machine, contact_state, at, out);
        out.ledger = self.ledger_of(out);
        match self.model.ideal() {
            IdealSource::ClosedForm => {}
            IdealSource::SelfReference => out.probe_error = Some(Vec3::zeros()),
            IdealSource::Simulated(_) | IdealSource::None(_) => out.probe_error = None,
        }
    }

    /// Evaluates everything at `time` within the latest step, so that the mechanism can be read; not counted as an
    /// evaluation.
    pub(super) fn evaluate_at(&mut self, time: f64) {
        let h = self.state.now.t - self.before.t;
        let inside = h > 0.0 && time < self.state.now.t;
        if inside {
            let theta = (time - self.before.t) / h;
            self.interpolate(theta, h);
        } else {
            self.scratch_y.copy_from_slice(&self.state.now.y);
        }
        let flies = self.include_all_bodies();
        let located = self.locates();
        let Self { mechanism, state, before, scratch_y, scratch_k, scratch_contacts, .. } = self;
        if inside {
            mechanism.project(time, scratch_y);
        }
        let (before, now) = (&before.contact_states, &state.now.contact_states);
        for (j, contact_state) in scratch_contacts.iter_mut().enumerate() {
            // A contact that began within a fixed step has its approach speed from then on.
            let known = !inside || (!located && !before[j].active);
            *contact_state = if known { now[j] } else { before[j] };
        }
        let mut evaluator = mechanism.evaluator(ActiveSet::by(located, scratch_contacts));
        evaluator.evaluate_fully(time, scratch_y, scratch_k);
        if flies {
            self.exclude_flights();
        }
    }

    /// Writes the state at fraction `theta` of the latest step, of size `h`, from the method's interpolant to the scratch state.
    pub(super) fn interpolate(&mut self, theta: f64, h: f64) {
        self.interpolate_stepped(theta, h);
        let (state, time) = (&self.state, self.before.t + theta * h);
        write_flights(self.mechanism, &state.flights, time, self.scratch_y);
    }

    /// The same without the bodies in flight.
    pub(super) fn interpolate_stepped(&mut self, theta: f64, h: f64) {
        let Self { mechanism, stepper, state, before, scratch_y, .. } = self;
        let now = &state.now;
        let (step, end) = (before.step(h), [&*now.y, &now.k]);
        if mechanism.is_kinematic() {
            hermite(0..now.y.len(), theta, step, &now.y, &now.k, scratch_y);
        } else {
            for part in mechanism.active_ranges() {
                stepper.interpolate(part.clone(), theta, step, end, &state.polynomial, scratch_y);
            }
        }
    }
}
