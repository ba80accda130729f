//! Scenes as data: what a mechanism consists of, its file format, and the single table of its parameters.
//!
#![doc = include_str!("../../../../docs/scene-format.md")]

mod access;
mod beside;
mod chain;
mod check;
mod copy;
mod document;
mod doubt;
mod drives;
mod elements;
mod error;
mod expression;
mod field;
mod format;
mod formula;
mod given;
mod include;
mod key;
mod load;
mod mesh_unit;
mod model;
mod numbers;
mod outline;
mod own;
mod parameters;
mod pattern;
mod points;
mod quantity;
mod read;
mod read_bodies;
mod read_joints;
mod reading;
mod roles;
mod solid;
mod table;
#[cfg(test)]
mod tests;
mod units;
mod value;
mod visible;
mod write;

pub use beside::{LARGEST_FILE, LARGEST_MESH, file_bytes, largest_file};
pub use check::least_impact_steps;
pub use doubt::{Doubt, Warning, WarningKind};
pub use drives::DRIVE_KINDS;
pub use elements::ELEMENT_KINDS;
pub use error::SceneError;
pub use expression::{Binary, ExpressionError, Fault, LONGEST_EXPRESSION, Number, Program, Unary, smooth_step};
pub use format::{FILE, file_tables};
pub use given::{FileNumber, OwnParameter};
pub use key::{ABOVE_ZERO, Absent, FileKey, FileTable, Many, Takes, Variants};
pub use load::*;
pub use model::*;
pub use outline::{OutlineFault, fill};
pub use parameters::*;
pub use quantity::{DimensionError, Quantity, evaluate};
pub use table::{find, reference_page, table};
pub use units::*;
pub use value::Value;
pub use visible::{visible, visible_line};

/// The parameter of any scene (by its key or the last part of it) or other word from `words` nearest to `wrong`, as errors
/// quote it: in brackets, or empty.
pub fn suggest_parameter(wrong: &str, words: &[&'static str]) -> String {
    let keys = table().iter().map(|parameter| parameter.key);
    error::nearest_parameter(wrong, keys, words)
}

/// The one of `names` nearest to `wrong`, as errors quote it: in brackets, or empty.
pub fn suggest<'a>(wrong: &str, names: impl IntoIterator<Item = &'a str>) -> String {
    error::nearest(wrong, names)
}
