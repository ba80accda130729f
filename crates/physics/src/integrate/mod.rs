//! Time steppers and event location for any system of ordinary differential equations.
//!
//! A [`Stepper`] only *attempts* a step: it leaves the end state, an error estimate and an interpolant, and the caller decides
//! whether to accept ([`Controller`] helps an adaptive one). Nothing here allocates after `new`.

mod controller;
mod dormand_prince;
mod fixed;
#[cfg(test)]
mod order_conditions;
mod radau;
mod root;

pub use controller::Controller;
pub use dormand_prince::DormandPrince;
pub use fixed::RungeKutta4;
pub use radau::{Polynomial, Radau};
pub use root::find_root;

use crate::words::words;
use std::ops::Range;

/// Time-stepping method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Discrete gradient of the contacts' elastic energy, friction at the end of the step; a number of steps per impact.
    DiscreteGradient,
    /// Classical Runge-Kutta, order 4, fixed step.
    RungeKutta4,
    /// Dormand-Prince 5(4), adaptive.
    DormandPrince5,
    /// Radau IIA(5), implicit, order 5, adaptive.
    Radau5,
    /// Dormand-Prince while accuracy limits the step, Radau IIA(5) in settled contact.
    Automatic,
}

words!(Method {
    DiscreteGradient => "discrete-gradient",
    RungeKutta4 => "rk4",
    DormandPrince5 => "dopri5",
    Radau5 => "radau5",
    Automatic => "automatic",
});

/// Rule for the size of a method's steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepControl {
    /// `solver.step` is the step.
    Fixed,
    /// An error estimate is held at `solver.tolerance`.
    Error,
    /// `solver.steps_per_impact` steps are taken while a ball strikes its wall.
    PerImpact,
}

impl Method {
    /// Whether each step solves a system with the Jacobian.
    pub fn is_implicit(self) -> bool {
        self == Self::Radau5
    }

    /// Rule for the size of its steps.
    pub fn control(self) -> StepControl {
        match self {
            Self::RungeKutta4 => StepControl::Fixed,
            Self::DiscreteGradient => StepControl::PerImpact,
            Self::DormandPrince5 | Self::Radau5 | Self::Automatic => StepControl::Error,
        }
    }

    /// Whether the step size is controlled by an error estimate.
    pub fn is_adaptive(self) -> bool {
        self.control() == StepControl::Error
    }
}

/// A first-order system y' = f(t, y).
pub trait System {
    /// Components that steps advance, in order. All other components are frozen and must not be touched; their derivatives are
    /// zero.
    fn active_ranges(&self) -> &[Range<usize>];
    /// Prepares for calls of [`Self::derivative`] at `times`, s: quantities that depend on time alone can then be computed for
    /// all of them together.
    fn prepare_times(&mut self, _times: &[f64]) {}
    /// Writes f(t, y) to `dy`.
    fn derivative(&mut self, t: f64, y: &[f64], dy: &mut [f64]);
    /// Absolute scale of each component: an error of `tolerance * scale` is acceptable.
    fn scale(&self) -> &[f64];
}

/// A system for implicit methods: it provides an approximation of its Jacobian J = df/dy that is good in the stiff part.
pub trait StiffSystem: System {
    /// Evaluates J at (t, y) and stores it; what of it depends on the shift is to fit `shift`, with which it is factored next.
    fn linearise(&mut self, t: f64, y: &[f64], shift: f64);
    /// Factors `shift` I - J.
    fn factor_shifted(&mut self, shift: f64);
    /// Solves (`shift` I - J) x = b in place.
    fn solve_shifted(&mut self, b: &mut [f64]);
    /// Factors (`real` + i `imaginary`) I - J.
    fn factor_shifted_pair(&mut self, real: f64, imaginary: f64);
    /// Solves with this complex matrix in place for `b_real` + i `b_imaginary`.
    fn solve_shifted_pair(&mut self, b_real: &mut [f64], b_imaginary: &mut [f64]);
}

/// A step of size `h`, s, from the state `y` at `t`, s, where `k` = f(t, y).
#[derive(Clone, Copy, Debug)]
pub struct Step<'a> {
    /// Start, s.
    pub t: f64,
    /// Size, s.
    pub h: f64,
    /// State at the start.
    pub y: &'a [f64],
    /// Its derivative.
    pub k: &'a [f64],
}

/// One-step method.
pub trait Stepper {
    /// Attempts `step` and writes the end state to `y_end`.
    ///
    /// An adaptive method also writes f(t + h, y_end) to `k_end`. Returns the error estimate relative to the system's scales
    /// (largest component; 0 for a fixed-step method), not yet divided by the tolerance.
    fn attempt<S: System>(&mut self, system: &mut S, step: Step<'_>, y_end: &mut [f64], k_end: &mut [f64]) -> f64;
}

/// Cubic Hermite interpolation at fraction `theta` of `step`, which ends at `y_end` with the derivative `k_end`, of the components
/// `part` of `out`; error O(h^4).
pub fn hermite(part: Range<usize>, theta: f64, step: Step<'_>, y_end: &[f64], k_end: &[f64], out: &mut [f64]) {
    let (s, h) = (1.0 - theta, step.h);
    let [y, k, y_end, k_end] = [step.y, step.k, y_end, k_end].map(|x| &x[part.clone()]);
    let out = &mut out[part];
    for i in 0..out.len() {
        let d = y_end[i] - y[i];
        out[i] = s * y[i]
            + theta * y_end[i]
            + theta * (theta - 1.0) * ((1.0 - 2.0 * theta) * d + (theta - 1.0) * h * k[i] + theta * h * k_end[i]);
    }
}

/// `out` = y + h (a_1 k_1 + a_2 k_2 + …) for the `terms` (a, k), over `parts`. All slices are cut to one length so that the
/// compiler can vectorise the loop.
fn combine<const N: usize>(parts: &[Range<usize>], out: &mut [f64], y: &[f64], h: f64, terms: [(f64, &[f64]); N]) {
    for part in parts {
        let (out, y) = (&mut out[part.clone()], &y[part.clone()]);
        let terms = terms.map(|(a, k)| (a, &k[part.clone()]));
        for i in 0..out.len() {
            let mut sum = terms[0].0 * terms[0].1[i];
            for (a, k) in &terms[1..] {
                sum += a * k[i];
            }
            out[i] = y[i] + h * sum;
        }
    }
}

/// `out` += a k, over `parts`.
pub(crate) fn add_scaled(parts: &[Range<usize>], out: &mut [f64], a: f64, k: &[f64]) {
    for part in parts {
        for (out, k) in out[part.clone()].iter_mut().zip(&k[part.clone()]) {
            *out += a * k;
        }
    }
}

/// `x` /= s, over `parts`.
pub(crate) fn divide(parts: &[Range<usize>], x: &mut [f64], s: f64) {
    for part in parts {
        x[part.clone()].iter_mut().for_each(|x| *x /= s);
    }
}

/// Copies `parts`.
pub(crate) fn copy(parts: &[Range<usize>], out: &mut [f64], from: &[f64]) {
    for part in parts {
        out[part.clone()].copy_from_slice(&from[part.clone()]);
    }
}

/// Largest component relative to its scale, over `parts`; NaN if any is.
fn largest(parts: &[Range<usize>], x: &[f64], scale: &[f64]) -> f64 {
    let mut size: f64 = 0.0;
    for part in parts {
        for (x, s) in x[part.clone()].iter().zip(&scale[part.clone()]) {
            let e = x.abs() / s;
            // `max` would drop a NaN.
            if e > size || e.is_nan() {
                size = e;
            }
        }
    }
    size
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x'' = -x with x(0) = 1, x'(0) = 0.
    struct Oscillator;

    impl System for Oscillator {
        fn active_ranges(&self) -> &[Range<usize>] {
            std::slice::from_ref(&(0..2))
        }
        fn derivative(&mut self, _t: f64, y: &[f64], dy: &mut [f64]) {
            dy[0] = y[1];
            dy[1] = -y[0];
        }
        fn scale(&self) -> &[f64] {
            &[1.0, 1.0]
        }
    }

    fn end_error(stepper: &mut impl Stepper, steps: u32) -> f64 {
        let (mut y, mut k, mut y1, mut k1) = ([1.0, 0.0], [0.0; 2], [0.0; 2], [0.0; 2]);
        let h = 2.0 / f64::from(steps);
        for n in 0..steps {
            let t = f64::from(n) * h;
            Oscillator.derivative(t, &y, &mut k);
            stepper.attempt(&mut Oscillator, Step { t, h, y: &y, k: &k }, &mut y1, &mut k1);
            y = y1;
        }
        (y[0] - libm::cos(2.0)).abs().max((y[1] + libm::sin(2.0)).abs())
    }

    fn observed_order(stepper: &mut impl Stepper, steps: u32) -> f64 {
        libm::log2(end_error(stepper, steps) / end_error(stepper, 2 * steps))
    }

    #[test]
    fn each_stepper_has_its_order() {
        let rk4 = observed_order(&mut RungeKutta4::new(2), 40);
        let dopri = observed_order(&mut DormandPrince::new(2), 20);
        assert!((rk4 - 4.0).abs() < 0.1, "Runge-Kutta 4: {rk4}");
        assert!((dopri - 5.0).abs() < 0.2, "Dormand-Prince: {dopri}");
    }

    #[test]
    fn frozen_components_are_not_read() {
        let step = |y: &[f64], k: &mut [f64], end: &mut [f64], k_end: &mut [f64]| {
            Oscillator.derivative(0.0, y, k);
            DormandPrince::new(y.len()).attempt(&mut Oscillator, Step { t: 0.0, h: 0.3, y, k }, end, k_end)
        };
        let (mut alone, mut with_frozen) = ([0.0; 2], [0.0; 3]);
        let error = step(&[1.0, 0.2], &mut [0.0; 2], &mut alone, &mut [0.0; 2]);
        let unknown = f64::NAN;
        let y = [1.0, 0.2, unknown];
        let same = step(&y, &mut [0.0, 0.0, unknown], &mut with_frozen, &mut [0.0; 3]);
        assert_eq!((error, &alone[..]), (same, &with_frozen[..2]));
    }

    fn interpolation_error(h: f64) -> f64 {
        let (mut k, mut y1, mut k1, mut out) = ([0.0; 2], [0.0; 2], [0.0; 2], [0.0; 2]);
        let y = [1.0, 0.0];
        let mut stepper = DormandPrince::new(2);
        Oscillator.derivative(0.0, &y, &mut k);
        let step = Step { t: 0.0, h, y: &y, k: &k };
        stepper.attempt(&mut Oscillator, step, &mut y1, &mut k1);
        stepper.interpolate(0..2, 0.37, step, &mut out);
        (out[0] - libm::cos(0.37 * h)).abs().max((out[1] + libm::sin(0.37 * h)).abs())
    }

    #[test]
    fn dormand_prince_interpolates_to_fourth_order() {
        let order = libm::log2(interpolation_error(0.4) / interpolation_error(0.2));
        assert!(order > 4.5, "local order {order}: a continuous extension of order 4 has 5");
    }
}
