//! Order conditions of every method, main and embedded, and of its interpolant, by rooted trees (Hairer, Nørsett & Wanner,
//! *Solving Ordinary Differential Equations I*, 2nd ed., II.2 and II.6; for methods that solve with a matrix that need
//! not be the Jacobian, Hairer & Wanner II, IV.7, W-methods).
//!
//! Butcher tableaux are read out of the running code: a system whose stage derivatives are unit vectors reveals them in the
//! states at which the method evaluates and in its end state.

use super::*;

/// A rooted tree. A fat vertex is a product with the method's matrix and has one son; a meagre one is a derivative of f.
#[derive(Clone, Debug)]
struct Tree {
    fat: bool,
    sons: Vec<Tree>,
}

impl Tree {
    fn order(&self) -> usize {
        1 + self.sons.iter().map(Tree::order).sum::<usize>()
    }

    /// gamma(t): in the exact solution, its elementary differential has the factor 1 / gamma.
    fn density(&self) -> f64 {
        let sons: f64 = self.sons.iter().map(Tree::density).product();
        self.order() as f64 * sons
    }

    fn has_fat(&self) -> bool {
        self.fat || self.sons.iter().any(Tree::has_fat)
    }

    /// Elementary weight of each stage.
    fn stages(&self, alpha: &[Vec<f64>], gamma: &[Vec<f64>]) -> Vec<f64> {
        let matrix = if self.fat { gamma } else { alpha };
        let mut product = vec![1.0; alpha.len()];
        for son in &self.sons {
            let son = son.stages(alpha, gamma);
            for (weight, row) in product.iter_mut().zip(matrix) {
                *weight *= dot(row, &son);
            }
        }
        product
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// All trees of at most `order` vertices, with fat vertices if `fat`.
fn trees(order: usize, fat: bool) -> Vec<Tree> {
    let mut all: Vec<Tree> = Vec::new();
    for n in 1..=order {
        let mut new = Vec::new();
        for sons in forests(&all, n - 1, 0) {
            if fat && sons.len() == 1 {
                let sons = sons.clone();
                new.push(Tree { fat: true, sons });
            }
            new.push(Tree { fat: false, sons });
        }
        all.extend(new);
    }
    all
}

/// All multisets of trees from `all[from..]` with this many vertices in total.
fn forests(all: &[Tree], vertices: usize, from: usize) -> Vec<Vec<Tree>> {
    if vertices == 0 {
        return vec![Vec::new()];
    }
    let mut found = Vec::new();
    for (i, tree) in all.iter().enumerate().skip(from) {
        if tree.order() <= vertices {
            for mut rest in forests(all, vertices - tree.order(), i) {
                rest.push(tree.clone());
                found.push(rest);
            }
        }
    }
    found
}

/// k_i = f(y + h sum alpha_ij k_j) + h J sum gamma_ij k_j.
struct Tableau {
    alpha: Vec<Vec<f64>>,
    gamma: Vec<Vec<f64>>,
}

impl Tableau {
    /// Tableau without matrix products.
    fn plain(alpha: Vec<Vec<f64>>) -> Self {
        let gamma = vec![vec![0.0; alpha.len()]; alpha.len()];
        Self { alpha, gamma }
    }

    /// Largest violation of the conditions of each order up to `order` by the weights for the fraction `theta` of a step.
    fn defects(&self, weights: &[f64], theta: f64, order: usize, fat: bool) -> Vec<f64> {
        let mut worst = vec![0.0_f64; order];
        for tree in trees(order, fat) {
            let n = tree.order();
            let wanted = if tree.has_fat() { 0.0 } else { theta.powi(n as i32) / tree.density() };
            let got = dot(weights, &tree.stages(&self.alpha, &self.gamma));
            worst[n - 1] = worst[n - 1].max((got - wanted).abs());
        }
        worst
    }

    /// Asserts that the weights have exactly this order, to rounding.
    fn assert_order(&self, what: &str, weights: &[f64], theta: f64, order: usize, fat: bool) {
        let defects = self.defects(weights, theta, order + 1, fat);
        assert!(defects[..order].iter().all(|d| *d < ROUNDING), "{what}: {defects:?}");
        assert!(defects[order] > 1e-6, "{what}: more than {order}");
    }
}

/// Bound on the rounding error of some twenty products of tabulated coefficients.
const ROUNDING: f64 = 2e-14;
/// Fractions of a step at which interpolants are checked.
const PARTS: [f64; 4] = [0.13, 0.5, 0.77, 1.0];

/// Returns `slopes[n]` for the n-th evaluation, whatever the state. Its matrix, if used, adds the first half of the components to
/// the second.
struct Probe {
    slopes: Vec<Vec<f64>>,
    calls: usize,
    /// Times and states of the evaluations.
    asked: Vec<(f64, Vec<f64>)>,
    scale: Vec<f64>,
    all: Range<usize>,
    shift: f64,
    zero: Vec<f64>,
}

impl Probe {
    fn new(slopes: Vec<Vec<f64>>) -> Self {
        let n = slopes[0].len();
        Self {
            slopes,
            // The first slope is passed in as the derivative at the start.
            calls: 1,
            asked: vec![(0.0, vec![0.0; n])],
            scale: vec![1.0; n],
            all: 0..n,
            shift: 0.0,
            zero: vec![0.0; n],
        }
    }

    /// Each stage a unit vector.
    fn units(stages: usize, dimension: usize) -> Self {
        let unit = |i: usize| (0..dimension).map(|j| f64::from(u8::from(i == j))).collect();
        Self::new((0..stages).map(unit).collect())
    }

    /// Rows of the coefficient matrix, whose sums are the times of the evaluations.
    fn rows(&self, stages: usize) -> Vec<Vec<f64>> {
        let rows: Vec<Vec<f64>> = self.asked.iter().map(|(_, y)| y[..stages].to_vec()).collect();
        for ((time, _), row) in self.asked.iter().zip(&rows) {
            let sum: f64 = row.iter().sum();
            assert!((time - sum).abs() < ROUNDING, "{time} {row:?}");
        }
        rows
    }
}

impl System for Probe {
    fn dimension(&self) -> usize {
        self.zero.len()
    }
    fn positions(&self) -> usize {
        0
    }
    fn moving(&self) -> &[Range<usize>] {
        std::slice::from_ref(&self.all)
    }
    fn derivative(&mut self, t: f64, y: &[f64], dy: &mut [f64]) {
        self.asked.push((t, y.to_vec()));
        dy.copy_from_slice(&self.slopes[self.calls]);
        self.calls += 1;
    }
    fn position_rate(&mut self, _t: f64, _y: &[f64], _dy: &mut [f64]) {}
    fn scale(&self) -> &[f64] {
        &self.scale
    }
}

impl StiffSystem for Probe {
    fn linearise(&mut self, _t: f64, _y: &[f64]) {}
    fn factor_shifted(&mut self, shift: f64) {
        self.shift = shift;
    }
    fn solve_shifted(&mut self, b: &mut [f64]) {
        let half = b.len() / 2;
        for i in 0..b.len() {
            b[i] /= self.shift;
            if i >= half && b.len() > 1 {
                b[i] += b[i - half] / self.shift;
            }
        }
    }
    fn factor_shifted_pair(&mut self, _real: f64, _imaginary: f64) {}
    fn solve_shifted_pair(&mut self, _b_real: &mut [f64], _b_imaginary: &mut [f64]) {}
    fn time_derivative(&self) -> &[f64] {
        &self.zero
    }
}

/// Tableau and weights of an explicit method of this many stages; the last stage is the end if the method evaluates there.
fn explicit(stepper: &mut impl Stepper, stages: usize) -> (Tableau, Vec<f64>) {
    let mut probe = Probe::units(stages, stages);
    let k = probe.slopes[0].clone();
    let (y, mut end, mut k_end) = (vec![0.0; stages], vec![0.0; stages], vec![0.0; stages]);
    stepper.attempt(&mut probe, 0.0, 1.0, &y, &k, &mut end, &mut k_end);
    let mut rows = probe.rows(stages);
    if rows.len() < stages {
        rows.push(end.clone());
    }
    (Tableau::plain(rows), end)
}

/// Error estimate where the stages are the elementary weights of a tree: zero up to the order of the embedded method.
fn estimate(tree: &Tree, tableau: &Tableau, attempt: impl FnOnce(&mut Probe, &[f64]) -> f64) -> f64 {
    let weights = tree.stages(&tableau.alpha, &tableau.gamma);
    let mut probe = Probe::new(weights.iter().map(|w| vec![*w]).collect());
    let k = probe.slopes[0].clone();
    attempt(&mut probe, &k)
}

#[test]
fn there_are_as_many_trees_as_the_books_count() {
    let count = |fat: bool, n: usize| {
        let all = trees(n, fat);
        all.iter().filter(|t| t.order() == n).count()
    };
    assert_eq!([1, 2, 3, 4, 5].map(|n| count(false, n)), [1, 1, 2, 4, 9]);
    // W-methods: 1, 3 and 8 conditions in all for the orders 1, 2 and 3 (Hairer & Wanner II, Table IV.7.1).
    assert_eq!([1, 2, 3].map(|n| trees(n, true).len()), [1, 3, 8]);
}

#[test]
fn kutta_has_order_four_and_the_cubic_through_its_ends_three() {
    let (tableau, weights) = explicit(&mut RungeKutta4::new(5), 5);
    tableau.assert_order("rk4", &weights, 1.0, 4, false);
    // The fifth stage is the derivative at the end.
    let unit = |i: usize| (0..5).map(|j| f64::from(u8::from(i == j))).collect::<Vec<f64>>();
    for theta in PARTS {
        let mut at = vec![0.0; 5];
        hermite(theta, 1.0, &[0.0; 5], &unit(0), &weights, &unit(4), &mut at);
        let defects = tableau.defects(&at, theta, 3, false);
        assert!(defects.iter().all(|d| *d < ROUNDING), "{theta}: {defects:?}");
    }
}

#[test]
fn dormand_and_prince_have_order_five_four_inside_and_four_embedded() {
    let mut stepper = DormandPrince::new(7);
    let (tableau, weights) = explicit(&mut stepper, 7);
    tableau.assert_order("dopri5", &weights, 1.0, 5, false);
    let k = Probe::units(7, 7).slopes[0].clone();
    for theta in PARTS {
        let mut at = vec![0.0; 7];
        stepper.interpolate(0..7, theta, 1.0, &[0.0; 7], &k, &mut at);
        let defects = tableau.defects(&at, theta, 4, false);
        assert!(defects.iter().all(|d| *d < ROUNDING), "{theta}: {defects:?}");
    }
    let mut largest = [0.0_f64; 5];
    for tree in trees(5, false) {
        let error = estimate(&tree, &tableau, |probe, k| {
            let mut stepper = DormandPrince::new(1);
            stepper.attempt(probe, 0.0, 1.0, &[0.0], k, &mut [0.0], &mut [0.0])
        });
        let order = tree.order() - 1;
        largest[order] = largest[order].max(error);
    }
    assert!(largest[..4].iter().all(|e| *e < ROUNDING), "{largest:?}");
    assert!(largest[4] > 1e-6);
}

#[test]
fn ros34pw2_has_order_three_with_any_matrix_and_two_embedded() {
    let tableau = Tableau {
        alpha: rosenbrock::ALPHA_IJ.map(|row| row.to_vec()).to_vec(),
        gamma: rosenbrock::GAMMA_IJ.map(|row| row.to_vec()).to_vec(),
    };
    let (weights, embedded) = (rosenbrock::WEIGHTS, rosenbrock::EMBEDDED);
    tableau.assert_order("main", &weights, 1.0, 3, true);
    tableau.assert_order("embedded", &embedded, 1.0, 2, true);
    // Stiffly accurate, both: the last row of alpha + gamma is the weights, which makes the method exact in the limit of
    // an infinitely stiff component.
    for j in 0..4 {
        let last = tableau.alpha[3][j] + tableau.gamma[3][j];
        assert!((last - weights[j]).abs() < ROUNDING, "{j}");
    }
    // With the derivative at the end as an extra stage: the cubic through both ends.
    let mut longer = Tableau::plain(tableau.alpha.clone());
    longer.gamma.clone_from(&tableau.gamma);
    for rows in [&mut longer.alpha, &mut longer.gamma] {
        rows.iter_mut().for_each(|row| row.push(0.0));
    }
    longer.alpha.push([&weights[..], &[0.0]].concat());
    longer.gamma.push(vec![0.0; 5]);
    let unit = |i: usize| (0..5).map(|j| f64::from(u8::from(i == j))).collect::<Vec<f64>>();
    // f at the start is k_1 minus its product with the matrix: for trees without fat vertices the two are the same.
    for theta in PARTS {
        let mut at = vec![0.0; 5];
        let end = [&weights[..], &[0.0]].concat();
        hermite(theta, 1.0, &[0.0; 5], &unit(0), &end, &unit(4), &mut at);
        let defects = longer.defects(&at, theta, 3, false);
        assert!(defects.iter().all(|d| *d < ROUNDING), "{theta}: {defects:?}");
    }
}

#[test]
fn the_code_of_ros34pw2_is_its_tableau() {
    // Four stages, the end; the second half of the components receives the products with the matrix.
    let mut probe = Probe::units(5, 8);
    let k = probe.slopes[0].clone();
    let (mut end, mut k_end) = (vec![0.0; 8], vec![0.0; 8]);
    let mut stepper = Rosenbrock::new(8);
    stepper.attempt(&mut probe, 0.0, 1.0, &[0.0; 8], &k, &mut end, &mut k_end);
    let rows = probe.rows(4);
    let through_gamma = |row: &[f64], j: usize| -> f64 { (0..4).map(|i| row[i] * rosenbrock::GAMMA_IJ[i][j]).sum() };
    for (i, row) in rosenbrock::ALPHA_IJ.iter().enumerate() {
        for j in 0..4 {
            assert!((rows[i][j] - row[j]).abs() < ROUNDING, "alpha {i} {j}");
            let product = probe.asked[i].1[4 + j];
            assert!((product - through_gamma(row, j)).abs() < ROUNDING, "{i} {j}");
        }
    }
    for j in 0..4 {
        let weights = rosenbrock::WEIGHTS;
        assert!((end[j] - weights[j]).abs() < ROUNDING, "weight {j}");
        assert!((end[4 + j] - through_gamma(&weights, j)).abs() < ROUNDING);
    }
    // The estimate is the difference from the embedded solution: zero up to its order.
    let tableau = Tableau::plain(rosenbrock::ALPHA_IJ.map(|row| row.to_vec()).to_vec());
    for tree in trees(3, false) {
        let error = estimate(&tree, &tableau, |probe, k| {
            probe.slopes.push(vec![0.0]);
            Rosenbrock::new(1).attempt(probe, 0.0, 1.0, &[0.0], k, &mut [0.0], &mut [0.0])
        });
        assert_eq!(error < ROUNDING, tree.order() <= 2, "{tree:?}: {error:e}");
    }
}

#[test]
fn radau_has_order_five_three_inside_and_three_embedded() {
    let (a, embedded) = radau::tableau();
    let tableau = Tableau::plain(a.to_vec());
    for (c, row) in radau::C.iter().zip(&a) {
        assert!((c - row.iter().sum::<f64>()).abs() < ROUNDING);
    }
    tableau.assert_order("radau5", &a[2], 1.0, 5, false);
    for theta in PARTS {
        let at = radau::weights_within(theta, &a);
        let defects = tableau.defects(&at, theta, 3, false);
        assert!(defects.iter().all(|d| *d < ROUNDING), "{theta}: {defects:?}");
    }
    // The embedded method has the derivative at the start as an extra first stage.
    let mut rows = vec![vec![0.0; 4]];
    rows.extend(a.iter().map(|row| [&[0.0], &row[..]].concat()));
    Tableau::plain(rows).assert_order("embedded", &embedded, 1.0, 3, false);
}

/// q' = v, v' = a.
struct Falling(f64);

impl System for Falling {
    fn dimension(&self) -> usize {
        2
    }
    fn positions(&self) -> usize {
        1
    }
    fn moving(&self) -> &[Range<usize>] {
        std::slice::from_ref(&(0..2))
    }
    fn derivative(&mut self, _t: f64, y: &[f64], dy: &mut [f64]) {
        dy.copy_from_slice(&[y[1], self.0]);
    }
    fn position_rate(&mut self, _t: f64, y: &[f64], dy: &mut [f64]) {
        dy[0] = y[1];
    }
    fn scale(&self) -> &[f64] {
        &[1.0, 1.0]
    }
}

#[test]
fn semi_implicit_euler_meets_the_conditions_of_order_one_and_no_more() {
    let h = 0.25;
    for (v, a) in [(1.0, 0.0), (0.0, 1.0)] {
        let (y, k) = ([0.0, v], [v, a]);
        let mut end = [0.0; 2];
        let mut system = Falling(a);
        SemiImplicitEuler::new(2).attempt(&mut system, 0.0, h, &y, &k, &mut end, &mut [0.0; 2]);
        // The position uses the velocity at the end: h^2 a, twice the exact contribution.
        assert_eq!(end, [h * v + h * h * a, v + h * a]);
    }
}
