//! Requests of the bench to the run.

use crate::analysis::ready_sweeps::ReadySweep;
use crate::app::load::Load;

/// A request of the user to the run.
pub enum BenchRequest {
    /// Run to a section of a sweep.
    Section(Load),
    /// Start a ready sweep with its scene.
    Ready(&'static ReadySweep),
    /// Set a parameter, and show its slider.
    Value {
        /// Key.
        key: String,
        /// Value, as a user writes it.
        text: String,
    },
}
