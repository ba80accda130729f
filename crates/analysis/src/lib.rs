//! Results computed from whole runs. The caller supplies the clock ([`RunContext`]); only [`parallel`] starts threads.
//!
//! - Sweeps: [`axis`] and [`design`] define the points, [`sweep`] runs them, [`point`], [`crossing`] and [`statistic`] record
//!   the results; `sweep_run` computes them on all cores, and resumes; [`sweep_task`] and [`task`] describe the same work as plain
//!   data for a thread or a worker, as [`one_at_a_time_task`] does for a study.
//! - Kinds of motion: Poincaré sections ([`section`]), the largest Lyapunov exponent ([`exponent`]) and the resulting
//!   [`regime`].
//! - Cost and error of the methods: [`Tradeoff`], and of the presets on the built-in scenes, as stored: [`presets`].
//! - The tip's error over the workspace, with the drives held ([`map`]).
//! - Runs of a scene at given values of its parameters, reduced to a few numbers, and each parameter alone ([`study`]).
//!
//! A sweep over two clearances that prints the kind of motion and the largest force in the second ball joint:
//!
//! ```
//! use jointplay_analysis::axis::Axis;
//! use jointplay_analysis::design::{Design, Start};
//! use jointplay_analysis::point::Plan;
//! use jointplay_analysis::sweep::Sweep;
//! use jointplay_scene::Scene;
//!
//! let scene = Scene::load("slider-crank-driven", &[])?;
//! let clearance = Axis::parse(&scene, "contact.clearance=0.1mm..0.3mm:2")?;
//! let design = Design::crossed(&scene, vec![clearance], &[Start::Cold])?;
//! let plan = Plan { periods: 4, discard: 1, phase: 0.0, exponent: false };
//! let sweep = Sweep::new(scene, design, plan)?;
//! for block in 0..sweep.design().blocks() {
//!     let mut run = sweep.begin(block);
//!     while !run.is_done() {
//!         run.advance(10_000);
//!     }
//!     for (point, result) in run.finished() {
//!         let result = result.as_ref().expect("it starts");
//!         println!("{}: {}, {:.1} N", sweep.describe(*point), result.regime, result.joints[1].peak);
//!         assert!(result.joints[1].peak > 5.0);
//!     }
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::disallowed_types))]

pub mod argument;
pub mod assembly;
pub mod axis;
pub mod crossing;
pub mod design;
pub mod drive;
pub mod exponent;
pub mod ideal_fault;
pub mod impact_row;
pub mod initial_peaks;
pub mod layout;
pub mod map;
pub mod map_task;
pub mod one_at_a_time_task;
pub mod orbit;
#[cfg(feature = "native")]
pub mod parallel;
pub mod point;
mod points;
pub mod presets;
pub mod ready_sweeps;
mod reference_solution;
pub mod regime;
pub mod row_times;
mod run_context;
pub mod section;
mod setting;
pub mod source;
pub mod span_request;
pub mod statistic;
pub mod study;
pub mod sweep;
#[cfg(feature = "native")]
#[expect(clippy::disallowed_methods, reason = "the record of a sweep grows in place")]
#[expect(clippy::disallowed_types, reason = "when the file was last brought to the disk; no result depends on it")]
pub mod sweep_run;
pub mod sweep_settings;
pub mod sweep_task;
pub mod task;
mod timing;
mod tradeoff;

pub use points::{PointsError, read_points};
pub use reference_solution::{Errors, ReferenceSolution};
pub use run_context::{AnalysisError, RunContext};
pub use setting::Setting;
pub use timing::End;
pub use tradeoff::{Grid, Row, Tradeoff};
