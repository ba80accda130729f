//! Settings of the desktop window across sessions: size, theme, type size, scene, and recent files. Test windows and headless
//! frames have no [`Store`] and neither read nor write settings.

use std::path::{Path, PathBuf};

use eframe::egui::{self, RichText, ThemePreference, Ui};
use serde::{Deserialize, Serialize};

use super::files::SCENE_TYPE;
use super::host::SaveFile;
use super::present::Presentation;
use super::{AppOptions, layout, theme};
use crate::files::{FileError, OutputFile, create_dir_all};
use crate::scene::{MAX_FILE_SIZE, Scene, built_in_text, read_regular};
use crate::session::link::ThemeChoice;
use crate::simulate::Simulation;
use crate::words::Words as _;

/// Length of the list of recent files.
const MAX_RECENT: usize = 8;
/// Least time between two writes while the window changes, s.
const MIN_WRITE_INTERVAL: f64 = 5.0;
/// Plausible window lengths, points, and zoom factors.
const WINDOW_LENGTHS: std::ops::RangeInclusive<f32> = 200.0..=20_000.0;
const ZOOM_FACTORS: std::ops::RangeInclusive<f32> = 0.2..=5.0;
/// Initial size of the window, points.
pub(super) const INITIAL_SIZE: [f32; 2] = [1280.0, 800.0];

/// The stored settings.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct StoredSettings {
    /// Inner size of the window, points at zoom 1.
    pub size: Option<[f32; 2]>,
    /// Outer position of the window, points at zoom 1; unavailable on some platforms.
    pub position: Option<[f32; 2]>,
    /// Whether the window is maximized.
    pub maximized: bool,
    /// `light`, `dark` or `system`.
    pub theme: Option<String>,
    /// Zoom of the interface.
    pub zoom: Option<f32>,
    /// File or name of the last scene; `None` for the default scene.
    pub scene: Option<String>,
    /// Opened or saved scene files, latest first.
    pub recent: Vec<String>,
}

impl StoredSettings {
    /// Discards implausible values.
    fn plausible(mut self) -> Self {
        self.size = self.size.filter(|size| size.iter().all(|length| WINDOW_LENGTHS.contains(length)));
        self.position = self.position.filter(|place| place.iter().all(|place| place.abs() <= *WINDOW_LENGTHS.end()));
        self.zoom = self.zoom.filter(|zoom| ZOOM_FACTORS.contains(zoom));
        self.recent.truncate(MAX_RECENT);
        self
    }

    fn theme(&self) -> Option<ThemePreference> {
        ThemeChoice::of_word(self.theme.as_deref()?).map(theme::preference)
    }

    /// Moves `file` to the head of the list.
    fn add_recent(&mut self, file: String) {
        self.recent.retain(|other| *other != file);
        self.recent.insert(0, file);
        self.recent.truncate(MAX_RECENT);
    }
}

/// The settings file.
pub struct Store {
    path: PathBuf,
    /// Current settings, and those in the file.
    now: StoredSettings,
    written: StoredSettings,
    /// Earliest time of the next write, s of viewing.
    due: f64,
    /// Zoom in the previous frame.
    scale: f32,
}

impl Store {
    /// The settings file of the current user; `None` if there is no folder for it.
    pub fn for_current_user() -> Option<Self> {
        let folder = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
        let data = if cfg!(windows) {
            folder("APPDATA")
        } else if cfg!(target_os = "macos") {
            folder("HOME").map(|home| home.join("Library").join("Application Support"))
        } else {
            folder("XDG_DATA_HOME").or_else(|| folder("HOME").map(|home| home.join(".local").join("share")))
        };
        Some(Self::at(data?.join("jointplay").join("window.json")))
    }

    /// The settings in the file `path`. An unreadable file counts as missing.
    pub fn at(path: PathBuf) -> Self {
        let read =
            || -> Option<StoredSettings> { serde_json::from_slice(&read_regular(&path, MAX_FILE_SIZE).ok()?).ok() };
        let now = read().unwrap_or_default().plausible();
        Self { path, written: now.clone(), now, due: f64::NEG_INFINITY, scale: 0.0 }
    }

    /// The current settings.
    pub fn remembered(&self) -> &StoredSettings {
        &self.now
    }

    /// Resets all settings.
    pub fn forget(&mut self) {
        self.now = StoredSettings::default();
        self.write();
    }

    /// Options of a window without arguments: the last scene, or the first visit. If that is missing or invalid, the message names it, and the
    /// default scene is opened.
    pub fn start_options(&self) -> AppOptions {
        let Some(name) = &self.now.scene else {
            return AppOptions::first();
        };
        let load = || Scene::load(name, &[]).map_err(|error| error.to_string());
        let opened = check_exists(name).and_then(|()| load());
        let started = opened.and_then(|scene| match Simulation::new(&scene.machine) {
            Ok(_) => Ok(AppOptions::new(scene)),
            Err(error) => Err(scene.locate(&error).to_string()),
        });
        started.unwrap_or_else(|reason| AppOptions {
            problem: Some(format!("Cannot open the last scene: {reason}")),
            ..AppOptions::default_scene()
        })
    }

    /// Writes changed settings to the file. Errors are only logged.
    pub fn write(&mut self) {
        if self.now == self.written {
            return;
        }
        let written = || -> Result<(), FileError> {
            let text = serde_json::to_string_pretty(&self.now).map_err(|error| FileError::cannot(&self.path, error))?;
            if let Some(folder) = self.path.parent() {
                create_dir_all(folder).map_err(|error| FileError::cannot(folder, error))?;
            }
            OutputFile::claim(&self.path, true)?.write(|out| std::io::Write::write_all(out, text.as_bytes()))
        };
        if let Err(error) = written() {
            log::warn!("the window will not be remembered: {error}");
        }
        self.written = self.now.clone();
    }

    /// Applies theme and type size, unless other values were requested.
    pub fn apply(&self, ctx: &egui::Context) {
        let theme = ctx.options(|options| options.theme_preference);
        if let Some(wanted) = self.now.theme().filter(|_| theme == ThemePreference::System) {
            ctx.set_theme(wanted);
        }
        if let Some(zoom) = self.now.zoom {
            ctx.set_zoom_factor(zoom);
        }
    }

    /// Records the settings of the window, and its `scene` with the name of its file, if any; not those of a lesson.
    pub(super) fn record(
        &mut self,
        ctx: &egui::Context,
        presentation: &Presentation,
        scene: Option<(&Scene, Option<&str>)>,
    ) {
        let scale = ctx.zoom_factor();
        let is_full_screen = presentation.is_running();
        let before = (self.now.scene.clone(), self.now.recent.len());
        let now = &mut self.now;
        // In the frame of a zoom change, the window size still uses the old zoom.
        let settled = std::mem::replace(&mut self.scale, scale) == scale;
        ctx.input(|input| {
            let window = input.viewport();
            let is = |state: Option<bool>| state == Some(true);
            now.maximized = is(window.maximized);
            if !settled || now.maximized || is_full_screen || is(window.fullscreen) || is(window.minimized) {
                return;
            }
            if let Some(inner) = window.inner_rect {
                now.size = Some((inner.size() * scale).round().into());
            }
            if let Some(outer) = window.outer_rect {
                now.position = Some((outer.min.to_vec2() * scale).round().into());
            }
        });
        let theme = ctx.options(|options| options.theme_preference);
        let choice = ThemeChoice::ALL.into_iter().find(|choice| theme::preference(*choice) == theme);
        now.theme = choice.map(|choice| choice.word().to_owned());
        now.zoom = Some(presentation.own_zoom(ctx));
        match scene.map(|(scene, name)| (scene, name.map(|name| absolute(Path::new(name))))) {
            Some((_, Some(file))) if now.scene.as_ref() != Some(&file) => {
                now.add_recent(file.clone());
                now.scene = Some(file);
            }
            Some((scene, None)) if built_in_text(&scene.name).is_some_and(|text| *text == *scene.source.text) => {
                now.scene = Some(scene.name.clone());
            }
            _ => {}
        }
        let time = ctx.input(|input| input.time);
        if self.now != self.written && (before != (self.now.scene.clone(), self.now.recent.len()) || time >= self.due) {
            self.write();
            self.due = time + MIN_WRITE_INTERVAL;
        }
    }

    /// Adds the scene among the saved `files` to the recent files.
    pub(super) fn note_saved(&mut self, files: &[SaveFile]) {
        for file in files.iter().filter(|file| file.mime == SCENE_TYPE) {
            self.now.add_recent(absolute(Path::new(&file.name)));
        }
    }

    /// The recent files.
    pub(super) fn recent(&self) -> &[String] {
        &self.now.recent
    }
}

/// Menu entries of the `recent` files; returns the chosen one.
pub fn recent_entries(ui: &mut Ui, recent: &[String]) -> Option<String> {
    let mut chosen = None;
    if !recent.is_empty() {
        ui.label(RichText::new("Recent files").small().weak());
    }
    for file in recent {
        let name = Path::new(file).file_name().map_or(file.into(), |name| name.to_string_lossy());
        if ui.button(name).on_hover_text(file).clicked() {
            chosen = Some(file.clone());
            layout::close_menu(ui);
        }
    }
    chosen
}

/// Checks that the scene `name` exists; its file may have been removed.
pub fn check_exists(name: &str) -> Result<(), String> {
    let path = Path::new(name);
    if path.is_absolute() && !path.exists() { Err(format!("{name} is no longer there")) } else { Ok(()) }
}

/// Absolute form of a path, independent of the working directory.
fn absolute(path: &Path) -> String {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned()).display().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::DEFAULT_SCENE;

    #[test]
    fn settings_are_read_back_and_broken_or_implausible_ones_are_dropped() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("deep").join("window.json");
        let mut store = Store::at(path.clone());
        assert_eq!(*store.remembered(), StoredSettings::default());
        store.write();
        assert!(!path.exists(), "nothing to write");
        store.now.size = Some([900.0, 700.5]);
        store.now.scene = Some("pendulum".to_owned());
        for index in 0..10 {
            store.now.add_recent(format!("/scenes/{index}.toml"));
        }
        store.now.add_recent("/scenes/5.toml".to_owned());
        store.write();
        let again = Store::at(path.clone());
        assert_eq!(*again.remembered(), *store.remembered());
        assert_eq!(again.remembered().recent.len(), MAX_RECENT);
        assert_eq!(again.remembered().recent[..2], ["/scenes/5.toml", "/scenes/9.toml"]);
        store.forget();
        assert_eq!(*Store::at(path.clone()).remembered(), StoredSettings::default());

        std::fs::write(&path, r#"{"size": [1e9, 3.0], "zoom": 0.0, "theme": "dark", "later": 1}"#).expect("writable");
        let remembered = Store::at(path.clone()).now;
        assert_eq!((remembered.size, remembered.zoom), (None, None));
        assert_eq!(remembered.theme(), Some(ThemePreference::Dark));
        std::fs::write(&path, "{").expect("writable");
        assert_eq!(*Store::at(path).remembered(), StoredSettings::default());
    }

    #[test]
    fn a_remembered_scene_is_opened_and_one_that_is_gone_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut store = Store::at(folder.path().join("window.json"));
        let opens = |store: &Store| {
            let options = store.start_options();
            (options.scene.name.clone(), options.problem)
        };
        assert_eq!(opens(&store), (DEFAULT_SCENE.to_owned(), None));
        store.now.scene = Some("pendulum".to_owned());
        assert_eq!(opens(&store), ("pendulum".to_owned(), None));
        let file = folder.path().join("mine.toml");
        store.now.scene = Some(absolute(&file));
        for text in [None, Some("no scene")] {
            if let Some(text) = text {
                std::fs::write(&file, text).expect("writable");
            }
            let (name, problem) = opens(&store);
            assert_eq!(name, DEFAULT_SCENE);
            let problem = problem.expect("a message");
            assert!(problem.contains("mine.toml"), "{problem}");
        }
        std::fs::write(&file, built_in_text("chain").expect("built in")).expect("writable");
        assert_eq!(opens(&store).1, None);
    }
}
