//! Scenes as data: what a mechanism is, its file format, and the one table of its parameters.
//!
#![doc = include_str!("../../docs/scene-format.md")]

mod access;
mod chain;
mod check;
mod document;
mod error;
mod load;
mod model;
mod parameters;
mod read;
mod read_bodies;
mod read_joints;
mod table;
#[cfg(test)]
mod tests;
mod units;
mod words;
mod write;

pub use error::SceneError;
pub use load::*;
pub use model::*;
pub use parameters::*;
pub use table::table;
pub use units::*;
pub use words::{visible, visible_line};

use table::find;
