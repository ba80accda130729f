//! A machine whose drives stand still: its pose without play, and its position of rest with play.

use super::assembly::Settled;
use super::constraints::Constraints;
use super::equilibrium::{rest_near, rest_state, with_constant_laws};
use super::members::Members;
use super::model::Model;
use super::settled::without_play;
use super::start::{CLOSED, factor_at};
use super::tree::Tree;
use super::{Mechanism, MechanismError};
use crate::machine::{Drive, Machine, Mat3, StartRule, Vec3};

/// Time at which the drives have reached their positions; they move from those at t = 0 at constant rates.
pub(super) const DRIVE_END: f64 = 1.0;
/// Largest component of the displacement in one step, over the length scale or 0.1 rad, and of its correction.
const MAX_STEP: f64 = 2.0;
const MAX_CORRECTION: f64 = 0.5;
/// Shortest step, as a fraction of the drives' whole path.
const MIN_STEP: f64 = 1e-6;
/// Smallest ratio of a pivot of the rows to the largest of its joint at which loads are determined to some digits.
const SINGULAR: f64 = 1e-10;
/// Ratio of a mobility of the tip to that without any constraint below which it is rounding.
pub(super) const IMMOBILE: f64 = 1e-9;

/// Error in finding the pose of a machine without play.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HeldError {
    /// The machine does not start, or has no position of rest.
    #[error(transparent)]
    Mechanism(#[from] MechanismError),
    /// The drives do not reach their positions.
    #[error(
        "without play the loops close only up to {:.1} % of the way from the drives' positions at t = 0 to these", 100.0 * .part
    )]
    Unreached {
        /// Fraction of the straight path of the drives, 0 to 1.
        part: f64,
    },
    /// The loops do not determine the pose.
    #[error("singular pose: without play the loops no longer determine it")]
    Singular,
}

/// A machine with drives that stand still.
pub struct HeldMachine {
    /// With play.
    pub(super) machine: Machine,
    /// Without.
    pub(super) model: Model,
    pub(super) tree: Tree,
    pub(super) constraints: Constraints,
    /// What has play in each joint.
    pub(super) members: Members,
    /// Tree coordinates of the pose without play, and velocities of zero.
    pub(super) ideal: Vec<f64>,
    pub(super) ideal_tip: Vec3,
}

impl HeldMachine {
    /// `machine` with its driven coordinates, in the order of [`Machine::driven`], at `held`, m or rad, or where they are at t =
    /// 0.
    ///
    /// The machine without play is assembled at t = 0 as its own start, and followed from there while all drives move at constant
    /// rates. If the tip still moves with the drives held, its pose is the static equilibrium nearby.
    ///
    /// # Errors
    /// The machine does not start, the drives do not reach their positions, the pose is singular, or no position of rest is
    /// found.
    pub fn new(machine: &Machine, held: &[Option<f64>]) -> Result<Self, HeldError> {
        let mut mechanism = Mechanism::new(&without_play(machine))?;
        // The pose is assembled from the joints; a path in closed form is no more than a first guess.
        let mut y = mechanism.start_off_path()?;
        let rank = mechanism.model.assembled.get().and_then(|assembled| assembled.rank);
        let mut moving = with_constant_laws(&without_play(machine));
        let mut stationary = moving.clone();
        let positions = held.iter().copied().chain(std::iter::repeat(None));
        for ((moving_drive, final_drive), held) in drives(&mut moving).zip(drives(&mut stationary)).zip(positions) {
            if let (Drive::Constant { position: from, velocity }, Drive::Constant { position: to, .. }) =
                (moving_drive, final_drive)
            {
                *to = held.unwrap_or(*to);
                *velocity = *to - *from;
            }
        }
        let model = Model::new(&moving);
        let mut tree = Tree::new(&model);
        let all: Vec<usize> = (0..model.joints.len()).collect();
        let mut constraints = Constraints::new(&model, &all);
        if let Some(rank) = rank {
            constraints.treat_as_dependent(rank);
        }
        y[model.nq..].fill(0.0);
        follow_drives(&model, &mut constraints, &mut tree, &mut y)?;
        y[model.nq..].fill(0.0);
        factor_at(&model, &mut constraints, &mut tree, DRIVE_END, &y);
        if !constraints.is_dependent() && !(constraints.least_joint_pivot() >= SINGULAR) {
            return Err(HeldError::Singular);
        }
        let mut own = Self {
            machine: Machine {
                loose_joints: machine.loose_joints.clone(),
                start: StartRule::Equilibrium,
                ..stationary.clone()
            },
            members: Members::new(&machine.loose_joints, &model),
            model,
            tree,
            constraints,
            ideal: y,
            ideal_tip: Vec3::zeros(),
        };
        if own.closed_mobility().trace() > IMMOBILE * own.mobility(|_| {}).trace() {
            own.ideal = rest_near(&stationary, own.ideal.clone())?.state;
        }
        own.ideal_tip = own.tip_at_ideal();
        Ok(own)
    }

    /// Tip without play, world axes, m: the output's probe, or else the origin of the output body.
    pub fn ideal_tip(&self) -> Vec3 {
        self.ideal_tip
    }

    /// Tip at rest with play, under gravity, springs and loads, minus the tip without, world axes, m.
    ///
    /// # Errors
    /// No position of rest is found, or the machine has too many coordinates for the search.
    pub fn settled_error(&mut self) -> Result<Vec3, MechanismError> {
        let Settled { state, .. } = rest_state(&self.machine, Some(&self.ideal))?;
        self.tree.update_kinematics(&self.model, DRIVE_END, &state);
        Ok(self.tip() - self.ideal_tip)
    }

    /// Body of the tip, and the tip from its centroid, body axes, m.
    fn tip_anchor(&self) -> (usize, Vec3) {
        let body = self.model.output_body;
        let origin = || self.model.bodies.get(body).map_or_else(Vec3::zeros, |body| body.origin);
        (body, self.model.probe.unwrap_or_else(origin))
    }

    /// Tip at the latest pose of the tree, m.
    pub(super) fn tip(&self) -> Vec3 {
        let (body, offset) = self.tip_anchor();
        let motion = &self.tree.motion[body];
        motion.position + motion.rotation * offset
    }

    fn tip_at_ideal(&mut self) -> Vec3 {
        self.tree.update_kinematics(&self.model, DRIVE_END, &self.ideal);
        self.tip()
    }

    /// Generalised forces of a force `load`, N, at the tip in the latest pose of the tree.
    pub(super) fn tip_load(&self, load: &Vec3) -> Vec<f64> {
        let (body, _) = self.tip_anchor();
        let mut forces = vec![0.0; self.model.nv];
        if self.model.bodies.get(body).is_some_and(|body| !body.driven_only) {
            let first = self.model.blocks[self.model.block_of[body]].v;
            super::tree::visit_columns(&self.model, &self.tree.motion, body, &self.tip(), |column, velocity, _| {
                forces[first + column] += velocity.dot(load);
            });
        }
        forces
    }

    /// Accelerations of the tip under unit forces at it, column by column, 1/kg, in the latest pose of the tree with its mass
    /// matrices; `constrain` removes from accelerations of the coordinates what the joints do not allow.
    pub(super) fn mobility(&self, mut constrain: impl FnMut(&mut [f64])) -> Mat3 {
        let loads = [Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| self.tip_load(&axis));
        let mut mobility = Mat3::zeros();
        for (j, load) in loads.iter().enumerate() {
            let mut vdot = load.clone();
            self.tree.solve(&self.model, &mut vdot);
            constrain(&mut vdot);
            for (i, load) in loads.iter().enumerate() {
                mobility[(i, j)] = load.iter().zip(&vdot).map(|(a, b)| a * b).sum();
            }
        }
        mobility
    }

    /// The same for the mechanism without play, with the constraint matrices of that pose.
    pub(super) fn closed_mobility(&mut self) -> Mat3 {
        let spare = Constraints::new(&self.model, &[]);
        let mut constraints = std::mem::replace(&mut self.constraints, spare);
        let mobility = self.mobility(|vdot| constraints.project_accelerations(&self.model, vdot));
        self.constraints = constraints;
        mobility
    }
}

/// Driven coordinates of `machine` at t = 0, in the order of [`Machine::driven`], m or rad.
pub fn drive_positions(machine: &Machine) -> Vec<f64> {
    let position = |drive: &mut Drive| if let Drive::Constant { position, .. } = drive { *position } else { 0.0 };
    drives(&mut with_constant_laws(machine)).map(position).collect()
}

/// Drives of the tree joints, in the order of [`Machine::driven`].
fn drives(machine: &mut Machine) -> impl Iterator<Item = &mut Drive> {
    machine.joints.iter_mut().flat_map(|joint| joint.drive.iter_mut().chain(&mut joint.second_drive))
}

/// Follows the closed pose `y` from t = 0 to [`DRIVE_END`]: predicted by the velocities, corrected by Newton's method, with steps
/// short enough to stay on the branch.
fn follow_drives(
    model: &Model,
    constraints: &mut Constraints,
    tree: &mut Tree,
    y: &mut Vec<f64>,
) -> Result<(), HeldError> {
    constraints.project(model, tree, 0.0, y);
    let (mut t, mut longest) = (0.0, DRIVE_END);
    while t < DRIVE_END {
        let speeds = y[model.nq..].iter().zip(&model.scale[model.nq..]);
        // Scales of speeds are those of coordinates per 0.1 s.
        let rate = speeds.map(|(v, scale)| (v / scale).abs() / 0.1).fold(0.0, f64::max);
        let step = longest.min(MAX_STEP / rate);
        if !(step > MIN_STEP) {
            return Err(HeldError::Unreached { part: t });
        }
        let next = if t + step > DRIVE_END - MIN_STEP { DRIVE_END } else { t + step };
        let moved: Vec<f64> = y[model.nq..].iter().map(|v| v * (next - t)).collect();
        let mut predicted = y.clone();
        Tree::displace(model, &mut predicted, &moved);
        let mut closed = predicted.clone();
        let error = constraints.project(model, tree, next, &mut closed);
        let corrections = closed.iter().zip(&predicted).zip(&model.scale).take(model.nq);
        let correction = corrections.map(|((a, b), scale)| (a - b).abs() / scale).fold(0.0, f64::max);
        if error <= CLOSED && correction <= MAX_CORRECTION {
            (t, *y) = (next, closed);
            longest = 2.0 * step;
        } else {
            longest = 0.5 * step;
        }
    }
    Ok(())
}
