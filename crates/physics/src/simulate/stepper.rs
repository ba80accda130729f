//! The stepping methods behind one type, so that the method can change while the simulation runs.

use serde::{Deserialize, Serialize};

use crate::integrate::{
    DormandPrince, Method, Polynomial, Radau, RungeKutta4, Step, Stepper, StiffSystem, System, hermite,
};
use std::ops::Range;

pub(super) enum AnyStepper {
    /// The equations take the whole step.
    DiscreteGradient,
    RungeKutta4(RungeKutta4),
    DormandPrince(DormandPrince),
    Radau(Box<Radau>),
    /// One scheme at a time.
    Automatic {
        explicit: DormandPrince,
        stiff: Box<Radau>,
        scheme: ActiveScheme,
    },
}

/// Active scheme of the automatic method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum ActiveScheme {
    /// Dormand-Prince.
    #[default]
    Explicit,
    /// Radau IIA.
    Implicit,
}

impl AnyStepper {
    pub(super) fn new(method: Method, dimension: usize) -> Self {
        match method {
            Method::DiscreteGradient => Self::DiscreteGradient,
            Method::RungeKutta4 => Self::RungeKutta4(RungeKutta4::new(dimension)),
            Method::DormandPrince5 => Self::DormandPrince(DormandPrince::new(dimension)),
            Method::Radau5 => Self::Radau(Box::new(Radau::new(dimension))),
            Method::Automatic => Self::Automatic {
                explicit: DormandPrince::new(dimension),
                stiff: Box::new(Radau::new(dimension)),
                scheme: ActiveScheme::Explicit,
            },
        }
    }

    /// The method that it steps by.
    pub(super) fn method(&self) -> Method {
        match self {
            Self::DiscreteGradient => Method::DiscreteGradient,
            Self::RungeKutta4(_) => Method::RungeKutta4,
            Self::DormandPrince(_) => Method::DormandPrince5,
            Self::Radau(_) => Method::Radau5,
            Self::Automatic { .. } => Method::Automatic,
        }
    }

    /// Activates a scheme of the automatic method.
    pub(super) fn choose(&mut self, chosen: ActiveScheme) {
        if let Self::Automatic { scheme, .. } = self {
            *scheme = chosen;
        }
    }

    /// Discards data computed at a state that is no longer current.
    pub(super) fn invalidate(&mut self) {
        match self {
            Self::Radau(stiff) | Self::Automatic { stiff, .. } => stiff.invalidate(),
            _ => {}
        }
    }

    /// Number of components of the method's [`Polynomial`]: those of the state, or none.
    pub(super) fn polynomial_size(method: Method, dimension: usize) -> usize {
        if matches!(method, Method::Radau5 | Method::Automatic) { dimension } else { 0 }
    }

    /// Upper bound on the step-size factor after the latest attempt, in addition to the limit set by its error.
    pub(super) fn growth(&self) -> f64 {
        match self {
            Self::Radau(s) | Self::Automatic { stiff: s, scheme: ActiveScheme::Implicit, .. } => s.growth(),
            _ => f64::INFINITY,
        }
    }

    /// Factorisations of the full matrices in the latest attempt by an implicit scheme; otherwise 0.
    pub(super) fn factorisations(&self) -> u32 {
        match self {
            Self::Radau(stiff) | Self::Automatic { stiff, scheme: ActiveScheme::Implicit, .. } => {
                stiff.factorisations()
            }
            _ => 0,
        }
    }

    /// Step size times the largest eigenvalue seen in the step just attempted by an explicit adaptive method.
    pub(super) fn stiffness<S: System>(&self, system: &S, h: f64, y_end: &[f64], k_end: &[f64]) -> f64 {
        match self {
            Self::DormandPrince(explicit) | Self::Automatic { explicit, scheme: ActiveScheme::Explicit, .. } => {
                explicit.stiffness(system.active_ranges(), h, y_end, k_end)
            }
            _ => 0.0,
        }
    }

    pub(super) fn attempt<S: StiffSystem>(
        &mut self,
        system: &mut S,
        step: Step<'_>,
        y_end: &mut [f64],
        k_end: &mut [f64],
        tolerance: f64,
        polynomial: &mut Polynomial,
    ) -> f64 {
        match self {
            Self::DiscreteGradient => unreachable!("the equations take this step"),
            Self::RungeKutta4(s) => s.attempt(system, step, y_end, k_end),
            Self::DormandPrince(s) | Self::Automatic { explicit: s, scheme: ActiveScheme::Explicit, .. } => {
                s.attempt(system, step, y_end, k_end)
            }
            Self::Radau(s) | Self::Automatic { stiff: s, .. } => {
                s.attempt(system, step, y_end, k_end, tolerance, polynomial)
            }
        }
    }

    /// Interior quadrature nodes for integrals over a step: the midpoint, used with both ends, or a collocation method's
    /// own nodes, between which its polynomial departs from stiff contacts.
    pub(super) fn interior(&self) -> &'static [f64] {
        match self {
            Self::Radau(_) | Self::Automatic { scheme: ActiveScheme::Implicit, .. } => &Radau::INTERIOR,
            _ => &[0.5],
        }
    }

    /// Those nodes and the ends used with them, in units of the step.
    pub(super) fn quadrature(&self) -> &'static [f64] {
        const RADAU: [f64; 3] = [Radau::INTERIOR[0], Radau::INTERIOR[1], 1.0];
        match self {
            Self::Radau(_) | Self::Automatic { scheme: ActiveScheme::Implicit, .. } => &RADAU,
            _ => &[0.0, 0.5, 1.0],
        }
    }

    /// Ends the latest attempt at fraction `theta` of it, on its interpolant.
    pub(super) fn truncate(&mut self, theta: f64, polynomial: &mut Polynomial) {
        match self {
            Self::DormandPrince(s) | Self::Automatic { explicit: s, scheme: ActiveScheme::Explicit, .. } => {
                s.truncate(theta)
            }
            Self::Radau(_) | Self::Automatic { scheme: ActiveScheme::Implicit, .. } => polynomial.truncate(theta),
            _ => {}
        }
    }

    /// Whether the interpolant is about as accurate as the step's error estimate.
    pub(super) fn ends_on_interpolant(&self) -> bool {
        matches!(self, Self::DormandPrince(_) | Self::Automatic { scheme: ActiveScheme::Explicit, .. })
    }

    /// Whether `attempt` provides the derivative at the end.
    pub(super) fn ends_with_derivative(&self) -> bool {
        !matches!(self, Self::DiscreteGradient | Self::RungeKutta4(_))
    }

    /// Whether rates are difference quotients over the step: no step needs a derivative at its end.
    pub(super) fn has_mean_rates(&self) -> bool {
        matches!(self, Self::DiscreteGradient)
    }

    /// Interpolates the components `part` of the state at fraction `theta` of the latest attempt, `step`, into those of `out`.
    pub(super) fn interpolate(
        &self,
        part: Range<usize>,
        theta: f64,
        step: Step<'_>,
        [y_end, k_end]: [&[f64]; 2],
        polynomial: &Polynomial,
        out: &mut [f64],
    ) {
        match self {
            Self::DiscreteGradient | Self::RungeKutta4(_) => hermite(part, theta, step, y_end, k_end, out),
            Self::DormandPrince(s) | Self::Automatic { explicit: s, scheme: ActiveScheme::Explicit, .. } => {
                s.interpolate(part, theta, step, out)
            }
            Self::Radau(_) | Self::Automatic { .. } => polynomial.interpolate(part, theta, step.y, out),
        }
    }
}
