//! The list of keys, the about box and the field that opens a file.

use eframe::egui::{self, Grid, Id, Modal, RichText, ScrollArea, TextEdit, Ui};

use super::host::SaveFile;
use super::keys::{BINDINGS, POINTER};
use super::player::Player;

/// Below this width keys and what they do stand below each other, points.
const NARROW: f32 = 480.0;

/// Which dialog is open.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Dialog {
    /// List of keys.
    Help,
    /// Version and state.
    About,
    /// Opens a file: the path as typed so far and what was wrong with it.
    Open {
        /// Path or name.
        path: String,
        /// Why it could not be opened.
        error: Option<String>,
    },
    /// Saves files: the path of the first as typed so far and what was wrong with it.
    Save {
        /// Path.
        path: String,
        /// The files, named as suggested.
        files: Vec<SaveFile>,
        /// Why they could not be saved.
        error: Option<String>,
    },
}

/// What a dialog asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// It wants to be closed.
    Close,
    /// Open this scene.
    Open(String),
    /// Save under this path.
    Save(String),
}

/// Shows `dialog`.
pub fn ui(
    ctx: &egui::Context,
    dialog: &mut Dialog,
    player: &Player,
    renderer: &str,
) -> Option<Answer> {
    let mut answer = None;
    let widest = (ctx.content_rect().width() - 48.0).min(520.0);
    let frame = egui::Frame::window(&ctx.global_style());
    let modal = Modal::new(Id::unique("dialog"))
        .frame(frame)
        .show(ctx, |ui| {
            ui.set_width(widest);
            let title = match dialog {
                Dialog::Help => "Keys",
                Dialog::About => "About Jointplay",
                Dialog::Open { .. } => "Open a scene file",
                Dialog::Save { .. } => "Save as",
            };
            ui.heading(title);
            ui.add_space(6.0);
            // Title, button and frame stay in sight on a low screen.
            let most = ctx.content_rect().height() - 140.0;
            let scrolled = ScrollArea::vertical().max_height(most.max(80.0));
            scrolled.show(ui, |ui| match dialog {
                Dialog::Help => help(ui),
                Dialog::About => about(ui, player, renderer),
                Dialog::Open { path, error } => answer = open(ui, path, error.as_deref()),
                Dialog::Save { path, files, error } => {
                    answer = save(ui, path, files, error.as_deref());
                }
            });
            ui.add_space(8.0);
            if ui.button("Close").clicked() {
                answer = Some(Answer::Close);
            }
        });
    if modal.should_close() {
        answer = Some(Answer::Close);
    }
    answer
}

fn help(ui: &mut Ui) {
    ui.spacing_mut().interact_size.y = 18.0;
    let rows = BINDINGS
        .iter()
        .filter(|b| !b.written.is_empty())
        .map(|b| (b.written, b.help))
        .chain(POINTER);
    if ui.available_width() < NARROW {
        // Below each other, else the longer half of each line would be outside.
        for (key, help) in rows {
            ui.label(RichText::new(key).strong());
            ui.indent(key, |ui| ui.label(help));
        }
        return;
    }
    Grid::new("keys")
        .num_columns(2)
        .spacing([18.0, 5.0])
        .striped(true)
        .show(ui, |ui| {
            for (key, help) in rows {
                ui.label(RichText::new(key).strong());
                ui.label(help);
                ui.end_row();
            }
        });
}

fn about(ui: &mut Ui, player: &Player, renderer: &str) {
    ui.label(format!("Version {}", crate::VERSION));
    if !renderer.is_empty() {
        ui.label(format!("Drawn with {renderer}"))
            .on_hover_text("Graphics interface and adapter");
    }
    ui.label("A 3D laboratory that shows what play in a ball joint does to a machine.");
    ui.add_space(6.0);
    let scene = player.scene();
    ui.label(RichText::new(&scene.title).strong());
    ui.label(&scene.description);
    ui.add_space(6.0);
    ui.horizontal_wrapped(|ui| {
        ui.label("State hash");
        ui.monospace(format!("{:016x}", player.simulation().state_hash()));
    })
    .response
    .on_hover_text(
        "Names the whole state at the latest step: equal hashes are equal states, bit for bit",
    );
    if !scene.changes.is_empty() {
        ui.label("Changed parameters");
        for (key, value) in &scene.changes {
            ui.monospace(format!("{key} = {value}"));
        }
    }
}

fn open(ui: &mut Ui, path: &mut String, error: Option<&str>) -> Option<Answer> {
    ui.label("Path of a scene file (.toml), or the name of a built-in scene. A file can also be dropped on the window.");
    path_field(ui, path, "scene.toml", "Open", error).map(Answer::Open)
}

fn save(ui: &mut Ui, path: &mut String, files: &[SaveFile], error: Option<&str>) -> Option<Answer> {
    ui.label("Path of the file. A name without folders goes to the folder that the program was started in.");
    if let [first, rest @ ..] = files {
        for file in rest {
            let ending = file.name.strip_prefix(&first.name).unwrap_or(&file.name);
            ui.label(RichText::new(format!("What made it is saved beside it (…{ending})")).weak());
        }
    }
    path_field(ui, path, "name", "Save", error).map(Answer::Save)
}

/// A path with a button below it; the path once it is entered.
fn path_field(
    ui: &mut Ui,
    path: &mut String,
    hint: &str,
    button: &str,
    error: Option<&str>,
) -> Option<String> {
    let field = ui.add(
        TextEdit::singleline(path)
            .desired_width(f32::INFINITY)
            .hint_text(hint),
    );
    let entered = field.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
    if !entered && ui.memory(|memory| memory.focused().is_none()) {
        field.request_focus();
    }
    field.accessible_name("Path");
    if let Some(error) = error {
        ui.label(RichText::new(error).color(ui.visuals().error_fg_color));
    }
    let clicked = ui
        .add_enabled(!path.trim().is_empty(), egui::Button::new(button))
        .clicked();
    ((clicked || entered) && !path.trim().is_empty()).then(|| path.trim().to_owned())
}
