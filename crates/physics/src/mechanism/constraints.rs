//! Loop closure in tree coordinates: three constraint rows for each ideal ball joint, (45), up to six for other joints, solved
//! for their Lagrange multipliers, and the projection onto the constraints.

use super::kinematics::{Kinematics, Wrench, part};
use super::model::{Anchor, BodyIndex, Model};
use super::pairs::Rows;
use super::rows::RowSystem;
use super::tree::{Tree, visit_columns};
use crate::machine::{Mat3, Vec3};
use std::ops::Range;

mod openings;

/// Rows of one joint in one block: Jacobian J and W = M^-1 J^T, both 3 x n, row-major from `offset`.
struct Side {
    block: usize,
    offset: usize,
    n: usize,
}

impl Side {
    /// The three rows in `of`: the Jacobians or W.
    #[inline]
    fn rows<'a>(&self, of: &'a [f64]) -> [&'a [f64]; 3] {
        let rows = &of[self.offset..][..3 * self.n];
        let (first, others) = rows.split_at(self.n);
        let (second, third) = others.split_at(self.n);
        [first, second, third]
    }

    #[inline]
    fn rows_mut<'a>(&self, of: &'a mut [f64]) -> [&'a mut [f64]; 3] {
        let rows = &mut of[self.offset..][..3 * self.n];
        let (first, others) = rows.split_at_mut(self.n);
        let (second, third) = others.split_at_mut(self.n);
        [first, second, third]
    }
}

/// Translational or rotational part of a loop-closing joint. Its three rows in the blocks are the relative velocity, or angular
/// velocity, of its bodies in world axes; up to three directions of these are constrained.
struct Unit {
    /// Index of the joint among those that close loops.
    closure: usize,
    turns: bool,
    rows: Vec<Rows>,
    /// First constraint row, and number of rows.
    first: usize,
    count: usize,
    /// Constrained directions, and violation with its first and second derivative, at the latest motion.
    along: [Vec3; 3],
    state: [[f64; 3]; 3],
}

impl Unit {
    fn range(&self) -> Range<usize> {
        self.first..self.first + self.count
    }

    /// Updates directions and violations.
    fn measure(&mut self, model: &Model, motion: &[Kinematics]) {
        let pair = &model.closures[self.closure];
        let (c, p) = (&motion[pair.child.body], &motion[pair.parent.body]);
        let mut at = 0;
        for rows in &self.rows {
            rows.linearise(c, p, &[], |i, row, state| {
                self.along[at + i] = row.child[usize::from(self.turns)];
                self.state[at + i] = state;
            });
            at += rows.count();
        }
    }

    /// Force or torque of this unit, given the multipliers of all rows.
    fn load(&self, multipliers: &[f64]) -> Vec3 {
        let own = self.along.iter().zip(&multipliers[self.range()]);
        own.map(|(along, x)| along * *x).sum()
    }
}

/// Constraint rows of a set of ball joints and of all other loop-closing joints.
pub struct Constraints {
    joints: Vec<usize>,
    /// Units follow the ball joints.
    units: Vec<Unit>,
    sides: Vec<Vec<Side>>,
    /// (i, j, side of i, side of j) with j <= i for every shared block, between ball joints.
    pairs: Vec<(usize, usize, usize, usize)>,
    /// The same if i is a unit.
    unit_pairs: Vec<(usize, usize, usize, usize)>,
    jacobian: Vec<f64>,
    weighted: Vec<f64>,
    matrix: RowSystem,
    /// Multipliers of the latest solve: force on the ball, N, three per joint; then those of the units, N or N m.
    multipliers: Vec<f64>,
    scratch: Vec<f64>,
    step: Vec<f64>,
    square: Vec<f64>,
    /// Time and positions of the latest factorisation.
    time: Option<f64>,
    positions: Vec<f64>,
    /// Smallest pivot ratio of the latest factorisation.
    pub(crate) least_pivot: f64,
}

impl Constraints {
    /// Rows of the ball joints with these indices and of all other loop-closing joints.
    pub fn new(model: &Model, joints: &[usize]) -> Self {
        let mut total = 0;
        let mut count = 3 * joints.len();
        let mut units = Vec::new();
        for (closure, pair) in model.closures.iter().enumerate() {
            for (rows, turns) in pair.rows().into_iter().zip([false, true]) {
                let first = count;
                count += rows.iter().map(Rows::count).sum::<usize>();
                units.push(Unit {
                    closure,
                    turns,
                    rows,
                    first,
                    count: count - first,
                    along: [Vec3::zeros(); 3],
                    state: [[0.0; 3]; 3],
                });
            }
        }
        let block_of =
            |b: BodyIndex| (b < model.bodies.len() && !model.bodies[b].driven_only).then(|| model.block_of[b]);
        let balls = joints.iter().map(|&j| {
            let joint = &model.joints[j];
            [joint.carried.body, joint.carrier.body]
        });
        let others = units.iter().map(|unit| {
            let pair = &model.closures[unit.closure];
            [pair.child.body, pair.parent.body]
        });
        let sides: Vec<Vec<Side>> = balls
            .chain(others)
            .map(|bodies| {
                let mut blocks: Vec<usize> = bodies.into_iter().filter_map(block_of).collect();
                blocks.dedup();
                blocks
                    .into_iter()
                    .map(|block| {
                        let n = model.blocks[block].n;
                        let side = Side { block, offset: total, n };
                        total += 3 * n;
                        side
                    })
                    .collect()
            })
            .collect();
        let balls = joints.len();
        let rows_of = |i: usize| match i.checked_sub(balls) {
            None => 3 * i..3 * i + 3,
            Some(unit) => units[unit].range(),
        };
        let mut pairs = Vec::new();
        let mut columns = vec![Vec::new(); count];
        // (joint, side) pairs that act on each block so far.
        let mut on_block = vec![Vec::new(); model.blocks.len()];
        for (i, sides) in sides.iter().enumerate() {
            let from = pairs.len();
            for (si, side) in sides.iter().enumerate() {
                on_block[side.block].push((i, si));
                pairs.extend(on_block[side.block].iter().map(|&(j, sj)| (i, j, si, sj)));
            }
            pairs[from..].sort_unstable();
            for row in rows_of(i) {
                let others = pairs[from..].iter().flat_map(|&(_, j, ..)| rows_of(j));
                columns[row].extend(others.filter(|&column| column < row));
            }
        }
        let unit_pairs = pairs.split_off(pairs.partition_point(|&(i, ..)| i < balls));
        Self {
            joints: joints.to_vec(),
            units,
            sides,
            pairs,
            unit_pairs,
            jacobian: vec![0.0; total],
            weighted: vec![0.0; total],
            matrix: RowSystem::new(columns),
            multipliers: vec![0.0; count],
            scratch: vec![0.0; count],
            step: vec![0.0; model.nv],
            square: if count == model.nv { vec![0.0; model.nv * model.nv] } else { Vec::new() },
            time: None,
            positions: vec![0.0; model.nq],
            least_pivot: f64::INFINITY,
        }
    }

    /// Whether the Jacobian of the latest factorisation, if square, has a positive determinant. The sign changes when the loops
    /// pass through a singular pose.
    pub fn is_determinant_positive(&mut self, model: &Model) -> bool {
        self.is_minor_positive(model, Some)
    }

    /// The same for a subset of as many rows as coordinates; `place` maps a row to its index in the square matrix.
    pub fn is_minor_positive(&mut self, model: &Model, place: impl Fn(usize) -> Option<usize>) -> bool {
        let n = model.nv;
        let a = &mut self.square;
        a.resize(n * n, 0.0);
        a.fill(0.0);
        let (of_balls, of_units) = self.sides.split_at(self.joints.len());
        for (k, sides) in of_balls.iter().enumerate() {
            for side in sides {
                let first = model.blocks[side.block].v;
                for i in 0..3 {
                    let Some(at) = place(3 * k + i) else { continue };
                    let row = &self.jacobian[side.offset + i * side.n..][..side.n];
                    for (a, j) in a[at * n + first..].iter_mut().zip(row) {
                        *a += j;
                    }
                }
            }
        }
        for (unit, sides) in self.units.iter().zip(of_units) {
            for side in sides {
                let first = model.blocks[side.block].v;
                let [x, y, z] = side.rows(&self.jacobian);
                for (row, along) in unit.range().zip(&unit.along) {
                    let Some(at) = place(row) else { continue };
                    for (c, a) in a[at * n + first..][..side.n].iter_mut().enumerate() {
                        *a += along.dot(&Vec3::new(x[c], y[c], z[c]));
                    }
                }
            }
        }
        super::factor::is_determinant_positive(a, n)
    }

    /// From now on treats the rows as dependent, with a rank of at most `rank`.
    pub fn treat_as_dependent(&mut self, rank: usize) {
        let units = self.units_of_rows();
        let group = units.flat_map(|rows| rows.clone().map(move |_| rows.start));
        let group = group.collect();
        self.matrix.treat_as_dependent(rank, 0, group);
        self.time = None;
    }

    /// Whether rows are treated as dependent.
    pub fn is_dependent(&self) -> bool {
        self.matrix.is_dependent()
    }

    /// Number of independent rows: that of the latest factorisation if rows are treated as dependent, else all.
    pub fn rank(&self) -> usize {
        self.matrix.rank()
    }

    /// Whether the reaction of joint `k` is unique at the latest factorisation; ball joints come first, then other loop-closing
    /// joints.
    pub fn is_unique(&self, k: usize) -> bool {
        let rows = match k.checked_sub(self.joints.len()) {
            None => 3 * k..3 * k + 3,
            Some(closure) => self.units[2 * closure].first..self.units[2 * closure + 1].range().end,
        };
        self.matrix.is_unique(rows.start, rows.len())
    }

    /// Changes of the load of joint `k`, counted as in [`Self::is_unique`], that the motion does not determine: force and torque,
    /// each up to a common factor.
    pub fn null_loads(&self, k: usize) -> Vec<[Vec3; 2]> {
        self.matrix.null_loads(|null| match k.checked_sub(self.joints.len()) {
            None => [Vec3::from_column_slice(part::<3>(null, 3 * k)), Vec3::zeros()],
            Some(closure) => self.closure_load_of(closure, null),
        })
    }

    /// Row ranges: each ball joint, then the translational and rotational part of each other loop-closing joint.
    fn units_of_rows(&self) -> impl Iterator<Item = Range<usize>> {
        let balls = (0..self.joints.len()).map(|k| 3 * k..3 * k + 3);
        balls.chain(self.units.iter().map(Unit::range))
    }

    /// After a plain factorisation: the smallest ratio of a pivot to the largest diagonal entry of its joint.
    pub fn least_joint_pivot(&self) -> f64 {
        self.matrix.least_joint_pivot(self.units_of_rows())
    }

    /// The system J M^-1 J^T.
    pub fn system(&self) -> &RowSystem {
        &self.matrix
    }

    /// Ball joints by their index in the scene.
    pub fn joints(&self) -> &[usize] {
        &self.joints
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.multipliers.len()
    }

    /// Multipliers of the latest solve.
    pub fn multipliers(&self) -> &[f64] {
        &self.multipliers
    }

    /// Force on the ball of the `k`-th constrained joint, N.
    pub fn reaction(&self, k: usize) -> Vec3 {
        Vec3::from_column_slice(&self.multipliers[3 * k..3 * k + 3])
    }

    /// Adds the loads exerted on the bodies by `multipliers` of all rows to `wrench`.
    pub fn load(&self, model: &Model, multipliers: &[f64], motion: &[Kinematics], wrench: &mut [Wrench]) {
        let mut push = |body: BodyIndex, arm: Vec3, force: Vec3| {
            let w = &mut wrench[body];
            w.force += force;
            w.torque += arm.cross(&force);
        };
        for (k, &j) in self.joints.iter().enumerate() {
            let force = Vec3::from_column_slice(part::<3>(multipliers, 3 * k));
            let joint = &model.joints[j];
            let [ball, socket] = joint.arms(motion);
            push(joint.carried.body, ball, force);
            push(joint.carrier.body, socket, -force);
        }
        for unit in self.units.iter().filter(|unit| !unit.turns) {
            let pair = &model.closures[unit.closure];
            let force = unit.load(multipliers);
            let [child, parent] = pair.arms(motion);
            push(pair.child.body, child, force);
            push(pair.parent.body, parent, -force);
        }
        for unit in self.units.iter().filter(|unit| unit.turns) {
            let pair = &model.closures[unit.closure];
            let torque = unit.load(multipliers);
            wrench[pair.child.body].torque += torque;
            wrench[pair.parent.body].torque -= torque;
        }
    }

    /// Force, N, and torque, N m, exerted on its child by the `c`-th loop-closing joint.
    pub fn closure_load(&self, c: usize) -> [Vec3; 2] {
        self.closure_load_of(c, &self.multipliers)
    }

    fn closure_load_of(&self, c: usize, multipliers: &[f64]) -> [Vec3; 2] {
        [2 * c, 2 * c + 1].map(|unit| self.units[unit].load(multipliers))
    }

    /// Computes the Jacobians and factors J M^-1 J^T, unless the latest call was for the same (t, q). Kinematics and mass
    /// matrices of the tree must be up to date at (t, q).
    fn factor(&mut self, model: &Model, tree: &Tree, t: f64, q: &[f64]) {
        if self.is_factored(t, q) {
            return;
        }
        self.time = Some(t);
        self.positions.copy_from_slice(q);
        self.jacobian.fill(0.0);
        for (k, &j) in self.joints.iter().enumerate() {
            let joint = &model.joints[j];
            for (anchor, sign) in [(&joint.carried, 1.0), (&joint.carrier, -1.0)] {
                let m = &tree.motion[anchor.body];
                let point = m.position + m.rotation * anchor.offset;
                let Some(side) = self.sides[k].iter().find(|s| {
                    anchor.body < model.bodies.len()
                        && !model.bodies[anchor.body].driven_only
                        && s.block == model.block_of[anchor.body]
                }) else {
                    continue;
                };
                let [x, y, z] = side.rows_mut(&mut self.jacobian);
                visit_columns(model, &tree.motion, anchor.body, &point, |column, velocity, _| {
                    x[column] += sign * velocity.x;
                    y[column] += sign * velocity.y;
                    z[column] += sign * velocity.z;
                });
            }
        }
        self.add_unit_columns(model, &tree.motion);
        self.weighted.copy_from_slice(&self.jacobian);
        for side in self.sides.iter().flatten() {
            for row in side.rows_mut(&mut self.weighted) {
                tree.solve_block(model, side.block, row);
            }
        }
        self.matrix.clear();
        for &(i, j, si, sj) in &self.pairs {
            let (a, b) = (&self.sides[i][si], &self.sides[j][sj]);
            let (left, right) = (a.rows(&self.jacobian), b.rows(&self.weighted));
            let block = left.map(|left| right.map(|right| dot(left, right)));
            self.matrix.add_block(i, j, &block);
        }
        self.add_unit_blocks();
        self.least_pivot = self.matrix.factor();
    }

    /// Jacobians of the units.
    fn add_unit_columns(&mut self, model: &Model, motion: &[Kinematics]) {
        let balls = self.joints.len();
        for (unit, sides) in self.units.iter_mut().zip(&self.sides[balls..]) {
            unit.measure(model, motion);
            let pair = &model.closures[unit.closure];
            let arms = pair.arms(motion);
            let ends = [(&pair.child, arms[0], 1.0), (&pair.parent, arms[1], -1.0)];
            for (&Anchor { body, .. }, arm, sign) in ends {
                let moves = model.bodies.get(body).is_some_and(|own| !own.driven_only);
                let own = |side: &&Side| moves && side.block == model.block_of[body];
                let Some(side) = sides.iter().find(own) else {
                    continue;
                };
                let point = motion[body].position + arm;
                let [x, y, z] = side.rows_mut(&mut self.jacobian);
                let turns = unit.turns;
                visit_columns(model, motion, body, &point, |column, velocity, omega| {
                    let moved = if turns { omega } else { velocity };
                    x[column] += sign * moved.x;
                    y[column] += sign * moved.y;
                    z[column] += sign * moved.z;
                });
            }
        }
    }

    /// Blocks of J M^-1 J^T that involve units.
    fn add_unit_blocks(&mut self) {
        let balls = self.joints.len();
        let world = [Vec3::x(), Vec3::y(), Vec3::z()];
        for unit in &self.units {
            self.matrix.set_reference(unit.first, 0.0);
        }
        let mut diagonal_sum = (usize::MAX, 0.0);
        for &(i, j, si, sj) in &self.unit_pairs {
            let (a, b) = (&self.sides[i][si], &self.sides[j][sj]);
            let (left, right) = (a.rows(&self.jacobian), b.rows(&self.weighted));
            let block = left.map(|left| right.map(|right| dot(left, right)));
            let block = Mat3::from_fn(|r, c| block[r][c]);
            let unit = &self.units[i - balls];
            if i == j {
                // Sum over both sides, if there are two.
                let before = if diagonal_sum.0 == i { diagonal_sum.1 } else { 0.0 };
                diagonal_sum = (i, before + block.trace());
                self.matrix.set_reference(unit.first, diagonal_sum.1);
            }
            let (first, others) = match j.checked_sub(balls) {
                None => (3 * j, &world[..]),
                Some(other) => {
                    let other = &self.units[other];
                    (other.first, &other.along[..other.count])
                }
            };
            for (row, along) in unit.range().zip(&unit.along) {
                let moved = block.tr_mul(along);
                for (column, other) in (first..=row).zip(others) {
                    self.matrix.add(row, column, moved.dot(other));
                }
            }
        }
    }

    fn is_factored(&self, t: f64, q: &[f64]) -> bool {
        self.time == Some(t) && self.positions == q
    }

    /// x = J v for the three rows of joint or unit `k`.
    fn apply(&self, model: &Model, k: usize, v: &[f64]) -> Vec3 {
        let mut sum = Vec3::zeros();
        for side in &self.sides[k] {
            let v = &v[model.blocks[side.block].v..][..side.n];
            let rows = side.rows(&self.jacobian);
            sum += Vec3::from(rows.map(|row| dot(row, v)));
        }
        sum
    }

    /// v += M^-1 J^T x.
    fn add_weighted(&self, model: &Model, x: &[f64], v: &mut [f64]) {
        let (of_balls, of_units) = self.sides.split_at(self.joints.len());
        for (k, sides) in of_balls.iter().enumerate() {
            self.add_weighted_rows(model, sides, part(x, 3 * k), v);
        }
        for (unit, sides) in self.units.iter().zip(of_units) {
            self.add_weighted_rows(model, sides, &unit.load(x).into(), v);
        }
    }

    /// The same for the three rows of `sides`.
    #[inline(always)]
    fn add_weighted_rows(&self, model: &Model, sides: &[Side], &[x1, x2, x3]: &[f64; 3], v: &mut [f64]) {
        for side in sides {
            let v = &mut v[model.blocks[side.block].v..][..side.n];
            let [w1, w2, w3] = side.rows(&self.weighted);
            for (c, v) in v.iter_mut().enumerate() {
                *v = *v + w1[c] * x1 + w2[c] * x2 + w3[c] * x3;
            }
        }
    }

    /// Sets each unit's multipliers to the negative of its violation (`order` 0), its rate (1) or its second derivative (2) at
    /// `motion`. Returns the largest magnitude.
    fn set_unit_residuals(&mut self, model: &Model, motion: &[Kinematics], order: usize) -> f64 {
        let mut largest: f64 = 0.0;
        for unit in &mut self.units {
            unit.measure(model, motion);
            for (x, state) in self.multipliers[unit.first..].iter_mut().zip(&unit.state[..unit.count]) {
                *x = -state[order];
                largest = largest.max(x.abs());
            }
        }
        largest
    }

    /// Sets the multipliers of all rows to their negative openings at `motion`. Returns the largest distance or angle.
    fn set_residuals(&mut self, model: &Model, motion: &[Kinematics]) -> f64 {
        let mut largest: f64 = 0.0;
        for (k, &j) in self.joints.iter().enumerate() {
            let e = model.joints[j].eccentricity(motion);
            largest = largest.max(e.norm());
            for i in 0..3 {
                self.multipliers[3 * k + i] = -e[i];
            }
        }
        largest.max(self.set_unit_residuals(model, motion, 0))
    }

    /// Corrects the unconstrained accelerations `vdot` so that the joints stay closed, and stores the multipliers. Bias
    /// accelerations and mass matrices of the tree must be up to date at the same state.
    pub fn correct(&mut self, model: &Model, tree: &Tree, t: f64, q: &[f64], vdot: &mut [f64]) {
        self.factor(model, tree, t, q);
        for k in 0..self.joints.len() {
            let bias = model.joints[self.joints[k]].opening_acceleration(&tree.motion);
            let residual = bias + self.apply(model, k, vdot);
            for i in 0..3 {
                self.multipliers[3 * k + i] = -residual[i];
            }
        }
        self.set_unit_residuals(model, &tree.motion, 2);
        for (u, unit) in self.units.iter().enumerate() {
            let moved = self.apply(model, self.joints.len() + u, vdot);
            let own = self.multipliers[unit.range()].iter_mut();
            for (x, along) in own.zip(&unit.along) {
                *x -= along.dot(&moved);
            }
        }
        self.matrix.solve(&mut self.multipliers);
        self.add_weighted(model, &self.multipliers, vdot);
    }

    /// Projects positions, then velocities, onto the constraints in the metric of the mass matrix.
    ///
    /// Returns the remaining closure error, m or rad: above `1e-12`, the loops could not be closed.
    pub fn project(&mut self, model: &Model, tree: &mut Tree, t: f64, y: &mut [f64]) -> f64 {
        let gravity = Vec3::zeros();
        let mut error = f64::INFINITY;
        for _ in 0..30 {
            tree.update_kinematics(model, t, y);
            let largest = self.set_residuals(model, &tree.motion);
            // Newton converges quadratically: stop once another step would only change rounding errors. Dependent rows leave a
            // residual, the inconsistency of the dimensions.
            let stagnation_limit = if self.is_dependent() { 1e-8 } else { 1e-13 };
            if largest <= 1e-15 || (largest < stagnation_limit && largest >= 0.5 * error) || largest.is_nan() {
                error = largest;
                break;
            }
            // Close to the solution, the previous iteration's matrix is good enough.
            if error.is_infinite() || !(largest < 1e-4 * error && largest < 1e-9) {
                self.prepare(model, tree, t, &y[..model.nq], &gravity);
            }
            error = largest;
            self.matrix.solve(&mut self.multipliers);
            let mut step = std::mem::take(&mut self.step);
            step.fill(0.0);
            self.add_weighted(model, &self.multipliers, &mut step);
            Tree::displace(model, y, &step);
            self.step = step;
        }
        self.prepare(model, tree, t, &y[..model.nq], &gravity);
        for (k, &j) in self.joints.iter().enumerate() {
            let rate = model.joints[j].opening_rate(&tree.motion);
            for i in 0..3 {
                self.multipliers[3 * k + i] = -rate[i];
            }
        }
        self.set_unit_residuals(model, &tree.motion, 1);
        self.matrix.solve(&mut self.multipliers);
        let mut step = std::mem::take(&mut self.step);
        step.fill(0.0);
        self.add_weighted(model, &self.multipliers, &mut step);
        for (v, d) in y[model.nq..].iter_mut().zip(&step) {
            *v += d;
        }
        self.step = step;
        error
    }

    /// Computes the Jacobians and factors J M^-1 J^T for a tree whose kinematics are up to date at (t, q).
    pub fn prepare(&mut self, model: &Model, tree: &mut Tree, t: f64, q: &[f64], gravity: &Vec3) {
        if self.is_factored(t, q) {
            return;
        }
        let mut scratch = std::mem::take(&mut self.step);
        tree.assemble(model, gravity, &mut scratch);
        self.step = scratch;
        self.factor(model, tree, t, q);
    }
}

/// Dot product of two vectors of equal length, mostly a free body's six coordinates.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    match (a.as_array::<6>(), b.as_array::<6>()) {
        (Some(a), Some(b)) => (0..6).map(|i| a[i] * b[i]).sum(),
        _ => a.iter().zip(b).map(|(x, y)| x * y).sum(),
    }
}
