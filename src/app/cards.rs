//! Choices with pictures: the lessons and the built-in machines.

use std::sync::LazyLock;

use eframe::egui::{Atom, Button, Response, RichText, TextFormat, TextStyle, Ui, text::LayoutJob, vec2};

use super::graphics::Graphics;
use super::layout;
use super::lesson::{self, LessonCard};
use crate::scene::{BUILT_IN, Scene};

/// Width from which lessons stand in two columns, points.
const TWO_COLUMNS: f32 = 700.0;

/// A built-in scene in the list.
pub struct SceneCard {
    /// Its name.
    pub name: &'static str,
    title: String,
    /// The first sentence of its description.
    sentence: String,
}

/// The built-in scenes.
pub static SCENES: LazyLock<Vec<SceneCard>> = LazyLock::new(|| {
    let about = |name| {
        let scene = Scene::load(name, &[]).ok()?;
        let description = scene.description.trim();
        let end = description.find(". ").map_or(description.len(), |end| end + 1);
        Some(SceneCard { name, sentence: description[..end].to_owned(), title: scene.title.clone() })
    };
    BUILT_IN.into_iter().filter_map(about).collect()
});

impl SceneCard {
    /// Draws it: picture, title, and the sentence below it.
    pub fn ui(&self, ui: &mut Ui, picture: Atom<'_>, chosen: bool, width: f32) -> Response {
        let help = format!("`{}` on the command line", self.name);
        let response = card(ui, picture, [&self.title, &self.sentence, ""], chosen, width).on_hover_text(help);
        let id = response.id;
        let response = response.accessible_name(self.name);
        ui.ctx().accesskit_node_builder(id, |node| node.set_description(&*self.title));
        response
    }
}

/// A button with a picture beside a title, a sentence and a note.
fn card(ui: &mut Ui, picture: Atom<'_>, lines: [&str; 3], chosen: bool, width: f32) -> Response {
    let mut words = LayoutJob::default();
    let [title, sentence, note] = lines;
    let mut append = |text: &str, style: TextStyle, colour| {
        words.append(text, 0.0, TextFormat::simple(style.resolve(ui.style()), colour));
    };
    append(title, TextStyle::Body, ui.visuals().strong_text_color());
    append("\n", TextStyle::Small, ui.visuals().text_color());
    append(sentence, TextStyle::Small, ui.visuals().text_color());
    if !note.is_empty() {
        append("\n", TextStyle::Small, ui.visuals().text_color());
        append(note, TextStyle::Small, ui.visuals().selection.stroke.color);
    }
    ui.add(Button::selectable(chosen, (picture, words)).gap(10.0).wrap().min_size(vec2(width, 0.0)))
}

/// The built-in machines; returns the name of the chosen one.
pub fn machines(ui: &mut Ui, graphics: &mut Graphics, running: &str) -> Option<&'static str> {
    layout::show_bar(ui);
    ui.set_width(ui.available_width() - 12.0);
    let mut chosen = None;
    for scene in &*SCENES {
        let picture = graphics.scene_picture(ui, false, scene.name);
        if scene.ui(ui, picture, scene.name == running, ui.available_width()).clicked() {
            chosen = Some(scene.name);
        }
    }
    chosen
}

/// The built-in lessons in the order of a lecture; returns the name of the chosen one.
pub fn lessons(ui: &mut Ui, graphics: &mut Graphics) -> Option<&'static str> {
    ui.label("Each lesson asks what will happen, and the machine gives the answer. They build on one another.");
    ui.add_space(4.0);
    layout::show_bar(ui);
    ui.set_width(ui.available_width() - 12.0);
    let mut chosen = None;
    let columns = if ui.available_width() < TWO_COLUMNS { 1 } else { 2 };
    let all = lesson::cards();
    // Down the first column, then down the second.
    let rows = all.len().div_ceil(columns);
    ui.columns(columns, |uis| {
        for (ui, (column, cards)) in uis.iter_mut().zip(all.chunks(rows).enumerate()) {
            for (row, card) in cards.iter().enumerate() {
                if lesson_card(ui, graphics, card, column * rows + row).clicked() {
                    chosen = Some(card.name);
                }
            }
        }
    });
    chosen
}

/// The card of the lesson at `place` in the order.
fn lesson_card(ui: &mut Ui, graphics: &mut Graphics, lesson: &LessonCard, place: usize) -> Response {
    if place == 0 {
        let colour = ui.visuals().selection.stroke.color;
        ui.label(RichText::new("Start here").strong().color(colour));
    }
    let picture = graphics.lesson_picture(ui, lesson);
    let title = format!("{}. {}", place + 1, lesson.title);
    let note = format!("About {} min, {} steps", lesson.minutes, lesson.steps);
    let response = card(ui, picture, [&title, &lesson.about, &note], false, ui.available_width());
    let id = response.id;
    let response = response.accessible_name(&lesson.title);
    ui.ctx().accesskit_node_builder(id, |node| node.set_description(format!("{}. {note}", lesson.about)));
    response
}
