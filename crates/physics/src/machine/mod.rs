//! Machines as typed data in SI units: bodies, joints, drives and force elements, built in code or read from a scene file.

mod applied;
mod body;
mod check;
mod closed_form;
mod conditions;
mod coupling;
mod doubts;
mod drive;
mod element;
mod joint;
mod loose_joint;
#[expect(clippy::disallowed_types, reason = "mesh files hold single-precision numbers")]
mod mesh;
mod mesh_unit;
mod outline;
mod roles;
mod settings;
mod solid;
mod wearing;

pub use applied::{AppliedForces, ControlFault, ElementNumber, LiveElements};
pub use body::*;
pub use check::{ContactConflict, ContactFault, MIN_IMPACT_STEPS, MachineFault, MasslessFault};
pub use closed_form::{ClosedForm, Function, Path};
pub use conditions::Conditions;
pub use coupling::Coupled;
pub(crate) use coupling::root;
pub use doubts::*;
pub use drive::*;
pub use element::*;
pub use joint::*;
pub use loose_joint::*;
pub use mesh::Mesh;
pub use outline::{OutlineFault, triangulate};
pub use settings::*;
pub use solid::Solid;

use crate::contact;

/// A vector in three dimensions, f64.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A 3 x 3 matrix, f64.
pub type Mat3 = nalgebra::Matrix3<f64>;
/// An orientation, f64.
pub type Quat = nalgebra::UnitQuaternion<f64>;

/// A mechanism and everything needed to simulate and draw it.
///
/// Cutting the joints with play and the joints that close loops leaves a forest: each body is attached to its parent by exactly one
/// entry of `joints`, and parents come before children.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Machine {
    /// Gravity, world axes, m/s^2.
    pub gravity: Vec3,
    /// Contact parameters of the machine as a whole; they also apply to loop-closing joints where these count as joints with play.
    pub contact: contact::Parameters,
    /// Equations of motion.
    pub formulation: Formulation,
    /// Stepper settings.
    pub solver: Solver,
    /// Closed-form motion that drives may follow.
    pub closed_form: Option<ClosedForm>,
    /// Contents of the pose columns.
    pub output: Output,
    /// Interpretation of the start values.
    pub start: StartRule,
    /// Moving bodies, parents before children.
    pub bodies: Vec<Body>,
    /// One tree joint for each body, in body order: `joints[i].child == i`.
    pub joints: Vec<Joint>,
    /// Joints with play, or without it if their clearance is 0; all are cut.
    pub loose_joints: Vec<LooseJoint>,
    /// Loop-closing joints, between bodies that have their own tree joints. They have neither drive nor start values.
    pub closing_joints: Vec<Joint>,
    /// Force elements: springs, external loads.
    pub elements: Vec<Element>,
    /// Fixed shapes (rails, frame), world axes.
    pub fixed_shapes: Vec<Shape>,
}

impl Machine {
    /// Adds a body with its tree joint, sets the joint's `child`, and returns the body's index. Parents come before children.
    pub fn add_body(&mut self, body: Body, joint: Joint) -> usize {
        let child = self.bodies.len();
        self.bodies.push(body);
        self.joints.push(Joint { child, ..joint });
        child
    }

    /// Names of the cut joints in index order: joints with play, then loop-closing joints.
    pub fn cut_joints(&self) -> impl Iterator<Item = &str> {
        let balls = self.loose_joints.iter().map(|joint| joint.name.as_str());
        balls.chain(self.closing_joints.iter().map(|joint| joint.name.as_str()))
    }

    /// Joints without play: tree joints, then loop-closing joints.
    pub fn kinematic_joints(&self) -> impl Iterator<Item = &Joint> + Clone {
        self.joints.iter().chain(&self.closing_joints)
    }

    /// Driven coordinates in index order, each with its joint.
    pub fn driven(&self) -> impl Iterator<Item = (&Joint, Freedom)> {
        let of = |joint| Joint::drives(joint).map(move |(freedom, _)| (joint, freedom));
        self.joints.iter().flat_map(of)
    }
}

/// Contents of the pose columns.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Output {
    /// Index of the body whose frame is reported.
    pub body: usize,
    /// Probe tip in that body's frame, m.
    pub probe: Option<Vec3>,
}
