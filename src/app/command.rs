//! Commands of keys, menus, messages, dialogs and the bench, and their execution.

use eframe::egui::{self, ThemePreference};

use super::App;
use super::dialogs::{self, Dialog, SharedLink};
use super::film::FilmSettings;
use super::host::SaveFile;
use super::impact_list;
use super::keys::Action;
use super::load::Load;
use super::panels::Sheet;
#[cfg(not(target_arch = "wasm32"))]
use super::plots::PlotFormat;
use super::undo::Undo;
use crate::analysis::ready_sweeps::ReadySweep;

/// What a widget asks of the application.
pub enum Command {
    /// Opens a built-in scene or a file.
    Open(String),
    /// Opens a recent file, which may be gone.
    #[cfg(not(target_arch = "wasm32"))]
    OpenRecent(String),
    /// Opens a link, a built-in scene or a file as typed in the dialog.
    OpenAny(String),
    /// Lets the user choose a scene file.
    ChooseFile,
    /// Shows a dialog.
    Ask(Dialog),
    /// Shows the settings of a film.
    AskFilm,
    MakeFilm(FilmSettings),
    CopyLink,
    /// Copies a shown link and keeps the typed address.
    CopyShared(SharedLink),
    /// Shows the link with its QR code.
    ShowLink,
    CopyEmbedding,
    SavePicture,
    #[cfg(not(target_arch = "wasm32"))]
    SavePlots(PlotFormat),
    SaveRecord,
    SaveImpacts,
    SaveScene,
    /// Saves files under a path.
    SaveAs(String, Vec<SaveFile>),
    /// Sets a parameter to a value, as a user writes it, and shows its slider.
    SetValue {
        key: String,
        text: String,
    },
    /// Runs to a section of a sweep, or asks first if more than the varied parameter would change.
    AskSection(Box<Load>),
    GoToSection(Box<Load>),
    /// Starts a ready sweep with its scene, or asks first if changes would be lost.
    AskSweep(&'static ReadySweep),
    StartSweep(&'static ReadySweep),
    Undo {
        redo: bool,
    },
    /// Starts a built-in lesson.
    Lesson(&'static str),
    /// Goes to the next or the previous step of the lesson.
    TurnPage {
        forward: bool,
    },
    /// Sets the machine for the step again.
    SetStep,
    LeaveLesson,
    /// Opens or closes the audience window.
    #[cfg(not(target_arch = "wasm32"))]
    Audience(bool),
    /// Back to t = 0, with all changes applied.
    Reset,
    /// Stops or cancels the task under way.
    StopTasks,
    /// Forgets all settings and opens the default scene.
    #[cfg(not(target_arch = "wasm32"))]
    StartAsNew,
}

impl App {
    /// Carries out `command`.
    pub(super) fn perform(&mut self, ctx: &egui::Context, command: Command) {
        match command {
            Command::Open(name) => {
                let opened = self.open(&name);
                self.messages.report(opened);
            }
            #[cfg(not(target_arch = "wasm32"))]
            Command::OpenRecent(file) => {
                let opened = super::remembered::check_exists(&file).and_then(|()| self.open(&file));
                self.messages.report(opened);
            }
            Command::OpenAny(argument) => {
                if let Err(reason) = self.open_any(ctx, &argument) {
                    // The dialog shows the error instead.
                    self.messages.dismiss_problem();
                    self.dialog = Some(Dialog::Open { path: argument, error: Some(reason) });
                }
            }
            Command::ChooseFile => {
                if !self.host.pick_file() {
                    self.dialog = Some(Dialog::open());
                }
            }
            Command::Ask(dialog) => self.dialog = Some(dialog),
            Command::AskFilm => {
                let settings = self.tasks.film_to_make(&self.run.player);
                self.dialog = Some(Dialog::Film { settings });
            }
            Command::MakeFilm(settings) => {
                let started = self.tasks.start_film(&mut self.run, &self.graphics, settings);
                self.messages.report(started);
            }
            Command::CopyLink => self.copy_link(ctx),
            Command::CopyShared(shared) => {
                self.copy(ctx, shared.link());
                if shared.is_editable() {
                    self.files.page = shared.page().to_owned();
                }
            }
            Command::ShowLink => self.show_link_dialog(),
            Command::CopyEmbedding => self.copy_embedding(ctx),
            Command::SavePicture => self.picture.request(ctx),
            #[cfg(not(target_arch = "wasm32"))]
            Command::SavePlots(format) => match self.run.plots.file(&self.run.player, format) {
                Ok(file) => self.save(vec![file]),
                Err(reason) => self.messages.fail(reason),
            },
            Command::SaveRecord => self.save_record(),
            Command::SaveImpacts => self.save(impact_list::files(&self.run.player)),
            Command::SaveScene => self.save_scene(),
            Command::SaveAs(path, files) => self.save_as(path, files),
            Command::SetValue { key, text } => match self.run.player.set(&key, &text) {
                Err(error) => self.messages.fail(error),
                Ok(_) => {
                    self.run.controls.reveal(&key);
                    if self.panels.is_compact() {
                        self.bench.set_aside();
                    }
                    self.panels.show(Sheet::Controls, true);
                }
            },
            Command::AskSection(load) => self.start_load(load),
            Command::GoToSection(load) => self.go_to_section(*load),
            Command::AskSweep(sweep) => self.ask_ready_sweep(sweep),
            Command::StartSweep(sweep) => self.start_ready_sweep(sweep),
            Command::Undo { redo } => {
                if !self.tasks.are_under_way() {
                    self.messages.warn(self.run.undo(redo));
                }
            }
            Command::Lesson(name) => self.open_lesson(name),
            Command::TurnPage { forward } => self.change_step(forward),
            Command::SetStep => self.set_step(),
            Command::LeaveLesson => self.leave_lesson(),
            #[cfg(not(target_arch = "wasm32"))]
            Command::Audience(on) => self.show_audience(on),
            Command::Reset => self.reset(),
            Command::StopTasks => self.tasks.cancel(&mut self.run, &mut self.messages),
            #[cfg(not(target_arch = "wasm32"))]
            Command::StartAsNew => self.reset_to_first_start(ctx),
        }
    }

    /// Carries out `commands` one after the other.
    pub(super) fn perform_all(&mut self, ctx: &egui::Context, commands: impl IntoIterator<Item = Command>) {
        commands.into_iter().for_each(|command| self.perform(ctx, command));
    }

    /// Performs the action of a key.
    pub(super) fn perform_action(&mut self, ctx: &egui::Context, action: Action) {
        // An open dialog blocks the machine's controls.
        if self.dialog.is_some() && !matches!(action, Action::Help | Action::Close) {
            return;
        }
        if self.leave_visit_for(action) {
            return;
        }
        let moves = matches!(
            action,
            Action::PlayPause
                | Action::Step
                | Action::StepBack
                | Action::Backwards
                | Action::Impact { .. }
                | Action::Home
                | Action::End
                | Action::Reset
        );
        if self.tasks.are_under_way() && moves {
            return;
        }
        match action {
            Action::Reset => self.reset(),
            Action::IdealGhost => {
                let on = self.run.player.ideal().is_none();
                self.messages.warn(self.run.show_ideal(on));
            }
            Action::Sound => self.set_sound(!self.is_sounding()),
            Action::TurnPage { forward } => self.change_step(forward),
            Action::Present => self.present(ctx, !self.is_presenting()),
            Action::Costs => self.show_costs(!self.shows_costs()),
            Action::Plots if self.is_presenting() => self.show_next_plot(),
            Action::Panel => self.panels.toggle(Sheet::Controls),
            Action::Plots => self.panels.toggle(Sheet::Plots),
            Action::Bench => self.panels.toggle(Sheet::Bench),
            Action::Theme => ctx.set_theme(match ctx.theme() {
                egui::Theme::Dark => ThemePreference::Light,
                egui::Theme::Light => ThemePreference::Dark,
            }),
            Action::Help => {
                self.dialog = if self.dialog == Some(Dialog::Help) { None } else { Some(Dialog::Help) };
            }
            Action::Close => self.close_innermost(ctx),
            other => self.run.perform(other),
        }
    }

    /// Closes the innermost element: menu, dialog, operation in progress, message, presentation or microscope.
    fn close_innermost(&mut self, ctx: &egui::Context) {
        // A menu and a list close themselves.
        if egui::Popup::is_any_open(ctx) || self.dialog.take().is_some() {
            return;
        }
        if self.tasks.are_under_way() {
            self.tasks.cancel(&mut self.run, &mut self.messages);
        } else if self.messages.dismiss_problem() {
            // Only the message closes.
        } else if self.run.impact_list.close() {
            // Only the list closes.
        } else if self.is_presenting() {
            self.present(ctx, false);
        } else {
            self.run.microscope.set_open(false);
        }
    }

    /// Handles the keys of undo and redo.
    pub(super) fn receive_undo(&mut self, ctx: &egui::Context) {
        if self.dialog.is_none()
            && !self.tasks.are_under_way()
            && !ctx.text_edit_focused()
            && let Some(redo) = Undo::pressed(ctx)
        {
            self.perform(ctx, Command::Undo { redo });
        }
    }

    /// Shows the open dialog and carries out its answer.
    pub(super) fn dialog_ui(&mut self, ctx: &egui::Context) {
        let Some(mut dialog) = self.dialog.take() else {
            return;
        };
        match dialogs::ui(ctx, &mut dialog, self.focus.is_new_dialog(), &self.run.player, &mut self.graphics) {
            None => self.dialog = Some(dialog),
            Some(accepted) => self.perform_all(ctx, dialog.command().filter(|_| accepted)),
        }
    }
}
