//! Jointplay: a 3D laboratory that shows what play in a joint does to a machine.
//!
//! Physics, scene files and analysis are separate crates, re-exported here. Above them are the following modules, each using
//! only those before it (`ARCHITECTURE.md`): [`files`], [`session`], [`chart`], [`film`] and [`view`], [`render`], [`app`], and the
//! entries [`cli`], `main.rs` and [`web`].
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::disallowed_types))]

/// The version that every output file names.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

pub use jointplay_analysis as analysis;
pub use jointplay_physics::{
    contact, expression, integrate, interpolate, jet, machine, mechanism, simulate, suggest, units, words,
};
pub use jointplay_scene as scene;
pub use jointplay_scene::mesh;

#[cfg(feature = "gui")]
pub mod app;
// The page draws its plots itself and should not download unused code.
#[cfg(not(target_arch = "wasm32"))]
pub mod chart;
#[cfg(not(target_arch = "wasm32"))]
pub mod cli;
#[cfg(not(target_arch = "wasm32"))]
#[expect(clippy::disallowed_methods, reason = "the module through which files are written")]
pub mod files;
#[cfg(feature = "gui")]
pub mod film;
#[cfg(feature = "gui")]
pub mod render;
pub mod session;
#[cfg(feature = "gui")]
pub mod view;
pub mod web;
