//! Default roles of bodies, from their joints and drives.

use super::{Freedom, JointKind, Machine, Role};

impl Machine {
    /// Default role of the shapes of each body, in body order; fixed shapes default to a frame.
    pub fn body_roles(&self) -> Vec<Role> {
        let mut roles: Vec<Role> = Vec::with_capacity(self.bodies.len());
        for (body, joint) in self.joints.iter().enumerate() {
            let driven = joint.drives().next().map(|(freedom, _)| freedom);
            let role = match (joint.kind, driven) {
                // Parents precede their children.
                (JointKind::Fixed, _) => joint.parent.map_or(Role::Frame, |parent| roles[parent]),
                (_, Some(Freedom::Slide)) => Role::Slider,
                (_, Some(_)) => Role::DrivingRod,
                _ if body == self.output.body => Role::Platform,
                (JointKind::Prismatic, None) => Role::Slider,
                _ => Role::DrivenRod,
            };
            roles.push(role);
        }
        roles
    }
}
