//! Force elements: springs, loads, stops and whatever else loads bodies without a constraint. Their physics is in
//! `mechanism/elements`, one file for each kind.

use super::{Attachment, Drive, Freedom, Quat, Vec3};
use crate::words::words;

/// A force element.
#[derive(Clone, Debug, PartialEq)]
pub struct Element {
    /// Unique name.
    pub name: String,
    /// What it is.
    pub kind: ElementKind,
    /// Where it acts: at one point, or between two; of one that acts on a coordinate, the points of parent and child that the joint
    /// connects.
    pub points: Vec<Attachment>,
}

/// Kind of a force element. Adding one takes a variant here, a file in `mechanism/elements`, and its row in the scene format.
#[derive(Clone, Debug, PartialEq)]
pub enum ElementKind {
    /// Spring with a damper along the line between two points.
    Spring(Spring),
    /// Force and torque from outside on a body.
    Load(Load),
    /// Spring with a damper on a coordinate of a joint.
    JointSpring(JointSpring),
    /// Stops at the ends of a coordinate of a joint.
    Stop(Stop),
    /// Three springs along and three about axes fixed in a body.
    Bushing(Bushing),
    /// Force or torque on a coordinate of a joint.
    Motor(Motor),
    /// Tyre of a wheel on a ground that may move.
    Tyre(Tyre),
}

/// A coordinate of a joint on which an element acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JointCoordinate {
    /// Index of the joint among [`super::Machine::kinematic_joints`].
    pub joint: usize,
    /// Which of its coordinates.
    pub freedom: Freedom,
}

/// What a spring exerts without its damper.
#[derive(Clone, Debug, PartialEq)]
pub enum Elastic {
    /// preload + stiffness s at a stretch s.
    Line {
        /// N (N m on a hinge).
        preload: f64,
        /// N/m (N m/rad on a hinge).
        stiffness: f64,
    },
    /// A curve through points: stretch, m (rad), and tension, N (N m), in the order of the stretch.
    Curve(Vec<[f64; 2]>),
}

/// Tension `elastic` + `damping` dl/dt along the line between two points, of which only part is left where it acts one way.
#[derive(Clone, Debug, PartialEq)]
pub struct Spring {
    /// Distance of the points from which the stretch counts, m.
    pub length: f64,
    /// By the stretch.
    pub elastic: Elastic,
    /// N s/m.
    pub damping: f64,
    /// Which way it acts.
    pub side: SpringSide,
}

/// Constant where the frequency is 0, otherwise times sin(2 pi frequency t + phase).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// At its point, N.
    pub force: Vec3,
    /// N m.
    pub torque: Vec3,
    /// In which both are constant.
    pub axes: LoadAxes,
    /// Hz.
    pub frequency: f64,
    /// rad.
    pub phase: f64,
}

/// Force or torque on the child, towards lower coordinates: `elastic` + `damping` dq/dt.
#[derive(Clone, Debug, PartialEq)]
pub struct JointSpring {
    /// On which it acts.
    pub on: JointCoordinate,
    /// Coordinate from which the stretch counts, m or rad.
    pub position: f64,
    /// By the stretch.
    pub elastic: Elastic,
    /// N s/m or N m s/rad.
    pub damping: f64,
}

/// F = K d^1.5 (1 + a dd/dt), never below 0, d the depth beyond a limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// On which it acts.
    pub on: JointCoordinate,
    /// Coordinates at which the stops begin, m or rad; infinite where there is none.
    pub lower: f64,
    /// As `lower`.
    pub upper: f64,
    /// What a stop bears when it is pressed in slowly by `depth`, N or N m.
    pub force: f64,
    /// m or rad.
    pub depth: f64,
    /// Speed after over speed before an impact at `speed`.
    pub restitution: f64,
    /// m/s or rad/s.
    pub speed: f64,
}

/// Diagonal stiffnesses and dampings along and about axes fixed in the first of two bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bushing {
    /// Its axes in the first body.
    pub axes: Quat,
    /// Orientation of the second body in the first in which it exerts no torque.
    pub rotation: Quat,
    /// N/m.
    pub stiffness: Vec3,
    /// N s/m.
    pub damping: Vec3,
    /// N m/rad.
    pub turning_stiffness: Vec3,
    /// N m s/rad.
    pub turning_damping: Vec3,
}

/// force + stiffness (target - q) + damping (target' - q'), clamped to the limit.
#[derive(Clone, Debug, PartialEq)]
pub struct Motor {
    /// On which it acts.
    pub on: JointCoordinate,
    /// Constant part, N or N m.
    pub force: f64,
    /// N/m or N m/rad.
    pub stiffness: f64,
    /// N s/m or N m s/rad.
    pub damping: f64,
    /// Largest force or torque, either way; infinite for no limit.
    pub limit: f64,
    /// Motion that it is to follow.
    pub target: Option<Drive>,
}

/// k d + c dd/dt along `up` at the wheel's centre, never below 0, d the depth of the wheel in the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct Tyre {
    /// Unit vector, world axes.
    pub up: Vec3,
    /// Height of the centre over the ground at which it begins to push, m.
    pub radius: f64,
    /// N/m.
    pub stiffness: f64,
    /// N s/m.
    pub damping: f64,
    /// Height of the ground along `up`; at rest in the origin if there is none.
    pub ground: Option<Drive>,
}

/// Axes in which a load is constant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LoadAxes {
    /// Those of the world.
    #[default]
    World,
    /// Those of the body, with which it turns.
    Body,
}

words!(LoadAxes {
    World => "world",
    Body => "body",
});

/// Which way a spring acts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SpringSide {
    /// Pushes and pulls.
    #[default]
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

impl Elastic {
    /// Whether it ever exerts anything.
    pub fn acts(&self) -> bool {
        match self {
            Self::Line { preload, stiffness } => *preload != 0.0 || *stiffness != 0.0,
            Self::Curve(points) => points.iter().any(|point| point[1] != 0.0),
        }
    }

    /// Tension where the stretch is 0, N or N m: of a curve, on the line between the points about that.
    fn unstretched(&self) -> f64 {
        let points = match self {
            Self::Line { preload, .. } => return *preload,
            Self::Curve(points) => points,
        };
        let next = points.partition_point(|point| point[0] < 0.0);
        let next = next.clamp(1, points.len() - 1);
        let ([x0, y0], [x1, y1]) = (points[next - 1], points[next]);
        y0 - x0 * (y1 - y0) / (x1 - x0)
    }
}

impl Element {
    /// The coordinate on which it acts, of one that acts on a joint.
    pub fn coordinate(&self) -> Option<JointCoordinate> {
        match &self.kind {
            ElementKind::JointSpring(spring) => Some(spring.on),
            ElementKind::Stop(stop) => Some(stop.on),
            ElementKind::Motor(motor) => Some(motor.on),
            ElementKind::Spring(_) | ElementKind::Load(_) | ElementKind::Bushing(_) | ElementKind::Tyre(_) => None,
        }
    }

    /// Whether it acts on an angle.
    pub fn is_on_hinge(&self) -> bool {
        self.coordinate().is_some_and(|on| on.freedom.turns())
    }

    /// The law of time that it follows, if any.
    pub fn law(&self) -> Option<&Drive> {
        match &self.kind {
            ElementKind::Motor(motor) => motor.target.as_ref(),
            ElementKind::Tyre(tyre) => tyre.ground.as_ref(),
            _ => None,
        }
    }

    /// Largest force at its points that its own values give, N: without what the motion adds.
    pub fn own_force(&self) -> f64 {
        let on_hinge = self.is_on_hinge();
        match &self.kind {
            ElementKind::Spring(spring) => spring.elastic.unstretched().abs(),
            ElementKind::Load(load) => load.force.norm(),
            ElementKind::JointSpring(spring) if !on_hinge => spring.elastic.unstretched().abs(),
            ElementKind::Motor(motor) if !on_hinge => motor.force.abs().min(motor.limit),
            _ => 0.0,
        }
    }
}

impl ElementKind {
    /// Its word, that of its section in a scene file.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Spring(_) => "spring",
            Self::Load(_) => "load",
            Self::JointSpring(_) => "joint_spring",
            Self::Stop(_) => "stop",
            Self::Bushing(_) => "bushing",
            Self::Motor(_) => "motor",
            Self::Tyre(_) => "tyre",
        }
    }
}
