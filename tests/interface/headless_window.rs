//! Frames of the whole application and of plain pictures with an overlay, without a window.

use std::collections::HashSet;
use std::sync::Arc;

use eframe::egui::ThemePreference;
use jointplay::app::{AppOptions, Headless, Overlay, force_notes};
use jointplay::render::{Image, RenderError};
use jointplay::scene::Scene;
use jointplay::simulate::{Frame, Simulation};
use jointplay::view::{DrawList, PeakMarks, SceneView, Shot, Theme, ViewOptions};

fn colours(image: &Image) -> usize {
    let pixels: HashSet<&[u8]> = image.rgba.chunks_exact(4).collect();
    pixels.len()
}

/// The application at `at`, s, in a context of its own.
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
fn a_frame_of_the_application_is_the_same_each_time_and_shows_its_instant() {
    let first = app_frame(7.85e-3, [900, 600]).expect("drawn");
    assert_eq!((first.width, first.height), (900, 600));
    assert_eq!(first.rgba.len(), 900 * 600 * 4);
    assert!(colours(&first) > 500, "an empty picture has few colours: {}", colours(&first));
    let again = app_frame(7.85e-3, [900, 600]).expect("drawn");
    assert!(first == again, "same instant, same picture");
    let later = app_frame(12e-3, [900, 600]).expect("drawn");
    assert!(first != later, "another instant, another picture");
}

#[test]
fn a_size_that_cannot_be_drawn_is_refused() {
    let error = app_frame(0.0, [0, 600]).expect_err("no picture is empty");
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
    let mut list = DrawList::default();
    view.build(
        &Shot {
            scene: &scene,
            frame: &frame,
            marks: &marks,
            options: &options,
            camera: &view.camera(),
            trail: &[],
            size: [640, 360],
            pixels_per_point: 1.0,
        },
        &mut list,
    );
    let list = Arc::new(list);
    let notes = force_notes(&scene, &frame);
    assert_eq!(notes.len(), 3);
    assert!(notes[0].starts_with("S1  normal "), "{}", notes[0]);

    let mut headless = Headless::new().expect("software Vulkan at least");
    let plain = headless.picture(&list, &Overlay::default(), Theme::Light, 1.0).expect("drawn");
    let overlay = Overlay { time: Some(7.85e-3), notes, legend: true, labels: true };
    let written = headless.picture(&list, &overlay, Theme::Light, 1.0).expect("drawn");
    let changed = plain.rgba.chunks_exact(4).zip(written.rgba.chunks_exact(4)).filter(|(a, b)| a != b).count();
    let part = changed as f64 / (640.0 * 360.0);
    assert!((0.01..0.3).contains(&part), "the overlay covers {part} of the picture");
}
