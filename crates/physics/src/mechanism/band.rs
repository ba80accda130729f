//! Banded matrices of 3 x 3 blocks, eliminated in place without pivoting. Allocates nothing.

use crate::machine::{Mat3, Vec3};
use std::ops::Range;

/// Sparsity pattern of a banded block matrix and of its factors, and the storage index of each block, row by row.
#[derive(Default)]
pub struct Band {
    size: usize,
    reach: usize,
    filled: Vec<bool>,
}

impl Band {
    /// With capacity for `size` block rows of bandwidth `reach`.
    pub fn with_room(size: usize, reach: usize) -> Self {
        Self { filled: Vec::with_capacity(Self::places(size, reach)), ..Self::default() }
    }

    /// Sets the pattern of a matrix with `size` block rows: block (i, j) may be nonzero on the diagonal and, within bandwidth
    /// `reach`, where `coupled(i, j)`. Two legs of a platform, for example, couple only through it.
    pub fn arrange(&mut self, size: usize, reach: usize, coupled: impl Fn(usize, usize) -> bool) {
        (self.size, self.reach) = (size, reach);
        self.filled.clear();
        self.filled.resize(self.len(), false);
        for i in 0..size {
            for j in i.saturating_sub(reach)..self.end(i) {
                let at = self.at(i, j);
                self.filled[at] = i == j || coupled(i, j);
            }
        }
        for k in 0..size {
            for i in k + 1..self.end(k) {
                for j in k + 1..self.end(k) {
                    let at = self.at(i, j);
                    self.filled[at] |= self.filled[self.at(i, k)] && self.filled[self.at(k, j)];
                }
            }
        }
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
        self.within(i, i.saturating_sub(self.reach)..self.end(i))
    }

    fn after(&self, k: usize) -> impl Iterator<Item = usize> + '_ {
        self.within(k, k + 1..self.end(k))
    }

    fn within(&self, i: usize, columns: Range<usize>) -> impl Iterator<Item = usize> + '_ {
        columns.filter(move |&j| self.filled[self.at(i, j)])
    }

    fn end(&self, i: usize) -> usize {
        (i + self.reach + 1).min(self.size)
    }

    /// Factors `blocks` in place; they become NaN if a diagonal block is singular.
    pub fn factor(&self, blocks: &mut [Mat3]) {
        for k in 0..self.size {
            let inverse = blocks[self.at(k, k)].try_inverse().unwrap_or_else(|| Mat3::from_element(f64::NAN));
            blocks[self.at(k, k)] = inverse;
            for i in k + 1..self.end(k) {
                let lower = self.at(i, k);
                if !self.filled[lower] {
                    continue;
                }
                let factor = blocks[lower] * inverse;
                blocks[lower] = factor;
                for j in self.after(k) {
                    let by = factor * blocks[self.at(k, j)];
                    blocks[self.at(i, j)] -= by;
                }
            }
        }
    }

    /// Solves with factored `blocks`, in place.
    pub fn solve(&self, blocks: &[Mat3], x: &mut [Vec3]) {
        for i in 0..self.size {
            let mut sum = x[i];
            for k in self.within(i, i.saturating_sub(self.reach)..i) {
                sum -= blocks[self.at(i, k)] * x[k];
            }
            x[i] = sum;
        }
        for k in (0..self.size).rev() {
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
            // Some blocks are zero, and a few of those fill in.
            let coupled = |i, j| (i + 2 * j) % 3 != 0;
            let mut band = Band::with_room(size, reach);
            band.arrange(size, reach, coupled);
            let mut blocks = vec![Mat3::zeros(); band.len()];
            for i in 0..size {
                for j in band.row(i) {
                    let part = Mat3::from_fn(|a, b| number(9 * (size * i + j) + 3 * a + b));
                    let unit = if i == j { 9.0 } else { 0.0 };
                    if i == j || coupled(i, j) {
                        blocks[band.at(i, j)] = part + Mat3::identity() * unit;
                    }
                }
            }
            let b: Vec<Vec3> = (0..size).map(|i| Vec3::from_fn(|a, _| number(3 * i + a))).collect();
            let (mut factors, mut x) = (blocks.clone(), b.clone());
            band.factor(&mut factors);
            band.solve(&factors, &mut x);
            for i in 0..size {
                let row = band.row(i).map(|j| blocks[band.at(i, j)] * x[j]);
                assert!((row.sum::<Vec3>() - b[i]).norm() < 1e-13, "{size} {reach}");
            }
        }
    }
}
