//! CPU cost of one frame of the window without stepping: interface, draw list, tessellation, encoding; of the draw list
//! alone, also for the longest chain; and of the sound of a frame. Targets: at most 2 ms for the default scene, of which a
//! presentation and sound take less than 0.5 ms each. Then the time of whole pictures.
//!
//! `cargo bench --bench frame`; without a GPU, drawing itself runs on the same processor and is waited for outside the
//! measured time, but leaves cold caches and a driver that is part of the frame. To measure only our own part, use a device
//! that does nothing: `WGPU_BACKEND=noop WGPU_NOOP_BACKEND=1 cargo bench --bench frame`.

use std::hint::black_box;
use std::time::Instant;

use eframe::egui;
use jointplay::app::{App, AppOptions, Click, Headless, MAX_CLICKS, PITCHES, TimeWindow, Voice, clicks};
use jointplay::render::Offscreen;
use jointplay::scene::Scene;
use jointplay::simulate::{Frame, Impact, Simulation};
use jointplay::view::{DrawList, PeakMarks, SceneView, Shot, ViewOptions, WearMap};
use timing::Stopwatch;

mod timing;

const SIZE: [u32; 2] = [1280, 800];
/// Time simulated before the frame, s, so that the plots have something to show.
const TIME: f64 = 0.1;

fn default_scene() -> Scene {
    Scene::load("spcmm", &[]).expect("built in")
}

/// The window as it opens, as a presentation, with the longest chain, and with every instrument on: microscope, ideal ghost,
/// twin, wear map and an abandoned future, after about a second of simulation.
fn frames(watch: &Stopwatch) {
    frame(watch, "frame of the window", default_scene(), |app, _| {
        app.player_mut().run_to(TIME);
    });
    frame(watch, "frame of a presentation", default_scene(), |app, ctx| {
        app.player_mut().run_to(TIME);
        app.present(ctx, true);
    });
    frame(watch, "frame of the longest chain", longest_chain(), |_, _| {});
    frame(watch, "frame with all instruments", default_scene(), |app, _| {
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

fn frame(watch: &Stopwatch, name: &str, scene: Scene, prepare: impl FnOnce(&mut App, &egui::Context)) {
    let mut headless = Headless::new().expect("a graphics adapter");
    let mut options = AppOptions::new(scene);
    options.view.wear = if name.contains("all") { WearMap::Impulse } else { WearMap::Off };
    let mut app = headless.app(options).expect("starts");
    prepare(&mut app, headless.context());
    headless.app_frame(&mut app, SIZE, 1.0).expect("drawn");
    watch.time_part(name, || {
        let clock = Instant::now();
        headless.encode_frame(&mut app, SIZE, 1.0).expect("drawn");
        let time = clock.elapsed();
        headless.wait();
        time
    });
}

/// An instant of a scene, and the camera that shows it.
struct Stage {
    scene: Scene,
    frame: Frame,
    view: SceneView,
    marks: PeakMarks,
}

impl Stage {
    fn new(scene: Scene, time: f64) -> Self {
        let mut simulation = Simulation::new(&scene.machine).expect("starts");
        simulation.advance_to(time).expect("runs");
        let mut frame = Frame::default();
        simulation.sample(time, &mut frame);
        let mut marks = PeakMarks::new();
        marks.update(&frame, &[], f64::INFINITY);
        Self { view: SceneView::new(&scene, &frame), scene, frame, marks }
    }

    /// Passes the shot of a picture of `size` to `then`.
    fn shot(&self, size: [u32; 2], then: impl FnOnce(&Shot<'_>)) {
        let options = ViewOptions { magnification: 20.0, ..ViewOptions::default() };
        let mut camera = self.view.camera();
        self.view.fit(&mut camera, &self.scene, &self.frame, &options, size);
        then(&Shot {
            scene: &self.scene,
            frame: &self.frame,
            marks: &self.marks,
            options: &options,
            camera: &camera,
            trail: &[],
            size,
            pixels_per_point: 1.0,
        });
    }

    fn list(&self, size: [u32; 2]) -> DrawList {
        let mut list = DrawList::default();
        self.shot(size, |shot| self.view.build(shot, &mut list));
        list
    }
}

fn draw_list(watch: &Stopwatch) {
    let bench = |name: &str, stage: &Stage| {
        let mut list = DrawList::default();
        stage.shot(SIZE, |shot| {
            watch.time(name, || stage.view.build(black_box(shot), &mut list));
        });
    };
    bench("draw list alone", &Stage::new(default_scene(), TIME));
    bench("draw list of the longest chain", &Stage::new(longest_chain(), 0.0));
}

/// As many links as a chain may have.
fn longest_chain() -> Scene {
    let links = ("chain.links".to_owned(), "4096".to_owned());
    Scene::load("chain", &[links]).expect("as many are allowed")
}

/// The worst case of a frame: every impact that a run stores, all at the lowest pitch and therefore longest. The page computes
/// the samples within the frame, the desktop in the system's audio thread.
fn sound(watch: &Stopwatch) {
    let impacts: Vec<Impact> = (1..=64)
        .map(|k| Impact {
            start: TIME,
            end: TIME + 0.5 / PITCHES.0 + 1e-6 * f64::from(k),
            approach_speed: 0.1,
            separation_speed: 0.1,
            energy: 4e-5 * f64::from(k),
            ..Impact::default()
        })
        .collect();
    let window = TimeWindow { from: TIME, to: 2.0 * TIME, lasts: 1.0 / 60.0 };
    let mut heard: Vec<Click> = Vec::new();
    watch.time("clicks of a frame", || clicks(black_box(&impacts).iter(), &window, 1.0, &mut heard));
    clicks(impacts.iter(), &window, 1.0, &mut heard);
    assert_eq!(heard.len(), MAX_CLICKS);
    watch.time("samples of the clicks of a frame", || -> usize {
        let samples = |click| Voice::new(click, 48_000.0).collect::<Vec<f32>>().len();
        black_box(&heard).iter().map(samples).sum()
    });
}

/// Pictures by scene and size: recorded, drawn and read back, until they are in memory.
fn pictures(watch: &Stopwatch) {
    let mut offscreen = Offscreen::new().expect("a graphics adapter");
    println!("drawn by {}", offscreen.adapter());
    let scenes = ["spcmm", "chain", "hexapod"].map(|name| (name, Scene::load(name, &[]).expect("built in")));
    for (name, scene) in scenes.into_iter().chain([("the longest chain", longest_chain())]) {
        let stage = Stage::new(scene, 0.0);
        for size in [[1280, 720], [1920, 1080], [3840, 2160]] {
            let list = stage.list(size);
            let [width, height] = size;
            watch.time(&format!("picture: {name}, {width}x{height}"), || offscreen.render(&list).expect("drawn"));
        }
    }
}

fn main() {
    let watch = Stopwatch::new();
    for part in [frames, draw_list, sound, pictures] {
        part(&watch);
    }
}
