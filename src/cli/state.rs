//! `run --save-state` and `--from-state`: a file with the state at the end of a run, from which a later run resumes with the
//! same bits.

use std::io::Write as _;
use std::path::Path;

use serde_json::{Map, Value as Json};

use super::Failure;
use super::provenance::{WRITER, meta};
use crate::files::{FileError, OutputFile, PendingFile};
use crate::scene::{LiveScene, ReadError, SavedState, Scene, SceneSnapshot, read_regular, visible_line};

/// Size limit of a state file, bytes.
const MAX_SIZE: u64 = 1 << 30;

/// Output file for the state of a run, claimed and checked to be writable before the run starts.
pub struct StateFile {
    file: OutputFile,
    saved: Option<SceneSnapshot>,
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

    /// The file.
    pub fn file(&mut self) -> &mut OutputFile {
        &mut self.file
    }

    /// To be called before every step of a run that ends at `end`, s. Saves the state before the first step that `end`
    /// truncates, because a longer run would not truncate it.
    pub fn watch(&mut self, simulation: &LiveScene, end: f64) {
        if self.saved.is_none() && simulation.is_truncated_by(end) {
            self.saved = Some(simulation.snapshot());
        }
    }

    /// The state as file content.
    ///
    /// # Errors
    /// A value that is not finite, which JSON cannot represent.
    pub fn text(&self, simulation: &LiveScene) -> Result<String, Failure> {
        let saved = self.saved.clone().unwrap_or_else(|| simulation.snapshot());
        SavedState::write(WRITER, simulation.pending(), &saved, simulation.time())
            .map_err(|why| FileError::cannot(self.file.path(), why).into())
    }

    /// Writes `text` under a temporary name.
    ///
    /// # Errors
    /// A file system error.
    pub fn fill(self, text: &str) -> Result<PendingFile, Failure> {
        Ok(self.file.fill(|out| out.write_all(text.as_bytes()))?)
    }
}

/// Reads the state of a run of `scene`.
///
/// # Errors
/// An unreadable or damaged file; a state of another scene, other parameters or another version of the program.
pub fn read(path: &Path, scene: &Scene) -> Result<SavedState, Failure> {
    let name = path.display();
    let refuse = |why: String| Failure::usage(format!("--from-state {name}: {why}"));
    let text = read_regular(path, MAX_SIZE).map_err(|cause| match cause {
        ReadError::TooLarge(_) => refuse(format!("{cause}: not a state that `run --save-state` wrote")),
        _ => Failure::io(format!("--from-state {name}: {cause}")),
    })?;
    let saved = SavedState::read(WRITER, &text).map_err(|why| refuse(why.to_string()))?;
    check_scene(&saved.meta, scene).map_err(&refuse)?;
    Ok(saved)
}

/// Rejects a state whose provenance `saved` describes a scene other than `scene`; the error is text.
fn check_scene(saved: &Json, scene: &Scene) -> Result<(), String> {
    if saved["scene_text"] != *scene.source.text {
        return Err(format!(
            "a state of the scene `{}`, whose text differs from that of the scene given, `{}`: a run resumes only in \
             the scene in which it began",
            word(&saved["scene"]),
            scene.name
        ));
    }
    let (then, beside) = (&saved["scene_files"], &scene.source.beside);
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
    let (changed, now) = (&saved["changed_parameters"], &meta(scene)["changed_parameters"]);
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
