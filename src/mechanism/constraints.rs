//! Ideal ball joints in tree coordinates: three constraint rows each, (45), solved for their Lagrange multipliers, and the
//! projection that keeps closed loops closed.

use super::kinematics::part;
use super::model::{BodyIndex, Model};
use super::rows::RowSystem;
use super::tree::{Tree, visit_columns};
use crate::scene::Vec3;

/// The rows of one joint in one block: Jacobian J and W = M^-1 J^T, both 3 x n row-major from `offset`.
struct Side {
    block: usize,
    offset: usize,
    n: usize,
}

impl Side {
    /// Its three rows of the Jacobians or of W.
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

/// Constraint rows of a set of ball joints.
pub struct Constraints {
    joints: Vec<usize>,
    sides: Vec<Vec<Side>>,
    /// (i, j, side of i, side of j) with j <= i for every shared block.
    pairs: Vec<(usize, usize, usize, usize)>,
    jacobian: Vec<f64>,
    weighted: Vec<f64>,
    matrix: RowSystem,
    /// Multipliers of the latest solve: force on the ball, N, three per joint.
    multipliers: Vec<f64>,
    scratch: Vec<f64>,
    step: Vec<f64>,
    square: Vec<f64>,
    /// Instant and positions of the latest factorisation.
    time: Option<f64>,
    positions: Vec<f64>,
    /// Smallest pivot ratio of the latest factorisation.
    pub least_pivot: f64,
}

impl Constraints {
    /// Rows of the joints with these indices.
    pub fn new(model: &Model, joints: &[usize]) -> Self {
        let mut total = 0;
        let block_of = |b: BodyIndex| {
            (b < model.bodies.len() && !model.bodies[b].driven_only).then(|| model.block_of[b])
        };
        let sides: Vec<Vec<Side>> = joints
            .iter()
            .map(|&j| {
                let joint = &model.joints[j];
                let mut blocks: Vec<usize> = [joint.ball.body, joint.socket.body]
                    .into_iter()
                    .filter_map(block_of)
                    .collect();
                blocks.dedup();
                blocks
                    .into_iter()
                    .map(|block| {
                        let n = model.blocks[block].n;
                        let side = Side {
                            block,
                            offset: total,
                            n,
                        };
                        total += 3 * n;
                        side
                    })
                    .collect()
            })
            .collect();
        let mut pairs = Vec::new();
        let mut columns = vec![Vec::new(); 3 * joints.len()];
        // (joint, side) pairs that act on each block so far.
        let mut on_block = vec![Vec::new(); model.blocks.len()];
        for (i, sides) in sides.iter().enumerate() {
            let from = pairs.len();
            for (si, side) in sides.iter().enumerate() {
                on_block[side.block].push((i, si));
                pairs.extend(on_block[side.block].iter().map(|&(j, sj)| (i, j, si, sj)));
            }
            pairs[from..].sort_unstable();
            for row in 3 * i..3 * i + 3 {
                let others = pairs[from..]
                    .iter()
                    .flat_map(|&(_, j, ..)| 3 * j..3 * j + 3);
                columns[row].extend(others.filter(|&column| column < row));
            }
        }
        Self {
            joints: joints.to_vec(),
            sides,
            pairs,
            jacobian: vec![0.0; total],
            weighted: vec![0.0; total],
            matrix: RowSystem::new(columns),
            multipliers: vec![0.0; 3 * joints.len()],
            scratch: vec![0.0; 3 * joints.len()],
            step: vec![0.0; model.nv],
            square: if 3 * joints.len() == model.nv {
                vec![0.0; model.nv * model.nv]
            } else {
                Vec::new()
            },
            time: None,
            positions: vec![0.0; model.nq],
            least_pivot: f64::INFINITY,
        }
    }

    /// Whether the Jacobian of the latest factorisation, if square, has a positive determinant: the sign changes when the
    /// loops pass through a singular pose.
    pub fn is_determinant_positive(&mut self, model: &Model) -> bool {
        self.is_minor_positive(model, Some)
    }

    /// The same for a subset of as many rows as coordinates: `place` maps a row to its place in the square matrix.
    pub fn is_minor_positive(
        &mut self,
        model: &Model,
        place: impl Fn(usize) -> Option<usize>,
    ) -> bool {
        let n = model.nv;
        let a = &mut self.square;
        a.resize(n * n, 0.0);
        a.fill(0.0);
        for (k, sides) in self.sides.iter().enumerate() {
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
        super::factor::is_determinant_positive(a, n)
    }

    /// Treats the rows as dependent from now on, with a rank of at most `rank`.
    pub fn treat_as_dependent(&mut self, rank: usize) {
        let group = (0..self.rows()).map(|i| i - i % 3).collect();
        self.matrix.treat_as_dependent(rank, 0, group);
        self.time = None;
    }

    /// Whether rows are treated as dependent.
    pub fn is_dependent(&self) -> bool {
        self.matrix.is_dependent()
    }

    /// Number of independent rows: as found by the latest factorisation if rows are treated as dependent, else all.
    pub fn rank(&self) -> usize {
        self.matrix.rank()
    }

    /// Whether the reaction of the `k`-th joint is unique at the latest factorisation.
    pub fn is_unique(&self, k: usize) -> bool {
        self.matrix.is_unique(3 * k, 3)
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
        3 * self.joints.len()
    }

    /// Force on the ball of the `k`-th constrained joint, N.
    pub fn reaction(&self, k: usize) -> Vec3 {
        Vec3::from_column_slice(&self.multipliers[3 * k..3 * k + 3])
    }

    /// Computes the Jacobians and factors J M^-1 J^T for a tree that has been moved forward and assembled at (t, q); does
    /// nothing if the latest call was for the same (t, q).
    fn factor(&mut self, model: &Model, tree: &Tree, t: f64, q: &[f64]) {
        if self.is_factored(t, q) {
            return;
        }
        self.time = Some(t);
        self.positions.copy_from_slice(q);
        self.jacobian.fill(0.0);
        for (k, &j) in self.joints.iter().enumerate() {
            let joint = &model.joints[j];
            for (anchor, sign) in [(&joint.ball, 1.0), (&joint.socket, -1.0)] {
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
                visit_columns(
                    model,
                    &tree.motion,
                    anchor.body,
                    &point,
                    |column, velocity, _| {
                        x[column] += sign * velocity.x;
                        y[column] += sign * velocity.y;
                        z[column] += sign * velocity.z;
                    },
                );
            }
        }
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
        self.least_pivot = self.matrix.factor();
    }

    fn is_factored(&self, t: f64, q: &[f64]) -> bool {
        self.time == Some(t) && self.positions == q
    }

    /// x = J v for the rows of joint `k`.
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
        for (k, sides) in self.sides.iter().enumerate() {
            for side in sides {
                let v = &mut v[model.blocks[side.block].v..][..side.n];
                let [w1, w2, w3] = side.rows(&self.weighted);
                let [x1, x2, x3] = *part(x, 3 * k);
                for (c, v) in v.iter_mut().enumerate() {
                    *v = *v + w1[c] * x1 + w2[c] * x2 + w3[c] * x3;
                }
            }
        }
    }

    /// Corrects the unconstrained accelerations `vdot` so that the joints stay closed, and keeps the multipliers.
    /// The tree must have been moved forward (bias accelerations) and assembled at the same state.
    pub fn correct(&mut self, model: &Model, tree: &Tree, t: f64, q: &[f64], vdot: &mut [f64]) {
        self.factor(model, tree, t, q);
        for k in 0..self.joints.len() {
            let bias = model.joints[self.joints[k]].opening_acceleration(&tree.motion);
            let residual = bias + self.apply(model, k, vdot);
            for i in 0..3 {
                self.multipliers[3 * k + i] = -residual[i];
            }
        }
        self.matrix.solve(&mut self.multipliers);
        self.add_weighted(model, &self.multipliers, vdot);
    }

    /// Removes from the accelerations `vdot` the part that would open the joints: the linear part of [`Self::correct`], with
    /// its matrices.
    pub fn project_accelerations(&mut self, model: &Model, vdot: &mut [f64]) {
        for k in 0..self.joints.len() {
            let residual = self.apply(model, k, vdot);
            for i in 0..3 {
                self.scratch[3 * k + i] = -residual[i];
            }
        }
        self.matrix.solve(&mut self.scratch);
        self.add_weighted(model, &self.scratch, vdot);
    }

    /// Projects positions, then velocities, onto the constraints in the metric of the mass matrix.
    ///
    /// Returns the remaining closure error, m: above `1e-12` the loops could not be closed.
    pub fn project(&mut self, model: &Model, tree: &mut Tree, t: f64, y: &mut [f64]) -> f64 {
        let gravity = Vec3::zeros();
        let mut error = f64::INFINITY;
        for _ in 0..30 {
            tree.update_kinematics(model, t, y);
            let mut largest: f64 = 0.0;
            for (k, &j) in self.joints.iter().enumerate() {
                let e = model.joints[j].eccentricity(&tree.motion);
                largest = largest.max(e.norm());
                for i in 0..3 {
                    self.multipliers[3 * k + i] = -e[i];
                }
            }
            // Newton converges quadratically: stop once another step would only change rounding errors.
            // Dependent rows leave a residual: the inconsistency of the parts' dimensions.
            let stirred = if self.is_dependent() { 1e-8 } else { 1e-13 };
            if largest <= 1e-15 || (largest < stirred && largest >= 0.5 * error) || largest.is_nan()
            {
                error = largest;
                break;
            }
            // Once close, the previous iteration's matrix is as good as a new one.
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

    /// Computes the Jacobians and factors J M^-1 J^T for a tree that has been moved forward to (t, q).
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

/// Scalar product of two vectors of the same length, mostly of a free body's six coordinates.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    match (a.as_array::<6>(), b.as_array::<6>()) {
        (Some(a), Some(b)) => (0..6).map(|i| a[i] * b[i]).sum(),
        _ => a.iter().zip(b).map(|(x, y)| x * y).sum(),
    }
}
