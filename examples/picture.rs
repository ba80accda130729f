//! A picture without a window, drawn as `jointplay render` draws it: the built-in pendulum after 0.5 s, as a PNG file.
//!
//!     cargo run --example picture -- pendulum.png

use std::error::Error;
use std::path::PathBuf;

use jointplay::render::Offscreen;
use jointplay::view::{DrawList, PeakMarks, SceneView, Shot, ViewOptions};
use jointplay_physics::simulate::{Frame, Simulation};
use jointplay_scene::Scene;

const SIZE: [u32; 2] = [640, 360];

fn main() -> Result<(), Box<dyn Error>> {
    let argument = std::env::args_os().nth(1).map(PathBuf::from);
    let file = argument.unwrap_or_else(|| std::env::temp_dir().join("jointplay-pendulum.png"));

    let scene = Scene::load("pendulum", &[])?;
    let mut simulation = Simulation::new(&scene.machine)?;
    let mut frame = Frame::default();
    simulation.advance_to(0.5)?;
    simulation.sample(0.5, &mut frame);

    // The draw list is plain data, built from the scene and one instant of its motion. Only `Offscreen` knows the graphics card.
    let view = SceneView::new(&scene, &frame);
    let (options, mut marks) = (ViewOptions::default(), PeakMarks::new());
    marks.update(&frame, &[], f64::INFINITY);
    let mut camera = view.camera();
    view.fit(&mut camera, &scene, &frame, &options, SIZE);
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
    let mut list = DrawList::default();
    view.build(&shot, &mut list);

    let mut offscreen = Offscreen::new()?;
    let image = offscreen.render(&list)?;
    std::fs::write(&file, image.png(&[("Title", "A pendulum with play")])?)?;
    println!("{}x{} pixels by {}: {}", image.width, image.height, offscreen.adapter(), file.display());

    // The picture is not empty: many pixels differ from the background.
    let background = image.pixel(0, 0);
    let drawn = (0..SIZE[0] * SIZE[1]).filter(|&i| image.pixel(i % SIZE[0], i / SIZE[0]) != background).count();
    assert!(drawn > 1000, "{drawn} pixels");
    Ok(())
}
