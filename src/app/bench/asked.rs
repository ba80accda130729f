//! What the bench asks of the run.

use crate::analysis::ready::ReadySweep;
use crate::app::load::Load;

/// What the user wants of the run.
pub enum Asked {
    /// To be at a section of a sweep.
    Section(Load),
    /// A ready sweep, over its scene.
    Ready(&'static ReadySweep),
}
