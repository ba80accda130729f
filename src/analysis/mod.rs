//! What is computed from whole runs: what a method costs and how wrong it is, what each part of the model costs, responses
//! beside the ideal motion, sections, exponents, regimes, sweeps, the paper's section 4. Knows no thread, and its clock comes from outside ([`Outside`]).

mod cost;
pub mod drive;
pub mod exponent;
mod front;
pub mod grid;
pub mod layout;
mod outside;
pub mod paper;
pub mod point;
pub mod presets;
mod reach;
pub mod regime;
pub mod reproduction;
pub mod response;
pub mod section;
mod setting;
mod standard;
mod stretch;
pub mod sweep;
pub mod swept;
pub mod task;
mod work_precision;

pub use cost::{Part, PartCost, model_costs};
pub use front::front;
pub use outside::{AnalysisError, Outside};
pub use reach::{Goal, Reach, reach};
pub use setting::Setting;
pub use standard::{Errors, SettledSpan, Slot, Standard};
pub use stretch::{Effort, End};
pub use work_precision::{Phase, Point, WorkPrecision, work_precision};
