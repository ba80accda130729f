//! Frames of the whole application, and pictures of the scene with an overlay, without a window.

use std::collections::HashSet;
use std::sync::Arc;

use eframe::egui::{self, ThemePreference};
use jointplay::app::{AppOptions, Headless, Overlay, force_notes};
use jointplay::render::{Image, RenderError};
use jointplay::scene::Scene;
use jointplay::simulate::{Frame, Simulation};
use jointplay::view::{DrawList, PeakMarks, SceneView, Shot, Theme, ViewOptions};

fn colour_count(image: &Image) -> usize {
    let pixels: HashSet<&[u8]> = image.rgba.chunks_exact(4).collect();
    pixels.len()
}

/// A frame of the application at `at`, s, drawn in a new context.
fn app_frame(at: f64, size: [u32; 2]) -> Result<Image, RenderError> {
    let mut options = AppOptions::new(Scene::load("spcmm", &[]).expect("built in"));
    options.theme = ThemePreference::Light;
    options.playing = false;
    let mut headless = Headless::new().expect("software Vulkan at least");
    let mut app = headless.app(options).expect("starts");
    app.run_to(at);
    headless.app_frame(&mut app, size, 1.0)
}

#[test]
fn frames_of_the_application_are_reproducible_and_show_their_instant() {
    let first = app_frame(7.85e-3, [900, 600]).expect("drawn");
    assert_eq!((first.width, first.height), (900, 600));
    assert_eq!(first.rgba.len(), 900 * 600 * 4);
    assert!(colour_count(&first) > 500, "an empty picture has few colours: {}", colour_count(&first));
    let repeated = app_frame(7.85e-3, [900, 600]).expect("drawn");
    assert!(first == repeated, "the pictures of one instant differ");
    let other = app_frame(12e-3, [900, 600]).expect("drawn");
    assert!(first != other, "the picture did not change with the instant");
}

#[test]
fn a_size_that_cannot_be_drawn_is_refused() {
    let error = app_frame(0.0, [0, 600]).expect_err("an empty picture");
    assert!(error.to_string().contains("0x600"), "{error}");
}

#[test]
fn the_overlay_adds_to_the_plain_picture() {
    let scene = Scene::load("spcmm", &[]).expect("built in");
    let mut simulation = Simulation::new(&scene.machine).expect("starts");
    simulation.advance_to(7.85e-3).expect("runs");
    let mut frame = Frame::default();
    simulation.sample(7.85e-3, &mut frame);
    let view = SceneView::new(&scene, &frame);
    let options = ViewOptions::default();
    let mut marks = PeakMarks::new();
    marks.update(&frame, &[], f64::INFINITY);
    let notes = force_notes(&scene, &frame);
    let overlay =
        Overlay { time: Some(7.85e-3), notes: notes.clone(), legend: true, labels: true, ..Overlay::default() };
    let whole = egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(640.0, 360.0));
    let strips = jointplay::app::strips(whole, &overlay, 1 + notes.len(), &options, false);
    let mut list = DrawList::default();
    view.build(
        &Shot {
            scene: &scene,
            frame: &frame,
            marks: &marks,
            options: &options,
            camera: &view.camera(),
            trail: &[],
            size: [strips.scene.width() as u32, strips.scene.height() as u32],
            pixels_per_point: 1.0,
        },
        &mut list,
    );
    let list = Arc::new(list);
    assert_eq!(notes.len(), 3);
    assert!(notes[0].starts_with("S1  normal "), "{}", notes[0]);

    let mut headless = Headless::new().expect("software Vulkan at least");
    let plain = headless.picture(&list, &Overlay::default(), &strips, Theme::Light).expect("drawn");
    let with_overlay = headless.picture(&list, &overlay, &strips, Theme::Light).expect("drawn");
    let changed = plain.rgba.chunks_exact(4).zip(with_overlay.rgba.chunks_exact(4)).filter(|(a, b)| a != b).count();
    let part = changed as f64 / (640.0 * 360.0);
    assert!((0.01..0.3).contains(&part), "the overlay covers {part} of the picture");
}
