//! Dialogs: list of keys, about box, file opening, link with QR code, and others.

use eframe::egui::{self, Align2, Id, Label, Modal, RichText, ScrollArea, TextEdit, Ui};

use super::command::Command;
use super::film::{self, FilmSettings};
use super::graphics::Graphics;
use super::host::SaveFile;
use super::keys::Group;
use super::load::Load;
use super::player::Player;
use super::{cards, spoken};
use crate::analysis::ready_sweeps::ReadySweep;
pub use code::SharedLink;

mod code;

/// Least width of a column of the list of keys, and width of its keys, points.
const MIN_COLUMN_WIDTH: f32 = 340.0;
const KEYS_WIDTH: f32 = 126.0;
/// Column width below which keys and descriptions are stacked, points.
const MIN_WIDTH_SIDE_BY_SIDE: f32 = 300.0;

/// The open dialog.
#[derive(Clone, Debug, PartialEq)]
pub enum Dialog {
    /// List of keys.
    Help,
    /// The lessons, and the one chosen.
    Lessons {
        /// Its name.
        chosen: Option<&'static str>,
    },
    /// The built-in machines, and the one chosen.
    Machines {
        /// Its name.
        chosen: Option<&'static str>,
    },
    /// Version and state.
    About,
    /// Opens a link, a file or a built-in scene: the text typed so far and its error.
    Open {
        /// Link, path or name.
        path: String,
        /// Why it could not be opened.
        error: Option<String>,
    },
    /// Saves files: the path of the first file as typed so far, and its error.
    Save {
        /// Path.
        path: String,
        /// The files, named as suggested.
        files: Vec<SaveFile>,
        /// Why they could not be saved.
        error: Option<String>,
    },
    /// Shows a link as a QR code, and asks for a missing address.
    Link(SharedLink),
    /// Settings of a film.
    Film {
        /// Settings so far.
        settings: FilmSettings,
    },
    /// Runs to a section of a sweep whose scene differs from the displayed one.
    Load {
        /// The run to the section.
        load: Box<Load>,
        /// Resulting changes, one phrase each.
        changes: Vec<String>,
    },
    /// Starts a ready sweep whose scene replaces a modified one.
    Ready {
        /// The sweep.
        sweep: &'static ReadySweep,
        /// Changes that would be lost, one phrase each.
        lost: Vec<String>,
    },
    /// Resets everything to first-start settings.
    #[cfg(not(target_arch = "wasm32"))]
    StartAsNew,
}

impl Dialog {
    /// Asks for a link, a file or a built-in scene.
    pub fn open() -> Self {
        Self::Open { path: String::new(), error: None }
    }

    fn title(&self) -> &'static str {
        match self {
            Self::Help => "Keyboard shortcuts",
            Self::Lessons { .. } => "Lessons",
            Self::Machines { .. } => "Choose a machine",
            Self::About => "About Jointplay",
            Self::Open { .. } => "Open a link or a scene",
            Self::Save { .. } => "Save as",
            Self::Link(_) => "Link to this state and view",
            Self::Film { .. } => "Film",
            Self::Load { .. } => "Change the running scene?",
            Self::Ready { .. } => "Replace the running scene?",
            #[cfg(not(target_arch = "wasm32"))]
            Self::StartAsNew => "Start fresh?",
        }
    }

    /// Label of its button, and whether it can be pressed yet; `None` if there is nothing to answer.
    fn button(&self) -> Option<(&'static str, bool)> {
        Some(match self {
            Self::Help | Self::About | Self::Lessons { .. } | Self::Machines { .. } => return None,
            Self::Link(shared) => ("Copy", shared.can_be_copied()),
            Self::Open { path, .. } => ("Open", !path.trim().is_empty()),
            Self::Save { path, .. } => ("Save", !path.trim().is_empty()),
            Self::Film { settings } => ("Make film", settings.objection().is_none()),
            Self::Load { .. } => ("Change and run", true),
            Self::Ready { .. } => ("Replace and sweep", true),
            #[cfg(not(target_arch = "wasm32"))]
            Self::StartAsNew => ("Start fresh", true),
        })
    }

    /// Label of the button that closes it without an effect.
    fn refusal(&self) -> &'static str {
        match self {
            Self::Load { .. } | Self::Ready { .. } => "Keep this scene",
            #[cfg(not(target_arch = "wasm32"))]
            Self::StartAsNew => "Keep everything",
            Self::Help | Self::About | Self::Lessons { .. } | Self::Machines { .. } | Self::Link(_) => "Close",
            Self::Open { .. } | Self::Save { .. } | Self::Film { .. } => "Cancel",
        }
    }

    /// Whether a text field takes the focus.
    fn has_field(&self) -> bool {
        match self {
            Self::Open { .. } | Self::Save { .. } => true,
            Self::Link(shared) => shared.is_editable(),
            _ => false,
        }
    }

    /// The command that its button gives.
    pub fn command(self) -> Option<Command> {
        Some(match self {
            Self::Help | Self::About => return None,
            Self::Lessons { chosen } => Command::Lesson(chosen?),
            Self::Machines { chosen } => Command::Open(chosen?.to_owned()),
            Self::Link(shared) => Command::CopyShared(shared),
            Self::Open { path, .. } => Command::OpenAny(path.trim().to_owned()),
            Self::Save { path, files, .. } => Command::SaveAs(path.trim().to_owned(), files),
            Self::Film { settings } => Command::MakeFilm(settings),
            Self::Load { load, .. } => Command::GoToSection(load),
            Self::Ready { sweep, .. } => Command::StartSweep(sweep),
            #[cfg(not(target_arch = "wasm32"))]
            Self::StartAsNew => Command::StartAsNew,
        })
    }
}

/// Shows `dialog`, which takes the focus if it is `new`. Returns whether its button was pressed once it is to close.
pub fn ui(
    ctx: &egui::Context,
    dialog: &mut Dialog,
    new: bool,
    player: &Player,
    graphics: &mut Graphics,
) -> Option<bool> {
    let mut answer = None;
    // Title, buttons and frame stay visible on a low screen and when the text grows.
    let max_height = (ctx.content_rect().height() - 140.0).max(80.0);
    let width = match dialog {
        Dialog::Link(_) => max_height.clamp(200.0, 720.0),
        Dialog::Help => 1120.0,
        Dialog::Lessons { .. } => 960.0,
        Dialog::Machines { .. } => 640.0,
        _ => 520.0,
    };
    let widest = (ctx.content_rect().width() - 48.0).min(width);
    let frame = egui::Frame::window(&ctx.global_style());
    let id = Id::unique("dialog");
    let mut area = Modal::default_area(id).accessible_name(dialog.title());
    if let Dialog::Link(_) = dialog {
        // It grows downwards when its code appears.
        area = area.anchor(Align2::CENTER_TOP, [0.0, 24.0]);
    }
    let modal = Modal::new(id).area(area).frame(frame).show(ctx, |ui| {
        ui.set_width(widest);
        spoken::heading(&ui.heading(dialog.title()), dialog.title());
        ui.add_space(6.0);
        let scrolled = ScrollArea::vertical().max_height(max_height).min_scrolled_height(max_height);
        let entered = scrolled
            .show(ui, |ui| match dialog {
                Dialog::Help => help(ui),
                Dialog::Lessons { chosen } => {
                    *chosen = cards::lessons(ui, graphics);
                    chosen.is_some()
                }
                Dialog::Machines { chosen } => {
                    *chosen = cards::machines(ui, graphics, &player.running().name);
                    chosen.is_some()
                }
                Dialog::About => about(ui, player, &graphics.renderer),
                Dialog::Open { path, error } => open(ui, path, error.as_deref(), new),
                Dialog::Save { path, files, error } => save(ui, path, files, error.as_deref(), new),
                Dialog::Link(shared) => code::ui(ui, shared, new),
                Dialog::Film { settings } => film::settings_ui(ui, settings, player.reached()),
                Dialog::Load { changes, .. } => {
                    list(ui, "The sweep was made from a different scene. Running to this section changes:", changes)
                }
                Dialog::Ready { sweep, lost } => {
                    let words = format!("The sweep runs over the scene {}. These changes would be lost:", sweep.scene);
                    list(ui, &words, lost)
                }
                #[cfg(not(target_arch = "wasm32"))]
                Dialog::StartAsNew => {
                    let words = "Forgets window size, type size, theme, last scene and recent files, and opens the \
                                 default scene. The current run is lost.";
                    list(ui, words, &[])
                }
            })
            .inner;
        ui.add_space(8.0);
        ui.horizontal(|ui| {
            if let Some((verb, possible)) = dialog.button() {
                let button = ui.add_enabled(possible, egui::Button::new(verb));
                if possible && (button.clicked() || entered) {
                    answer = Some(true);
                }
            } else if entered {
                answer = Some(true);
            }
            let close = ui.button(dialog.refusal());
            if new && !dialog.has_field() {
                close.request_focus();
            }
            if close.clicked() {
                answer = Some(false);
            }
        });
        if let Dialog::Link(shared) = dialog {
            code::picture(ui, shared);
        }
    });
    if modal.should_close() {
        answer = Some(false);
    }
    answer
}

/// The list of keys: groups in as many columns as fit.
fn help(ui: &mut Ui) -> bool {
    ui.spacing_mut().interact_size.y = 18.0;
    ui.spacing_mut().item_spacing.y = 4.0;
    let columns: &[&[Group]] = match ui.available_width() {
        width if width >= 3.0 * MIN_COLUMN_WIDTH => {
            &[&[Group::Run, Group::Window], &[Group::Picture, Group::Focus], &[Group::Pointer]]
        }
        width if width >= 2.0 * MIN_COLUMN_WIDTH => {
            &[&[Group::Run, Group::Picture, Group::Focus], &[Group::Window, Group::Pointer]]
        }
        _ => &[&[Group::Run, Group::Picture, Group::Window, Group::Pointer, Group::Focus]],
    };
    ui.columns(columns.len(), |uis| {
        for (ui, groups) in uis.iter_mut().zip(columns) {
            for group in *groups {
                ui.label(RichText::new(group.title()).small().weak());
                for (key, help) in group.rows() {
                    key_row(ui, key, help);
                }
                ui.add_space(8.0);
            }
        }
    });
    false
}

fn key_row(ui: &mut Ui, key: &str, help: &str) {
    let key = Label::new(RichText::new(key).strong()).wrap();
    let help = Label::new(help).wrap();
    if ui.available_width() < MIN_WIDTH_SIDE_BY_SIDE {
        // Stacked, since the longer part of each line would be cut off otherwise.
        ui.add(key);
        ui.indent("help", |ui| ui.add(help));
        return;
    }
    ui.horizontal_top(|ui| {
        ui.allocate_ui(egui::vec2(KEYS_WIDTH, 0.0), |ui| {
            ui.set_width(KEYS_WIDTH);
            ui.add(key);
        });
        ui.add(help);
    });
}

fn about(ui: &mut Ui, player: &Player, renderer: &str) -> bool {
    ui.label(format!("Version {}", crate::VERSION));
    if !renderer.is_empty() {
        ui.label(format!("Drawn with {renderer}")).on_hover_text("Graphics interface and adapter");
    }
    ui.label("A 3D laboratory that shows what play in a joint does to a machine.");
    #[cfg(target_arch = "wasm32")]
    ui.add(
        egui::Hyperlink::from_label_and_url("Licences of the fonts and libraries", "licences.txt")
            .open_in_new_tab(true),
    );
    ui.add_space(6.0);
    let scene = player.running();
    ui.label(RichText::new(&scene.title).strong());
    ui.label(scene.description.replace('`', ""));
    ui.add_space(6.0);
    ui.horizontal_wrapped(|ui| {
        ui.label("State hash");
        ui.monospace(format!("{:016x}", player.simulation().state_hash()));
    })
    .response
    .on_hover_text("Identifies the complete state at the latest step: equal hashes mean equal states, bit for bit");
    if !scene.changes.is_empty() {
        ui.label("Changed parameters");
        for (key, value) in &scene.changes {
            ui.monospace(format!("{key} = {value}"));
        }
    }
    false
}

fn open(ui: &mut Ui, path: &mut String, error: Option<&str>, new: bool) -> bool {
    ui.label(
        "A link, the path of a scene file (.toml), or the name of a built-in scene. A file can also be dropped on the \
         window, together with the files that it names, and a link can be pasted.",
    );
    path_field(ui, path, "https://…#scene=…, scene.toml or pendulum", error, new)
}

fn save(ui: &mut Ui, path: &mut String, files: &[SaveFile], error: Option<&str>, new: bool) -> bool {
    ui.label("Path of the file. A name without a folder is saved in the folder in which the program was started.");
    if let [first, rest @ ..] = files {
        for file in rest {
            let ending = file.name.strip_prefix(&first.name).unwrap_or(&file.name);
            ui.label(RichText::new(format!("Its metadata is saved beside it (…{ending})")).weak());
        }
    }
    path_field(ui, path, "name", error, new)
}

fn list(ui: &mut Ui, words: &str, changes: &[String]) -> bool {
    ui.label(words);
    for change in changes {
        ui.label(RichText::new(change).strong());
    }
    false
}

/// The text field with its error below; returns whether Enter was pressed.
fn path_field(ui: &mut Ui, path: &mut String, hint: &str, error: Option<&str>, new: bool) -> bool {
    let field = ui.add(TextEdit::singleline(path).desired_width(f32::INFINITY).hint_text(hint));
    let entered = field.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
    if new || (!entered && ui.memory(|memory| memory.focused().is_none())) {
        field.request_focus();
    }
    field.accessible_name("Path");
    if let Some(error) = error {
        ui.label(RichText::new(error).color(ui.visuals().error_fg_color));
    }
    entered
}
