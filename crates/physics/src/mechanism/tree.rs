//! The tree formulation: coordinates of the spanning forest that remains once every joint with play is cut.
//!
//! Mass matrix by the composite-rigid-body algorithm, bias by one outward and one inward pass (Featherstone 2008,
//! chapters 5 and 6), in world axes with each body's own centroid as reference. Allocates nothing after `new`.

use super::kinematics::{self, Driven, Kinematics, Wrench, angular_velocity_of, part};
use super::model::{BodyIndex, Model, Motion};
use super::path::Path;
use crate::jet::Jet;
use crate::machine::{Mat3, Vec3};

/// Mass, first moment and inertia of a body with all its descendants, about that body's centroid.
#[derive(Clone, Copy)]
struct Composite {
    mass: f64,
    moment: Vec3,
    inertia: Mat3,
    force: Vec3,
    torque: Vec3,
}

impl Composite {
    const EMPTY: Self = Self {
        mass: 0.0,
        moment: Vec3::new(0.0, 0.0, 0.0),
        inertia: Mat3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        force: Vec3::new(0.0, 0.0, 0.0),
        torque: Vec3::new(0.0, 0.0, 0.0),
    };

    /// Adds a composite about the same centroid.
    #[inline]
    fn add(&mut self, other: &Self) {
        self.mass += other.mass;
        self.moment += other.moment;
        self.inertia += other.inertia;
        self.force += other.force;
        self.torque += other.torque;
    }

    /// Adds a composite whose centroid is displaced by `d` from this one's.
    #[inline]
    fn add_shifted(&mut self, c: &Self, d: &Vec3) {
        self.mass += c.mass;
        self.moment += c.moment + d * c.mass;
        add_shifted_inertia(&mut self.inertia, &c.inertia, c.mass, &c.moment, d);
        self.force += c.force;
        self.torque += c.torque + d.cross(&c.force);
    }
}

/// Equations of motion in tree coordinates.
pub struct Tree {
    /// Bodies, then the world.
    pub motion: Vec<Kinematics>,
    /// External loads of the latest evaluation, same order.
    pub(crate) wrench: Vec<Wrench>,
    /// Motion prescribed by time.
    pub driven: Driven,
    composite: Vec<Composite>,
    dynamic: Vec<usize>,
    /// The dynamic bodies that evaluations move and accelerate, those that they skip, and whether each body is skipped.
    active: Vec<usize>,
    suspended: Vec<usize>,
    is_suspended: Vec<bool>,
    /// Mass matrices of the blocks, factored, row-major, one after the other.
    mass: Vec<f64>,
    mass_offset: Vec<usize>,
    inverse_diagonal: Vec<f64>,
}

impl Tree {
    /// For `model`.
    pub fn new(model: &Model) -> Self {
        let mut tree = Self::without_masses(model);
        let mut total = 0;
        for block in &model.blocks {
            tree.mass_offset.push(total);
            total += if block.single_free_body.is_some() { 0 } else { block.n * block.n };
        }
        tree.mass = vec![0.0; total];
        tree
    }

    /// For use without mass matrices: only [`Self::update_kinematics`] is available.
    pub fn without_masses(model: &Model) -> Self {
        let n = model.bodies.len();
        let moves = |&b: &usize| !model.bodies[b].driven_only;
        let dynamic: Vec<usize> = model.order.iter().copied().filter(moves).collect();
        Self {
            motion: vec![Kinematics::rest(); n + 1],
            wrench: vec![Wrench::zero(); n + 1],
            driven: Driven::new(model),
            composite: vec![Composite::EMPTY; n],
            active: dynamic.clone(),
            suspended: Vec::with_capacity(dynamic.len()),
            is_suspended: vec![false; n],
            dynamic,
            mass: Vec::new(),
            mass_offset: Vec::new(),
            inverse_diagonal: vec![0.0; model.nv],
        }
    }

    /// Poses, velocities and bias accelerations (for zero coordinate accelerations) at (t, y).
    #[inline]
    pub fn update_kinematics(&mut self, model: &Model, t: f64, y: &[f64]) {
        self.update_active(model, t, y);
        // Suspended bodies have no descendants, so that they may come last.
        self.update_suspended(model, y);
    }

    /// Lets evaluations skip the bodies for which `suspended` holds: free bodies that are trees of their own.
    pub fn suspend(&mut self, suspended: impl Fn(BodyIndex) -> bool) {
        self.active.clear();
        self.suspended.clear();
        for &b in &self.dynamic {
            self.is_suspended[b] = suspended(b);
            if self.is_suspended[b] {
                self.suspended.push(b);
            } else {
                self.active.push(b);
            }
        }
    }

    /// As [`Self::update_kinematics`] for the active bodies.
    #[inline]
    pub fn update_active(&mut self, model: &Model, t: f64, y: &[f64]) {
        self.driven.update(model, t, &mut self.motion);
        let (motion, coordinates) = (&mut self.motion, &self.driven.coordinates);
        for &b in &self.active {
            move_body(model, b, y, coordinates, motion);
        }
    }

    /// As [`Self::update_kinematics`] for the suspended bodies, after [`Self::update_active`] at this instant.
    pub fn update_suspended(&mut self, model: &Model, y: &[f64]) {
        let (motion, coordinates) = (&mut self.motion, &self.driven.coordinates);
        for &b in &self.suspended {
            move_body(model, b, y, coordinates, motion);
        }
    }

    /// The same for the bodies on `path` alone.
    pub fn update_along(&mut self, model: &Model, t: f64, y: &[f64], path: &Path) {
        self.driven.update_along(model, t, path, &mut self.motion);
        let (motion, coordinates) = (&mut self.motion, &self.driven.coordinates);
        for &b in &path.dynamic {
            move_body(model, b, y, coordinates, motion);
        }
    }

    /// Factored mass matrices, and generalised forces (loads, gravity, bias) in `out`; those of suspended bodies are left
    /// unchanged.
    #[inline]
    pub fn assemble(&mut self, model: &Model, gravity: &Vec3, out: &mut [f64]) {
        let Self { motion, wrench, composite, mass, mass_offset, active, .. } = self;
        for &b in active.iter().rev() {
            let body = &model.bodies[b];
            let m = &motion[b];
            let inertia = world_inertia(&m.rotation, &body.inertia, body.diagonal);
            let w = m.angular_velocity;
            let load = &wrench[b];
            let block_index = model.block_of[b];
            let block = &model.blocks[block_index];
            if let (Motion::Free { v, .. }, Some(_)) = (body.motion, block.single_free_body) {
                // A single free body has no descendants, and its bias accelerations are zero.
                let force = load.force + gravity * body.mass;
                let torque = load.torque - w.cross(&(inertia * w));
                out[v..v + 6].copy_from_slice(&six_of(&force, &torque));
                continue;
            }
            let mut c = Composite {
                mass: body.mass,
                moment: Vec3::zeros(),
                inertia,
                force: load.force + (gravity - m.acceleration) * body.mass,
                torque: load.torque - inertia * m.angular_acceleration - w.cross(&(inertia * w)),
            };
            if body.has_moving_child {
                // All descendants of this body have been accumulated.
                c.add(&composite[b]);
                composite[b] = Composite::EMPTY;
            }
            let n = block.n;
            match body.motion {
                Motion::Revolute { v, .. } => {
                    let a = m.axis;
                    out[v] = a.dot(&(c.torque + m.arm.cross(&c.force)));
                    let centre = a.cross(&m.arm);
                    let momentum = centre * c.mass + a.cross(&c.moment);
                    let angular = c.moment.cross(&centre) + c.inertia * a;
                    let row = v - block.v;
                    let h = &mut mass[mass_offset[block_index]..][..n * n];
                    h[row * n + row] = momentum.dot(&centre) + angular.dot(&a);
                    fill_row(model, motion, &mut h[row * n..][..n], block.v, b, momentum, angular);
                }
                Motion::Prismatic { v, .. } => {
                    let a = m.axis;
                    out[v] = a.dot(&c.force);
                    let momentum = a * c.mass;
                    let angular = c.moment.cross(&a);
                    let row = v - block.v;
                    let h = &mut mass[mass_offset[block_index]..][..n * n];
                    h[row * n + row] = c.mass;
                    fill_row(model, motion, &mut h[row * n..][..n], block.v, b, momentum, angular);
                }
                Motion::Free { v, .. } => {
                    out[v..v + 6].copy_from_slice(&six_of(&c.force, &c.torque));
                    fill_free(&mut mass[mass_offset[block_index]..][..n * n], n, &c);
                }
                Motion::Fixed | Motion::Driven { .. } => {}
            }
            let parent = body.parent;
            if parent < model.bodies.len() && model.bodies[parent].has_moving_child {
                composite[parent].add_shifted(&c, &(m.position - motion[parent].position));
            }
        }
        for (index, block) in model.blocks.iter().enumerate() {
            if block.single_free_body.is_none() {
                let h = &mut self.mass[self.mass_offset[index]..][..block.n * block.n];
                let d = &mut self.inverse_diagonal[block.v..][..block.n];
                block.pattern.factor(h, d);
            }
        }
    }

    /// x = M^-1 x for the coordinates of block `index`, after [`Self::assemble`].
    #[inline]
    pub fn solve_block(&self, model: &Model, index: usize, x: &mut [f64]) {
        let block = &model.blocks[index];
        if let Some(b) = block.single_free_body {
            let body = &model.bodies[b];
            let rotation = &self.motion[b].rotation;
            let [fx, fy, fz, tx, ty, tz] = *part(x, 0);
            let acceleration = Vec3::new(fx, fy, fz) / body.mass;
            let torque = Vec3::new(tx, ty, tz);
            let alpha = rotation * (body.inertia_inverse * rotation.tr_mul(&torque));
            x.copy_from_slice(&six_of(&acceleration, &alpha));
        } else {
            let h = &self.mass[self.mass_offset[index]..][..block.n * block.n];
            block.pattern.solve(h, &self.inverse_diagonal[block.v..][..block.n], x);
        }
    }

    /// x = M^-1 x for all coordinates; those of suspended bodies are left unchanged.
    #[inline]
    pub fn solve(&self, model: &Model, x: &mut [f64]) {
        for (index, block) in model.blocks.iter().enumerate() {
            if !block.single_free_body.is_some_and(|b| self.is_suspended[b]) {
                self.solve_block(model, index, &mut x[block.v..][..block.n]);
            }
        }
    }

    /// As [`Self::solve`] for the blocks whose coordinates lie within `first..end`.
    pub fn solve_within(&self, model: &Model, first: usize, end: usize, x: &mut [f64]) {
        let from = model.blocks.partition_point(|block| block.v < first);
        for (index, block) in model.blocks.iter().enumerate().skip(from) {
            if block.v >= end {
                break;
            }
            self.solve_block(model, index, &mut x[block.v..][..block.n]);
        }
    }

    /// Replaces the bodies' bias accelerations with the true ones for the coordinate accelerations `vdot`.
    pub fn accelerate(&mut self, model: &Model, y: &[f64], vdot: &[f64]) {
        let vs = &y[model.nq..];
        for &b in &self.dynamic {
            let body = &model.bodies[b];
            let parent = self.motion[body.parent];
            let child = &mut self.motion[b];
            match body.motion {
                Motion::Free { v, .. } => {
                    child.acceleration = Vec3::new(vdot[v], vdot[v + 1], vdot[v + 2]);
                    child.angular_acceleration = Vec3::new(vdot[v + 3], vdot[v + 4], vdot[v + 5]);
                }
                Motion::Revolute { v, .. } => kinematics::accelerate(child, &parent, true, vs[v], vdot[v]),
                Motion::Prismatic { v, .. } => kinematics::accelerate(child, &parent, false, vs[v], vdot[v]),
                Motion::Driven { drive, revolute } => {
                    let q = self.driven.coordinates[drive];
                    kinematics::accelerate(child, &parent, revolute, q.rate, q.acceleration);
                }
                Motion::Fixed => kinematics::accelerate(child, &parent, false, 0.0, 0.0),
            }
        }
    }

    /// dq/dt from the velocities in `y`; that of suspended bodies is left unchanged.
    #[inline]
    pub fn position_rate(&self, model: &Model, y: &[f64], dq: &mut [f64]) {
        let (qs, vs) = y.split_at(model.nq);
        for &b in &self.active {
            match model.bodies[b].motion {
                Motion::Free { q, v } => {
                    let rate = kinematics::free_rate(part(qs, q), part(vs, v));
                    dq[q..q + 7].copy_from_slice(&rate);
                }
                Motion::Revolute { q, v } | Motion::Prismatic { q, v } => dq[q] = vs[v],
                Motion::Fixed | Motion::Driven { .. } => {}
            }
        }
    }

    /// Velocities of the active bodies for the position rates `rate` at the positions in `y`.
    pub fn velocities_of(&self, model: &Model, y: &[f64], rate: &[f64], out: &mut [f64]) {
        for &b in &self.active {
            match model.bodies[b].motion {
                Motion::Free { q, v } => {
                    out[v..v + 3].copy_from_slice(&rate[q..q + 3]);
                    out[v + 3..v + 6].copy_from_slice(&angular_velocity_of(&y[q + 3..q + 7], &rate[q + 3..q + 7]));
                }
                Motion::Revolute { q, v } | Motion::Prismatic { q, v } => out[v] = rate[q],
                Motion::Fixed | Motion::Driven { .. } => {}
            }
        }
    }

    /// Moves the positions in `y` by the velocity-space displacement `step` (rotations by their rotation vectors).
    pub fn displace(model: &Model, y: &mut [f64], step: &[f64]) {
        for body in &model.bodies {
            match body.motion {
                Motion::Free { q, v } => {
                    for i in 0..3 {
                        y[q + i] += step[v + i];
                    }
                    let turn = Vec3::new(step[v + 3], step[v + 4], step[v + 5]);
                    kinematics::rotate_quaternion(&mut y[q + 3..q + 7], &turn);
                }
                Motion::Revolute { q, v } | Motion::Prismatic { q, v } => y[q] += step[v],
                Motion::Fixed | Motion::Driven { .. } => {}
            }
        }
    }

    /// Normalises quaternions to length 1.
    #[inline]
    pub fn normalise(model: &Model, y: &mut [f64]) {
        for body in &model.bodies {
            if let Motion::Free { q, .. } = body.motion {
                kinematics::normalise_quaternion(&mut y[q + 3..q + 7]);
            }
        }
    }
}

/// Smallest ratio of a pivot to its diagonal element of the mass matrix; a smaller one is rounding.
const LEAST_INDEPENDENT: f64 = 1e-12;

impl Tree {
    /// After [`Self::assemble`], the velocity coordinate farthest from its root that moves all mass in the same way as a
    /// combination of the coordinates beyond it: with H = L^T D L, D is 0 there and the diagonal element of H is not. `None` if
    /// there is none.
    pub fn dependent_coordinate(&self, model: &Model) -> Option<usize> {
        model.blocks.iter().zip(&self.mass_offset).find_map(|(block, &offset)| {
            let pivot = |k: usize| 1.0 / self.inverse_diagonal[block.v + k];
            let factor = |j: usize, k: usize| self.mass[offset + j * block.n + k];
            let eliminated = |k: usize| (k + 1..block.n).map(|j| factor(j, k) * factor(j, k) * pivot(j)).sum::<f64>();
            let depends = |&k: &usize| !(pivot(k) > LEAST_INDEPENDENT * (pivot(k) + eliminated(k)));
            let last = block.single_free_body.is_none().then(|| (0..block.n).rev().find(depends)).flatten();
            last.map(|k| block.v + k)
        })
    }
}

/// Moves body `b` relative to its parent.
#[inline(always)]
fn move_body(model: &Model, b: BodyIndex, y: &[f64], driven: &[Jet], motion: &mut [Kinematics]) {
    let (qs, vs) = y.split_at(model.nq);
    let body = &model.bodies[b];
    match body.motion {
        Motion::Free { q, v } => {
            let m = &mut motion[b];
            m.move_freely(part(qs, q), part(vs, v));
            m.acceleration = Vec3::zeros();
            m.angular_acceleration = Vec3::zeros();
        }
        Motion::Revolute { q, v } => {
            let q = Jet::new(qs[q], vs[v], 0.0);
            kinematics::move_child(motion, b, body, true, q);
        }
        Motion::Prismatic { q, v } => {
            let q = Jet::new(qs[q], vs[v], 0.0);
            kinematics::move_child(motion, b, body, false, q);
        }
        Motion::Driven { drive, revolute } => {
            let q = driven[drive];
            kinematics::move_child(motion, b, body, revolute, q);
        }
        Motion::Fixed => {
            kinematics::move_child(motion, b, body, false, Jet::default());
        }
    }
}

/// Components of both vectors, linear before angular.
#[inline(always)]
fn six_of(linear: &Vec3, angular: &Vec3) -> [f64; 6] {
    let (l, a) = (linear, angular);
    [l.x, l.y, l.z, a.x, a.y, a.z]
}

/// R I R^T.
#[inline]
fn world_inertia(r: &Mat3, inertia: &Mat3, diagonal: bool) -> Mat3 {
    let t = if diagonal {
        let mut t = *r;
        for j in 0..3 {
            let d = inertia[(j, j)];
            for i in 0..3 {
                t[(i, j)] *= d;
            }
        }
        t
    } else {
        r * inertia
    };
    let entry = |i: usize, j: usize| t[(i, 0)] * r[(j, 0)] + t[(i, 1)] * r[(j, 1)] + t[(i, 2)] * r[(j, 2)];
    let (xx, xy, xz, yy, yz, zz) = (entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2));
    Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

/// Adds to `sum` the inertia of a composite (inertia about its own reference, mass, first moment) about another reference, with
/// its own at `d` from that: I + m (d.d 1 - d d^T) + 2 (d.k) 1 - d k^T - k d^T.
#[inline]
fn add_shifted_inertia(sum: &mut Mat3, inertia: &Mat3, mass: f64, k: &Vec3, d: &Vec3) {
    // With h = k + m d / 2 the whole shift is 2 (d.h) 1 - d h^T - h d^T.
    let h = k + d * (0.5 * mass);
    let trace = 2.0 * d.dot(&h);
    let (xy, xz, yz) = (d.x * h.y + h.x * d.y, d.x * h.z + h.x * d.z, d.y * h.z + h.y * d.z);
    sum.m11 += inertia.m11 + trace - 2.0 * d.x * h.x;
    sum.m22 += inertia.m22 + trace - 2.0 * d.y * h.y;
    sum.m33 += inertia.m33 + trace - 2.0 * d.z * h.z;
    let (ixy, ixz, iyz) = (inertia.m12 - xy, inertia.m13 - xz, inertia.m23 - yz);
    sum.m12 += ixy;
    sum.m21 += ixy;
    sum.m13 += ixz;
    sum.m31 += ixz;
    sum.m23 += iyz;
    sum.m32 += iyz;
}

/// Rows of a free body: `[m 1, .; [k]x, I]` with k the first moment.
#[inline]
fn fill_free(h: &mut [f64], n: usize, c: &Composite) {
    let k = c.moment;
    for i in 0..3 {
        for j in 0..=i {
            h[i * n + j] = if i == j { c.mass } else { 0.0 };
            h[(3 + i) * n + 3 + j] = c.inertia[(i, j)];
        }
    }
    let lower = [[0.0, -k.z, k.y], [k.z, 0.0, -k.x], [-k.y, k.x, 0.0]];
    for i in 0..3 {
        h[(3 + i) * n..(3 + i) * n + 3].copy_from_slice(&lower[i]);
    }
}

/// Couples a coordinate with its ancestors in its `row` of the block that begins with coordinate `first`, given the momentum and angular momentum about body `b`'s centroid for unit rate.
#[inline]
fn fill_row(
    model: &Model,
    motion: &[Kinematics],
    row: &mut [f64],
    first: usize,
    b: usize,
    momentum: Vec3,
    mut angular: Vec3,
) {
    let mut below = b;
    loop {
        let a = model.bodies[below].parent;
        if a >= model.bodies.len() || model.bodies[a].driven_only {
            return;
        }
        angular += (motion[below].position - motion[a].position).cross(&momentum);
        match model.bodies[a].motion {
            Motion::Revolute { v, .. } => {
                let axis = motion[a].axis;
                row[v - first] = axis.dot(&(angular + motion[a].arm.cross(&momentum)));
            }
            Motion::Prismatic { v, .. } => row[v - first] = motion[a].axis.dot(&momentum),
            Motion::Free { v, .. } => {
                let at = v - first;
                row[at..at + 3].copy_from_slice(momentum.as_slice());
                row[at + 3..at + 6].copy_from_slice(angular.as_slice());
            }
            Motion::Fixed | Motion::Driven { .. } => {}
        }
        below = a;
    }
}

/// Visits the coordinates that move body `b` column by column: calls `visit(coordinate within block, point velocity, angular
/// velocity)`, both per unit rate, for the point `point` (world).
#[inline]
pub fn visit_columns(
    model: &Model,
    motion: &[Kinematics],
    b: usize,
    point: &Vec3,
    mut visit: impl FnMut(usize, Vec3, Vec3),
) {
    let mut at = b;
    while at < model.bodies.len() && !model.bodies[at].driven_only {
        let first = model.blocks[model.block_of[at]].v;
        let m = &motion[at];
        match model.bodies[at].motion {
            Motion::Revolute { v, .. } => {
                let joint = m.position - m.arm;
                visit(v - first, m.axis.cross(&(point - joint)), m.axis);
            }
            Motion::Prismatic { v, .. } => visit(v - first, m.axis, Vec3::zeros()),
            Motion::Free { v, .. } => visit_free(v - first, &(point - m.position), &mut visit),
            Motion::Fixed | Motion::Driven { .. } => {}
        }
        at = model.bodies[at].parent;
    }
}

/// The six columns of a free body for a point `d` from its centroid.
#[inline]
pub fn visit_free(v: usize, d: &Vec3, visit: &mut impl FnMut(usize, Vec3, Vec3)) {
    let zero = Vec3::zeros();
    visit(v, Vec3::x(), zero);
    visit(v + 1, Vec3::y(), zero);
    visit(v + 2, Vec3::z(), zero);
    visit(v + 3, Vec3::new(0.0, -d.z, d.y), Vec3::x());
    visit(v + 4, Vec3::new(d.z, 0.0, -d.x), Vec3::y());
    visit(v + 5, Vec3::new(-d.y, d.x, 0.0), Vec3::z());
}
