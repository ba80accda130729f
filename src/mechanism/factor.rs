//! Sparse factorisation of a tree's mass matrix, H = L^T D L: fill-in free because every coordinate couples only with
//! its ancestors (Featherstone, *Rigid Body Dynamics Algorithms*, 2008, section 6.5).

use super::model::NONE;

/// Factors the lower triangle of the row-major n x n matrix `h` in place; `inverse_diagonal` gets 1 / D.
#[inline]
pub fn factor(h: &mut [f64], n: usize, parent: &[usize], inverse_diagonal: &mut [f64]) {
    for k in (0..n).rev() {
        let inverse = 1.0 / h[k * n + k];
        inverse_diagonal[k] = inverse;
        let mut i = parent[k];
        while i != NONE {
            let a = h[k * n + i] * inverse;
            let mut j = i;
            while j != NONE {
                h[i * n + j] -= a * h[k * n + j];
                j = parent[j];
            }
            h[k * n + i] = a;
            i = parent[i];
        }
    }
}

/// Solves H x = b in place.
#[inline]
pub fn solve(h: &[f64], n: usize, parent: &[usize], inverse_diagonal: &[f64], x: &mut [f64]) {
    for k in (0..n).rev() {
        let xk = x[k];
        let mut i = parent[k];
        while i != NONE {
            x[i] -= h[k * n + i] * xk;
            i = parent[i];
        }
    }
    for k in 0..n {
        let mut xk = x[k] * inverse_diagonal[k];
        let mut i = parent[k];
        while i != NONE {
            xk -= h[k * n + i] * x[i];
            i = parent[i];
        }
        x[k] = xk;
    }
}

/// Cholesky factorisation of a symmetric positive definite matrix stored by its row envelope.
///
/// Row i holds columns `first[i]..=i`; nothing outside the envelope fills in, so that a chain costs linear time.
pub struct Skyline {
    first: Vec<usize>,
    offset: Vec<usize>,
    values: Vec<f64>,
}

impl Skyline {
    /// For rows that begin at columns `first`.
    pub fn new(first: Vec<usize>) -> Self {
        let mut offset = Vec::with_capacity(first.len());
        let mut total = 0;
        for (i, &f) in first.iter().enumerate() {
            offset.push(total);
            total += i - f + 1;
        }
        Self {
            first,
            offset,
            values: vec![0.0; total],
        }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.first.len()
    }

    /// Forgets all values.
    pub fn clear(&mut self) {
        self.values.fill(0.0);
    }

    /// Adds to entry (i, j), j <= i, inside the envelope.
    #[inline]
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        self.values[self.offset[i] + j - self.first[i]] += value;
    }

    /// Factors in place. Returns the smallest ratio of a pivot to its diagonal entry: at rounding level or below, rows
    /// depend on one another.
    pub fn factor(&mut self) -> f64 {
        let mut least = f64::INFINITY;
        for i in 0..self.len() {
            let (fi, oi) = (self.first[i], self.offset[i]);
            for j in fi..i {
                let (fj, oj) = (self.first[j], self.offset[j]);
                let start = fi.max(fj);
                let mut sum = self.values[oi + j - fi];
                for k in start..j {
                    sum -= self.values[oi + k - fi] * self.values[oj + k - fj];
                }
                self.values[oi + j - fi] = sum / self.values[oj + j - fj];
            }
            let diagonal = self.values[oi + i - fi];
            let mut pivot = diagonal;
            for k in fi..i {
                let l = self.values[oi + k - fi];
                pivot -= l * l;
            }
            least = least.min(pivot / diagonal);
            self.values[oi + i - fi] = pivot.max(0.0).sqrt();
        }
        least
    }

    /// Solves A x = b in place.
    pub fn solve(&self, x: &mut [f64]) {
        for i in 0..self.len() {
            let (fi, oi) = (self.first[i], self.offset[i]);
            let mut sum = x[i];
            for k in fi..i {
                sum -= self.values[oi + k - fi] * x[k];
            }
            x[i] = sum / self.values[oi + i - fi];
        }
        for i in (0..self.len()).rev() {
            let (fi, oi) = (self.first[i], self.offset[i]);
            let xi = x[i] / self.values[oi + i - fi];
            x[i] = xi;
            for k in fi..i {
                x[k] -= self.values[oi + k - fi] * xi;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn branched_tree_solves_like_a_dense_matrix() {
        // Coordinates 0-1 at the root, 2 and 3 two branches on 1.
        let parent = [NONE, 0, 1, 1];
        let dense = nalgebra::Matrix4::new(
            9., 1., 2., 3., 1., 8., -1., 1., 2., -1., 7., 0., 3., 1., 0., 6.,
        );
        let b = nalgebra::Vector4::new(1., -2., 3., 4.);
        let expected = dense.lu().solve(&b).unwrap();
        let mut h: Vec<f64> = dense.transpose().as_slice().to_vec();
        let mut d = [0.0; 4];
        factor(&mut h, 4, &parent, &mut d);
        let mut x = b;
        solve(&h, 4, &parent, &d, x.as_mut_slice());
        assert!((x - expected).norm() < 1e-14, "{x} {expected}");
    }

    #[test]
    fn skyline_solves_a_banded_system() {
        let n = 12;
        let mut a = Skyline::new((0..n).map(|i: usize| i.saturating_sub(2)).collect());
        let mut dense = nalgebra::DMatrix::<f64>::zeros(n, n);
        for i in 0..n {
            for j in i.saturating_sub(2)..=i {
                let value = if i == j {
                    5.0 + i as f64
                } else {
                    1.0 / (1.0 + i as f64 + j as f64)
                };
                a.add(i, j, value);
                dense[(i, j)] = value;
                dense[(j, i)] = value;
            }
        }
        let b = nalgebra::DVector::from_fn(n, |i, _| 1.0 + i as f64);
        let expected = dense.lu().solve(&b).unwrap();
        assert!(a.factor() > 0.5);
        let mut x = b;
        a.solve(x.as_mut_slice());
        assert!((x - expected).norm() < 1e-13);
    }
}
