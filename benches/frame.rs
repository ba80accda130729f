//! What one frame of the window costs the processor, stepping left out: interface, draw list, tessellation, encoding;
//! and the draw list by itself. Asked for: at most 2 ms at the default scene.
//!
//! `cargo bench --bench frame`; without a GPU, the drawing itself happens on the same processor and is waited for
//! outside the clock.

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{Criterion, criterion_group, criterion_main};
use jointplay::app::{AppOptions, Headless};
use jointplay::scene::Scene;
use jointplay::simulate::{Frame, Simulation};
use jointplay::view::{DrawList, PeakMarks, SceneView, Shot, ViewOptions};

const SIZE: [u32; 2] = [1280, 800];
/// Simulated before the frame, s: the plots have something to show.
const TIME: f64 = 0.1;

fn default_scene() -> Scene {
    Scene::load("spcmm", &[]).expect("built in")
}

fn frame(c: &mut Criterion) {
    let mut headless = Headless::new().expect("a graphics adapter");
    let mut app = headless
        .app(AppOptions::new(default_scene()))
        .expect("starts");
    app.player_mut().run_to(TIME);
    headless.app_frame(&mut app, SIZE, 1.0).expect("drawn");
    c.bench_function("frame of the window", |b| {
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

criterion_group!(benches, frame, draw_list);
criterion_main!(benches);
