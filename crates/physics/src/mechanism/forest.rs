//! The complete `tree` formulation: spanning forest plus loop constraints of ideal ball joints and other cut joints.

use super::constraints::Constraints;
use super::equations::Equations;
use super::kinematics::{Driven, Kinematics, Wrench};
use super::model::{BodyIndex, Model, Motion, Site};
use super::path::Path;
use super::power::inverse_dynamics;
use super::tree::{self, Tree};
use crate::machine::{Mat3, Vec3};

/// Spanning forest with constraint rows for the joints that close loops.
pub(super) struct Forest {
    tree: Tree,
    constraints: Option<Constraints>,
    /// Wrench transmitted by the joint above each body at the latest [`Self::find_drive_forces`], about the body's centroid. The
    /// last entry is the world's.
    transmitted: Vec<Wrench>,
}

impl Forest {
    /// For `model`.
    pub(super) fn new(model: &Model) -> Self {
        let constraints = || Constraints::new(model, &model.ideal_joints);
        let tree = Tree::new(model);
        Self {
            transmitted: vec![Wrench::zero(); tree.wrench.len()],
            tree,
            constraints: model.closes_loops().then(constraints),
        }
    }

    /// Drive forces for the accelerations in the tree's motion under its loads, from the bodies selected by `moved`. If `closed`,
    /// includes the reactions of loop-closing joints.
    fn find_drive_forces(
        &mut self,
        model: &Model,
        gravity: &Vec3,
        closed: bool,
        moved: impl Fn(usize) -> bool,
        mut visit: impl FnMut(&Driven, usize, f64),
    ) {
        let Self { tree: Tree { motion, wrench, driven, .. }, constraints, transmitted } = self;
        transmitted.copy_from_slice(wrench);
        if let Some(constraints) = constraints.as_ref().filter(|_| closed) {
            constraints.load(constraints.multipliers(), motion, transmitted);
        }
        inverse_dynamics(model, motion, transmitted, gravity, moved, |drive, force| visit(driven, drive, force));
    }
}

impl Equations for Forest {
    fn positions(&self, model: &Model) -> usize {
        model.nq
    }

    fn velocities(&self, model: &Model) -> usize {
        model.nv
    }

    fn scale<'a>(&'a self, model: &'a Model) -> &'a [f64] {
        &model.scale
    }

    fn treat_as_dependent(&mut self, rank: usize) {
        if let Some(constraints) = &mut self.constraints {
            constraints.treat_as_dependent(rank);
        }
    }

    fn state_of(&self, _: &Model, y: Vec<f64>, _: &[Kinematics]) -> Vec<f64> {
        y
    }

    fn motion(&self) -> &[Kinematics] {
        &self.tree.motion
    }

    fn driven(&self) -> &Driven {
        &self.tree.driven
    }

    fn driven_mut(&mut self) -> &mut Driven {
        &mut self.tree.driven
    }

    fn coordinate(&self, model: &Model, y: &[f64], b: BodyIndex) -> Option<[f64; 2]> {
        match model.bodies[b].motion {
            Motion::Driven { drive, .. } => Some(self.tree.driven.coordinate(drive)),
            Motion::Revolute { q, v } | Motion::Prismatic { q, v } => Some([y[q], y[model.nq + v]]),
            Motion::Fixed | Motion::Free { .. } => None,
        }
    }

    fn update_kinematics(&mut self, model: &Model, t: f64, y: &[f64]) {
        self.tree.update_kinematics(model, t, y);
    }

    fn suspend(&mut self, suspended: &dyn Fn(BodyIndex) -> bool) {
        self.tree.suspend(suspended);
    }

    fn update_active(&mut self, model: &Model, t: f64, y: &[f64]) {
        self.tree.update_active(model, t, y);
    }

    fn update_suspended(&mut self, model: &Model, y: &[f64]) {
        self.tree.update_suspended(model, y);
    }

    fn path(&self, model: &Model, site: &Site) -> Option<Path> {
        Path::of(model, site)
    }

    fn update_along(&mut self, model: &Model, t: f64, y: &[f64], path: &Path) {
        self.tree.update_along(model, t, y, path);
    }

    fn loads(&mut self) -> (&[Kinematics], &mut [Wrench]) {
        (&self.tree.motion, &mut self.tree.wrench)
    }

    fn accelerate(&mut self, model: &Model, gravity: &Vec3, t: f64, y: &[f64], dv: &mut [f64]) {
        self.tree.assemble(model, gravity, dv);
        self.tree.solve(model, dv);
        if let Some(constraints) = &mut self.constraints {
            constraints.correct(model, &self.tree, t, &y[..model.nq], dv);
        }
    }

    fn complete_motion(&mut self, model: &Model, y: &[f64], dv: &[f64]) {
        self.tree.accelerate(model, y, dv);
    }

    fn position_rate(&self, model: &Model, y: &[f64], dq: &mut [f64]) {
        self.tree.position_rate(model, y, dq);
    }

    fn velocities_of(&self, model: &Model, y: &[f64], rate: &[f64], out: &mut [f64]) {
        self.tree.velocities_of(model, y, rate, out);
    }

    fn displace(&self, model: &Model, y: &mut [f64], step: &[f64]) {
        Tree::displace(model, y, step);
    }

    fn project(&mut self, model: &Model, t: f64, y: &mut [f64]) -> f64 {
        Tree::normalise(model, y);
        match &mut self.constraints {
            Some(constraints) => constraints.project(model, &mut self.tree, t, y),
            None => 0.0,
        }
    }

    fn projects(&self) -> bool {
        self.constraints.is_some()
    }

    fn visit_columns(&self, model: &Model, body: usize, point: &Vec3, visit: &mut dyn FnMut(usize, Vec3, Vec3)) {
        if body < model.bodies.len() && !model.bodies[body].driven_only {
            let first = model.blocks[model.block_of[body]].v;
            tree::visit_columns(model, &self.tree.motion, body, point, |c, v, w| {
                visit(first + c, v, w);
            });
        }
    }

    fn apply_inverse_mass(&mut self, model: &Model, x: &mut [f64]) {
        self.tree.solve(model, x);
        if let Some(constraints) = &mut self.constraints {
            constraints.project_accelerations(model, x);
        }
    }

    fn free_body_inverse_mass(&self, model: &Model, first: usize) -> Option<(f64, Mat3)> {
        if self.constraints.is_some() {
            return None;
        }
        let block = model.blocks.partition_point(|block| block.v < first);
        let b = model.blocks.get(block)?.single_free_body?;
        let (body, rotation) = (&model.bodies[b], &self.tree.motion[b].rotation);
        Some((1.0 / body.mass, rotation * body.inertia_inverse * rotation.transpose()))
    }

    fn apply_inverse_mass_within(&mut self, model: &Model, (first, end): (usize, usize), x: &mut [f64]) {
        self.tree.solve_within(model, first, end, x);
    }

    fn is_block_diagonal(&self) -> bool {
        self.constraints.is_none()
    }

    fn rows(&self) -> usize {
        self.constraints.as_ref().map_or(0, Constraints::rows)
    }

    fn rank(&self) -> usize {
        self.constraints.as_ref().map_or(0, Constraints::rank)
    }

    fn least_pivot(&self) -> f64 {
        let constraints = self.constraints.as_ref();
        constraints.map_or(f64::INFINITY, |c| c.least_pivot)
    }

    fn is_undetermined(&self) -> bool {
        false
    }

    fn drift(&self) -> f64 {
        0.0
    }

    fn is_kinematic(&self, model: &Model) -> bool {
        let rows = self.constraints.as_ref().filter(|c| !c.is_dependent());
        model.nv == rows.map_or(0, Constraints::rows)
    }

    fn is_determinant_positive(&mut self, model: &Model) -> bool {
        match &mut self.constraints {
            Some(constraints) => constraints.is_determinant_positive(model),
            None => true,
        }
    }

    fn closing_load(&self, k: usize) -> [Vec3; 2] {
        self.constraints.as_ref().map_or([Vec3::zeros(); 2], |own| own.load_on_child(k))
    }

    fn is_closing_load_unique(&self, k: usize) -> bool {
        self.constraints.as_ref().is_none_or(|own| own.is_unique(k))
    }

    fn null_closing_loads(&self, k: usize) -> Vec<[Vec3; 2]> {
        self.constraints.as_ref().map_or_else(Vec::new, |own| own.null_loads(k))
    }

    fn actuator_forces(&mut self, model: &Model, gravity: &Vec3, out: &mut [f64]) {
        self.find_drive_forces(model, gravity, true, |_| true, |_, drive, force| out[drive] = force);
    }

    fn joint_loads(&mut self) -> (&[Kinematics], &[Wrench]) {
        (&self.tree.motion, &self.transmitted)
    }

    fn is_actuator_unique(&mut self, model: &Model, gravity: &Vec3, i: usize) -> bool {
        let Some(constraints) = &self.constraints else {
            return true;
        };
        let motion = &self.tree.motion;
        let mut wrench = vec![Wrench::zero(); self.transmitted.len()];
        let mut force_under = |multipliers: Option<&[f64]>| {
            wrench.fill(Wrench::zero());
            if let Some(multipliers) = multipliers {
                constraints.load(multipliers, motion, &mut wrench);
            }
            let mut force = 0.0;
            let visit = |drive, value| {
                if drive == i {
                    force = value;
                }
            };
            inverse_dynamics(model, motion, &mut wrench, gravity, |_| true, visit);
            force
        };
        let without = force_under(None);
        constraints.system().null_multipliers().all(|null| {
            let largest = null.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            // With a lever arm of a metre, a millionth of the largest multiplier is rounding.
            (force_under(Some(null)) - without).abs() <= 1e-6 * largest
        })
    }

    fn prescribes_drives(&self) -> bool {
        self.constraints.is_none()
    }

    fn drive_power(&mut self, model: &Model, gravity: &Vec3, y: &[f64], dv: &[f64], all: bool) -> f64 {
        if all {
            self.tree.accelerate(model, y, dv);
        }
        // If forces suffice, the motion of everything carried by a drive is a function of time.
        let moved = |b: usize| all || model.bodies[b].driven_only;
        let mut power = 0.0;
        self.find_drive_forces(model, gravity, all, moved, |driven, drive, force| {
            power += force * driven.coordinates[drive].rate;
        });
        power
    }
}
