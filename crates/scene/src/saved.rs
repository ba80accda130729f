//! States of runs as text, which `run --save-state` writes to a file and Python to a pickle.

use super::{Scene, SceneError, Texts, insert_texts, provenance};
use jointplay_physics::simulate::Snapshot;
use serde::Deserialize as _;
use serde_json::{Map, Value as Json, json};

/// Version of the layout.
const FORMAT: u64 = 12;

/// A state of a run, with the scene to which it belongs.
#[derive(Clone, Debug)]
pub struct SavedState {
    /// Provenance of the run and texts of its scene; an object.
    pub meta: Json,
    /// The state, and what looking at the run had found.
    pub snapshot: Snapshot,
    /// Time at which the run that saved it ended, s.
    pub time: f64,
}

/// Why a text is not a resumable state, or a state cannot be written as text.
#[derive(Debug, thiserror::Error)]
pub enum SavedStateError {
    /// A number that JSON cannot represent.
    #[error("the state holds a value that is not a number")]
    NotFinite,
    /// Not JSON.
    #[error("not a state that `run --save-state` wrote, or a damaged one: {0}")]
    Text(#[from] serde_json::Error),
    /// JSON from elsewhere.
    #[error("not a state that `run --save-state` wrote")]
    Foreign,
    /// Written by a version of the program, or in a layout, that this one does not resume.
    #[error(
        "written by version {version} of the program, in format {format}; this is version {own}, format {FORMAT}, and only \
         the same version resumes with the same bits"
    )]
    Version {
        /// Version that wrote it, as written.
        version: String,
        /// Its layout, as written.
        format: String,
        /// Version that reads it.
        own: String,
    },
    /// Changed since it was written.
    #[error("damaged: the checksum of its content is {found}, not {stated} as it states")]
    Checksum {
        /// Of the content.
        found: String,
        /// As written.
        stated: String,
    },
    /// Parts are missing.
    #[error("incomplete: the state or its time is missing")]
    Incomplete,
    /// The content is not a state.
    #[error("not a state: {0}")]
    State(serde_json::Error),
}

impl SavedState {
    /// The text of `snapshot`, of a run of `scene` that ended at `time`, s, written by a program with this name and version.
    ///
    /// # Errors
    /// A value that is not finite, which JSON cannot represent.
    pub fn write(program: [&str; 2], scene: &Scene, snapshot: &Snapshot, time: f64) -> Result<String, SavedStateError> {
        let mut meta = provenance(program, scene);
        meta.insert("state_format".into(), json!(FORMAT));
        // Rows of a resumed run begin here.
        meta.insert("time_s".into(), json!(time));
        meta.insert("step_end_s".into(), json!(snapshot.time()));
        insert_texts(&mut meta, scene);
        let values = serde_json::to_value(snapshot).unwrap_or_default();
        let read = Snapshot::deserialize(&values).ok();
        if read.map(|read| read.with_elements_of(snapshot)).as_ref() != Some(snapshot) {
            return Err(SavedStateError::NotFinite);
        }
        let mut content = Map::new();
        content.insert("meta".into(), Json::Object(meta));
        if let Json::Object(parts) = values {
            content.extend(parts);
        }
        content.insert("crc32".into(), json!(checksum(&content)));
        Ok(Json::Object(content).to_string())
    }

    /// Reads the text of a state for a program with this name and version.
    ///
    /// # Errors
    /// A damaged text, or one of another version of the program.
    pub fn read([program, version]: [&str; 2], text: &[u8]) -> Result<Self, SavedStateError> {
        let mut content: Map<String, Json> = serde_json::from_slice(text)?;
        let stated = content.shift_remove("crc32");
        let meta = |key: &str| &content.get("meta").unwrap_or(&Json::Null)[key];
        if meta("program") != program || meta("state_format").is_null() {
            return Err(SavedStateError::Foreign);
        }
        if *meta("version") != version || *meta("state_format") != FORMAT {
            let [written, format] = ["version", "state_format"].map(|key| plain(meta(key)));
            return Err(SavedStateError::Version { version: written, format, own: version.to_owned() });
        }
        let found = checksum(&content);
        if stated != Some(json!(found)) {
            return Err(SavedStateError::Checksum { found, stated: plain(&stated.unwrap_or_default()) });
        }
        let time = meta("time_s").as_f64();
        let meta = content.shift_remove("meta").unwrap_or_default();
        let Some(time) = time.filter(|_| content.contains_key("state")) else {
            return Err(SavedStateError::Incomplete);
        };
        let snapshot = Snapshot::deserialize(Json::Object(content)).map_err(SavedStateError::State)?;
        Ok(Self { meta, snapshot, time })
    }

    /// The scene of the run, with its changes, from the texts beside the state.
    ///
    /// # Errors
    /// The texts are not a scene.
    pub fn scene(&self) -> Result<Scene, SceneError> {
        let texts = |key: &str| {
            let all = self.meta[key].as_object().into_iter().flatten();
            all.map(|(name, text)| (name.clone(), text.as_str().unwrap_or_default().to_owned())).collect::<Vec<_>>()
        };
        let beside: Texts = texts("scene_files").into_iter().map(|(name, text)| (name, text.into())).collect();
        let text = self.meta["scene_text"].as_str().unwrap_or_default();
        Scene::parse_with(text, self.meta["scene_file"].as_str(), &beside, &texts("changed_parameters"))
    }
}

/// A value as messages quote it.
fn plain(value: &Json) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// CRC-32 of the content as compact JSON, independent of the layout of the text, as eight hexadecimal digits.
fn checksum(content: &Map<String, Json>) -> String {
    let text = serde_json::to_string(content).unwrap_or_default();
    format!("{:08x}", crc32fast::hash(text.as_bytes()))
}
