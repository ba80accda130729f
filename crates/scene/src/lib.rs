//! Scenes as data: what a mechanism consists of, its file format, and the single table of its parameters.
//!
#![doc = include_str!("../../../docs/scene-format.md")]

mod access;
mod assets;
mod chain;
mod check;
mod document;
mod drives;
mod elements;
mod error;
mod field;
mod format;
mod formula;
mod given;
mod include;
mod key;
mod live;
mod load;
pub mod mesh;
mod model;
mod numbers;
mod outline;
mod own;
mod parameters;
mod pattern;
mod pattern_instance;
mod placement;
mod points;
mod quantity;
mod read;
mod read_bodies;
mod read_joints;
mod reading;
mod table;
#[cfg(test)]
mod tests;
mod value;
mod visible;
mod write;

pub use access::contact_value;
pub use assets::{LARGEST_FILE, LARGEST_MESH, file_bytes, largest_file};
pub use drives::{DRIVE_LAWS, DriveLaw};
pub use elements::is_element;
pub use error::SceneError;
pub use format::{FILE, file_tables};
pub use given::{FileNumber, UserParameter};
pub use key::{ABOVE_ZERO, DefaultRule, FileKey, FileTable, ListLimit, ValueType, Variants};
pub use live::{LiveScene, SceneSnapshot, SetError};
pub use load::*;
pub use model::*;
pub use outline::{OutlineFault, fill};
pub use parameters::*;
pub use quantity::{DimensionError, Quantity, evaluate};
pub use table::{find, reference_page, table};
pub use value::Value;
pub use visible::{visible, visible_line};

use jointplay_physics::machine::{
    Attachment, BallJoint, Body, Drive, Formulation, Freedom, Geometry, Harmonic, Joint, JointKind, JointStart,
    Machine, Mat3, Output, Preset, Quat, Role, Shape, Spcmm, StartRule, Vec3,
};
use jointplay_physics::units::{Dimension, format_quantity, parse_quantity, si_unit, unit_names};

/// The parameter of any scene (by its key or the last part of it) or other word from `words` nearest to `wrong`, as errors
/// quote it: in brackets, or empty.
pub fn suggest_parameter(wrong: &str, words: &[&'static str]) -> String {
    let keys = table().iter().map(|parameter| parameter.key);
    error::nearest_parameter(wrong, keys, words)
}
