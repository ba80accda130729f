//! Powers of what gives and takes energy, each from the force that does it and the velocity of the point where it acts.
//! Allocates nothing.

use super::Mechanism;
use super::elements::ForceElement;
use super::equations::Equations;
use super::kinematics::{Kinematics, Wrench};
use super::model::{Model, Motion};
use crate::scene::Vec3;

/// Powers at one instant, or their integrals over a time (then J).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Powers {
    /// Given by the drives: actuator force times rate, W.
    pub drive: f64,
    /// Taken by the damping of the normal forces, W: (F_N - K delta^1.5) d(delta)/dt.
    pub restitution: f64,
    /// Taken by friction, W: -F_T . (velocity of the ball's point - velocity of the socket's point) (24).
    pub friction: f64,
    /// Given by clearances on their way, W: -F_N dc/dt + 2/5 dK/dt delta^2.5.
    pub clearance: f64,
    /// Taken by the dampers of force elements, W.
    pub damping: f64,
    /// Given by loads from outside, W.
    pub external: f64,
}

/// A ball that presses against the wall of its socket.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Unit vector from the socket's centre to the point of contact, in the axes of the socket's body.
    pub direction: Vec3,
    /// F_N, N.
    pub normal_force: f64,
    /// Power that friction takes, W.
    pub friction_power: f64,
}

impl Powers {
    /// Adds `weight` times `other`.
    pub fn add(&mut self, weight: f64, other: &Self) {
        self.drive += weight * other.drive;
        self.restitution += weight * other.restitution;
        self.friction += weight * other.friction;
        self.clearance += weight * other.clearance;
        self.damping += weight * other.damping;
        self.external += weight * other.external;
    }
}

/// What of a scene can have a power.
pub(super) struct Sources {
    /// Neither drives, nor contacts, nor force elements: every power is zero.
    pub none: bool,
    /// No drive feels an acceleration that the equations of motion have to be solved for: forces alone will do.
    pub forces_suffice: bool,
}

impl Sources {
    /// Of a scene and its equations.
    pub(super) fn new(model: &Model, equations: &dyn Equations, elements: usize) -> Self {
        let n = model.bodies.len();
        let drives = !model.drives.is_empty();
        let contacts = model.joints.iter().any(|joint| joint.ideal.is_none());
        // Parents come before children.
        let mut moved = vec![false; n + 1];
        let mut free_rider = false;
        for (b, body) in model.bodies.iter().enumerate() {
            moved[b] = moved[body.parent] || matches!(body.motion, Motion::Driven { .. });
            free_rider |= moved[b] && !body.driven_only;
        }
        let prescribed = equations.prescribes_drives() && !free_rider;
        Self {
            none: !drives && !contacts && elements == 0,
            forces_suffice: !drives || prescribed,
        }
    }
}

impl Mechanism {
    /// Whether anything can give or take energy but gravity.
    pub fn has_powers(&self) -> bool {
        !self.sources.none
    }

    /// Whether motion and forces of the latest evaluation are those at `t`.
    pub fn is_evaluated_at(&self, t: f64) -> bool {
        self.evaluated == Some(t)
    }

    /// What was evaluated last is not to be read any more.
    pub fn forget_evaluation(&mut self) {
        self.evaluated = None;
    }

    /// Powers at the latest evaluation, whose derivative is `dy` where accelerations enter.
    pub(super) fn powers_of_latest(&mut self, t: f64, y: &[f64], dy: &[f64]) -> Powers {
        let mut powers = Powers::default();
        let motion = self.equations.motion();
        for contact in self.contacts.loose() {
            contact.add_powers(t, motion, &mut powers);
        }
        for element in &self.elements {
            element.add_powers(t, motion, &mut powers);
        }
        if !self.model.drives.is_empty() {
            let dv = &dy[self.positions()..];
            let all = !self.sources.forces_suffice;
            let (model, gravity) = (&self.model, &self.gravity);
            powers.drive = self.equations.drive_power(model, gravity, y, dv, all);
            // The loads were changed, and the accelerations may have been.
            self.evaluated = None;
        }
        powers
    }

    /// What the ball of joint `j` does to the wall of its socket at the latest evaluation; `None` where it does not press.
    pub fn touch(&self, j: usize) -> Option<Touch> {
        self.contacts.joint(j).touch(self.motion())
    }

    /// Unit vector from the socket's centre of joint `j` to the ball's, off the centre, at the latest evaluation, in the axes of
    /// the socket's body: towards the point of the wall that the ball is next to.
    pub fn wall_direction(&self, j: usize) -> Vec3 {
        self.contacts.joint(j).wall_direction(self.motion())
    }
}

/// Forces that the drives must give for the accelerations in `motion` under the loads in `wrench`, which it changes, from
/// the bodies for which `moved` says so: calls `found(drive, force)` for each.
pub(super) fn inverse_dynamics(
    model: &Model,
    motion: &[Kinematics],
    wrench: &mut [Wrench],
    gravity: &Vec3,
    moved: impl Fn(usize) -> bool,
    mut found: impl FnMut(usize, f64),
) {
    for (b, body) in model.bodies.iter().enumerate() {
        if !moved(b) {
            continue;
        }
        let m = &motion[b];
        let w = m.rotation.tr_mul(&m.angular_velocity);
        let alpha = m.rotation.tr_mul(&m.angular_acceleration);
        let torque = m.rotation * (body.inertia * alpha + w.cross(&(body.inertia * w)));
        let load = &mut wrench[b];
        load.force = (m.acceleration - gravity) * body.mass - load.force;
        load.torque = torque - load.torque;
    }
    for (b, body) in model.bodies.iter().enumerate().rev() {
        if !moved(b) {
            continue;
        }
        let m = &motion[b];
        let needed = wrench[b];
        if let Motion::Driven { drive, revolute } = body.motion {
            let force = if revolute {
                m.axis.dot(&(needed.torque + m.arm.cross(&needed.force)))
            } else {
                m.axis.dot(&needed.force)
            };
            found(drive, force);
        }
        if body.parent < model.bodies.len() {
            let d = m.position - motion[body.parent].position;
            let parent = &mut wrench[body.parent];
            parent.force += needed.force;
            parent.torque += needed.torque + d.cross(&needed.force);
        }
    }
}
