//! An integration method with the setting that controls its steps.

use super::AnalysisError;
use jointplay_physics::integrate::{Method, StepControl};
use jointplay_physics::machine::{Machine, Preset, Solver};
use jointplay_physics::simulate::Simulation;
use jointplay_scene::Scene;

/// A method with its step size, tolerance or steps per impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// Integration method.
    pub method: Method,
    /// Fixed step size, or initial step size of a method that adapts it, s.
    pub step_s: f64,
    /// Relative tolerance of an adaptive method.
    pub tolerance: f64,
    /// Steps per impact of the discrete-gradient method.
    pub steps_per_impact: u32,
}

impl Setting {
    /// `method` with `value` as its step size in s, its tolerance or its number of steps per impact, whichever controls its
    /// steps.
    pub fn new(method: Method, value: f64) -> Self {
        let mut setting = Self::of(&Solver { method, ..Solver::default() });
        match method.control() {
            StepControl::Fixed => setting.step_s = value,
            StepControl::Error => setting.tolerance = value,
            StepControl::PerImpact => setting.steps_per_impact = value as u32,
        }
        setting
    }

    /// The setting of a machine's solver.
    fn of(solver: &Solver) -> Self {
        let Solver { method, step: step_s, tolerance, steps_per_impact, .. } = *solver;
        Self { method, step_s, tolerance, steps_per_impact }
    }

    /// The setting of a preset on `machine`.
    pub fn of_preset(preset: Preset, machine: &Machine) -> Self {
        Self::of(&preset.solver(machine))
    }

    /// Runge-Kutta 4 at 10 microseconds, the baseline of speed ratios.
    pub fn baseline() -> Self {
        Self::new(Method::RungeKutta4, 10e-6)
    }

    /// The method of reference runs: the explicit pair of order 5 at `tolerance`.
    pub(super) fn reference(tolerance: f64) -> Self {
        Self::new(Method::DormandPrince5, tolerance)
    }

    /// The automatic selection of methods at `tolerance`.
    pub(super) fn automatic(tolerance: f64) -> Self {
        Self::new(Method::Automatic, tolerance)
    }

    /// The value that controls the steps of the method: a step size in s, a tolerance, or a number of steps per impact.
    pub fn value(&self) -> f64 {
        match self.method.control() {
            StepControl::Fixed => self.step_s,
            StepControl::Error => self.tolerance,
            StepControl::PerImpact => f64::from(self.steps_per_impact),
        }
    }

    /// Starts `scene` with this setting.
    pub(super) fn start(&self, scene: &Scene) -> Result<Simulation, AnalysisError> {
        Ok(Simulation::new(&self.in_machine(&scene.machine))?)
    }

    /// Continues from the state of `start` with this setting in place of its solver's.
    pub(super) fn resume(&self, start: &Simulation) -> Result<Simulation, AnalysisError> {
        let mut simulation = start.clone();
        let machine = self.in_machine(&simulation.changed_machine());
        simulation.adopt(&machine)?;
        Ok(simulation)
    }

    /// `machine` with this setting.
    fn in_machine(&self, machine: &Machine) -> Machine {
        let mut machine = machine.clone();
        machine.solver.method = self.method;
        machine.solver.step = self.step_s;
        machine.solver.tolerance = self.tolerance;
        machine.solver.steps_per_impact = self.steps_per_impact;
        machine
    }
}
