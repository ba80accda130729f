//! A number with its first two time derivatives, carried exactly through every operation.
//!
//! Implemented here because dual-number crates call std's elementary functions, whose bits differ between native and wasm.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// f, df/dt and d2f/dt2 at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Jet {
    /// Value.
    pub value: f64,
    /// First time derivative.
    pub rate: f64,
    /// Second time derivative.
    pub acceleration: f64,
}

impl Jet {
    /// A constant.
    pub const fn constant(value: f64) -> Self {
        Self { value, rate: 0.0, acceleration: 0.0 }
    }

    /// A value with its derivatives.
    pub const fn new(value: f64, rate: f64, acceleration: f64) -> Self {
        Self { value, rate, acceleration }
    }

    /// Composition g(self), from g, g', g'' at the value.
    pub fn chain(self, g: f64, g1: f64, g2: f64) -> Self {
        Self { value: g, rate: g1 * self.rate, acceleration: g1 * self.acceleration + g2 * self.rate * self.rate }
    }

    /// Sine and cosine.
    pub fn sin_cos(self) -> (Self, Self) {
        let (s, c) = libm::sincos(self.value);
        (self.chain(s, c, -s), self.chain(c, -s, -c))
    }

    /// Square root; NaN below 0.
    pub fn sqrt(self) -> Self {
        let g = self.value.sqrt();
        let g1 = 0.5 / g;
        self.chain(g, g1, -0.5 * g1 / self.value)
    }

    /// 1 / self.
    pub(crate) fn recip(self) -> Self {
        let g = 1.0 / self.value;
        self.chain(g, -g * g, 2.0 * g * g * g)
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self::new(self.value + o.value, self.rate + o.rate, self.acceleration + o.acceleration)
    }
}

impl Sub for Jet {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self::new(self.value - o.value, self.rate - o.rate, self.acceleration - o.acceleration)
    }
}

impl Neg for Jet {
    type Output = Self;
    fn neg(self) -> Self {
        Self::new(-self.value, -self.rate, -self.acceleration)
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self::new(
            self.value * o.value,
            self.rate * o.value + self.value * o.rate,
            self.acceleration * o.value + 2.0 * self.rate * o.rate + self.value * o.acceleration,
        )
    }
}

impl Div for Jet {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        let value = self.value / o.value;
        let rate = (self.rate - value * o.rate) / o.value;
        let acceleration = (self.acceleration - 2.0 * rate * o.rate - value * o.acceleration) / o.value;
        Self::new(value, rate, acceleration)
    }
}

impl Mul<Jet> for f64 {
    type Output = Jet;
    fn mul(self, o: Jet) -> Jet {
        Jet::new(self * o.value, self * o.rate, self * o.acceleration)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_the_closed_form() {
        // f(t) = sqrt(2 + sin t) / (1 + t^2), derivatives worked out by hand at t = 0.7.
        let t = Jet::new(0.7, 1.0, 0.0);
        let f = (Jet::constant(2.0) + t.sin_cos().0).sqrt() * (Jet::constant(1.0) + t * t).recip();
        let (s, c) = libm::sincos(0.7);
        let (a, b): (f64, f64) = ((2.0 + s).sqrt(), 1.49);
        let (a1, b1) = (0.5 * c / a, 1.4);
        let a2 = -0.5 * s / a - 0.25 * c * c / (a * a * a);
        let f1 = a1 / b - a * b1 / (b * b);
        let f2 = a2 / b - 2.0 * a1 * b1 / (b * b) - a * 2.0 / (b * b) + 2.0 * a * b1 * b1 / (b * b * b);
        assert!((f.rate - f1).abs() < 1e-15 && (f.acceleration - f2).abs() < 1e-14);
    }
}
