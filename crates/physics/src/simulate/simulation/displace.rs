//! Perturbations of the state, for a twin run and its renormalisation.

use super::{Attempt, Control, Stepping};
use crate::contact::ContactState;

impl Stepping<'_> {
    /// As [`Simulation::displace`](crate::simulate::Simulation::displace).
    pub(in crate::simulate) fn displace(&mut self, offset: &[f64]) {
        let Self { mechanism, state, .. } = self;
        for (y, offset) in state.now.y.iter_mut().zip(offset) {
            *y += offset;
        }
        // Normalising a unit quaternion may round it to another.
        if offset.iter().any(|&offset| offset != 0.0) {
            mechanism.project(state.now.t, &mut state.now.y);
        }
        mechanism.measure(state.now.t, &state.now.y);
        for j in 0..state.now.contact_states.len() {
            if !mechanism.contacts.has_clearance(j) {
                continue;
            }
            // The offset may cross a corner of the laws.
            state.now.contact_states[j] = state.now.contact_states[j].unfrozen();
            let gap = *mechanism.contacts.gap(j);
            let in_contact = gap.separation.penetration > 0.0;
            if in_contact == state.now.contact_states[j].active {
                continue;
            }
            state.now.contact_states[j] = if in_contact {
                state.control.contact_began = true;
                state.control.h_next = state.control.h_next.min(state.control.h_contact);
                ContactState::at_onset(mechanism.contacts.coefficients(j), gap.separation.rate)
            } else {
                ContactState::default()
            };
        }
        self.state.record.wear = None;
        self.refresh();
        self.record_change();
    }

    /// Lets the next step end where and how the latest step of another run did, of which `attempt` is left.
    pub(in crate::simulate) fn reproduce(&mut self, attempt: &Attempt) {
        self.attempt.step_to_reproduce = attempt.full_step;
    }

    /// Adopts the step control of another run in nearly the same state.
    pub(in crate::simulate) fn adopt_step_control(&mut self, control: &Control) {
        let turns = self.state.control.scheme != control.scheme;
        self.state.control.clone_from(control);
        if turns {
            self.freeze_branches(false);
            self.invalidate();
        }
    }
}
