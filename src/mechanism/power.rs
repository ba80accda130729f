//! Powers of what gives and takes energy, each from the force that does it and the velocity of the point where it acts.
//! Allocates nothing.

use super::kinematics::{Kinematics, Wrench};
use super::model::{Model, Motion};
use super::{Form, Mechanism, load_reactions};
use crate::integrate::System;
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
}

impl Powers {
    /// Adds `weight` times `other`.
    pub fn add(&mut self, weight: f64, other: &Self) {
        self.drive += weight * other.drive;
        self.restitution += weight * other.restitution;
        self.friction += weight * other.friction;
        self.clearance += weight * other.clearance;
    }
}

/// What of a scene can have a power.
pub(super) struct Sources {
    /// Neither drives nor contacts: every power is zero.
    pub none: bool,
    /// No drive feels an acceleration that the equations of motion have to be solved for: forces alone will do.
    pub forces_suffice: bool,
}

impl Sources {
    /// Of a scene in the `tree` form, or in the other one.
    pub(super) fn new(model: &Model, tree: bool) -> Self {
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
        let prescribed = tree && !free_rider && model.ideal_joints.is_empty();
        Self {
            none: !drives && !contacts,
            forces_suffice: !drives || prescribed,
        }
    }
}

impl Mechanism {
    /// Whether drives or contacts can give or take energy at all.
    pub fn has_powers(&self) -> bool {
        !self.sources.none
    }

    /// Whether motion and forces of the latest evaluation are those at `t`.
    pub fn is_evaluated_at(&self, t: f64) -> bool {
        self.evaluated == t
    }

    /// What was evaluated last is not to be read any more.
    pub fn forget_evaluation(&mut self) {
        self.evaluated = f64::NAN;
    }

    /// Powers at (t, y) with the contact memory in force. `dy` holds the derivative there if the latest evaluation was at
    /// this instant, and is scratch otherwise. Counts as no evaluation.
    pub fn powers(&mut self, t: f64, y: &[f64], dy: &mut [f64]) -> Powers {
        if self.sources.none {
            return Powers::default();
        }
        if !self.is_evaluated_at(t) {
            let counts = (self.evaluations, self.contacts.evaluations);
            if self.sources.forces_suffice {
                self.load(t, y);
            } else {
                self.derivative(t, y, dy);
            }
            (self.evaluations, self.contacts.evaluations) = counts;
        }
        let mut powers = self.contact_powers();
        if !self.model.drives.is_empty() {
            powers.drive = self.drive_power(y, dy);
            // The loads were changed, and the accelerations may have been.
            self.evaluated = f64::NAN;
        }
        powers
    }

    /// Motion and contact forces at (t, y), no accelerations.
    fn load(&mut self, t: f64, y: &[f64]) {
        let Self {
            model,
            form,
            contacts,
            ..
        } = self;
        match form {
            Form::Tree { tree, .. } => {
                tree.forward(model, t, y);
                tree.load(t, contacts);
            }
            Form::Lagrange(lagrange) => {
                lagrange.forward(model, t, y);
                lagrange.wrench.fill(Wrench::zero());
                contacts.evaluate(t, &lagrange.motion, &mut lagrange.wrench);
            }
        }
        // No accelerations.
        self.evaluated = f64::NAN;
    }

    fn contact_powers(&self) -> Powers {
        let mut powers = Powers::default();
        let motion = self.motion();
        for (j, joint) in self.model.joints.iter().enumerate() {
            if joint.ideal.is_some() {
                continue;
            }
            let (gap, c) = (&self.contacts.gaps()[j], self.contacts.coefficients(j));
            if gap.eccentricity.norm_squared() <= c.clearance * c.clearance {
                continue;
            }
            let at = self.contacts.separation(j);
            powers.restitution += c.restitution_power(&at, gap.normal_force);
            powers.clearance += c.clearance_power(&at, gap.normal_force);
            if gap.friction != Vec3::zeros() {
                let spin = |body: usize| &motion[body].angular_velocity;
                let (ball, socket) = (spin(joint.ball.body), spin(joint.socket.body));
                let velocity = &gap.eccentricity_rate;
                let surfaces = c.surface_velocity(&at.normal, velocity, ball, socket);
                powers.friction -= gap.friction.dot(&surfaces);
            }
        }
        powers
    }

    /// Sum of actuator force times rate after an evaluation at `y` with the derivative `dy`. Changes the loads.
    fn drive_power(&mut self, y: &[f64], dy: &[f64]) -> f64 {
        let Self {
            model,
            form,
            gravity,
            sources,
            ..
        } = self;
        let mut power = 0.0;
        match form {
            Form::Tree { tree, constraints } => {
                let all = !sources.forces_suffice;
                if all {
                    tree.accelerate(model, y, &dy[model.nq..]);
                    if let Some(constraints) = constraints {
                        load_reactions(model, tree, |k| constraints.reaction(k));
                    }
                }
                let rates = &tree.driven.coordinates;
                // Where forces suffice, all that hangs on a drive depends on time alone.
                let moved = |b: usize| all || model.bodies[b].driven_only;
                inverse_dynamics(
                    model,
                    &tree.motion,
                    &mut tree.wrench,
                    gravity,
                    moved,
                    |drive, force| power += force * rates[drive].rate,
                );
            }
            Form::Lagrange(lagrange) => {
                for (i, drive) in model.drives.iter().enumerate() {
                    power += lagrange.actuator(i) * rate_of(model, &lagrange.motion, drive.body);
                }
            }
        }
        power
    }
}

/// Rate of a driven joint from the motion of the two bodies that it holds.
fn rate_of(model: &Model, motion: &[Kinematics], b: usize) -> f64 {
    let body = &model.bodies[b];
    let (child, parent) = (&motion[b], &motion[body.parent]);
    let axis = parent.rotation * body.axis;
    match body.motion {
        Motion::Driven { revolute: true, .. } => {
            axis.dot(&(child.angular_velocity - parent.angular_velocity))
        }
        _ => {
            // Of the point of the parent that is at the child's joint point just now.
            let arm = child.rotation * -body.to_centroid;
            let at = child.position + arm - parent.position;
            axis.dot(&(child.point_velocity(&arm) - parent.point_velocity(&at)))
        }
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
