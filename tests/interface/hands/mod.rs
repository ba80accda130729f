//! Opens windows for tests and performs gestures.

pub mod bench;
pub mod lesson;
pub mod page;
pub mod window;

use std::collections::BTreeSet;

use eframe::egui::{self, Event, Key, Modifiers, PointerButton, Pos2, Shape, TouchPhase, accesskit::Role};
use eframe::egui_wgpu::{RenderState, RendererOptions};
use egui_kittest::wgpu::{WgpuTestRenderer, create_render_state, default_wgpu_setup};
use egui_kittest::{Harness, HarnessBuilder, LazyRenderer, kittest::Queryable as _};
use jointplay::app::{App, AppOptions};
use jointplay::integrate::Method;
use jointplay::scene::Scene;
use jointplay::simulate::{Impact, Peak, Simulation};

use crate::golden::{self, PLAIN, Picture, compare};

/// A new graphics adapter.
fn graphics() -> RenderState {
    create_render_state(default_wgpu_setup(), RendererOptions::PREDICTABLE)
}

/// A window of `size` that creates its graphics adapter when a test first asks for a picture: most tests read only texts, and
/// creating an adapter with its shaders takes longer than such a test.
pub fn builder(size: [f32; 2], theme: egui::Theme) -> HarnessBuilder<App> {
    let renderer = LazyRenderer::new(|| {
        let graphics = graphics();
        jointplay::render::install(&graphics);
        WgpuTestRenderer::from_render_state(graphics)
    });
    Harness::builder().with_size(size).with_theme(theme).with_step_dt(1.0 / 60.0).with_max_steps(60).renderer(renderer)
}

/// Gives the window an adapter for off-screen drawing: pictures and films.
pub fn give_graphics(harness: &mut Harness<'_, App>) {
    let ctx = harness.ctx.clone();
    let theme = ctx.theme();
    harness.state_mut().attach(&ctx, Some(&graphics()), theme.into());
}

/// The window on `scene` with some changes, paused at t = 0; `clock` replaces the real one.
pub fn opened(
    scene: &str,
    changes: &[(&str, &str)],
    size: [f32; 2],
    theme: egui::Theme,
    clock: fn() -> f64,
) -> Harness<'static, App> {
    paced(scene, changes, size, theme, clock, 1.0 / 60.0)
}

/// As [`opened`], with `dt` seconds between frames.
pub fn paced(
    scene: &str,
    changes: &[(&str, &str)],
    size: [f32; 2],
    theme: egui::Theme,
    clock: fn() -> f64,
    dt: f32,
) -> Harness<'static, App> {
    let owned = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
    let changes: Vec<_> = changes.iter().map(owned).collect();
    let mut options = AppOptions::new(Scene::load(scene, &changes).expect("a built-in scene"));
    options.playing = false;
    options.theme = theme.into();
    options.clock = clock;
    let builder = builder(size, theme).with_step_dt(dt);
    let mut harness = builder.build_eframe(move |cc| App::new(cc, options).expect("the scene starts"));
    harness.run();
    harness
}

/// The window on `scene` with some changes and [`PLAIN`] steps, for comparison with stored texts.
pub fn plain(scene: &str, changes: &[(&str, &str)], size: [f32; 2], theme: egui::Theme) -> Harness<'static, App> {
    opened(scene, &[changes, &PLAIN].concat(), size, theme, crate::common::ticking_clock::<10>)
}

/// Folder of the stored texts and pictures of windows.
const STORED: &str = "tests/golden/window";

/// Windows with a stored picture; together they show everything that is drawn.
const PICTURED: [&str; 8] = [
    "bench_sweep",
    "energy_balance",
    "ghosts_dark",
    "lesson_twin",
    "microscope_light",
    "past_dark",
    "presentation_dark",
    "wear_phone",
];

/// Compares all visible texts exactly with those stored under `name`, and for [`PICTURED`] windows the picture at half its size. The
/// picture's tolerance for other drivers would hide a changed digit.
#[track_caller]
pub fn compare_window(harness: &mut Harness<'_, App>, name: &str) {
    let method = harness.state().player().running().machine.solver.method;
    assert_eq!(method, Method::RungeKutta4, "{name} runs with an adaptive method");
    let path = format!("{}/{STORED}/{name}.txt", env!("CARGO_MANIFEST_DIR"));
    let mut texts = String::new();
    for part in &harness.output().shapes {
        add_texts(&part.shape, part.clip_rect, &mut texts);
    }
    if golden::storing() {
        std::fs::write(&path, &texts).expect("writable");
    }
    let stored = std::fs::read_to_string(&path).unwrap_or_default();
    let differs = stored.lines().zip(texts.lines()).find(|(a, b)| a != b);
    assert!(stored == texts, "{path}: {differs:?}");
    if PICTURED.contains(&name) {
        let image = harness.render().expect("drawn");
        let picture = Picture::new([image.width(), image.height()], image.as_raw());
        compare(STORED, name, &picture.half(), "the window at half its size");
    }
}

#[test]
fn stored_windows_have_few_and_small_pictures() {
    if golden::storing() {
        return;
    }
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(STORED);
    let files = std::fs::read_dir(folder).expect("a folder").map(|file| file.expect("readable").path());
    let (pictures, texts): (Vec<_>, Vec<_>) =
        files.partition(|file| file.extension().is_some_and(|ending| ending == "png"));
    let names = |files: &[std::path::PathBuf]| -> BTreeSet<String> {
        files.iter().map(|file| file.file_stem().expect("a name").to_string_lossy().into_owned()).collect()
    };
    assert_eq!(names(&pictures), PICTURED.map(String::from).into());
    assert!(names(&texts).is_superset(&names(&pictures)));
    let size: u64 = pictures.iter().map(|file| file.metadata().expect("readable").len()).sum();
    assert!(size < 1_000_000, "{size} bytes");
}

/// Appends the texts of `shape` visible within `clip`, one per line.
pub fn add_texts(shape: &Shape, clip: egui::Rect, out: &mut String) {
    match shape {
        Shape::Vec(shapes) => shapes.iter().for_each(|shape| add_texts(shape, clip, out)),
        Shape::Text(text) if clip.intersects(text.visual_bounding_rect()) => {
            out.push_str(&text.galley.text().replace('\n', " / "));
            out.push('\n');
        }
        _ => {}
    }
}

/// Replaces the content of a text field without pressing Enter.
pub fn type_over(harness: &mut Harness<'_, App>, label: &str, text: &str) {
    harness.get_by_role_and_label(Role::TextInput, label).focus();
    harness.step();
    harness.key_press_modifiers(Modifiers::COMMAND, Key::A);
    harness.step();
    harness.get_by_role_and_label(Role::TextInput, label).type_text(text);
    harness.step();
}

/// Fingers on the screen, each with its path: they touch down one after the other, move together and are lifted. The first also
/// moves the pointer, as in a real window.
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

/// Lifts the fingers at the ends of their paths.
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

/// The impacts of a separate run of the same scene until `time`, s, in the order of their starts, each with the instant of its largest force, s.
pub fn peaks_of_run(app: &App, time: f64) -> Vec<(Impact, f64)> {
    let mut simulation = Simulation::new(&app.player().running().machine).expect("starts");
    let (mut impacts, mut latest, mut peaks) = (Vec::new(), Vec::new(), Vec::<(usize, Peak)>::new());
    while simulation.time() < time {
        simulation.step().expect("runs");
        impacts.extend(simulation.take_impacts());
        simulation.take_peaks(&mut latest);
        peaks.extend(latest.iter().copied().enumerate());
    }
    impacts.retain(|impact| impact.end <= time);
    impacts.sort_by(|a, b| a.start.total_cmp(&b.start));
    let instant = |impact: &Impact| {
        let of_it = peaks
            .iter()
            .filter(|(joint, peak)| *joint == impact.joint && (impact.start..=impact.end).contains(&peak.time));
        let largest = of_it.max_by(|a, b| a.1.normal.total_cmp(&b.1.normal)).expect("a force");
        assert_eq!(largest.1.normal, impact.peak);
        largest.1.time
    };
    impacts.iter().map(|impact| (*impact, instant(impact))).collect()
}
