//! What one frame of the window costs the processor, stepping left out: interface, draw list, tessellation, encoding.
//! Asked for: at most 2 ms at the default scene.

use std::time::{Duration, Instant};

use criterion::{Criterion, criterion_group, criterion_main};
use jointplay::app::{AppOptions, Headless};
use jointplay::scene::Scene;

const SIZE: [u32; 2] = [1280, 800];

fn frame(c: &mut Criterion) {
    let mut headless = Headless::new().expect("a graphics adapter");
    let options = AppOptions::new(Scene::load("spcmm", &[]).expect("built in"));
    let mut app = headless.app(options).expect("starts");
    app.player_mut().run_to(0.1);
    headless.app_frame(&mut app, SIZE, 1.0).expect("drawn");
    c.bench_function("frame of the window", |b| {
        b.iter_custom(|frames| {
            let mut total = Duration::ZERO;
            for _ in 0..frames {
                let clock = Instant::now();
                headless.encode_frame(&mut app, SIZE, 1.0).expect("drawn");
                total += clock.elapsed();
                // A software device draws on the same processor: let it finish outside the clock.
                headless.wait();
            }
            total
        });
    });
}

criterion_group!(benches, frame);
criterion_main!(benches);
