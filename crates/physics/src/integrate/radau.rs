//! Radau IIA with three stages: implicit, order 5, stiffly accurate, L-stable, stage order 3
//! (Hairer & Wanner, *Solving Ordinary Differential Equations II*, 2nd ed., IV.8; coefficients of Table IV.5.6).
//!
//! Unlike a linearly implicit method it iterates: with a stiff contact on a curved path, a linearised step misses the contact by
//! (h v)^2 / (2 L), more than a settled penetration at steps of a millisecond.

use serde::{Deserialize, Serialize};

use super::{Step, StiffSystem, copy, largest};
use std::ops::Range;

const SQRT6: f64 = 2.449_489_742_783_178;
pub(super) const C: [f64; 3] = [(4.0 - SQRT6) / 10.0, (4.0 + SQRT6) / 10.0, 1.0];
/// Weights of the stages in the embedded error estimate.
const ERROR: [f64; 3] = [-(13.0 + 7.0 * SQRT6) / 3.0, (-13.0 + 7.0 * SQRT6) / 3.0, -1.0 / 3.0];
/// Eigenvalues of the inverse of the coefficient matrix: one real, one complex pair.
const REAL: f64 = 3.637_834_252_744_496;
const PAIR: (f64, f64) = (2.681_082_873_627_752, 3.050_430_199_247_411);
/// Transformation to those eigenvalues, and its inverse.
const T: [[f64; 3]; 3] = [
    [0.091_232_394_870_892_94, -0.141_255_295_020_954_2, -0.030_029_194_105_147_424],
    [0.241_717_932_707_107, 0.204_129_352_293_799_93, 0.382_942_112_757_261_9],
    [0.966_048_182_615_093, 1.0, 0.0],
];
const T_INVERSE: [[f64; 3]; 3] = [
    [4.325_579_890_063_155, 0.339_199_251_815_809_87, 0.541_770_539_935_874_9],
    [-4.178_718_591_551_905, -0.327_682_820_761_062_4, 0.476_623_554_500_550_45],
    [-0.502_872_634_945_786_9, 2.571_926_949_855_605, -0.596_039_204_828_224_9],
];
const MAX_ITERATIONS: u32 = 7;
/// Largest step ratio at which the previous step's polynomial still predicts the next step.
const MAX_STEP_RATIO: f64 = 10.0;
/// Contraction rate targeted by the step size (Gustafsson & Söderlind, SIAM J. Sci. Comput. 18, 1997): the rate is about
/// proportional to the step, and steps chosen by their error alone grow until every other iteration fails.
const TARGET_CONTRACTION: f64 = 0.5;
/// After a failed iteration, steps are limited to the fraction `STEP_AFTER_FAILURE` of the failed one. The limit grows by the
/// factor `LIMIT_GROWTH` per step until an iteration contracts faster than `FAST_CONTRACTION`.
const STEP_AFTER_FAILURE: f64 = 0.5;
const LIMIT_GROWTH: f64 = 1.3;
const FAST_CONTRACTION: f64 = 0.05;
/// Fraction of the allowed error that the iteration may leave (Hairer & Wanner II, IV.8).
const ITERATION_ERROR: f64 = 0.03;

/// Collocation polynomial of the latest attempt: its interpolant, and the starting guess for the next one. It belongs to the
/// state of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Polynomial {
    /// Step size, s; 0 if there is none.
    h: f64,
    /// End of the step, s.
    end: f64,
    /// Increments of the three stages.
    z: [Vec<f64>; 3],
    /// theta / (1 - theta) of the latest iteration that gave an estimate of its contraction rate theta.
    contraction: f64,
    /// Limit on the step after a failed iteration, s.
    held: Option<f64>,
}

impl Polynomial {
    /// No polynomial yet, for `dimension` components.
    pub fn new(dimension: usize) -> Self {
        let z = std::array::from_fn(|_| vec![0.0; dimension]);
        Self { h: 0.0, end: 0.0, z, contraction: 1.0, held: None }
    }

    /// Whether the polynomial has `dimension` components.
    pub fn fits(&self, dimension: usize) -> bool {
        self.z.iter().all(|z| z.len() == dimension)
    }

    /// Discards the latest step after a change of state that is not a step.
    pub fn clear(&mut self) {
        self.h = 0.0;
        self.contraction = 1.0;
        self.held = None;
    }

    /// Truncates the latest attempt to the fraction `theta` of its length, with the same polynomial.
    pub fn truncate(&mut self, theta: f64) {
        let n = self.z[0].len();
        for i in 0..n {
            let dense_output = DenseOutput::of(&std::array::from_fn(|j| self.z[j][i]));
            for j in 0..3 {
                self.z[j][i] = dense_output.at(C[j] * theta - 1.0);
            }
        }
        self.end -= (1.0 - theta) * self.h;
        self.h *= theta;
    }

    /// Components `part` of the state at fraction `theta` of the latest attempt, which began at `y`.
    pub fn interpolate(&self, part: Range<usize>, theta: f64, y: &[f64], out: &mut [f64]) {
        let y = &y[part.clone()];
        let z = self.z.each_ref().map(|z| &z[part.clone()]);
        for (i, out) in out[part].iter_mut().enumerate() {
            *out = y[i] + DenseOutput::of(&z.map(|z| z[i])).at(theta - 1.0);
        }
    }

    /// Stores the attempt of size `h` from `t` with the stage increments `z`.
    fn store(&mut self, active_ranges: &[Range<usize>], t: f64, h: f64, z: &[Vec<f64>; 3]) {
        for (to, z) in self.z.iter_mut().zip(z) {
            copy(active_ranges, to, z);
        }
        self.h = h;
        self.end = t + h;
    }
}

/// Radau IIA(5).
pub struct Radau {
    /// Stage increments Z and their transforms W.
    z: [Vec<f64>; 3],
    w: [Vec<f64>; 3],
    f: [Vec<f64>; 3],
    stage: Vec<f64>,
    error: Vec<f64>,
    linearised_at: Option<f64>,
    /// Largest contraction rate seen in the latest attempt; 0 if none was measured.
    contraction: f64,
    growth: f64,
    factorisations: u32,
}

impl Radau {
    /// Interior nodes within a step; the third node is the end. Interpolation of a quantity through them has the order of the
    /// step.
    pub(crate) const INTERIOR: [f64; 2] = [C[0], C[1]];

    /// Stepper for `dimension` components.
    pub fn new(dimension: usize) -> Self {
        let triple = || std::array::from_fn(|_| vec![0.0; dimension]);
        Self {
            z: triple(),
            w: triple(),
            f: triple(),
            stage: vec![0.0; dimension],
            error: vec![0.0; dimension],
            linearised_at: None,
            contraction: 0.0,
            growth: f64::INFINITY,
            factorisations: 0,
        }
    }

    /// Discards the Jacobian after a change of state that is not a step.
    pub fn invalidate(&mut self) {
        self.linearised_at = None;
    }

    /// As [`super::Stepper::attempt`]; `tolerance` also sets the convergence target of the iteration. Infinite if that fails.
    /// `previous` is the polynomial of the previous attempt, and then of this one.
    pub fn attempt<S: StiffSystem>(
        &mut self,
        system: &mut S,
        step: Step<'_>,
        y_end: &mut [f64],
        k_end: &mut [f64],
        tolerance: f64,
        previous: &mut Polynomial,
    ) -> f64 {
        let Step { t, h, y, k } = step;
        self.factorisations = 0;
        if self.set_initial_guess(system.active_ranges(), t, h, previous) {
            self.linearise_within(system, t, h, y);
        } else {
            if self.linearised_at != Some(t) {
                system.linearise(t, y, REAL / h);
                self.linearised_at = Some(t);
            }
            self.factor(system, h);
        }
        let converged = self.iterate(system, t, h, y, tolerance, previous);
        self.growth = TARGET_CONTRACTION / self.contraction;
        if !converged {
            previous.held = Some(STEP_AFTER_FAILURE * h);
            return f64::INFINITY;
        }
        if (f64::MIN_POSITIVE..FAST_CONTRACTION).contains(&self.contraction) {
            previous.held = None;
        } else if let Some(held) = &mut previous.held {
            *held *= LIMIT_GROWTH;
            self.growth = self.growth.min(*held / h);
        }
        add(system.active_ranges(), y_end, y, &self.z[2]);
        let error = self.estimate(system, t, h, y, k, tolerance);
        system.derivative(t + h, y_end, k_end);
        // A diverged attempt is no guess for the next one.
        if error.is_finite() {
            previous.store(system.active_ranges(), t, h, &self.z);
        }
        error
    }

    /// Step-size factor requested by the iteration of the latest attempt; infinite if there is no request.
    pub fn growth(&self) -> f64 {
        self.growth
    }

    /// Number of factorisations in the latest attempt.
    pub(crate) fn factorisations(&self) -> u32 {
        self.factorisations
    }

    /// Starting guess for the stages: the extrapolated polynomial of the previous step, or that of a longer attempt from the same
    /// point. Returns true for the former; an earlier attempt may have failed by diverging.
    fn set_initial_guess(&mut self, active_ranges: &[Range<usize>], t: f64, h: f64, previous: &Polynomial) -> bool {
        let repeats = previous.h > 0.0 && (previous.end - previous.h - t).abs() <= 1e-9 * h;
        let continues = previous.h > 0.0 && (previous.end - t).abs() <= 1e-9 * h && h <= MAX_STEP_RATIO * previous.h;
        if !repeats && !continues {
            for j in 0..3 {
                self.z[j].fill(0.0);
                self.w[j].fill(0.0);
            }
            return false;
        }
        let ratio = h / previous.h;
        // The polynomial is in s = (time - step's end) / h_previous and gives increments from its own start.
        let from = if repeats { -1.0 } else { 0.0 };
        let at = C.map(|c| from + c * ratio);
        for part in active_ranges {
            let increments = previous.z.each_ref().map(|z| &z[part.clone()]);
            let [z1, z2, z3] = self.z.each_mut().map(|z| &mut z[part.clone()]);
            let [w1, w2, w3] = self.w.each_mut().map(|w| &mut w[part.clone()]);
            for i in 0..part.len() {
                let dense_output = DenseOutput::of(&increments.map(|z| z[i]));
                let start = dense_output.at(from);
                let z = at.map(|s| dense_output.at(s) - start);
                [z1[i], z2[i], z3[i]] = z;
                [w1[i], w2[i], w3[i]] = multiply(&T_INVERSE, &z);
            }
        }
        !repeats
    }

    /// Evaluates the Jacobian at the current estimate of the second stage. Where a contact normal turns within the step, a
    /// Jacobian from the start fits the end badly. This one serves all three stages, and the order of the method does not depend
    /// on it.
    fn linearise_within<S: StiffSystem>(&mut self, system: &mut S, t: f64, h: f64, y: &[f64]) {
        add(system.active_ranges(), &mut self.stage, y, &self.z[1]);
        system.linearise(t + C[1] * h, &self.stage, REAL / h);
        self.linearised_at = None;
        self.factor(system, h);
    }

    /// Factors the matrices of the stages.
    fn factor<S: StiffSystem>(&mut self, system: &mut S, h: f64) {
        system.factor_shifted(REAL / h);
        system.factor_shifted_pair(PAIR.0 / h, PAIR.1 / h);
        self.factorisations += 1;
    }

    /// Simplified Newton iteration on the transformed stages. Returns whether it converged.
    fn iterate<S: StiffSystem>(
        &mut self,
        system: &mut S,
        t: f64,
        h: f64,
        y: &[f64],
        tolerance: f64,
        previous: &mut Polynomial,
    ) -> bool {
        // The iteration error must be well below the step error.
        let target = (10.0 * f64::EPSILON / tolerance).max(tolerance.sqrt().min(ITERATION_ERROR));
        let (real, alpha, beta) = (REAL / h, PAIR.0 / h, PAIR.1 / h);
        // After fast convergence in previous steps, one iteration may be enough; that trust decays (Hairer & Wanner II, IV.8).
        let expected = libm::pow(previous.contraction.max(f64::EPSILON), 0.8);
        previous.contraction = expected;
        self.contraction = 0.0;
        let mut previous_size = 0.0;
        let mut has_new_jacobian = false;
        system.prepare_times(&C.map(|c| t + c * h));
        for iteration in 0..MAX_ITERATIONS {
            for j in 0..3 {
                add(system.active_ranges(), &mut self.stage, y, &self.z[j]);
                system.derivative(t + C[j] * h, &self.stage, &mut self.f[j]);
            }
            for part in system.active_ranges() {
                let [f1, f2, f3] = self.f.each_mut().map(|f| &mut f[part.clone()]);
                let [w1, w2, w3] = self.w.each_ref().map(|w| &w[part.clone()]);
                for i in 0..part.len() {
                    let a = multiply(&T_INVERSE, &[f1[i], f2[i], f3[i]]);
                    f1[i] = a[0] - real * w1[i];
                    f2[i] = a[1] - alpha * w2[i] + beta * w3[i];
                    f3[i] = a[2] - alpha * w3[i] - beta * w2[i];
                }
            }
            let [f1, f2, f3] = &mut self.f;
            system.solve_shifted(f1);
            system.solve_shifted_pair(f2, f3);
            let mut size: f64 = 0.0;
            for part in system.active_ranges() {
                let scale = &system.scale()[part.clone()];
                let [f1, f2, f3] = self.f.each_ref().map(|f| &f[part.clone()]);
                let [w1, w2, w3] = self.w.each_mut().map(|w| &mut w[part.clone()]);
                let [z1, z2, z3] = self.z.each_mut().map(|z| &mut z[part.clone()]);
                for i in 0..part.len() {
                    let f = [f1[i], f2[i], f3[i]];
                    let w = [w1[i] + f[0], w2[i] + f[1], w3[i] + f[2]];
                    [w1[i], w2[i], w3[i]] = w;
                    [z1[i], z2[i], z3[i]] = multiply(&T, &w);
                    let largest = 0.0_f64.max(f[0].abs()).max(f[1].abs()).max(f[2].abs());
                    let relative = largest / (tolerance * scale[i]);
                    if relative > size || relative.is_nan() {
                        size = relative;
                    }
                }
            }
            if !size.is_finite() {
                return false;
            }
            if iteration == 0 {
                if expected * size <= target {
                    return true;
                }
            } else {
                let theta = size / previous_size;
                // Corrections at rounding level do not shrink further.
                if size <= 0.1 * target {
                    return true;
                }
                self.contraction = self.contraction.max(theta);
                let mut fails = theta >= 0.99;
                if !fails {
                    previous.contraction = theta / (1.0 - theta);
                    let remaining_error = previous.contraction * size;
                    if remaining_error <= target {
                        return true;
                    }
                    let remaining_iterations = (MAX_ITERATIONS - 1 - iteration) as i32;
                    fails = remaining_error * theta.powi(remaining_iterations) > target;
                }
                if fails {
                    // A contracting iteration is closer to the solution: with a new Jacobian there it usually converges, at less
                    // cost than another attempt.
                    if has_new_jacobian || theta > 1.0 {
                        return false;
                    }
                    has_new_jacobian = true;
                    self.linearise_within(system, t, h, y);
                }
            }
            previous_size = size;
        }
        false
    }

    /// Embedded error estimate of order 3, filtered through the real factor so that stiff components do not inflate it.
    fn estimate<S: StiffSystem>(
        &mut self,
        system: &mut S,
        t: f64,
        h: f64,
        y: &[f64],
        k: &[f64],
        tolerance: f64,
    ) -> f64 {
        copy(system.active_ranges(), &mut self.error, k);
        self.add_weighted(system.active_ranges(), h);
        system.solve_shifted(&mut self.error);
        let mut error = largest(system.active_ranges(), &self.error, system.scale());
        if error > tolerance {
            add(system.active_ranges(), &mut self.stage, y, &self.error);
            system.derivative(t, &self.stage, &mut self.error);
            self.add_weighted(system.active_ranges(), h);
            system.solve_shifted(&mut self.error);
            error = largest(system.active_ranges(), &self.error, system.scale());
        }
        error
    }

    /// Adds the stages' part of the estimate to the derivative in `error`.
    fn add_weighted(&mut self, active_ranges: &[Range<usize>], h: f64) {
        for part in active_ranges {
            let [z1, z2, z3] = self.z.each_ref().map(|z| &z[part.clone()]);
            for (i, error) in self.error[part.clone()].iter_mut().enumerate() {
                *error += (ERROR[0] * z1[i] + ERROR[1] * z2[i] + ERROR[2] * z3[i]) / h;
            }
        }
    }
}

/// `out` = y + z, over `parts`.
fn add(parts: &[Range<usize>], out: &mut [f64], y: &[f64], z: &[f64]) {
    for part in parts {
        let [y, z] = [y, z].map(|x| &x[part.clone()]);
        for ((out, y), z) in out[part.clone()].iter_mut().zip(y).zip(z) {
            *out = y + z;
        }
    }
}

/// m x.
#[inline(always)]
fn multiply(m: &[[f64; 3]; 3], x: &[f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2])
}

/// Increment of one component from the step's start: the cubic through 0 and the three stages, in Newton's form.
struct DenseOutput([f64; 4]);

impl DenseOutput {
    const NODES: [f64; 2] = [C[0] - 1.0, C[1] - 1.0];

    #[inline(always)]
    fn of(z: &[f64; 3]) -> Self {
        let (c1, c2) = (C[0], C[1]);
        let a1 = (z[1] - z[2]) / Self::NODES[1];
        let slope = (z[0] - z[1]) / (c1 - c2);
        let a3 = (slope - z[0] / c1) / c2;
        let a2 = (slope - a1) / Self::NODES[0];
        Self([z[2], a1, a2, a2 - a3])
    }

    /// At s = (time - step's end) / h.
    #[inline(always)]
    fn at(&self, s: f64) -> f64 {
        let [a0, a1, a2, a3] = self.0;
        a0 + s * (a1 + (s - Self::NODES[1]) * (a2 + (s - Self::NODES[0]) * a3))
    }
}

/// Coefficient matrix behind the transformation, and the embedded weights, the first of which is for the derivative at the start.
#[cfg(test)]
pub(super) fn tableau() -> ([Vec<f64>; 3], [f64; 4]) {
    use nalgebra::Matrix3;
    let matrix = |m: &[[f64; 3]; 3]| Matrix3::from_fn(|i, j| m[i][j]);
    let (alpha, beta) = PAIR;
    let values = Matrix3::new(REAL, 0.0, 0.0, 0.0, alpha, -beta, 0.0, beta, alpha);
    let inverse = matrix(&T) * values * matrix(&T_INVERSE);
    let a = inverse.try_inverse().expect("Radau's matrix is regular");
    let rows = std::array::from_fn(|i| a.row(i).iter().copied().collect::<Vec<f64>>());
    // The estimate is (f(y) + sum ERROR_i z_i / h) h / REAL, with z = h A f.
    let mut embedded = [1.0 / REAL, 0.0, 0.0, 0.0];
    for j in 0..3 {
        let shift: f64 = (0..3).map(|i| ERROR[i] * a[(i, j)]).sum();
        embedded[j + 1] = a[(2, j)] + shift / REAL;
    }
    (rows, embedded)
}

/// Weights of the stages' derivatives in the collocation polynomial at the fraction `theta` of a step.
#[cfg(test)]
pub(super) fn weights_within(theta: f64, a: &[Vec<f64>; 3]) -> Vec<f64> {
    let unit = |i: usize| std::array::from_fn(|j| f64::from(u8::from(i == j)));
    let mut weights = vec![0.0; 3];
    for (i, row) in a.iter().enumerate() {
        let part = DenseOutput::of(&unit(i)).at(theta - 1.0);
        for (weight, a) in weights.iter_mut().zip(row) {
            *weight += part * a;
        }
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::System;
    use nalgebra::{Complex, Matrix2, Vector2};

    /// Van der Pol's oscillator in Lienard's form, stiff for small `epsilon`; here also with forcing in time.
    struct VanDerPol {
        epsilon: f64,
        j: Matrix2<f64>,
        real: Matrix2<f64>,
        pair: Matrix2<Complex<f64>>,
    }

    impl VanDerPol {
        fn new(epsilon: f64) -> Self {
            Self { epsilon, j: Matrix2::zeros(), real: Matrix2::zeros(), pair: Matrix2::zeros() }
        }
    }

    impl System for VanDerPol {
        fn active_ranges(&self) -> &[Range<usize>] {
            std::slice::from_ref(&(0..2))
        }
        fn derivative(&mut self, t: f64, y: &[f64], dy: &mut [f64]) {
            dy[0] = y[1];
            dy[1] = ((1.0 - y[0] * y[0]) * y[1] - y[0] + libm::sin(t)) / self.epsilon;
        }
        fn scale(&self) -> &[f64] {
            &[1.0, 1.0]
        }
    }

    impl StiffSystem for VanDerPol {
        fn linearise(&mut self, _t: f64, y: &[f64], _shift: f64) {
            self.j =
                Matrix2::new(0.0, 1.0, (-2.0 * y[0] * y[1] - 1.0) / self.epsilon, (1.0 - y[0] * y[0]) / self.epsilon);
        }
        fn factor_shifted(&mut self, shift: f64) {
            self.real = (Matrix2::identity() * shift - self.j).try_inverse().unwrap();
        }
        fn solve_shifted(&mut self, b: &mut [f64]) {
            let x = self.real * Vector2::new(b[0], b[1]);
            b[..2].copy_from_slice(x.as_slice());
        }
        fn factor_shifted_pair(&mut self, real: f64, imaginary: f64) {
            let shift = Matrix2::identity() * Complex::new(real, imaginary);
            self.pair = (shift - self.j.map(|x| Complex::new(x, 0.0))).try_inverse().unwrap();
        }
        fn solve_shifted_pair(&mut self, re: &mut [f64], im: &mut [f64]) {
            let x = self.pair * Vector2::new(Complex::new(re[0], im[0]), Complex::new(re[1], im[1]));
            for i in 0..2 {
                (re[i], im[i]) = (x[i].re, x[i].im);
            }
        }
    }

    fn end(epsilon: f64, steps: u32) -> [f64; 2] {
        let mut system = VanDerPol::new(epsilon);
        let mut method = Radau::new(2);
        let mut polynomial = Polynomial::new(2);
        let (mut y, mut k, mut y1, mut k1) = ([1.5, -1.0], [0.0; 2], [0.0; 2], [0.0; 2]);
        let h = 0.5 / f64::from(steps);
        for n in 0..steps {
            let t = f64::from(n) * h;
            system.derivative(t, &y, &mut k);
            let error =
                method.attempt(&mut system, Step { t, h, y: &y, k: &k }, &mut y1, &mut k1, 1e-13, &mut polynomial);
            assert!(error.is_finite(), "the iteration failed at {t}");
            y = y1;
        }
        y
    }

    #[test]
    fn the_order_is_five_on_a_smooth_problem() {
        let fine = end(1.0, 512);
        let error = |steps: u32| {
            let y = end(1.0, steps);
            (y[0] - fine[0]).abs().max((y[1] - fine[1]).abs())
        };
        let order = libm::log2(error(4) / error(8));
        assert!((order - 5.0).abs() < 0.4, "{order}");
    }

    #[test]
    fn frozen_components_are_not_read() {
        // Two steps: the second starts from the polynomial of the first.
        let steps = |y: &[f64], k: &[f64]| {
            let (mut y, mut k) = (y.to_vec(), k.to_vec());
            let (mut y1, mut k1) = (y.clone(), k.clone());
            let mut system = VanDerPol::new(0.1);
            let mut method = Radau::new(y.len());
            let mut polynomial = Polynomial::new(y.len());
            system.derivative(0.0, &y, &mut k);
            let mut error = 0.0;
            for n in 0..2 {
                let t = 0.02 * f64::from(n);
                error = method.attempt(
                    &mut system,
                    Step { t, h: 0.02, y: &y, k: &k },
                    &mut y1,
                    &mut k1,
                    1e-9,
                    &mut polynomial,
                );
                std::mem::swap(&mut y, &mut y1);
                std::mem::swap(&mut k, &mut k1);
            }
            (error, y[..2].to_vec())
        };
        let unknown = f64::NAN;
        let alone = steps(&[1.5, -1.0], &[0.0; 2]);
        assert!(alone.0 > 0.0);
        assert_eq!(alone, steps(&[1.5, -1.0, unknown], &[0.0, 0.0, unknown]));
    }

    #[test]
    fn the_transformation_times_its_inverse_is_the_identity() {
        for i in 0..3 {
            for j in 0..3 {
                let product: f64 = (0..3).map(|k| T[i][k] * T_INVERSE[k][j]).sum();
                let unit = if i == j { 1.0 } else { 0.0 };
                assert!((product - unit).abs() < 2e-15, "{i} {j}: {product}");
            }
        }
    }

    #[test]
    fn the_polynomial_passes_through_its_stages() {
        let z = [0.3, -0.7, 1.1];
        let dense_output = DenseOutput::of(&z);
        assert!(dense_output.at(-1.0).abs() < 1e-15);
        for j in 0..3 {
            assert!((dense_output.at(C[j] - 1.0) - z[j]).abs() < 1e-14);
        }
    }
}
