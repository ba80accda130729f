//! A method with its step or tolerance.

use serde::Serialize;

use super::AnalysisError;
use crate::integrate::Method;
use crate::scene::{Kind, Preset, Scene, Value, table};
use crate::simulate::{Simulation, Snapshot};

/// A method with its step or tolerance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Setting {
    /// Word of `solver.method`.
    pub method: &'static str,
    /// Whether `tolerance` decides, and not `step_s`.
    pub adaptive: bool,
    /// Fixed step, or first step of an adaptive method, s.
    pub step_s: f64,
    /// Relative tolerance of an adaptive method.
    pub tolerance: f64,
}

/// First step of an adaptive method and tolerance of a fixed-step one, which it does not use.
const FIRST_STEP: f64 = 10e-6;
const UNUSED_TOLERANCE: f64 = 1e-6;

impl Setting {
    /// Words of all methods there are, in the order of the table of parameters.
    pub fn methods() -> &'static [&'static str] {
        let row = table().iter().find(|row| row.key == "solver.method");
        match row.map(|row| &row.kind) {
            Some(Kind::Choice(words)) => words,
            _ => &[],
        }
    }

    /// `method` at `value`: a step in s where its step is fixed, else a tolerance.
    ///
    /// # Errors
    /// An unknown word.
    pub fn new(scene: &Scene, method: &'static str, value: f64) -> Result<Self, AnalysisError> {
        let mut scratch = scene.clone();
        scratch.set_value("solver.method", &Value::Choice(method))?;
        let adaptive = scratch.solver.method.is_adaptive();
        Ok(Self {
            method,
            adaptive,
            step_s: if adaptive { FIRST_STEP } else { value },
            tolerance: if adaptive { value } else { UNUSED_TOLERANCE },
        })
    }

    /// The one that a preset stands for.
    ///
    /// # Errors
    /// None in a scene that has solver settings.
    pub fn of_preset(scene: &Scene, preset: Preset) -> Result<Self, AnalysisError> {
        let (method, step_s, tolerance) = preset.point();
        Ok(Self {
            method: word_of(scene, method)?,
            adaptive: method.is_adaptive(),
            step_s,
            tolerance,
        })
    }

    /// Runge-Kutta 4 at 10 microseconds, by which speeds are divided.
    ///
    /// # Errors
    /// None while there is that method.
    pub fn yardstick(scene: &Scene) -> Result<Self, AnalysisError> {
        Self::new(scene, word_of(scene, Method::RungeKutta4)?, 10e-6)
    }

    /// The reference: the explicit pair of order 5 at `tolerance`.
    pub(super) fn reference(scene: &Scene, tolerance: f64) -> Result<Self, AnalysisError> {
        Self::new(scene, word_of(scene, Method::DormandPrince5)?, tolerance)
    }

    /// The automatic pair at `tolerance`.
    pub(super) fn automatic(scene: &Scene, tolerance: f64) -> Result<Self, AnalysisError> {
        Self::new(scene, word_of(scene, Method::Automatic)?, tolerance)
    }

    /// The step of a fixed-step method, s, the tolerance of an adaptive one.
    pub fn value(&self) -> f64 {
        if self.adaptive {
            self.tolerance
        } else {
            self.step_s
        }
    }

    /// `scene` with this setting, at its start.
    pub(super) fn start(&self, scene: &Scene) -> Result<Simulation, AnalysisError> {
        let mut scene = scene.clone();
        for (key, value) in self.changes() {
            scene.set_value(key, &value)?;
        }
        Ok(Simulation::new(&scene)?)
    }

    /// Goes on from `snapshot`, whichever setting that has, with this one.
    pub(super) fn resume(
        &self,
        scene: &Scene,
        snapshot: &Snapshot,
    ) -> Result<Simulation, AnalysisError> {
        let mut simulation = Simulation::new(scene)?;
        simulation.restore(snapshot)?;
        for (key, value) in self.changes() {
            simulation.set_value(key, &value)?;
        }
        Ok(simulation)
    }

    fn changes(&self) -> [(&'static str, Value); 3] {
        [
            ("solver.method", Value::Choice(self.method)),
            ("solver.step", Value::Number(self.step_s)),
            ("solver.tolerance", Value::Number(self.tolerance)),
        ]
    }
}

fn word_of(scene: &Scene, method: Method) -> Result<&'static str, AnalysisError> {
    let mut scratch = scene.clone();
    for word in Setting::methods() {
        scratch.set_value("solver.method", &Value::Choice(word))?;
        if scratch.solver.method == method {
            return Ok(word);
        }
    }
    unreachable!("every method has its word")
}
