//! What is computed from whole runs: what a method costs and how wrong it is, what each part of the model costs, responses
//! beside the ideal motion, sections, exponents, regimes, sweeps, the paper's section 4. Knows no thread, and its clock comes from outside ([`RunContext`]).

mod cost;
pub mod drive;
pub mod exponent;
mod front;
pub mod grid;
pub mod layout;
pub mod orbit;
pub mod paper;
pub mod point;
pub mod presets;
mod reach;
mod reference_solution;
pub mod regime;
pub mod reproduction;
pub mod response;
mod run_context;
pub mod section;
mod setting;
pub mod source;
mod stretch;
pub mod sweep;
pub mod swept;
pub mod task;
mod work_precision;

pub use cost::{Part, PartCost, model_costs};
pub use front::front;
pub use reach::{Goal, Reach, reach};
pub use reference_solution::{Errors, ReferenceSolution, SettledSpan, Slot};
pub use run_context::{AnalysisError, RunContext};
pub use setting::Setting;
pub use stretch::{Effort, End};
pub use work_precision::{Phase, Point, View, WorkPrecision, work_precision};
