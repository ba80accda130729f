//! Sparse linear systems up to a given size. Allocates nothing after `new`.

use nalgebra::ComplexField;
use std::ops::Range;

/// Below this number of rows, dense elimination is faster than testing for zeros.
const MIN_SPARSE: usize = 16;

/// LU factorisation with partial pivoting, for real and complex numbers, that skips zeros. Its cost depends on the row order and
/// is linear for banded and bordered matrices.
pub struct Lu<X> {
    /// Maximum number of rows.
    max_rows: usize,
    /// Rows in use.
    n: usize,
    rows: Vec<X>,
    pivots: Vec<usize>,
    /// Column range of each row that may be nonzero.
    extents: Vec<Range<usize>>,
    /// Last row whose extent starts at or left of each column.
    lowest: Vec<usize>,
    /// Nonzero factors left and right of the diagonal, row by row: start of each row, columns, values.
    starts: Vec<usize>,
    columns: Vec<u32>,
    factors: Vec<X>,
    /// Nonzero columns of a pivot row.
    filled: Vec<usize>,
    /// Multiplications in the latest sparse elimination.
    pub products: usize,
}

impl<X: ComplexField<RealField = f64> + Copy> Lu<X> {
    /// For at most `n` rows.
    pub fn new(n: usize) -> Self {
        Self {
            max_rows: n,
            n: 0,
            rows: vec![X::zero(); n * n],
            pivots: vec![0; n],
            extents: vec![0..0; n],
            lowest: vec![0; n],
            starts: Vec::with_capacity(2 * n + 1),
            columns: Vec::with_capacity(n * n),
            factors: Vec::with_capacity(n * n),
            filled: Vec::with_capacity(n),
            products: 0,
        }
    }

    /// Factors the `n` x `n` matrix with these entries (row, column, value) plus `diagonal` on its diagonal.
    pub fn factor(&mut self, n: usize, entries: impl Iterator<Item = (usize, usize, X)>, diagonal: X) {
        self.clear();
        self.n = n;
        self.products = 0;
        let stride = self.stride();
        let (a, extents) = (&mut self.rows[..], &mut self.extents[..n]);
        for (i, extent) in extents.iter_mut().enumerate() {
            *extent = i..i + 1;
        }
        for (i, j, entry) in entries {
            a[i * stride + j] = entry;
            if n >= MIN_SPARSE {
                let extent = &mut extents[i];
                *extent = extent.start.min(j)..extent.end.max(j + 1);
            }
        }
        for i in 0..n {
            a[i * stride + i] += diagonal;
        }
        if n < MIN_SPARSE {
            self.eliminate_dense();
        } else {
            self.eliminate_sparse();
            self.pack();
        }
    }

    /// Distance between two rows.
    #[inline]
    fn stride(&self) -> usize {
        if self.n < MIN_SPARSE { self.n } else { self.max_rows }
    }

    /// Zeroes the entries of the latest matrix.
    fn clear(&mut self) {
        let n = self.n;
        if n < MIN_SPARSE {
            self.rows[..n * n].fill(X::zero());
            return;
        }
        for (row, extent) in self.rows.chunks_exact_mut(self.max_rows).zip(&self.extents[..n]) {
            row[extent.clone()].fill(X::zero());
        }
    }

    /// Dense elimination that skips rows with a zero factor.
    fn eliminate_dense(&mut self) {
        let n = self.n;
        let a = &mut self.rows[..n * n];
        for k in 0..n {
            let (mut best, mut largest) = (k, a[k * n + k].norm1());
            for i in k + 1..n {
                let size = a[i * n + k].norm1();
                if size > largest {
                    (best, largest) = (i, size);
                }
            }
            self.pivots[k] = best;
            if best != k {
                let (top, bottom) = a.split_at_mut(best * n);
                top[k * n..][..n].swap_with_slice(&mut bottom[..n]);
            }
            let (top, bottom) = a.split_at_mut((k + 1) * n);
            let pivot_row = &top[k * n..];
            let inverse = X::one() / pivot_row[k];
            let last = pivot_row.iter().rposition(|a| !a.is_zero());
            let span = k + 1..last.unwrap_or(k).max(k) + 1;
            for row in bottom.chunks_exact_mut(n) {
                if row[k].is_zero() {
                    continue;
                }
                let factor = row[k] * inverse;
                row[k] = factor;
                let pairs = row[span.clone()].iter_mut().zip(&pivot_row[span.clone()]);
                pairs.for_each(|(a, pivot)| *a -= factor * *pivot);
            }
        }
    }

    /// Elimination restricted to the extents of the rows.
    fn eliminate_sparse(&mut self) {
        let (n, stride) = (self.n, self.max_rows);
        let (a, extents) = (&mut self.rows[..], &mut self.extents[..n]);
        let lowest = &mut self.lowest[..n];
        lowest.fill(0);
        for (i, extent) in extents.iter().enumerate() {
            lowest[extent.start] = i;
        }
        for k in 1..n {
            lowest[k] = lowest[k].max(lowest[k - 1]);
        }
        for k in 0..n {
            let below = k + 1..lowest[k] + 1;
            let (mut best, mut largest) = (k, a[k * stride + k].norm1());
            for i in below.clone() {
                if extents[i].contains(&k) {
                    let size = a[i * stride + k].norm1();
                    if size > largest {
                        (best, largest) = (i, size);
                    }
                }
            }
            self.pivots[k] = best;
            if best != k {
                let part = extents[k].start.min(extents[best].start)..extents[k].end.max(extents[best].end);
                let (top, bottom) = a.split_at_mut(best * stride);
                top[k * stride..][part.clone()].swap_with_slice(&mut bottom[part]);
                extents.swap(k, best);
            }
            let (top, bottom) = a.split_at_mut((k + 1) * stride);
            let pivot_row = &top[k * stride..];
            let inverse = X::one() / pivot_row[k];
            let last = extents[k].clone().rev().find(|&j| !pivot_row[j].is_zero());
            let span = k + 1..last.unwrap_or(k).max(k) + 1;
            self.filled.clear();
            let filled = span.clone().filter(|&j| !pivot_row[j].is_zero());
            self.filled.extend(filled);
            // Contiguous ranges vectorise.
            let is_contiguous = span.len() < 2 * self.filled.len();
            let width = if is_contiguous { span.len() } else { self.filled.len() };
            for i in below {
                let extent = &mut extents[i];
                if !extent.contains(&k) {
                    continue;
                }
                let row = &mut bottom[(i - k - 1) * stride..][..n];
                if row[k].is_zero() {
                    continue;
                }
                extent.end = extent.end.max(span.end);
                self.products += 1 + width;
                let factor = row[k] * inverse;
                row[k] = factor;
                if is_contiguous {
                    let pairs = row[span.clone()].iter_mut().zip(&pivot_row[span.clone()]);
                    pairs.for_each(|(a, pivot)| *a -= factor * *pivot);
                } else {
                    for &j in &self.filled {
                        row[j] -= factor * pivot_row[j];
                    }
                }
            }
        }
    }

    /// Collects the nonzero factors.
    fn pack(&mut self) {
        let n = self.n;
        self.starts.clear();
        self.columns.clear();
        self.factors.clear();
        let rows = self.rows.chunks_exact(self.max_rows);
        for (i, (row, extent)) in rows.zip(&self.extents).take(n).enumerate() {
            for part in [extent.start..i, i + 1..extent.end] {
                self.starts.push(self.columns.len());
                for j in part {
                    if !row[j].is_zero() {
                        self.columns.push(j as u32);
                        self.factors.push(row[j]);
                    }
                }
            }
        }
        self.starts.push(self.columns.len());
    }

    /// b[i] minus the products of the factors left (`right` = 0) or right (1) of the diagonal in row `i`.
    #[inline]
    fn reduced(&self, i: usize, right: usize, b: &[X]) -> X {
        let mut x = b[i];
        if self.n < MIN_SPARSE {
            let part = [0..i, i + 1..self.n][right].clone();
            let row = &self.rows[i * self.n..][..self.n];
            for (a, b) in row[part.clone()].iter().zip(&b[part]) {
                x -= *a * *b;
            }
        } else {
            let part = self.starts[2 * i + right]..self.starts[2 * i + right + 1];
            for (a, &j) in self.factors[part.clone()].iter().zip(&self.columns[part]) {
                x -= *a * b[j as usize];
            }
        }
        x
    }

    /// Solves in place with the factors.
    pub fn solve(&self, b: &mut [X]) {
        let (n, stride) = (self.n, self.stride());
        for k in 0..n {
            b.swap(k, self.pivots[k]);
        }
        for i in 1..n {
            b[i] = self.reduced(i, 0, b);
        }
        for i in (0..n).rev() {
            b[i] = self.reduced(i, 1, b) / self.rows[i * stride + i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Diagonal blocks of three, each coupled to a border, which is the first or the last block.
    fn arrow(blocks: usize, border: usize) -> Vec<(usize, usize, f64)> {
        let mut entries = Vec::new();
        let mut seed = 7_u32;
        for p in 0..blocks {
            for q in 0..blocks {
                if p != q && p != border && q != border {
                    continue;
                }
                for i in 0..3 {
                    for j in 0..3 {
                        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                        let entry = f64::from(seed >> 8) / f64::from(1 << 24) - 0.5;
                        entries.push((3 * p + i, 3 * q + j, entry));
                    }
                }
            }
        }
        entries
    }

    #[test]
    fn solutions_satisfy_the_system_and_a_border_at_the_end_causes_no_fill_in() {
        let mut filled = Vec::new();
        for (blocks, border) in [(3, 2), (8, 7), (16, 15), (16, 0)] {
            let n = 3 * blocks;
            let entries = arrow(blocks, border);
            let mut lu = Lu::new(n + 4);
            lu.factor(n, entries.iter().copied(), 5.0);
            let x: Vec<f64> = (0..n).map(|i| i as f64 - 3.5).collect();
            let mut b: Vec<f64> = x.iter().map(|x| 5.0 * x).collect();
            for &(i, j, entry) in &entries {
                b[i] += entry * x[j];
            }
            lu.solve(&mut b);
            for (b, x) in b.iter().zip(&x) {
                assert!((b - x).abs() < 1e-12, "{b} {x}");
            }
            filled.push(lu.factors.len());
        }
        // Off-diagonal entries: one block of 3 with its row and column of the border, and the last block.
        let border = |blocks: usize| (blocks - 1) * (6 + 18) + 6;
        assert_eq!(filled, [0, border(8), border(16), 48 * 47]);
    }
}
