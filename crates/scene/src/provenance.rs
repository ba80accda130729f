//! Provenance of an output: program version, scene, changed parameters and method. Every output carries it.

use super::{Scene, file_bytes};
use jointplay_physics::integrate::StepControl;
use serde_json::{Map, Value as Json, json};

/// The common part of every output's `meta`, for a program with this name and version.
pub fn provenance([program, version]: [&str; 2], scene: &Scene) -> Map<String, Json> {
    let mut meta = Map::new();
    meta.insert("program".into(), json!(program));
    meta.insert("version".into(), json!(version));
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
    meta.insert("scene_text".into(), json!(&*scene.source.text));
    insert_files(meta, "scene_files", scene, |text| json!(text));
}

/// Adds under `key` the value that `value_of` returns for the text of each file that `scene` names, if any.
fn insert_files(meta: &mut Map<String, Json>, key: &str, scene: &Scene, value_of: impl Fn(&str) -> Json) {
    let texts = scene.source.beside.iter();
    let files: Map<String, Json> = texts.map(|(name, text)| (name.clone(), value_of(text))).collect();
    if !files.is_empty() {
        meta.insert(key.into(), Json::Object(files));
    }
}
