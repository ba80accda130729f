//! The top bar with its menus, and the message strips below it.

use std::sync::LazyLock;

use eframe::egui::{
    self, Atom, ComboBox, Frame, RichText, TextFormat, TextStyle, ThemePreference, Ui, text::LayoutJob,
};

use super::App;
use super::dialogs::Dialog;
use super::files::needs_no_action;
use super::{layout, opening, spoken, theme};
use crate::scene::{BUILT_IN, DEFAULT_SCENE, Scene};
use crate::session::replay::Verdict;

/// Window width from which the header shows the program's name, points.
const MIN_WIDTH_WITH_NAME: f32 = 900.0;

/// Width of the list of scenes, points.
const LIST_WIDTH: f32 = 560.0;

/// Entry of a built-in scene in the list.
struct SceneEntry {
    name: &'static str,
    title: String,
    /// The first sentence of its description.
    sentence: String,
}

static ABOUT_SCENES: LazyLock<Vec<SceneEntry>> = LazyLock::new(|| {
    let about = |name| {
        let scene = Scene::load(name, &[]).ok()?;
        let description = scene.description.trim();
        let end = description.find(". ").map_or(description.len(), |end| end + 1);
        Some(SceneEntry { name, sentence: description[..end].to_owned(), title: scene.title.clone() })
    };
    BUILT_IN.into_iter().filter_map(about).collect()
});

impl SceneEntry {
    /// Draws the entry: picture, title, and the sentence below it.
    fn entry(&self, ui: &mut Ui, picture: Atom<'_>, chosen: bool, width: f32) -> egui::Response {
        let mut words = LayoutJob::default();
        let format = |style: TextStyle, colour| TextFormat::simple(style.resolve(ui.style()), colour);
        words.append(&self.title, 0.0, format(TextStyle::Body, ui.visuals().strong_text_color()));
        words.append("\n", 0.0, format(TextStyle::Small, ui.visuals().text_color()));
        words.append(&self.sentence, 0.0, format(TextStyle::Small, ui.visuals().text_color()));
        let entry =
            egui::Button::selectable(chosen, (picture, words)).gap(10.0).wrap().min_size(egui::vec2(width, 0.0));
        let response = ui.add(entry).on_hover_text(self.name);
        let id = response.id;
        let response = response.accessible_name(self.name);
        ui.ctx().accesskit_node_builder(id, |node| node.set_description(&*self.title));
        response
    }
}

impl App {
    pub(super) fn header(&mut self, ui: &mut Ui, compact: bool) {
        spoken::landmark(ui, "Scene and files");
        ui.horizontal(|ui| {
            // In a narrow window the buttons need the space.
            if !compact && ui.available_width() > MIN_WIDTH_WITH_NAME {
                ui.label(RichText::new("Jointplay").heading().strong());
                ui.add_space(8.0);
            }
            self.scene_box(ui, compact);
            if compact {
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    layout::menu(ui, "Menu", true, |ui| self.menu(ui)).on_hover_text("Open, save, share, theme, keys");
                });
                return;
            }
            #[cfg(not(target_arch = "wasm32"))]
            if self.is_remembered() || !ui.ctx().embed_viewports() {
                layout::menu(ui, "Open", false, |ui| {
                    self.open_button(ui, "File…");
                    self.desktop_entries(ui);
                })
                .on_hover_text("Open a scene, a recent file or a second window");
            } else {
                self.open_button(ui, "Open…");
            }
            #[cfg(target_arch = "wasm32")]
            self.open_button(ui, "Open…");
            let save = |ui: &mut Ui| {
                self.save_menu(ui);
                self.code_button(ui);
            };
            layout::menu(ui, "Save", true, save).on_hover_text("Save a picture, a film, the data or the scene");
            self.link_button(ui);
            self.undo_buttons(ui);
            layout::menu(ui, "Lessons", false, |ui| self.lesson_menu(ui))
                .on_hover_text("Ten lessons on play in joints, step by step");
            let panels = [
                (&mut self.show_controls, "Controls", "Parameters shown or hidden (key C)"),
                (&mut self.show_plots, "Plots", "Plots shown or hidden (key P)"),
                (
                    &mut self.show_bench,
                    "Bench",
                    "Bench shown or hidden: chaos bench (key B) with sweeps and twin run; what play costs (key W)",
                ),
            ];
            for (on, name, help) in panels {
                if ui.add(egui::Button::selectable(*on, name)).on_hover_text(help).clicked() {
                    *on = !*on;
                }
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                if ui.button("?").on_hover_text("Keys (?)").accessible_name("Keys").clicked() {
                    self.dialog = Some(Dialog::Help);
                }
                // Omitted rather than overlapped if it does not fit; the theme also has a key.
                let room = ui.available_width();
                if room > 80.0 && ui.button("About").clicked() {
                    self.dialog = Some(Dialog::About);
                }
                if room > 200.0 {
                    theme_box(ui);
                }
            });
        });
    }

    fn scene_box(&mut self, ui: &mut Ui, compact: bool) {
        let name = self.player.running().name.clone();
        let (mut wanted, mut link) = (None, false);
        ComboBox::from_id_salt("scene")
            .width(if compact { 150.0 } else { 170.0 })
            .truncate()
            // Shows all scenes if the window is high enough; otherwise the list scrolls.
            .height(0.85 * ui.ctx().content_rect().height())
            .selected_text(&name)
            .show_ui(ui, |ui| {
                let help = "Open a link, a scene by its name, or a file";
                let other = ui.selectable_label(false, "Link…").on_hover_text(help);
                link = other.clicked();
                ui.separator();
                // Stays within the edges of a narrow window.
                let width = LIST_WIDTH.min(ui.ctx().content_rect().width() - 60.0);
                ui.set_width(width);
                // Textures of the window are invalid on another canvas.
                let graphics = self.graphics.as_ref().filter(|_| !self.picture.is_drawn());
                for scene in &*ABOUT_SCENES {
                    let load = || Scene::load(scene.name, &[]).ok();
                    let picture = self.scene_pictures.atom(ui, graphics, scene.name, load);
                    if scene.entry(ui, picture, name == scene.name, width).clicked() {
                        wanted = Some(scene.name);
                    }
                }
            })
            .response
            .on_hover_text(&self.player.running().title)
            .accessible_name("Scene");
        if let Some(wanted) = wanted {
            self.problem = self.open(wanted).err();
        }
        if link {
            self.show_open_dialog();
        }
    }

    fn open_button(&mut self, ui: &mut Ui, name: &str) {
        let help = "Open a scene file; a link can be pasted anywhere, or into Link… in the list of scenes";
        if layout::entry(ui, name, help) {
            self.choose_file();
        }
    }

    /// Desktop-only menu entries.
    #[cfg(not(target_arch = "wasm32"))]
    fn desktop_entries(&mut self, ui: &mut Ui) {
        self.recent_entries(ui);
        ui.separator();
        if !ui.ctx().embed_viewports() && self.audience_entry(ui) {
            layout::close_menu(ui);
        }
        if self.is_remembered() {
            self.new_entry(ui);
        }
    }

    fn link_button(&mut self, ui: &mut Ui) {
        let mut help =
            "Copies a link that opens this scene in this state and view, with every change made on the way".to_owned();
        if self.page_address().is_empty() {
            help += ". No page address is set: asks for one first";
        }
        if layout::entry(ui, "Copy link", &help) {
            self.copy_link(ui.ctx());
        }
    }

    fn save_menu(&mut self, ui: &mut Ui) {
        self.picture_menu(ui);
        ui.separator();
        let help = "A film of a range of the timeline, MP4 or GIF";
        if layout::entry(ui, "Film…", help) {
            let settings = self.film_to_make();
            self.dialog = Some(Dialog::Film { settings });
        }
        #[cfg(not(target_arch = "wasm32"))]
        self.plots_menu(ui);
        #[cfg(target_arch = "wasm32")]
        ui.add_enabled(false, egui::Button::new("Plots…")).on_disabled_hover_text(
            "Plots as SVG and PNG are saved by the desktop program: the page leaves out the libraries that draw them, so \
             that it loads fast. Picture… can show them with the view, as PNG, and Data (CSV) has their values",
        );
        if layout::entry(ui, "Data (CSV)…", "Everything that the plots have recorded since the reset") {
            self.save_record();
        }
        if layout::entry(ui, "Impacts…", "A row for each impact up to the instant shown, CSV") {
            self.save_impacts();
        }
        if layout::entry(ui, "Scene…", "The scene file with the changed values in it, TOML") {
            self.save_scene();
        }
        ui.separator();
        let help = "Copies the HTML line that embeds this scene, in this state and view, in another page or in slides";
        if layout::entry(ui, "Embed", help) {
            self.copy_embedding(ui.ctx());
        }
    }

    /// Menu of a small header, with everything that does not fit into the bar.
    fn menu(&mut self, ui: &mut Ui) {
        ui.set_min_width(180.0);
        theme::use_dense_rows(ui);
        self.open_button(ui, "Open…");
        #[cfg(not(target_arch = "wasm32"))]
        self.desktop_entries(ui);
        self.link_button(ui);
        self.code_button(ui);
        // Collapsed, so that the following entries are visible.
        ui.collapsing("Lessons", |ui| self.lesson_menu(ui));
        ui.separator();
        ui.label(RichText::new("Save").small().weak());
        self.save_menu(ui);
        ui.separator();
        self.undo_entries(ui);
        theme_box(ui);
        if layout::entry(ui, "Keys", "Keys (?)") {
            self.dialog = Some(Dialog::Help);
        }
        if ui.button("About").clicked() {
            self.dialog = Some(Dialog::About);
            layout::close_menu(ui);
        }
    }

    /// Whether [`Self::strips`] has messages.
    pub(super) fn has_messages(&self) -> bool {
        self.problem.is_some() || self.shows_verdict() || self.is_under_way() || self.shows_first_notice()
    }

    /// Whether the first-time scene is displayed and its notice not yet dismissed.
    fn shows_first_notice(&self) -> bool {
        let is_ordinary_window = self.embedded().is_none() && self.course().is_none() && !self.is_presenting();
        is_ordinary_window && !self.changes_seen && opening::is_rattling(self.player.pending())
    }

    /// Notice of the changes the window started with; one click reverts them.
    fn changes_strip(&mut self, ui: &mut Ui) {
        let words = "Driven at 6 Hz; in the paper at 0.5 Hz.";
        let row = plate(ui, ui.visuals().weak_text_color()).show(ui, |ui| {
            ui.horizontal_wrapped(|ui| {
                ui.label(words);
                let help = "The scene as in its file. Its joints rattle for 70 ms and come to rest; at 6 Hz they \
                            rattle in every period";
                let paper = ui.button("The paper's settings").on_hover_text(help).clicked();
                (paper, ui.button("Dismiss").clicked())
            })
            .inner
        });
        let (paper, dismissed) = row.inner;
        self.changes_seen |= dismissed;
        if paper {
            let opened = Scene::load(DEFAULT_SCENE, &[]).map_err(|error| error.to_string());
            self.problem = opened
                .and_then(|scene| {
                    self.show_scene(&scene)?;
                    self.player.pacer.set_scale(opening::time_scale(&scene));
                    Ok(())
                })
                .err();
        }
    }

    /// Whether the verdict on a link is displayed. An embedded window omits verdicts that need no action, to save space.
    fn shows_verdict(&self) -> bool {
        let is_embedded = self.embedded().is_some();
        let is_relevant = self.verdict.as_ref().is_some_and(|verdict| !(is_embedded && needs_no_action(verdict)));
        is_relevant && self.verdict_shown != Some(f64::NEG_INFINITY)
    }

    /// Errors, the progress of a replay, and the verdict on a link.
    pub(super) fn strips(&mut self, ui: &mut Ui) {
        if self.shows_first_notice() {
            self.changes_strip(ui);
        }
        if let Some(problem) = self.problem.clone() {
            let colour = ui.visuals().error_fg_color;
            if strip(ui, &problem, colour) {
                self.problem = None;
            }
        }
        let replay = self.replay.as_ref();
        let tasks = [
            ("Reproducing the state of the link…", replay.map(|replay| replay.fraction(&self.player))),
            ("Running to the chosen section…", self.loading()),
            ("Making the film…", self.filming()),
        ];
        for (words, fraction) in tasks {
            let stop = if self.filming().is_some() {
                ("Cancel", "Cancels the film; the run returns to where it was (Esc)")
            } else {
                ("Stop here", "Stay at the time that the run has reached (Esc)")
            };
            if fraction.is_some_and(|fraction| progress_row(ui, words, fraction, stop)) {
                self.cancel_replay();
            }
        }
        if let Some(verdict) = self.verdict.as_ref().filter(|_| self.shows_verdict()) {
            let colour = match verdict {
                Verdict::Agrees(_) => ui.visuals().selection.stroke.color,
                Verdict::Reached => ui.visuals().weak_text_color(),
                Verdict::Differs { .. } => ui.visuals().warn_fg_color,
                Verdict::Failed(_) => ui.visuals().error_fg_color,
            };
            if strip(ui, &verdict.to_string(), colour) {
                self.verdict = None;
            }
        }
    }
}

/// The opaque background of a message.
fn plate(ui: &Ui, colour: egui::Color32) -> Frame {
    let fill = ui.visuals().panel_fill.lerp_to_gamma(colour, 0.14);
    Frame::new().fill(fill).corner_radius(6.0).inner_margin(egui::Margin::symmetric(12, 8))
}

/// Progress of a run to its target; returns whether it was cancelled. The last argument is the label and tooltip of the stop
/// button.
fn progress_row(ui: &mut Ui, words: &str, fraction: f32, (stop, help): (&str, &str)) -> bool {
    let plate = plate(ui, ui.visuals().panel_fill);
    let row = plate.show(ui, |ui| {
        ui.horizontal_wrapped(|ui| {
            let percent = (fraction * 100.0).floor();
            ui.label(format!("{words} {percent} %"));
            ui.add(egui::ProgressBar::new(fraction).desired_width(120.0)).accessible_name("Run so far");
            ui.button(stop).on_hover_text(help).clicked()
        })
        .inner
    });
    row.inner
}

/// A coloured strip with a message; returns whether it was dismissed.
fn strip(ui: &mut Ui, words: &str, colour: egui::Color32) -> bool {
    let shown = plate(ui, colour).show(ui, |ui| {
        let narrow = ui.available_width() < 520.0;
        let words = egui::Label::new(RichText::new(words).color(colour)).wrap();
        if narrow {
            ui.add(words);
            return ui.button("Dismiss").clicked();
        }
        ui.horizontal_top(|ui| {
            // Space for the button and the gap before it.
            let room = ui.available_width() - 90.0;
            ui.vertical(|ui| {
                ui.set_width(room);
                ui.add(words);
            });
            ui.button("Dismiss").clicked()
        })
        .inner
    });
    shown.inner
}

/// Selection of the theme: light, dark or system.
fn theme_box(ui: &mut Ui) {
    let label = |preference| match preference {
        ThemePreference::System => "System theme",
        ThemePreference::Light => "Light",
        ThemePreference::Dark => "Dark",
    };
    let mut preference = ui.ctx().options(|options| options.theme_preference);
    let before = preference;
    let all = [ThemePreference::System, ThemePreference::Light, ThemePreference::Dark];
    layout::choice(ui, ["Theme", "Light or dark (key T)"], Some(104.0), &mut preference, all, label);
    if preference != before {
        ui.ctx().set_theme(preference);
    }
}
