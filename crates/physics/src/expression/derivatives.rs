//! Evaluation of expressions with derivatives.

use super::{Binary, Number, Unary, smooth_step};
use crate::jet::Jet;

impl Number for Jet {
    fn constant(value: f64) -> Self {
        Self::constant(value)
    }

    fn sin_cos(self) -> (Self, Self) {
        Self::sin_cos(self)
    }

    fn scaled(self, factor: f64) -> Self {
        factor * self
    }

    fn shifted(self, shift: f64) -> Self {
        Self { value: shift + self.value, ..self }
    }

    #[inline(always)]
    fn unary(self, operation: Unary) -> Self {
        let x = self.value;
        // The value equals that in f64, bit for bit.
        let g = x.unary(operation);
        let (g1, g2) = match operation {
            Unary::Negate => return -self,
            Unary::Sqrt => return self.sqrt(),
            Unary::Sin => (libm::cos(x), -g),
            Unary::Cos => (-libm::sin(x), -g),
            Unary::Tan => (1.0 + g * g, 2.0 * g * (1.0 + g * g)),
            Unary::Asin | Unary::Acos => {
                let g1 = 1.0 / (1.0 - x * x).sqrt();
                let sign = if operation == Unary::Asin { 1.0 } else { -1.0 };
                (sign * g1, sign * x * g1 * g1 * g1)
            }
            Unary::Atan => {
                let g1 = 1.0 / (1.0 + x * x);
                (g1, -2.0 * x * g1 * g1)
            }
            Unary::Sinh => (libm::cosh(x), g),
            Unary::Cosh => (libm::sinh(x), g),
            Unary::Tanh => (1.0 - g * g, -2.0 * g * (1.0 - g * g)),
            Unary::Exp => (g, g),
            Unary::Ln => (1.0 / x, -1.0 / (x * x)),
            Unary::SmoothStep => {
                let (_, g1, g2) = smooth_step(x);
                (g1, g2)
            }
            // Drives reject this function.
            Unary::Abs => (1.0_f64.copysign(x), 0.0),
        };
        self.chain(g, g1, g2)
    }

    #[inline(always)]
    fn binary(self, operation: Binary, other: Self) -> Self {
        match operation {
            Binary::Add => self + other,
            Binary::Subtract => self - other,
            Binary::Multiply => self * other,
            // The reciprocal has fewer roundings.
            Binary::Divide if self == Self::constant(1.0) => other.recip(),
            Binary::Divide => self / other,
            Binary::Power => power(self, other),
            Binary::Atan2 => {
                let (y, x) = (self, other);
                let square = x.value * x.value + y.value * y.value;
                let rate = (x.value * y.rate - y.value * x.rate) / square;
                let turn = x.value * y.acceleration - y.value * x.acceleration;
                let growth = 2.0 * (x.value * x.rate + y.value * y.rate);
                let angle = libm::atan2(y.value, x.value);
                Self::new(angle, rate, (turn - rate * growth) / square)
            }
            // Drives reject these functions.
            Binary::Min => [self, other][usize::from(other.value < self.value)],
            Binary::Max => [self, other][usize::from(other.value > self.value)],
        }
    }
}

/// x^y; for constant y, x may be negative as far as f64 allows.
fn power(x: Jet, y: Jet) -> Jet {
    let value = libm::pow(x.value, y.value);
    if y.rate == 0.0 && y.acceleration == 0.0 {
        let c = y.value;
        // A zero factor cancels an infinite power of 0: x and 1 have derivatives at 0.
        let term = |factor: f64, exponent: f64| match factor {
            0.0 => 0.0,
            _ => factor * libm::pow(x.value, exponent),
        };
        return x.chain(value, term(c, c - 1.0), term(c * (c - 1.0), c - 2.0));
    }
    // ln(x^y) = y ln x.
    let growth = y * x.unary(Unary::Ln);
    growth.chain(value, value, value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expression::Program;

    #[test]
    fn every_operation_has_the_derivatives_of_its_value() {
        for text in [
            "t + 1/t",
            "-t*t - 3",
            "sin(2*t)",
            "cos(t^2)",
            "tan(t/2)",
            "asin(t/3)",
            "acos(t*t/4)",
            "atan(3*t)",
            "sinh(t)*cosh(t)",
            "tanh(t*t)",
            "exp(-t*t)",
            "ln(1 + t)",
            "sqrt(t + t*t)",
            "smoothstep(t - 0.3)",
            "t^3",
            "(t - 2)^3",
            "(t - 2)^-2",
            "t^1.5",
            "2^t",
            "t^t",
            "(1 + t)^sin(t)",
            "pow(t, 2.5)",
            "atan2(sin(t), 2 + t)",
        ] {
            let program = Program::parse(text, |name| (name == "t").then_some(0), &[]).expect(text);
            let at = |t: f64| program.eval(&[Jet::new(t, 1.0, 0.0)]);
            for t in [0.2, 0.7, 1.1] {
                let (now, h) = (at(t), 1e-5);
                assert_eq!(now.value, program.eval(&[t]), "{text}");
                let rate = (at(t + h).value - at(t - h).value) / (2.0 * h);
                let acceleration = (at(t + h).rate - at(t - h).rate) / (2.0 * h);
                assert!((now.rate - rate).abs() < 1e-7 * (1.0 + rate.abs()), "{text} at {t}");
                let off = (now.acceleration - acceleration).abs();
                assert!(off < 1e-6 * (1.0 + acceleration.abs()), "{text} at {t}");
            }
        }
    }

    #[test]
    fn whole_powers_have_derivatives_at_zero() {
        let zero = Jet::new(0.0, 1.0, 0.0);
        for (exponent, expected) in
            [(0.0, Jet::constant(1.0)), (1.0, zero), (2.0, Jet::new(0.0, 0.0, 2.0)), (3.0, Jet::default())]
        {
            let found = zero.binary(Binary::Power, Jet::constant(exponent));
            assert_eq!(found, expected, "{exponent}");
        }
    }
}
