//! A fixed-step method.

use super::{Step, Stepper, System, combine};

/// Kutta's classical method of order 4 (1901).
pub struct RungeKutta4 {
    k2: Vec<f64>,
    k3: Vec<f64>,
    k4: Vec<f64>,
    stage: Vec<f64>,
}

impl RungeKutta4 {
    /// Stepper for `dimension` components.
    pub fn new(dimension: usize) -> Self {
        let zeros = || vec![0.0; dimension];
        Self { k2: zeros(), k3: zeros(), k4: zeros(), stage: zeros() }
    }
}

impl Stepper for RungeKutta4 {
    fn attempt<S: System>(&mut self, system: &mut S, step: Step<'_>, y_end: &mut [f64], _k_end: &mut [f64]) -> f64 {
        let Step { t, h, y, k } = step;
        let n = y.len();
        let Self { k2, k3, k4, stage } = self;
        combine(system.active_ranges(), stage, y, 0.5 * h, [(1.0, k)]);
        system.derivative(t + 0.5 * h, stage, k2);
        combine(system.active_ranges(), stage, y, 0.5 * h, [(1.0, k2)]);
        system.derivative(t + 0.5 * h, stage, k3);
        combine(system.active_ranges(), stage, y, h, [(1.0, k3)]);
        system.derivative(t + h, stage, k4);
        let [k, k2, k3, k4] = [k, k2, k3, k4].map(|k| &k[..n]);
        let y_end = &mut y_end[..n];
        for i in 0..n {
            y_end[i] = y[i] + h / 6.0 * (k[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
        }
        0.0
    }
}
