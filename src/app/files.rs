//! Import and export of links and files.

use std::fmt::Write as _;
use std::path::Path;

use eframe::egui;
use serde_json::{Map, json};

use super::dialogs::{Dialog, SharedLink};
use super::host::{OpenedFile, SaveFile};
use super::lesson::RunningLesson;
use super::open::with_home;
use super::player::Player;
use super::reload::{FileContents, SceneFile};
use super::{App, value};
use crate::session::link::settings::{self as link_settings, Instruments};
use crate::session::link::{Link, SceneText, is_link};
use crate::simulate::Channel;

/// Number of rows in a saved record.
const ROWS: usize = 1000;
/// Extensions of pictures, which are dropped by mistake.
const PICTURES: [&str; 8] = [".png", ".jpg", ".jpeg", ".gif", ".webp", ".svg", ".mp4", ".webm"];
/// Media type of scene files.
pub(super) const SCENE_TYPE: &str = "application/toml";

/// Files of the scene and of what is saved, and the address for links.
#[derive(Default)]
pub struct Files {
    /// The file of the scene. Empty for a scene from a link: a link must not make the program read a file.
    pub(super) scene: SceneFile,
    /// Page address typed by the user, which replaces the host's; "" for none.
    pub page: String,
    /// Files waiting for a path from the host.
    #[cfg(not(target_arch = "wasm32"))]
    saving: Vec<SaveFile>,
}

impl Files {
    /// The scene file `name`, if it has one.
    pub fn of(name: Option<String>) -> Self {
        Self { scene: SceneFile::named(name), ..Self::default() }
    }
}

impl App {
    /// A link to the present state.
    pub fn link(&self) -> Link {
        if let Some(replay) = self.tasks.replay() {
            let (lesson, step) = self.course.running().and_then(RunningLesson::link_position).unzip();
            return Link { lesson, step, embedded: self.panels.embedded.clone(), ..replay.link().clone() };
        }
        let player = &self.run.player;
        let (plots, window) = self.run.plots.changes_from_initial(player.pending());
        let followed = self.run.viewport.followed();
        let joints = &player.running().machine.loose_joints;
        let under_microscope = joints.get(self.run.microscope.joint());
        let instruments = Instruments {
            microscope: under_microscope.filter(|_| self.run.microscope.is_open()).map(|joint| joint.name.clone()),
            ideal: player.ideal().is_some(),
            wear: self.run.viewport.options.wear,
        };
        let (lesson, step) = self.course.running().and_then(RunningLesson::link_position).unzip();
        Link {
            lesson,
            step,
            scene: SceneText::of(player.pending()),
            log: player.log(),
            steps: Some(player.steps()),
            time: Some(player.pacer.shown()),
            hash: Some(player.simulation().state_hash()),
            time_scale: Some(player.pacer.scale()),
            camera: self.run.viewport.pose(),
            magnification: Some(self.run.viewport.options.magnification),
            follow: followed.and_then(|part| link_settings::name_followed(player.running(), part)),
            plots,
            channels: (!self.run.plots.picked.is_empty()).then(|| self.run.plots.picked.clone()),
            window,
            instruments: (instruments != Instruments::default()).then_some(instruments),
            embedded: self.panels.embedded.clone(),
            playing: Some(player.is_playing()),
            theme: None,
            version: Some(crate::VERSION.to_owned()),
            beside: player.pending().source.beside.clone(),
        }
    }

    /// The present state as a URL fragment of any length, without the `#`, for a page that must restart.
    /// [`super::AppOptions::from_link`] restores it.
    pub fn share_state(&self) -> String {
        self.link().format()
    }

    /// The state including contents too large for an address: a large scene, many changes, files referenced by a scene.
    /// [`super::AppOptions::from_link`] restores it.
    pub fn session(&self) -> String {
        self.link().to_storage_text()
    }

    /// Whether closing this window would lose changes to the user's own scene: not for built-in scenes, nor for changes saved in
    /// a file or received with a link. `None` until something is changed or saved after opening a link.
    pub fn unsaved(&self) -> Option<bool> {
        let pending = self.run.player.pending();
        if matches!(SceneText::of(pending), SceneText::BuiltIn(_)) {
            return Some(false);
        }
        let changed = !self.files.scene.is_saved_with(&pending.changes)?;
        (changed || self.files.scene.has_file()).then_some(changed)
    }

    /// Address of the page for links; "" for none.
    pub(super) fn page_address(&self) -> String {
        if self.files.page.is_empty() { self.host.address() } else { self.files.page.clone() }
    }

    /// Copies a link to the present state; asks for an address first if none is known.
    pub fn copy_link(&mut self, ctx: &egui::Context) {
        let address = self.page_address();
        if address.is_empty() {
            self.show_link_dialog();
            return;
        }
        match self.link().format_short(self.run.player.pending()) {
            Ok((fragment, note)) => {
                self.copy(ctx, format!("{address}#{fragment}"));
                note.into_iter().for_each(|note| self.messages.notify(note));
            }
            Err(reason) => self.messages.fail(reason),
        }
    }

    /// Copies `link`.
    pub(super) fn copy(&mut self, ctx: &egui::Context, link: String) {
        if !self.host.publish_link(&link) {
            ctx.copy_text(link);
        }
        self.messages.notify("Link copied");
    }

    /// Shows the link to the present state, and asks for an address if other devices cannot reach the page.
    pub(super) fn show_link_dialog(&mut self) {
        match self.link().format_short(self.run.player.pending()) {
            Ok((fragment, note)) => {
                self.dialog = Some(Dialog::Link(SharedLink::new(fragment, self.page_address())));
                note.into_iter().for_each(|note| self.messages.notify(note));
            }
            Err(reason) => self.messages.fail(reason),
        }
    }

    /// Opens a scene file from its content; on an error the running scene stays, and the reason is shown and returned.
    ///
    /// # Errors
    /// The content is not text or not a valid scene.
    pub fn open_bytes(&mut self, name: &str, bytes: Vec<u8>) -> Result<(), String> {
        self.open_given(name, bytes, &FileContents::new())
    }

    /// The same for a scene that may refer to the files `companions`.
    fn open_given(&mut self, name: &str, bytes: Vec<u8>, companions: &FileContents) -> Result<(), String> {
        let opened = String::from_utf8(bytes)
            .map_err(|_| format!("{name}: not a text file"))
            .and_then(|text| self.parse_file(name, &text, companions, &[]).map_err(|error| error.to_string()))
            .and_then(|scene| self.show_scene(&scene));
        self.messages.report(opened.clone());
        opened
    }

    /// Opens a link pasted outside a text field; other text is ignored.
    pub(super) fn receive_links(&mut self, ctx: &egui::Context) {
        if self.dialog.is_some() || ctx.text_edit_focused() {
            return;
        }
        let pasted = ctx.input(|input| {
            let text = input.events.iter().find_map(|event| match event {
                egui::Event::Paste(text) => Some(text.clone()),
                _ => None,
            });
            text.filter(|text| is_link(text))
        });
        if let Some(link) = pasted {
            // The error is already shown.
            let _ = self.open_link(ctx, &link);
        }
    }

    /// Receives dropped or previously chosen files.
    pub(super) fn receive_files(&mut self, ctx: &egui::Context) {
        let dropped = ctx.input(|input| input.raw.dropped_files.clone());
        if !dropped.is_empty() {
            self.host.read_dropped(dropped);
        }
        while let Some(files) = self.host.opened() {
            let opened = self.open_together(files);
            self.messages.warn(opened);
        }
    }

    /// Opens files that were chosen or dropped together: a scene, and those it refers to.
    fn open_together(&mut self, files: Vec<OpenedFile>) -> Result<(), String> {
        let is_picture = |file: &&OpenedFile| {
            file.content.is_ok() && PICTURES.iter().any(|ending| file.name.to_lowercase().ends_with(ending))
        };
        if let Some(OpenedFile { name, .. }) = files.iter().find(is_picture) {
            return Err(format!("{name}: a picture or a film, not a scene; open a .toml file"));
        }
        let mut read = Vec::with_capacity(files.len());
        for OpenedFile { name, content } in files {
            let bytes = content.map_err(|reason| format!("{name}: {reason}"))?;
            read.push((name, bytes));
        }
        let Some(scene) = scene_index(&read) else {
            let names: Vec<&str> = read.iter().map(|(name, _)| name.as_str()).collect();
            return Err(format!(
                "{}: no scene among them; open the scene's .toml file with the files that it names",
                names.join(", ")
            ));
        };
        let (name, bytes) = read.swap_remove(scene);
        let own = |(name, bytes): (String, Vec<u8>)| (file_name_of(&name).to_owned(), bytes);
        let companions: FileContents = read.into_iter().map(own).collect();
        self.open_given(&name, bytes, &companions)?;
        self.files.scene = SceneFile::opened(name, companions);
        Ok(())
    }

    /// Passes files to the host, or asks for a path first.
    pub(super) fn save(&mut self, files: Vec<SaveFile>) {
        #[cfg(not(target_arch = "wasm32"))]
        if let Some(first) = files.first()
            && self.host.pick_path(&first.name)
        {
            self.files.saving = files;
            return;
        }
        if self.host.asks_for_path() {
            self.dialog = Some(Dialog::Save {
                path: files.first().map_or(String::new(), |f| f.name.clone()),
                files,
                error: None,
            });
        } else {
            match self.host.save(&files) {
                Ok(done) => {
                    self.note_saved(&files);
                    self.messages.notify(done);
                }
                Err(reason) => self.messages.fail(reason),
            }
        }
    }

    /// Saves files under the path chosen for them.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn receive_path(&mut self, ctx: &egui::Context, frame: &eframe::Frame) {
        if let Some(chosen) = self.host.picked_path(ctx, frame) {
            let files = std::mem::take(&mut self.files.saving);
            if let Some(path) = chosen.filter(|_| !files.is_empty()) {
                self.save_as(path, files);
            }
        }
    }

    /// Saves files under the path from [`Dialog::Save`].
    pub(super) fn save_as(&mut self, path: String, files: Vec<SaveFile>) {
        let path = with_home(&path).into_owned();
        let suggested = files.first().map_or(String::new(), |f| f.name.clone());
        let renamed: Vec<SaveFile> = files
            .iter()
            .map(|file| SaveFile {
                // Companion files are renamed along with the first.
                name: file.name.replacen(&suggested, &path, 1),
                ..file.clone()
            })
            .collect();
        match self.host.save(&renamed) {
            Ok(done) => {
                self.note_saved(&files);
                #[cfg(not(target_arch = "wasm32"))]
                if let Some(store) = &mut self.store {
                    store.note_saved(&renamed);
                }
                self.messages.notify(done);
            }
            Err(reason) => {
                self.dialog = Some(Dialog::Save { path, files, error: Some(reason) });
            }
        }
    }

    /// Saves the scene file including changes.
    pub fn save_scene(&mut self) {
        let scene = self.run.player.pending();
        match scene.to_toml() {
            Ok(text) => {
                let name = format!("{}.toml", scene.name);
                self.save(vec![SaveFile { name, mime: SCENE_TYPE, bytes: text.into_bytes() }]);
            }
            Err(error) => self.messages.fail(format!("The scene cannot be saved: {error}")),
        }
    }

    /// Marks the changes as saved if the scene is among `files`.
    fn note_saved(&mut self, files: &[SaveFile]) {
        if files.iter().any(|file| file.mime == SCENE_TYPE) {
            let changes = self.run.player.pending().changes.clone();
            self.files.scene.record_saved(changes);
        }
    }

    /// Saves the record of the plots.
    pub fn save_record(&mut self) {
        self.save(record_files(&self.run.player));
    }
}

/// Index of the scene among these files (name, content): the only file, or the last `.toml` file that no other file includes.
fn scene_index(files: &[(String, Vec<u8>)]) -> Option<usize> {
    if files.len() == 1 {
        return Some(0);
    }
    let scenes = (0..files.len()).filter(|&i| files[i].0.ends_with(".toml"));
    let scenes: Vec<usize> = scenes.collect();
    let included = |&&i: &&usize| {
        let named = format!("{}\"", file_name_of(&files[i].0));
        let names = |&other: &usize| String::from_utf8_lossy(&files[other].1).contains(&named);
        scenes.iter().any(|other| *other != i && names(other))
    };
    let mut last_first = scenes.iter().rev();
    let found = last_first.find(|i| !included(i)).or(scenes.last());
    found.copied()
}

/// File name without folders.
fn file_name_of(name: &str) -> &str {
    Path::new(name).file_name().and_then(|own| own.to_str()).unwrap_or(name)
}

/// File name stem: scene and time.
pub(super) fn file_stem(player: &Player) -> String {
    format!("{}-{:.3}ms", player.running().name, player.pacer.shown() * 1e3)
}

/// Files with the record of a run and its metadata.
pub(super) fn record_files(player: &Player) -> Vec<SaveFile> {
    let name = format!("{}.csv", file_stem(player));
    let (rows, meta) = (record_csv(player), meta(player, []));
    vec![
        SaveFile { name: name.clone(), mime: "text/csv", bytes: rows.into_bytes() },
        SaveFile { name: format!("{name}.meta.json"), mime: "application/json", bytes: meta.into_bytes() },
    ]
}

/// The record as CSV: time, then least and greatest value of each channel since the previous row; SI units.
fn record_csv(player: &Player) -> String {
    let mut text = String::from("t_s");
    let channels = player.channels();
    let columns = channels.list().iter().map(Channel::column);
    let picked = channels.picked().iter().map(|channel| &*channel.column);
    // A picked channel may also be recorded by default.
    let places = (0..channels.len()).chain(player.picked());
    let mut written: Vec<(&str, usize)> = Vec::new();
    for (column, place) in columns.chain(picked).zip(places) {
        if !written.iter().any(|(other, _)| *other == column) {
            written.push((column, place));
        }
    }
    for (column, _) in &written {
        // Writing to a String cannot fail.
        let _ = write!(text, ",{column}_min,{column}_max");
    }
    text.push('\n');
    for (time, values) in player.history().rows(ROWS) {
        let _ = write!(text, "{time:.9e}");
        for (least, greatest) in written.iter().map(|(_, place)| &values[*place]) {
            if least > greatest {
                // The channel has no record here.
                text.push_str(",NaN,NaN");
                continue;
            }
            let _ = write!(text, ",{least:.7e},{greatest:.7e}");
        }
        text.push('\n');
    }
    text
}

/// Metadata: the origin of the record, and `more` about its contents.
pub(super) fn meta<const N: usize>(player: &Player, more: [(&str, serde_json::Value); N]) -> String {
    let scene = player.running();
    let changed: Map<String, serde_json::Value> =
        scene.changes.iter().map(|(key, value)| (key.clone(), json!(value))).collect();
    let mut meta = json!({
        "program": "jointplay",
        "version": crate::VERSION,
        "scene": scene.name,
        "scene_file": scene.source.file,
        "changed_parameters": changed,
        "formulation": scene.machine.formulation,
        "method": scene.machine.solver.method,
        "step_s": scene.machine.solver.step,
        "tolerance": scene.machine.solver.tolerance,
        "steps_per_impact": scene.machine.solver.steps_per_impact,
        "time_s": player.pacer.shown(),
        // The hash refers to the end of the latest step.
        "state_time_s": player.simulation().time(),
        "state_hash": format!("{:016x}", player.simulation().state_hash()),
    });
    let pending = player.pending();
    if pending.source.beside.is_empty() {
        let link = Link {
            scene: SceneText::of(pending),
            log: player.log(),
            steps: Some(player.steps()),
            time: Some(player.pacer.shown()),
            hash: Some(player.simulation().state_hash()),
            ..Link::default()
        };
        meta["link"] = json!(link.format());
    } else {
        // A link can carry only one text.
        let texts = pending.source.beside.iter();
        let texts = texts.map(|(name, text)| (name.clone(), json!(**text)));
        meta["scene_text"] = json!(&*pending.source.text);
        meta["scene_files"] = texts.collect();
    }
    for (key, value) in more {
        meta[key] = value;
    }
    format!("{meta:#}\n")
}

/// Description embedded in a picture.
pub(super) fn describe(player: &Player) -> String {
    let mut words = format!(
        "{} at t = {}, state hash {:016x}",
        player.running().name,
        value::time(player.pacer.shown()),
        player.simulation().state_hash()
    );
    for (key, value) in &player.running().changes {
        let _ = write!(words, ", {key} = {value}");
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;
    use crate::simulate::Quantity;

    fn player(scene: &str) -> Player {
        Player::new(&Scene::load(scene, &[]).expect("built in")).expect("starts")
    }

    #[test]
    fn the_record_has_a_row_for_each_instant_and_holds_the_peak() {
        let mut player = player("spcmm");
        player.run_to(9e-3);
        player.advance(0.0);
        // Displays the end of the record.
        player.single_step();
        let text = record_csv(&player);
        let mut lines = text.lines();
        let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
        assert_eq!(header.len(), 1 + 2 * player.channels().len());
        let column = |name: &str| header.iter().position(|h| *h == name).expect("a column");
        let (peak, least) = (column("S1_normal_N_max"), column("S1_normal_N_min"));
        let rows: Vec<Vec<f64>> =
            lines.map(|line| line.split(',').map(|v| v.parse().expect("a number")).collect()).collect();
        assert!((50..=ROWS).contains(&rows.len()), "{}", rows.len());
        assert!(rows.windows(2).all(|pair| pair[0][0] < pair[1][0]));
        assert!(rows.iter().all(|row| row.len() == header.len() && row[least] <= row[peak]));
        let strongest = rows.iter().map(|row| row[peak]).fold(0.0, f64::max);
        let in_record = player.simulation().statistics().joints[0].peak_normal;
        assert!((strongest / in_record - 1.0).abs() < 1e-6, "{strongest} {in_record}");
        let last = rows.last().expect("rows");
        let channels = player.channels().list();
        let x = channels.iter().position(|c| c.quantity == Quantity::Position);
        let shown = player.frame().pose.position.x;
        let x = last[2 + 2 * x.expect("recorded")];
        assert!((x / shown - 1.0).abs() < 1e-5, "{x} {shown}");
        let meta: serde_json::Value = serde_json::from_str(&meta(&player, [])).expect("JSON");
        assert_eq!(meta["method"], "automatic");
        let link = Link::parse(meta["link"].as_str().expect("a text")).expect("a link");
        assert_eq!(link.steps, Some(player.steps()));
        assert!(meta.get("scene_files").is_none());
    }

    #[test]
    fn the_record_of_a_scene_that_names_files_holds_their_texts_instead_of_a_link() {
        let text = crate::scene::built_in_text("pendulum").expect("built in");
        let text = format!("include = [\"own.toml\"]\n{text}");
        let own = "[[parameter]]\nname = \"reach\"\nvalue = \"1 mm\"\n";
        let beside = [("own.toml".to_owned(), own.into())].into();
        let scene = Scene::parse_with(&text, Some("mine.toml"), &beside, &[]).expect("a scene");
        let player = Player::new(&scene).expect("starts");
        let meta: serde_json::Value = serde_json::from_str(&meta(&player, [])).expect("JSON");
        assert!(meta.get("link").is_none());
        assert_eq!(meta["scene_text"], text);
        assert_eq!(meta["scene_files"], json!({"own.toml": own}));
    }
}
