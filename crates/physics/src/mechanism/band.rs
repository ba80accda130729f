//! Sparse matrices of 3 x 3 blocks, eliminated in place without pivoting. Allocates nothing.

use crate::machine::{Mat3, Vec3};
use std::ops::Range;

/// Symmetric sparsity pattern of a block matrix within a band, and of its factors. Blocks are stored row by row.
#[derive(Default)]
pub struct Band {
    size: usize,
    bandwidth: usize,
    /// Whether a block may be nonzero, for the diagonal and the band to its right.
    filled: Vec<bool>,
    /// Column of each stored block; index of the first block of each row, and of its diagonal block.
    columns: Vec<usize>,
    starts: Vec<usize>,
    diagonal: Vec<usize>,
    /// Blocks that the elimination changes, in its order: for each pivot and each row i below it, the block of row i under the
    /// pivot and those under the rest of the pivot's row. Index of the first of each pivot.
    targets: Vec<usize>,
    first_targets: Vec<usize>,
}

impl Band {
    /// With capacity for `size` block rows of bandwidth `bandwidth`.
    pub fn with_capacity(size: usize, bandwidth: usize) -> Self {
        Self {
            filled: Vec::with_capacity(size * (bandwidth + 1)),
            columns: Vec::with_capacity(Self::max_blocks(size, bandwidth)),
            starts: Vec::with_capacity(size + 1),
            diagonal: Vec::with_capacity(size),
            targets: Vec::with_capacity(size * bandwidth * (bandwidth + 1)),
            first_targets: Vec::with_capacity(size),
            ..Self::default()
        }
    }

    /// Largest number of blocks of `size` rows.
    pub fn max_blocks(size: usize, bandwidth: usize) -> usize {
        size * (2 * bandwidth + 1)
    }

    /// Sets the pattern of a matrix with `size` block rows: block (i, j) may be nonzero on the diagonal and, within bandwidth
    /// `bandwidth`, where `coupled(i, j)`, which is symmetric. Two legs of a platform, for example, couple only through it.
    pub fn set_pattern(&mut self, size: usize, bandwidth: usize, coupled: impl Fn(usize, usize) -> bool) {
        (self.size, self.bandwidth) = (size, bandwidth);
        self.filled.clear();
        for i in 0..size {
            self.filled.extend((i..=i + bandwidth).map(|j| i == j || (j < size && coupled(i, j))));
        }
        let at = |i: usize, j: usize| i * (bandwidth + 1) + j - i;
        for k in 0..size {
            let end = (k + bandwidth + 1).min(size);
            for i in k + 1..end {
                if self.filled[at(k, i)] {
                    for j in i + 1..end {
                        self.filled[at(i, j)] |= self.filled[at(k, j)];
                    }
                }
            }
        }
        self.columns.clear();
        self.starts.clear();
        self.diagonal.clear();
        for i in 0..size {
            self.starts.push(self.columns.len());
            let before = (i.saturating_sub(bandwidth)..i).filter(|&j| self.filled[at(j, i)]);
            self.columns.extend(before);
            self.diagonal.push(self.columns.len());
            let after = (i..(i + bandwidth + 1).min(size)).filter(|&j| self.filled[at(i, j)]);
            self.columns.extend(after);
        }
        self.starts.push(self.columns.len());
        self.targets.clear();
        self.first_targets.clear();
        for k in 0..size {
            self.first_targets.push(self.targets.len());
            for below in self.after(k) {
                let i = self.columns[below];
                // Row i has a block wherever row k has one.
                for column in self.diagonal[k]..self.starts[k + 1] {
                    self.targets.push(self.position(i, self.columns[column]));
                }
            }
        }
    }

    /// Indices of the stored blocks of row `i`.
    pub fn row(&self, i: usize) -> Range<usize> {
        self.starts[i]..self.starts[i + 1]
    }

    /// Index of its diagonal block.
    pub fn diagonal(&self, i: usize) -> usize {
        self.diagonal[i]
    }

    /// Index of block (`i`, `j`) of the pattern.
    pub fn position(&self, i: usize, j: usize) -> usize {
        self.starts[i] + self.columns[self.row(i)].partition_point(|&column| column < j)
    }

    /// Column of each stored block.
    pub fn columns(&self) -> &[usize] {
        &self.columns
    }

    /// Number of products of blocks in the elimination.
    pub fn products(&self) -> usize {
        self.targets.len()
    }

    /// Blocks of row `k` right of the diagonal.
    fn after(&self, k: usize) -> Range<usize> {
        self.diagonal[k] + 1..self.starts[k + 1]
    }

    /// Factors `blocks` in place; they become NaN if a diagonal block is singular. `is_unit(i)`: row i is that of the unit
    /// matrix.
    pub fn factor(&self, blocks: &mut [Mat3], is_unit: impl Fn(usize) -> bool) {
        for k in 0..self.size {
            if is_unit(k) {
                // The pivot is 1 and the rest of its row 0, so that the rows below stay as they are.
                continue;
            }
            let pivot = &mut blocks[self.diagonal[k]];
            let inverse = pivot.try_inverse().unwrap_or_else(|| Mat3::from_element(f64::NAN));
            *pivot = inverse;
            let after = self.after(k);
            let targets = self.targets[self.first_targets[k]..].chunks_exact(after.len() + 1);
            for (&i, targets) in self.columns[after.clone()].iter().zip(targets) {
                if is_unit(i) {
                    continue;
                }
                let start = self.starts[i];
                let (above, row) = blocks.split_at_mut(start);
                let factor = row[targets[0] - start] * inverse;
                row[targets[0] - start] = factor;
                for (&target, by) in targets[1..].iter().zip(&above[after.clone()]) {
                    subtract_product(&mut row[target - start], &factor, by);
                }
            }
        }
    }

    /// Solves with factored `blocks`, in place. A unit row's right-hand side is its solution.
    pub fn solve(&self, blocks: &[Mat3], x: &mut [Vec3], is_unit: impl Fn(usize) -> bool) {
        for i in (0..self.size).filter(|&i| !is_unit(i)) {
            let mut sum = x[i];
            for at in self.starts[i]..self.diagonal[i] {
                sum -= blocks[at] * x[self.columns[at]];
            }
            x[i] = sum;
        }
        for k in (0..self.size).rev().filter(|&k| !is_unit(k)) {
            let mut sum = x[k];
            for at in self.after(k) {
                sum -= blocks[at] * x[self.columns[at]];
            }
            x[k] = blocks[self.diagonal[k]] * sum;
        }
    }
}

/// out -= a b.
#[inline]
fn subtract_product(out: &mut Mat3, a: &Mat3, b: &Mat3) {
    for j in 0..3 {
        let (x, y, z) = (b[(0, j)], b[(1, j)], b[(2, j)]);
        for i in 0..3 {
            out[(i, j)] -= a[(i, 0)] * x + a[(i, 1)] * y + a[(i, 2)] * z;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factored_matrix_solves_its_system() {
        for (size, bandwidth) in [(0, 0), (1, 0), (5, 1), (6, 5)] {
            let number = |n: usize| libm::sin(1.0 + n as f64);
            // Some blocks are zero, and a few of those fill in. One row is that of the unit matrix.
            let coupled = |i, j| (i + j) % 3 != 0;
            let is_unit = |i| i == 2;
            let mut band = Band::with_capacity(size, bandwidth);
            band.set_pattern(size, bandwidth, coupled);
            let mut blocks = vec![Mat3::zeros(); band.columns().len()];
            for i in 0..size {
                for at in band.row(i) {
                    let j = band.columns()[at];
                    let part = Mat3::from_fn(|a, b| number(9 * (size * i + j) + 3 * a + b));
                    let unit = if i == j { 9.0 } else { 0.0 };
                    if is_unit(i) {
                        blocks[at] = if i == j { Mat3::identity() } else { Mat3::zeros() };
                    } else if i == j || coupled(i, j) {
                        blocks[at] = part + Mat3::identity() * unit;
                    }
                }
            }
            let b: Vec<Vec3> = (0..size).map(|i| Vec3::from_fn(|a, _| number(3 * i + a))).collect();
            let (mut factors, mut x) = (blocks.clone(), b.clone());
            band.factor(&mut factors, is_unit);
            band.solve(&factors, &mut x, is_unit);
            for i in 0..size {
                let row = band.row(i).map(|at| blocks[at] * x[band.columns()[at]]);
                assert!((row.sum::<Vec3>() - b[i]).norm() < 1e-13, "{size} {bandwidth}");
            }
        }
    }
}
