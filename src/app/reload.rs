//! Reloads the displayed scene file when another program saves it or a file it refers to.

use std::collections::BTreeMap;

use eframe::egui;

use super::App;
use super::host::OpenedFile;
use crate::scene::{Scene, SceneError};

/// Longest stepping time, s, to reach the previously displayed instant again; otherwise the run restarts at 0.
const MAX_REPLAY_TIME: f64 = 0.4;

/// The file of the displayed scene, if any.
#[derive(Debug, Default)]
pub(super) struct SceneFile {
    name: Option<String>,
    /// Referenced files that the host also watches; `None` until the host is told.
    watched: Option<Vec<String>>,
    /// The referenced file with an error. The displayed scene may lack it.
    faulty: Option<String>,
    /// Files opened together with the scene file.
    companions: FileContents,
    /// Changes stored in a file or delivered with the scene: those at the first check.
    saved: Option<Changes>,
    /// Whether the user saved the scene in this window.
    saved_here: bool,
}

/// Changed parameters with their values.
type Changes = Vec<(String, String)>;

/// Contents of files by their names without folders.
pub(super) type FileContents = BTreeMap<String, Vec<u8>>;

impl SceneFile {
    /// The file `name` as entered by the user; the host is not told yet.
    pub(super) fn named(name: Option<String>) -> Self {
        Self { name, ..Self::default() }
    }

    /// The file `name`, opened together with the files `companions`.
    pub(super) fn opened(name: String, companions: FileContents) -> Self {
        Self { companions, ..Self::named(Some(name)) }
    }

    /// Records that the scene was saved with `changes`.
    pub(super) fn record_saved(&mut self, changes: Changes) {
        self.saved = Some(changes);
        self.saved_here = true;
    }

    /// Whether `changes` equal the saved ones; `None` before the first check.
    pub(super) fn is_saved_with(&self, changes: &Changes) -> Option<bool> {
        Some(self.saved.as_ref()? == changes)
    }

    /// Whether the scene is stored in a file.
    pub(super) fn has_file(&self) -> bool {
        self.saved_here || self.name.is_some()
    }

    /// Name of the file.
    pub(super) fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }
}

impl App {
    /// Makes the host watch the files of the scene, and reloads the scene after a save.
    pub(super) fn receive_saved_scene(&mut self, ctx: &egui::Context) {
        // The changes of a link arrive with its replay.
        let has_changes = self.tasks.replay().is_none();
        let file = &mut self.files.scene;
        let pending = self.run.player.pending();
        if has_changes && file.saved.is_none() {
            file.saved = Some(pending.changes.clone());
        }
        let beside = &pending.source.beside;
        let faulty = file.faulty.as_ref();
        let faulty = faulty.filter(|faulty| !beside.contains_key(*faulty));
        let names = beside.keys().chain(faulty).filter(|_| file.name.is_some());
        let watched = file.watched.as_ref();
        if watched.is_none_or(|watched| !names.clone().eq(watched)) {
            let names: Vec<String> = names.cloned().collect();
            self.host.watch(ctx, file.name.as_deref(), &names);
            file.watched = Some(names);
        }
        while let Some(file) = self.host.saved_elsewhere() {
            // The latest message may concern a file that is no longer displayed.
            if self.files.scene.name() == Some(&file.name)
                && let Err(reason) = self.reload(file)
            {
                self.messages.fail(reason);
            }
        }
    }

    /// Parses `text`, the content of the file `name`, with the files it refers to as they are now, or as in `companions`.
    pub(super) fn parse_file(
        &self,
        name: &str,
        text: &str,
        companions: &FileContents,
        changes: &[(String, String)],
    ) -> Result<Scene, SceneError> {
        let folder = self.host.folder(name);
        Scene::parse_given(text, Some(name), companions, folder.as_deref(), changes)
    }

    /// Shows the scene of `file` with the changes made here, except where the file now has a different value. View and plots are
    /// preserved, and so is the instant if it is reached quickly. On an error the running scene is unchanged.
    fn reload(&mut self, file: OpenedFile) -> Result<(), String> {
        let name = file.name;
        let bytes = file.content.map_err(|reason| format!("{name}: {reason}"))?;
        let text = String::from_utf8(bytes).map_err(|_| format!("{name}: not a text file"))?;
        let pending = self.run.player.pending();
        let source = &pending.source;
        let has_same_files = |scene: Scene| scene.source.beside == source.beside;
        let same = *text == *source.text;
        let companions = self.files.scene.companions.clone();
        if same && (self.parse_file(&name, &text, &companions, &pending.changes)).is_ok_and(has_same_files) {
            // Saved without changes, or reverted after an error.
            self.messages.dismiss_problem();
            self.files.scene.faulty = None;
            return Ok(());
        }
        let before = pending.with_changes(&[]);
        let after = match self.parse_file(&name, &text, &companions, &[]) {
            Ok(after) => after,
            Err(error) => {
                let file = error.file.clone();
                self.files.scene.faulty = file.filter(|file| *file != name);
                return Err(error.to_string());
            }
        };
        let is_unchanged_in_file = |key: &str| {
            let before = before.as_ref().ok().and_then(|scene| scene.get(key).ok());
            before.is_some() && before == after.get(key).ok()
        };
        let mut changes = self.run.player.pending().changes.clone();
        changes.retain(|(key, _)| is_unchanged_in_file(key));
        let scene = self.parse_file(&name, &text, &companions, &changes);
        let scene = scene.map_err(|error| error.to_string())?;

        let link = self.link();
        let (playing, twin) = (self.run.player.is_playing(), self.run.player.twin().is_some());
        let (phase, time) = (self.run.player.watch().phase(), self.run.player.pacer.shown());
        let watched = self.files.scene.watched.clone();
        let (scale, chosen, window) =
            (self.run.player.pacer.scale(), self.run.plots.chosen.clone(), self.run.plots.window);
        self.show_scene(&scene)?;
        self.hint.end();
        self.run.player.pacer.set_scale(scale);
        (self.run.plots.chosen, self.run.plots.window) = (chosen, window);
        self.files.scene = SceneFile { watched, ..SceneFile::opened(name, companions) };
        self.run.player.set_phase(phase);
        let (clock, start) = (self.run.player.clock, (self.run.player.clock)());
        let reached = self.run.player.run_towards(time, || clock() - start < MAX_REPLAY_TIME);
        if !reached {
            self.reset();
        }
        self.run.player.set_twin(twin);
        self.run.player.set_playing(playing);
        if let Some(pose) = link.camera {
            self.run.viewport.set_pose(pose);
        }
        let followed = link.followed_part(&scene).ok().flatten();
        self.run.viewport.follow(followed);
        match link.microscope_joint(&scene) {
            Ok(Some(joint)) => self.run.microscope.focus(joint),
            _ => self.run.microscope.set_open(false),
        }
        self.run.viewport.clear_history(&self.run.player);
        let at = if reached && time > 0.0 {
            format!("at {:.3} ms", self.run.player.pacer.shown() * 1e3)
        } else {
            "from the start".to_owned()
        };
        let kept_changes = match changes.len() {
            0 => String::new(),
            1 => ", keeping 1 change".to_owned(),
            more => format!(", keeping {more} changes"),
        };
        self.messages.notify(format!("Reloaded {at}{kept_changes}"));
        Ok(())
    }
}
