//! What is computed from runs: sections, exponents, regimes, sweeps. No clock, no thread, no graphics.

pub mod drive;
pub mod exponent;
pub mod grid;
pub mod layout;
pub mod point;
pub mod regime;
pub mod section;
pub mod sweep;
