//! Constant velocity.

use super::Law;
use crate::jet::Jet;

#[derive(Debug)]
pub(super) struct Line {
    pub position: f64,
    pub velocity: f64,
    pub turns: bool,
}

impl Law for Line {
    fn at(&self, t: f64) -> Jet {
        Jet::new(self.position + self.velocity * t, self.velocity, 0.0)
    }

    /// For a hinge: one full turn.
    fn period(&self) -> f64 {
        if self.turns { std::f64::consts::TAU / self.velocity.abs() } else { f64::INFINITY }
    }
}
