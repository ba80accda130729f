//! Perturbations of the state, for a twin run and its renormalisation.

use super::{Attempt, Control, Run};
use crate::contact::ContactState;

impl Run<'_> {
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
        let turns = self.state.control.member != control.member;
        self.state.control.clone_from(control);
        if turns {
            self.freeze_branches(false);
            self.invalidate();
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::scene::Scene;
    use crate::simulate::Simulation;

    #[test]
    fn a_twin_that_adopts_the_step_control_takes_the_same_steps() {
        let change = ("solver.preset".to_owned(), "preview".to_owned());
        let scene = Scene::load("four-bar", &[change]).expect("loads");
        let mut run = Simulation::new(&scene.machine).expect("starts");
        run.advance_to(0.3).expect("runs");
        let twin = |offset: f64| {
            let mut twin = run.clone();
            twin.displace(&[offset; 8]);
            twin
        };
        let (mut follower, mut alone) = (twin(1e-9), twin(1e-9));
        let before = run.statistics().steps;
        for _ in 0..400 {
            run.step().expect("runs");
            for other in [&mut follower, &mut alone] {
                while other.time() < run.time() {
                    other.step_until(run.time()).expect("runs");
                }
            }
            follower.adopt_step_control(&run);
        }
        // Rounding splits some of the follower's steps in two; a twin that chooses its own is truncated at nearly every one of
        // the run's.
        let steps = |of: &Simulation| of.statistics().steps - before;
        assert!(steps(&follower) < 600, "{}", steps(&follower));
        assert!(steps(&alone) > 800, "{}", steps(&alone));
    }
}
