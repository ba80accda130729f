//! An expression of time.

use super::Law;
use crate::expression::Program;
use crate::jet::Jet;

#[derive(Debug)]
pub(super) struct Formula {
    pub program: Program,
    pub scale: f64,
    /// Longest step, s.
    pub(crate) max_step: f64,
}

impl Law for Formula {
    fn at(&self, t: f64) -> Jet {
        self.scale * self.program.eval(&[Jet::new(t, 1.0, 0.0)])
    }

    fn step_end(&self, t: f64) -> f64 {
        t + self.max_step
    }

    fn bounds_steps(&self) -> bool {
        true
    }
}
