//! The paper's formulation (44)-(58): six velocity coordinates per body, constraints with Lagrange multipliers, Baumgarte
//! stabilisation. Orientations are unit quaternions, so there are no singularities; gyroscopic terms are kept.
//!
//! The KKT system (55) is solved by its Schur complement J M^-1 J^T. Allocates nothing after `new`.

use super::equations::{Equations, LEAST_PIVOT};
use super::kinematics::{self, Driven, Kinematics, Wrench, part};
use super::model::{BallJoint, BodyIndex, Model, Motion};
use super::path::Path;
use super::rows::RowSystem;
use super::tree::visit_free;
use crate::jet::Jet;
use crate::scene::{JointKind, Mat3, Scene, Vec3};

/// Baumgarte parameters of the paper: Phi'' + 2 alpha Phi' + beta^2 Phi = 0, 1/s.
const BAUMGARTE: (f64, f64) = (5.0, 5.0);

/// Kinds of constraint rows between a child and a parent.
#[derive(Clone, Copy, Debug)]
enum Rows {
    /// Two points coincide: 3 rows, (45) and the first three of (47).
    Point { child: Vec3, parent: Vec3 },
    /// A vector of the child stays perpendicular to one of the parent: 1 row, as in (46), (47).
    Perpendicular { child: Vec3, parent: Vec3 },
    /// The child's point stays at `parent + s along`, s = 0 or the driven coordinate: 1 row, (46) and Phi_D of (48).
    Offset {
        child: Vec3,
        parent: Vec3,
        along: Vec3,
        drive: Option<usize>,
    },
    /// Angle from the parent's `zero` to the child's `child` about `axis` is the driven coordinate: 1 row.
    Angle {
        child: Vec3,
        zero: Vec3,
        axis: Vec3,
        drive: usize,
    },
}

impl Rows {
    fn count(&self) -> usize {
        if matches!(self, Self::Point { .. }) {
            3
        } else {
            1
        }
    }
}

/// Rows of one joint, between a child and a parent.
pub struct Group {
    rows: Rows,
    pub child: BodyIndex,
    pub parent: BodyIndex,
    pub first: usize,
}

impl Group {
    /// Indices of its rows.
    pub fn rows(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.rows.count()
    }
}

/// J of one row for its two bodies: (velocity, angular velocity) of the child, then of the parent.
#[derive(Clone, Copy)]
struct JacobianRow {
    child: [Vec3; 2],
    parent: [Vec3; 2],
    /// Inverse inertia of both times their angular parts; zero for the world.
    turned: [Vec3; 2],
}

impl JacobianRow {
    fn new(child: [Vec3; 2], parent: [Vec3; 2]) -> Self {
        Self {
            child,
            parent,
            turned: [Vec3::zeros(); 2],
        }
    }
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
    /// First row of each ideal ball joint.
    ideal_row: Vec<usize>,
    rows: Vec<JacobianRow>,
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
}

/// The constraint rows of a scene.
pub struct Layout {
    pub groups: Vec<Group>,
    /// Number of rows.
    rows: usize,
    /// First row of each driven coordinate and of each ideal ball joint.
    driver_row: Vec<usize>,
    ideal_row: Vec<usize>,
}

impl Layout {
    /// For `scene` compiled as `model`.
    pub fn new(scene: &Scene, model: &Model) -> Self {
        let mut groups: Vec<Group> = Vec::new();
        let mut rows = 0;
        let mut driver_row = vec![0; model.drives.len()];
        let mut add = |rows_of: Rows, child: BodyIndex, parent: BodyIndex| {
            let first = rows;
            rows += rows_of.count();
            groups.push(Group {
                rows: rows_of,
                child,
                parent,
                first,
            });
            first
        };
        for (b, (body, joint)) in model.bodies.iter().zip(&scene.joints).enumerate() {
            let parent = body.parent;
            // Vectors of the parent, and the same vectors in the child's axes at q = 0.
            let x = joint.axis;
            let across = if x.x.abs() < 0.7 {
                Vec3::x()
            } else {
                Vec3::y()
            };
            let y = x.cross(&across).normalize();
            let z = x.cross(&y);
            let seen = |v: &Vec3| joint.rotation.inverse() * v;
            let (child_point, parent_point) = (-body.to_centroid, body.from_parent);
            let point = Rows::Point {
                child: child_point,
                parent: parent_point,
            };
            let perpendicular = |c: &Vec3, p: &Vec3| Rows::Perpendicular {
                child: seen(c),
                parent: *p,
            };
            let offset = |along: &Vec3, drive| Rows::Offset {
                child: child_point,
                parent: parent_point,
                along: *along,
                drive,
            };
            let drive = match body.motion {
                Motion::Driven { drive, .. } => Some(drive),
                _ => None,
            };
            match joint.kind {
                JointKind::Free => {}
                JointKind::Fixed => {
                    add(point, b, parent);
                    for (c, p) in [(&x, &y), (&x, &z), (&y, &z)] {
                        add(perpendicular(c, p), b, parent);
                    }
                }
                JointKind::Revolute => {
                    add(point, b, parent);
                    add(perpendicular(&x, &y), b, parent);
                    add(perpendicular(&x, &z), b, parent);
                    if let Some(drive) = drive {
                        driver_row[drive] = add(
                            Rows::Angle {
                                child: seen(&y),
                                zero: y,
                                axis: x,
                                drive,
                            },
                            b,
                            parent,
                        );
                    }
                }
                JointKind::Prismatic => {
                    add(offset(&y, None), b, parent);
                    add(offset(&z, None), b, parent);
                    for (c, p) in [(&x, &y), (&x, &z), (&y, &z)] {
                        add(perpendicular(c, p), b, parent);
                    }
                    if let Some(drive) = drive {
                        driver_row[drive] = add(offset(&x, Some(drive)), b, parent);
                    }
                }
            }
        }
        let ideal_row = model
            .ideal_joints
            .iter()
            .map(|&j| {
                let joint = &model.joints[j];
                let point = Rows::Point {
                    child: joint.ball.offset,
                    parent: joint.socket.offset,
                };
                add(point, joint.ball.body, joint.socket.body)
            })
            .collect();
        Self {
            groups,
            rows,
            driver_row,
            ideal_row,
        }
    }
}

impl Lagrange {
    /// For `scene` compiled as `model`.
    pub fn new(scene: &Scene, model: &Model) -> Self {
        let Layout {
            groups,
            rows,
            driver_row,
            ideal_row,
        } = Layout::new(scene, model);
        let group_of: Vec<usize> = groups
            .iter()
            .enumerate()
            .flat_map(|(g, group)| std::iter::repeat_n(g, group.rows.count()))
            .collect();
        let pairs = pairs_of(&groups, model.world());
        let mut columns = vec![Vec::new(); rows];
        for &(i, j) in &pairs {
            if j < i {
                columns[i].push(j);
            }
        }
        let n = model.bodies.len();
        let empty = JacobianRow::new([Vec3::zeros(); 2], [Vec3::zeros(); 2]);
        // Bodies that depend on time alone are part of the state here too.
        let mut driven = Driven::new(model);
        driven.only_coordinates();
        Self {
            motion: vec![Kinematics::rest(); n + 1],
            wrench: vec![Wrench::zero(); n + 1],
            driven,
            groups,
            driver_row,
            ideal_row,
            rows: vec![empty; rows],
            group_of,
            pairs,
            matrix: RowSystem::new(columns),
            multipliers: vec![0.0; rows],
            residual: vec![0.0; rows],
            inverse_inertia: vec![Mat3::zeros(); n],
            scale: body_scales(model),
            drift: 0.0,
            least_pivot: f64::INFINITY,
        }
    }

    /// J_i M^-1 J_j^T.
    #[inline]
    fn mobility(&self, model: &Model, i: usize, j: usize) -> f64 {
        let (gi, gj) = (
            &self.groups[self.group_of[i]],
            &self.groups[self.group_of[j]],
        );
        let (ri, rj) = (&self.rows[i], &self.rows[j]);
        let mut sum = 0.0;
        let others = [
            (gj.child, &rj.child[0], &rj.turned[0]),
            (gj.parent, &rj.parent[0], &rj.turned[1]),
        ];
        for (bi, ji) in [(gi.child, &ri.child), (gi.parent, &ri.parent)] {
            if bi == model.bodies.len() {
                continue;
            }
            for (bj, moved, turned) in others {
                if bi == bj {
                    sum += ji[0].dot(moved) / model.bodies[bi].mass + ji[1].dot(turned);
                }
            }
        }
        sum
    }

    /// Jacobian rows, and the residual of the unconstrained accelerations: -(J a0 + bias) - 2 alpha Phi' - beta^2 Phi.
    fn linearise(&mut self) {
        self.drift = 0.0;
        let zero = Vec3::zeros();
        for group in &self.groups {
            let (c, p) = (&self.motion[group.child], &self.motion[group.parent]);
            let (wc, wp) = (c.angular_velocity, p.angular_velocity);
            let at = group.first;
            match group.rows {
                Rows::Point { child, parent } => {
                    let (dc, dp) = (c.rotation * child, p.rotation * parent);
                    let phi = (c.position + dc) - (p.position + dp);
                    let rate = c.point_velocity(&dc) - p.point_velocity(&dp);
                    let acceleration = c.point_acceleration(&dc) - p.point_acceleration(&dp);
                    for i in 0..3 {
                        let mut e = zero;
                        e[i] = 1.0;
                        self.rows[at + i] = JacobianRow::new([e, dc.cross(&e)], [-e, e.cross(&dp)]);
                        self.residual[at + i] = stabilised(phi[i], rate[i], acceleration[i]);
                        self.drift = self.drift.max(phi[i].abs());
                    }
                }
                Rows::Perpendicular { child, parent } => {
                    let (a, b) = (c.rotation * child, p.rotation * parent);
                    let cross = a.cross(&b);
                    let phi = a.dot(&b);
                    let relative = wc - wp;
                    let turning = wc.cross(&a).cross(&b) + a.cross(&wp.cross(&b));
                    let acceleration = (c.angular_acceleration - p.angular_acceleration)
                        .dot(&cross)
                        + relative.dot(&turning);
                    self.rows[at] = JacobianRow::new([zero, cross], [zero, -cross]);
                    self.residual[at] = stabilised(phi, relative.dot(&cross), acceleration);
                    self.drift = self.drift.max(phi.abs());
                }
                Rows::Offset {
                    child,
                    parent,
                    along,
                    drive,
                } => {
                    let (dc, dp, b) = (c.rotation * child, p.rotation * parent, p.rotation * along);
                    let f = drive.map_or(Jet::default(), |d| self.driven.coordinates[d]);
                    let d = (c.position + dc) - (p.position + dp);
                    let d1 = c.point_velocity(&dc) - p.point_velocity(&dp);
                    let d2 = c.point_acceleration(&dc) - p.point_acceleration(&dp);
                    let b1 = wp.cross(&b);
                    let b2 = p.angular_acceleration.cross(&b) + wp.cross(&b1);
                    let phi = b.dot(&d) - f.value;
                    let rate = b1.dot(&d) + b.dot(&d1) - f.rate;
                    let acceleration = b2.dot(&d) + 2.0 * b1.dot(&d1) + b.dot(&d2) - f.acceleration;
                    self.rows[at] =
                        JacobianRow::new([b, dc.cross(&b)], [-b, b.cross(&dp) + b.cross(&d)]);
                    self.residual[at] = stabilised(phi, rate, acceleration);
                    self.drift = self.drift.max(phi.abs());
                }
                Rows::Angle {
                    child,
                    zero: reference,
                    axis,
                    drive,
                } => {
                    let (a, b, x) = (
                        c.rotation * child,
                        p.rotation * reference,
                        p.rotation * axis,
                    );
                    let f = self.driven.coordinates[drive];
                    let angle = libm::atan2(b.cross(&a).dot(&x), b.dot(&a));
                    // A driven crank turns many times: compare modulo a turn.
                    let turns = libm::round((f.value - angle) / std::f64::consts::TAU);
                    let phi = angle + turns * std::f64::consts::TAU - f.value;
                    let relative = wc - wp;
                    let acceleration = (c.angular_acceleration - p.angular_acceleration).dot(&x)
                        + relative.dot(&wp.cross(&x))
                        - f.acceleration;
                    self.rows[at] = JacobianRow::new([zero, x], [zero, -x]);
                    self.residual[at] = stabilised(phi, relative.dot(&x) - f.rate, acceleration);
                    self.drift = self.drift.max(phi.abs());
                }
            }
        }
    }
}

impl Equations for Lagrange {
    fn positions(&self, model: &Model) -> usize {
        7 * model.bodies.len()
    }

    fn velocities(&self, model: &Model) -> usize {
        6 * model.bodies.len()
    }

    fn scale<'a>(&'a self, _: &'a Model) -> &'a [f64] {
        &self.scale
    }

    fn treat_as_dependent(&mut self, rank: usize) {
        let balls = self.ideal_row.first().copied().unwrap_or(self.rows.len());
        let group = |&g: &usize| self.groups[g].first;
        let group = self.group_of.iter().map(group).collect();
        self.matrix.treat_as_dependent(balls + rank, balls, group);
    }

    fn state_of(&self, model: &Model, _: Vec<f64>, motion: &[Kinematics]) -> Vec<f64> {
        let bodies = model.bodies.len();
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

    fn coordinate(&self, model: &Model, _: &[f64], b: BodyIndex) -> Option<[f64; 2]> {
        match model.bodies[b].motion {
            Motion::Driven { drive, .. } => Some(self.driven.coordinate(drive)),
            Motion::Revolute { .. } | Motion::Prismatic { .. } => Some([
                position_of(model, &self.motion, b),
                rate_of(model, &self.motion, b),
            ]),
            Motion::Fixed | Motion::Free { .. } => None,
        }
    }

    fn update_kinematics(&mut self, model: &Model, t: f64, y: &[f64]) {
        self.driven.update(model, t, &mut self.motion);
        let n = model.bodies.len();
        let (qs, vs) = y.split_at(7 * n);
        for b in 0..n {
            self.motion[b].move_freely(part(qs, 7 * b), part(vs, 6 * b));
        }
    }

    fn path(&self, model: &Model, joint: &BallJoint) -> Option<Path> {
        Some(Path::of_bodies(model, joint))
    }

    fn update_along(&mut self, model: &Model, _: f64, y: &[f64], path: &Path) {
        let (qs, vs) = y.split_at(7 * model.bodies.len());
        for &b in &path.dynamic {
            self.motion[b].move_freely(part(qs, 7 * b), part(vs, 6 * b));
        }
    }

    fn loads(&mut self) -> (&[Kinematics], &mut [Wrench]) {
        (&self.motion, &mut self.wrench)
    }

    fn accelerate(&mut self, model: &Model, gravity: &Vec3, _: f64, _: &[f64], dv: &mut [f64]) {
        for (b, body) in model.bodies.iter().enumerate() {
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
        for (row, &group) in self.rows.iter_mut().zip(&self.group_of) {
            let group = &self.groups[group];
            for (b, turned, j) in [
                (group.child, 0, row.child[1]),
                (group.parent, 1, row.parent[1]),
            ] {
                if b < model.bodies.len() {
                    row.turned[turned] = self.inverse_inertia[b] * j;
                }
            }
        }
        self.matrix.clear();
        for &(i, j) in &self.pairs {
            let value = self.mobility(model, i, j);
            self.matrix.add(i, j, value);
        }
        self.least_pivot = self.matrix.factor();
        self.multipliers.copy_from_slice(&self.residual);
        self.matrix.solve(&mut self.multipliers);
        for (i, row) in self.rows.iter().enumerate() {
            let group = &self.groups[self.group_of[i]];
            let lambda = self.multipliers[i];
            for (b, j) in [(group.child, &row.child), (group.parent, &row.parent)] {
                if b < model.bodies.len() {
                    let m = &mut self.motion[b];
                    m.acceleration += j[0] * (lambda / model.bodies[b].mass);
                    m.angular_acceleration += self.inverse_inertia[b] * j[1] * lambda;
                }
            }
        }
        for (b, m) in self.motion[..model.bodies.len()].iter().enumerate() {
            dv[6 * b..6 * b + 3].copy_from_slice(m.acceleration.as_slice());
            dv[6 * b + 3..6 * b + 6].copy_from_slice(m.angular_acceleration.as_slice());
        }
    }

    /// Nothing to do: [`Self::accelerate`] has already written them.
    fn complete_motion(&mut self, _: &Model, _: &[f64], _: &[f64]) {}

    fn position_rate(&self, model: &Model, y: &[f64], dq: &mut [f64]) {
        let n = model.bodies.len();
        let (qs, vs) = y.split_at(7 * n);
        for b in 0..n {
            let rate = kinematics::free_rate(part(qs, 7 * b), part(vs, 6 * b));
            dq[7 * b..7 * b + 7].copy_from_slice(&rate);
        }
    }

    fn velocities_of(&self, model: &Model, y: &[f64], rate: &[f64], out: &mut [f64]) {
        for b in 0..model.bodies.len() {
            out[6 * b..6 * b + 3].copy_from_slice(&rate[7 * b..7 * b + 3]);
            let turn = 7 * b + 3..7 * b + 7;
            let spin = kinematics::spin_of(&y[turn.clone()], &rate[turn]);
            out[6 * b + 3..6 * b + 6].copy_from_slice(&spin);
        }
    }

    fn project(&mut self, model: &Model, _: f64, y: &mut [f64]) -> f64 {
        for b in 0..model.bodies.len() {
            kinematics::normalise_quaternion(&mut y[7 * b + 3..7 * b + 7]);
        }
        0.0
    }

    fn projects(&self) -> bool {
        false
    }

    fn visit_columns(
        &self,
        model: &Model,
        body: usize,
        point: &Vec3,
        mut visit: &mut dyn FnMut(usize, Vec3, Vec3),
    ) {
        if body < model.bodies.len() {
            let arm = point - self.motion[body].position;
            visit_free(6 * body, &arm, &mut visit);
        }
    }

    fn apply_inverse_mass(&mut self, model: &Model, x: &mut [f64]) {
        for (b, body) in model.bodies.iter().enumerate() {
            let torque = Vec3::new(x[6 * b + 3], x[6 * b + 4], x[6 * b + 5]);
            let alpha = self.inverse_inertia[b] * torque;
            for i in 0..3 {
                x[6 * b + i] /= body.mass;
                x[6 * b + 3 + i] = alpha[i];
            }
        }
        let part = |x: &[f64], b: usize, at: usize| {
            Vec3::new(x[6 * b + at], x[6 * b + at + 1], x[6 * b + at + 2])
        };
        for (i, row) in self.rows.iter().enumerate() {
            let group = &self.groups[self.group_of[i]];
            let mut sum = 0.0;
            for (b, j) in [(group.child, &row.child), (group.parent, &row.parent)] {
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
            for (b, j) in [(group.child, &row.child), (group.parent, &row.parent)] {
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

    fn apply_inverse_mass_within(&mut self, model: &Model, _: (usize, usize), x: &mut [f64]) {
        self.apply_inverse_mass(model, x);
    }

    fn is_block_diagonal(&self) -> bool {
        false
    }

    fn prescribed_motion(&mut self, _: &Model, _: f64, _: &[f64]) -> Option<&[Kinematics]> {
        None
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

    fn reaction(&self, k: usize) -> Vec3 {
        Vec3::from_column_slice(&self.multipliers[self.ideal_row[k]..][..3])
    }

    fn is_reaction_unique(&self, k: usize) -> bool {
        self.matrix.is_unique(self.ideal_row[k], 3)
    }

    fn actuators(&mut self, _: &Model, _: &Vec3, out: &mut [f64]) {
        for (out, &row) in out.iter_mut().zip(&self.driver_row) {
            *out = self.multipliers[row];
        }
    }

    /// From the multipliers of the joints' rows, which come before those of the ball joints.
    fn joint_loads(&mut self) -> (&[Kinematics], &[Wrench]) {
        self.wrench.fill(Wrench::zero());
        let balls = self.ideal_row.first().copied();
        let rows = &self.rows[..balls.unwrap_or(self.rows.len())];
        for ((row, &group), lambda) in rows.iter().zip(&self.group_of).zip(&self.multipliers) {
            let [along, about] = row.child;
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
        each.map(|(drive, &row)| self.multipliers[row] * rate_of(model, &self.motion, drive.body))
            .sum()
    }
}

/// Angle, rad, or displacement, m, of a joint from the poses of the two bodies it connects.
fn position_of(model: &Model, motion: &[Kinematics], b: usize) -> f64 {
    let body = &model.bodies[b];
    let (child, parent) = (&motion[b], &motion[body.parent]);
    match body.motion {
        Motion::Revolute { .. } => {
            // The three parts of the relative rotation are orthogonal matrices.
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

/// Rate of a joint from the motion of the two bodies it connects.
fn rate_of(model: &Model, motion: &[Kinematics], b: usize) -> f64 {
    let body = &model.bodies[b];
    let (child, parent) = (&motion[b], &motion[body.parent]);
    let axis = parent.rotation * body.axis;
    match body.motion {
        Motion::Revolute { .. } | Motion::Driven { revolute: true, .. } => {
            axis.dot(&(child.angular_velocity - parent.angular_velocity))
        }
        _ => {
            // Relative to the parent's point that currently coincides with the child's joint point.
            let arm = child.rotation * -body.to_centroid;
            let at = child.position + arm - parent.position;
            axis.dot(&(child.point_velocity(&arm) - parent.point_velocity(&at)))
        }
    }
}

/// Pairs of each row with the rows at or before it that share a body with it, in order.
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

/// Scales of the body coordinates: those of a free body in the tree, from the model's length scale.
fn body_scales(model: &Model) -> Vec<f64> {
    let n = model.bodies.len();
    let (length, speed) = (model.length_scale, model.length_scale / 0.1);
    let mut scale = Vec::with_capacity(13 * n);
    for _ in 0..n {
        scale.extend([length, length, length, 0.05, 0.05, 0.05, 0.05]);
    }
    for _ in 0..n {
        scale.extend([speed, speed, speed, 1.0, 1.0, 1.0]);
    }
    scale
}
