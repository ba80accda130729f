//! Which member of the automatic choice steps: the explicit one through impacts, the implicit one once contacts have settled.

use serde::{Deserialize, Serialize};

use super::{Simulation, shortest_step};
use crate::integrate::{Controller, Method};
use crate::mechanism::{LARGEST_DENSE, Mechanism, MechanismError};
use crate::simulate::stepper::Member;

/// h |lambda| beyond which an explicit step is limited by stability.
pub(super) const STABILITY_LIMIT: f64 = 3.0;
/// Steps that must be limited by stability, or taken since the latest contact began, before the implicit method is tried.
const LIMITED_STEPS: u32 = 8;
/// Steps that must be limited by stability before friction is tried as the cause.
const LIMITED_BEFORE_FRICTION: u32 = 2;
const SETTLED_STEPS: u32 = 60;
/// Over this many implicit steps, or those until something strikes, the progress per cost must be this many times that of the
/// explicit methods before; otherwise these get steps for this many times the cost of the trial, twice as many after each
/// consecutive failed trial, at most so many times.
const TRIAL_STEPS: u32 = 24;
/// The first of them, in which the step still grows, do not count once there are as many.
const GROWING_STEPS: u32 = 4;
const WORTH_IT: f64 = 0.7;
/// How much of the progress and cost of the explicit methods counts a step later.
const KEPT: f64 = 0.95;
const EXPLICIT_TURN: f64 = 2.5;
const MOST_DOUBLINGS: u32 = 3;
/// Cost of a step beside evaluations and algebra (events, peaks, energies), and of an explicit step in all, in evaluations.
const STEP_COST: f64 = 6.0;
const EXPLICIT_COST: f64 = STEP_COST + 6.0;

/// State of the automatic pair.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Choice {
    /// Explicit steps since the latest contact began, and how many of them were limited by stability.
    pub(super) since_contact: u32,
    pub(super) limited: u32,
    /// Explicit steps before the implicit method may be tried again.
    pub(super) wait: u32,
    /// Explicit step size at the latest switch to the implicit method, s.
    pub(super) h_explicit: f64,
    /// Time and cost, in evaluations, of the latest explicit steps.
    pub(super) explicit_progress: f64,
    pub(super) explicit_cost: f64,
    /// Time and cost, in evaluations, of the implicit steps on trial.
    pub(super) progress: f64,
    pub(super) cost: f64,
    pub(super) steps: u32,
    /// Consecutive failed trials.
    pub(super) failures: u32,
}

impl Choice {
    /// Ends the trial of the implicit method; whether it failed.
    fn judge(&mut self) -> bool {
        let explicit = self.explicit_progress / self.explicit_cost;
        let fails = self.progress < WORTH_IT * explicit * self.cost;
        if fails {
            let turn = EXPLICIT_TURN * self.cost / EXPLICIT_COST;
            self.wait = (turn as u32) << self.failures.min(MOST_DOUBLINGS);
            self.failures += 1;
        } else {
            self.failures = 0;
        }
        (self.progress, self.cost, self.steps) = (0.0, 0.0, 0);
        fails
    }
}

impl Simulation {
    /// Which method of the automatic choice takes the next step, after one of size `h` that took so many evaluations.
    pub(super) fn choose_member(&mut self, h: f64, stiffness: f64, evaluations: f64) {
        let before = self.state.control.member;
        let member = self.next_member(h, stiffness, evaluations);
        if member != before {
            self.put_member(member);
        }
    }

    fn put_member(&mut self, member: Member) {
        self.state.control.member = member;
        self.state.control.controller = controller_of(Method::Automatic, member);
        // Corners are located by those that have an interpolant of their own.
        self.hold_pieces(false);
        self.stepper.invalidate();
    }

    /// After an explicit step that blew up: whether friction on its ramp may be the cause, and now steps implicitly.
    pub(super) fn turn_to_friction(&mut self) -> bool {
        let touches = self.state.now.memory.iter().any(|m| m.active);
        let turns = self.running.solver.method == Method::Automatic
            && self.state.control.member == Member::Explicit
            && touches
            && self.mechanism.has_friction_alone();
        if turns {
            self.put_member(Member::Friction);
            self.stepper.choose(Member::Friction);
        }
        turns
    }

    fn next_member(&mut self, h: f64, stiffness: f64, evaluations: f64) -> Member {
        let velocities = self.state.now.y.len() - self.mechanism.positions();
        let factorisations = f64::from(self.attempt.factorisations);
        let state = &mut self.state;
        let member = state.control.member;
        let algebra = match member {
            Member::Explicit => 0.0,
            Member::Friction => self.mechanism.friction_algebra(),
            Member::Implicit => factorisations * self.mechanism.implicit_algebra(),
        };
        let cost = evaluations + algebra + STEP_COST;
        let choice = &mut state.control.choice;
        if member == Member::Implicit {
            choice.progress += h;
            choice.cost += cost;
            choice.steps += 1;
        }
        if state.control.contact_began {
            choice.since_contact = 0;
            choice.limited = 0;
            // An impact is short and not stiff: the explicit method resolves it at less cost.
            let strikes = state.now.memory.iter().any(|m| m.active && !m.floored);
            let leaves = member == Member::Implicit && strikes;
            if leaves {
                choice.judge();
            }
            (choice.explicit_progress, choice.explicit_cost) = (0.0, 0.0);
            return if leaves { Member::Explicit } else { member };
        }
        if member == Member::Implicit {
            if choice.steps == GROWING_STEPS {
                (choice.progress, choice.cost) = (0.0, 0.0);
            }
            if choice.steps >= TRIAL_STEPS && choice.judge() {
                // That step may have been cut at an event to next to nothing.
                state.control.h_next = choice.h_explicit.max(shortest_step(state.now.t));
                return Member::Explicit;
            }
            return member;
        }
        choice.since_contact += 1;
        choice.explicit_progress = KEPT * choice.explicit_progress + h;
        choice.explicit_cost = KEPT * choice.explicit_cost + cost;
        let touches = state.now.memory.iter().any(|m| m.active);
        let mut next = member;
        if member == Member::Friction {
            // It costs more than an explicit step, which must be as much shorter.
            let dearer = 1.0 + algebra / EXPLICIT_COST;
            if self.mechanism.friction_rate() * h < STABILITY_LIMIT * dearer {
                choice.limited = 0;
                next = Member::Explicit;
            } else {
                choice.limited += 1;
            }
        } else {
            choice.limited = if stiffness > STABILITY_LIMIT {
                choice.limited + 1
            } else {
                choice.limited.saturating_sub(1)
            };
            if touches
                && self.mechanism.has_friction_alone()
                && choice.limited >= LIMITED_BEFORE_FRICTION
                && choice.limited < LIMITED_STEPS
            {
                next = Member::Friction;
            }
        }
        if choice.wait > 0 {
            choice.wait -= 1;
            return next;
        }
        let limited =
            choice.limited >= LIMITED_STEPS && (touches || self.mechanism.has_couplings());
        let settled = limited || (touches && choice.since_contact >= SETTLED_STEPS);
        if settled && velocities <= self.mechanism.largest_implicit() {
            *choice = Choice {
                h_explicit: h,
                explicit_progress: choice.explicit_progress,
                explicit_cost: choice.explicit_cost,
                failures: choice.failures,
                ..Choice::default()
            };
            return Member::Implicit;
        }
        next
    }
}

/// Step-size control for the order of the method's error estimate.
pub(super) fn controller_of(method: Method, member: Member) -> Controller {
    Controller::new(match (method, member) {
        (Method::Rosenbrock, _) | (Method::Automatic, Member::Friction) => 2,
        (Method::Radau5, _) | (Method::Automatic, Member::Implicit) => 3,
        _ => 4,
    })
}

/// Allocates what an implicit method needs.
pub(super) fn prepare_implicit(
    mechanism: &mut Mechanism,
    method: Method,
) -> Result<(), MechanismError> {
    let velocities = mechanism.dimension() - mechanism.positions();
    if mechanism.is_kinematic() {
        return Ok(());
    }
    if method == Method::ImexEuler {
        mechanism.prepare_implicit_contacts()?;
    }
    if method.is_implicit() && velocities > LARGEST_DENSE {
        return Err(MechanismError::TooLarge {
            velocities,
            most: LARGEST_DENSE,
        });
    }
    let tries = method == Method::Automatic && velocities <= mechanism.largest_implicit();
    if method.is_implicit() || tries {
        mechanism.prepare_linearisation();
    }
    if method == Method::Automatic {
        // Where they couple too widely, without it.
        let _ = mechanism.prepare_friction();
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    #[test]
    fn a_trial_that_a_strike_ends_is_judged_by_what_it_did() {
        let mut simulation = Simulation::new(&Scene::load("spcmm", &[]).unwrap()).unwrap();
        simulation.advance_to(1.0).unwrap();
        simulation.state.now.memory[0].active = true;
        simulation.state.now.memory[0].floored = false;
        // Progress per cost over that of the explicit steps.
        for (ratio, fails) in [(0.9 * WORTH_IT, true), (1.1 * WORTH_IT, false)] {
            simulation.state.control.member = Member::Implicit;
            simulation.state.control.contact_began = true;
            simulation.state.control.choice = Choice {
                explicit_progress: 1e-3,
                explicit_cost: 1e3,
                progress: ratio * 1e-2,
                cost: 1e4,
                steps: 7,
                failures: 1,
                ..Choice::default()
            };
            simulation.choose_member(1e-9, 0.0, 10.0);
            let control = &simulation.state.control;
            assert_eq!(control.member, Member::Explicit);
            assert_eq!(control.choice.wait > 0, fails, "{ratio}");
            assert_eq!(control.choice.failures, if fails { 2 } else { 0 });
            assert_eq!(control.choice.steps, 0);
        }
    }

    #[test]
    fn a_failed_trial_leaves_a_step_that_advances_time() {
        let mut simulation = Simulation::new(&Scene::load("spcmm", &[]).unwrap()).unwrap();
        simulation.advance_to(1.0).unwrap();
        assert_eq!(simulation.state.control.member, Member::Implicit);
        simulation.state.control.choice = Choice {
            h_explicit: 1e-16,
            explicit_progress: 1.0,
            explicit_cost: 1e-3,
            steps: TRIAL_STEPS - 1,
            ..Choice::default()
        };
        simulation.choose_member(1e-3, 0.0, 10.0);
        let (control, t) = (&simulation.state.control, simulation.state.now.t);
        assert_eq!(control.member, Member::Explicit);
        assert!(t + control.h_next > t);
        assert!(control.h_next >= shortest_step(t));
        simulation.advance_to(1.1).unwrap();
    }
}
