//! One instant of a simulation as plain data, for the outputs and the view.

use serde::{Deserialize, Serialize};

use super::Ledger;
use crate::machine::{JointFrame, LooseKind, Mat3, Vec3};
use crate::mechanism::{Division, Part};
pub use crate::mechanism::{ElementReport, WornWall};

/// Everything that is reported about one instant. SI units, world axes.
#[derive(Clone, Debug, Default)]
pub struct Frame {
    /// Simulated time, s.
    pub time: f64,
    /// Origin of all positions, world axes, m: zero, unless the view has moved it.
    pub origin: Vec3,
    /// Bodies in scene order.
    pub bodies: Vec<BodyMotion>,
    /// Joints with play in scene order.
    pub joints: Vec<JointReport>,
    /// Places where joints with several can touch: by joint, each in the order of
    /// [`LooseKind::site_names`](crate::machine::LooseKind::site_names).
    pub sites: Vec<SiteReport>,
    /// Walls that wear by direction, by joint.
    pub worn_walls: Vec<WornWall>,
    /// Joints that close loops in scene order: force, N, at the child's point and torque, N m, on the child.
    pub closing: Vec<[Vec3; 2]>,
    /// Force elements in scene order.
    pub elements: Vec<ElementReport>,
    /// The pulling hand, if any: force from the hand on the grasped point. Only set in the displayed frame.
    pub pull: Option<ElementReport>,
    /// Coordinates of the joints that slide or turn, m or rad, each with its rate: tree joints in scene order, then joints that
    /// close loops. Angles count turns; those of the latter start between -pi and pi.
    pub coordinates: Vec<[f64; 2]>,
    /// Driven joints in scene order: actuator force, N (or torque, N m), positive along the joint axis.
    pub actuators: Vec<f64>,
    /// Fixed, sliding and turning joints in scene order: force, N, and torque about the child's joint point, N m, on the child,
    /// including its drive's. Filled only on request, that is, if there is a list here.
    pub reactions: Option<Vec<[Vec3; 2]>>,
    /// The output body.
    pub pose: Pose,
    /// Kinetic energy of all bodies, J.
    pub kinetic: f64,
    /// Gravitational plus elastic energy, J; gravity's zero is the world origin.
    pub potential: f64,
    /// The elastic part of `potential`: energy stored in contacts and springs, J.
    pub elastic: f64,
    /// Probe tip minus the tip of the ideal mechanism at the same time, m; `None` if the scene has no probe or the ideal
    /// mechanism cannot reach this instant.
    pub probe_error: Option<Vec3>,
    /// Energy exchanged since the start; `None` where `solver.energy_ledger` is off.
    pub ledger: Option<Ledger>,
}

impl Frame {
    /// Axes of a frame of a joint as columns, world axes.
    pub fn axes_of(&self, joint: &JointFrame) -> Mat3 {
        let own = joint.rotation.to_rotation_matrix().into_inner();
        joint.origin.body.and_then(|body| self.bodies.get(body)).map_or(own, |body| body.rotation * own)
    }

    /// Worn depth of cell `cell` of the part `part` of the surfaces of joint `joint` of the kind `kind`, m.
    pub fn worn_depth(&self, joint: usize, kind: &LooseKind, division: &Division, (part, cell): (&Part, usize)) -> f64 {
        let wall = self.worn_walls.iter().find(|wall| wall.joint == joint && wall.place == part.place);
        wall.map_or_else(
            || self.joints[joint].worn[kind.play_of(part.place)],
            |wall| wall.depth(&division.direction(part, cell)),
        )
    }

    /// Places of joint `joint` where it can touch; empty if there is only one.
    pub fn sites_of(&self, joint: usize) -> &[SiteReport] {
        let first = self.sites.partition_point(|site| site.joint < joint);
        let count = self.sites[first..].partition_point(|site| site.joint == joint);
        &self.sites[first..first + count]
    }
}

/// Motion of a body's frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BodyMotion {
    /// Origin of the body frame, m.
    pub position: Vec3,
    /// Body axes as columns.
    pub rotation: Mat3,
    /// Velocity of the origin, m/s.
    pub velocity: Vec3,
    /// Angular velocity, rad/s.
    pub angular_velocity: Vec3,
    /// Acceleration of the origin, m/s^2.
    pub acceleration: Vec3,
    /// Angular acceleration, rad/s^2.
    pub angular_acceleration: Vec3,
}

/// Pose of the output body with its angles, R = Rx(alpha) Rz(beta) Ry(gamma).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Origin, m.
    pub position: Vec3,
    /// (alpha, beta, gamma), rad.
    pub angles: Vec3,
    /// Velocity of the origin, m/s.
    pub velocity: Vec3,
    /// Rates of the angles, rad/s.
    pub angle_rates: Vec3,
    /// Acceleration of the origin, m/s^2.
    pub acceleration: Vec3,
    /// Second derivatives of the angles, rad/s^2.
    pub angle_accelerations: Vec3,
}

/// Contact state of a joint with play.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ContactMode {
    /// It touches nowhere.
    #[default]
    Free,
    /// In contact, sliding slower than `slip_speed_high`, where friction is below its full value: any tangential load makes the
    /// ball creep.
    Creep,
    /// In contact and sliding.
    Slip,
    /// In contact, with friction below its limit, where it has bristles: it does not slide.
    Stick,
    /// No clearance: a constraint.
    Ideal,
}

impl ContactMode {
    /// Whether it touches and carries friction.
    pub fn touches(self) -> bool {
        matches!(self, Self::Creep | Self::Slip | Self::Stick)
    }
}

/// One joint with play at one instant; what is said of a ball holds for a pin and a block, too. SI units, world axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointReport {
    /// Z_i, m.
    pub socket_centre: Vec3,
    /// Z_j, m.
    pub ball_centre: Vec3,
    /// e = Z_j - Z_i, m (5); of a pin and of a slide its part across the axis.
    pub eccentricity: Vec3,
    /// The part along the axis of the carrier, m; 0 for a ball.
    pub axial: f64,
    /// Angle by which a pin's axis is tilted in its bearing, or a block in its guide, rad; 0 for a ball.
    pub tilt: f64,
    /// Current clearance (a live change ramps it at a bounded rate), with what has worn off evenly, m.
    pub clearance: f64,
    /// By how much it has worn wider since the start, m, and its second play; where it wears by direction, the mean over its walls.
    pub worn: [f64; 2],
    /// Current second play, m: along the axis of a pin, across the second pair of walls of a guide; 0 if it has none.
    pub second_clearance: f64,
    /// delta = |e| - c, m (10), where it is deepest; 0 for an ideal joint.
    pub penetration: f64,
    /// d(delta)/dt, m/s.
    pub penetration_rate: f64,
    /// Normal force on the ball, N. For an ideal joint the whole reaction.
    pub normal_force: Vec3,
    /// Friction force on the ball, N.
    pub friction_force: Vec3,
    /// Force of the lubricant in it on the ball, N.
    pub lubricant_force: Vec3,
    /// Where the forces act on the ball, Z_j + r n, m.
    pub contact_point: Vec3,
    /// Sliding speed used by the friction law, m/s.
    pub slip_speed: f64,
    /// Sliding of the ball over the socket.
    pub sliding: Sliding,
    /// Contact state.
    pub state: ContactMode,
}

/// One place where the bodies of a joint can touch, at one instant. SI units, world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SiteReport {
    /// Joint, by its index in the scene.
    pub joint: usize,
    /// Distance to the wall, m; negative where they touch, infinite where the joint has no play.
    pub gap: f64,
    /// Normal force on the carried part, N.
    pub normal_force: Vec3,
    /// Friction force on the carried part, N.
    pub friction_force: Vec3,
    /// Where the forces act, m.
    pub contact_point: Vec3,
    /// Sliding of the carried part over the carrier there.
    pub sliding: Sliding,
}

/// Sliding of the two surfaces of a contact, and the friction that limits it; zero where they do not touch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sliding {
    /// Sliding velocity in the sense of the friction law, whether or not that exerts a force, m/s, world axes; of several contacts that
    /// of the deepest.
    pub velocity: Vec3,
    /// Largest friction force that the law allows at this normal force and sliding speed, N; of several contacts the sum.
    pub limit: f64,
}

/// The largest force on a joint with play since the peaks were last taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Peak {
    /// Largest |F_N| in continuous time, N.
    pub normal: f64,
    /// When, s.
    pub time: f64,
    /// Normal force on the ball at that instant, N, world axes.
    pub normal_force: Vec3,
    /// Number of contacts begun.
    pub impacts: u32,
    /// Largest approach speed of those impacts, m/s.
    pub approach_speed: f64,
}
