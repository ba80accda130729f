//! Force elements: springs, loads, stops and others that load bodies without a constraint. Their physics is in
//! `mechanism/elements`, one file for each kind.

use super::{Attachment, Drive, Freedom, Machine, Quat, Vec3};
use crate::interpolate::Interpolation;
use crate::words::words;

/// A force element.
#[derive(Clone, Debug, PartialEq)]
pub struct Element {
    /// Unique name.
    pub name: String,
    /// Kind, with its parameters.
    pub kind: ElementKind,
}

/// Kind of a force element. Adding one takes a variant here, a file in `mechanism/elements`, and its row in the scene format.
#[derive(Clone, Debug, PartialEq)]
pub enum ElementKind {
    /// Spring-damper along the line between two points.
    Spring(Spring),
    /// External force and torque on a body.
    Load(Load),
    /// Spring-damper on a joint coordinate.
    JointSpring(JointSpring),
    /// Stops at the limits of a joint coordinate.
    Stop(Stop),
    /// Three springs along and three about axes fixed in a body.
    Bushing(Bushing),
    /// Force or torque on a joint coordinate.
    Motor(Motor),
    /// Tyre of a wheel on ground that may move.
    Tyre(Tyre),
}

/// Joint coordinate on which an element acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JointCoordinate {
    /// Index of the joint among [`super::Machine::kinematic_joints`].
    pub joint: usize,
    /// The coordinate.
    pub freedom: Freedom,
}

/// Elastic characteristic of a spring.
#[derive(Clone, Debug, PartialEq)]
pub enum Elastic {
    /// preload + stiffness s, with the stretch s.
    Line {
        /// Force at zero stretch, N (N m on a hinge).
        preload: f64,
        /// Stiffness, N/m (N m/rad on a hinge).
        stiffness: f64,
    },
    /// A curve through points.
    Curve {
        /// Stretches, m (rad), and tensions, N (N m), in ascending stretch.
        points: Vec<[f64; 2]>,
        /// How it passes through them.
        interpolation: Interpolation,
    },
}

/// Tension `elastic` + `damping` dl/dt along the line between two points, restricted to one sign if the spring is one-sided.
#[derive(Clone, Debug, PartialEq)]
pub struct Spring {
    /// First point of application.
    pub from: Attachment,
    /// Second point of application, on another body.
    pub to: Attachment,
    /// Distance of the points at zero stretch, m.
    pub length: f64,
    /// Tension as a function of the stretch.
    pub elastic: Elastic,
    /// Damping, N s/m.
    pub damping: f64,
    /// Direction in which it acts.
    pub side: SpringSide,
}

/// An external load, constant or times a function of time.
#[derive(Clone, Debug, PartialEq)]
pub struct Load {
    /// Point of application, on a body.
    pub on: Attachment,
    /// Force at its point where the factor is 1, N.
    pub force: Vec3,
    /// Torque where the factor is 1, N m.
    pub torque: Vec3,
    /// Axes of both.
    pub axes: LoadAxes,
    /// Factor of both over time, a pure number; `None` for a constant load.
    pub factor: Option<Drive>,
}

/// Force or torque on the child, towards lower coordinates: `elastic` + `damping` dq/dt.
#[derive(Clone, Debug, PartialEq)]
pub struct JointSpring {
    /// Coordinate on which it acts.
    pub on: JointCoordinate,
    /// Coordinate at zero stretch, m or rad.
    pub position: f64,
    /// Tension as a function of the stretch.
    pub elastic: Elastic,
    /// Damping, N s/m or N m s/rad.
    pub damping: f64,
}

/// Stop force F = K d^1.5 (1 + a dd/dt), never below 0, with the depth d beyond a limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// Coordinate on which it acts.
    pub on: JointCoordinate,
    /// Lower limit of the coordinate, m or rad; infinite without a stop.
    pub lower: f64,
    /// Upper limit, likewise.
    pub upper: f64,
    /// Quasi-static force at `depth`, N or N m.
    pub force: f64,
    /// Reference depth, m or rad.
    pub depth: f64,
    /// Restitution of an impact at `speed`.
    pub restitution: f64,
    /// Reference impact speed, m/s or rad/s.
    pub speed: f64,
}

/// Diagonal stiffnesses and dampings along and about axes fixed in the first of two bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bushing {
    /// First point of application.
    pub from: Attachment,
    /// Second point of application, on another body.
    pub to: Attachment,
    /// Its axes in the first body.
    pub axes: Quat,
    /// Orientation of the second body relative to the first at which the torque vanishes.
    pub rotation: Quat,
    /// Stiffness, N/m.
    pub stiffness: Vec3,
    /// Damping, N s/m.
    pub damping: Vec3,
    /// Rotational stiffness, N m/rad.
    pub turning_stiffness: Vec3,
    /// Rotational damping, N m s/rad.
    pub turning_damping: Vec3,
}

/// force + stiffness (target - q) + damping (target' - q'), clamped to the limit.
#[derive(Clone, Debug, PartialEq)]
pub struct Motor {
    /// Coordinate on which it acts.
    pub on: JointCoordinate,
    /// Constant part, N or N m.
    pub force: f64,
    /// Stiffness, N/m or N m/rad.
    pub stiffness: f64,
    /// Damping, N s/m or N m s/rad.
    pub damping: f64,
    /// Largest magnitude of the force or torque; infinite for no limit.
    pub limit: f64,
    /// Target motion.
    pub target: Option<Drive>,
}

/// Tyre force k d + c dd/dt along `up` at the wheel's centre, never below 0, with the depth d of the wheel in the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct Tyre {
    /// Point of application, on a body.
    pub on: Attachment,
    /// Unit vector, world axes.
    pub up: Vec3,
    /// Height of the centre above ground at first contact, m.
    pub radius: f64,
    /// Stiffness, N/m.
    pub stiffness: f64,
    /// Damping, N s/m.
    pub damping: f64,
    /// Height of the ground along `up` above `height`; `None` is ground at rest there.
    pub ground: Option<Drive>,
    /// Coordinate along `up` at which `ground` is 0, m.
    pub height: f64,
}

/// Axes in which a load is defined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LoadAxes {
    /// World axes.
    #[default]
    World,
    /// Body axes, which turn with the body.
    Body,
}

words!(LoadAxes {
    World => "world",
    Body => "body",
});

/// Direction in which a spring acts.
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
    /// The part of a tension that this side transmits, N.
    pub fn of(self, tension: f64) -> f64 {
        match self {
            Self::Both => tension,
            Self::Push => tension.min(0.0),
            Self::Pull => tension.max(0.0),
        }
    }
}

impl Elastic {
    /// Whether the tension is ever nonzero.
    pub fn has_effect(&self) -> bool {
        match self {
            Self::Line { preload, stiffness } => *preload != 0.0 || *stiffness != 0.0,
            Self::Curve { points, .. } => points.iter().any(|point| point[1] != 0.0),
        }
    }

    /// Tension at zero stretch, N or N m; a curve is interpolated linearly.
    fn unstretched(&self) -> f64 {
        let points = match self {
            Self::Line { preload, .. } => return *preload,
            Self::Curve { points, .. } => points,
        };
        let next = points.partition_point(|point| point[0] < 0.0);
        let next = next.clamp(1, points.len() - 1);
        let ([x0, y0], [x1, y1]) = (points[next - 1], points[next]);
        y0 - x0 * (y1 - y0) / (x1 - x0)
    }
}

impl Element {
    /// Points of application in `machine`: one, or two for an element between points; of one on a joint coordinate, the parent and
    /// child points of that joint.
    pub fn points(&self, machine: &Machine) -> Vec<Attachment> {
        match &self.kind {
            ElementKind::Spring(Spring { from, to, .. }) | ElementKind::Bushing(Bushing { from, to, .. }) => {
                vec![*from, *to]
            }
            ElementKind::Load(Load { on, .. }) | ElementKind::Tyre(Tyre { on, .. }) => vec![*on],
            ElementKind::JointSpring(JointSpring { on, .. })
            | ElementKind::Stop(Stop { on, .. })
            | ElementKind::Motor(Motor { on, .. }) => {
                let joint = machine.kinematic_joints().nth(on.joint);
                joint.map_or_else(Vec::new, |joint| joint.points().to_vec())
            }
        }
    }

    /// Whether it acts between two points of its own.
    pub(crate) fn is_between_points(&self) -> bool {
        matches!(self.kind, ElementKind::Spring(_) | ElementKind::Bushing(_))
    }

    /// The joint coordinate on which it acts, if any.
    pub fn coordinate(&self) -> Option<JointCoordinate> {
        match &self.kind {
            ElementKind::JointSpring(spring) => Some(spring.on),
            ElementKind::Stop(stop) => Some(stop.on),
            ElementKind::Motor(motor) => Some(motor.on),
            ElementKind::Spring(_) | ElementKind::Load(_) | ElementKind::Bushing(_) | ElementKind::Tyre(_) => None,
        }
    }

    /// Whether it acts on an angle.
    pub(crate) fn is_on_hinge(&self) -> bool {
        self.coordinate().is_some_and(|on| on.freedom.turns())
    }

    /// The elastic law of a spring.
    pub fn elastic(&self) -> Option<&Elastic> {
        match &self.kind {
            ElementKind::Spring(spring) => Some(&spring.elastic),
            ElementKind::JointSpring(spring) => Some(&spring.elastic),
            ElementKind::Load(_)
            | ElementKind::Stop(_)
            | ElementKind::Bushing(_)
            | ElementKind::Motor(_)
            | ElementKind::Tyre(_) => None,
        }
    }

    /// The time law that it follows, if any.
    pub fn law(&self) -> Option<&Drive> {
        match &self.kind {
            ElementKind::Load(load) => load.factor.as_ref(),
            ElementKind::Motor(motor) => motor.target.as_ref(),
            ElementKind::Tyre(tyre) => tyre.ground.as_ref(),
            ElementKind::Spring(_) | ElementKind::JointSpring(_) | ElementKind::Stop(_) | ElementKind::Bushing(_) => {
                None
            }
        }
    }

    /// Largest force at its points due to its own parameters, N; contributions of the motion are excluded.
    pub fn own_force(&self) -> f64 {
        let on_hinge = self.is_on_hinge();
        match &self.kind {
            ElementKind::Spring(spring) => spring.elastic.unstretched().abs(),
            ElementKind::Load(load) => load.force.norm(),
            ElementKind::JointSpring(spring) if !on_hinge => spring.elastic.unstretched().abs(),
            ElementKind::Motor(motor) if !on_hinge => motor.force.abs().min(motor.limit),
            ElementKind::JointSpring(_)
            | ElementKind::Motor(_)
            | ElementKind::Stop(_)
            | ElementKind::Bushing(_)
            | ElementKind::Tyre(_) => 0.0,
        }
    }
}

impl ElementKind {
    /// Name of the kind in a scene file.
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
