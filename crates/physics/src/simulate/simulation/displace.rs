//! Perturbations of the state, for a twin run and its renormalisation.

use super::Simulation;
use crate::contact::Memory;
use crate::simulate::Stopped;

impl Simulation {
    /// Adds `offset` to coordinates and velocities (ordered as in [`Self::state`]) and continues from there. Quaternions are
    /// renormalised, ideal joints closed again. A ball moved into its wall is now in contact, a ball lifted off is not; every
    /// other contact retains its memory. Counters are unchanged; a wear map is dropped.
    ///
    /// Components of `offset` beyond the state's are ignored, missing ones are 0.
    pub fn displace(&mut self, offset: &[f64]) {
        let Self { mechanism, state, .. } = self;
        for (y, offset) in state.now.y.iter_mut().zip(offset) {
            *y += offset;
        }
        // Normalising a unit quaternion may round it to another.
        if offset.iter().any(|&offset| offset != 0.0) {
            mechanism.project(state.now.t, &mut state.now.y);
        }
        mechanism.measure(state.now.t, &state.now.y);
        for j in 0..state.now.memory.len() {
            if !mechanism.contacts.has_clearance(j) {
                continue;
            }
            // The offset may cross a corner of the laws.
            state.now.memory[j] = state.now.memory[j].unsplit();
            let gap = *mechanism.contacts.gap(j);
            let touching = gap.separation.penetration > 0.0;
            if touching == state.now.memory[j].active {
                continue;
            }
            state.now.memory[j] = if touching {
                state.control.contact_began = true;
                state.control.h_next = state.control.h_next.min(state.control.h_contact);
                Memory::begun(mechanism.contacts.coefficients(j), gap.separation.rate)
            } else {
                Memory::default()
            };
        }
        self.state.record.wear = None;
        self.refresh();
        self.record_change();
    }

    /// Moves the stored approach speeds of the contacts towards those of `other`, a run in nearly the same state, by the fraction
    /// `part` of their difference.
    pub fn remember_like(&mut self, other: &Self, part: f64) {
        for (own, other) in self.state.now.memory.iter_mut().zip(&other.state.now.memory) {
            own.approach_speed += part * (other.approach_speed - own.approach_speed);
        }
    }

    /// Steps to the time of `other`, a run in nearly the same state, by reproducing its latest step and the way it ended. A step
    /// merely truncated there would have a different error, by about the tolerance.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn step_beside(&mut self, other: &Self) -> Result<(), Stopped> {
        if self.state.now.t == other.step_start() {
            self.attempt.beside = other.attempt.whole;
        }
        while self.state.now.t < other.state.now.t {
            self.step_until(other.state.now.t)?;
        }
        Ok(())
    }

    /// Adopts the step control of `other`, a run in nearly the same state: its step size and its scheme of the automatic method.
    /// Two runs that choose their own have different errors and seem to diverge.
    pub fn step_like(&mut self, other: &Self) {
        let turns = self.state.control.member != other.state.control.member;
        self.state.control.clone_from(&other.state.control);
        if turns {
            self.freeze_branches(false);
            self.stepper.invalidate();
        }
    }

    /// Scale of each component of [`Self::state`]: the error scales of the tolerance.
    pub fn scales(&self) -> &[f64] {
        self.mechanism.scale()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    #[test]
    fn a_twin_that_steps_like_its_run_takes_the_same_steps() {
        let change = ("solver.preset".to_owned(), "preview".to_owned());
        let scene = Scene::load("four-bar", &[change]).expect("loads");
        let mut run = Simulation::new(&scene.machine).expect("starts");
        run.advance_to(0.3).expect("runs");
        let twin = |offset: f64| {
            let mut twin = Simulation::of(&run.snapshot());
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
            follower.step_like(&run);
        }
        // Rounding splits some of the follower's steps in two; a twin that chooses its own is truncated at nearly every one of
        // the run's.
        let steps = |of: &Simulation| of.statistics().steps - before;
        assert!(steps(&follower) < 600, "{}", steps(&follower));
        assert!(steps(&alone) > 800, "{}", steps(&alone));
    }
}
