//! Powers of all energy sources and sinks, each from a force and the velocity of its point of application. Allocates nothing.

use super::elements::{ForceElement, Powers, WallContact};
use super::equations::Equations;
use super::kinematics::{Kinematics, Wrench};
use super::loose::Spot;
use super::model::{ContactId, Model, Motion};
use super::{Latest, Mechanism};
use crate::machine::Vec3;

/// Parts of a scene that can have power.
pub(super) struct Sources {
    /// Whether there are neither drives nor contacts nor force elements: every power is zero.
    pub none: bool,
    /// Whether the loads alone suffice, because no drive force depends on an unknown acceleration.
    pub(crate) forces_suffice: bool,
}

impl Sources {
    /// For a scene with this number of force elements.
    pub(super) fn new(model: &Model, equations: &dyn Equations, elements: usize) -> Self {
        let n = model.bodies.len();
        let drives = !model.drives.is_empty();
        let contacts = !model.sites.is_empty();
        // Parents come before children.
        let mut moved = vec![false; n + 1];
        let mut carries_free_body = false;
        for &b in &model.order {
            let body = &model.bodies[b];
            moved[b] = moved[body.parent] || matches!(body.motion, Motion::Driven { .. });
            carries_free_body |= moved[b] && !body.driven_only;
        }
        let prescribed = equations.prescribes_drives() && !carries_free_body;
        Self { none: !drives && !contacts && elements == 0, forces_suffice: !drives || prescribed }
    }
}

impl Mechanism {
    /// Whether anything other than gravity can supply or dissipate energy.
    pub(crate) fn has_powers(&self) -> bool {
        !self.sources.none
    }

    /// Whether motion and forces of the latest evaluation are those at `t`.
    pub(crate) fn is_evaluated_at(&self, t: f64) -> bool {
        self.latest == Latest::Evaluated(t)
    }

    /// Whether motion and gaps, at least, are those of a measurement or evaluation at `t`.
    pub(crate) fn is_measured_at(&self, t: f64) -> bool {
        self.latest == Latest::Measured(t) || self.is_evaluated_at(t)
    }

    /// Marks the latest evaluation as stale.
    pub(crate) fn forget_evaluation(&mut self) {
        self.latest = Latest::Unknown;
    }

    /// Powers at the latest evaluation; `dy` is its derivative, needed if accelerations enter.
    pub(super) fn powers_of_latest(&mut self, t: f64, y: &[f64], dy: &[f64]) -> Powers {
        let mut powers = Powers::default();
        let motion = self.equations.motion();
        for contact in self.contacts.iter() {
            contact.add_powers(t, motion, &mut powers);
        }
        for element in &self.elements {
            element.add_powers(t, motion, &mut powers);
        }
        if !self.model.drives.is_empty() {
            let dv = &dy[self.velocity_range()];
            let all = !self.sources.forces_suffice;
            let (model, gravity) = (&self.model, &self.gravity);
            powers.drive += self.equations.drive_power(model, gravity, y, dv, all);
            // The accelerations may have been changed.
            self.latest = Latest::Unknown;
        }
        powers
    }

    /// What presses against the wall of contact `c` at the latest evaluation; `None` without contact force.
    pub(crate) fn wall_contact(&self, c: ContactId) -> Option<WallContact> {
        let contact = self.contacts.contact(c);
        contact.wall_contact(&self.model.joints[contact.site.joint].carrier, self.motion())
    }

    /// Normal force times sliding speed of contact `c` at the latest evaluation, W.
    pub(crate) fn sliding_power(&self, c: ContactId) -> f64 {
        self.contacts.contact(c).sliding_power(self.motion())
    }

    /// Where contact `c` touches, or would if it is near the wall, at the latest evaluation.
    pub(crate) fn spot(&self, c: ContactId) -> Spot {
        let contact = self.contacts.contact(c);
        contact.spot(&self.model.joints[contact.site.joint].carrier, self.motion())
    }
}

/// Drive forces required for the accelerations in `motion` under the loads in `wrench` (overwritten), from the bodies selected by
/// `moved`. Calls `visit(drive, force)` for each.
pub(super) fn inverse_dynamics(
    model: &Model,
    motion: &[Kinematics],
    wrench: &mut [Wrench],
    gravity: &Vec3,
    moved: impl Fn(usize) -> bool,
    mut visit: impl FnMut(usize, f64),
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
    for &b in model.order.iter().rev() {
        if !moved(b) {
            continue;
        }
        let body = &model.bodies[b];
        let m = &motion[b];
        let needed = wrench[b];
        if let Motion::Driven { drive, revolute } = body.motion {
            let force = if revolute {
                m.axis.dot(&(needed.torque + m.arm.cross(&needed.force)))
            } else {
                m.axis.dot(&needed.force)
            };
            visit(drive, force);
        }
        if body.parent < model.bodies.len() {
            let d = m.position - motion[body.parent].position;
            let parent = &mut wrench[body.parent];
            parent.force += needed.force;
            parent.torque += needed.torque + d.cross(&needed.force);
        }
    }
}
