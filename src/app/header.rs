//! The top bar with its menus.

use eframe::egui::{self, ComboBox, RichText, ThemePreference, Ui};

use super::command::Command;
use super::dialogs::Dialog;
use super::graphics::Graphics;
use super::panels::Panels;
use super::picture::Picture;
use super::run::Run;
#[cfg(not(target_arch = "wasm32"))]
use super::{audience, plots, remembered};
use super::{cards, layout, spoken};

/// Window width from which the header shows the program's name, points.
const MIN_WIDTH_WITH_NAME: f32 = 900.0;

/// Window width from which the list of scenes has its full width, points.
const MIN_WIDTH_WITH_TITLES: f32 = 1080.0;

/// Greatest width of the box with the scene's title, points.
const MAX_BOX_WIDTH: f32 = 290.0;

/// Room in a small header for its menu and the lessons, points.
const MIN_WIDTH_WITH_LESSONS: f32 = 150.0;

/// Width of the list of scenes, points.
const LIST_WIDTH: f32 = 560.0;

/// The header: it reads the parts of the window and collects the commands chosen in it.
pub struct Header<'a> {
    pub run: &'a Run,
    /// Whether a task is under way.
    pub is_busy: bool,
    pub panels: &'a mut Panels,
    pub picture: &'a mut Picture,
    pub graphics: &'a mut Graphics,
    /// Whether links have a page address.
    pub has_page: bool,
    /// Recent files; `None` if settings are not stored.
    #[cfg(not(target_arch = "wasm32"))]
    pub recent: Option<&'a [String]>,
    /// Whether the audience window is open.
    #[cfg(not(target_arch = "wasm32"))]
    pub has_audience: bool,
    /// Whether a small header has a button for the lessons beside its menu.
    pub has_lessons_button: bool,
    pub commands: Vec<Command>,
}

impl Header<'_> {
    /// The bar. A small window has most of it in a menu.
    pub fn ui(&mut self, ui: &mut Ui) {
        let compact = self.panels.is_compact();
        spoken::landmark(ui, "Scene and files");
        ui.horizontal(|ui| {
            // In a narrow window the buttons need the space.
            if !compact && ui.available_width() > MIN_WIDTH_WITH_NAME {
                ui.label(RichText::new("Jointplay").heading().strong());
                ui.add_space(8.0);
            }
            self.scene_box(ui, compact);
            if compact {
                self.has_lessons_button = ui.available_width() > MIN_WIDTH_WITH_LESSONS;
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    layout::menu(ui, "Menu", true, |ui| self.menu(ui)).on_hover_text("Open, save, share, theme, keys");
                    if self.has_lessons_button {
                        self.lessons_button(ui);
                    }
                });
                return;
            }
            layout::menu(ui, "Open", false, |ui| {
                self.open_button(ui, "File…");
                #[cfg(not(target_arch = "wasm32"))]
                self.desktop_entries(ui);
            })
            .on_hover_text("Open a file or a link");
            let save = |ui: &mut Ui| {
                self.save_menu(ui);
                self.code_button(ui);
            };
            layout::menu(ui, "Save", true, save).on_hover_text("Save a picture, a film, the data or the scene");
            self.link_button(ui);
            let undone = self.run.undo.buttons(ui, !self.is_busy);
            self.commands.extend(undone.map(|redo| Command::Undo { redo }));
            self.lessons_button(ui);
            self.panels.switches(ui);
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                if ui
                    .button("?")
                    .on_hover_text("Keyboard shortcuts (?)")
                    .accessible_name("Keyboard shortcuts")
                    .clicked()
                {
                    self.commands.push(Command::Ask(Dialog::Help));
                }
                // Omitted rather than overlapped if it does not fit; the theme also has a key.
                let room = ui.available_width();
                if room > 80.0 && ui.button("About").clicked() {
                    self.commands.push(Command::Ask(Dialog::About));
                }
                if room > 200.0 {
                    theme_box(ui);
                }
            });
        });
    }

    /// A menu entry for `command`.
    fn entry(&mut self, ui: &mut Ui, name: &str, help: &str, command: Command) {
        if layout::entry(ui, name, help) {
            self.commands.push(command);
        }
    }

    fn scene_box(&mut self, ui: &mut Ui, compact: bool) {
        // Of a wider window, half of what it has more, up to the longest title.
        let more = 0.5 * (ui.ctx().content_rect().width() - MIN_WIDTH_WITH_TITLES);
        let width = match compact {
            true => 190.0_f32.min(ui.available_width() - 90.0),
            false if more < 0.0 => 150.0,
            false => (190.0 + more).min(MAX_BOX_WIDTH),
        };
        let size = egui::vec2(width, ui.spacing().interact_size.y);
        ui.allocate_ui(size, |ui| self.scene_list(ui, width));
    }

    fn scene_list(&mut self, ui: &mut Ui, width: f32) {
        let scene = self.run.player.running();
        ui.set_max_width(width);
        ComboBox::from_id_salt("scene")
            .width(width)
            .truncate()
            // Shows all scenes if the window is high enough; otherwise the list scrolls.
            .height(0.85 * ui.ctx().content_rect().height())
            .selected_text(&scene.title)
            .show_ui(ui, |ui| {
                // Stays within the edges of a narrow window.
                let width = LIST_WIDTH.min(ui.ctx().content_rect().width() - 60.0);
                ui.set_width(width);
                for entry in &*cards::SCENES {
                    let picture = self.graphics.scene_picture(ui, self.picture.is_drawn(), entry.name);
                    if entry.ui(ui, picture, scene.name == entry.name, width).clicked() {
                        self.commands.push(Command::Open(entry.name.to_owned()));
                    }
                }
            })
            .response
            .on_hover_text(format!("{} (`{}` on the command line)", scene.title, scene.name))
            .accessible_name("Scene");
    }

    fn open_button(&mut self, ui: &mut Ui, name: &str) {
        self.entry(ui, name, "Open a scene file; it can also be dropped on the window", Command::ChooseFile);
        let help = "A link, which can also be pasted anywhere, a scene by its name, or a file by its path";
        self.entry(ui, "Link…", help, Command::Ask(Dialog::open()));
    }

    /// Desktop-only menu entries.
    #[cfg(not(target_arch = "wasm32"))]
    fn desktop_entries(&mut self, ui: &mut Ui) {
        let chosen = remembered::recent_entries(ui, self.recent.unwrap_or_default());
        self.commands.extend(chosen.map(Command::OpenRecent));
        ui.separator();
        if !ui.ctx().embed_viewports() && audience::entry(ui, self.has_audience) {
            self.commands.push(Command::Audience(!self.has_audience));
            layout::close_menu(ui);
        }
        if self.recent.is_some() {
            let help = "Forgets window size, theme, type size, last scene and recent files";
            self.entry(ui, "Start fresh…", help, Command::Ask(Dialog::StartAsNew));
        }
    }

    fn link_button(&mut self, ui: &mut Ui) {
        let mut help =
            "Copies a link that opens this scene in this state and view, with every change made on the way".to_owned();
        if !self.has_page {
            help += ". No page address is set: asks for one first";
        }
        self.entry(ui, "Copy link", &help, Command::CopyLink);
    }

    fn code_button(&mut self, ui: &mut Ui) {
        let help = "The link to this scene in this state and view, to be photographed by a phone";
        self.entry(ui, "QR code", help, Command::ShowLink);
    }

    fn lessons_button(&mut self, ui: &mut Ui) {
        let help = "Lessons on play in joints, step by step, with pictures and in order";
        self.entry(ui, "Lessons", help, Command::Ask(Dialog::Lessons { chosen: None }));
    }

    fn save_menu(&mut self, ui: &mut Ui) {
        if self.picture.menu(ui, self.panels.picture) {
            self.commands.push(Command::SavePicture);
        }
        ui.separator();
        self.entry(ui, "Film…", "A film of a range of the timeline, MP4 or GIF", Command::AskFilm);
        #[cfg(not(target_arch = "wasm32"))]
        self.commands.extend(plots::format_buttons(ui).map(Command::SavePlots));
        #[cfg(target_arch = "wasm32")]
        ui.add_enabled(false, egui::Button::new("Plots…")).on_disabled_hover_text(
            "Plots as SVG and PNG are saved by the desktop program: the page leaves out the libraries that draw them, so \
             that it loads fast. Picture… can show them with the view, as PNG, and Data (CSV) has their values",
        );
        let help = "Everything that the plots have recorded since the reset";
        self.entry(ui, "Data (CSV)…", help, Command::SaveRecord);
        let help = "A row for each impact up to the instant shown, CSV";
        self.entry(ui, "Impacts…", help, Command::SaveImpacts);
        self.entry(ui, "Scene…", "The scene file with the changed values in it, TOML", Command::SaveScene);
        ui.separator();
        let help = "Copies the HTML line that embeds this scene, in this state and view, in another page or in slides";
        self.entry(ui, "Embed", help, Command::CopyEmbedding);
    }

    /// Menu of a small header, with everything that does not fit into the bar.
    fn menu(&mut self, ui: &mut Ui) {
        ui.set_min_width(180.0);
        self.open_button(ui, "Open…");
        #[cfg(not(target_arch = "wasm32"))]
        self.desktop_entries(ui);
        self.link_button(ui);
        self.code_button(ui);
        if !self.has_lessons_button {
            self.lessons_button(ui);
        }
        ui.separator();
        layout::aligned(ui, |ui| ui.label(RichText::new("Save").small().weak()));
        self.save_menu(ui);
        ui.separator();
        let undone = self.run.undo.entries(ui, !self.is_busy);
        self.commands.extend(undone.map(|redo| Command::Undo { redo }));
        theme_box(ui);
        self.entry(ui, "Keyboard shortcuts", "The list of keys (?)", Command::Ask(Dialog::Help));
        if ui.button("About").clicked() {
            self.commands.push(Command::Ask(Dialog::About));
            layout::close_menu(ui);
        }
    }
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
