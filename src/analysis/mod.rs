//! What is computed from runs. No clock, no thread, no graphics.

pub mod paper;
pub mod response;
