//! The stepping methods behind one type, so that the method can change while the simulation runs.

use crate::integrate::{
    ContactSystem, DormandPrince, ImexEuler, Method, Polynomial, Radau, Rosenbrock, RungeKutta4,
    SemiImplicitEuler, Stepper, StiffSystem, hermite,
};

pub(super) enum AnyStepper {
    SemiImplicitEuler(SemiImplicitEuler),
    ImexEuler(ImexEuler),
    RungeKutta4(RungeKutta4),
    DormandPrince(DormandPrince),
    Rosenbrock(Box<Rosenbrock>),
    Radau(Box<Radau>),
    /// The explicit method steps while `implicit` is false.
    Pair {
        explicit: DormandPrince,
        stiff: Box<Radau>,
        implicit: bool,
    },
}

impl AnyStepper {
    pub(super) fn new(method: Method, dimension: usize) -> Self {
        match method {
            Method::SemiImplicitEuler => Self::SemiImplicitEuler(SemiImplicitEuler::new(dimension)),
            Method::ImexEuler => Self::ImexEuler(ImexEuler::new(dimension)),
            Method::RungeKutta4 => Self::RungeKutta4(RungeKutta4::new(dimension)),
            Method::DormandPrince5 => Self::DormandPrince(DormandPrince::new(dimension)),
            Method::Rosenbrock => Self::Rosenbrock(Box::new(Rosenbrock::new(dimension))),
            Method::Radau5 => Self::Radau(Box::new(Radau::new(dimension))),
            Method::Automatic => Self::Pair {
                explicit: DormandPrince::new(dimension),
                stiff: Box::new(Radau::new(dimension)),
                implicit: false,
            },
        }
    }

    /// Selects the implicit or the explicit method of a pair.
    pub(super) fn choose(&mut self, use_implicit: bool) {
        if let Self::Pair { implicit, .. } = self {
            *implicit = use_implicit;
        }
    }

    /// Discards what was computed at a state that is no longer current.
    pub(super) fn invalidate(&mut self) {
        match self {
            Self::Rosenbrock(stiff) => stiff.invalidate(),
            Self::Radau(stiff) | Self::Pair { stiff, .. } => stiff.invalidate(),
            _ => {}
        }
    }

    /// The implicit method's latest polynomial, for a snapshot.
    pub(super) fn polynomial(&self) -> Option<&Polynomial> {
        match self {
            Self::Radau(stiff) | Self::Pair { stiff, .. } => Some(stiff.polynomial()),
            _ => None,
        }
    }

    /// Restores it.
    pub(super) fn set_polynomial(&mut self, polynomial: &Polynomial) {
        if let Self::Radau(stiff) | Self::Pair { stiff, .. } = self {
            stiff.set_polynomial(polynomial);
        }
    }

    /// Step size times the largest eigenvalue seen in the step just attempted by an explicit adaptive method.
    pub(super) fn stiffness(&self, h: f64, y_end: &[f64], k_end: &[f64]) -> f64 {
        match self {
            Self::DormandPrince(explicit)
            | Self::Pair {
                explicit,
                implicit: false,
                ..
            } => explicit.stiffness(h, y_end, k_end),
            _ => 0.0,
        }
    }

    pub(super) fn attempt<S: StiffSystem + ContactSystem>(
        &mut self,
        system: &mut S,
        t: f64,
        h: f64,
        y: &[f64],
        k: &[f64],
        y_end: &mut [f64],
        k_end: &mut [f64],
        tolerance: f64,
    ) -> f64 {
        match self {
            Self::SemiImplicitEuler(s) => s.attempt(system, t, h, y, k, y_end, k_end),
            Self::ImexEuler(s) => s.attempt(system, t, h, y, y_end),
            Self::RungeKutta4(s) => s.attempt(system, t, h, y, k, y_end, k_end),
            Self::DormandPrince(s)
            | Self::Pair {
                explicit: s,
                implicit: false,
                ..
            } => s.attempt(system, t, h, y, k, y_end, k_end),
            Self::Rosenbrock(s) => s.attempt(system, t, h, y, k, y_end, k_end),
            Self::Radau(s) | Self::Pair { stiff: s, .. } => {
                s.attempt(system, t, h, y, k, y_end, k_end, tolerance)
            }
        }
    }

    /// Interior quadrature nodes for integrals over a step: the midpoint, used with both ends, or a collocation method's
    /// own nodes, between which its polynomial departs from stiff contacts.
    pub(super) fn interior(&self) -> &'static [f64] {
        match self {
            Self::Radau(_) | Self::Pair { implicit: true, .. } => &Radau::INTERIOR,
            _ => &[0.5],
        }
    }

    /// Those nodes with the ends used with them, in units of the step.
    pub(super) fn quadrature(&self) -> &'static [f64] {
        const RADAU: [f64; 3] = [Radau::INTERIOR[0], Radau::INTERIOR[1], 1.0];
        match self {
            Self::Radau(_) | Self::Pair { implicit: true, .. } => &RADAU,
            _ => &[0.0, 0.5, 1.0],
        }
    }

    /// Ends the latest attempt at fraction `theta` of it, on its interpolant.
    pub(super) fn truncate(&mut self, theta: f64) {
        match self {
            Self::DormandPrince(s)
            | Self::Pair {
                explicit: s,
                implicit: false,
                ..
            } => s.truncate(theta),
            Self::Radau(s) | Self::Pair { stiff: s, .. } => s.truncate(theta),
            _ => {}
        }
    }

    /// Whether `attempt` provides the derivative at the end.
    pub(super) fn ends_with_derivative(&self) -> bool {
        !matches!(
            self,
            Self::SemiImplicitEuler(_) | Self::ImexEuler(_) | Self::RungeKutta4(_)
        )
    }

    /// Whether rates are difference quotients over the step: no step needs a derivative at its end.
    pub(super) fn has_mean_rates(&self) -> bool {
        matches!(self, Self::ImexEuler(_))
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
        match self {
            Self::SemiImplicitEuler(_)
            | Self::ImexEuler(_)
            | Self::RungeKutta4(_)
            | Self::Rosenbrock(_) => {
                hermite(theta, h, y, k, y_end, k_end, out);
            }
            Self::DormandPrince(s)
            | Self::Pair {
                explicit: s,
                implicit: false,
                ..
            } => s.interpolate(theta, h, y, k, out),
            Self::Radau(s) | Self::Pair { stiff: s, .. } => s.interpolate(theta, y, out),
        }
    }
}
