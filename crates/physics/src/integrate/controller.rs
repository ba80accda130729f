//! Step-size control (Hairer, Nørsett & Wanner, *Solving Ordinary Differential Equations I*, 2nd ed., II.4).

use serde::{Deserialize, Serialize};

/// Proportional-integral controller of an adaptive stepper.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Controller {
    /// Order of the error estimate plus one.
    exponent: f64,
    /// Error of the previous accepted step, relative to the tolerance.
    previous: f64,
}

impl Controller {
    /// Controller for an embedded pair whose lower order is `order`.
    pub fn new(order: u32) -> Self {
        Self { exponent: f64::from(order) + 1.0, previous: 1e-4 }
    }

    /// Step-size factor after an accepted step with relative error `error` <= 1.
    pub fn after_accept(&mut self, error: f64) -> f64 {
        let beta = 0.04;
        let error = error.max(1e-10);
        let alpha = 1.0 / self.exponent - 0.75 * beta;
        let factor = 0.9 * libm::pow(error, -alpha) * libm::pow(self.previous, beta);
        self.previous = error.max(1e-4);
        factor.clamp(0.2, 8.0)
    }

    /// Step-size factor after a rejected step with relative error `error`.
    pub fn after_reject(&self, error: f64) -> f64 {
        if !error.is_finite() {
            return 0.25;
        }
        (0.9 * libm::pow(error, -1.0 / self.exponent)).clamp(0.1, 0.9)
    }
}
