//! Values of parameters.

/// A parameter's value in SI units.
#[derive(Clone, Debug, PartialEq, PartialOrd)]
pub enum Value {
    /// A quantity in SI units, or a pure number.
    Number(f64),
    /// A count.
    Count(u64),
    /// One of the parameter's choices.
    Choice(&'static str),
    /// Not given (`solver.preset` only).
    Unset,
}
