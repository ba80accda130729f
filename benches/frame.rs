//! CPU cost of one frame of the window without stepping: interface, draw list, tessellation, encoding; and of the draw
//! list alone. Target: at most 2 ms for the default scene.
//!
//! `cargo bench --bench frame`; without a GPU, drawing itself runs on the same processor and is waited for outside the
//! measured time, but leaves cold caches and a driver that is part of the frame. Our own share alone, with a device that
//! does nothing: `WGPU_BACKEND=noop WGPU_NOOP_BACKEND=1 cargo bench --bench frame`.

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{Criterion, criterion_group, criterion_main};
use jointplay::app::{App, AppOptions, Headless};
use jointplay::scene::Scene;
use jointplay::simulate::{Frame, Simulation};
use jointplay::view::{DrawList, PeakMarks, SceneView, Shot, ViewOptions, WearMap};

const SIZE: [u32; 2] = [1280, 800];
/// Time simulated before the frame, s, so that the plots have something to show.
const TIME: f64 = 0.1;

fn default_scene() -> Scene {
    Scene::load("spcmm", &[]).expect("built in")
}

/// As the window opens, and with every instrument on: microscope, ideal ghost, twin, wear map, an abandoned future, over a
/// second of simulation.
fn frames(c: &mut Criterion) {
    frame(c, "frame of the window", |app| {
        app.player_mut().run_to(TIME);
    });
    frame(c, "frame with all instruments", |app| {
        app.microscope_mut().set_open(true);
        let player = app.player_mut();
        player.set_ideal(true);
        player.run_to(1.0);
        player.set_twin(true);
        player.go_to(0.5);
        player.set("contact.friction", "0.2").expect("in range");
        player.run_to(0.6);
        player.go_to(0.55);
    });
}

fn frame(c: &mut Criterion, name: &str, prepare: impl FnOnce(&mut App)) {
    let mut headless = Headless::new().expect("a graphics adapter");
    let mut options = AppOptions::new(default_scene());
    options.view.wear = if name.contains("all") {
        WearMap::Impulse
    } else {
        WearMap::Off
    };
    let mut app = headless.app(options).expect("starts");
    prepare(&mut app);
    headless.app_frame(&mut app, SIZE, 1.0).expect("drawn");
    c.bench_function(name, |b| {
        b.iter_custom(|frames| {
            let mut total = Duration::ZERO;
            for _ in 0..frames {
                let clock = Instant::now();
                headless.encode_frame(&mut app, SIZE, 1.0).expect("drawn");
                total += clock.elapsed();
                headless.wait();
            }
            total
        });
    });
}

fn draw_list(c: &mut Criterion) {
    let scene = default_scene();
    let mut simulation = Simulation::new(&scene).expect("starts");
    simulation.advance_to(TIME).expect("runs");
    let mut frame = Frame::default();
    simulation.sample(TIME, &mut frame);
    let view = SceneView::new(&scene, &frame);
    let options = ViewOptions {
        magnification: 20.0,
        ..ViewOptions::default()
    };
    let mut marks = PeakMarks::new();
    marks.update(&frame, &[], f64::INFINITY);
    let camera = view.camera();
    let mut list = DrawList::default();
    c.bench_function("draw list alone", |b| {
        b.iter(|| {
            let shot = Shot {
                scene: &scene,
                frame: &frame,
                marks: &marks,
                options: &options,
                camera: &camera,
                trail: &[],
                size: SIZE,
                pixels_per_point: 1.0,
            };
            view.build(black_box(&shot), &mut list);
        });
    });
}

criterion_group!(benches, frames, draw_list);
criterion_main!(benches);
