//! Pictures for visual inspection: `JOINTPLAY_LOOK=folder cargo test --lib render::look -- --ignored`.

use super::Offscreen;
use crate::view::{DrawList, PeakMarks, Preset, SceneView, Shot, Theme, ViewOptions, fixture};

#[test]
#[ignore = "writes pictures for a person to look at"]
fn look() {
    let folder = std::path::PathBuf::from(std::env::var("JOINTPLAY_LOOK").expect("JOINTPLAY_LOOK names a folder"));
    let mut offscreen = Offscreen::new().expect("a graphics adapter");
    for (name, (scene, frame)) in [("pendulum", fixture::pendulum()), ("legs", fixture::three_legs())] {
        let view = SceneView::new(&scene, &frame);
        let mut marks = PeakMarks::new();
        for (theme, theme_name) in [(Theme::Light, "light"), (Theme::Dark, "dark")] {
            for (shot, magnification) in
                [("whole", 1.0), ("play", 20.0), ("close", 20.0), ("hit", 20.0), ("front", 1.0)]
            {
                let options = ViewOptions { theme, magnification, ..Default::default() };
                marks.clear(-1.0);
                marks.update(&frame, &[], f64::INFINITY);
                let mut camera = view.camera();
                match shot {
                    "close" => view.close_up(&mut camera, 0, &scene, &frame, &options),
                    "hit" => {
                        view.close_up(&mut camera, 0, &scene, &frame, &options);
                        camera.distance *= 3.0;
                        marks.update(&frame, &fixture::hits(&frame), 1.0);
                    }
                    "front" => {
                        camera.preset(Preset::Front);
                    }
                    _ => {}
                }
                if matches!(shot, "whole" | "play" | "front") {
                    view.fit(&mut camera, &scene, &frame, &options, [1280, 720]);
                }
                let trail: Vec<glam::Vec3> = (0..200)
                    .map(|i| {
                        view.bounds().centre
                            + 0.1 * glam::Vec3::new(0.4, (i as f32 * 0.05).cos(), (i as f32 * 0.08).sin())
                    })
                    .collect();
                let mut list = DrawList::default();
                let input = Shot {
                    scene: &scene,
                    frame: &frame,
                    marks: &marks,
                    options: &options,
                    camera: &camera,
                    trail: &trail,
                    size: [1280, 720],
                    pixels_per_point: 1.0,
                };
                view.build(&input, &mut list);
                let started = web_time::Instant::now();
                let image = offscreen.render(&list).expect("a picture");
                println!("{name} {theme_name} {shot}: {:?}, {}", started.elapsed(), list.magnification_text);
                let png = image.png(&[("Title", name)]).expect("a PNG");
                std::fs::write(folder.join(format!("{name}-{theme_name}-{shot}.png")), png).expect("a writable folder");
            }
        }
    }
}

/// CPU cost of a picture: building the list, and recording its passes.
#[test]
#[ignore = "prints times for a person to read"]
fn time() {
    let mut offscreen = Offscreen::new().expect("a graphics adapter");
    let (scene, frame) = fixture::three_legs();
    let view = SceneView::new(&scene, &frame);
    let (options, camera) = (ViewOptions::default(), view.camera());
    let mut marks = PeakMarks::new();
    marks.update(&frame, &fixture::hits(&frame), 1.0);
    let trail = vec![glam::Vec3::ZERO; 1000];
    let mut list = DrawList::default();
    let (mut build, mut record) = (Vec::new(), Vec::new());
    for _ in 0..100 {
        let start = web_time::Instant::now();
        let shot = Shot {
            scene: &scene,
            frame: &frame,
            marks: &marks,
            options: &options,
            camera: &camera,
            trail: &trail,
            size: [64, 48],
            pixels_per_point: 1.0,
        };
        view.build(&shot, &mut list);
        build.push(start.elapsed());
        let start = web_time::Instant::now();
        offscreen.render(&list).expect("drawn");
        record.push(start.elapsed());
    }
    build.sort();
    record.sort();
    println!("draw list {:?}, picture {:?} (median of 100)", build[50], record[50]);
}
