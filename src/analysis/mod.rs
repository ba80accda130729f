//! What is computed from whole runs: what a method costs and how wrong it is, which choice nothing beats, what each part
//! of the model costs. Knows no clock and no thread: both come from outside ([`Outside`]).

mod cost;
mod front;
mod outside;
pub mod paper;
pub mod presets;
mod reach;
pub mod response;
mod setting;
mod standard;
mod stretch;
mod work_precision;

pub use cost::{Part, PartCost, model_costs};
pub use front::front;
pub use outside::{AnalysisError, Outside};
pub use reach::{Goal, Reach, reach};
pub use setting::Setting;
pub use standard::{Errors, SettledSpan, Slot, Standard};
pub use stretch::{Effort, End};
pub use work_precision::{Phase, Point, WorkPrecision, work_precision};
