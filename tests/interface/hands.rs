//! The window as a user opens it, and gestures.

use eframe::egui::{self, Event, Key, Modifiers, PointerButton, Pos2, Shape, TouchPhase, accesskit::Role};
use egui_kittest::{Harness, kittest::Queryable as _};
use jointplay::app::{App, AppOptions};
use jointplay::scene::Scene;

/// The window on `scene` with some changes, paused at t = 0, by a `clock` that the test drives.
pub fn opened(
    scene: &str,
    changes: &[(&str, &str)],
    size: [f32; 2],
    theme: egui::Theme,
    clock: fn() -> f64,
) -> Harness<'static, App> {
    paced(scene, changes, size, theme, clock, 1.0 / 60.0)
}

/// The same with frames `dt` s after each other.
pub fn paced(
    scene: &str,
    changes: &[(&str, &str)],
    size: [f32; 2],
    theme: egui::Theme,
    clock: fn() -> f64,
    dt: f32,
) -> Harness<'static, App> {
    let own = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
    let changes: Vec<_> = changes.iter().map(own).collect();
    let mut options = AppOptions::new(Scene::load(scene, &changes).expect("a built-in scene"));
    options.playing = false;
    options.theme = theme.into();
    options.clock = clock;
    let mut harness = Harness::builder()
        .with_size(size)
        .with_theme(theme)
        .with_step_dt(dt)
        .with_max_steps(60)
        .wgpu()
        .build_eframe(move |cc| App::new(cc, options).expect("the scene starts"));
    harness.run();
    harness
}

/// Compares the window with the stored picture `name`, and every text in it with those stored beside: a picture must leave room for
/// other drivers, in which a digit would hide. `UPDATE_SNAPSHOTS=1` stores both.
pub fn compare_window(harness: &mut Harness<'_, App>, name: &str) {
    let path = format!("{}/tests/snapshots/{name}.txt", env!("CARGO_MANIFEST_DIR"));
    let mut texts = String::new();
    for part in &harness.output().shapes {
        add_texts(&part.shape, part.clip_rect, &mut texts);
    }
    if std::env::var_os("UPDATE_SNAPSHOTS").is_some() {
        std::fs::write(&path, &texts).expect("writes");
    }
    let stored = std::fs::read_to_string(&path).unwrap_or_default();
    let differs = stored.lines().zip(texts.lines()).find(|(a, b)| a != b);
    assert!(stored == texts, "{path}: {differs:?}");
    harness.snapshot(name);
}

/// The texts of `shape` that are in sight within `clip`, a line each.
fn add_texts(shape: &Shape, clip: egui::Rect, out: &mut String) {
    match shape {
        Shape::Vec(shapes) => shapes.iter().for_each(|shape| add_texts(shape, clip, out)),
        Shape::Text(text) if clip.intersects(text.visual_bounding_rect()) => {
            out.push_str(&text.galley.text().replace('\n', " / "));
            out.push('\n');
        }
        _ => {}
    }
}

/// Replaces what stands in a text field; nothing is entered yet.
pub fn type_over(harness: &mut Harness<'_, App>, label: &str, text: &str) {
    harness.get_by_role_and_label(Role::TextInput, label).focus();
    harness.step();
    harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
    harness.step();
    harness.get_by_role_and_label(Role::TextInput, label).type_text(text);
    harness.step();
}

/// Fingers on the screen, each with its way: they come down one after the other, move together and are lifted. The first is the
/// pointer, too, as in a real window.
pub fn fingers(harness: &mut Harness<'_, App>, paths: &[&[Pos2]]) {
    fingers_down(harness, paths);
    lift(harness, paths);
}

/// As [`fingers`], but they stay down.
pub fn fingers_down(harness: &mut Harness<'_, App>, paths: &[&[Pos2]]) {
    for (finger, path) in paths.iter().enumerate() {
        touch(harness, finger, TouchPhase::Start, path[0]);
        harness.step();
    }
    for step in 1..paths[0].len() {
        for (finger, path) in paths.iter().enumerate() {
            touch(harness, finger, TouchPhase::Move, path[step]);
        }
        harness.step();
    }
}

/// Lifts the fingers at the ends of their ways.
pub fn lift(harness: &mut Harness<'_, App>, paths: &[&[Pos2]]) {
    for (finger, path) in paths.iter().enumerate() {
        touch(harness, finger, TouchPhase::End, path[path.len() - 1]);
    }
    harness.step();
}

fn touch(harness: &mut Harness<'_, App>, finger: usize, phase: TouchPhase, pos: Pos2) {
    harness.event(Event::Touch {
        device_id: egui::TouchDeviceId(0),
        id: egui::TouchId::from(finger as u64),
        phase,
        pos,
        force: None,
    });
    if finger > 0 {
        return;
    }
    harness.event(Event::PointerMoved(pos));
    if phase != TouchPhase::Move {
        harness.event(Event::PointerButton {
            pos,
            button: PointerButton::Primary,
            pressed: phase == TouchPhase::Start,
            modifiers: Modifiers::NONE,
        });
    }
    if phase == TouchPhase::End {
        harness.event(Event::PointerGone);
    }
}
