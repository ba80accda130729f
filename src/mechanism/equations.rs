//! What a formulation of the equations of motion answers. The rest of the house knows no more of one.

use super::kinematics::{Driven, Kinematics, Wrench};
use super::model::Model;
use crate::scene::Vec3;

/// Equations of motion in some coordinates. The `model` given is always the one that they were made for.
pub(super) trait Equations: Send {
    /// Position coordinates.
    fn positions(&self, model: &Model) -> usize;

    /// Velocity coordinates.
    fn velocities(&self, model: &Model) -> usize;

    /// Absolute scale of each component of (positions, velocities).
    fn scale<'a>(&'a self, model: &'a Model) -> &'a [f64];

    /// Treats rows of the ideal joints as dependent from now on: `rank` of them count.
    fn reveal(&mut self, rank: usize);

    /// State from the coordinates `y` of the forest, which moves as `motion` says.
    fn state_of(&self, model: &Model, y: Vec<f64>, motion: &[Kinematics]) -> Vec<f64>;

    /// Motion of the centroid frames at the latest instant; the last entry is the world.
    fn motion(&self) -> &[Kinematics];

    /// Motion that time prescribes.
    fn driven(&self) -> &Driven;

    /// Poses and velocities at (t, y).
    fn forward(&mut self, model: &Model, t: f64, y: &[f64]);

    /// Motion of the latest [`Self::forward`], and the loads on the bodies about their centroids, to be put there; the last
    /// entry of each is the world's.
    fn loads(&mut self) -> (&[Kinematics], &mut [Wrench]);

    /// Accelerations of the velocity coordinates into `dv`, under the loads in [`Self::loads`].
    fn accelerate(&mut self, model: &Model, gravity: &Vec3, t: f64, y: &[f64], dv: &mut [f64]);

    /// Leaves in [`Self::motion`] the true accelerations of the bodies for the coordinate accelerations `dv`.
    fn complete_motion(&mut self, model: &Model, y: &[f64], dv: &[f64]);

    /// T: dq/dt from the velocities in `y`.
    fn position_rate(&self, model: &Model, y: &[f64], dq: &mut [f64]);

    /// T^+: velocities from position rates at `y`.
    fn velocities_of(&self, model: &Model, y: &[f64], rate: &[f64], out: &mut [f64]);

    /// After a step: orientations back to unit length, loops closed again. Returns the closure error left, m.
    fn project(&mut self, model: &Model, t: f64, y: &mut [f64]) -> f64;

    /// Whether that closes loops.
    fn projects(&self) -> bool;

    /// Calls `visit(coordinate, velocity, angular velocity)`, both per unit rate, for the coordinates that move the point of
    /// `body` that is at `point`.
    fn visit_columns(
        &self,
        model: &Model,
        body: usize,
        point: &Vec3,
        visit: &mut dyn FnMut(usize, Vec3, Vec3),
    );

    /// Applies the inverse mass matrix under the constraints: generalised forces to accelerations, in place.
    fn apply_inverse_mass(&mut self, model: &Model, x: &mut [f64]);

    /// The same for forces that act on the coordinates `range` alone, where [`Self::is_block_diagonal`].
    fn apply_inverse_mass_within(&mut self, model: &Model, range: (usize, usize), x: &mut [f64]);

    /// Whether a force accelerates only the coordinates of the trees that it acts on.
    fn is_block_diagonal(&self) -> bool;

    /// Motion at (t, y) if it can differ from rest where all velocities in `y` are zero.
    fn motion_by_time_alone(&mut self, model: &Model, t: f64, y: &[f64]) -> Option<&[Kinematics]>;

    /// Constraint rows.
    fn rows(&self) -> usize;

    /// Independent ones among them.
    fn rank(&self) -> usize;

    /// Smallest pivot ratio of the constraints at the latest evaluation; infinite without any.
    fn least_pivot(&self) -> f64;

    /// Largest violation of a stabilised constraint at the latest evaluation, m or rad.
    fn drift(&self) -> f64;

    /// Whether the motion is a function of time alone: as many independent rows as coordinates.
    fn is_kinematic(&self, model: &Model) -> bool;

    /// Of such a motion, the side of a singular pose on which its loops are.
    fn is_right_handed(&mut self, model: &Model) -> bool;

    /// Force on the ball of the `k`-th ideal joint at the latest evaluation, N.
    fn reaction(&self, k: usize) -> Vec3;

    /// Whether it is the only one that fits the motion.
    fn is_reaction_unique(&self, k: usize) -> bool;

    /// Force (N) or torque (N m) of every actuator, with true accelerations in [`Self::motion`]. May change the loads.
    fn actuators(&mut self, model: &Model, gravity: &Vec3, out: &mut [f64]);

    /// Whether that of actuator `i` is the only one that fits the motion.
    fn is_actuator_unique(&mut self, model: &Model, gravity: &Vec3, i: usize) -> bool;

    /// Whether the drives' forces follow from the loads alone where nothing that is no function of time rides on a drive.
    fn prescribes_drives(&self) -> bool;

    /// Power of all drives, W, after an evaluation at `y` with the accelerations `dv`; `all` where some of them feel bodies whose
    /// motion is no function of time. May change the loads.
    fn drive_power(
        &mut self,
        model: &Model,
        gravity: &Vec3,
        y: &[f64],
        dv: &[f64],
        all: bool,
    ) -> f64;
}
