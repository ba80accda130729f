//! Banded matrices of 3 x 3 blocks, eliminated in place without exchanging rows. Allocates nothing.

use crate::scene::{Mat3, Vec3};
use std::ops::Range;

/// Where the blocks of a banded matrix stand, row by row.
#[derive(Clone, Copy, Default)]
pub struct Band {
    /// Rows of blocks.
    pub size: usize,
    /// Blocks further from the diagonal are zero.
    pub reach: usize,
}

impl Band {
    /// Number of blocks.
    pub fn len(self) -> usize {
        self.size * (2 * self.reach + 1)
    }

    /// Place of block (`i`, `j`).
    pub fn at(self, i: usize, j: usize) -> usize {
        i * (2 * self.reach + 1) + j + self.reach - i
    }

    /// Columns of row `i`.
    pub fn row(self, i: usize) -> Range<usize> {
        i.saturating_sub(self.reach)..self.end(i)
    }

    fn end(self, i: usize) -> usize {
        (i + self.reach + 1).min(self.size)
    }

    /// Factors `blocks`; they become NaN where a diagonal block is singular. Blocks that stay zero are skipped: two legs of a
    /// platform couple through it alone.
    pub fn factor(self, blocks: &mut [Mat3]) {
        for k in 0..self.size {
            let inverse = blocks[self.at(k, k)]
                .try_inverse()
                .unwrap_or_else(|| Mat3::from_element(f64::NAN));
            blocks[self.at(k, k)] = inverse;
            for i in k + 1..self.end(k) {
                let lower = blocks[self.at(i, k)];
                if lower == Mat3::zeros() {
                    continue;
                }
                let factor = lower * inverse;
                blocks[self.at(i, k)] = factor;
                for j in k + 1..self.end(k) {
                    let upper = blocks[self.at(k, j)];
                    if upper != Mat3::zeros() {
                        blocks[self.at(i, j)] -= factor * upper;
                    }
                }
            }
        }
    }

    /// Solves with factored `blocks`, in place.
    pub fn solve(self, blocks: &[Mat3], x: &mut [Vec3]) {
        for k in 0..self.size {
            for i in k + 1..self.end(k) {
                let above = x[k];
                x[i] -= blocks[self.at(i, k)] * above;
            }
        }
        for k in (0..self.size).rev() {
            let mut sum = x[k];
            for j in k + 1..self.end(k) {
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
            let band = Band { size, reach };
            let number = |n: usize| libm::sin(1.0 + n as f64);
            let mut blocks = vec![Mat3::zeros(); band.len()];
            for i in 0..size {
                for j in band.row(i) {
                    let part = Mat3::from_fn(|a, b| number(9 * (size * i + j) + 3 * a + b));
                    let unit = if i == j { 9.0 } else { 0.0 };
                    // Some that are zero, of which a few fill in.
                    if i == j || (i + 2 * j) % 3 != 0 {
                        blocks[band.at(i, j)] = part + Mat3::identity() * unit;
                    }
                }
            }
            let b: Vec<Vec3> = (0..size)
                .map(|i| Vec3::from_fn(|a, _| number(3 * i + a)))
                .collect();
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
