//! Time steppers and event location for any system of ordinary differential equations.

/// Time-stepping method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Semi-implicit Euler, order 1, fixed step.
    SemiImplicitEuler,
    /// Classical Runge-Kutta, order 4, fixed step.
    RungeKutta4,
    /// Dormand-Prince 5(4), adaptive.
    DormandPrince5,
}

impl Method {
    /// Whether the step size is controlled by an error estimate.
    pub fn is_adaptive(self) -> bool {
        matches!(self, Self::DormandPrince5)
    }
}
