//! The built-in scenes as a viewer watches them.

use std::path::Path;

use eframe::egui;
use egui_kittest::Harness;
use jointplay::app::{App, AppOptions};
use jointplay::scene::{BUILT_IN, Scene};

use crate::hands::builder;

/// The window that opens on `scene`, playing, in frames of 0.1 s.
fn watched(scene: &str, size: [f32; 2], theme: egui::Theme) -> Harness<'static, App> {
    let mut options = match scene {
        "" => AppOptions::first(),
        name => AppOptions::new(Scene::load(name, &[]).expect("a built-in scene")),
    };
    options.theme = theme.into();
    options.clock = crate::common::looks::<10>;
    let builder = builder(size, theme).with_step_dt(0.1);
    builder.build_eframe(move |cc| App::new(cc, options).expect("the scene starts"))
}

#[test]
#[ignore = "draws pictures to look at into KEEP_PICTURES"]
fn full_watch() {
    let Some(keep) = std::env::var_os("KEEP_PICTURES") else { return };
    let only = std::env::var("ONLY").unwrap_or_default();
    let sizes = std::env::var("SIZES").unwrap_or("1280x800".into());
    let themes = std::env::var("THEMES").unwrap_or("light".into());
    let seconds: usize = std::env::var("SECONDS_WATCHED").ok().and_then(|s| s.parse().ok()).unwrap_or(10);
    for size in sizes.split(',') {
        let (w, h) = size.split_once('x').unwrap();
        let size = [w.parse::<f32>().unwrap(), h.parse::<f32>().unwrap()];
        for theme in themes.split(',') {
            let theme = if theme == "dark" { egui::Theme::Dark } else { egui::Theme::Light };
            for scene in BUILT_IN.into_iter().chain([""]) {
                let name = if scene.is_empty() { "first" } else { scene };
                if !only.is_empty() && !only.split(',').any(|o| o == name) {
                    continue;
                }
                let mut harness = watched(scene, size, theme);
                for second in 0..=seconds {
                    let image = harness.render().expect("drawn");
                    let file = format!("{name}_{}_{:?}_{second:02}.png", size[0], theme);
                    image.save(Path::new(&keep).join(file)).expect("writable");
                    harness.run_steps(10);
                }
            }
        }
    }
}
