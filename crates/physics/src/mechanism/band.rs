//! Banded matrices of 3 x 3 blocks, eliminated in place without pivoting. Allocates nothing.

use crate::machine::{Mat3, Vec3};

/// Sparsity pattern of a banded block matrix and of its factors, and the storage index of each block, row by row. The pattern is
/// symmetric.
#[derive(Default)]
pub struct Band {
    size: usize,
    reach: usize,
    filled: Vec<bool>,
    /// Columns of each row that may be nonzero, row after row, and where each row starts.
    columns: Vec<usize>,
    starts: Vec<usize>,
}

impl Band {
    /// With capacity for `size` block rows of bandwidth `reach`.
    pub fn with_room(size: usize, reach: usize) -> Self {
        let places = Self::places(size, reach);
        Self {
            filled: Vec::with_capacity(places),
            columns: Vec::with_capacity(places),
            starts: Vec::with_capacity(size + 1),
            ..Self::default()
        }
    }

    /// Sets the pattern of a matrix with `size` block rows: block (i, j) may be nonzero on the diagonal and, within bandwidth
    /// `reach`, where `coupled(i, j)`, which is symmetric. Two legs of a platform, for example, couple only through it.
    pub fn arrange(&mut self, size: usize, reach: usize, coupled: impl Fn(usize, usize) -> bool) {
        (self.size, self.reach) = (size, reach);
        self.filled.clear();
        self.filled.resize(self.len(), false);
        for i in 0..size {
            for j in i..self.end(i) {
                let filled = i == j || coupled(i, j);
                self.fill(i, j, filled);
            }
        }
        for k in 0..size {
            for i in k + 1..self.end(k) {
                if self.filled[self.at(i, k)] {
                    for j in i + 1..self.end(k) {
                        let filled = self.filled[self.at(i, j)] || self.filled[self.at(k, j)];
                        self.fill(i, j, filled);
                    }
                }
            }
        }
        self.columns.clear();
        self.starts.clear();
        for i in 0..size {
            self.starts.push(self.columns.len());
            let row = i.saturating_sub(reach)..self.end(i);
            self.columns.extend(row.filter(|&j| self.filled[i * (2 * reach + 1) + j + reach - i]));
        }
        self.starts.push(self.columns.len());
    }

    fn fill(&mut self, i: usize, j: usize, filled: bool) {
        let (one, other) = (self.at(i, j), self.at(j, i));
        self.filled[one] = filled;
        self.filled[other] = filled;
    }

    /// Number of block rows.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Storage for `size` block rows, in blocks.
    pub fn places(size: usize, reach: usize) -> usize {
        size * (2 * reach + 1)
    }

    /// Storage in use, in blocks.
    pub fn len(&self) -> usize {
        Self::places(self.size, self.reach)
    }

    /// Storage index of block (`i`, `j`).
    pub fn at(&self, i: usize, j: usize) -> usize {
        i * (2 * self.reach + 1) + j + self.reach - i
    }

    /// Columns of row `i` that may be nonzero.
    pub fn row(&self, i: usize) -> impl Iterator<Item = usize> + '_ {
        self.columns[self.starts[i]..self.starts[i + 1]].iter().copied()
    }

    /// Those right of the diagonal.
    fn after(&self, k: usize) -> impl Iterator<Item = usize> + '_ {
        self.row(k).skip_while(move |&j| j <= k)
    }

    fn end(&self, i: usize) -> usize {
        (i + self.reach + 1).min(self.size)
    }

    /// Factors `blocks` in place; they become NaN if a diagonal block is singular. `is_unit(i)`: row i is that of the unit matrix.
    pub fn factor(&self, blocks: &mut [Mat3], is_unit: impl Fn(usize) -> bool) {
        for k in 0..self.size {
            if is_unit(k) {
                // The pivot is 1 and the rest of its row 0, so that the rows below stay as they are.
                continue;
            }
            let inverse = blocks[self.at(k, k)].try_inverse().unwrap_or_else(|| Mat3::from_element(f64::NAN));
            blocks[self.at(k, k)] = inverse;
            for i in self.after(k).filter(|&i| !is_unit(i)) {
                let lower = self.at(i, k);
                let factor = blocks[lower] * inverse;
                blocks[lower] = factor;
                for j in self.after(k) {
                    let by = factor * blocks[self.at(k, j)];
                    blocks[self.at(i, j)] -= by;
                }
            }
        }
    }

    /// Solves with factored `blocks`, in place. A unit row's right-hand side is its solution.
    pub fn solve(&self, blocks: &[Mat3], x: &mut [Vec3], is_unit: impl Fn(usize) -> bool) {
        for i in (0..self.size).filter(|&i| !is_unit(i)) {
            let mut sum = x[i];
            for k in self.row(i).take_while(|&k| k < i) {
                sum -= blocks[self.at(i, k)] * x[k];
            }
            x[i] = sum;
        }
        for k in (0..self.size).rev().filter(|&k| !is_unit(k)) {
            let mut sum = x[k];
            for j in self.after(k) {
                sum -= blocks[self.at(k, j)] * x[j];
            }
            x[k] = blocks[self.at(k, k)] * sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_solves_what_it_was_given() {
        for (size, reach) in [(0, 0), (1, 0), (5, 1), (6, 5)] {
            let number = |n: usize| libm::sin(1.0 + n as f64);
            // Some blocks are zero, and a few of those fill in. One row is that of the unit matrix.
            let coupled = |i, j| (i + j) % 3 != 0;
            let is_unit = |i| i == 2;
            let mut band = Band::with_room(size, reach);
            band.arrange(size, reach, coupled);
            let mut blocks = vec![Mat3::zeros(); band.len()];
            for i in 0..size {
                for j in band.row(i) {
                    let part = Mat3::from_fn(|a, b| number(9 * (size * i + j) + 3 * a + b));
                    let unit = if i == j { 9.0 } else { 0.0 };
                    if is_unit(i) {
                        blocks[band.at(i, j)] = if i == j { Mat3::identity() } else { Mat3::zeros() };
                    } else if i == j || coupled(i, j) {
                        blocks[band.at(i, j)] = part + Mat3::identity() * unit;
                    }
                }
            }
            let b: Vec<Vec3> = (0..size).map(|i| Vec3::from_fn(|a, _| number(3 * i + a))).collect();
            let (mut factors, mut x) = (blocks.clone(), b.clone());
            band.factor(&mut factors, is_unit);
            band.solve(&factors, &mut x, is_unit);
            for i in 0..size {
                let row = band.row(i).map(|j| blocks[band.at(i, j)] * x[j]);
                assert!((row.sum::<Vec3>() - b[i]).norm() < 1e-13, "{size} {reach}");
            }
        }
    }
}
