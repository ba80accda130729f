//! An expression of time.

use std::sync::Arc;

use super::Law;
use crate::jet::Jet;
use crate::scene::{Drive, DriveData, Program};

#[derive(Debug)]
struct Formula {
    program: Program,
    scale: f64,
    /// Longest step, s.
    resolve: f64,
}

pub(super) fn make(drive: &Drive, _turns: bool) -> Arc<dyn Law> {
    let DriveData::Formula(program, scale) = &drive.data else { unreachable!("a formula is read with its expression") };
    Arc::new(Formula { program: program.clone(), scale: *scale, resolve: drive.number("resolve") })
}

impl Law for Formula {
    fn at(&self, t: f64) -> Jet {
        self.scale * self.program.eval(&[Jet::new(t, 1.0, 0.0)])
    }

    fn step_end(&self, t: f64) -> f64 {
        t + self.resolve
    }

    fn bounds_steps(&self) -> bool {
        true
    }
}
