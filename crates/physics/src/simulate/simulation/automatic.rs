//! Choice of scheme in the automatic method: explicit through impacts, implicit once contacts have settled.

use serde::{Deserialize, Serialize};

use super::{Run, shortest_step};
use crate::integrate::{Controller, Method};
use crate::mechanism::{LARGEST_DENSE, Mechanism, MechanismError};
use crate::simulate::stepper::ActiveScheme;

/// h |lambda| beyond which an explicit step is limited by stability.
pub(super) const STABILITY_LIMIT: f64 = 3.0;
/// Stability-limited steps before the implicit scheme is tried.
const LIMITED_STEPS: u32 = 8;
/// Stability-limited steps before friction is tried as the cause.
const LIMITED_BEFORE_FRICTION: u32 = 2;
/// Steps since the latest contact began before the implicit scheme is tried.
const SETTLED_STEPS: u32 = 60;
/// A scheme passes its trial if its progress per cost is at least `WORTH_IT` times that of the steps before. Otherwise it waits
/// for explicit steps that cost `EXPLICIT_TURN` times as much as the trial; each consecutive failure doubles the wait, up to
/// `MOST_DOUBLINGS` times.
const WORTH_IT: f64 = 0.7;
const EXPLICIT_TURN: f64 = 2.5;
const MOST_DOUBLINGS: u32 = 3;
/// Steps in a trial of the implicit scheme, unless an impact ends it.
const TRIAL_STEPS: u32 = 24;
/// Initial trial steps that do not count once they are complete, because the step size is still growing.
const GROWING_STEPS: u32 = 4;
/// Steps in a trial of the friction scheme, unless friction stops limiting the step size before.
const FRICTION_STEPS: u32 = 8;
/// Tolerance below which the friction scheme is on trial: its lower order may make its steps shorter than explicit ones.
const TRIED_BELOW: f64 = 2e-6;
/// Longest step of the friction scheme times the angular frequency at which a ball rings on its wall: the normal force is
/// explicit, and at loose tolerances longer steps sustain the ringing.
const RINGING: f64 = 1.5;
/// Decay per step of the recorded progress and cost of the explicit schemes.
const KEPT: f64 = 0.95;
/// Cost of a step besides evaluations and algebra (events, peaks, energies), and total cost of an explicit step, in evaluations.
const STEP_COST: f64 = 6.0;
const EXPLICIT_COST: f64 = STEP_COST + 6.0;

/// Steps of a scheme on trial, and the outcome of earlier trials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Trial {
    /// Time, s, cost, in evaluations, and number of its steps.
    progress: f64,
    cost: f64,
    steps: u32,
    /// Consecutive failed trials.
    failures: u32,
    /// Explicit steps before the next trial.
    wait: u32,
}

impl Trial {
    fn add(&mut self, h: f64, cost: f64) {
        self.progress += h;
        self.cost += cost;
        self.steps += 1;
    }

    /// Ends the trial; returns whether it failed against earlier steps with the progress per cost `before`.
    fn conclude_trial(&mut self, before: f64) -> bool {
        let fails = self.progress < WORTH_IT * before * self.cost;
        if fails {
            let turn = EXPLICIT_TURN * self.cost / EXPLICIT_COST;
            self.wait = (turn as u32) << self.failures.min(MOST_DOUBLINGS);
            self.failures += 1;
        } else {
            self.failures = 0;
        }
        self.restart();
        fails
    }

    fn restart(&mut self) {
        (self.progress, self.cost, self.steps) = (0.0, 0.0, 0);
    }
}

/// State of the automatic choice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(in crate::simulate) struct SchemeSelector {
    /// Steps other than implicit ones since the latest contact began, and how many of them were limited by stability.
    since_contact: u32,
    limited: u32,
    /// Explicit step size at the latest switch to the implicit method, s.
    h_explicit: f64,
    /// Time, s, and cost, in evaluations, of the latest steps other than implicit ones.
    explicit_progress: f64,
    explicit_cost: f64,
    /// Trials of the friction scheme and of the implicit one.
    friction: Trial,
    implicit: Trial,
}

impl SchemeSelector {
    /// Progress per cost of the latest steps other than implicit ones.
    fn explicit(&self) -> f64 {
        self.explicit_progress / self.explicit_cost
    }
}

impl Run<'_> {
    /// Starts with the implicit scheme if balls touch from the start and their laws have no damping: explicit steps would sustain
    /// the ringing at a multiple of the tolerance, and implicit ones would then have to resolve it.
    pub(super) fn choose_first_member(&mut self) {
        let Self { mechanism, state, .. } = self;
        let touching = || state.now.contact_states.iter().enumerate().filter(|(_, m)| m.active).map(|(j, _)| j);
        let undamped = |j| mechanism.contacts.coefficients(j).damping == 0.0;
        let velocities = state.now.y.len() - mechanism.positions();
        if state.conditions.solver.method == Method::Automatic
            && velocities <= mechanism.largest_implicit()
            && touching().next().is_some()
            && touching().all(undamped)
            && !mechanism.is_kinematic()
        {
            self.put_member(ActiveScheme::Implicit);
        }
    }

    /// Chooses the scheme of the next step, after one of size `h` that took `evaluations` evaluations.
    pub(super) fn choose_member(&mut self, h: f64, stiffness: f64, evaluations: f64) {
        let before = self.state.control.member;
        if before == ActiveScheme::Friction {
            let longest = RINGING / self.mechanism.friction_ringing();
            let control = &mut self.state.control;
            control.h_next = control.h_next.min(longest);
        }
        let member = self.next_member(h, stiffness, evaluations);
        if member != before {
            self.put_member(member);
        }
    }

    fn put_member(&mut self, member: ActiveScheme) {
        self.state.control.member = member;
        self.state.control.controller = controller_of(Method::Automatic, member);
        // Only schemes with their own interpolant locate corners.
        self.freeze_branches(false);
        self.invalidate();
    }

    /// After an unstable explicit step: switches to the friction scheme if friction on its ramp may be the cause; returns whether
    /// it did so.
    pub(super) fn try_friction_scheme(&mut self) -> bool {
        let touches = self.state.now.contact_states.iter().any(|m| m.active);
        let turns = self.state.conditions.solver.method == Method::Automatic
            && self.state.control.member == ActiveScheme::Explicit
            && self.state.control.choice.friction.wait == 0
            && touches
            && self.mechanism.has_friction_alone();
        if turns {
            self.put_member(ActiveScheme::Friction);
            self.stepper.choose(ActiveScheme::Friction);
        }
        turns
    }

    fn next_member(&mut self, h: f64, stiffness: f64, evaluations: f64) -> ActiveScheme {
        let velocities = self.state.now.y.len() - self.mechanism.positions();
        let factorisations = f64::from(self.attempt.factorisations);
        let tries_friction = self.state.conditions.solver.tolerance < TRIED_BELOW;
        let state = &mut self.state;
        let member = state.control.member;
        let algebra = match member {
            ActiveScheme::Explicit => 0.0,
            ActiveScheme::Friction => self.mechanism.friction_algebra(),
            ActiveScheme::Implicit => factorisations * self.mechanism.implicit_algebra(),
        };
        let cost = evaluations + algebra + STEP_COST;
        let choice = &mut state.control.choice;
        match member {
            ActiveScheme::Explicit => choice.friction.wait = choice.friction.wait.saturating_sub(1),
            ActiveScheme::Friction if tries_friction => choice.friction.add(h, cost),
            ActiveScheme::Friction => {}
            ActiveScheme::Implicit => choice.implicit.add(h, cost),
        }
        if state.control.contact_began {
            choice.since_contact = 0;
            choice.limited = 0;
            // An impact is short and not stiff: the explicit method resolves it at less cost.
            let strikes = state.now.contact_states.iter().any(|m| m.active && !m.floored);
            let leaves = member == ActiveScheme::Implicit && strikes;
            if leaves {
                choice.implicit.conclude_trial(choice.explicit());
            }
            (choice.explicit_progress, choice.explicit_cost) = (0.0, 0.0);
            return if leaves { ActiveScheme::Explicit } else { member };
        }
        if member == ActiveScheme::Implicit {
            let before = choice.explicit();
            let trial = &mut choice.implicit;
            if trial.steps == GROWING_STEPS {
                (trial.progress, trial.cost) = (0.0, 0.0);
            }
            if trial.steps >= TRIAL_STEPS && trial.conclude_trial(before) {
                // An event may have truncated that step to almost nothing.
                state.control.h_next = choice.h_explicit.max(shortest_step(state.now.t));
                return ActiveScheme::Explicit;
            }
            return member;
        }
        choice.since_contact += 1;
        choice.explicit_progress = KEPT * choice.explicit_progress + h;
        choice.explicit_cost = KEPT * choice.explicit_cost + cost;
        let touches = state.now.contact_states.iter().any(|m| m.active);
        let mut next = member;
        if member == ActiveScheme::Friction {
            // A friction step costs more than an explicit one, so it must be longer in proportion.
            let dearer = 1.0 + algebra / EXPLICIT_COST;
            let over = self.mechanism.friction_rate() * h < STABILITY_LIMIT * dearer;
            let ends = over || choice.friction.steps >= FRICTION_STEPS;
            let before = choice.explicit();
            let fails = tries_friction && ends && choice.friction.conclude_trial(before);
            if over || fails {
                choice.limited = 0;
                next = ActiveScheme::Explicit;
            } else {
                choice.limited += 1;
            }
        } else {
            choice.limited =
                if stiffness > STABILITY_LIMIT { choice.limited + 1 } else { choice.limited.saturating_sub(1) };
            if touches
                && choice.friction.wait == 0
                && self.mechanism.has_friction_alone()
                && choice.limited >= LIMITED_BEFORE_FRICTION
                && choice.limited < LIMITED_STEPS
            {
                next = ActiveScheme::Friction;
            }
        }
        if choice.implicit.wait > 0 {
            choice.implicit.wait -= 1;
            return next;
        }
        let limited = choice.limited >= LIMITED_STEPS && (touches || self.mechanism.has_couplings());
        let settled = limited || (touches && choice.since_contact >= SETTLED_STEPS);
        if settled && velocities <= self.mechanism.largest_implicit() {
            (choice.since_contact, choice.limited) = (0, 0);
            choice.h_explicit = h;
            choice.implicit.restart();
            choice.friction.restart();
            return ActiveScheme::Implicit;
        }
        next
    }
}

/// Step-size control for the order of the method's error estimate.
pub(in crate::simulate) fn controller_of(method: Method, member: ActiveScheme) -> Controller {
    Controller::new(match (method, member) {
        (Method::Rosenbrock, _) | (Method::Automatic, ActiveScheme::Friction) => 2,
        (Method::Radau5, _) | (Method::Automatic, ActiveScheme::Implicit) => 3,
        _ => 4,
    })
}

/// Allocates the workspace of an implicit method.
pub(in crate::simulate) fn prepare_implicit(mechanism: &mut Mechanism, method: Method) -> Result<(), MechanismError> {
    let velocities = mechanism.dimension() - mechanism.positions();
    if mechanism.is_kinematic() {
        return Ok(());
    }
    if method == Method::DiscreteGradient {
        mechanism.prepare_discrete_gradient()?;
    }
    if method.is_implicit() && velocities > LARGEST_DENSE {
        return Err(MechanismError::TooLarge { velocities, most: LARGEST_DENSE });
    }
    let tries = method == Method::Automatic && velocities <= mechanism.largest_implicit();
    if method.is_implicit() || tries {
        mechanism.prepare_linearisation();
    }
    if method == Method::Automatic {
        // If contacts couple too widely, the method does without the friction scheme.
        let _ = mechanism.prepare_friction();
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;
    use crate::simulate::Simulation;

    #[test]
    fn a_failed_trial_leaves_a_step_that_advances_time() {
        let mut simulation = Simulation::new(&Scene::load("spcmm", &[]).unwrap().machine).unwrap();
        simulation.advance_to(1.0).unwrap();
        let (model, mut state) = (simulation.model(), simulation.state().clone());
        let mut workspace = model.workspace(&state);
        assert_eq!(state.control.member, ActiveScheme::Implicit);
        state.control.choice = SchemeSelector {
            h_explicit: 1e-16,
            explicit_progress: 1.0,
            explicit_cost: 1e-3,
            implicit: Trial { steps: TRIAL_STEPS - 1, ..Trial::default() },
            ..SchemeSelector::default()
        };
        Run::new(model, &mut state, &mut workspace).choose_member(1e-3, 0.0, 10.0);
        let (control, t) = (&state.control, state.now.t);
        assert_eq!(control.member, ActiveScheme::Explicit);
        assert!(t + control.h_next > t);
        assert!(control.h_next >= shortest_step(t));
        while state.time() < 1.1 {
            model.step(&mut state, &mut workspace).unwrap();
        }
    }
}
