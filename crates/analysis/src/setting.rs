//! A method with its step size or tolerance.

use serde::Serialize;

use super::AnalysisError;
use jointplay_physics::integrate::Method;
use jointplay_physics::machine::{Machine, Preset};
use jointplay_physics::simulate::Simulation;
use jointplay_scene::Scene;

/// A method with its step size or tolerance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Setting {
    /// Method.
    pub method: Method,
    /// Whether `tolerance` applies rather than `step_s`.
    pub adaptive: bool,
    /// Fixed step size, or initial step size of an adaptive method, s.
    pub step_s: f64,
    /// Relative tolerance of an adaptive method.
    pub tolerance: f64,
}

/// Initial step size of an adaptive method, and tolerance of a fixed-step one, which ignores it.
const FIRST_STEP: f64 = 10e-6;
const UNUSED_TOLERANCE: f64 = 1e-6;

impl Setting {
    /// `method` at `value`: a step size in s if its step is fixed, otherwise a tolerance.
    pub fn new(method: Method, value: f64) -> Self {
        let adaptive = method.is_adaptive();
        Self {
            method,
            adaptive,
            step_s: if adaptive { FIRST_STEP } else { value },
            tolerance: if adaptive { value } else { UNUSED_TOLERANCE },
        }
    }

    /// The setting of a preset.
    pub fn of_preset(preset: Preset) -> Self {
        let (method, step_s, tolerance) = preset.point();
        Self { method, adaptive: method.is_adaptive(), step_s, tolerance }
    }

    /// Runge-Kutta 4 at 10 microseconds, the baseline of speed ratios.
    pub fn baseline() -> Self {
        Self::new(Method::RungeKutta4, 10e-6)
    }

    /// The reference: the explicit pair of order 5 at `tolerance`.
    pub(super) fn reference(tolerance: f64) -> Self {
        Self::new(Method::DormandPrince5, tolerance)
    }

    /// The automatic selection of methods at `tolerance`.
    pub(super) fn automatic(tolerance: f64) -> Self {
        Self::new(Method::Automatic, tolerance)
    }

    /// The step size of a fixed-step method, s, or the tolerance of an adaptive one.
    pub fn value(&self) -> f64 {
        if self.adaptive { self.tolerance } else { self.step_s }
    }

    /// Starts `scene` with this setting.
    pub(super) fn start(&self, scene: &Scene) -> Result<Simulation, AnalysisError> {
        Ok(Simulation::new(&self.of(&scene.machine))?)
    }

    /// Continues from the state of `start` with this setting in place of its own.
    pub(super) fn resume(&self, start: &Simulation) -> Result<Simulation, AnalysisError> {
        let mut simulation = start.clone();
        let machine = self.of(&simulation.changed_machine());
        simulation.adopt(&machine)?;
        Ok(simulation)
    }

    /// `machine` with this setting.
    fn of(&self, machine: &Machine) -> Machine {
        let mut machine = machine.clone();
        machine.solver.method = self.method;
        machine.solver.step = self.step_s;
        machine.solver.tolerance = self.tolerance;
        machine
    }
}
