//! Provenance of an output: program version, scene, changed parameters and method. Every output carries it.

use serde_json::{Map, Value as Json, json};

#[cfg(feature = "gui")]
use super::Failure;
use crate::files::PROGRAM;
use crate::integrate::StepControl;
use crate::scene::{Scene, file_bytes};

/// The common part of every output's `meta`.
pub fn meta(scene: &Scene) -> Map<String, Json> {
    let mut meta = Map::new();
    meta.insert("program".into(), json!(PROGRAM));
    meta.insert("version".into(), json!(crate::VERSION));
    meta.insert("scene".into(), json!(scene.name));
    meta.insert("scene_file".into(), json!(scene.source.file));
    // The last change of a key wins, here as in the scene.
    let changed: Map<String, Json> = scene.changes.iter().map(|(key, value)| (key.clone(), json!(value))).collect();
    meta.insert("changed_parameters".into(), Json::Object(changed));
    // Present only if the scene needs files besides its own.
    let checksum = |text: &str| json!(format!("{:08x}", crc32fast::hash(&file_bytes(text))));
    insert_files(&mut meta, "scene_files_crc32", scene, checksum);
    meta.insert("formulation".into(), json!(scene.machine.formulation));
    meta.insert("method".into(), json!(scene.machine.solver.method));
    meta.insert("step_s".into(), json!(scene.machine.solver.step));
    match scene.machine.solver.method.control() {
        StepControl::Fixed => {}
        StepControl::Error => {
            meta.insert("tolerance".into(), json!(scene.machine.solver.tolerance));
        }
        StepControl::PerImpact => {
            meta.insert("steps_per_impact".into(), json!(scene.machine.solver.steps_per_impact));
        }
    }
    meta
}

/// Adds the texts of `scene`, which reproduce it with the changed parameters even if its files are gone.
pub fn insert_texts(meta: &mut Map<String, Json>, scene: &Scene) {
    meta.insert("scene_text".into(), json!(scene.source.text));
    insert_files(meta, "scene_files", scene, |text| json!(text));
}

/// Adds under `key` the value of `of` for the text of each file that `scene` names, if any.
fn insert_files(meta: &mut Map<String, Json>, key: &str, scene: &Scene, of: impl Fn(&str) -> Json) {
    let texts = scene.source.beside.iter();
    let files: Map<String, Json> = texts.map(|(name, text)| (name.clone(), of(text))).collect();
    if !files.is_empty() {
        meta.insert(key.into(), Json::Object(files));
    }
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
