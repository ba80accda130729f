//! The stepping methods behind one name, so that a method can change while the simulation runs.

use crate::integrate::{
    DormandPrince, Method, Rosenbrock, RungeKutta4, SemiImplicitEuler, Stepper, StiffSystem,
};

pub(super) enum AnyStepper {
    SemiImplicitEuler(SemiImplicitEuler),
    RungeKutta4(RungeKutta4),
    DormandPrince(DormandPrince),
    Rosenbrock(Box<Rosenbrock>),
    /// The explicit one steps while `implicit` is false.
    Pair {
        explicit: DormandPrince,
        stiff: Box<Rosenbrock>,
        implicit: bool,
    },
}

/// Calls the stepper in charge.
macro_rules! each {
    ($self:expr, $s:ident => $call:expr) => {
        match $self {
            AnyStepper::SemiImplicitEuler($s) => $call,
            AnyStepper::RungeKutta4($s) => $call,
            AnyStepper::DormandPrince($s) => $call,
            AnyStepper::Rosenbrock($s) => $call,
            AnyStepper::Pair {
                explicit,
                stiff,
                implicit,
            } => {
                if *implicit {
                    let $s = stiff;
                    $call
                } else {
                    let $s = explicit;
                    $call
                }
            }
        }
    };
}

impl AnyStepper {
    pub(super) fn new(method: Method, dimension: usize) -> Self {
        match method {
            Method::SemiImplicitEuler => Self::SemiImplicitEuler(SemiImplicitEuler::new(dimension)),
            Method::RungeKutta4 => Self::RungeKutta4(RungeKutta4::new(dimension)),
            Method::DormandPrince5 => Self::DormandPrince(DormandPrince::new(dimension)),
            Method::Rosenbrock => Self::Rosenbrock(Box::new(Rosenbrock::new(dimension))),
            Method::Automatic => Self::Pair {
                explicit: DormandPrince::new(dimension),
                stiff: Box::new(Rosenbrock::new(dimension)),
                implicit: false,
            },
        }
    }

    /// Puts the linearly implicit method of a pair in charge, or the explicit one.
    pub(super) fn choose(&mut self, use_implicit: bool) {
        if let Self::Pair { implicit, .. } = self {
            *implicit = use_implicit;
        }
    }

    /// Forgets what was computed at a state that is no longer the current one.
    pub(super) fn invalidate(&mut self) {
        match self {
            Self::Rosenbrock(stiff) | Self::Pair { stiff, .. } => stiff.invalidate(),
            _ => {}
        }
    }

    /// Step size times the largest eigenvalue felt in the step just attempted by an explicit adaptive method.
    pub(super) fn stiffness(&self, h: f64, y_end: &[f64], k_end: &[f64]) -> f64 {
        match self {
            Self::Pair {
                explicit,
                implicit: false,
                ..
            } => explicit.stiffness(h, y_end, k_end),
            _ => 0.0,
        }
    }

    pub(super) fn attempt<S: StiffSystem>(
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

    /// Whether `attempt` leaves the derivative at the end.
    pub(super) fn ends_with_derivative(&self) -> bool {
        !matches!(self, Self::SemiImplicitEuler(_) | Self::RungeKutta4(_))
    }

    pub(super) fn interpolate(
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
