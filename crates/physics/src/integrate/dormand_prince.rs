//! Dormand-Prince 5(4) with its continuous extension of order 4
//! (Hairer, Nørsett & Wanner, *Solving Ordinary Differential Equations I*, 2nd ed., Table II.5.2 and II.6).

use super::{Step, Stepper, System, combine, copy};
use std::ops::Range;

const C: [f64; 5] = [0.2, 0.3, 0.8, 8.0 / 9.0, 1.0];
const A: [[f64; 5]; 5] = [
    [0.2, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
];
/// Weights of k1, k3, k4, k5, k6.
const B: [f64; 5] = [35.0 / 384.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0];
/// Fifth minus fourth order weights of k1, k3, k4, k5, k6, k7.
const E: [f64; 6] = [71.0 / 57600.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0];
/// Continuous extension: weights of k1, k3, k4, k5, k6, k7.
const D: [f64; 6] = [
    -12715105075.0 / 11282082432.0,
    87487479700.0 / 32700410799.0,
    -10690763975.0 / 1880347072.0,
    701980252875.0 / 199316789632.0,
    -1453857185.0 / 822651844.0,
    69997945.0 / 29380423.0,
];

/// Dormand-Prince 5(4): seven stages, first same as last.
pub struct DormandPrince {
    k2: Vec<f64>,
    k3: Vec<f64>,
    k4: Vec<f64>,
    k5: Vec<f64>,
    k6: Vec<f64>,
    stage: Vec<f64>,
    /// End state and derivative as computed: the caller may project its own copy.
    raw_end: Vec<f64>,
    raw_k_end: Vec<f64>,
    /// Fraction of the latest attempt that remains after truncation.
    remaining_fraction: f64,
}

impl DormandPrince {
    /// Stepper for `dimension` components.
    pub fn new(dimension: usize) -> Self {
        let zeros = || vec![0.0; dimension];
        Self {
            k2: zeros(),
            k3: zeros(),
            k4: zeros(),
            k5: zeros(),
            k6: zeros(),
            stage: zeros(),
            raw_end: zeros(),
            raw_k_end: zeros(),
            remaining_fraction: 1.0,
        }
    }

    /// Truncates the latest attempt to the fraction `theta` of its length, with the same interpolant.
    pub fn truncate(&mut self, theta: f64) {
        self.remaining_fraction *= theta;
    }

    /// Interpolates components `part` of the state at `t + theta h` of the latest attempt, 0 <= theta <= 1, from the state and
    /// derivative at its start.
    pub fn interpolate(&self, part: Range<usize>, theta: f64, step: Step<'_>, out: &mut [f64]) {
        let (y, k) = (step.y, step.k);
        let (theta, h) = (theta * self.remaining_fraction, step.h / self.remaining_fraction);
        let s = 1.0 - theta;
        let Self { k3, k4, k5, k6, raw_end: y_end, raw_k_end: k_end, .. } = self;
        let [y, k, k3, k4, k5, k6, y_end, k_end] = [y, k, k3, k4, k5, k6, y_end, k_end].map(|x| &x[part.clone()]);
        let out = &mut out[part];
        for i in 0..out.len() {
            let d = y_end[i] - y[i];
            let b = h * k[i] - d;
            let c = d - h * k_end[i] - b;
            let e = h * (D[0] * k[i] + D[1] * k3[i] + D[2] * k4[i] + D[3] * k5[i] + D[4] * k6[i] + D[5] * k_end[i]);
            out[i] = y[i] + theta * (d + s * (b + theta * (c + s * e)));
        }
    }

    /// Estimate of h |lambda| for the latest attempt, from the two evaluations at its end, in the components of `active_ranges`; 0 if
    /// it was truncated. Beyond about 3.25 the step is limited by stability, not accuracy (Hairer & Wanner II, IV.2, eq. (2.8)).
    pub fn stiffness(&self, active_ranges: &[Range<usize>], h: f64, y_end: &[f64], k_end: &[f64]) -> f64 {
        let (mut rate, mut distance) = (0.0, 0.0);
        for i in active_ranges.iter().flat_map(Range::clone) {
            let (dk, dy) = (k_end[i] - self.k6[i], y_end[i] - self.stage[i]);
            rate += dk * dk;
            distance += dy * dy;
        }
        if distance > 0.0 && self.remaining_fraction == 1.0 { h * (rate / distance).sqrt() } else { 0.0 }
    }
}

impl Stepper for DormandPrince {
    fn attempt<S: System>(&mut self, system: &mut S, step: Step<'_>, y_end: &mut [f64], k_end: &mut [f64]) -> f64 {
        let Step { t, h, y, k } = step;
        let Self { k2, k3, k4, k5, k6, stage, raw_end, raw_k_end, remaining_fraction } = self;
        *remaining_fraction = 1.0;
        system.prepare_times(&C.map(|c| t + c * h));
        let [a2, a3, a4, a5, a6] = &A;
        combine(system.active_ranges(), stage, y, h, [(a2[0], k)]);
        system.derivative(t + C[0] * h, stage, k2);
        combine(system.active_ranges(), stage, y, h, [(a3[0], k), (a3[1], k2)]);
        system.derivative(t + C[1] * h, stage, k3);
        let terms = [(a4[0], k), (a4[1], k2), (a4[2], k3)];
        combine(system.active_ranges(), stage, y, h, terms);
        system.derivative(t + C[2] * h, stage, k4);
        let terms = [(a5[0], k), (a5[1], k2), (a5[2], k3), (a5[3], k4)];
        combine(system.active_ranges(), stage, y, h, terms);
        system.derivative(t + C[3] * h, stage, k5);
        let terms = [(a6[0], k), (a6[1], k2), (a6[2], k3), (a6[3], k4), (a6[4], k5)];
        combine(system.active_ranges(), stage, y, h, terms);
        system.derivative(t + C[4] * h, stage, k6);
        let terms = [(B[0], k), (B[1], k3), (B[2], k4), (B[3], k5), (B[4], k6)];
        combine(system.active_ranges(), y_end, y, h, terms);
        system.derivative(t + h, y_end, k_end);
        copy(system.active_ranges(), raw_end, y_end);
        copy(system.active_ranges(), raw_k_end, k_end);
        let mut error = 0.0;
        for part in system.active_ranges() {
            let [k, k3, k4, k5, k6, k_end, scale] =
                [k, k3, k4, k5, k6, k_end, system.scale()].map(|x| &x[part.clone()]);
            for i in 0..part.len() {
                let e = h
                    * (E[0] * k[i] + E[1] * k3[i] + E[2] * k4[i] + E[3] * k5[i] + E[4] * k6[i] + E[5] * k_end[i]).abs();
                let e = e / scale[i];
                // `max` would drop a NaN.
                if e > error || e.is_nan() {
                    error = e;
                }
            }
        }
        error
    }
}
