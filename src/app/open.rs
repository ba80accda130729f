//! Opening of scenes, links and sections of sweeps in place of the running scene.

use std::borrow::Cow;

use eframe::egui;

use super::dialogs::Dialog;
use super::load::Load;
use super::player::Player;
use super::reload::SceneFile;
#[cfg(not(target_arch = "wasm32"))]
use super::remembered::INITIAL_SIZE;
use super::{App, AppOptions, Link, link, theme, value};
use crate::analysis::ready_sweeps::{READY_SWEEPS, ReadySweep};
use crate::analysis::source::SceneSource;
use crate::scene::Scene;

/// A path with the user's folder in place of a leading `~/`, as a shell writes it.
pub(super) fn with_home(path: &str) -> Cow<'_, str> {
    #[cfg(not(target_arch = "wasm32"))]
    if let Some(rest) = path.strip_prefix("~/")
        && let Some(home) = std::env::home_dir()
    {
        return home.join(rest).to_string_lossy().into_owned().into();
    }
    path.into()
}

impl App {
    /// Shows `scene` from its start; the tasks and messages of the previous one end.
    pub(super) fn show_scene(&mut self, scene: &Scene) -> Result<(), String> {
        let player = Player::new(scene).map_err(|error| scene.locate(&error).to_string())?;
        self.end_visit();
        // Cancelled first, because a film uses another time scale.
        self.tasks.cancel_film(&mut self.run);
        let before = self.run.show_scene(scene, player);
        self.course.remember_run(before, std::mem::take(&mut self.files.scene));
        self.tasks.clear();
        self.messages.clear();
        self.hint.begin(scene);
        Ok(())
    }

    /// Applies camera, followed part, plots and instruments of `link`, and goes to its instant; other settings stay.
    pub(super) fn show_link(&mut self, link: Link) {
        if link.has_instant() {
            // The link shows something of its own.
            self.hint.end();
        }
        self.messages.warn(self.run.apply_link(&link));
        self.tasks.start_replay(link, &mut self.run.player);
    }

    /// Starts a ready sweep; asks first if changes would be lost.
    pub(super) fn ask_ready_sweep(&mut self, sweep: &'static ReadySweep) {
        let scene = match sweep.scene() {
            Err(error) => return self.messages.fail(error),
            Ok(scene) => scene,
        };
        let pending = self.run.player.pending();
        let lost = value::changes(pending);
        // Changes made by another ready sweep are no loss.
        let ready_scenes = READY_SWEEPS.iter().filter_map(|ready| ready.scene().ok());
        let mut known_scenes = ready_scenes.chain([scene]);
        let same = known_scenes.any(|scene| value::differences(&scene, pending, &[]).is_empty());
        if same || lost.is_empty() {
            self.start_ready_sweep(sweep);
        } else {
            self.dialog = Some(Dialog::Ready { sweep, lost });
        }
    }

    /// Opens the scene of a ready sweep and starts the sweep.
    pub(super) fn start_ready_sweep(&mut self, sweep: &'static ReadySweep) {
        let scene = sweep.scene().map_err(|error| error.to_string());
        let shown = scene.and_then(|scene| self.show_scene(&scene));
        if self.messages.report(shown) {
            self.bench.start(sweep, self.run.player.pending());
        }
    }

    /// Runs to a section of a sweep; asks first if more than the varied parameter would change.
    pub(super) fn start_load(&mut self, load: Box<Load>) {
        match load.scene.scene() {
            Err(error) => self.messages.fail(error),
            Ok(scene) => {
                let changes = value::differences(&scene, self.run.player.pending(), load.varied());
                if changes.is_empty() {
                    self.go_to_section(*load);
                } else {
                    self.dialog = Some(Dialog::Load { load, changes });
                }
            }
        }
    }

    /// Restarts the scene of a sweep and runs to a section.
    pub(super) fn go_to_section(&mut self, load: Load) {
        let phase = self.run.player.watch().phase();
        let twin = self.run.player.twin().is_some();
        let pose = self.run.viewport.pose();
        let (target, current) = (&load.scene, SceneSource::of(self.run.player.pending()));
        let same = (&target.text, &target.beside) == (&current.text, &current.beside);
        let file = self.files.scene.name().map(str::to_owned).filter(|_| same);
        let scene = load.scene.scene().map_err(|error| error.to_string());
        let shown = scene.and_then(|scene| self.show_scene(&scene));
        if self.messages.report(shown) {
            self.run.player.set_playing(false);
            self.run.player.set_phase(phase);
            if let Some(pose) = pose.filter(|_| same) {
                self.run.viewport.set_pose(pose);
            }
            self.files.scene = SceneFile::named(file);
            self.tasks.start_load(load, twin);
        }
    }

    /// Opens a built-in scene or a file; on an error the running scene stays, and the reason is shown.
    pub fn open(&mut self, argument: &str) -> Result<(), String> {
        let scene = Scene::load(argument, &[]).map_err(|error| error.to_string())?;
        self.show_scene(&scene)?;
        self.files.scene = SceneFile::named(scene.source.file.clone());
        Ok(())
    }

    /// Opens a link in any form, a built-in scene or a file; on an error the running scene stays.
    ///
    /// # Errors
    /// As [`Self::open_link`] and [`Self::open`], as a message.
    pub fn open_any(&mut self, ctx: &egui::Context, text: &str) -> Result<(), String> {
        if link::is_link(text) { self.open_link(ctx, text) } else { self.open(&with_home(text.trim())) }
    }

    /// Opens a link in place of the running scene; on an error that scene stays, and the reason is shown and returned.
    ///
    /// # Errors
    /// As [`AppOptions::from_link`].
    pub fn open_link(&mut self, ctx: &egui::Context, text: &str) -> Result<(), String> {
        let opened = AppOptions::from_link(text).and_then(|options| {
            if options.lesson.is_some() {
                self.course.remember_window(&mut self.run, &self.panels, &mut self.bench);
            }
            self.show_scene(&options.scene)?;
            let starts_step = options.link.is_none();
            self.run.player.pacer.set_scale(options.time_scale);
            self.run.player.set_playing(options.playing);
            // A stand-alone window remains one.
            if let (Some(panels), Some(wanted)) = (&mut self.panels.embedded, options.embedded) {
                *panels = wanted;
            }
            self.run.viewport.options.magnification = options.view.magnification;
            if let Some(link) = options.link {
                if let Some(theme) = link.theme {
                    ctx.set_theme(theme::preference(theme));
                }
                self.show_link(link);
            }
            if let Some((lesson, step)) = options.lesson {
                self.resume_lesson(lesson, step, starts_step);
            }
            Ok(())
        });
        self.messages.report(opened.clone());
        opened
    }

    /// Resets all settings and opens the default scene.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn reset_to_first_start(&mut self, ctx: &egui::Context) {
        self.present(ctx, false);
        let options = AppOptions { clock: self.run.player.clock, ..AppOptions::first() };
        let mut new = match Self::with_context(ctx, self.graphics.state.as_ref(), options) {
            Ok(new) => new,
            Err(error) => return self.messages.fail(error),
        };
        new.host = std::mem::replace(&mut self.host, Box::new(super::NoHost));
        new.store = self.store.take();
        new.presentation.set_aside_zoom = Some(1.0);
        new.follow_frame_rate();
        *self = new;
        if let Some(store) = &mut self.store {
            store.forget();
        }
        ctx.send_viewport_cmd(egui::ViewportCommand::Maximized(false));
        // In points at the zoom still in effect when the command arrives.
        let size = egui::Vec2::from(INITIAL_SIZE) / ctx.zoom_factor();
        ctx.send_viewport_cmd(egui::ViewportCommand::InnerSize(size));
    }
}

#[cfg(all(test, not(target_arch = "wasm32")))]
mod tests {
    use super::*;

    #[test]
    fn the_folder_of_the_user_may_be_written_as_in_a_shell() {
        let home = std::env::home_dir().expect("has one");
        assert_eq!(with_home("~/own/mine.toml"), home.join("own/mine.toml").to_string_lossy());
        for path in ["pendulum", "own/~/mine.toml", "~other/mine.toml", "/tmp/mine.toml"] {
            assert_eq!(with_home(path), path);
        }
    }
}
