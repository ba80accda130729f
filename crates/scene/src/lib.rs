//! Scenes as data: a text file, the machine it describes, and the single parameter table.
//!
//! [`Scene::load`] reads a built-in scene or a file, [`Scene::parse`] a text. Errors name the line, the key and the allowed
//! values ([`SceneError`]). A [`Scene`] holds the [`Machine`] to simulate and changes it by key ([`Scene::set`]);
//! [`table()`] lists the keys. A [`LiveScene`] changes parameters during a run.
//!
//! ```
//! use jointplay_physics::simulate::Effect;
//! use jointplay_scene::{LiveScene, Scene};
//!
//! let mut scene = Scene::load("pendulum", &[])?;
//! scene.set("contact.clearance", "0.2 mm")?;
//! assert_eq!(scene.machine.loose_joints[0].contact.clearance, 0.2e-3);
//! let error = scene.set("contact.clearence", "0.2 mm").unwrap_err();
//! assert!(error.to_string().contains("did you mean `contact.clearance`?"));
//!
//! let mut live = LiveScene::new(&scene)?;
//! live.advance_to(0.1)?;
//! assert_eq!(live.set("contact.friction", "0.3")?, Effect::Now);
//! // Without play the ball joint is a constraint: other equations, from the next reset on.
//! assert_eq!(live.set("contact.clearance", "0 mm")?, Effect::AtReset);
//! live.reset()?;
//! assert_eq!(live.running().machine.loose_joints[0].contact.clearance, 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The rest of this page is the manual of the file format.
//!
#![cfg_attr(any(doc, doctest), doc = include_str!("../../../docs/scene-format.md"))]
#![cfg_attr(not(test), warn(clippy::disallowed_methods, clippy::disallowed_types))]

mod access;
mod assets;
mod check;
mod closed_form;
mod document;
mod drives;
mod elements;
mod error;
mod field;
#[expect(clippy::disallowed_methods, reason = "reads within a limit")]
mod file;
mod file_number;
mod format;
mod formula;
mod include;
mod instance;
mod key;
mod live;
mod load;
#[expect(clippy::disallowed_types, reason = "mesh files hold single-precision numbers")]
pub mod mesh;
mod model;
mod numbers;
mod parameters;
mod pattern;
mod placement;
mod play;
mod points;
mod provenance;
mod quantity;
mod read;
mod read_bodies;
mod read_joints;
mod reading;
mod saved;
mod sticks;
mod table;
#[cfg(test)]
mod tests;
mod user_parameters;
mod value;
mod visible;
mod write;

pub use access::check_solver_changes;
pub use assets::{MAX_FILE_SIZE, MAX_MESH_SIZE, file_bytes, max_file_size};
pub use drives::{DRIVE_LAWS, DriveLaw};
pub use elements::is_element;
pub use error::SceneError;
pub use file::{ReadError, open_regular, read_regular};
pub use file_number::FileNumber;
pub use format::{FILE, file_tables};
pub use key::{ABOVE_ZERO, DefaultRule, FileKey, FileTable, ListLimit, ValueType, Variants};
pub use live::{LiveScene, SceneSnapshot, SetError};
pub use load::*;
pub use model::*;
pub use numbers::OWN_GROUP;

pub use parameters::*;
pub use provenance::{insert_texts, provenance};
pub use quantity::{DimensionError, Quantity, evaluate};
pub use saved::{SavedState, SavedStateError};
pub use sticks::sticks;
pub use table::{find, reference_page, table};
pub use value::Value;
pub use visible::{visible, visible_line};

use jointplay_physics::machine::{
    Attachment, Body, Drive, Formulation, Freedom, Geometry, Harmonic, Joint, JointKind, JointStart, LooseJoint,
    Machine, Mat3, Output, Preset, Quat, Role, Shape, StartRule, Vec3,
};
use jointplay_physics::units::{Dimension, format_quantity, parse_quantity, si_unit, unit_names};

/// A hint for error messages: the parameter nearest to `wrong`, by its key or last key part, or the nearest of `words`; in
/// brackets, or empty if none is near.
pub fn suggest_parameter(wrong: &str, words: &[&'static str]) -> String {
    let keys = table().iter().map(|parameter| parameter.key);
    error::nearest_parameter(wrong, keys, words)
}
