//! Parameters changed while the simulation runs.

use super::automatic::{SchemeSelector, controller_of, prepare_implicit};
use super::workspace::sync_parameters;
use super::{CLEARANCE_SPEED, Stepping};
use crate::contact::ContactState;
use crate::integrate::Polynomial;
use crate::jet::Jet;
use crate::machine::{
    AppliedForces, ControlFault, Drive, Element, ElementKind, ElementNumber, LiveElements, LooseJoint, Machine,
};
use crate::mechanism::{ContactId, MechanismError, Pull, Ramp, law_of};
use crate::simulate::Effect;
use crate::simulate::stepper::{ActiveScheme, AnyStepper};

/// Largest distance of a hand, or of the point it holds, m: beyond it a pull makes no sense.
const MAX_HAND_DISTANCE: f64 = 1e6;

/// Why a running simulation was not changed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ChangeError {
    /// A method that the equations do not allow, or no longer with these forces.
    #[error("solver.method: {0}")]
    Method(#[from] MechanismError),
    /// A number of an element that cannot be set.
    #[error(transparent)]
    Control(#[from] ControlFault),
    /// A pull on a body that does not exist.
    #[error("body {body} is pulled, of {bodies} (counted from 0)")]
    NoBody {
        /// Index.
        body: usize,
        /// Number of bodies.
        bodies: usize,
    },
    /// A hand, or the point that it holds, out of reach.
    #[error("a hand, or the point that it holds, is {far:e} m away; allowed at most {MAX_HAND_DISTANCE} m")]
    TooFar {
        /// m.
        far: f64,
    },
}

/// As [`Simulation::check_pull`](crate::simulate::Simulation::check_pull), for a pull on a body of `machine`.
pub(in crate::simulate) fn check_pull(machine: &Machine, pull: &Pull) -> Result<(), ChangeError> {
    let (body, bodies) = (pull.body, machine.bodies.len());
    let far = pull.hand.amax().max(pull.point.amax());
    if body >= bodies {
        Err(ChangeError::NoBody { body, bodies })
    } else if far > MAX_HAND_DISTANCE {
        Err(ChangeError::TooFar { far })
    } else {
        Ok(())
    }
}

/// As [`Simulation::check_control`](crate::simulate::Simulation::check_control).
pub(super) fn check_control(
    machine: &Machine,
    elements: &LiveElements,
    (i, number, value): (usize, ElementNumber, f64),
) -> Result<(), ControlFault> {
    if i >= machine.elements.len() {
        return Err(ControlFault::NoElement { element: i, elements: machine.elements.len() });
    }
    elements.element(machine, i).check_number(number, value)
}

/// A motor's target at `time`, s; at rest at 0 if it has none.
fn target_at(motor: &Element, time: f64) -> Jet {
    law_of(motor).map_or_else(Jet::default, |law| law.at(time))
}

/// Value of a number of `element` at `time`, s; `None` if it does not have that.
pub(super) fn number_at(element: &Element, number: ElementNumber, time: f64) -> Option<f64> {
    match (&element.kind, number) {
        (ElementKind::Motor(_), ElementNumber::Target) => Some(target_at(element, time).value),
        (ElementKind::Motor(_), ElementNumber::TargetRate) => Some(target_at(element, time).rate),
        _ => element.number(number),
    }
}

impl Stepping<'_> {
    /// As [`Simulation::adopt`](crate::simulate::Simulation::adopt).
    pub(in crate::simulate) fn adopt(&mut self, next: &Machine) -> Result<Effect, ChangeError> {
        let pairs = self.machine.loose_joints.iter().zip(&next.loose_joints);
        let structure = |joint: &LooseJoint| joint.contact.structure();
        let changes_equations = pairs.into_iter().any(|(a, b)| structure(a) != structure(b));
        if changes_equations || !self.machine.differs_only_in_conditions(next) {
            return Ok(Effect::AtReset);
        }
        let solver = next.solver;
        let other_method = solver.method != self.state.conditions.solver.method;
        if other_method {
            prepare_implicit(self.mechanism, solver.method)?;
        }
        let mut elements = self.state.elements.clone();
        elements.adopt(self.machine, next);
        self.mechanism.set_elements(self.machine, &elements)?;
        self.state.elements = elements;
        let before = std::mem::replace(&mut self.state.conditions, next.conditions());
        for (j, old) in before.joints.iter().enumerate() {
            if self.state.conditions.joints[j] != *old {
                self.change_contact(j);
            }
            if self.state.conditions.joints[j].wear_coefficient != old.wear_coefficient {
                // The next step finds the new rate.
                self.state.joints[j].worn.iter_mut().for_each(|worn| worn.rate = 0.0);
            }
        }
        if solver != before.solver {
            if other_method {
                let dimension = self.state.now.y.len();
                *self.stepper = AnyStepper::new(solver.method, dimension);
                let control = &mut self.state.control;
                control.scheme = ActiveScheme::Explicit;
                control.controller = controller_of(solver.method, ActiveScheme::Explicit);
                control.selector = SchemeSelector::default();
                let components = AnyStepper::polynomial_size(solver.method, dimension);
                self.state.polynomial = Polynomial::new(components);
            }
            self.state.control.h_next = self.state.control.h_next.min(solver.step);
        }
        self.sync_parameters();
        self.refresh();
        self.record_change();
        Ok(Effect::Now)
    }

    /// Starts, changes or (with `None`) ends the pull of a hand on a body.
    pub(in crate::simulate) fn pull(&mut self, pull: Option<Pull>) {
        self.state.pull = pull;
        self.sync_parameters();
        self.refresh();
        self.record_change();
    }

    /// As [`Simulation::control`](crate::simulate::Simulation::control).
    pub(in crate::simulate) fn control(&mut self, numbers: &[(usize, ElementNumber, f64)]) -> Result<(), ChangeError> {
        let (time, machine) = (self.state.now.t, self.machine);
        let mut elements = self.state.elements.clone();
        for &(i, number, value) in numbers {
            check_control(machine, &elements, (i, number, value))?;
            let element = elements.element(machine, i);
            if let (ElementKind::Motor(motor), ElementNumber::Target | ElementNumber::TargetRate) =
                (&element.kind, number)
            {
                let now = target_at(&element, time);
                // A target that is set while another law moves it stands still there.
                let rate = if matches!(motor.target, Some(Drive::Constant { .. })) { now.rate } else { 0.0 };
                let [position, rate] = if number == ElementNumber::Target { [value, rate] } else { [now.value, value] };
                elements.set(i, ElementNumber::Target, position - rate * time);
                elements.set(i, ElementNumber::TargetRate, rate);
            } else {
                elements.set(i, number, value);
            }
        }
        self.mechanism.set_elements(machine, &elements)?;
        self.state.elements = elements;
        self.sync_parameters();
        self.refresh();
        self.record_change();
        Ok(())
    }

    /// Lets `forces` act from now on, and changes nothing else.
    pub(in crate::simulate) fn set_applied_forces(&mut self, forces: &AppliedForces) -> Result<(), ChangeError> {
        self.mechanism.set_elements(self.machine, &forces.elements)?;
        self.state.conditions.gravity = forces.gravity;
        self.state.elements = forces.elements.clone();
        self.sync_parameters();
        self.refresh();
        Ok(())
    }

    fn sync_parameters(&mut self) {
        sync_parameters(self.mechanism, self.model, self.state);
    }

    /// Rewinds to `time` within the latest step, on its interpolant; only for a simulation without contacts.
    pub(in crate::simulate) fn rewind_to(&mut self, time: f64) {
        let h = self.state.now.t - self.before.t;
        if !(time < self.state.now.t && time >= self.before.t) {
            return;
        }
        self.interpolate((time - self.before.t) / h, h);
        self.state.now.t = time;
        self.state.now.y.copy_from_slice(self.scratch_y);
        self.mechanism.project(time, &mut self.state.now.y);
        self.refresh();
    }

    /// Applies new contact parameters from this instant; a clearance that would place the ball inside the wall is ramped.
    fn change_contact(&mut self, j: usize) {
        for (play, clearance) in self.state.conditions.joints[j].clearances().into_iter().enumerate() {
            if clearance > 0.0 {
                self.change_play(j, play, clearance);
            }
        }
    }

    /// Sets a play of joint `j` to `next`, m, at once or by a ramp; what has worn off adds to it.
    fn change_play(&mut self, j: usize, play: usize, next: f64) {
        let Self { mechanism, state, attempt, .. } = self;
        mechanism.measure(state.now.t, &state.now.y);
        let (set, worn) = (state.plays_without_wear(j)[play], state.worn_evenly(j)[play]);
        let now = mechanism.contacts.play(j, play);
        let distance = |c: ContactId| mechanism.contacts.gap(c).separation.penetration + now;
        let farthest = mechanism.contacts.of_play(j, play).map(distance).fold(0.0, f64::max);
        let (ramp, clearance) = if next < set && farthest > next + worn {
            (Some(Ramp { start: state.now.t, from: set, rate: -CLEARANCE_SPEED, to: next }), set)
        } else {
            (None, next)
        };
        state.joints[j].ramps[play] = ramp;
        state.joints[j].plays[play] = clearance;
        // The wall has moved away from the ball. The state of a ball just arriving or leaving does not change.
        let clearance = clearance + worn;
        for c in mechanism.contacts.of_play(j, play) {
            if clearance > now && state.now.contact_states[c].active && distance(c) <= clearance {
                state.now.contact_states[c] = ContactState::default();
            }
            let in_contact = state.now.contact_states[c].active;
            state.record.impacts.change(c, in_contact, state.now.t, &mut attempt.events);
        }
    }

    /// End of the active clearance ramp that finishes first, s.
    pub(super) fn ramp_end(&self) -> f64 {
        let end = |r: &Ramp| r.start + (r.to - r.from) / r.rate;
        self.state.joints.iter().flat_map(|joint| joint.ramps.iter().flatten()).map(end).fold(f64::INFINITY, f64::min)
    }

    pub(super) fn finish_ramps(&mut self) {
        let t = self.state.now.t;
        let mut finished = false;
        for joint in &mut self.state.joints {
            for (ramp, play) in joint.ramps.iter_mut().zip(&mut joint.plays) {
                if let Some(Ramp { to, .. }) = ramp.take_if(|ramp| t >= ramp.start + (ramp.to - ramp.from) / ramp.rate)
                {
                    *play = to;
                    finished = true;
                }
            }
        }
        if finished {
            self.sync_parameters();
            self.refresh();
            self.record_change();
        }
    }
}
