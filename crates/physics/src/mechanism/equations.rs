//! Interface of a formulation of the equations of motion; no other module depends on the details of one.

use super::kinematics::{Driven, Kinematics, Wrench};
use super::model::{BodyIndex, Model, Site};
use super::path::Path;
use crate::machine::{Mat3, Vec3};

/// Smallest acceptable pivot ratio of the constraints: below it they determine the motion to fewer than four digits.
pub(super) const LEAST_PIVOT: f64 = 1e-12;
/// The same limit once steps have collapsed to rounding level: below it, the pose is singular.
pub(super) const NEARLY_DEPENDENT: f64 = 1e-6;

/// Equations of motion in some set of coordinates. The `model` passed in is always the one they were built from.
pub(super) trait Equations: Send + Sync {
    /// Position coordinates.
    fn positions(&self, model: &Model) -> usize;

    /// Velocity coordinates.
    fn velocities(&self, model: &Model) -> usize;

    /// Absolute scale of each component of (positions, velocities).
    fn scale<'a>(&'a self, model: &'a Model) -> &'a [f64];

    /// From now on treats the constraint rows as dependent, with rank `rank`.
    fn treat_as_dependent(&mut self, rank: usize);

    /// Converts tree coordinates `y`, with the corresponding `motion`, to a state of this formulation.
    fn state_of(&self, model: &Model, y: Vec<f64>, motion: &[Kinematics]) -> Vec<f64>;

    /// Motion of the centroid frames at the latest instant; the last entry is the world.
    fn motion(&self) -> &[Kinematics];

    /// Motion prescribed as a function of time.
    fn driven(&self) -> &Driven;

    /// The same, to prepare later instants.
    fn driven_mut(&mut self) -> &mut Driven;

    /// Coordinate and rate of the joint above body `b`, after an evaluation at `y`: m and m/s, or rad and rad/s; `None` if the
    /// joint neither slides nor turns.
    fn coordinate(&self, model: &Model, y: &[f64], b: BodyIndex) -> Option<[f64; 2]>;

    /// Poses and velocities at (t, y).
    fn update_kinematics(&mut self, model: &Model, t: f64, y: &[f64]);

    /// Lets evaluations skip the bodies for which `suspended` holds, if [`Self::is_block_diagonal`]: free bodies that are trees
    /// of their own. Their components of derivatives are left unchanged, and their motion is that of the latest
    /// [`Self::update_kinematics`] or [`Self::update_suspended`].
    fn suspend(&mut self, _asleep: &dyn Fn(BodyIndex) -> bool) {}

    /// [`Self::update_kinematics`] for the active bodies.
    fn update_active(&mut self, model: &Model, t: f64, y: &[f64]) {
        self.update_kinematics(model, t, y);
    }

    /// The same for the suspended bodies, after [`Self::update_active`] at this instant.
    fn update_suspended(&mut self, _model: &Model, _y: &[f64]) {}

    /// Bodies that determine the gap at `site`; `None` if they are nearly all that [`Self::update_kinematics`] moves.
    fn path(&self, model: &Model, site: &Site) -> Option<Path>;

    /// [`Self::update_kinematics`] for the bodies on `path` alone.
    fn update_along(&mut self, model: &Model, t: f64, y: &[f64], path: &Path);

    /// Motion of the latest [`Self::update_kinematics`], and the loads on the bodies about their centroids, to be filled in by
    /// the caller. The last entry of each is the world's.
    fn loads(&mut self) -> (&[Kinematics], &mut [Wrench]);

    /// Writes the accelerations of the velocity coordinates under the loads in [`Self::loads`] to `dv`.
    fn accelerate(&mut self, model: &Model, gravity: &Vec3, t: f64, y: &[f64], dv: &mut [f64]);

    /// Writes the bodies' true accelerations for the coordinate accelerations `dv` to [`Self::motion`].
    fn complete_motion(&mut self, model: &Model, y: &[f64], dv: &[f64]);

    /// T: dq/dt from the velocities in `y`.
    fn position_rate(&self, model: &Model, y: &[f64], dq: &mut [f64]);

    /// T^+: velocities from position rates at `y`.
    fn velocities_of(&self, model: &Model, y: &[f64], rate: &[f64], out: &mut [f64]);

    /// Moves the positions in `y` by the velocity-space displacement `step` (rotations by their rotation vectors).
    fn displace(&self, model: &Model, y: &mut [f64], step: &[f64]);

    /// Projects the state after a step: quaternions to unit length, loops closed. Returns the remaining closure error, m or rad.
    fn project(&mut self, model: &Model, t: f64, y: &mut [f64]) -> f64;

    /// Whether this projection closes loops.
    fn projects(&self) -> bool;

    /// Calls `visit(coordinate, velocity, angular velocity)`, both per unit rate, for each coordinate that moves the point
    /// `point` of `body`.
    fn visit_columns(&self, model: &Model, body: usize, point: &Vec3, visit: &mut dyn FnMut(usize, Vec3, Vec3));

    /// Applies the constrained inverse mass matrix: generalised forces to accelerations, in place.
    fn apply_inverse_mass(&mut self, model: &Model, x: &mut [f64]);

    /// Inverse mass, 1/kg, and inverse inertia in world axes, 1/(kg m^2), of the free body with six coordinates from `first` on,
    /// if its accelerations depend on the forces on it alone.
    fn free_body_inverse_mass(&self, model: &Model, first: usize) -> Option<(f64, Mat3)>;

    /// The same for forces on the coordinates `range` only, if [`Self::is_block_diagonal`].
    fn apply_inverse_mass_within(&mut self, model: &Model, range: (usize, usize), x: &mut [f64]);

    /// Whether a force accelerates only the coordinates of the trees it acts on.
    fn is_block_diagonal(&self) -> bool;

    /// Constraint rows.
    fn rows(&self) -> usize;

    /// Independent constraint rows.
    fn rank(&self) -> usize;

    /// Smallest pivot ratio of the constraints at the latest evaluation; infinite without any.
    fn least_pivot(&self) -> f64;

    /// Whether the constraints no longer determine the motion at the latest evaluation. A formulation that closes its loops after
    /// every step passes through such poses.
    fn is_undetermined(&self) -> bool;

    /// Largest violation of a stabilised constraint at the latest evaluation, m or rad.
    fn drift(&self) -> f64;

    /// Whether the motion is a function of time alone: as many independent rows as coordinates.
    fn is_kinematic(&self, model: &Model) -> bool;

    /// For such a motion: whether the determinant of the loops' Jacobian is positive. Its sign changes across a singular pose.
    fn is_determinant_positive(&mut self, model: &Model) -> bool;

    /// Force, N, at the child's point and torque, N m, exerted on its child at the latest evaluation by the `k`-th joint that closes
    /// a loop, counted as [`Model::closed_joints`].
    fn closing_load(&self, k: usize) -> [Vec3; 2];

    /// Whether that load is unique.
    fn is_closing_load_unique(&self, k: usize) -> bool;

    /// Changes of that load that the motion does not determine, each up to a factor.
    fn null_closing_loads(&self, k: usize) -> Vec<[Vec3; 2]>;

    /// Force (N) or torque (N m) of every actuator, given the true accelerations in [`Self::motion`].
    fn actuator_forces(&mut self, model: &Model, gravity: &Vec3, out: &mut [f64]);

    /// The motion, and the force and torque about each body's centroid exerted on it by the joint above it, actuators included,
    /// after [`Self::actuator_forces`].
    fn joint_loads(&mut self) -> (&[Kinematics], &[Wrench]);

    /// Whether the force or torque of actuator `i` is unique.
    fn is_actuator_unique(&mut self, model: &Model, gravity: &Vec3, i: usize) -> bool;

    /// Whether the drive forces follow from the loads alone if the motion of everything carried by a drive is a function of time.
    fn prescribes_drives(&self) -> bool;

    /// Power of all drives, W, after an evaluation at `y` with the accelerations `dv`. Set `all` if some drives are loaded by
    /// bodies whose motion is not a function of time alone. May change the accelerations in [`Self::motion`].
    fn drive_power(&mut self, model: &Model, gravity: &Vec3, y: &[f64], dv: &[f64], all: bool) -> f64;
}
