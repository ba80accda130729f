//! Parameters changed while the simulation runs.

use std::sync::Arc;

use super::automatic::{Choice, controller_of, prepare_implicit};
use super::{CLEARANCE_SPEED, Simulation};
use crate::contact::Memory;
use crate::mechanism::{ElementReport, MechanismError, Pull, Ramp};
use crate::scene::{Scene, SceneError};
use crate::simulate::stepper::{AnyStepper, Member};
use crate::simulate::{Effect, Frame};

/// Largest distance of a hand, or of the point it holds, m: beyond it a pull makes no sense.
const FARTHEST_HAND: f64 = 1e6;

/// Why a running simulation was not changed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ChangeError {
    /// A parameter or value that the scene does not accept.
    #[error(transparent)]
    Scene(#[from] SceneError),
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

/// Whether `next` is what `running` is but for gravity and contacts, which take effect at once: a parameter of the scene's own may
/// be used there alone.
pub fn differs_in_conditions_alone(running: &Scene, next: &Scene) -> bool {
    let mut like_next = Scene::clone(running);
    like_next.gravity = next.gravity;
    like_next.contact = next.contact;
    for (joint, next) in like_next.ball_joints.iter_mut().zip(&next.ball_joints) {
        joint.contact = next.contact;
    }
    like_next.source.clone_from(&next.source);
    like_next.changes.clone_from(&next.changes);
    like_next == *next
}

impl Simulation {
    /// Changes a parameter (`contact.clearance`, `joint.S1.friction`, …) to a value as a user writes it.
    ///
    /// # Errors
    /// Unknown key, bad unit, out of range: the running simulation is unchanged.
    pub fn set(&mut self, key: &str, value: &str) -> Result<Effect, ChangeError> {
        let mut next = Scene::clone(&self.scene);
        let waits = next.set(key, value)?.at_reset;
        self.adopt(next, |running| running.set(key, value).map(|_| ()), waits)
    }

    /// As [`Self::set`], with a value in SI units.
    ///
    /// # Errors
    /// As [`Self::set`].
    pub fn set_value(&mut self, key: &str, value: &crate::scene::Value) -> Result<Effect, ChangeError> {
        let mut next = Scene::clone(&self.scene);
        let waits = next.set_value(key, value)?.at_reset;
        self.adopt(next, |running| running.set_value(key, value).map(|_| ()), waits)
    }

    /// Starts, changes or (with `None`) ends the pull of a hand on a body.
    ///
    /// # Errors
    /// As [`Self::check_pull`]: the running simulation is unchanged.
    pub fn pull(&mut self, pull: Option<Pull>) -> Result<(), ChangeError> {
        pull.map_or(Ok(()), |pull| self.check_pull(&pull))?;
        self.state.pull = pull;
        self.put_conditions();
        self.refresh();
        self.book_change();
        Ok(())
    }

    /// Whether such a pull is possible.
    ///
    /// # Errors
    /// An unknown body, or a position out of reach.
    pub fn check_pull(&self, pull: &Pull) -> Result<(), ChangeError> {
        let bodies = self.running.bodies.len();
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

    /// Force of the hand that pulls, if any, with the bodies as in `frame`.
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

    fn adopt(
        &mut self,
        next: Scene,
        change: impl FnOnce(&mut Scene) -> Result<(), SceneError>,
        waits: bool,
    ) -> Result<Effect, ChangeError> {
        let mut running = Scene::clone(&self.running);
        // What the running scene cannot accept may suit the waiting one, say a joint of a longer chain.
        let refused = change(&mut running).is_err();
        let waits = refused || (waits && !differs_in_conditions_alone(&self.running, &running));
        // A joint that becomes ideal, or stops being so, changes the equations.
        let turns = |running: &Scene| {
            let pairs = self.running.ball_joints.iter().zip(&running.ball_joints);
            pairs.map(|(a, b)| (a.contact.clearance, b.contact.clearance)).any(|(a, b)| (a == 0.0) != (b == 0.0))
        };
        if waits || turns(&running) {
            self.scene = Arc::new(next);
            return Ok(Effect::AtReset);
        }
        if running.solver.method != self.running.solver.method {
            prepare_implicit(&mut self.mechanism, running.solver.method)?;
        }
        self.scene = Arc::new(next);
        let before = std::mem::replace(&mut self.running, Arc::new(running));
        if self.running.gravity != before.gravity {
            let gravity = self.running.gravity;
            self.reference.set_gravity(self.state.now.t, gravity);
        }
        for j in 0..self.running.ball_joints.len() {
            let contact = self.running.ball_joints[j].contact;
            if contact != before.ball_joints[j].contact {
                self.change_contact(j, &contact);
            }
        }
        if self.running.solver != before.solver {
            let solver = &self.running.solver;
            if solver.method != before.solver.method {
                self.stepper = AnyStepper::new(solver.method, self.state.now.y.len());
                self.state.control.member = Member::Explicit;
                self.state.control.controller = controller_of(solver.method, Member::Explicit);
                self.state.control.choice = Choice::default();
            }
            self.state.control.h_next = self.state.control.h_next.min(solver.step);
        }
        self.put_conditions();
        self.refresh();
        self.book_change();
        Ok(Effect::Now)
    }

    /// Sets gravity from now on, m/s^2, for a simulation whose scene is not changed otherwise.
    pub fn set_gravity(&mut self, gravity: crate::scene::Vec3) {
        Arc::make_mut(&mut self.running).gravity = gravity;
        Arc::make_mut(&mut self.scene).gravity = gravity;
        self.put_conditions();
        self.refresh();
    }

    /// Gives the equations what live changes reach: the running scene and the state have it.
    pub(super) fn put_conditions(&mut self) {
        let Self { mechanism, state, running, .. } = self;
        mechanism.gravity = running.gravity;
        if mechanism.pull() != state.pull {
            mechanism.set_pull(running, state.pull);
        }
        for (j, joint) in running.ball_joints.iter().enumerate() {
            if joint.contact.clearance > 0.0 {
                let contacts = &mut mechanism.contacts;
                contacts.set_ramp(j, state.ramps[j]);
                contacts.set_parameters(j, &joint.contact, state.clearances[j]);
            }
        }
    }

    /// Back to `time` within the latest step, on its interpolant; only for a simulation without contacts.
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

    /// New contact parameters from this instant; a clearance that would put the ball inside the wall is ramped.
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
        // A ball that the wall has left; one just arriving, or leaving, stays as it is.
        if clearance > now && state.now.memory[j].active && distance <= clearance {
            state.now.memory[j] = Memory::default();
        }
        state.record.impacts.change(j, state.now.memory[j].active);
    }

    /// When the first clearance ramp under way ends, s.
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
            self.put_conditions();
            self.refresh();
            self.book_change();
        }
    }
}
