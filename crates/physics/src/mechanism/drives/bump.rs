//! Motions of finite duration: a ramp from one position to another, and a pulse that returns to its base. Rate and acceleration
//! are 0 at both ends, because a ramp of constant rate or a half-sine pulse would require an infinite force at its corners.

use std::f64::consts::PI;

use super::{Law, step_end_within};
use crate::expression::smooth_step;
use crate::jet::Jet;

#[derive(Debug)]
pub(super) struct Ramp {
    pub from: f64,
    pub rise: f64,
    pub start: f64,
    pub duration: f64,
}

impl Law for Ramp {
    fn at(&self, t: f64) -> Jet {
        let (value, rate, acceleration) = smooth_step((t - self.start) / self.duration);
        let d = self.duration;
        Jet::constant(self.from) + self.rise * Jet::new(value, rate / d, acceleration / (d * d))
    }

    fn step_end(&self, t: f64) -> f64 {
        step_end_within(self.start, self.start + self.duration, t)
    }

    fn bounds_steps(&self) -> bool {
        true
    }
}

#[derive(Debug)]
pub(super) struct Pulse {
    pub base: f64,
    pub height: f64,
    pub start: f64,
    pub duration: f64,
}

impl Law for Pulse {
    fn at(&self, t: f64) -> Jet {
        let s = (t - self.start) / self.duration;
        if !(0.0..=1.0).contains(&s) {
            return Jet::constant(self.base);
        }
        let (sine, _) = Jet::new(PI * s, PI / self.duration, 0.0).sin_cos();
        Jet::constant(self.base) + self.height * (sine * sine * sine)
    }

    fn step_end(&self, t: f64) -> f64 {
        step_end_within(self.start, self.start + self.duration, t)
    }

    fn bounds_steps(&self) -> bool {
        true
    }
}
