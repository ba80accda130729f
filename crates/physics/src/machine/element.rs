//! Force elements: springs, loads, stops and others that load bodies without a constraint. Their physics is in
//! `mechanism/elements`, one file for each kind.

use super::{Attachment, Drive, Freedom, LooseJoint, LooseKind, Machine, Quat, Vec3};
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

/// Kind of a force element. Adding one takes a variant here with its [`Description`], a file in `mechanism/elements`, and its row
/// in the scene format.
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
    /// Lubricant in a joint with play.
    Lubricant(Lubricant),
}

/// Joint coordinate on which an element acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JointCoordinate {
    /// Index of the joint among [`super::Machine::kinematic_joints`].
    pub joint: usize,
    /// The coordinate.
    pub freedom: Freedom,
}

/// Force of a spring by its stretch, m (rad on a hinge), or of a damper by the rate of that, m/s (rad/s).
#[derive(Clone, Debug, PartialEq)]
pub enum Characteristic {
    /// offset + slope x, with the stretch or the rate x.
    Line {
        /// Force at 0, N (N m on a hinge): the preload of a spring, 0 for a damper.
        offset: f64,
        /// Stiffness, N/m (N m/rad on a hinge), or damping, N s/m (N m s/rad).
        slope: f64,
    },
    /// A curve through points.
    Curve {
        /// Stretches or rates, and forces, N (N m), with increasing first coordinates.
        points: Vec<[f64; 2]>,
        /// How it passes through them.
        interpolation: Interpolation,
    },
}

/// Tension `elastic`(l - `length`) + `damping`(dl/dt) along the line between two points at the distance l, restricted to one sign
/// if the spring is one-sided.
#[derive(Clone, Debug, PartialEq)]
pub struct Spring {
    /// First point of application.
    pub from: Attachment,
    /// Second point of application, on another body.
    pub to: Attachment,
    /// Distance of the points at zero stretch, m.
    pub length: f64,
    /// Tension as a function of the stretch.
    pub elastic: Characteristic,
    /// Tension as a function of the rate of the distance.
    pub damping: Characteristic,
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

/// Force or torque on the child, towards lower coordinates q: `elastic`(q - `position`) + `damping`(dq/dt).
#[derive(Clone, Debug, PartialEq)]
pub struct JointSpring {
    /// Coordinate on which it acts.
    pub on: JointCoordinate,
    /// Coordinate at zero stretch, m or rad.
    pub position: f64,
    /// Force or torque as a function of the stretch.
    pub elastic: Characteristic,
    /// Force or torque as a function of the rate of the coordinate.
    pub damping: Characteristic,
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

/// Lubricant between ball and socket, or pin and bearing, of a joint with play; without effect while that is ideal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lubricant {
    /// Index of the joint among [`super::Machine::loose_joints`].
    pub joint: usize,
    /// Dynamic viscosity, Pa s.
    pub viscosity: f64,
    /// Thickness below which its film does not fall, as the surfaces are rough, m.
    pub thickness: f64,
    /// Length of the film along a pin, m; `None` for that of the joint.
    pub length: Option<f64>,
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

impl Characteristic {
    /// A line through 0 with this slope.
    pub const fn linear(slope: f64) -> Self {
        Self::Line { offset: 0.0, slope }
    }

    /// Whether the force is ever nonzero.
    pub fn has_effect(&self) -> bool {
        match self {
            Self::Line { offset, slope } => *offset != 0.0 || *slope != 0.0,
            Self::Curve { points, .. } => points.iter().any(|point| point[1] != 0.0),
        }
    }

    /// Force at 0, N or N m; a curve is interpolated linearly.
    fn at_zero(&self) -> f64 {
        let points = match self {
            Self::Line { offset, .. } => return *offset,
            Self::Curve { points, .. } => points,
        };
        let next = points.partition_point(|point| point[0] < 0.0);
        let next = next.clamp(1, points.len() - 1);
        let ([x0, y0], [x1, y1]) = (points[next - 1], points[next]);
        y0 - x0 * (y1 - y0) / (x1 - x0)
    }
}

impl Lubricant {
    /// Whether its joint can hold it, and its numbers are a lubricant's.
    pub(super) fn is_held(&self, machine: &Machine) -> bool {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        let holds = |joint: &LooseJoint| match joint.kind {
            LooseKind::Ball => self.length.is_none(),
            LooseKind::Pin(_) => self.length.or(joint.pin_length()).is_some_and(positive),
            LooseKind::Slide(_) => false,
        };
        let joint = machine.loose_joints.get(self.joint);
        joint.is_some_and(holds) && self.viscosity >= 0.0 && self.viscosity.is_finite() && positive(self.thickness)
    }
}

/// Where an element acts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// At a point of a body.
    Point(Attachment),
    /// Between points of two bodies.
    Between([Attachment; 2]),
    /// On a coordinate of a joint.
    Coordinate(JointCoordinate),
    /// In a joint with play: its index among [`super::Machine::loose_joints`].
    Loose(usize),
}

/// What an element says of itself, whatever its kind.
#[derive(Clone, Copy, Debug)]
pub struct Description<'a> {
    /// Name of the kind in a scene file.
    pub word: &'static str,
    /// Where it acts.
    pub place: Place,
    /// Elastic and damping force of a spring.
    pub spring: Option<[&'a Characteristic; 2]>,
    /// Time law that it follows, if any, with its key in a scene file.
    pub law: Option<(&'static str, &'a Drive)>,
    /// Magnitude of a force that depends on neither motion nor time, N or N m.
    pub constant_force: f64,
    /// Depth at which a stop exerts the force given for it, m or rad.
    pub stop_depth: Option<f64>,
    /// Whether it is a load from outside the machine.
    pub is_external: bool,
}

impl Element {
    /// What it says of itself.
    pub fn describe(&self) -> Description<'_> {
        let of = |word, place| Description {
            word,
            place,
            spring: None,
            law: None,
            constant_force: 0.0,
            stop_depth: None,
            is_external: false,
        };
        match &self.kind {
            ElementKind::Spring(spring) => Description {
                spring: Some([&spring.elastic, &spring.damping]),
                ..of("spring", Place::Between([spring.from, spring.to]))
            },
            ElementKind::Load(load) => Description {
                law: load.factor.as_ref().map(|factor| ("factor", factor)),
                constant_force: load.force.norm(),
                is_external: true,
                ..of("load", Place::Point(load.on))
            },
            ElementKind::JointSpring(spring) => Description {
                spring: Some([&spring.elastic, &spring.damping]),
                ..of("joint_spring", Place::Coordinate(spring.on))
            },
            ElementKind::Stop(stop) => {
                Description { stop_depth: Some(stop.depth), ..of("stop", Place::Coordinate(stop.on)) }
            }
            ElementKind::Bushing(bushing) => of("bushing", Place::Between([bushing.from, bushing.to])),
            ElementKind::Motor(motor) => Description {
                law: motor.target.as_ref().map(|target| ("target", target)),
                constant_force: motor.force.abs().min(motor.limit),
                ..of("motor", Place::Coordinate(motor.on))
            },
            ElementKind::Tyre(tyre) => Description {
                law: tyre.ground.as_ref().map(|ground| ("ground", ground)),
                ..of("tyre", Place::Point(tyre.on))
            },
            ElementKind::Lubricant(film) => of("lubricant", Place::Loose(film.joint)),
        }
    }

    /// The time law of its [`Description`].
    pub fn law_mut(&mut self) -> Option<&mut Drive> {
        match &mut self.kind {
            ElementKind::Load(load) => load.factor.as_mut(),
            ElementKind::Motor(motor) => motor.target.as_mut(),
            ElementKind::Tyre(tyre) => tyre.ground.as_mut(),
            ElementKind::Spring(_)
            | ElementKind::JointSpring(_)
            | ElementKind::Stop(_)
            | ElementKind::Bushing(_)
            | ElementKind::Lubricant(_) => None,
        }
    }

    /// Points of application in `machine`: one, or two for an element between points; of one on a joint coordinate or in a joint, the
    /// points of that joint.
    pub fn points(&self, machine: &Machine) -> Vec<Attachment> {
        match self.describe().place {
            Place::Point(point) => vec![point],
            Place::Between(points) => points.to_vec(),
            Place::Loose(joint) => {
                machine.loose_joints.get(joint).map_or_else(Vec::new, |joint| vec![joint.carrier(), joint.carried()])
            }
            Place::Coordinate(on) => {
                let joint = machine.kinematic_joints().nth(on.joint);
                joint.map_or_else(Vec::new, |joint| joint.points().to_vec())
            }
        }
    }

    /// The joint coordinate on which it acts, if any.
    pub fn coordinate(&self) -> Option<JointCoordinate> {
        match self.describe().place {
            Place::Coordinate(on) => Some(on),
            Place::Point(_) | Place::Between(_) | Place::Loose(_) => None,
        }
    }

    /// Whether it acts on an angle.
    pub(crate) fn is_on_hinge(&self) -> bool {
        self.coordinate().is_some_and(|on| on.freedom.turns())
    }

    /// Largest force at its points due to its own parameters, N; contributions of the motion are excluded.
    pub fn own_force(&self) -> f64 {
        let Description { spring, constant_force, .. } = self.describe();
        match spring {
            _ if self.is_on_hinge() => 0.0,
            Some([elastic, _]) => elastic.at_zero().abs(),
            None => constant_force,
        }
    }
}
