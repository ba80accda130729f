//! Sparse factorisation of a tree's mass matrix, H = L^T D L: fill-in free because every coordinate couples only with
//! its ancestors (Featherstone, *Rigid Body Dynamics Algorithms*, 2008, section 6.5).

/// No parent coordinate.
pub const NONE: usize = usize::MAX;

/// Sparsity pattern: which coordinates each one couples with.
#[derive(Clone, Debug)]
pub struct Pattern {
    /// Parent coordinate of each; [`NONE`] at a root.
    pub parent: Vec<usize>,
    /// All further coordinates are direct children of a free body's six: the case that is worth fixed-size loops.
    on_free_body: bool,
}

impl Pattern {
    /// From the parent of each coordinate.
    pub fn new(parent: Vec<usize>) -> Self {
        let chain = |k: usize| if k == 0 { NONE } else { k - 1 };
        let on_free_body = parent.len() >= 6
            && parent
                .iter()
                .enumerate()
                .all(|(k, &p)| p == if k < 6 { chain(k) } else { 5 });
        Self {
            parent,
            on_free_body,
        }
    }

    /// Number of coordinates.
    pub fn len(&self) -> usize {
        self.parent.len()
    }

    /// Factors the lower triangle of the row-major matrix `h` in place; `inverse_diagonal` gets 1 / D.
    #[inline]
    pub fn factor(&self, h: &mut [f64], inverse_diagonal: &mut [f64]) {
        let (n, parent) = (self.len(), &self.parent);
        if self.on_free_body {
            factor_on_free_body(h, n, inverse_diagonal);
            return;
        }
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
    pub fn solve(&self, h: &[f64], inverse_diagonal: &[f64], x: &mut [f64]) {
        let (n, parent) = (self.len(), &self.parent);
        if self.on_free_body {
            solve_on_free_body(h, n, inverse_diagonal, x);
            return;
        }
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
}

/// First six entries of row `k`.
#[inline(always)]
fn six(h: &[f64], n: usize, k: usize) -> [f64; 6] {
    std::array::from_fn(|j| h[k * n..k * n + 6][j])
}

/// [`Pattern::factor`] where coordinates 6.. are children of a free body's six: the same operations in fixed-size loops.
fn factor_on_free_body(h: &mut [f64], n: usize, inverse_diagonal: &mut [f64]) {
    let mut base: [[f64; 6]; 6] = std::array::from_fn(|i| six(h, n, i));
    for k in 6..n {
        let row = six(h, n, k);
        let inverse = 1.0 / h[k * n + k];
        inverse_diagonal[k] = inverse;
        let scaled = row.map(|x| x * inverse);
        // The upper triangle is updated too: full rows are cheaper than ragged ones, and nobody reads it.
        for i in 0..6 {
            for j in 0..6 {
                base[i][j] -= scaled[i] * row[j];
            }
        }
        h[k * n..k * n + 6].copy_from_slice(&scaled);
    }
    for k in (0..6).rev() {
        let row = base[k];
        let inverse = 1.0 / row[k];
        inverse_diagonal[k] = inverse;
        for i in 0..k {
            let a = row[i] * inverse;
            for j in 0..=i {
                base[i][j] -= a * row[j];
            }
            base[k][i] = a;
        }
    }
    for (i, row) in base.iter().enumerate() {
        h[i * n..i * n + 6].copy_from_slice(row);
    }
}

fn solve_on_free_body(h: &[f64], n: usize, inverse_diagonal: &[f64], x: &mut [f64]) {
    let mut base: [f64; 6] = std::array::from_fn(|i| x[..6][i]);
    for k in (6..n).rev() {
        let row = six(h, n, k);
        for i in 0..6 {
            base[i] -= row[i] * x[k];
        }
    }
    for k in (0..6).rev() {
        let row = six(h, n, k);
        for i in 0..k {
            base[i] -= row[i] * base[k];
        }
    }
    for k in 0..6 {
        let row = six(h, n, k);
        let mut xk = base[k] * inverse_diagonal[k];
        for i in 0..k {
            xk -= row[i] * base[i];
        }
        base[k] = xk;
    }
    x[..6].copy_from_slice(&base);
    for k in 6..n {
        let row = six(h, n, k);
        let mut xk = x[k] * inverse_diagonal[k];
        for i in 0..6 {
            xk -= row[i] * base[i];
        }
        x[k] = xk;
    }
}

/// Whether the determinant of a row-major n x n matrix is positive, by elimination in place with row exchanges.
pub fn is_determinant_positive(a: &mut [f64], n: usize) -> bool {
    let mut positive = true;
    for k in 0..n {
        let mut best = k;
        for i in k + 1..n {
            if a[i * n + k].abs() > a[best * n + k].abs() {
                best = i;
            }
        }
        if best != k {
            positive = !positive;
            for j in k..n {
                a.swap(k * n + j, best * n + j);
            }
        }
        let (top, bottom) = a.split_at_mut((k + 1) * n);
        let pivot = &top[k * n..];
        positive ^= pivot[k] < 0.0;
        let inverse = 1.0 / pivot[k];
        for row in bottom.chunks_exact_mut(n) {
            let factor = row[k] * inverse;
            if factor != 0.0 {
                for j in k + 1..n {
                    row[j] -= factor * pivot[j];
                }
            }
        }
    }
    positive
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

    /// Sets all entries to zero.
    pub fn clear(&mut self) {
        self.values.fill(0.0);
    }

    /// Adds to entry (i, j), j <= i, inside the envelope.
    #[inline]
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        self.values[self.offset[i] + j - self.first[i]] += value;
    }

    /// Entry (i, j), j <= i, before [`Self::factor`]; 0 outside the envelope.
    pub fn get(&self, i: usize, j: usize) -> f64 {
        if j < self.first[i] {
            0.0
        } else {
            self.values[self.offset[i] + j - self.first[i]]
        }
    }

    /// Original diagonal entry i and its pivot, after [`Self::factor`].
    pub fn diagonal_and_pivot(&self, i: usize) -> (f64, f64) {
        let row = &self.values[self.offset[i]..][..=i - self.first[i]];
        let pivot = self.get(i, i) * self.get(i, i);
        (row.iter().map(|l| l * l).sum(), pivot)
    }

    /// Factors in place. Returns the smallest ratio of a pivot to its diagonal entry: at rounding level or below, rows are
    /// dependent.
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

    /// A symmetric matrix with the pattern's zeros, diagonally dominant.
    fn matrix(parent: &[usize]) -> nalgebra::DMatrix<f64> {
        let n = parent.len();
        let mut m = nalgebra::DMatrix::zeros(n, n);
        for k in 0..n {
            m[(k, k)] = 20.0 + k as f64;
            let mut i = parent[k];
            while i != NONE {
                let value = libm::sin((3 * k + 7 * i) as f64);
                m[(k, i)] = value;
                m[(i, k)] = value;
                i = parent[i];
            }
        }
        m
    }

    #[test]
    fn trees_solve_like_dense_matrices() {
        let branched = vec![NONE, 0, 1, 1];
        let on_free_body = vec![NONE, 0, 1, 2, 3, 4, 5, 5, 5];
        let nested = vec![NONE, 0, 1, 2, 3, 4, 5, 6, 5];
        for parent in [branched, on_free_body, nested] {
            let n = parent.len();
            let dense = matrix(&parent);
            let b = nalgebra::DVector::from_fn(n, |i, _| 1.0 - 0.3 * i as f64);
            let mut h: Vec<f64> = dense.transpose().as_slice().to_vec();
            let expected = dense.lu().solve(&b).unwrap();
            let pattern = Pattern::new(parent);
            let mut d = vec![0.0; n];
            pattern.factor(&mut h, &mut d);
            let mut x = b;
            pattern.solve(&h, &d, x.as_mut_slice());
            assert!((x - expected).norm() < 1e-15 * 10.0, "{n}");
        }
    }

    #[test]
    fn sign_of_the_determinant() {
        let dense = matrix(&[NONE, 0, 1, 1]);
        for sign in [1.0, -1.0] {
            let mut a = dense.clone();
            a.row_mut(2).scale_mut(sign);
            a.swap_rows(0, 3);
            let expected = a.determinant() > 0.0;
            let mut rows: Vec<f64> = a.transpose().as_slice().to_vec();
            assert_eq!(is_determinant_positive(&mut rows, 4), expected);
        }
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
