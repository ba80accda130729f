//! The stepping methods behind one name, so that a method can change while the simulation runs.

use crate::integrate::{DormandPrince, Method, RungeKutta4, SemiImplicitEuler, Stepper, System};

pub(super) enum AnyStepper {
    SemiImplicitEuler(SemiImplicitEuler),
    RungeKutta4(RungeKutta4),
    DormandPrince(DormandPrince),
}

impl AnyStepper {
    pub(super) fn new(method: Method, dimension: usize) -> Self {
        match method {
            Method::SemiImplicitEuler => Self::SemiImplicitEuler(SemiImplicitEuler::new(dimension)),
            Method::RungeKutta4 => Self::RungeKutta4(RungeKutta4::new(dimension)),
            Method::DormandPrince5 => Self::DormandPrince(DormandPrince::new(dimension)),
        }
    }
}

/// Calls the stepper inside.
macro_rules! each {
    ($self:expr, $s:ident => $call:expr) => {
        match $self {
            AnyStepper::SemiImplicitEuler($s) => $call,
            AnyStepper::RungeKutta4($s) => $call,
            AnyStepper::DormandPrince($s) => $call,
        }
    };
}

impl Stepper for AnyStepper {
    fn attempt<S: System>(
        &mut self,
        system: &mut S,
        t: f64,
        h: f64,
        y: &[f64],
        k: &[f64],
        y_end: &mut [f64],
        k_end: &mut [f64],
    ) -> f64 {
        each!(self, s => s.attempt(system, t, h, y, k, y_end, k_end))
    }

    fn ends_with_derivative(&self) -> bool {
        each!(self, s => s.ends_with_derivative())
    }

    fn interpolate(
        &self,
        theta: f64,
        h: f64,
        y: &[f64],
        k: &[f64],
        y_end: &[f64],
        k_end: &[f64],
        out: &mut [f64],
    ) {
        each!(self, s => s.interpolate(theta, h, y, k, y_end, k_end, out));
    }
}
