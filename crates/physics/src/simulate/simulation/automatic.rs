//! Choice of scheme in the automatic method: explicit through impacts, implicit once contacts have settled.

use serde::{Deserialize, Serialize};

use super::{Stepping, shortest_step};
use crate::integrate::{Controller, Method};
use crate::mechanism::{MAX_DENSE, Mechanism, MechanismError};
use crate::simulate::stepper::ActiveScheme;

/// h |lambda| beyond which an explicit step is limited by stability.
pub(super) const STABILITY_LIMIT: f64 = 3.0;
/// Stability-limited steps before the implicit scheme is tried.
const LIMITED_STEPS: u32 = 8;
/// Steps since the latest contact began before the implicit scheme is tried.
const SETTLED_STEPS: u32 = 60;
/// The implicit scheme passes its trial if its progress per cost is at least `MIN_PROGRESS` times that of the steps before.
/// Otherwise it waits for explicit steps that cost `WAIT_FACTOR` times as much as the trial; each consecutive failure doubles the
/// wait, up to `MAX_DOUBLINGS` times.
const MIN_PROGRESS: f64 = 0.7;
const WAIT_FACTOR: f64 = 2.5;
const MAX_DOUBLINGS: u32 = 3;
/// Steps in a trial of the implicit scheme, unless an impact ends it.
const TRIAL_STEPS: u32 = 24;
/// Initial trial steps that do not count once they are complete, because the step size is still growing.
const GROWING_STEPS: u32 = 4;
/// Decay per step of the recorded progress and cost of the explicit scheme.
const DECAY: f64 = 0.95;
/// Cost of a step besides evaluations and algebra (events, peaks, energies), and total cost of an explicit step, in evaluations.
pub(super) const STEP_COST: f64 = 6.0;
const EXPLICIT_COST: f64 = STEP_COST + 6.0;

/// Steps of the implicit scheme on trial, and the outcome of earlier trials.
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
    fn conclude(&mut self, before: f64) -> bool {
        let fails = self.progress < MIN_PROGRESS * before * self.cost;
        if fails {
            let turn = WAIT_FACTOR * self.cost / EXPLICIT_COST;
            self.wait = (turn as u32) << self.failures.min(MAX_DOUBLINGS);
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
    /// Explicit steps since the latest contact began, and how many of them were limited by stability.
    since_contact: u32,
    limited: u32,
    /// Explicit step size at the latest switch to the implicit method, s.
    h_explicit: f64,
    /// Time, s, and cost, in evaluations, of the latest explicit steps.
    explicit_progress: f64,
    explicit_cost: f64,
    implicit: Trial,
}

impl SchemeSelector {
    /// Progress per cost of the latest explicit steps.
    fn explicit(&self) -> f64 {
        self.explicit_progress / self.explicit_cost
    }
}

impl Stepping<'_> {
    /// Starts with the implicit scheme if balls touch from the start and their laws have no damping: explicit steps would sustain
    /// the ringing at a multiple of the tolerance, and implicit ones would then have to resolve it. Or if a film is too stiff for the first
    /// explicit step.
    pub(super) fn choose_first_scheme(&mut self) {
        let Self { mechanism, state, .. } = self;
        let touching = || state.now.contact_states.iter().enumerate().filter(|(_, m)| m.active).map(|(c, _)| c);
        let undamped = |c| mechanism.contacts.coefficients(c).damping == 0.0;
        let velocities = mechanism.velocities();
        let rings = touching().next().is_some() && touching().all(undamped);
        let is_stiff = mechanism.fastest_film() * state.control.h_next > STABILITY_LIMIT;
        if state.conditions.solver.method == Method::Automatic
            && velocities <= mechanism.largest_implicit()
            && (rings || is_stiff)
            && !mechanism.is_kinematic()
        {
            self.set_scheme(ActiveScheme::Implicit);
        }
    }

    /// Chooses the scheme of the next step, after one of size `h` that took `evaluations` evaluations.
    pub(super) fn choose_scheme(&mut self, h: f64, stiffness: f64, evaluations: f64) {
        let scheme = self.next_scheme(h, stiffness, evaluations);
        if scheme != self.state.control.scheme {
            self.set_scheme(scheme);
        }
    }

    fn set_scheme(&mut self, scheme: ActiveScheme) {
        self.state.control.scheme = scheme;
        self.state.control.controller = controller_of(Method::Automatic, scheme);
        self.invalidate();
    }

    fn next_scheme(&mut self, h: f64, stiffness: f64, evaluations: f64) -> ActiveScheme {
        let velocities = self.mechanism.velocities();
        let factorisations = f64::from(self.attempt.factorisations);
        let state = &mut self.state;
        let scheme = state.control.scheme;
        let algebra = match scheme {
            ActiveScheme::Explicit => 0.0,
            ActiveScheme::Implicit => factorisations * self.mechanism.implicit_algebra(),
        };
        let cost = evaluations + algebra + STEP_COST;
        let selector = &mut state.control.selector;
        if scheme == ActiveScheme::Implicit {
            selector.implicit.add(h, cost);
        }
        if state.control.contact_began {
            selector.since_contact = 0;
            selector.limited = 0;
            // An impact is short and not stiff: the explicit method resolves it at less cost.
            let strikes = state.now.contact_states.iter().any(|m| m.active && !m.below_speed_floor);
            let leaves = scheme == ActiveScheme::Implicit && strikes;
            if leaves {
                selector.implicit.conclude(selector.explicit());
            }
            (selector.explicit_progress, selector.explicit_cost) = (0.0, 0.0);
            return if leaves { ActiveScheme::Explicit } else { scheme };
        }
        if scheme == ActiveScheme::Implicit {
            let before = selector.explicit();
            let trial = &mut selector.implicit;
            if trial.steps == GROWING_STEPS {
                (trial.progress, trial.cost) = (0.0, 0.0);
            }
            if trial.steps >= TRIAL_STEPS && trial.conclude(before) {
                // An event may have truncated that step to almost nothing.
                state.control.h_next = selector.h_explicit.max(shortest_step(state.now.t));
                return ActiveScheme::Explicit;
            }
            return scheme;
        }
        selector.since_contact += 1;
        selector.explicit_progress = DECAY * selector.explicit_progress + h;
        selector.explicit_cost = DECAY * selector.explicit_cost + cost;
        selector.limited =
            if stiffness > STABILITY_LIMIT { selector.limited + 1 } else { selector.limited.saturating_sub(1) };
        if selector.implicit.wait > 0 {
            selector.implicit.wait -= 1;
            return scheme;
        }
        let touches = state.now.contact_states.iter().any(|m| m.active);
        let limited = selector.limited >= LIMITED_STEPS && (touches || self.mechanism.has_couplings());
        let is_damped = touches || self.mechanism.films().next().is_some();
        let settled = limited || (is_damped && selector.since_contact >= SETTLED_STEPS);
        if settled && velocities <= self.mechanism.largest_implicit() {
            (selector.since_contact, selector.limited) = (0, 0);
            selector.h_explicit = h;
            selector.implicit.restart();
            return ActiveScheme::Implicit;
        }
        scheme
    }
}

/// Step-size control for the order of the method's error estimate.
pub(in crate::simulate) fn controller_of(method: Method, scheme: ActiveScheme) -> Controller {
    Controller::new(match (method, scheme) {
        (Method::Radau5, _) | (Method::Automatic, ActiveScheme::Implicit) => 3,
        _ => 4,
    })
}

/// Allocates the workspace of an implicit method.
pub(in crate::simulate) fn prepare_implicit(mechanism: &mut Mechanism, method: Method) -> Result<(), MechanismError> {
    let velocities = mechanism.velocities();
    if mechanism.is_kinematic() {
        return Ok(());
    }
    if method == Method::DiscreteGradient {
        mechanism.prepare_discrete_gradient()?;
    }
    if method.is_implicit() && velocities > MAX_DENSE {
        return Err(MechanismError::TooLarge { velocities, most: MAX_DENSE });
    }
    let tries = method == Method::Automatic && velocities <= mechanism.largest_implicit();
    if method.is_implicit() || tries {
        mechanism.prepare_linearisation();
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::{Attachment, Body, Joint, LooseJoint, Machine, Mat3, Vec3};
    use crate::simulate::Simulation;

    #[test]
    fn a_failed_trial_leaves_a_step_that_advances_time() {
        let mut machine = Machine { gravity: Vec3::new(0.0, 0.0, -9.81), ..Machine::default() };
        let bob = machine.add_body(Body::new("bob", 0.4, Mat3::identity() * 1e-3), Joint::free(0));
        let [socket, ball] = [Attachment::world(Vec3::zeros()), Attachment::on(bob, Vec3::zeros())];
        machine.loose_joints.push(LooseJoint::ball("S1", socket, ball).with_clearance(0.2e-3));
        let mut simulation = Simulation::new(&machine).unwrap();
        simulation.advance_to(1.0).unwrap();
        let (model, mut state) = (simulation.model(), simulation.state().clone());
        let mut workspace = model.workspace(&state);
        assert_eq!(state.control.scheme, ActiveScheme::Implicit);
        state.control.selector = SchemeSelector {
            h_explicit: 1e-16,
            explicit_progress: 1.0,
            explicit_cost: 1e-3,
            implicit: Trial { steps: TRIAL_STEPS - 1, ..Trial::default() },
            ..SchemeSelector::default()
        };
        Stepping::new(model, &mut state, &mut workspace).choose_scheme(1e-3, 0.0, 10.0);
        let (control, t) = (&state.control, state.now.t);
        assert_eq!(control.scheme, ActiveScheme::Explicit);
        assert!(t + control.h_next > t);
        assert!(control.h_next >= shortest_step(t));
        while state.time() < 1.1 {
            model.step(&mut state, &mut workspace).unwrap();
        }
    }
}
