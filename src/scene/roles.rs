//! What a body does, where its shapes do not say it.

use super::{JointKind, Role, Scene};

impl Scene {
    /// Roles that shapes without one have, by body; on the world it is that of a frame.
    pub fn body_roles(&self) -> Vec<Role> {
        let mut roles: Vec<Role> = Vec::with_capacity(self.bodies.len());
        for (body, joint) in self.joints.iter().enumerate() {
            let role = match (joint.kind, &joint.drive) {
                // Parents come first.
                (JointKind::Fixed, _) => joint.parent.map_or(Role::Frame, |parent| roles[parent]),
                (JointKind::Revolute, Some(_)) => Role::DrivingRod,
                (_, Some(_)) => Role::Slider,
                _ if body == self.output.body => Role::Platform,
                (JointKind::Prismatic, None) => Role::Slider,
                _ => Role::DrivenRod,
            };
            roles.push(role);
        }
        roles
    }
}
