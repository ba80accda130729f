//! The paper's formulation (44)-(58): six velocity coordinates per body, constraints with Lagrange multipliers, Baumgarte
//! stabilisation. Orientations are unit quaternions, so there are no singularities; gyroscopic terms are included.
//!
//! The KKT system (55) is solved by its Schur complement J M^-1 J^T. Allocates nothing after `new`.

use super::equations::{Equations, LEAST_PIVOT};
use super::kinematics::{self, Driven, Kinematics, Wrench, part};
use super::model::{Anchor, BodyIndex, Model, Motion, Pair, Site};
use super::pairs::{JacobianRow, Rows};
use super::path::Path;
use super::rows::RowSystem;
use super::tree::visit_free;
use crate::machine::{Machine, Mat3, Vec3};
use std::ops::Range;

/// Baumgarte parameters of the paper: Phi'' + 2 alpha Phi' + beta^2 Phi = 0, 1/s.
const BAUMGARTE: (f64, f64) = (5.0, 5.0);

/// Pivot ratio below which a step ends with a projection onto the constraints. In a pose in which rows become dependent, the
/// drift not yet removed by stabilisation would be divided by the pivot and throw the mechanism onto another branch.
const NEAR_SINGULAR: f64 = 1e-2;
/// Maximum number of position corrections, and the violation at rounding level, m or rad.
const CORRECTIONS: usize = 8;
const CLOSED: f64 = 1e-14;

/// Rows of one joint between a child and a parent.
pub struct Group {
    rows: Rows,
    pub child: BodyIndex,
    pub parent: BodyIndex,
    pub first: usize,
}

impl Group {
    /// Indices of its rows.
    pub fn rows(&self) -> Range<usize> {
        self.first..self.first + self.rows.count()
    }
}

/// One row.
#[derive(Clone, Copy, Default)]
struct Row {
    j: JacobianRow,
    /// Inverse inertias of child and parent times the angular parts; zero for the world.
    inertia_weighted: [Vec3; 2],
}

/// Equations of motion with multipliers.
pub struct Lagrange {
    /// Bodies, then the world.
    motion: Vec<Kinematics>,
    /// External loads of the latest evaluation.
    wrench: Vec<Wrench>,
    /// Driven coordinates.
    driven: Driven,
    groups: Vec<Group>,
    /// Row of each driven coordinate.
    driver_row: Vec<usize>,
    /// Rows of each joint that closes a loop; they follow all others.
    closing_rows: Vec<Range<usize>>,
    rows: Vec<Row>,
    /// Group of each row.
    group_of: Vec<usize>,
    /// Pairs (i, j), j <= i, of rows that share a body.
    pairs: Vec<(usize, usize)>,
    matrix: RowSystem,
    multipliers: Vec<f64>,
    residual: Vec<f64>,
    inverse_inertia: Vec<Mat3>,
    scale: Vec<f64>,
    /// Largest constraint violation at the latest evaluation: m, or rad for orientation rows.
    drift: f64,
    /// Smallest pivot ratio of the latest factorisation.
    least_pivot: f64,
    /// Whether the latest step was projected onto the constraints.
    projected: bool,
    /// State before the latest correction.
    state_before: Vec<f64>,
}

/// The constraint rows of a scene.
pub struct Layout {
    pub groups: Vec<Group>,
    /// Number of rows.
    rows: usize,
    /// Row of each driven coordinate.
    driver_row: Vec<usize>,
    closing_rows: Vec<Range<usize>>,
}

impl Layout {
    /// For `machine` compiled as `model`.
    pub fn new(machine: &Machine, model: &Model) -> Self {
        let mut groups: Vec<Group> = Vec::new();
        let mut rows = 0;
        let mut driver_row = vec![0; model.drives.len()];
        let mut add = |rows_of: Rows, child: BodyIndex, parent: BodyIndex| {
            let first = rows;
            rows += rows_of.count();
            groups.push(Group { rows: rows_of, child, parent, first });
            first
        };
        for (b, (body, joint)) in model.bodies.iter().zip(&machine.joints).enumerate() {
            let pair = match model.two_degree_joint_at(b) {
                Some((pair, _)) => *pair,
                None => {
                    let child = Anchor { body: b, offset: -body.to_centroid };
                    let parent = Anchor { body: body.parent, offset: body.from_parent };
                    Pair::new(joint, child, parent)
                }
            };
            let parent = pair.parent.body;
            for rows in pair.rows().into_iter().flatten() {
                add(rows, b, parent);
            }
            // The first of two coordinates belongs to the link.
            let link = model.two_degree_joint_at(b).map(|_| body.parent);
            for (part, of) in link.into_iter().chain([b]).enumerate() {
                if let Motion::Driven { drive, .. } = model.bodies[of].motion {
                    driver_row[drive] = add(pair.driven_row(part, drive), b, parent);
                }
            }
        }
        let mut closing_rows = Vec::new();
        for cut in model.cuts(&model.ideal_joints) {
            let own = cut.rows.into_iter().flatten();
            let own = own.map(|of| (add(of, cut.child.body, cut.parent.body), of.count()));
            let ends = own.map(|(first, count)| first..first + count);
            closing_rows.extend(ends.reduce(|a, b| a.start..b.end));
        }
        Self { groups, rows, driver_row, closing_rows }
    }
}

impl Lagrange {
    /// For `machine` compiled as `model`.
    pub fn new(machine: &Machine, model: &Model) -> Self {
        let Layout { groups, rows, driver_row, closing_rows } = Layout::new(machine, model);
        let group_of: Vec<usize> =
            groups.iter().enumerate().flat_map(|(g, group)| std::iter::repeat_n(g, group.rows.count())).collect();
        let pairs = pairs_of(&groups, model.world());
        let mut columns = vec![Vec::new(); rows];
        for &(i, j) in &pairs {
            if j < i {
                columns[i].push(j);
            }
        }
        let n = model.massive;
        // Here, bodies that depend on time alone are part of the state, too.
        let mut driven = Driven::new(model);
        driven.exclude_bodies();
        Self {
            motion: vec![Kinematics::rest(); model.world() + 1],
            wrench: vec![Wrench::zero(); model.world() + 1],
            driven,
            groups,
            driver_row,
            closing_rows,
            rows: vec![Row::default(); rows],
            group_of,
            pairs,
            matrix: RowSystem::new(columns),
            multipliers: vec![0.0; rows],
            residual: vec![0.0; rows],
            inverse_inertia: vec![Mat3::zeros(); n],
            scale: body_scales(model),
            drift: 0.0,
            least_pivot: f64::INFINITY,
            projected: false,
            state_before: vec![0.0; 13 * n],
        }
    }

    /// J_i M^-1 J_j^T.
    #[inline]
    fn mobility(&self, model: &Model, i: usize, j: usize) -> f64 {
        let (gi, gj) = (&self.groups[self.group_of[i]], &self.groups[self.group_of[j]]);
        let (ri, rj) = (&self.rows[i].j, &self.rows[j]);
        let mut sum = 0.0;
        let others = [
            (gj.child, &rj.j.child[0], &rj.inertia_weighted[0]),
            (gj.parent, &rj.j.parent[0], &rj.inertia_weighted[1]),
        ];
        for (bi, ji) in [(gi.child, &ri.child), (gi.parent, &ri.parent)] {
            if bi == model.bodies.len() {
                continue;
            }
            for (bj, moved, inertia_weighted) in others {
                if bi == bj {
                    sum += ji[0].dot(moved) / model.bodies[bi].mass + ji[1].dot(inertia_weighted);
                }
            }
        }
        sum
    }

    /// Factors J M^-1 J^T of the rows last linearised.
    fn factor(&mut self, model: &Model) {
        for (Row { j, inertia_weighted }, &group) in self.rows.iter_mut().zip(&self.group_of) {
            let group = &self.groups[group];
            let [of_child, of_parent] = inertia_weighted;
            for (b, inertia_weighted, j) in
                [(group.child, of_child, j.child[1]), (group.parent, of_parent, j.parent[1])]
            {
                if b < model.bodies.len() {
                    *inertia_weighted = self.inverse_inertia[b] * j;
                }
            }
        }
        self.matrix.clear();
        for &(i, j) in &self.pairs {
            let value = self.mobility(model, i, j);
            self.matrix.add(i, j, value);
        }
        self.least_pivot = self.matrix.factor();
    }

    /// Projects positions, then velocities, onto the constraints in the metric of the mass matrix.
    fn project_onto_constraints(&mut self, model: &Model, t: f64, y: &mut [f64]) {
        let nq = 7 * model.massive;
        let mut before = f64::INFINITY;
        for _ in 0..CORRECTIONS {
            self.evaluate_violations(model, t, y, |[phi, _, _]| -phi);
            // In the singular pose itself, no correction closes the rows; elsewhere, dependent rows retain the inconsistency of
            // the dimensions.
            if self.drift > before {
                y.copy_from_slice(&self.state_before);
            }
            if self.drift <= CLOSED || self.drift >= 0.5 * before {
                break;
            }
            before = self.drift;
            self.state_before.copy_from_slice(y);
            self.matrix.solve(&mut self.residual);
            self.visit_corrections(model, |b, moved, inertia_weighted| {
                for i in 0..3 {
                    y[7 * b + i] += moved[i];
                }
                kinematics::rotate_quaternion(&mut y[7 * b + 3..7 * b + 7], &inertia_weighted);
            });
        }
        self.evaluate_violations(model, t, y, |[_, rate, _]| -rate);
        self.matrix.solve(&mut self.residual);
        self.visit_corrections(model, |b, moved, inertia_weighted| {
            for i in 0..3 {
                y[nq + 6 * b + i] += moved[i];
                y[nq + 6 * b + 3 + i] += inertia_weighted[i];
            }
        });
    }

    /// Factors the rows at (t, y). The residual of each row is `of` its violation with first and second derivatives.
    fn evaluate_violations(&mut self, model: &Model, t: f64, y: &[f64], of: impl Fn([f64; 3]) -> f64) {
        self.update_kinematics(model, t, y);
        for (b, body) in model.bodies[..model.massive].iter().enumerate() {
            let rotation = &self.motion[b].rotation;
            self.inverse_inertia[b] = rotation * body.inertia_inverse * rotation.transpose();
        }
        self.linearise_with(of);
        self.factor(model);
    }

    /// M^-1 J^T times the solution in the residual, by body: displacement, m, and rotation, rad, or their rates.
    fn visit_corrections(&self, model: &Model, mut visit: impl FnMut(BodyIndex, Vec3, Vec3)) {
        for (row, (group, x)) in self.rows.iter().zip(self.group_of.iter().zip(&self.residual)) {
            let group = &self.groups[*group];
            for (b, j, inertia_weighted) in [
                (group.child, &row.j.child, &row.inertia_weighted[0]),
                (group.parent, &row.j.parent, &row.inertia_weighted[1]),
            ] {
                if b < model.bodies.len() {
                    visit(b, j[0] * (x / model.bodies[b].mass), inertia_weighted * *x);
                }
            }
        }
    }

    /// Jacobian rows, and the residual of the unconstrained accelerations: -(J a0 + bias) - 2 alpha Phi' - beta^2 Phi.
    fn linearise(&mut self) {
        self.linearise_with(|[phi, rate, acceleration]| stabilised(phi, rate, acceleration));
    }

    /// Jacobian rows. The residual of each is `of` its violation with first and second derivatives.
    fn linearise_with(&mut self, of: impl Fn([f64; 3]) -> f64) {
        self.drift = 0.0;
        for group in &self.groups {
            let (c, p) = (&self.motion[group.child], &self.motion[group.parent]);
            let record = |i: usize, row, violation: [f64; 3]| {
                self.rows[group.first + i].j = row;
                self.residual[group.first + i] = of(violation);
                self.drift = self.drift.max(violation[0].abs());
            };
            group.rows.linearise(c, p, &self.driven.coordinates, record);
        }
    }
}

impl Equations for Lagrange {
    fn positions(&self, model: &Model) -> usize {
        7 * model.massive
    }

    fn velocities(&self, model: &Model) -> usize {
        6 * model.massive
    }

    fn scale<'a>(&'a self, _: &'a Model) -> &'a [f64] {
        &self.scale
    }

    fn treat_as_dependent(&mut self, rank: usize) {
        let cut = self.closing_rows.first().map_or(self.rows.len(), |rows| rows.start);
        let group = |&g: &usize| self.groups[g].first;
        let group = self.group_of.iter().map(group).collect();
        self.matrix.treat_as_dependent(cut + rank, cut, group);
    }

    fn state_of(&self, model: &Model, _: Vec<f64>, motion: &[Kinematics]) -> Vec<f64> {
        let bodies = model.massive;
        let mut y = Vec::with_capacity(13 * bodies);
        for m in &motion[..bodies] {
            let q = kinematics::quaternion_of(&m.rotation);
            y.extend(m.position.iter());
            y.extend([q.w, q.i, q.j, q.k]);
        }
        for m in &motion[..bodies] {
            y.extend(m.velocity.iter());
            y.extend(m.angular_velocity.iter());
        }
        y
    }

    fn motion(&self) -> &[Kinematics] {
        &self.motion
    }

    fn driven(&self) -> &Driven {
        &self.driven
    }

    fn driven_mut(&mut self) -> &mut Driven {
        &mut self.driven
    }

    fn coordinate(&self, model: &Model, _: &[f64], b: BodyIndex) -> Option<[f64; 2]> {
        match model.bodies[b].motion {
            Motion::Driven { drive, .. } => Some(self.driven.coordinate(drive)),
            Motion::Revolute { .. } | Motion::Prismatic { .. } => match model.two_degree_joint_at(b) {
                Some((pair, part)) => pair.coordinates(&self.motion).nth(part),
                None => Some([position_of(model, &self.motion, b), rate_of(model, &self.motion, b)]),
            },
            Motion::Fixed | Motion::Free { .. } => None,
        }
    }

    fn update_kinematics(&mut self, model: &Model, t: f64, y: &[f64]) {
        self.driven.update(model, t, &mut self.motion);
        let n = model.massive;
        let (qs, vs) = y.split_at(7 * n);
        for b in 0..n {
            self.motion[b].move_freely(part(qs, 7 * b), part(vs, 6 * b));
        }
    }

    fn path(&self, model: &Model, site: &Site) -> Option<Path> {
        Some(Path::of_bodies(model, site))
    }

    fn update_along(&mut self, model: &Model, _: f64, y: &[f64], path: &Path) {
        let (qs, vs) = y.split_at(7 * model.massive);
        for &b in &path.dynamic {
            self.motion[b].move_freely(part(qs, 7 * b), part(vs, 6 * b));
        }
    }

    fn loads(&mut self) -> (&[Kinematics], &mut [Wrench]) {
        (&self.motion, &mut self.wrench)
    }

    fn accelerate(&mut self, model: &Model, gravity: &Vec3, _: f64, _: &[f64], dv: &mut [f64]) {
        for (b, body) in model.bodies[..model.massive].iter().enumerate() {
            let m = &mut self.motion[b];
            let load = &self.wrench[b];
            let w_body = m.rotation.tr_mul(&m.angular_velocity);
            let gyroscopic = w_body.cross(&(body.inertia * w_body));
            let torque = m.rotation.tr_mul(&load.torque) - gyroscopic;
            m.acceleration = load.force / body.mass + gravity;
            m.angular_acceleration = m.rotation * (body.inertia_inverse * torque);
            self.inverse_inertia[b] = m.rotation * body.inertia_inverse * m.rotation.transpose();
        }
        self.linearise();
        self.factor(model);
        self.multipliers.copy_from_slice(&self.residual);
        self.matrix.solve(&mut self.multipliers);
        for (i, row) in self.rows.iter().enumerate() {
            let group = &self.groups[self.group_of[i]];
            let lambda = self.multipliers[i];
            for (b, j) in [(group.child, &row.j.child), (group.parent, &row.j.parent)] {
                if b < model.bodies.len() {
                    let m = &mut self.motion[b];
                    m.acceleration += j[0] * (lambda / model.bodies[b].mass);
                    m.angular_acceleration += self.inverse_inertia[b] * j[1] * lambda;
                }
            }
        }
        for (b, m) in self.motion[..model.massive].iter().enumerate() {
            dv[6 * b..6 * b + 3].copy_from_slice(m.acceleration.as_slice());
            dv[6 * b + 3..6 * b + 6].copy_from_slice(m.angular_acceleration.as_slice());
        }
    }

    /// Does nothing: [`Self::accelerate`] has already written the accelerations.
    fn complete_motion(&mut self, _: &Model, _: &[f64], _: &[f64]) {}

    fn position_rate(&self, model: &Model, y: &[f64], dq: &mut [f64]) {
        let n = model.massive;
        let (qs, vs) = y.split_at(7 * n);
        for b in 0..n {
            let rate = kinematics::free_rate(part(qs, 7 * b), part(vs, 6 * b));
            dq[7 * b..7 * b + 7].copy_from_slice(&rate);
        }
    }

    fn velocities_of(&self, model: &Model, y: &[f64], rate: &[f64], out: &mut [f64]) {
        for b in 0..model.massive {
            out[6 * b..6 * b + 3].copy_from_slice(&rate[7 * b..7 * b + 3]);
            let turn = 7 * b + 3..7 * b + 7;
            let spin = kinematics::angular_velocity_of(&y[turn.clone()], &rate[turn]);
            out[6 * b + 3..6 * b + 6].copy_from_slice(&spin);
        }
    }

    fn displace(&self, model: &Model, out: &mut [f64], step: &[f64]) {
        for b in 0..model.massive {
            let [x, y, z, turn @ ..]: &[f64; 6] = part(step, 6 * b);
            for (q, step) in out[7 * b..].iter_mut().zip([x, y, z]) {
                *q += step;
            }
            kinematics::rotate_quaternion(&mut out[7 * b + 3..7 * b + 7], &Vec3::from(*turn));
        }
    }

    fn project(&mut self, model: &Model, t: f64, y: &mut [f64]) -> f64 {
        for b in 0..model.massive {
            kinematics::normalise_quaternion(&mut y[7 * b + 3..7 * b + 7]);
        }
        self.projected = self.least_pivot < NEAR_SINGULAR;
        if self.projected {
            self.project_onto_constraints(model, t, y);
        }
        0.0
    }

    fn projects(&self) -> bool {
        self.projected
    }

    fn visit_columns(&self, model: &Model, body: usize, point: &Vec3, mut visit: &mut dyn FnMut(usize, Vec3, Vec3)) {
        if body < model.bodies.len() {
            let arm = point - self.motion[body].position;
            visit_free(6 * body, &arm, &mut visit);
        }
    }

    fn apply_inverse_mass(&mut self, model: &Model, x: &mut [f64]) {
        for (b, body) in model.bodies[..model.massive].iter().enumerate() {
            let torque = Vec3::new(x[6 * b + 3], x[6 * b + 4], x[6 * b + 5]);
            let alpha = self.inverse_inertia[b] * torque;
            for i in 0..3 {
                x[6 * b + i] /= body.mass;
                x[6 * b + 3 + i] = alpha[i];
            }
        }
        let part = |x: &[f64], b: usize, at: usize| Vec3::new(x[6 * b + at], x[6 * b + at + 1], x[6 * b + at + 2]);
        for (i, row) in self.rows.iter().enumerate() {
            let group = &self.groups[self.group_of[i]];
            let mut sum = 0.0;
            for (b, j) in [(group.child, &row.j.child), (group.parent, &row.j.parent)] {
                if b < model.bodies.len() {
                    sum += j[0].dot(&part(x, b, 0)) + j[1].dot(&part(x, b, 3));
                }
            }
            self.residual[i] = -sum;
        }
        self.matrix.solve(&mut self.residual);
        for (i, row) in self.rows.iter().enumerate() {
            let group = &self.groups[self.group_of[i]];
            let lambda = self.residual[i];
            for (b, j) in [(group.child, &row.j.child), (group.parent, &row.j.parent)] {
                if b < model.bodies.len() {
                    let linear = j[0] * (lambda / model.bodies[b].mass);
                    let angular = self.inverse_inertia[b] * j[1] * lambda;
                    for k in 0..3 {
                        x[6 * b + k] += linear[k];
                        x[6 * b + 3 + k] += angular[k];
                    }
                }
            }
        }
    }

    fn free_body_inverse_mass(&self, _: &Model, _: usize) -> Option<(f64, Mat3)> {
        None
    }

    fn apply_inverse_mass_within(&mut self, model: &Model, _: (usize, usize), x: &mut [f64]) {
        self.apply_inverse_mass(model, x);
    }

    fn is_block_diagonal(&self) -> bool {
        false
    }

    fn rows(&self) -> usize {
        self.rows.len()
    }

    fn rank(&self) -> usize {
        self.matrix.rank()
    }

    fn least_pivot(&self) -> f64 {
        self.least_pivot
    }

    fn is_undetermined(&self) -> bool {
        !(self.least_pivot >= LEAST_PIVOT)
    }

    fn drift(&self) -> f64 {
        self.drift
    }

    fn is_kinematic(&self, _: &Model) -> bool {
        false
    }

    fn is_determinant_positive(&mut self, _: &Model) -> bool {
        true
    }

    fn closing_load(&self, k: usize) -> [Vec3; 2] {
        self.closing_load_of(k, &self.multipliers)
    }

    fn is_closing_load_unique(&self, k: usize) -> bool {
        let rows = &self.closing_rows[k];
        self.matrix.is_unique(rows.start, rows.len())
    }

    fn null_closing_loads(&self, k: usize) -> Vec<[Vec3; 2]> {
        self.matrix.null_loads(|null| self.closing_load_of(k, null))
    }

    fn actuator_forces(&mut self, _: &Model, _: &Vec3, out: &mut [f64]) {
        for (out, &row) in out.iter_mut().zip(&self.driver_row) {
            *out = self.multipliers[row];
        }
    }

    /// From the multipliers of tree joints, whose rows precede those of loop-closing joints.
    fn joint_loads(&mut self) -> (&[Kinematics], &[Wrench]) {
        self.wrench.fill(Wrench::zero());
        let cut = self.closing_rows.first().map_or(self.rows.len(), |rows| rows.start);
        let rows = &self.rows[..cut];
        for ((row, &group), lambda) in rows.iter().zip(&self.group_of).zip(&self.multipliers) {
            let [along, about] = row.j.child;
            let load = &mut self.wrench[self.groups[group].child];
            load.force += along * *lambda;
            load.torque += about * *lambda;
        }
        (&self.motion, &self.wrench)
    }

    fn is_actuator_unique(&mut self, _: &Model, _: &Vec3, i: usize) -> bool {
        self.matrix.is_unique(self.driver_row[i], 1)
    }

    fn prescribes_drives(&self) -> bool {
        false
    }

    fn drive_power(&mut self, model: &Model, _: &Vec3, _: &[f64], _: &[f64], _: bool) -> f64 {
        let each = model.drives.iter().zip(&self.driver_row);
        let rate = |b: BodyIndex| match model.two_degree_joint_at(b) {
            Some((pair, part)) => {
                let own = pair.coordinates(&self.motion).nth(part);
                own.map_or(0.0, |[_, rate]| rate)
            }
            None => rate_of(model, &self.motion, b),
        };
        each.map(|(drive, &row)| self.multipliers[row] * rate(drive.body)).sum()
    }
}

impl Lagrange {
    /// Force and torque on the child of the `k`-th joint that closes a loop from the `multipliers` of all rows.
    fn closing_load_of(&self, k: usize, multipliers: &[f64]) -> [Vec3; 2] {
        let mut load = [Vec3::zeros(); 2];
        for i in self.closing_rows[k].clone() {
            let part = usize::from(self.groups[self.group_of[i]].rows.turns());
            load[part] += self.rows[i].j.child[part] * multipliers[i];
        }
        load
    }
}

/// Angle, rad, or displacement, m, of a joint from the poses of the two connected bodies.
fn position_of(model: &Model, motion: &[Kinematics], b: usize) -> f64 {
    let body = &model.bodies[b];
    let (child, parent) = (&motion[b], &motion[body.parent]);
    match body.motion {
        Motion::Revolute { .. } => {
            // The three parts of the relative rotation are mutually orthogonal matrices.
            let turn = parent.rotation.transpose() * child.rotation;
            libm::atan2(turn.dot(&body.sine), turn.dot(&body.cosine))
        }
        _ => {
            let at = child.position - child.rotation * body.to_centroid;
            let from = parent.position + parent.rotation * body.from_parent;
            (parent.rotation * body.axis).dot(&(at - from))
        }
    }
}

/// Rate of a joint from the motion of the two connected bodies.
fn rate_of(model: &Model, motion: &[Kinematics], b: usize) -> f64 {
    let body = &model.bodies[b];
    let (child, parent) = (&motion[b], &motion[body.parent]);
    let axis = parent.rotation * body.axis;
    match body.motion {
        Motion::Revolute { .. } | Motion::Driven { revolute: true, .. } => {
            axis.dot(&(child.angular_velocity - parent.angular_velocity))
        }
        _ => {
            // Relative to the parent's point that coincides with the child's joint point.
            let arm = child.rotation * -body.to_centroid;
            let at = child.position + arm - parent.position;
            axis.dot(&(child.point_velocity(&arm) - parent.point_velocity(&at)))
        }
    }
}

/// Pairs of each row with itself and the earlier rows that share a body with it, in order.
fn pairs_of(groups: &[Group], world: BodyIndex) -> Vec<(usize, usize)> {
    let mut pairs = Vec::new();
    // Groups that act on each body so far.
    let mut on_body = vec![Vec::new(); world];
    let mut sharing = Vec::new();
    for (g, group) in groups.iter().enumerate() {
        sharing.clear();
        for body in [group.child, group.parent] {
            if body != world {
                on_body[body].push(g);
                sharing.extend_from_slice(&on_body[body]);
            }
        }
        sharing.sort_unstable();
        sharing.dedup();
        for i in group.rows() {
            let before = sharing.iter().flat_map(|&other| groups[other].rows());
            pairs.extend(before.take_while(|&j| j <= i).map(|j| (i, j)));
        }
    }
    pairs
}

/// Required change of the constraint acceleration: -(Phi'' + 2 alpha Phi' + beta^2 Phi).
#[inline]
fn stabilised(phi: f64, rate: f64, acceleration: f64) -> f64 {
    let (alpha, beta) = BAUMGARTE;
    -(acceleration + 2.0 * alpha * rate + beta * beta * phi)
}

/// Scales of the body coordinates, as for a free body in the tree.
fn body_scales(model: &Model) -> Vec<f64> {
    let (length, speed) = (model.length_scale, model.speed_scale());
    let angles = || model.spin_scales.iter().copied();
    let positions = angles().flat_map(|angle| [length, length, length].into_iter().chain([0.5 * angle; 4]));
    let velocities = angles().flat_map(|angle| [speed, speed, speed].into_iter().chain([speed / length * angle; 3]));
    positions.chain(velocities).collect()
}
