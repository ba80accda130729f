//! The typed scene, in SI units. `read.rs` builds it from a file, `parameters.rs` changes it by key.

use crate::words::{Words, words};
use std::collections::BTreeMap;
use std::sync::Arc;

use super::expression::Program;
use super::given::{FileNumber, OwnParameter};
use super::key::{FileKey, Takes};
use super::units::Dimension;
use crate::contact;
use crate::integrate::Method;
use crate::mesh::Mesh;

/// A vector in three dimensions, f64.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A 3 x 3 matrix, f64.
pub type Mat3 = nalgebra::Matrix3<f64>;
/// An orientation, f64.
pub type Quat = nalgebra::UnitQuaternion<f64>;

/// A mechanism and everything needed to simulate and draw it.
///
/// Cut every ball joint and every joint that closes a loop, and a forest remains: each body hangs on its parent by exactly one
/// entry of `joints`, and parents come before children.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Short name: that of the built-in scene, or of the file without its extension.
    pub name: String,
    /// A one-line title, for lists.
    pub title: String,
    /// A paragraph for the user.
    pub description: String,
    /// Gravity, world axes, m/s^2.
    pub gravity: Vec3,
    /// Contact parameters of every ball joint that does not override them.
    pub contact: contact::Parameters,
    /// Equations of motion.
    pub formulation: Formulation,
    /// Stepper settings.
    pub solver: Solver,
    /// Set in scenes whose sliders follow the paper's inverse kinematics.
    pub spcmm: Option<Spcmm>,
    /// Set in scenes made of repeated links.
    pub chain: Option<Chain>,
    /// How it is to be viewed.
    pub view: ViewSettings,
    /// What the pose columns report.
    pub output: Output,
    /// How the file's start values are to be understood.
    pub start: StartRule,
    /// Moving bodies, parents before children.
    pub bodies: Vec<Body>,
    /// One tree joint for each body, in body order: `joints[i].child == i`.
    pub joints: Vec<Joint>,
    /// The cut joints.
    pub ball_joints: Vec<BallJoint>,
    /// Joints that close loops: both bodies hang elsewhere. They have neither drive nor start values.
    pub closing_joints: Vec<Joint>,
    /// Force elements: springs, external loads.
    pub elements: Vec<Element>,
    /// Fixed shapes (rails, frame), world axes.
    pub fixed_shapes: Vec<Shape>,
    /// Text the scene was read from, and its origin: a reset reads it again with the changes.
    pub source: Source,
    /// Parameters changed since the file was read, in order: key and value as a user would write them.
    pub changes: Vec<(String, String)>,
}

impl Scene {
    /// Names of the joints at which trees are cut, in the order in which they are counted: ball joints, then joints that close
    /// loops.
    pub fn cut_joints(&self) -> impl Iterator<Item = &str> {
        let balls = self.ball_joints.iter().map(|joint| joint.name.as_str());
        balls.chain(self.closing_joints.iter().map(|joint| joint.name.as_str()))
    }

    /// Joints besides ball joints: those that bodies hang on, then those that close loops.
    pub fn kinematic_joints(&self) -> impl Iterator<Item = &Joint> + Clone {
        self.joints.iter().chain(&self.closing_joints)
    }

    /// Driven coordinates in the order in which they are counted, each with its joint.
    pub fn driven(&self) -> impl Iterator<Item = (&Joint, Freedom)> {
        let of = |joint| Joint::drives(joint).map(move |(freedom, _)| (joint, freedom));
        self.joints.iter().flat_map(of)
    }
}

/// How the start values of the joints are to be understood.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StartRule {
    /// Exactly as the file gives them.
    #[default]
    AsGiven,
    /// Initial guesses: the mechanism is assembled with every ball concentric with its socket at t = 0, and velocities that
    /// follow from the drives.
    Ideal,
    /// As [`Self::Ideal`], and then every ball lies on the wall of its socket where the mechanism without play would press it,
    /// as deep as that force needs.
    Settled,
}

words!(StartRule {
    AsGiven => "as-given",
    Ideal => "ideal",
    Settled => "settled",
});

/// Texts of files by the names that a scene gives them.
pub type Texts = BTreeMap<String, Arc<str>>;

/// Where a scene's text came from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Source {
    /// The file as the user named it; `None` for a built-in scene.
    pub file: Option<String>,
    /// The TOML text.
    pub text: String,
    /// Byte offsets in the text of what errors found after reading point to: each parameter given in the text, by key;
    /// `spcmm`, its section; `joint.<name>`, each ball joint (a chain's: its section).
    pub places: BTreeMap<String, usize>,
    /// Numbers from which the scene was built, by key.
    pub numbers: Arc<BTreeMap<String, FileNumber>>,
    /// The scene's own parameters, in the order of the file.
    pub own: Vec<OwnParameter>,
    /// Texts of the files beside the scene that it names, as they were when it was loaded.
    pub beside: Texts,
}

/// Formulation of the equations of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Formulation {
    /// Generalized coordinates of a spanning forest.
    Tree,
    /// All bodies, Lagrange multipliers, Baumgarte stabilisation; paper eqs. (44)-(58).
    Lagrange,
}

words!(Formulation {
    Tree => "tree",
    Lagrange => "lagrange",
});

/// A named point on the speed-accuracy front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// Fast, rough.
    Preview,
    /// The fastest that keeps impacts resolved.
    RealTime,
    /// For figures.
    Accurate,
    /// The reference for the others.
    Reference,
}

words!(Preset {
    Preview => "preview",
    RealTime => "real-time",
    Accurate => "accurate",
    Reference => "reference",
});

/// Stepper settings. An explicit method, step or tolerance takes precedence over the preset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solver {
    /// Named point; fills in what is not given.
    pub preset: Option<Preset>,
    /// Method in force.
    pub method: Method,
    /// Fixed step, s; the first step of an adaptive method.
    pub step: f64,
    /// Relative tolerance of an adaptive method.
    pub tolerance: f64,
    /// Whether the energy ledger is kept.
    pub energy_ledger: bool,
}

/// Keys of what a preset stands for, in the order of [`Preset::point`].
pub const SOLVER_KEYS: [&str; 3] = ["solver.method", "solver.step", "solver.tolerance"];

impl Preset {
    /// Method, step (s) and tolerance of the preset, chosen by measurement (`docs/tradeoff.md`).
    pub fn point(self) -> (Method, f64, f64) {
        match self {
            Self::Preview => (Method::Automatic, 10e-6, 1e-4),
            Self::RealTime => (Method::Automatic, 10e-6, 1e-6),
            Self::Accurate => (Method::Automatic, 10e-6, 1e-7),
            Self::Reference => (Method::DormandPrince5, 10e-6, 1e-11),
        }
    }
}

/// The paper's mechanism: dimensions and trajectory for its slider laws. SI units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spcmm {
    /// a1, distance along +X from O_A to the slider plane, m.
    pub slider_plane: f64,
    /// Amplitude of x, m (59).
    pub amplitude_x: f64,
    /// Amplitude of beta, rad (59).
    pub amplitude_beta: f64,
    /// Drive frequency, Hz (59): 0.5 Hz is the paper's period of 2 s.
    pub frequency: f64,
    /// Mean of x, m (59).
    pub mean_x: f64,
    /// gamma, rad (59).
    pub gamma: f64,
    /// b, hinge radius on the platform, m.
    pub hinge_radius: f64,
    /// L1, driving rod, m.
    pub driving_rod: f64,
    /// L2, driven rod, m.
    pub driven_rod: f64,
}

/// A row of equal links.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chain {
    /// Number of links.
    pub links: usize,
}

/// A world axis with its sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum SignedAxis {
    PlusX,
    MinusX,
    PlusY,
    MinusY,
    PlusZ,
    MinusZ,
}

words!(SignedAxis {
    PlusX => "+x",
    MinusX => "-x",
    PlusY => "+y",
    MinusY => "-y",
    PlusZ => "+z",
    MinusZ => "-z",
});

impl SignedAxis {
    /// Unit vector, world axes.
    pub fn unit(self) -> Vec3 {
        match self {
            Self::PlusX => Vec3::x(),
            Self::MinusX => -Vec3::x(),
            Self::PlusY => Vec3::y(),
            Self::MinusY => -Vec3::y(),
            Self::PlusZ => Vec3::z(),
            Self::MinusZ => -Vec3::z(),
        }
    }
}

/// How the scene is to be viewed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewSettings {
    /// World axis that points down on the screen.
    pub down: SignedAxis,
    /// Position of the floor grid: coordinate along `down`, m; `None` lets the view choose.
    pub floor: Option<f64>,
    /// Azimuth about the vertical and elevation of the isometric view, rad, where the usual one would hide something.
    pub isometric: Option<(f64, f64)>,
    /// Simulated seconds per second that a window begins with; `None` lets it choose.
    pub time_scale: Option<f64>,
    /// Plots that a window begins with, each one of [`PLOT_WORDS`]; `None` at first lets it choose.
    pub plots: [Option<&'static str>; MOST_PLOTS],
}

/// Most plots that a window may begin with.
pub const MOST_PLOTS: usize = 4;

/// Words for the plots of a window, in the order in which it lists them.
pub const PLOT_WORDS: [&str; 16] = [
    "normal-force",
    "friction-force",
    "eccentricity",
    "penetration",
    "position",
    "angles",
    "velocity",
    "angle-rates",
    "acceleration",
    "angle-accelerations",
    "actuator-force",
    "actuator-torque",
    "energy",
    "energy-balance",
    "probe-error",
    "tip-error",
];

/// What the pose columns report.
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    /// Index of the body whose frame is reported.
    pub body: usize,
    /// Probe tip in that body's frame, m.
    pub probe: Option<Vec3>,
}

/// A rigid body. The file places its frame; the centroid may lie elsewhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Unique name.
    pub name: String,
    /// Mass, kg.
    pub mass: f64,
    /// Centroid in the body frame, m.
    pub centre: Vec3,
    /// Inertia about the centroid, body axes, kg m^2; symmetric positive definite.
    pub inertia: Mat3,
    /// What to draw, body frame.
    pub shapes: Vec<Shape>,
    /// Density of the shapes from which mass, centroid and inertia were computed, kg/m^3; `None` where the file gives those.
    pub density: Option<f64>,
}

/// What a shape represents: the view picks its colour and material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// A part that slides.
    Slider,
    /// A part that a drive turns: a crank.
    DrivingRod,
    /// A part that follows: a coupler, a link.
    DrivenRod,
    /// The part that does the machine's work.
    Platform,
    /// A shaft, bolt or bearing.
    Pin,
    /// A measuring tip.
    Probe,
    /// What a part slides on.
    Rail,
    /// What stands still.
    Frame,
}

words!(Role {
    Slider => "slider",
    DrivingRod => "driving-rod",
    DrivenRod => "driven-rod",
    Platform => "platform",
    Pin => "pin",
    Probe => "probe",
    Rail => "rail",
    Frame => "frame",
});

/// A drawn shape in its body's frame (or the world's).
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Form and position.
    pub geometry: Geometry,
    /// What it represents; `None` leaves that to what its body does ([`Scene::body_roles`]).
    pub role: Option<Role>,
    /// Red, green and blue (sRGB), where it is not to have the colour of its role.
    pub colour: Option<[u8; 3]>,
}

/// Form and position of a shape, m.
#[derive(Clone, Debug, PartialEq)]
pub enum Geometry {
    /// Round bar with hemispherical ends.
    Capsule {
        /// One end of the axis.
        from: Vec3,
        /// Other end of the axis.
        to: Vec3,
        /// Radius.
        radius: f64,
    },
    /// Round bar with flat ends.
    Cylinder {
        /// Centre of one end.
        from: Vec3,
        /// Centre of the other end.
        to: Vec3,
        /// Radius.
        radius: f64,
    },
    /// Cone with its base at `from` and its tip at `to`.
    Cone {
        /// Centre of the base.
        from: Vec3,
        /// Tip.
        to: Vec3,
        /// Radius of the base.
        radius: f64,
    },
    /// Box along the body axes.
    Box {
        /// Centre.
        centre: Vec3,
        /// Full edge lengths.
        size: Vec3,
    },
    /// Ball.
    Sphere {
        /// Centre.
        centre: Vec3,
        /// Radius.
        radius: f64,
    },
    /// Flat plate: a polygon extruded to both sides of its plane.
    Plate {
        /// Corners in order, in one plane.
        corners: Vec<Vec3>,
        /// What fills it, as indices of corners: [`super::fill`].
        triangles: Vec<[usize; 3]>,
        /// Thickness.
        thickness: f64,
    },
    /// Triangles of a file.
    Mesh {
        /// In the file's frame and unit; shapes of the same file share them.
        mesh: Arc<Mesh>,
        /// Length of the file's unit.
        unit: f64,
        /// Origin of the file's frame.
        position: Vec3,
        /// Orientation of the file's frame.
        rotation: Quat,
    },
}

/// The joint that connects `child` to `parent`: one that the child hangs on in the tree, or one that closes a loop.
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
    /// Prescribes q(t), of two coordinates the first; `None` leaves it to the dynamics.
    pub drive: Option<Drive>,
    /// Prescribes the second of two coordinates.
    pub second_drive: Option<Drive>,
    /// Its start values; without meaning where a drive prescribes its motion.
    pub start: JointStart,
    /// Whether the view draws a pin or a rail for it.
    pub drawn: bool,
}

impl Joint {
    /// The points that it connects: the parent's, then the child's.
    pub fn points(&self) -> [Attachment; 2] {
        let parent = Attachment { body: self.parent, point: self.parent_point };
        let child = Attachment { body: Some(self.child), point: self.child_point };
        [parent, child]
    }

    /// Its driven coordinates.
    pub fn drives(&self) -> impl Iterator<Item = (Freedom, &Drive)> {
        let drives = [&self.drive, &self.second_drive];
        let coordinates = self.kind.freedoms().iter().zip(drives);
        coordinates.filter_map(|(freedom, drive)| Some((*freedom, drive.as_ref()?)))
    }

    /// Whether time alone moves its child against its parent.
    pub fn is_prescribed(&self) -> bool {
        self.kind != JointKind::Free && self.drives().count() == self.kind.freedoms().len()
    }
}

/// Kind of a tree joint.
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

/// What one coordinate of a joint measures.
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
    /// The coordinate's name in files and channels.
    pub fn word(self) -> &'static str {
        match self {
            Self::Slide => "position",
            Self::Turn | Self::TurnOfSlide | Self::FirstTurn => "angle",
            Self::SecondTurn => "child_angle",
        }
    }

    /// Whether it is an angle.
    pub fn turns(self) -> bool {
        self != Self::Slide
    }
}

impl JointKind {
    /// Its coordinates; a free joint's pose has none.
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

/// A ball-and-socket joint: ideal if its clearance is 0, otherwise a contact.
#[derive(Clone, Debug, PartialEq)]
pub struct BallJoint {
    /// Unique name.
    pub name: String,
    /// Socket centre Z_i.
    pub socket: Attachment,
    /// Ball centre Z_j.
    pub ball: Attachment,
    /// Unit vector in the socket body's frame: the drawn socket is cut open on that side, so that the rod can pass and the
    /// ball inside is visible. It has no effect on the motion.
    pub opening: Vec3,
    /// This joint's contact parameters, overrides applied.
    pub contact: contact::Parameters,
    /// Keys (without prefix) in which it differs from the scene's `contact.*`.
    pub overrides: Vec<&'static str>,
}

/// Axes to which a load keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoadAxes {
    /// Those of the world.
    World,
    /// Those of the body, with which it turns.
    Body,
}

words!(LoadAxes {
    World => "world",
    Body => "body",
});

/// Which way a spring acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpringSide {
    /// Pushes and pulls.
    Both,
    /// Pushes only, like a tyre on the ground.
    Push,
    /// Pulls only, like a rope.
    Pull,
}

words!(SpringSide {
    Both => "both",
    Push => "push",
    Pull => "pull",
});

impl SpringSide {
    /// The tension that is left of one, N.
    pub fn of(self, tension: f64) -> f64 {
        match self {
            Self::Both => tension,
            Self::Push => tension.min(0.0),
            Self::Pull => tension.max(0.0),
        }
    }
}

/// A numeric key of an element.
#[derive(Clone, Copy, Debug)]
pub struct ElementNumber {
    /// Key.
    pub key: &'static str,
    /// Its dimension.
    pub dimension: Dimension,
    /// Closed range, SI.
    pub range: (f64, f64),
    /// Value if the file gives none, infinite for no limit; `None` if it is required.
    pub default: Option<f64>,
    /// An example.
    pub like: &'static str,
    /// What it is.
    pub help: &'static str,
    /// What is different where the element acts on a hinge.
    pub on_hinge: Option<OnHinge>,
}

/// A number of an element that acts on a hinge, where it would otherwise be that of a slide.
#[derive(Clone, Copy, Debug)]
pub struct OnHinge {
    /// Key.
    pub key: &'static str,
    /// Its dimension.
    pub dimension: Dimension,
    /// An example.
    pub like: &'static str,
}

impl ElementNumber {
    /// Key, dimension and example, on a hinge or else.
    pub fn on(&self, hinge: bool) -> (&'static str, Dimension, &'static str) {
        match &self.on_hinge {
            Some(own) if hinge => (own.key, own.dimension, own.like),
            _ => (self.key, self.dimension, self.like),
        }
    }
}

/// A vector of an element.
#[derive(Debug)]
pub struct ElementVector {
    /// Key.
    pub key: &'static str,
    /// Its dimension.
    pub dimension: Dimension,
    /// Closed range of its components, SI.
    pub range: (f64, f64),
    /// Whether it points somewhere; else its components belong to three axes.
    pub direction: bool,
    /// Whether it is a unit vector, opposite to the gravity of the file where that gives none; else it is 0 there.
    pub upward: bool,
    /// What it is.
    pub help: &'static str,
}

/// A curve of an element: a number that depends on another, through points.
#[derive(Debug)]
pub struct ElementCurve {
    /// Keys: of its points, and of a file with them.
    pub keys: [&'static str; 2],
    /// Names and dimensions of both numbers, and an example.
    pub slide: CurveAxes,
    /// The same on a hinge.
    pub hinge: CurveAxes,
    /// Numbers that it takes the place of.
    pub instead_of: &'static [&'static str],
    /// What it is.
    pub help: &'static str,
}

/// Names and dimensions of the two numbers of a curve, and an example of its points.
pub type CurveAxes = ([(&'static str, Dimension); 2], &'static str);

/// Coordinates of joints that an element may act on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ElementJoint {
    /// Any.
    Any,
    /// One without a drive.
    Undriven,
}

/// What an element looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ElementLook {
    /// A coil between its points, where they differ.
    Coil,
    /// An arrow for its force.
    Arrow,
    /// A disc on the ground at its first point.
    Ground,
    /// A sleeve at its first point and a pin at its second.
    Bushing,
    /// Where its joint's coordinate ends.
    Stop,
    /// A case on its joint's axis, with an arrow in the positive sense.
    Motor,
    /// Nothing.
    Hidden,
}

/// A law of driven joints. Adding one takes a row here, and a file in `mechanism/drives` with its row there.
#[derive(Debug)]
pub struct DriveKind {
    /// Word of the file: `law = "harmonic"`.
    pub word: &'static str,
    /// What it is.
    pub help: &'static str,
    /// Its keys.
    pub keys: &'static [FileKey],
}

impl DriveKind {
    /// Rows of its numbers.
    pub(super) fn numbers(&self) -> impl Iterator<Item = &'static FileKey> + use<> {
        let number = |key: &&FileKey| matches!(key.takes, Takes::Number(..));
        self.keys.iter().filter(number)
    }
}

impl PartialEq for DriveKind {
    fn eq(&self, other: &Self) -> bool {
        self.word == other.word
    }
}

/// Law of a driven joint, q(t) with exact first and second derivatives, according to its row.
#[derive(Clone, Debug, PartialEq)]
pub struct Drive {
    /// Row.
    pub kind: &'static DriveKind,
    pub(super) numbers: Vec<f64>,
    /// What it has besides numbers.
    pub data: DriveData,
}

/// What a law has besides its numbers.
#[derive(Clone, Debug, PartialEq)]
pub enum DriveData {
    /// Nothing.
    Numbers,
    /// The coordinate, from 0, that the scene's closed form drives: with `[spcmm]` a slider of the paper's inverse
    /// kinematics (39), (59).
    Slider(usize),
    /// Harmonic terms: amplitude (m or rad), frequency (Hz), phase (rad).
    Terms(Vec<[f64; 3]>),
    /// Instants and coordinates, s and m or rad.
    Points {
        /// In the order of time.
        points: Vec<[f64; 2]>,
        /// Whether they are one period of the motion.
        repeats: bool,
    },
    /// An expression of t, s, and one of its units in SI.
    Formula(Program, f64),
}

impl Drive {
    /// A number of its row, SI.
    ///
    /// # Panics
    /// If the row has no such key.
    pub fn number(&self, key: &str) -> f64 {
        let at = self.kind.numbers().position(|of| of.name == key);
        self.numbers[at.expect("a number of the row")]
    }

    /// The coordinate, from 0, of the scene's closed form, if it follows that.
    pub fn slider(&self) -> Option<usize> {
        match self.data {
            DriveData::Slider(coordinate) => Some(coordinate),
            _ => None,
        }
    }
}

/// A kind of force element. Adding one takes a row here, and a file in `mechanism/elements` with its row there.
#[derive(Debug)]
pub struct ElementKind {
    /// Section of the file, `[[spring]]`.
    pub section: &'static str,
    /// What it is.
    pub help: &'static str,
    /// Points on bodies or the world, each `{ body, at }`.
    pub points: &'static [&'static str],
    /// Of one that acts on a coordinate of a joint, named by `joint`, instead of at points: which.
    pub joint: Option<ElementJoint>,
    /// Its numbers.
    pub numbers: &'static [ElementNumber],
    /// Its vectors.
    pub vectors: &'static [ElementVector],
    /// The frame of their components.
    pub frame: &'static str,
    /// Its orientations, none if the file gives none: key, help.
    pub rotations: &'static [(&'static str, &'static str)],
    /// A curve in place of some of its numbers, if it may have one.
    pub curve: Option<&'static ElementCurve>,
    /// A law of time, as of a drive, for its joint's coordinate or else for a length, if it may have one: key, help.
    pub law: Option<(&'static str, &'static str)>,
    /// Numbers and vectors of which at least one is needed for it to have any effect.
    pub acts_by: &'static [&'static str],
    /// Its choices: key, words with the default first, help.
    pub choices: &'static [(&'static str, &'static [&'static str], &'static str)],
    /// The number that is the frequency of its force, if it has one.
    pub frequency: Option<&'static str>,
    /// The number that tells over what length it acts, if it resists with a stiff law: see [`Scene::length_scale`].
    pub depth: Option<&'static str>,
    /// Largest force at its points that its own values give, N: without what the motion adds.
    pub force: fn(&Element) -> f64,
    /// What else its values must satisfy: the key at fault and why.
    pub fault: fn(&Element) -> Option<(&'static str, String)>,
    /// What it looks like.
    pub look: ElementLook,
}

impl PartialEq for ElementKind {
    fn eq(&self, other: &Self) -> bool {
        self.section == other.section
    }
}

/// A force element of a scene, according to its row.
#[derive(Clone, Debug, PartialEq)]
pub struct Element {
    /// Unique name.
    pub name: String,
    /// Row.
    pub kind: &'static ElementKind,
    /// In the order of the row; of one that acts on a joint, the points of parent and child that the joint connects.
    pub points: Vec<Attachment>,
    /// The coordinate that it acts on, with its joint by its index among [`Scene::kinematic_joints`].
    pub joint: Option<(usize, Freedom)>,
    /// Whether that is an angle.
    pub on_hinge: bool,
    pub(super) numbers: Vec<f64>,
    pub(super) vectors: Vec<Vec3>,
    pub(super) rotations: Vec<Quat>,
    /// Points of the curve of its row, SI, in order, if it has one.
    pub curve: Option<Vec<[f64; 2]>>,
    /// The law of its row.
    pub law: Option<Drive>,
    pub(super) choices: Vec<&'static str>,
}

impl Element {
    /// A number of its row, SI.
    ///
    /// # Panics
    /// If the row has no such key.
    pub fn number(&self, key: &str) -> f64 {
        let at = self.kind.numbers.iter().position(|of| of.key == key);
        self.numbers[at.expect("a number of the row")]
    }

    /// A vector of its row, SI.
    ///
    /// # Panics
    /// If the row has no such key.
    pub fn vector(&self, key: &str) -> Vec3 {
        let at = self.kind.vectors.iter().position(|of| of.key == key);
        self.vectors[at.expect("a vector of the row")]
    }

    /// An orientation of its row.
    ///
    /// # Panics
    /// If the row has no such key.
    pub fn rotation(&self, key: &str) -> Quat {
        let at = self.kind.rotations.iter().position(|of| of.0 == key);
        self.rotations[at.expect("an orientation of the row")]
    }

    /// A choice of its row.
    ///
    /// # Panics
    /// If the row has no such key, or other words for it.
    pub fn choice<T: Words>(&self, key: &str) -> T {
        let at = self.kind.choices.iter().position(|of| of.0 == key);
        T::of_word(self.choices[at.expect("a choice of the row")]).expect("a word of the row")
    }
}
