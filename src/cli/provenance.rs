//! Provenance of an output: program version, scene, changed parameters and method. Every output carries it.

#[cfg(feature = "gui")]
use serde_json::json;
use serde_json::{Map, Value as Json};

#[cfg(feature = "gui")]
use super::Failure;
use crate::files::PROGRAM;
use crate::scene::{Scene, provenance};

/// Name and version of this program.
pub const WRITER: [&str; 2] = [PROGRAM, crate::VERSION];

/// The common part of every output's `meta`.
pub fn meta(scene: &Scene) -> Map<String, Json> {
    provenance(WRITER, scene)
}

/// Every parameter of `scene` with its value as a user would write it.
///
/// # Errors
/// None for a scene that was parsed.
#[cfg(feature = "gui")]
pub fn parameters(scene: &Scene) -> Result<Json, Failure> {
    let mut all = Map::new();
    for parameter in scene.parameters() {
        let value = scene.get(parameter.key)?;
        all.insert(parameter.key.to_owned(), json!(parameter.write(&value)));
    }
    for (key, value) in scene.changes.iter().filter(|(key, _)| key.starts_with("joint.")) {
        all.insert(key.clone(), json!(value));
    }
    Ok(Json::Object(all))
}
