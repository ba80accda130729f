//! ROS34PW2, a linearly implicit method for stiff systems: four stages, order 3 for any approximation of the Jacobian
//! (a W-method), stiffly accurate, L-stable, embedded order 2
//! (Rang & Angermann, *New Rosenbrock W-methods of order 3 for PDAEs of index 1*, BIT 45 (2005) 761-787).
//!
//! Written in the variables U = Gamma K, which need no product with the Jacobian
//! (Hairer & Wanner, *Solving Ordinary Differential Equations II*, 2nd ed., IV.7, eq. (7.25)).

use super::{StiffSystem, add_scaled, copy};

const STAGES: usize = 4;
const GAMMA: f64 = 0.435_866_521_508_459;
pub(super) const ALPHA_IJ: [[f64; STAGES]; STAGES] = [
    [0.0; 4],
    [0.871_733_043_016_918, 0.0, 0.0, 0.0],
    [0.844_570_600_153_694_2, -0.112_990_642_364_841_85, 0.0, 0.0],
    [0.0, 0.0, 1.0, 0.0],
];
pub(super) const GAMMA_IJ: [[f64; STAGES]; STAGES] = [
    [GAMMA, 0.0, 0.0, 0.0],
    [-0.871_733_043_016_918, GAMMA, 0.0, 0.0],
    [-0.903_380_570_130_440_8, 0.054_180_672_388_095_326, GAMMA, 0.0],
    [0.242_123_807_060_953_46, -1.223_250_583_904_514_7, 0.545_260_255_335_102_1, GAMMA],
];
pub(super) const WEIGHTS: [f64; STAGES] =
    [0.242_123_807_060_953_46, -1.223_250_583_904_514_7, 1.545_260_255_335_102, GAMMA];
pub(super) const EMBEDDED: [f64; STAGES] = [0.378_109_031_458_193_7, -0.096_042_292_212_423_18, 0.5, 0.5 * GAMMA];

/// Coefficients in the variables U.
struct Tableau {
    a: [[f64; STAGES]; STAGES],
    c: [[f64; STAGES]; STAGES],
    weights: [f64; STAGES],
    error: [f64; STAGES],
    /// Abscissae and the weights of the time derivative.
    alpha: [f64; STAGES],
    gamma: [f64; STAGES],
}

impl Tableau {
    /// A = alpha Gamma^-1, C = diag(1 / gamma) - Gamma^-1, m = b Gamma^-1.
    fn new() -> Self {
        let mut inverse = [[0.0; STAGES]; STAGES];
        for j in 0..STAGES {
            for i in j..STAGES {
                let mut sum = if i == j { 1.0 } else { 0.0 };
                for k in j..i {
                    sum -= GAMMA_IJ[i][k] * inverse[k][j];
                }
                inverse[i][j] = sum / GAMMA;
            }
        }
        let times_inverse =
            |row: &[f64; STAGES]| std::array::from_fn(|j| (0..STAGES).map(|k| row[k] * inverse[k][j]).sum::<f64>());
        let difference: [f64; STAGES] = std::array::from_fn(|i| WEIGHTS[i] - EMBEDDED[i]);
        Self {
            a: std::array::from_fn(|i| times_inverse(&ALPHA_IJ[i])),
            c: std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 0.0 } else { -inverse[i][j] })),
            weights: times_inverse(&WEIGHTS),
            error: times_inverse(&difference),
            alpha: std::array::from_fn(|i| ALPHA_IJ[i].iter().sum()),
            gamma: std::array::from_fn(|i| GAMMA_IJ[i].iter().sum()),
        }
    }
}

/// ROS34PW2.
pub struct Rosenbrock {
    table: Tableau,
    u: [Vec<f64>; STAGES],
    stage: Vec<f64>,
    rate: Vec<f64>,
    /// Time of the latest Jacobian, which is reused after a rejected step.
    linearised_at: Option<f64>,
}

impl Rosenbrock {
    /// Step size of a step that solves with `shift`.
    pub fn step_of(shift: f64) -> f64 {
        1.0 / (GAMMA * shift)
    }

    /// Stepper for `dimension` components.
    pub fn new(dimension: usize) -> Self {
        Self {
            table: Tableau::new(),
            u: std::array::from_fn(|_| vec![0.0; dimension]),
            stage: vec![0.0; dimension],
            rate: vec![0.0; dimension],
            linearised_at: None,
        }
    }

    /// Discards the Jacobian after a change of state that is not a step.
    pub fn invalidate(&mut self) {
        self.linearised_at = None;
    }

    /// As [`super::Stepper::attempt`].
    pub fn attempt<S: StiffSystem>(
        &mut self,
        system: &mut S,
        t: f64,
        h: f64,
        y: &[f64],
        k: &[f64],
        y_end: &mut [f64],
        k_end: &mut [f64],
    ) -> f64 {
        if self.linearised_at != Some(t) {
            system.linearise(t, y);
            self.linearised_at = Some(t);
        }
        system.factor_shifted(1.0 / (GAMMA * h));
        let Self { table, u, stage, rate, .. } = self;
        for i in 0..STAGES {
            let (done, rest) = u.split_at_mut(i);
            let target = &mut rest[0];
            if i == 0 {
                copy(system.moving(), target, k);
            } else {
                copy(system.moving(), stage, y);
                for (j, uj) in done.iter().enumerate() {
                    add_scaled(system.moving(), stage, table.a[i][j], uj);
                }
                system.derivative(t + table.alpha[i] * h, stage, rate);
                copy(system.moving(), target, rate);
                for (j, uj) in done.iter().enumerate() {
                    add_scaled(system.moving(), target, table.c[i][j] / h, uj);
                }
            }
            let slope = system.time_derivative();
            add_scaled(system.moving(), target, table.gamma[i] * h, slope);
            system.solve_shifted(target);
        }
        let mut error = 0.0;
        for part in system.moving() {
            let scale = &system.scale()[part.clone()];
            let u = u.each_ref().map(|u| &u[part.clone()]);
            let (y, y_end) = (&y[part.clone()], &mut y_end[part.clone()]);
            for m in 0..part.len() {
                let (mut sum, mut e) = (y[m], 0.0);
                for i in 0..STAGES {
                    sum += table.weights[i] * u[i][m];
                    e += table.error[i] * u[i][m];
                }
                y_end[m] = sum;
                let e: f64 = e.abs() / scale[m];
                // `max` would drop a NaN.
                if e > error || e.is_nan() {
                    error = e;
                }
            }
        }
        system.derivative(t + h, y_end, k_end);
        error
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::System;
    use std::ops::Range;

    /// Prothero & Robinson (1974) with a second, mildly nonlinear component: y0' = -L (y0 - sin t) + cos t,
    /// y1' = -y1^2 + t; `exact` uses the true Jacobian, else a crude one.
    struct Problem {
        stiffness: f64,
        exact: bool,
        j: [f64; 2],
        shift: f64,
        ft: [f64; 2],
    }

    impl System for Problem {
        fn dimension(&self) -> usize {
            2
        }
        fn positions(&self) -> usize {
            0
        }
        fn moving(&self) -> &[Range<usize>] {
            std::slice::from_ref(&(0..2))
        }
        fn derivative(&mut self, t: f64, y: &[f64], dy: &mut [f64]) {
            let (s, c) = libm::sincos(t);
            dy[0] = -self.stiffness * (y[0] - s) + c;
            dy[1] = -y[1] * y[1] + t;
        }
        fn position_rate(&mut self, _t: f64, _y: &[f64], _dy: &mut [f64]) {}
        fn scale(&self) -> &[f64] {
            &[1.0, 1.0]
        }
    }

    impl StiffSystem for Problem {
        fn linearise(&mut self, t: f64, y: &[f64]) {
            let (s, c) = libm::sincos(t);
            if self.exact {
                self.j = [-self.stiffness, -2.0 * y[1]];
                self.ft = [self.stiffness * c - s, 1.0];
            } else {
                self.j = [-0.9 * self.stiffness, 0.0];
                self.ft = [0.0, 0.0];
            }
        }
        fn factor_shifted(&mut self, shift: f64) {
            self.shift = shift;
        }
        fn solve_shifted(&mut self, b: &mut [f64]) {
            b[0] /= self.shift - self.j[0];
            b[1] /= self.shift - self.j[1];
        }
        fn factor_shifted_pair(&mut self, _real: f64, _imaginary: f64) {}
        fn solve_shifted_pair(&mut self, _b_real: &mut [f64], _b_imaginary: &mut [f64]) {}
        fn time_derivative(&self) -> &[f64] {
            &self.ft
        }
    }

    fn end_error(stiffness: f64, exact: bool, steps: u32) -> f64 {
        let end = |steps: u32| {
            let mut problem = Problem { stiffness, exact, j: [0.0; 2], shift: 0.0, ft: [0.0; 2] };
            let mut method = Rosenbrock::new(2);
            let (mut y, mut k, mut y1, mut k1) = ([0.0, 0.5], [0.0; 2], [0.0; 2], [0.0; 2]);
            let h = 1.0 / f64::from(steps);
            for n in 0..steps {
                let t = f64::from(n) * h;
                problem.derivative(t, &y, &mut k);
                method.attempt(&mut problem, t, h, &y, &k, &mut y1, &mut k1);
                y = y1;
            }
            y
        };
        let (got, fine) = (end(steps), end(4096));
        (got[0] - libm::sin(1.0)).abs().max((got[1] - fine[1]).abs())
    }

    #[test]
    fn order_is_three_with_an_exact_and_with_a_crude_jacobian() {
        for exact in [true, false] {
            let order = libm::log2(end_error(2.0, exact, 20) / end_error(2.0, exact, 40));
            assert!((order - 3.0).abs() < 0.3, "exact {exact}: {order}");
        }
    }

    #[test]
    fn what_does_not_move_is_not_looked_at() {
        let step = |y: &[f64], k: &[f64]| {
            let mut problem = Problem { stiffness: 50.0, exact: true, j: [0.0; 2], shift: 0.0, ft: [0.0; 2] };
            let (mut k, mut end, mut k_end) = (k.to_vec(), y.to_vec(), k.to_vec());
            problem.derivative(0.0, y, &mut k);
            let mut method = Rosenbrock::new(y.len());
            let error = method.attempt(&mut problem, 0.0, 0.05, y, &k, &mut end, &mut k_end);
            (error, end[..2].to_vec())
        };
        let unknown = f64::NAN;
        let alone = step(&[0.1, 0.5], &[0.0; 2]);
        assert!(alone.0 > 0.0);
        assert_eq!(alone, step(&[0.1, 0.5, unknown], &[0.0, 0.0, unknown]));
    }

    #[test]
    fn a_very_stiff_component_is_followed_at_large_steps() {
        // L h = 5e8: an explicit method would need half a billion steps.
        let error = end_error(1e10, true, 20);
        assert!(error < 1e-4, "{error:e}");
    }

    /// y' = (1 + off) rate y, with `rate` as its Jacobian.
    struct Off {
        rate: f64,
        off: f64,
        shift: f64,
    }

    impl System for Off {
        fn dimension(&self) -> usize {
            1
        }
        fn positions(&self) -> usize {
            0
        }
        fn moving(&self) -> &[Range<usize>] {
            std::slice::from_ref(&(0..1))
        }
        fn derivative(&mut self, _t: f64, y: &[f64], dy: &mut [f64]) {
            dy[0] = (1.0 + self.off) * self.rate * y[0];
        }
        fn position_rate(&mut self, _t: f64, _y: &[f64], _dy: &mut [f64]) {}
        fn scale(&self) -> &[f64] {
            &[1.0]
        }
    }

    impl StiffSystem for Off {
        fn linearise(&mut self, _t: f64, _y: &[f64]) {}
        fn factor_shifted(&mut self, shift: f64) {
            self.shift = shift;
        }
        fn solve_shifted(&mut self, b: &mut [f64]) {
            b[0] /= self.shift - self.rate;
        }
        fn factor_shifted_pair(&mut self, _: f64, _: f64) {}
        fn solve_shifted_pair(&mut self, _: &mut [f64], _: &mut [f64]) {}
        fn time_derivative(&self) -> &[f64] {
            &[0.0]
        }
    }

    #[test]
    fn a_jacobian_that_is_far_too_large_or_by_a_third_too_small_leaves_it_stable() {
        let amplification = |rate: f64, off: f64| {
            let mut system = Off { rate, off, shift: 0.0 };
            let (y, mut k, mut end, mut rate_end) = ([1.0], [0.0], [0.0], [0.0]);
            system.derivative(0.0, &y, &mut k);
            Rosenbrock::new(1).attempt(&mut system, 0.0, 1.0, &y, &k, &mut end, &mut rate_end);
            end[0].abs()
        };
        for rate in [-0.1, -1.0, -3.0, -10.0, -100.0, -1e4, -1e8] {
            for tenths in -9..=5 {
                let off = f64::from(tenths) / 10.0;
                let found = amplification(rate, off);
                assert!(found < 1.0, "{rate} {off}: {found}");
            }
        }
        // A larger error makes it unstable.
        assert!(amplification(-1e4, 1.0) > 1.0);
    }
}
