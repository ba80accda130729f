//! Provenance of an output: program version, scene, changed parameters and method. Every output carries it.

use serde_json::{Map, Value as Json, json};

#[cfg(feature = "gui")]
use super::Failure;
use crate::files::PROGRAM;
use crate::scene::Scene;

/// The common part of every output's `meta`.
pub fn meta(scene: &Scene) -> Map<String, Json> {
    let mut meta = Map::new();
    meta.insert("program".into(), json!(PROGRAM));
    meta.insert("version".into(), json!(crate::VERSION));
    meta.insert("scene".into(), json!(scene.name));
    meta.insert("scene_file".into(), json!(scene.source.file));
    // The last change of a key wins, here as in the scene.
    let changed: Map<String, Json> = scene
        .changes
        .iter()
        .map(|(key, value)| (key.clone(), json!(value)))
        .collect();
    meta.insert("changed_parameters".into(), Json::Object(changed));
    meta.insert("formulation".into(), json!(scene.formulation));
    meta.insert("method".into(), json!(scene.solver.method));
    meta.insert("step_s".into(), json!(scene.solver.step));
    if scene.solver.method.is_adaptive() {
        meta.insert("tolerance".into(), json!(scene.solver.tolerance));
    }
    meta
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
    for (key, value) in scene
        .changes
        .iter()
        .filter(|(key, _)| key.starts_with("joint."))
    {
        all.insert(key.clone(), json!(value));
    }
    Ok(Json::Object(all))
}
