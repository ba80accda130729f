//! `run --save-state` and `--from-state`: a file with the state at the end of a run, from which a later run resumes with the
//! same bits.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::path::Path;

use serde::Deserialize as _;
use serde_json::{Map, Value as Json, json};

use super::{Failure, provenance};
use crate::files::{FileError, OutputFile, PROGRAM, PendingFile};
use crate::scene::LiveScene;
use crate::scene::{Scene, visible_line};
use crate::simulate::State;

/// Version of the file layout.
const FORMAT: u64 = 5;
/// Size limit of a state file, bytes.
const LARGEST: u64 = 1 << 30;

/// Output file for the state of a run, claimed and known to be writable before the run starts.
pub struct StateFile {
    file: OutputFile,
    saved: Option<State>,
}

impl StateFile {
    /// Checks that `path` can be written.
    ///
    /// # Errors
    /// As [`OutputFile::claim`].
    pub fn claim(path: &Path, force: bool) -> Result<Self, Failure> {
        let file = OutputFile::claim(path, force)?;
        Ok(Self { file, saved: None })
    }

    /// To be called before every step of a run that ends at `end`, s. Saves the state before the first step that `end`
    /// truncates, because a longer run would not truncate it.
    pub fn watch(&mut self, simulation: &LiveScene, end: f64) {
        if self.saved.is_none() && simulation.is_cut_by(end) {
            self.saved = Some(simulation.state().clone());
        }
    }

    /// The state as file content.
    ///
    /// # Errors
    /// A value that is not finite, which JSON cannot represent.
    pub fn text(&self, simulation: &LiveScene) -> Result<String, Failure> {
        let saved = match &self.saved {
            Some(saved) => saved,
            None => simulation.state(),
        };
        let scene = simulation.pending();
        let mut meta = provenance::meta(scene);
        meta.insert("state_format".into(), json!(FORMAT));
        // Rows of a resumed run begin here.
        meta.insert("time_s".into(), json!(simulation.time()));
        meta.insert("step_end_s".into(), json!(saved.time()));
        provenance::insert_texts(&mut meta, scene);
        let state = serde_json::to_value(saved).unwrap_or_default();
        if State::deserialize(&state).ok().as_ref() != Some(saved) {
            let why = "the state holds a value that is not a number";
            return Err(FileError::cannot(self.file.path(), why).into());
        }
        let mut content = Map::new();
        content.insert("meta".into(), Json::Object(meta));
        content.insert("state".into(), state);
        content.insert("crc32".into(), json!(checksum(&content)));
        Ok(Json::Object(content).to_string())
    }

    /// Writes `text` under a temporary name.
    ///
    /// # Errors
    /// A file system error.
    pub fn fill(self, text: &str) -> Result<PendingFile, Failure> {
        Ok(self.file.fill(|out| out.write_all(text.as_bytes()))?)
    }
}

/// A state from which a run resumes.
pub struct Checkpoint {
    /// The state.
    pub state: State,
    /// Time at which the run that saved it ended, s.
    pub time: f64,
}

/// Reads the state of a run of `scene`.
///
/// # Errors
/// An unreadable or damaged file; a state of another scene, other parameters or another version of the program.
pub fn read(path: &Path, scene: &Scene) -> Result<Checkpoint, Failure> {
    let name = path.display();
    let mut text = Vec::new();
    File::open(path)
        .and_then(|file| file.take(LARGEST + 1).read_to_end(&mut text))
        .map_err(|cause| Failure::io(format!("--from-state: cannot read {name}: {cause}")))?;
    let refuse = |why: String| Failure::usage(format!("--from-state {name}: {why}"));
    if text.len() as u64 > LARGEST {
        return Err(refuse(format!("larger than {} GiB: not a state that `run --save-state` wrote", LARGEST >> 30)));
    }
    let mut content: Map<String, Json> = serde_json::from_slice(&text)
        .map_err(|cause| refuse(format!("not a state that `run --save-state` wrote, or a damaged one: {cause}")))?;
    let told = content.shift_remove("crc32");
    let meta = |key: &str| &content.get("meta").unwrap_or(&Json::Null)[key];
    if meta("program") != PROGRAM || meta("state_format").is_null() {
        return Err(refuse("not a state that `run --save-state` wrote".to_owned()));
    }
    if *meta("version") != crate::VERSION || *meta("state_format") != FORMAT {
        return Err(refuse(format!(
            "written by version {} of the program, in format {}; this is version {}, format {FORMAT}, and only the same \
             version resumes with the same bits",
            word(meta("version")),
            word(meta("state_format")),
            crate::VERSION,
        )));
    }
    let found = checksum(&content);
    if told != Some(json!(found)) {
        return Err(refuse(format!(
            "damaged: the checksum of its content is {found}, not {} as it states",
            word(&told.unwrap_or_default())
        )));
    }
    check_scene(content.get("meta").unwrap_or(&Json::Null), scene).map_err(&refuse)?;
    let time = meta("time_s").as_f64();
    let state = content.get("state").map(State::deserialize);
    let (Some(time), Some(state)) = (time, state) else {
        return Err(refuse("incomplete: the state or its time is missing".to_owned()));
    };
    let state = state.map_err(|cause| refuse(format!("not a state: {cause}")))?;
    Ok(Checkpoint { state, time })
}

/// Rejects a state whose `meta` describes a scene other than `scene`; the error is text.
fn check_scene(meta: &Json, scene: &Scene) -> Result<(), String> {
    if meta["scene_text"] != *scene.source.text {
        return Err(format!(
            "a state of the scene `{}`, whose text differs from that of the scene given, `{}`: a run resumes only in \
             the scene in which it began",
            word(&meta["scene"]),
            scene.name
        ));
    }
    let (then, beside) = (&meta["scene_files"], &scene.source.beside);
    let names = then.as_object().into_iter().flat_map(Map::keys);
    let differs = |name: &&String| beside.get(*name).is_none_or(|now| then[*name] != **now);
    if let Some(name) = names.chain(beside.keys()).find(differs) {
        return Err(format!(
            "a state of the scene `{}`, whose file {} has changed since: a run resumes only in the scene in which it \
             began",
            scene.name,
            visible_line(name)
        ));
    }
    let (changed, now) = (&meta["changed_parameters"], &provenance::meta(scene)["changed_parameters"]);
    if changed == now {
        return Ok(());
    }
    let options = |changes: &Json| {
        let changes = changes.as_object().into_iter().flatten();
        let options: Vec<String> = changes.map(|(key, value)| format!("--set {key}={}", word(value))).collect();
        if options.is_empty() { "no --set".to_owned() } else { options.join(" ") }
    };
    Err(format!(
        "saved with {}, but the scene has {}: a run resumes only with the parameters with which it began",
        options(changed),
        options(now)
    ))
}

/// A value as messages quote it.
fn word(value: &Json) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// CRC-32 of the content as compact JSON, independent of the file's layout, as eight hexadecimal digits.
fn checksum(content: &Map<String, Json>) -> String {
    let text = serde_json::to_string(content).unwrap_or_default();
    format!("{:08x}", crc32fast::hash(text.as_bytes()))
}
