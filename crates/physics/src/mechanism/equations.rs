//! Interface of a formulation of the equations of motion. No other module knows more about one.

use super::kinematics::{Driven, Kinematics, Wrench};
use super::model::{BallJoint, BodyIndex, Model};
use super::path::Path;
use crate::machine::Vec3;

/// Smallest pivot ratio of the constraints: below it they determine the motion to fewer than four digits.
pub(super) const LEAST_PIVOT: f64 = 1e-12;
/// The same where steps have become as short as rounding: below it the pose is the reason.
pub(super) const NEARLY_DEPENDENT: f64 = 1e-6;

/// Equations of motion in some coordinates. The `model` passed in is always the one they were made for.
pub(super) trait Equations: Send {
    /// Position coordinates.
    fn positions(&self, model: &Model) -> usize;

    /// Velocity coordinates.
    fn velocities(&self, model: &Model) -> usize;

    /// Absolute scale of each component of (positions, velocities).
    fn scale<'a>(&'a self, model: &'a Model) -> &'a [f64];

    /// Treats the rows of the joints that close loops as dependent from now on, with rank `rank`.
    fn treat_as_dependent(&mut self, rank: usize);

    /// State for the forest's coordinates `y` and the motion `motion` that goes with them.
    fn state_of(&self, model: &Model, y: Vec<f64>, motion: &[Kinematics]) -> Vec<f64>;

    /// Motion of the centroid frames at the latest instant; the last entry is the world.
    fn motion(&self) -> &[Kinematics];

    /// Motion prescribed by time.
    fn driven(&self) -> &Driven;

    /// Coordinate of the joint above body `b` and its rate, after an evaluation at `y`: m and m/s, or rad and rad/s; `None`
    /// if the joint does not slide or turn.
    fn coordinate(&self, model: &Model, y: &[f64], b: BodyIndex) -> Option<[f64; 2]>;

    /// Poses and velocities at (t, y).
    fn update_kinematics(&mut self, model: &Model, t: f64, y: &[f64]);

    /// Lets evaluations leave out the bodies for which `asleep` holds, if [`Self::is_block_diagonal`]: free bodies, each a
    /// tree of its own. Their components of derivatives stay as they are, and their motion is that of the latest
    /// [`Self::update_kinematics`] or [`Self::update_asleep`].
    fn suspend(&mut self, _asleep: &dyn Fn(BodyIndex) -> bool) {}

    /// [`Self::update_kinematics`] for the bodies that are awake.
    fn update_awake(&mut self, model: &Model, t: f64, y: &[f64]) {
        self.update_kinematics(model, t, y);
    }

    /// The same for the others, after [`Self::update_awake`] at this instant.
    fn update_asleep(&mut self, _model: &Model, _y: &[f64]) {}

    /// What moves the gap of `joint`, unless it is about as much as [`Self::update_kinematics`] moves.
    fn path(&self, model: &Model, joint: &BallJoint) -> Option<Path>;

    /// [`Self::update_kinematics`] for the bodies on `path` alone.
    fn update_along(&mut self, model: &Model, t: f64, y: &[f64], path: &Path);

    /// Motion of the latest [`Self::update_kinematics`], and the loads on the bodies about their centroids, for the caller to
    /// fill in; the last entry of each is the world's.
    fn loads(&mut self) -> (&[Kinematics], &mut [Wrench]);

    /// Accelerations of the velocity coordinates into `dv`, under the loads in [`Self::loads`].
    fn accelerate(&mut self, model: &Model, gravity: &Vec3, t: f64, y: &[f64], dv: &mut [f64]);

    /// Writes the bodies' true accelerations for the coordinate accelerations `dv` to [`Self::motion`].
    fn complete_motion(&mut self, model: &Model, y: &[f64], dv: &[f64]);

    /// T: dq/dt from the velocities in `y`.
    fn position_rate(&self, model: &Model, y: &[f64], dq: &mut [f64]);

    /// T^+: velocities from position rates at `y`.
    fn velocities_of(&self, model: &Model, y: &[f64], rate: &[f64], out: &mut [f64]);

    /// Projects the state after a step: quaternions to unit length, loops closed. Returns the remaining closure error, m
    /// or rad.
    fn project(&mut self, model: &Model, t: f64, y: &mut [f64]) -> f64;

    /// Whether this projection closes loops.
    fn projects(&self) -> bool;

    /// Calls `visit(coordinate, velocity, angular velocity)`, both per unit rate, for each coordinate that moves the point of
    /// `body` located at `point`.
    fn visit_columns(&self, model: &Model, body: usize, point: &Vec3, visit: &mut dyn FnMut(usize, Vec3, Vec3));

    /// Applies the constrained inverse mass matrix: generalised forces to accelerations, in place.
    fn apply_inverse_mass(&mut self, model: &Model, x: &mut [f64]);

    /// The same for forces that act only on the coordinates `range`, if [`Self::is_block_diagonal`].
    fn apply_inverse_mass_within(&mut self, model: &Model, range: (usize, usize), x: &mut [f64]);

    /// Whether a force accelerates only the coordinates of the trees it acts on.
    fn is_block_diagonal(&self) -> bool;

    /// Motion at (t, y) of what is awake, if bodies can move even with all velocities in `y` zero.
    fn prescribed_motion(&mut self, model: &Model, t: f64, y: &[f64]) -> Option<&[Kinematics]>;

    /// Constraint rows.
    fn rows(&self) -> usize;

    /// Independent constraint rows.
    fn rank(&self) -> usize;

    /// Smallest pivot ratio of the constraints at the latest evaluation; infinite without any.
    fn least_pivot(&self) -> f64;

    /// Whether the constraints no longer determine the motion at the latest evaluation. A form that closes its loops after
    /// every step passes such poses.
    fn is_undetermined(&self) -> bool;

    /// Largest violation of a stabilised constraint at the latest evaluation, m or rad.
    fn drift(&self) -> f64;

    /// Whether the motion is a function of time alone: as many independent rows as coordinates.
    fn is_kinematic(&self, model: &Model) -> bool;

    /// For such a motion: the determinant of the loops' Jacobian, whose sign tells the side of a singular pose.
    fn is_determinant_positive(&mut self, model: &Model) -> bool;

    /// Force on the ball of the `k`-th ideal joint at the latest evaluation, N.
    fn reaction(&self, k: usize) -> Vec3;

    /// Whether that reaction is unique.
    fn is_reaction_unique(&self, k: usize) -> bool;

    /// Force, N, at the child's point and torque, N m, that the `c`-th joint that closes a loop exerts on its child at the latest
    /// evaluation.
    fn closure_load(&self, c: usize) -> [Vec3; 2];

    /// Whether these are unique.
    fn is_closure_unique(&self, c: usize) -> bool;

    /// Force (N) or torque (N m) of every actuator, given true accelerations in [`Self::motion`].
    fn actuators(&mut self, model: &Model, gravity: &Vec3, out: &mut [f64]);

    /// The motion, and force and torque about its centroid that the joint above each body exerts on it, actuators included,
    /// after [`Self::actuators`].
    fn joint_loads(&mut self) -> (&[Kinematics], &[Wrench]);

    /// Whether the force or torque of actuator `i` is unique.
    fn is_actuator_unique(&mut self, model: &Model, gravity: &Vec3, i: usize) -> bool;

    /// Whether the drive forces follow from the loads alone if everything carried by a drive moves as a function of time.
    fn prescribes_drives(&self) -> bool;

    /// Power of all drives, W, after an evaluation at `y` with the accelerations `dv`; `all` if some of them are loaded by
    /// bodies whose motion is not a function of time alone. May change the accelerations in [`Self::motion`].
    fn drive_power(&mut self, model: &Model, gravity: &Vec3, y: &[f64], dv: &[f64], all: bool) -> f64;
}
