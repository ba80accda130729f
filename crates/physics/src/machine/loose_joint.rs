//! Joints with play.

use super::{Attachment, Quat, Vec3};
use crate::contact;

/// A joint with play: contacts between two bodies in place of constraints, unless its clearance is 0.
#[derive(Clone, Debug, PartialEq)]
pub struct LooseJoint {
    /// Unique name.
    pub name: String,
    /// What can play in it.
    pub kind: LooseKind,
    /// A frame on each of its bodies, which coincide at the joint's zero position without play: that of the carrier (the socket),
    /// in which the contact's surface is fixed, then that of the carried part (the ball).
    pub frames: [JointFrame; 2],
    /// Unit vector in the carrier's body frame: the drawn socket is cut open on that side, so that the rod can pass and the ball
    /// inside is visible. It has no effect on the motion.
    pub opening: Vec3,
    /// Contact parameters.
    pub contact: contact::Parameters,
}

/// Kind of a joint with play.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LooseKind {
    /// A ball in a socket.
    Ball,
}

/// A point of a body, or of the world, with axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointFrame {
    /// Origin.
    pub origin: Attachment,
    /// Orientation in the axes of the body, or of the world. A ball has no use for it.
    pub rotation: Quat,
}

impl From<Attachment> for JointFrame {
    /// With axes parallel to those of the body.
    fn from(origin: Attachment) -> Self {
        Self { origin, rotation: Quat::identity() }
    }
}

impl LooseJoint {
    /// Ball joint with default contact parameters and the drawn socket open towards -z.
    pub fn ball(name: &str, socket: Attachment, ball: Attachment) -> Self {
        Self {
            name: name.to_owned(),
            kind: LooseKind::Ball,
            frames: [socket.into(), ball.into()],
            opening: -Vec3::z(),
            contact: contact::Parameters::default(),
        }
    }

    /// The same joint with a radial clearance of `clearance`, m; 0 makes it ideal.
    pub fn with_clearance(mut self, clearance: f64) -> Self {
        self.contact.clearance = clearance;
        self
    }

    /// Origin of the carrier's frame: the socket's centre Z_i.
    pub fn carrier(&self) -> Attachment {
        self.frames[0].origin
    }

    /// Origin of the carried part's frame: the ball's centre Z_j.
    pub fn carried(&self) -> Attachment {
        self.frames[1].origin
    }
}
