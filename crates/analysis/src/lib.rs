//! Results computed from whole runs: cost and error of the methods, cost of the parts of the model, responses beside the
//! ideal motion, Poincaré sections, Lyapunov exponents, regimes, sweeps, the paper's section 4, cases with known answers. Starts no threads, and
//! its clock comes from outside ([`RunContext`]).

pub mod beginning;
mod cost;
pub mod drive;
pub mod exponent;
mod front;
pub mod grid;
pub mod impact_row;
pub mod layout;
mod many_joints;
pub mod orbit;
pub mod paper;
pub mod point;
pub mod presets;
mod reach;
pub mod ready;
mod reference_solution;
pub mod regime;
pub mod reproduction;
pub mod response;
mod run_context;
pub mod section;
mod setting;
pub mod source;
pub mod sweep;
pub mod sweep_task;
pub mod task;
mod timing;
pub mod validation;
mod work_precision;

pub use cost::{CaseCost, CostCase, model_costs};
pub use front::front;
pub use many_joints::{GROWTH, SPEED_GOALS, Speed, SpeedGoal, growth, speed};
pub use reach::{Goal, GoalResult, reach};
pub use reference_solution::{Errors, ReferenceSolution, SettledSpan, Slot};
pub use run_context::{AnalysisError, RunContext};
pub use setting::Setting;
pub use timing::{End, WorkBudget};
pub use work_precision::{Phase, Point, View, WorkPrecision, work_precision};
