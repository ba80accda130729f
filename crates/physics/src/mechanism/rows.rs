//! The symmetric system J M^-1 J^T of constraint rows. Plain Cholesky if the rows are independent; otherwise (a planar loop
//! closed by a ball joint, two ball joints that make a hinge) Cholesky with pivoting up to the rank.

use super::factor::Skyline;
use crate::machine::Vec3;
use std::ops::Range;

/// Scaled pivots at or below this are rounding.
const ROUNDING: f64 = 1e-12;
/// Regularisation near a pose in which another row becomes dependent. For scaled pivots far below this, the multiplier shrinks
/// instead of growing, so that finite steps pass through such a pose with an error of the order of its square.
const REGULARISATION: f64 = 1e-10;
/// Components of a null vector below this fraction of its largest count as zero.
pub const NEGLIGIBLE: f64 = 1e-7;

/// The coupled constraint rows.
pub struct RowSystem {
    skyline: Skyline,
    /// For the first row of each group with its own unit: reference value of its diagonal entries without the other constraints,
    /// or 0 if unknown. Rows that nothing can move do not reveal it themselves.
    reference: Vec<f64>,
    dependent: Option<Box<Dependent>>,
}

impl RowSystem {
    /// For rows that couple with these `columns` before the diagonal.
    pub fn new(columns: Vec<Vec<usize>>) -> Self {
        Self { reference: vec![0.0; columns.len()], skyline: Skyline::new(columns), dependent: None }
    }

    /// Sets the reference diagonal entry of the rows from `first` on: its value if their sides could move freely.
    pub fn set_reference(&mut self, first: usize, diagonal: f64) {
        self.reference[first] = diagonal;
    }

    /// From now on treats the rows as dependent, with a rank of at most `rank`. Among the solutions, the multipliers from
    /// `minimised_from` on have the smallest sum of squares. Row i belongs to the group with the same unit that starts at row
    /// `group[i]`.
    pub fn treat_as_dependent(&mut self, rank: usize, minimised_from: usize, group: Vec<usize>) {
        self.dependent = Some(Box::new(Dependent::new(rank, minimised_from, group)));
    }

    /// Number of independent rows: that of the latest factorisation if rows are treated as dependent, else all.
    pub fn rank(&self) -> usize {
        let all = self.skyline.len();
        self.dependent.as_ref().map_or(all, |rows| rows.rank)
    }

    /// Whether rows are treated as dependent.
    pub fn is_dependent(&self) -> bool {
        self.dependent.is_some()
    }

    /// Independent rows of the latest factorisation, in ascending order.
    pub fn independent(&self) -> Vec<usize> {
        match &self.dependent {
            None => (0..self.skyline.len()).collect(),
            Some(rows) => {
                let mut independent = rows.order[..rows.rank].to_vec();
                independent.sort_unstable();
                independent
            }
        }
    }

    /// Null vectors, one per dropped row: multipliers without net load, any multiple of which may be added to a solution.
    pub fn null_multipliers(&self) -> impl Iterator<Item = &[f64]> {
        let rows = self.dependent.iter();
        rows.flat_map(|rows| rows.null.chunks_exact(rows.n).take(rows.n - rows.rank))
    }

    /// The loads that `load_of` derives from each null vector, whose largest component is scaled to 1.
    pub fn null_loads(&self, load_of: impl Fn(&[f64]) -> [Vec3; 2]) -> Vec<[Vec3; 2]> {
        let loads = self.null_multipliers().map(|null| {
            let largest = null.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
            load_of(null).map(|part| part / largest)
        });
        loads.collect()
    }

    /// Whether the multipliers of rows `first..first + count` are unique.
    pub fn is_unique(&self, first: usize, count: usize) -> bool {
        self.null_multipliers().all(|null| {
            let largest = null.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
            let own = null[first..first + count].iter();
            own.fold(0.0_f64, |largest, x| largest.max(x.abs())) <= NEGLIGIBLE * largest
        })
    }

    /// Sets all entries to zero.
    #[inline]
    pub fn clear(&mut self) {
        self.skyline.clear();
    }

    /// Adds to entry (i, j), j <= i.
    #[inline(always)]
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        self.skyline.add(i, j, value);
    }

    /// The block of rows that consists of `first` and the two that follow, if there is one.
    pub fn whole_block(&self, first: usize) -> Option<usize> {
        self.skyline.whole_block(first)
    }

    /// Adds to block (i, j), j <= i, of three rows each.
    #[inline]
    pub fn add_block(&mut self, i: usize, j: usize, block: &[[f64; 3]; 3]) {
        self.skyline.add_block(i, j, block);
    }

    /// Factors in place. Returns the smallest pivot ratio, excluding rows known to be dependent: near rounding level, further
    /// rows are dependent.
    #[inline]
    pub fn factor(&mut self) -> f64 {
        match &mut self.dependent {
            None => self.skyline.factor(),
            Some(rows) => rows.factor(&self.skyline, &self.reference),
        }
    }

    /// After a plain factorisation: the smallest ratio of a pivot to the largest diagonal entry among the rows of its joint,
    /// listed in `joints`, or to the reference entry. For a row that is zero up to rounding, the ratio to its own diagonal entry
    /// would be meaningless.
    pub fn least_joint_pivot(&self, joints: impl Iterator<Item = Range<usize>>) -> f64 {
        let mut least = f64::INFINITY;
        for joint in joints {
            let reference = self.reference[joint.start];
            let rows = || joint.clone().map(|i| self.skyline.diagonal_and_pivot(i));
            let largest = rows().map(|(diagonal, _)| diagonal);
            let largest = largest.fold(reference, f64::max);
            for (_, pivot) in rows() {
                let ratio = pivot / largest;
                if !(ratio >= least) {
                    least = if ratio.is_nan() { 0.0 } else { ratio };
                }
            }
        }
        least
    }

    /// Solves A x = b in place.
    #[inline]
    pub fn solve(&mut self, x: &mut [f64]) {
        match &mut self.dependent {
            None => self.skyline.solve(x),
            Some(rows) => rows.solve(x),
        }
    }
}

/// Rows of which some are dependent. With S A S scaled to diagonal entries of at most 1, and P its pivot order,
/// P^T S A S P = L L^T over the first `rank` columns; the remaining rows give the null vectors of A.
struct Dependent {
    n: usize,
    /// Upper bound on the rank: near the constraint manifold, but not on it, more rows appear independent.
    max_rank: usize,
    minimised_from: usize,
    group: Vec<usize>,
    rank: usize,
    order: Vec<usize>,
    scale: Vec<f64>,
    /// Lower triangle, rows in pivot order.
    factor: Vec<f64>,
    /// Null vectors of A, one after the other.
    null: Vec<f64>,
    /// Cholesky factor of their Gram matrix over the counted rows.
    gram: Vec<f64>,
    work: Vec<f64>,
}

impl Dependent {
    fn new(max_rank: usize, minimised_from: usize, group: Vec<usize>) -> Self {
        let n = group.len();
        Self {
            n,
            max_rank: max_rank.min(n),
            minimised_from,
            group,
            rank: 0,
            order: (0..n).collect(),
            scale: vec![1.0; n],
            factor: vec![0.0; n * n],
            null: vec![0.0; n * n],
            gram: vec![0.0; n * n],
            work: vec![0.0; n],
        }
    }

    fn factor(&mut self, entries: &Skyline, reference: &[f64]) -> f64 {
        let n = self.n;
        self.scale.copy_from_slice(reference);
        for i in 0..n {
            let largest = &mut self.scale[self.group[i]];
            *largest = largest.max(entries.get(i, i));
        }
        // A group that nothing can move has no scale; all its entries are 0.
        for i in (0..n).rev() {
            let largest = self.scale[self.group[i]];
            self.scale[i] = if largest > 0.0 { 1.0 / largest.sqrt() } else { 1.0 };
        }
        for (i, place) in self.order.iter_mut().enumerate() {
            *place = i;
        }
        for i in 0..n {
            for j in 0..=i {
                let value = entries.get(i, j) * self.scale[i] * self.scale[j];
                self.factor[i * n + j] = value;
                self.factor[j * n + i] = value;
            }
        }
        let least = self.eliminate();
        self.find_null_vectors();
        least
    }

    /// Right-looking Cholesky with diagonal pivoting. Returns the smallest pivot; 0 if fewer rows than `max_rank` are
    /// independent.
    fn eliminate(&mut self) -> f64 {
        let (n, a) = (self.n, &mut self.factor);
        let mut least = f64::INFINITY;
        self.rank = self.max_rank;
        for k in 0..self.max_rank {
            let mut best = k;
            for i in k + 1..n {
                if a[i * n + i] > a[best * n + best] {
                    best = i;
                }
            }
            let pivot = a[best * n + best];
            if !(pivot > ROUNDING) {
                self.rank = k;
                return 0.0;
            }
            least = least.min(pivot);
            if best != k {
                self.order.swap(k, best);
                for j in 0..n {
                    a.swap(k * n + j, best * n + j);
                }
                for i in 0..n {
                    a.swap(i * n + k, i * n + best);
                }
            }
            let root = (pivot + REGULARISATION * REGULARISATION / pivot).sqrt();
            a[k * n + k] = root;
            for i in k + 1..n {
                a[i * n + k] /= root;
            }
            for i in k + 1..n {
                for j in k + 1..=i {
                    let less = a[i * n + k] * a[j * n + k];
                    a[i * n + j] -= less;
                    a[j * n + i] = a[i * n + j];
                }
            }
        }
        least
    }

    fn find_null_vectors(&mut self) {
        let (n, rank) = (self.n, self.rank);
        let l = &self.factor;
        for (dropped, null) in (rank..n).zip(self.null.chunks_exact_mut(n)) {
            null.fill(0.0);
            // L1^T x = -(row of L2), then back to the original order and units.
            for k in (0..rank).rev() {
                let mut x = -l[dropped * n + k];
                for i in k + 1..rank {
                    x -= l[i * n + k] * self.work[i];
                }
                self.work[k] = x / l[k * n + k];
                null[self.order[k]] = self.work[k] * self.scale[self.order[k]];
            }
            null[self.order[dropped]] = self.scale[self.order[dropped]];
        }
        let free = n - rank;
        for i in 0..free {
            for j in 0..=i {
                let (a, b) = (&self.null[i * n..][..n], &self.null[j * n..][..n]);
                let pairs = a[self.minimised_from..].iter().zip(&b[self.minimised_from..]);
                let mut sum: f64 = pairs.map(|(x, y)| x * y).sum();
                for k in 0..j {
                    sum -= self.gram[i * n + k] * self.gram[j * n + k];
                }
                self.gram[i * n + j] =
                    if i == j { sum.max(f64::MIN_POSITIVE).sqrt() } else { sum / self.gram[j * n + j] };
            }
        }
    }

    fn solve(&mut self, x: &mut [f64]) {
        let (n, rank) = (self.n, self.rank);
        let (l, work) = (&self.factor, &mut self.work);
        for k in 0..rank {
            let at = self.order[k];
            let mut sum = x[at] * self.scale[at];
            for j in 0..k {
                sum -= l[k * n + j] * work[j];
            }
            work[k] = sum / l[k * n + k];
        }
        x.fill(0.0);
        for k in (0..rank).rev() {
            let mut sum = work[k];
            for i in k + 1..rank {
                sum -= l[i * n + k] * work[i];
            }
            work[k] = sum / l[k * n + k];
            x[self.order[k]] = work[k] * self.scale[self.order[k]];
        }
        // Subtract the null-space component that minimises the counted multipliers.
        let free = n - rank;
        for i in 0..free {
            let null = &self.null[i * n..][..n];
            let pairs = null[self.minimised_from..].iter().zip(&x[self.minimised_from..]);
            let mut sum: f64 = pairs.map(|(a, b)| a * b).sum();
            for k in 0..i {
                sum -= self.gram[i * n + k] * work[k];
            }
            work[i] = sum / self.gram[i * n + i];
        }
        for i in (0..free).rev() {
            let mut sum = work[i];
            for k in i + 1..free {
                sum -= self.gram[k * n + i] * work[k];
            }
            work[i] = sum / self.gram[i * n + i];
        }
        for i in 0..free {
            let null = &self.null[i * n..][..n];
            for (x, a) in x.iter_mut().zip(null) {
                *x -= work[i] * a;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use std::iter::once;

    /// Row i of B; the last two rows depend on the first three.
    fn rows() -> DMatrix<f64> {
        let mut b = DMatrix::from_fn(5, 7, |i, j| libm::sin(((2 * i + 3) * (j + 2)) as f64));
        let (first, second) = (b.row(0) * 2.0 - b.row(2), b.row(1) * 0.5);
        b.set_row(3, &first);
        b.set_row(4, &second);
        b
    }

    fn system(a: &DMatrix<f64>) -> RowSystem {
        let n = a.nrows();
        let mut system = RowSystem::new((0..n).map(|i| (0..i).collect()).collect());
        for i in 0..n {
            for j in 0..=i {
                system.add(i, j, a[(i, j)]);
            }
        }
        system
    }

    #[test]
    fn dependent_rows_have_the_multipliers_of_least_norm() {
        let b = rows();
        let a = &b * b.transpose();
        let right = &a * DVector::from_fn(5, |i, _| 1.0 + i as f64);
        let mut plain = system(&a);
        assert!(plain.factor() < 1e-12 || plain.least_joint_pivot(once(0..5)) < 1e-12);
        for max_rank in [3, 5] {
            let mut system = system(&a);
            system.treat_as_dependent(max_rank, 0, vec![0; 5]);
            system.factor();
            assert_eq!(system.rank(), 3);
            let mut x = right.clone();
            system.solve(x.as_mut_slice());
            let pseudo = a.clone().pseudo_inverse(1e-10).unwrap() * &right;
            assert!((x - pseudo).norm() < 1e-9);
        }
        // Only the last four count: no null vector can reduce them.
        let mut system = system(&a);
        system.treat_as_dependent(3, 1, vec![0, 1, 2, 3, 4]);
        system.factor();
        let mut x = right.clone();
        system.solve(x.as_mut_slice());
        assert!((&a * &x - &right).norm() < 1e-9 * right.norm());
        for null in system.null_multipliers() {
            let null = DVector::from_row_slice(null);
            assert!((&a * &null).norm() < 1e-12 * null.norm());
            let (own, idle) = (x.rows(1, 4), null.rows(1, 4));
            assert!(own.dot(&idle).abs() < 1e-9 * own.norm() * idle.norm());
        }
    }

    #[test]
    fn a_zero_row_is_dropped_and_only_its_multiplier_is_not_unique() {
        let a = DMatrix::from_row_slice(3, 3, &[2.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 3.0]);
        let mut system = system(&a);
        assert_eq!(
            {
                system.factor();
                system.least_joint_pivot(once(0..3))
            },
            0.0
        );
        system.clear();
        for (i, j) in [(0, 0), (2, 0), (2, 2)] {
            system.add(i, j, a[(i, j)]);
        }
        system.treat_as_dependent(3, 0, vec![0; 3]);
        system.factor();
        assert_eq!((system.rank(), system.independent()), (2, vec![0, 2]));
        let mut x = [3.0, 0.0, 4.0];
        system.solve(&mut x);
        assert!((x[0] - 1.0).abs() < 1e-15 && x[1] == 0.0 && (x[2] - 1.0).abs() < 1e-15);
        assert!(system.is_unique(0, 1) && !system.is_unique(1, 1) && system.is_unique(2, 1));
    }
}
