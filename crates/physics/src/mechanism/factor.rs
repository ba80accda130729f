//! Sparse factorisation of a tree's mass matrix, H = L^T D L, without fill-in because every coordinate couples only with its
//! ancestors (Featherstone, *Rigid Body Dynamics Algorithms*, 2008, section 6.5).

/// No parent coordinate.
pub const NONE: usize = usize::MAX;

/// Sparsity pattern: the coordinates that each coordinate couples with.
#[derive(Clone, Debug)]
pub struct Pattern {
    /// Parent coordinate of each; [`NONE`] at a root.
    pub parent: Vec<usize>,
    /// Whether all further coordinates are direct children of a free body's six, a case worth fixed-size loops.
    on_free_body: bool,
}

impl Pattern {
    /// From the parent of each coordinate.
    pub fn new(parent: Vec<usize>) -> Self {
        let chain = |k: usize| if k == 0 { NONE } else { k - 1 };
        let on_free_body =
            parent.len() >= 6 && parent.iter().enumerate().all(|(k, &p)| p == if k < 6 { chain(k) } else { 5 });
        Self { parent, on_free_body }
    }

    /// Number of coordinates.
    pub fn len(&self) -> usize {
        self.parent.len()
    }

    /// Factors the lower triangle of the row-major matrix `h` in place; writes 1 / D to `inverse_diagonal`.
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

/// [`Pattern::factor`] if coordinates 6.. are children of a free body's six: the same operations in fixed-size loops.
fn factor_on_free_body(h: &mut [f64], n: usize, inverse_diagonal: &mut [f64]) {
    let mut base: [[f64; 6]; 6] = std::array::from_fn(|i| six(h, n, i));
    for k in 6..n {
        let row = six(h, n, k);
        let inverse = 1.0 / h[k * n + k];
        inverse_diagonal[k] = inverse;
        let scaled = row.map(|x| x * inverse);
        // Also updates the unused upper triangle: full rows are cheaper than ragged ones.
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

/// Rows of a block.
const SIDE: usize = 3;

type Block = [[f64; SIDE]; SIDE];

/// Cholesky factorisation of a symmetric positive definite matrix stored by its row envelope, in blocks of up to three rows with
/// the same sparsity, such as those of a ball joint. Smaller blocks are padded with rows of the identity.
///
/// There is no fill-in outside the envelope, so that a chain costs linear time. Inside it, blocks that stay zero are skipped: two
/// legs of a platform couple only through their rows on it. Otherwise sums run in row order.
pub struct Skyline {
    /// Block of each row, and its index within the block.
    place: Vec<(usize, usize)>,
    /// Rows in each block.
    size: Vec<usize>,
    /// Block row i stores the block columns `first[i]..=i` from `offset[i]`; the nonzero ones are
    /// `coupled[coupled_of[i]..coupled_of[i + 1]]` and the last.
    first: Vec<usize>,
    offset: Vec<usize>,
    coupled: Vec<usize>,
    coupled_of: Vec<usize>,
    blocks: Vec<Block>,
    /// Right-hand side and solution by blocks.
    x: Vec<[f64; SIDE]>,
}

impl Skyline {
    /// For rows with entries in these `columns` before the diagonal.
    pub fn new(mut columns: Vec<Vec<usize>>) -> Self {
        let mut skyline = Self {
            place: Vec::with_capacity(columns.len()),
            size: Vec::new(),
            first: Vec::new(),
            offset: Vec::new(),
            coupled: Vec::new(),
            coupled_of: vec![0],
            blocks: Vec::new(),
            x: Vec::new(),
        };
        for i in 0..columns.len() {
            columns[i].sort_unstable();
            columns[i].dedup();
            let alike = i > 0 && columns[i].split_last() == Some((&(i - 1), &columns[i - 1][..]));
            match skyline.size.last_mut() {
                Some(size) if alike && *size < SIDE => *size += 1,
                _ => skyline.size.push(1),
            }
            let block = skyline.size.len() - 1;
            skyline.place.push((block, skyline.size[block] - 1));
        }
        // A row of the factor fills in along the paths from its entries towards the root of the elimination tree
        // (Davis, *Direct Methods for Sparse Linear Systems*, 2006, section 4.1).
        let blocks = skyline.size.len();
        let mut parent = vec![NONE; blocks];
        let mut reached = vec![NONE; blocks];
        let mut row: Vec<usize> = Vec::new();
        let mut total = 0;
        let leading = (0..columns.len()).filter(|&i| skyline.place[i].1 == 0);
        for (i, columns) in leading.map(|i| &columns[i]).enumerate() {
            row.clear();
            reached[i] = i;
            for &column in columns {
                let mut j = skyline.place[column].0;
                while reached[j] != i {
                    reached[j] = i;
                    row.push(j);
                    if parent[j] == NONE {
                        parent[j] = i;
                    }
                    j = parent[j];
                }
            }
            row.sort_unstable();
            let first = row.first().copied().unwrap_or(i);
            skyline.first.push(first);
            skyline.offset.push(total);
            total += i - first + 1;
            skyline.coupled.extend(&row);
            skyline.coupled_of.push(skyline.coupled.len());
        }
        skyline.blocks = vec![Block::default(); total];
        skyline.x = vec![[0.0; SIDE]; blocks];
        skyline
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.place.len()
    }

    /// Sets all entries to zero.
    pub fn clear(&mut self) {
        self.blocks.fill(Block::default());
    }

    /// Adds to entry (i, j), j <= i, inside the envelope.
    // Inlined: every pair of rows adds one, and a call would cost the lagrange form four per cent.
    #[inline(always)]
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        let ((i, row), (j, column)) = (self.place[i], self.place[j]);
        self.blocks[self.offset[i] + j - self.first[i]][row][column] += value;
    }

    /// The block of rows that consists of `first` and the two that follow, if there is one.
    pub fn whole_block(&self, first: usize) -> Option<usize> {
        let (block, place) = *self.place.get(first)?;
        (place == 0 && self.size[block] == SIDE).then_some(block)
    }

    /// Adds to block (i, j), j <= i, of three rows each, inside the envelope. Entries above the diagonal are never read.
    #[inline]
    pub fn add_block(&mut self, i: usize, j: usize, block: &Block) {
        debug_assert_eq!([self.size[i], self.size[j]], [SIDE; 2]);
        let sum = &mut self.blocks[self.offset[i] + j - self.first[i]];
        for (sum, row) in sum.iter_mut().zip(block) {
            for (sum, value) in sum.iter_mut().zip(row) {
                *sum += value;
            }
        }
    }

    /// Entry (i, j), j <= i, before [`Self::factor`]; 0 outside the envelope.
    pub fn get(&self, i: usize, j: usize) -> f64 {
        let ((i, row), (j, column)) = (self.place[i], self.place[j]);
        if j < self.first[i] { 0.0 } else { self.blocks[self.offset[i] + j - self.first[i]][row][column] }
    }

    /// Original diagonal entry i and its pivot, after [`Self::factor`].
    pub fn diagonal_and_pivot(&self, i: usize) -> (f64, f64) {
        let (i, row) = self.place[i];
        let (before, own) = self.blocks[self.offset[i]..].split_at(i - self.first[i]);
        let pivot = 1.0 / (own[0][row][row] * own[0][row][row]);
        let entries = before.iter().flat_map(|block| &block[row]);
        let entries = entries.chain(&own[0][row][..row]);
        (entries.map(|l| l * l).sum::<f64>() + pivot, pivot)
    }

    /// Nonzero block columns of block row i before the diagonal.
    #[inline]
    fn coupled(&self, i: usize) -> &[usize] {
        &self.coupled[self.coupled_of[i]..self.coupled_of[i + 1]]
    }

    /// Factors in place. Returns the smallest ratio of a pivot to its diagonal entry: at or below rounding level, rows are
    /// dependent.
    pub fn factor(&mut self) -> f64 {
        let mut blocks = std::mem::take(&mut self.blocks);
        let mut least = f64::INFINITY;
        for (i, &size) in self.size.iter().enumerate() {
            let (above, row) = blocks.split_at_mut(self.offset[i]);
            let (first, coupled) = (self.first[i], self.coupled(i));
            let row = &mut row[..=i - first];
            for &j in coupled {
                let other_first = self.first[j];
                let other = &above[self.offset[j]..][..=j - other_first];
                let mut block = row[j - first];
                for &k in coupled {
                    if (other_first..j).contains(&k) {
                        subtract_product(&mut block, &row[k - first], &other[k - other_first]);
                    }
                }
                divide(&mut block, &other[j - other_first]);
                row[j - first] = block;
            }
            let mut block = row[i - first];
            let diagonal = [block[0][0], block[1][1], block[2][2]];
            for &k in coupled {
                let left = &row[k - first];
                subtract_product(&mut block, left, left);
            }
            let pivots = factor_block(&mut block, size);
            for (pivot, diagonal) in pivots.iter().zip(diagonal).take(size) {
                least = least.min(pivot / diagonal);
            }
            row[i - first] = block;
        }
        self.blocks = blocks;
        least
    }

    /// Solves A x = b in place.
    pub fn solve(&mut self, x: &mut [f64]) {
        let mut by_block = std::mem::take(&mut self.x);
        for (&(block, row), x) in self.place.iter().zip(&*x) {
            by_block[block][row] = *x;
        }
        for i in 0..by_block.len() {
            let row = &self.blocks[self.offset[i]..];
            let mut b = by_block[i];
            for &j in self.coupled(i) {
                let (block, x) = (&row[j - self.first[i]], by_block[j]);
                for r in 0..SIDE {
                    for c in 0..SIDE {
                        b[r] -= block[r][c] * x[c];
                    }
                }
            }
            let own = &row[i - self.first[i]];
            for r in 0..SIDE {
                for c in 0..r {
                    b[r] -= own[r][c] * b[c];
                }
                b[r] *= own[r][r];
            }
            by_block[i] = b;
        }
        for i in (0..by_block.len()).rev() {
            let row = &self.blocks[self.offset[i]..];
            let own = &row[i - self.first[i]];
            let mut b = by_block[i];
            for r in (0..SIDE).rev() {
                b[r] *= own[r][r];
                for c in 0..r {
                    b[c] -= own[r][c] * b[r];
                }
            }
            by_block[i] = b;
            for &j in self.coupled(i) {
                let (block, x) = (&row[j - self.first[i]], &mut by_block[j]);
                for r in (0..SIDE).rev() {
                    for c in 0..SIDE {
                        x[c] -= block[r][c] * b[r];
                    }
                }
            }
        }
        for (&(block, row), x) in self.place.iter().zip(x) {
            *x = by_block[block][row];
        }
        self.x = by_block;
    }
}

/// `block` -= L M^T.
#[inline]
fn subtract_product(block: &mut Block, l: &Block, m: &Block) {
    for r in 0..SIDE {
        for c in 0..SIDE {
            for k in 0..SIDE {
                block[r][c] -= l[r][k] * m[c][k];
            }
        }
    }
}

/// `block` = `block` L^-T for a lower triangle L from [`factor_block`].
#[inline]
fn divide(block: &mut Block, l: &Block) {
    for row in block {
        for c in 0..SIDE {
            for k in 0..c {
                row[c] -= row[k] * l[c][k];
            }
            row[c] *= l[c][c];
        }
    }
}

/// Cholesky factor of a block of `size` rows in place, with inverted diagonal entries because solves divide by them. Returns the
/// pivots.
#[inline]
fn factor_block(block: &mut Block, size: usize) -> [f64; SIDE] {
    let mut pivots = [1.0; SIDE];
    for r in 0..SIDE {
        if r < size {
            for c in 0..r {
                for k in 0..c {
                    block[r][c] -= block[r][k] * block[c][k];
                }
                block[r][c] *= block[c][c];
            }
            pivots[r] = block[r][r];
            for k in 0..r {
                pivots[r] -= block[r][k] * block[r][k];
            }
        }
        block[r][r] = 1.0 / pivots[r].max(0.0).sqrt();
    }
    pivots
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A symmetric, diagonally dominant matrix with the pattern's zeros.
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
    fn skyline_fills_in_where_it_must_and_skips_the_rest() {
        // Four legs of two joints: three rows of the first joint couple with no earlier rows, two of the second with those three
        // and with all rows of earlier second joints.
        let mut columns: Vec<Vec<usize>> = Vec::new();
        for leg in 0..4 {
            let second = (0..leg).flat_map(|other| 5 * other + 3..5 * other + 5);
            for row in 0..5 {
                let own = 5 * leg..5 * leg + row;
                columns.push(if row < 3 { own.collect() } else { second.clone().chain(own).collect() });
            }
        }
        let n = columns.len();
        let mut a = Skyline::new(columns.clone());
        assert_eq!(a.size, [3, 2, 3, 2, 3, 2, 3, 2]);
        assert!(a.coupled(6).is_empty());
        assert_eq!(a.coupled(7), [1, 3, 5, 6]);
        let mut dense = nalgebra::DMatrix::<f64>::identity(n, n) * 9.0;
        for i in 0..n {
            a.add(i, i, 9.0);
            for &j in &columns[i] {
                let value = libm::sin((i + 3 * j) as f64);
                a.add(i, j, value);
                dense[(i, j)] = value;
                dense[(j, i)] = value;
            }
        }
        let b = nalgebra::DVector::from_fn(n, |i, _| 1.0 + i as f64);
        let expected = dense.lu().solve(&b).unwrap();
        assert!(a.factor() > 0.1);
        assert!((a.diagonal_and_pivot(n - 1).0 - 9.0).abs() < 1e-14);
        let mut x = b;
        a.solve(x.as_mut_slice());
        assert!((x - expected).norm() < 1e-13);
        // The first column couples rows 2 and 3, which fill in the last row between its entries.
        let star = Skyline::new(vec![vec![], vec![], vec![0], vec![0], vec![1, 2]]);
        assert_eq!((star.coupled(3), star.coupled(4)), (&[0, 2][..], &[1, 2, 3][..]));
    }

    #[test]
    fn skyline_solves_a_banded_system() {
        let n = 12;
        let columns: Vec<_> = (0..n).map(|i: usize| (i.saturating_sub(2)..i).collect()).collect();
        let mut a = Skyline::new(columns);
        let mut dense = nalgebra::DMatrix::<f64>::zeros(n, n);
        for i in 0..n {
            for j in i.saturating_sub(2)..=i {
                let value = if i == j { 5.0 + i as f64 } else { 1.0 / (1.0 + i as f64 + j as f64) };
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
