//! Loop closure in tree coordinates: the constraint rows of each joint that closes a loop, (45) to (47), solved for their Lagrange
//! multipliers, and the projection onto the constraints.

use super::kinematics::{Kinematics, Wrench, part};
use super::model::{BodyIndex, Model};
use super::pairs::{Cut, Rows};
use super::rows::RowSystem;
use super::tree::{Tree, visit_columns};
use crate::machine::{Mat3, Vec3};
use std::ops::Range;

mod openings;

/// Rows of one unit in one block: Jacobian J and W = M^-1 J^T, both 3 x n, row-major from `offset`.
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

/// Translational or rotational part of a joint that closes a loop. Its three rows in the blocks are the relative velocity, or
/// angular velocity, of its bodies in world axes; up to three directions of these are constrained.
struct Unit {
    /// Index of its joint among the cut ones.
    joint: usize,
    turns: bool,
    rows: Vec<Rows>,
    /// First constraint row, and number of rows.
    first: usize,
    count: usize,
    sides: Vec<Side>,
    /// If two points coincide: the block of its rows, which are along the world's axes.
    point: Option<usize>,
    /// Constrained directions, and violation with its first and second derivative, at the latest motion.
    along: [Vec3; 3],
    state: [[f64; 3]; 3],
}

impl Unit {
    fn range(&self) -> Range<usize> {
        self.first..self.first + self.count
    }

    /// Updates directions and violations.
    fn measure(&mut self, cut: &Cut, motion: &[Kinematics]) {
        if self.point.is_some() {
            return;
        }
        let (c, p) = (&motion[cut.child.body], &motion[cut.parent.body]);
        let mut at = 0;
        for rows in &self.rows {
            rows.linearise(c, p, &[], |i, row, state| {
                self.along[at + i] = row.child[usize::from(self.turns)];
                self.state[at + i] = state;
            });
            at += rows.count();
        }
    }

    /// Derivative of this order (0, 1 or 2) of the violation at the motion last measured, which is `motion`.
    #[inline(always)]
    fn violation(&self, cut: &Cut, motion: &[Kinematics], order: usize) -> [f64; 3] {
        match self.point {
            Some(_) => cut.separation(motion, order).into(),
            None => self.state.map(|state| state[order]),
        }
    }

    /// Components of `moved`, the relative velocity or angular velocity of its bodies, along the constrained directions.
    #[inline(always)]
    fn components(&self, moved: Vec3) -> [f64; 3] {
        match self.point {
            Some(_) => moved.into(),
            None => self.along.map(|along| along.dot(&moved)),
        }
    }

    /// Force or torque of this unit, given the multipliers of all rows.
    #[inline(always)]
    fn load(&self, multipliers: &[f64]) -> Vec3 {
        if self.point.is_some() {
            return Vec3::from_column_slice(part::<3>(multipliers, self.first));
        }
        let own = self.along.iter().zip(&multipliers[self.range()]);
        own.map(|(along, x)| along * *x).sum()
    }
}

/// Constraint rows of a set of joints that close loops.
pub struct Constraints {
    /// The joints by their index among the cut ones of the machine, as rows, and the units of each.
    joints: Vec<usize>,
    cuts: Vec<Cut>,
    units_of: Vec<Range<usize>>,
    units: Vec<Unit>,
    /// (i, j, side of i, side of j) with j <= i for every block that units share.
    pairs: Vec<(usize, usize, usize, usize)>,
    jacobian: Vec<f64>,
    weighted: Vec<f64>,
    matrix: RowSystem,
    /// Multipliers of the latest solve, N or N m.
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
    /// Rows of the loose joints with these indices as if they had no play, and of all other joints that close loops.
    pub fn new(model: &Model, joints: &[usize]) -> Self {
        let cuts: Vec<Cut> = model.cuts(joints).collect();
        let block_of =
            |b: BodyIndex| (b < model.bodies.len() && !model.bodies[b].driven_only).then(|| model.block_of[b]);
        let (mut total, mut count) = (0, 0);
        let mut units: Vec<Unit> = Vec::new();
        let mut units_of = Vec::with_capacity(cuts.len());
        for (joint, cut) in cuts.iter().enumerate() {
            let of = units.len();
            for (rows, turns) in cut.rows.iter().zip([false, true]).filter(|(rows, _)| !rows.is_empty()) {
                let first = count;
                count += rows.iter().map(Rows::count).sum::<usize>();
                let mut blocks: Vec<usize> =
                    [cut.child.body, cut.parent.body].into_iter().filter_map(block_of).collect();
                blocks.dedup();
                let side = |block: usize| {
                    let n = model.blocks[block].n;
                    let side = Side { block, offset: total, n };
                    total += 3 * n;
                    side
                };
                units.push(Unit {
                    joint,
                    turns,
                    rows: rows.clone(),
                    first,
                    count: count - first,
                    sides: blocks.into_iter().map(side).collect(),
                    point: None,
                    along: [Vec3::x(), Vec3::y(), Vec3::z()],
                    state: [[0.0; 3]; 3],
                });
            }
            units_of.push(of..units.len());
        }
        let mut pairs = Vec::new();
        let mut columns = vec![Vec::new(); count];
        // (unit, side) pairs that act on each block so far.
        let mut on_block = vec![Vec::new(); model.blocks.len()];
        for (i, unit) in units.iter().enumerate() {
            let from = pairs.len();
            for (si, side) in unit.sides.iter().enumerate() {
                on_block[side.block].push((i, si));
                pairs.extend(on_block[side.block].iter().map(|&(j, sj)| (i, j, si, sj)));
            }
            pairs[from..].sort_unstable();
            for row in unit.range() {
                let others = pairs[from..].iter().flat_map(|&(_, j, ..)| units[j].range());
                columns[row].extend(others.filter(|&column| column < row));
            }
        }
        let matrix = RowSystem::new(columns);
        for unit in &mut units {
            let is_point = matches!(unit.rows[..], [Rows::Point { .. }]);
            unit.point = if is_point { matrix.whole_block(unit.first) } else { None };
        }
        Self {
            joints: joints.iter().copied().chain(model.joints.len()..).take(cuts.len()).collect(),
            cuts,
            units_of,
            units,
            pairs,
            jacobian: vec![0.0; total],
            weighted: vec![0.0; total],
            matrix,
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
        for unit in &self.units {
            for side in &unit.sides {
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
        let group = self.units.iter().flat_map(|unit| std::iter::repeat_n(unit.first, unit.count));
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

    /// Whether the load of joint `k` is unique at the latest factorisation.
    pub fn is_unique(&self, k: usize) -> bool {
        let units = &self.units[self.units_of[k].clone()];
        let rows = units.iter().map(Unit::range).reduce(|a, b| a.start..b.end);
        rows.is_none_or(|rows| self.matrix.is_unique(rows.start, rows.len()))
    }

    /// Changes of the load of joint `k` that the motion does not determine: force and torque, each up to a common factor.
    pub fn null_loads(&self, k: usize) -> Vec<[Vec3; 2]> {
        self.matrix.null_loads(|null| self.load_of(k, null))
    }

    /// After a plain factorisation: the smallest ratio of a pivot to the largest diagonal entry of its joint.
    pub fn least_joint_pivot(&self) -> f64 {
        self.matrix.least_joint_pivot(self.units.iter().map(Unit::range))
    }

    /// The system J M^-1 J^T.
    pub fn system(&self) -> &RowSystem {
        &self.matrix
    }

    /// The joints by their index among the cut ones: loose joints, then other joints that close loops.
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

    /// Adds the loads exerted on the bodies by `multipliers` of all rows to `wrench`.
    pub fn load(&self, multipliers: &[f64], motion: &[Kinematics], wrench: &mut [Wrench]) {
        let mut push = |body: BodyIndex, arm: Vec3, force: Vec3| {
            let w = &mut wrench[body];
            w.force += force;
            w.torque += arm.cross(&force);
        };
        for unit in self.units.iter().filter(|unit| !unit.turns) {
            let cut = &self.cuts[unit.joint];
            let force = unit.load(multipliers);
            let [child, parent] = cut.arms(motion);
            push(cut.child.body, child, force);
            push(cut.parent.body, parent, -force);
        }
        for unit in self.units.iter().filter(|unit| unit.turns) {
            let cut = &self.cuts[unit.joint];
            let torque = unit.load(multipliers);
            wrench[cut.child.body].torque += torque;
            wrench[cut.parent.body].torque -= torque;
        }
    }

    /// Force, N, and torque, N m, exerted on its child by joint `k`.
    pub fn load_on_child(&self, k: usize) -> [Vec3; 2] {
        self.load_of(k, &self.multipliers)
    }

    fn load_of(&self, k: usize, multipliers: &[f64]) -> [Vec3; 2] {
        let mut load = [Vec3::zeros(); 2];
        for unit in &self.units[self.units_of[k].clone()] {
            load[usize::from(unit.turns)] = unit.load(multipliers);
        }
        load
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
        for unit in &mut self.units {
            let cut = &self.cuts[unit.joint];
            unit.measure(cut, &tree.motion);
            let arms = cut.arms(&tree.motion);
            for ((body, arm), sign) in [cut.child.body, cut.parent.body].into_iter().zip(arms).zip([1.0, -1.0]) {
                let moves = model.bodies.get(body).is_some_and(|own| !own.driven_only);
                let own = |side: &&Side| moves && side.block == model.block_of[body];
                let Some(side) = unit.sides.iter().find(own) else {
                    continue;
                };
                let point = tree.motion[body].position + arm;
                let [x, y, z] = side.rows_mut(&mut self.jacobian);
                let mut add = |column: usize, moved: &Vec3| {
                    x[column] += sign * moved.x;
                    y[column] += sign * moved.y;
                    z[column] += sign * moved.z;
                };
                if unit.turns {
                    visit_columns(model, &tree.motion, body, &point, |column, _, omega| add(column, &omega));
                } else {
                    visit_columns(model, &tree.motion, body, &point, |column, velocity, _| add(column, &velocity));
                }
            }
        }
        self.weighted.copy_from_slice(&self.jacobian);
        for side in self.units.iter().flat_map(|unit| &unit.sides) {
            for row in side.rows_mut(&mut self.weighted) {
                tree.solve_block(model, side.block, row);
            }
        }
        self.matrix.clear();
        self.add_blocks();
        self.least_pivot = self.matrix.factor();
    }

    /// The blocks of J M^-1 J^T.
    fn add_blocks(&mut self) {
        for unit in self.units.iter().filter(|unit| self.cuts[unit.joint].turns()) {
            self.matrix.set_reference(unit.first, 0.0);
        }
        let mut diagonal_sum = (usize::MAX, 0.0);
        for &(i, j, si, sj) in &self.pairs {
            let (unit, other) = (&self.units[i], &self.units[j]);
            let (left, right) = (unit.sides[si].rows(&self.jacobian), other.sides[sj].rows(&self.weighted));
            let block = left.map(|left| right.map(|right| dot(left, right)));
            if i == j && self.cuts[unit.joint].turns() {
                // Sum over both sides, if there are two.
                let before = if diagonal_sum.0 == i { diagonal_sum.1 } else { 0.0 };
                diagonal_sum = (i, before + (block[0][0] + block[1][1] + block[2][2]));
                self.matrix.set_reference(unit.first, diagonal_sum.1);
            }
            if let (Some(i), Some(j)) = (unit.point, other.point) {
                self.matrix.add_block(i, j, &block);
                continue;
            }
            let block = Mat3::from_fn(|r, c| block[r][c]);
            for (row, along) in unit.range().zip(&unit.along) {
                let moved = block.tr_mul(along);
                for (column, other) in (other.first..=row).zip(&other.along[..other.count]) {
                    self.matrix.add(row, column, moved.dot(other));
                }
            }
        }
    }

    fn is_factored(&self, t: f64, q: &[f64]) -> bool {
        self.time == Some(t) && self.positions == q
    }

    /// x = J v for the three rows of unit `k`.
    #[inline(always)]
    fn apply(&self, model: &Model, k: usize, v: &[f64]) -> Vec3 {
        let mut sum = Vec3::zeros();
        for side in &self.units[k].sides {
            let v = &v[model.blocks[side.block].v..][..side.n];
            let rows = side.rows(&self.jacobian);
            sum += Vec3::from(rows.map(|row| dot(row, v)));
        }
        sum
    }

    /// v += M^-1 J^T x.
    fn add_weighted(&self, model: &Model, x: &[f64], v: &mut [f64]) {
        for unit in &self.units {
            let [x1, x2, x3] = unit.load(x).into();
            for side in &unit.sides {
                let v = &mut v[model.blocks[side.block].v..][..side.n];
                let [w1, w2, w3] = side.rows(&self.weighted);
                for (c, v) in v.iter_mut().enumerate() {
                    *v = *v + w1[c] * x1 + w2[c] * x2 + w3[c] * x3;
                }
            }
        }
    }

    /// Sets the multipliers of all rows to the negative of their violation (`order` 0), its rate (1) or its second derivative (2)
    /// at `motion`. Returns the largest distance or angle.
    fn set_residuals(&mut self, motion: &[Kinematics], order: usize) -> f64 {
        let mut largest: f64 = 0.0;
        for unit in &mut self.units {
            let cut = &self.cuts[unit.joint];
            unit.measure(cut, motion);
            let own = &mut self.multipliers[unit.first..][..unit.count];
            for (x, violation) in own.iter_mut().zip(unit.violation(cut, motion, order)) {
                *x = -violation;
            }
            largest = largest.max(match *own {
                [x, y, z] if !cut.turns() => Vec3::new(x, y, z).norm(),
                _ => own.iter().fold(0.0, |most, x| x.abs().max(most)),
            });
        }
        largest
    }

    /// Corrects the unconstrained accelerations `vdot` so that the joints stay closed, and stores the multipliers. Bias
    /// accelerations and mass matrices of the tree must be up to date at the same state.
    pub fn correct(&mut self, model: &Model, tree: &Tree, t: f64, q: &[f64], vdot: &mut [f64]) {
        self.factor(model, tree, t, q);
        self.set_residuals(&tree.motion, 2);
        for (u, unit) in self.units.iter().enumerate() {
            let moved = self.apply(model, u, vdot);
            let own = self.multipliers[unit.range()].iter_mut();
            for (x, moved) in own.zip(unit.components(moved)) {
                *x -= moved;
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
            let largest = self.set_residuals(&tree.motion, 0);
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
        self.set_residuals(&tree.motion, 1);
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
