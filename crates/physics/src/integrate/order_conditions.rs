//! Order conditions of every method, main and embedded, and of its interpolant, by rooted trees (Hairer, Nørsett & Wanner,
//! *Solving Ordinary Differential Equations I*, 2nd ed., II.2 and II.6).
//!
//! The Butcher tableaux are read from the running code: if the stage derivatives of a system are unit vectors, the states at
//! which the method evaluates, and its end state, are the rows of its tableau.

use super::*;

/// A rooted tree.
#[derive(Clone, Debug)]
struct Tree {
    children: Vec<Tree>,
}

impl Tree {
    fn order(&self) -> usize {
        1 + self.children.iter().map(Tree::order).sum::<usize>()
    }

    /// gamma(t): in the exact solution, its elementary differential has the factor 1 / gamma.
    fn density(&self) -> f64 {
        let children: f64 = self.children.iter().map(Tree::density).product();
        self.order() as f64 * children
    }

    /// Elementary weight of each stage.
    fn stages(&self, matrix: &[Vec<f64>]) -> Vec<f64> {
        let mut product = vec![1.0; matrix.len()];
        for child in &self.children {
            let child = child.stages(matrix);
            for (weight, row) in product.iter_mut().zip(matrix) {
                *weight *= dot(row, &child);
            }
        }
        product
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// All trees of at most `order` vertices.
fn trees(order: usize) -> Vec<Tree> {
    let mut all: Vec<Tree> = Vec::new();
    for n in 1..=order {
        let mut new = Vec::new();
        for children in forests(&all, n - 1, 0) {
            new.push(Tree { children });
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
    let mut multisets = Vec::new();
    for (i, tree) in all.iter().enumerate().skip(from) {
        if tree.order() <= vertices {
            for mut rest in forests(all, vertices - tree.order(), i) {
                rest.push(tree.clone());
                multisets.push(rest);
            }
        }
    }
    multisets
}

/// k_i = f(y + h sum a_ij k_j).
struct Tableau(Vec<Vec<f64>>);

impl Tableau {
    /// Largest violation of the conditions of each order up to `order` by the weights for the fraction `theta` of a step.
    fn defects(&self, weights: &[f64], theta: f64, order: usize) -> Vec<f64> {
        let mut worst = vec![0.0_f64; order];
        for tree in trees(order) {
            let n = tree.order();
            let expected = theta.powi(n as i32) / tree.density();
            let got = dot(weights, &tree.stages(&self.0));
            worst[n - 1] = worst[n - 1].max((got - expected).abs());
        }
        worst
    }

    /// Asserts that the weights have exactly this order, to rounding.
    fn assert_order(&self, what: &str, weights: &[f64], theta: f64, order: usize) {
        let defects = self.defects(weights, theta, order + 1);
        assert!(defects[..order].iter().all(|d| *d < ROUNDING), "{what}: {defects:?}");
        assert!(defects[order] > 1e-6, "{what}: more than {order}");
    }
}

/// Bound on the rounding error of some twenty products of tabulated coefficients.
const ROUNDING: f64 = 2e-14;
/// Fractions of a step at which interpolants are checked.
const PARTS: [f64; 4] = [0.13, 0.5, 0.77, 1.0];

/// Returns `slopes[n]` for the n-th evaluation, whatever the state.
struct Probe {
    slopes: Vec<Vec<f64>>,
    calls: usize,
    /// Times and states of the evaluations.
    evaluations: Vec<(f64, Vec<f64>)>,
    scale: Vec<f64>,
    all: Range<usize>,
}

impl Probe {
    fn new(slopes: Vec<Vec<f64>>) -> Self {
        let n = slopes[0].len();
        Self {
            slopes,
            // The first slope is passed in as the derivative at the start.
            calls: 1,
            evaluations: vec![(0.0, vec![0.0; n])],
            scale: vec![1.0; n],
            all: 0..n,
        }
    }

    /// Each stage a unit vector.
    fn units(stages: usize, dimension: usize) -> Self {
        let unit = |i: usize| (0..dimension).map(|j| f64::from(u8::from(i == j))).collect();
        Self::new((0..stages).map(unit).collect())
    }

    /// Rows of the coefficient matrix, whose sums are the times of the evaluations.
    fn rows(&self, stages: usize) -> Vec<Vec<f64>> {
        let rows: Vec<Vec<f64>> = self.evaluations.iter().map(|(_, y)| y[..stages].to_vec()).collect();
        for ((time, _), row) in self.evaluations.iter().zip(&rows) {
            let sum: f64 = row.iter().sum();
            assert!((time - sum).abs() < ROUNDING, "{time} {row:?}");
        }
        rows
    }
}

impl System for Probe {
    fn active_ranges(&self) -> &[Range<usize>] {
        std::slice::from_ref(&self.all)
    }
    fn derivative(&mut self, t: f64, y: &[f64], dy: &mut [f64]) {
        self.evaluations.push((t, y.to_vec()));
        dy.copy_from_slice(&self.slopes[self.calls]);
        self.calls += 1;
    }
    fn scale(&self) -> &[f64] {
        &self.scale
    }
}

/// Tableau and weights of an explicit method of this many stages; the last stage is the end if the method evaluates there.
fn explicit(stepper: &mut impl Stepper, stages: usize) -> (Tableau, Vec<f64>) {
    let mut probe = Probe::units(stages, stages);
    let k = probe.slopes[0].clone();
    let (y, mut end, mut k_end) = (vec![0.0; stages], vec![0.0; stages], vec![0.0; stages]);
    stepper.attempt(&mut probe, Step { t: 0.0, h: 1.0, y: &y, k: &k }, &mut end, &mut k_end);
    let mut rows = probe.rows(stages);
    if rows.len() < stages {
        rows.push(end.clone());
    }
    (Tableau(rows), end)
}

/// Error estimate where the stages are the elementary weights of a tree: zero up to the order of the embedded method.
fn estimate(tree: &Tree, tableau: &Tableau, attempt: impl FnOnce(&mut Probe, &[f64]) -> f64) -> f64 {
    let weights = tree.stages(&tableau.0);
    let mut probe = Probe::new(weights.iter().map(|w| vec![*w]).collect());
    let k = probe.slopes[0].clone();
    attempt(&mut probe, &k)
}

#[test]
fn the_numbers_of_trees_are_those_of_the_literature() {
    let count = |n: usize| {
        let all = trees(n);
        all.iter().filter(|t| t.order() == n).count()
    };
    assert_eq!([1, 2, 3, 4, 5].map(count), [1, 1, 2, 4, 9]);
}

#[test]
fn the_classical_runge_kutta_method_has_order_four_and_its_hermite_cubic_three() {
    let (tableau, weights) = explicit(&mut RungeKutta4::new(5), 5);
    tableau.assert_order("rk4", &weights, 1.0, 4);
    // The fifth stage is the derivative at the end.
    let unit = |i: usize| (0..5).map(|j| f64::from(u8::from(i == j))).collect::<Vec<f64>>();
    for theta in PARTS {
        let mut at = vec![0.0; 5];
        hermite(0..5, theta, Step { t: 0.0, h: 1.0, y: &[0.0; 5], k: &unit(0) }, &weights, &unit(4), &mut at);
        let defects = tableau.defects(&at, theta, 3);
        assert!(defects.iter().all(|d| *d < ROUNDING), "{theta}: {defects:?}");
    }
}

#[test]
fn dormand_prince_has_order_five_and_its_interpolant_and_embedded_method_four() {
    let mut stepper = DormandPrince::new(7);
    let (tableau, weights) = explicit(&mut stepper, 7);
    tableau.assert_order("dopri5", &weights, 1.0, 5);
    let k = Probe::units(7, 7).slopes[0].clone();
    for theta in PARTS {
        let mut at = vec![0.0; 7];
        stepper.interpolate(0..7, theta, Step { t: 0.0, h: 1.0, y: &[0.0; 7], k: &k }, &mut at);
        let defects = tableau.defects(&at, theta, 4);
        assert!(defects.iter().all(|d| *d < ROUNDING), "{theta}: {defects:?}");
    }
    let mut largest = [0.0_f64; 5];
    for tree in trees(5) {
        let error = estimate(&tree, &tableau, |probe, k| {
            let mut stepper = DormandPrince::new(1);
            stepper.attempt(probe, Step { t: 0.0, h: 1.0, y: &[0.0], k }, &mut [0.0], &mut [0.0])
        });
        let order = tree.order() - 1;
        largest[order] = largest[order].max(error);
    }
    assert!(largest[..4].iter().all(|e| *e < ROUNDING), "{largest:?}");
    assert!(largest[4] > 1e-6);
}

#[test]
fn radau_has_order_five_and_its_interpolant_and_embedded_method_three() {
    let (a, embedded) = radau::tableau();
    let tableau = Tableau(a.to_vec());
    for (c, row) in radau::C.iter().zip(&a) {
        assert!((c - row.iter().sum::<f64>()).abs() < ROUNDING);
    }
    tableau.assert_order("radau5", &a[2], 1.0, 5);
    for theta in PARTS {
        let at = radau::weights_within(theta, &a);
        let defects = tableau.defects(&at, theta, 3);
        assert!(defects.iter().all(|d| *d < ROUNDING), "{theta}: {defects:?}");
    }
    // The embedded method has the derivative at the start as an extra first stage.
    let mut rows = vec![vec![0.0; 4]];
    rows.extend(a.iter().map(|row| [&[0.0], &row[..]].concat()));
    Tableau(rows).assert_order("embedded", &embedded, 1.0, 3);
}
