//! Dense linear systems of a size known beforehand. Allocates nothing after `new`.

use nalgebra::ComplexField;

/// Dense LU factorisation with partial pivoting, for real and complex numbers.
pub struct Lu<X> {
    n: usize,
    rows: Vec<X>,
    pivots: Vec<usize>,
}

impl<X: ComplexField<RealField = f64> + Copy> Lu<X> {
    /// For `n` rows.
    pub fn new(n: usize) -> Self {
        Self {
            n,
            rows: vec![X::zero(); n * n],
            pivots: vec![0; n],
        }
    }

    /// Factors the matrix with these entries (row, column, n).
    pub fn factor(&mut self, entry: impl Fn(usize, usize, usize) -> X) {
        let n = self.n;
        let a = &mut self.rows;
        for (i, row) in a.chunks_exact_mut(n).enumerate() {
            for (j, a) in row.iter_mut().enumerate() {
                *a = entry(i, j, n);
            }
        }
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
            // Bodies that are far apart in a mechanism do not couple: most factors are zero, and the row of the pivot ends early.
            let last = pivot_row.iter().rposition(|a| !a.is_zero());
            let end = last.map_or(k, |last| last + 1);
            for row in bottom.chunks_exact_mut(n) {
                if row[k].is_zero() {
                    continue;
                }
                let factor = row[k] * inverse;
                row[k] = factor;
                for (a, pivot) in row[k + 1..end].iter_mut().zip(&pivot_row[k + 1..end]) {
                    *a -= factor * *pivot;
                }
            }
        }
    }

    /// Solves with the factors in place.
    pub fn solve(&self, b: &mut [X]) {
        let n = self.n;
        for k in 0..n {
            b.swap(k, self.pivots[k]);
        }
        for i in 1..n {
            let mut x = b[i];
            for (a, x_j) in self.rows[i * n..i * n + i].iter().zip(&*b) {
                x -= *a * *x_j;
            }
            b[i] = x;
        }
        for i in (0..n).rev() {
            let row = &self.rows[i * n..(i + 1) * n];
            let mut x = b[i];
            for (a, x_j) in row[i + 1..].iter().zip(&b[i + 1..]) {
                x -= *a * *x_j;
            }
            b[i] = x / row[i];
        }
    }
}
