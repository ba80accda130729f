//! Joints without play: tree joints and loop-closing joints.

use super::{Drive, Quat, Vec3};
use crate::words::words;

/// A joint between `child` and `parent`, in the tree or closing a loop.
///
/// Pose of the child for joint coordinate q, with R the parent's (world: identity) rotation, `rotation` = R0: revolute
/// `R_child = R Rot(axis, q) R0`, the two points coincide; prismatic `R_child = R R0`, the child's point is at the parent's
/// point + q axis; cylindrical both, first the slide, then the turn; universal `R_child = R Rot(axis, q1) R0 Rot(child_axis, q2)`,
/// the two points coincide; fixed as prismatic with q = 0; free (parent is the world): see `start`.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Unique name.
    pub name: String,
    /// Kind of motion.
    pub kind: JointKind,
    /// Parent body; `None` is the world.
    pub parent: Option<usize>,
    /// Child body.
    pub child: usize,
    /// Joint point in the parent's frame, m.
    pub parent_point: Vec3,
    /// Joint point in the child's frame, m.
    pub child_point: Vec3,
    /// Unit axis in the parent's frame (all but fixed and free).
    pub axis: Vec3,
    /// Second unit axis of a universal joint in the child's frame, perpendicular to `axis`.
    pub child_axis: Vec3,
    /// Child's orientation in the parent at q = 0.
    pub rotation: Quat,
    /// Drive of q(t), or of the first of two coordinates; `None` leaves it to the dynamics.
    pub drive: Option<Drive>,
    /// Drive of the second of two coordinates.
    pub second_drive: Option<Drive>,
    /// Start values; ignored where a drive prescribes the motion.
    pub start: JointStart,
    /// Whether the view draws a pin or a rail for it.
    pub drawn: bool,
}

impl Joint {
    /// Free joint of body `child`, at rest at the world origin.
    pub fn free(child: usize) -> Self {
        Self::free_at(child, Vec3::zeros())
    }

    /// Free joint of body `child`, at rest at `position` (m), with its axes parallel to those of the world.
    pub fn free_at(child: usize, position: Vec3) -> Self {
        let start = JointStart::Pose {
            position,
            rotation: Quat::identity(),
            velocity: Vec3::zeros(),
            angular_velocity: Vec3::zeros(),
        };
        Self { start, ..Self::new(JointKind::Free, None, child, Vec3::x()) }
    }

    /// A hinge about the unit vector `axis`, through the frame origins of `child` and `parent` (the world if `None`).
    pub fn revolute(parent: Option<usize>, child: usize, axis: Vec3) -> Self {
        Self::new(JointKind::Revolute, parent, child, axis)
    }

    /// A slide along the unit vector `axis`, through the same points.
    pub fn prismatic(parent: Option<usize>, child: usize, axis: Vec3) -> Self {
        Self::new(JointKind::Prismatic, parent, child, axis)
    }

    fn new(kind: JointKind, parent: Option<usize>, child: usize, axis: Vec3) -> Self {
        Self {
            name: format!("{kind}{}", child + 1),
            kind,
            parent,
            child,
            parent_point: Vec3::zeros(),
            child_point: Vec3::zeros(),
            axis,
            child_axis: Vec3::y(),
            rotation: Quat::identity(),
            drive: None,
            second_drive: None,
            start: JointStart::Scalar { position: 0.0, velocity: 0.0 },
            drawn: true,
        }
    }

    /// The same joint with its first coordinate driven by `drive`.
    pub fn with_drive(self, drive: Drive) -> Self {
        Self { drive: Some(drive), ..self }
    }

    /// The same joint of one coordinate, starting at `position` (m or rad) with the rate `velocity`.
    pub fn with_start(self, position: f64, velocity: f64) -> Self {
        Self { start: JointStart::Scalar { position, velocity }, ..self }
    }

    /// Connected points: the parent's, then the child's.
    pub fn points(&self) -> [Attachment; 2] {
        let parent = Attachment { body: self.parent, point: self.parent_point };
        let child = Attachment { body: Some(self.child), point: self.child_point };
        [parent, child]
    }

    /// Driven coordinates with their drives.
    pub fn drives(&self) -> impl Iterator<Item = (Freedom, &Drive)> {
        let drives = [&self.drive, &self.second_drive];
        let coordinates = self.kind.freedoms().iter().zip(drives);
        coordinates.filter_map(|(freedom, drive)| Some((*freedom, drive.as_ref()?)))
    }

    /// Whether the child's motion relative to its parent is a function of time alone.
    pub fn is_prescribed(&self) -> bool {
        self.kind != JointKind::Free && self.drives().count() == self.kind.freedoms().len()
    }
}

/// Kind of a joint without play.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// No motion.
    Fixed,
    /// Slides along `axis`.
    Prismatic,
    /// Turns about `axis`.
    Revolute,
    /// Six degrees of freedom.
    Free,
    /// Slides along `axis` and turns about it.
    Cylindrical,
    /// Turns about `axis` of the parent and about `child_axis` of the child.
    Universal,
}

words!(JointKind {
    Fixed => "fixed",
    Prismatic => "prismatic",
    Revolute => "revolute",
    Free => "free",
    Cylindrical => "cylindrical",
    Universal => "universal",
});

/// Meaning of a joint coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Freedom {
    /// Displacement along the axis of a slide or a cylindrical joint, m.
    Slide,
    /// Angle of a hinge, rad.
    Turn,
    /// Angle of a cylindrical joint, rad.
    TurnOfSlide,
    /// Angle of a universal joint about its axis in the parent, rad.
    FirstTurn,
    /// The same about its axis in the child.
    SecondTurn,
}

impl Freedom {
    /// Name of the coordinate in files and channels.
    pub fn word(self) -> &'static str {
        match self {
            Self::Slide => "position",
            Self::Turn | Self::TurnOfSlide | Self::FirstTurn => "angle",
            Self::SecondTurn => "child_angle",
        }
    }

    /// Whether the coordinate is an angle.
    pub fn turns(self) -> bool {
        self != Self::Slide
    }
}

impl JointKind {
    /// Coordinates of a joint of this kind; a free joint's pose has none.
    pub fn freedoms(self) -> &'static [Freedom] {
        match self {
            Self::Fixed | Self::Free => &[],
            Self::Prismatic => &[Freedom::Slide],
            Self::Revolute => &[Freedom::Turn],
            Self::Cylindrical => &[Freedom::Slide, Freedom::TurnOfSlide],
            Self::Universal => &[Freedom::FirstTurn, Freedom::SecondTurn],
        }
    }
}

/// Start values of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointStart {
    /// Coordinate (m or rad) and rate of a one-degree joint.
    Scalar {
        /// q at t = 0.
        position: f64,
        /// dq/dt at t = 0.
        velocity: f64,
    },
    /// Coordinates (m or rad) and rates of a joint of two degrees, in the order of [`JointKind::freedoms`].
    Pair {
        /// q at t = 0.
        position: [f64; 2],
        /// dq/dt at t = 0.
        velocity: [f64; 2],
    },
    /// Pose of the body frame and its motion, world axes.
    Pose {
        /// Body frame's origin, m.
        position: Vec3,
        /// Orientation.
        rotation: Quat,
        /// Velocity of the body frame's origin, m/s.
        velocity: Vec3,
        /// Angular velocity, rad/s.
        angular_velocity: Vec3,
    },
}

/// A point on a body, or fixed in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attachment {
    /// Body; `None` is the world.
    pub body: Option<usize>,
    /// Point in that body's frame, m.
    pub point: Vec3,
}

impl Attachment {
    /// A world-fixed point, m.
    pub fn world(point: Vec3) -> Self {
        Self { body: None, point }
    }

    /// A point of a body, in its frame, m.
    pub fn on(body: usize, point: Vec3) -> Self {
        Self { body: Some(body), point }
    }
}
