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
        for i in 0..n {
            for j in 0..n {
                a[i * n + j] = entry(i, j, n);
            }
        }
        for k in 0..n {
            let mut best = k;
            for i in k + 1..n {
                if a[i * n + k].norm1() > a[best * n + k].norm1() {
                    best = i;
                }
            }
            self.pivots[k] = best;
            if best != k {
                for j in 0..n {
                    a.swap(k * n + j, best * n + j);
                }
            }
            let (top, bottom) = a.split_at_mut((k + 1) * n);
            let pivot_row = &top[k * n..];
            let inverse = X::one() / pivot_row[k];
            for row in bottom.chunks_exact_mut(n) {
                let factor = row[k] * inverse;
                row[k] = factor;
                for j in k + 1..n {
                    row[j] -= factor * pivot_row[j];
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
