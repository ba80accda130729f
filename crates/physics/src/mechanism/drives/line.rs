//! Constant velocity.

use std::sync::Arc;

use super::Law;
use crate::jet::Jet;
use crate::scene::Drive;

#[derive(Debug)]
struct Line {
    position: f64,
    velocity: f64,
    turns: bool,
}

pub(super) fn make(drive: &Drive, turns: bool) -> Arc<dyn Law> {
    Arc::new(Line { position: drive.number("position"), velocity: drive.number("velocity"), turns })
}

impl Law for Line {
    fn at(&self, t: f64) -> Jet {
        Jet::new(self.position + self.velocity * t, self.velocity, 0.0)
    }

    /// Of a hinge: a turn.
    fn period(&self) -> f64 {
        if self.turns { std::f64::consts::TAU / self.velocity.abs() } else { f64::INFINITY }
    }
}
