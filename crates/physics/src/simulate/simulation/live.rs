//! Parameters changed while the simulation runs.

use std::sync::Arc;

use super::automatic::{SchemeSelector, controller_of, prepare_implicit};
use super::{CLEARANCE_SPEED, Simulation};
use crate::contact::Memory;
use crate::machine::{Machine, Vec3};
use crate::mechanism::{ElementReport, MechanismError, Pull, Ramp};
use crate::simulate::stepper::{ActiveScheme, AnyStepper};
use crate::simulate::{Effect, Frame};

/// Largest distance of a hand, or of the point it holds, m: beyond it a pull makes no sense.
const FARTHEST_HAND: f64 = 1e6;

/// Why a running simulation was not changed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ChangeError {
    /// A method that the equations do not allow.
    #[error("solver.method: {0}")]
    Method(#[from] MechanismError),
    /// A pull on a body that does not exist.
    #[error("body {body} is pulled, of {bodies} (counted from 0)")]
    NoBody {
        /// Index.
        body: usize,
        /// Number of bodies.
        bodies: usize,
    },
    /// A hand, or the point that it holds, out of reach.
    #[error("a hand, or the point that it holds, is {far:e} m away; allowed at most {FARTHEST_HAND} m")]
    TooFar {
        /// m.
        far: f64,
    },
}

impl Simulation {
    /// Adopts the gravity, contacts and stepper of `next`. Returns [`Effect::AtReset`] and changes nothing if `next` differs in
    /// anything else, or if a ball joint becomes or ceases to be ideal, which changes the equations.
    ///
    /// # Errors
    /// If the method is too costly for the equations; nothing has changed then.
    pub fn adopt(&mut self, next: &Machine) -> Result<Effect, ChangeError> {
        let pairs = self.machine.ball_joints.iter().zip(&next.ball_joints);
        let clearances = pairs.map(|(a, b)| (a.contact.clearance, b.contact.clearance));
        let changes_equations = clearances.into_iter().any(|(a, b)| (a == 0.0) != (b == 0.0));
        if changes_equations || !self.machine.differs_in_conditions_alone(next) {
            return Ok(Effect::AtReset);
        }
        if next.solver.method != self.machine.solver.method {
            prepare_implicit(&mut self.mechanism, next.solver.method)?;
        }
        let before = std::mem::replace(&mut self.machine, Arc::new(next.clone()));
        if self.machine.gravity != before.gravity {
            let gravity = self.machine.gravity;
            self.reference.set_gravity(self.state.now.t, gravity);
        }
        for j in 0..self.machine.ball_joints.len() {
            let contact = self.machine.ball_joints[j].contact;
            if contact != before.ball_joints[j].contact {
                self.change_contact(j, &contact);
            }
        }
        if self.machine.solver != before.solver {
            let solver = &self.machine.solver;
            if solver.method != before.solver.method {
                self.stepper = AnyStepper::new(solver.method, self.state.now.y.len());
                self.state.control.member = ActiveScheme::Explicit;
                self.state.control.controller = controller_of(solver.method, ActiveScheme::Explicit);
                self.state.control.choice = SchemeSelector::default();
            }
            self.state.control.h_next = self.state.control.h_next.min(solver.step);
        }
        self.sync_parameters();
        self.refresh();
        self.record_change();
        Ok(Effect::Now)
    }

    /// Starts, changes or (with `None`) ends the pull of a hand on a body.
    ///
    /// # Errors
    /// As [`Self::check_pull`]: the running simulation is unchanged.
    pub fn pull(&mut self, pull: Option<Pull>) -> Result<(), ChangeError> {
        pull.map_or(Ok(()), |pull| self.check_pull(&pull))?;
        self.state.pull = pull;
        self.sync_parameters();
        self.refresh();
        self.record_change();
        Ok(())
    }

    /// Checks whether a pull is possible.
    ///
    /// # Errors
    /// An unknown body, or a position out of reach.
    pub fn check_pull(&self, pull: &Pull) -> Result<(), ChangeError> {
        let bodies = self.machine.bodies.len();
        let far = pull.hand.amax().max(pull.point.amax());
        if pull.body >= bodies {
            let body = pull.body;
            Err(ChangeError::NoBody { body, bodies })
        } else if far > FARTHEST_HAND {
            Err(ChangeError::TooFar { far })
        } else {
            Ok(())
        }
    }

    /// Force of the pulling hand, if any, with the bodies as in `frame`.
    pub fn pull_in(&self, frame: &Frame) -> Option<ElementReport> {
        let pull = self.state.pull?;
        let motion = frame.bodies.get(pull.body)?;
        let arm = motion.rotation * pull.point;
        let velocity = motion.velocity + motion.angular_velocity.cross(&arm);
        Some(pull.report(motion.position + arm, velocity))
    }

    /// The current pull, if any.
    pub fn pulled(&self) -> Option<Pull> {
        self.state.pull
    }

    /// Sets gravity from now on, m/s^2, and changes nothing else.
    pub fn set_gravity(&mut self, gravity: Vec3) {
        Arc::make_mut(&mut self.machine).gravity = gravity;
        self.sync_parameters();
        self.refresh();
    }

    /// Copies the parameters that live changes affect from machine and state to the mechanism.
    pub(super) fn sync_parameters(&mut self) {
        let Self { mechanism, state, machine, .. } = self;
        mechanism.gravity = machine.gravity;
        if mechanism.pull() != state.pull {
            mechanism.set_pull(machine, state.pull);
        }
        for (j, joint) in machine.ball_joints.iter().enumerate() {
            if joint.contact.clearance > 0.0 {
                let contacts = &mut mechanism.contacts;
                contacts.set_ramp(j, state.ramps[j]);
                contacts.set_parameters(j, &joint.contact, state.clearances[j]);
            }
        }
    }

    /// Rewinds to `time` within the latest step, on its interpolant; only for a simulation without contacts.
    pub(in crate::simulate) fn go_back_to(&mut self, time: f64) {
        let h = self.state.now.t - self.state.before.t;
        if !(time < self.state.now.t && time >= self.state.before.t) {
            return;
        }
        self.interpolate((time - self.state.before.t) / h, h);
        self.state.now.t = time;
        self.state.now.y.copy_from_slice(&self.scratch_y);
        self.mechanism.project(time, &mut self.state.now.y);
        self.refresh();
    }

    /// Applies new contact parameters from this instant; a clearance that would place the ball inside the wall is ramped.
    fn change_contact(&mut self, j: usize, contact: &crate::contact::Parameters) {
        if contact.clearance == 0.0 {
            return;
        }
        let Self { mechanism, state, .. } = self;
        mechanism.measure(state.now.t, &state.now.y);
        let now = mechanism.contacts.clearance(j);
        let gap = *mechanism.contacts.gap(j);
        let distance = gap.separation.penetration + now;
        let clearance = if contact.clearance < now && distance > contact.clearance {
            let ramp = Ramp { start: state.now.t, from: now, rate: -CLEARANCE_SPEED, to: contact.clearance };
            state.ramps[j] = Some(ramp);
            now
        } else {
            state.ramps[j] = None;
            contact.clearance
        };
        state.clearances[j] = clearance;
        // The wall has moved away from the ball. The state of a ball just arriving or leaving does not change.
        if clearance > now && state.now.memory[j].active && distance <= clearance {
            state.now.memory[j] = Memory::default();
        }
        state.record.impacts.change(j, state.now.memory[j].active);
    }

    /// End of the active clearance ramp that finishes first, s.
    pub(super) fn ramp_end(&self) -> f64 {
        let end = |r: &Ramp| r.start + (r.to - r.from) / r.rate;
        self.state.ramps.iter().flatten().map(end).fold(f64::INFINITY, f64::min)
    }

    pub(super) fn finish_ramps(&mut self) {
        let t = self.state.now.t;
        let mut finished = false;
        for j in 0..self.state.ramps.len() {
            let Some(ramp) = self.state.ramps[j] else {
                continue;
            };
            if t >= ramp.start + (ramp.to - ramp.from) / ramp.rate {
                self.state.ramps[j] = None;
                self.state.clearances[j] = ramp.to;
                finished = true;
            }
        }
        if finished {
            self.sync_parameters();
            self.refresh();
            self.record_change();
        }
    }
}
