//! What made an output: program version, scene, changed parameters and method. Every output carries it.

use serde_json::{Map, Value as Json, json};

use super::Failure;
use crate::files::PROGRAM;
use crate::scene::{Scene, Value};

/// The common part of every output's `meta`.
///
/// # Errors
/// Usage: a scene without the keys that every scene has.
pub fn meta(scene: &Scene) -> Result<Map<String, Json>, Failure> {
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
    meta.insert("formulation".into(), json!(choice(scene, "formulation")?));
    meta.insert("method".into(), json!(choice(scene, "solver.method")?));
    meta.insert("step_s".into(), json!(scene.solver.step));
    if scene.solver.method.is_adaptive() {
        meta.insert("tolerance".into(), json!(scene.solver.tolerance));
    }
    Ok(meta)
}

/// The word that `key` has in `scene`.
///
/// # Errors
/// A key that the scene has not.
pub fn choice(scene: &Scene, key: &str) -> Result<&'static str, Failure> {
    match scene.get(key)? {
        Value::Choice(word) => Ok(word),
        Value::Number(_) | Value::Count(_) | Value::Unset => Ok("-"),
    }
}

/// Every parameter of `scene` with its value as a user would write it.
///
/// # Errors
/// As [`meta`].
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
