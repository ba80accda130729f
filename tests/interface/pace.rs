//! Slow frames: reduced picture resolution, an unchanged run, and the displayed limit of the speed.

use eframe::egui::Theme;
use egui_kittest::{Harness, kittest::Queryable as _};
use jointplay::app::App;
use jointplay::view::Quality;

use crate::common::ticking_clock;
use crate::hands::paced;
use crate::hands::window::click;

const SIZE: [f32; 2] = [1000.0, 700.0];
const LOWEST: Quality = Quality::LADDER[Quality::LADDER.len() - 1];

type Pixels = Vec<u8>;

/// RGBA pixels to the left of `to`, points, and of the rest.
fn split_pixels(harness: &mut Harness<'_, App>, to: f32) -> [Pixels; 2] {
    let image = harness.render().expect("drawn");
    let row = 4 * image.width() as usize;
    let mut parts = [Pixels::new(), Pixels::new()];
    for line in image.as_raw().chunks_exact(row) {
        let (left, right) = line.split_at(4 * to as usize);
        parts[0].extend(left);
        parts[1].extend(right);
    }
    parts
}

#[test]
fn slow_motion_reduces_the_resolution_and_rest_restores_it() {
    // The same frames, ten per second, with and without adaptation of the resolution.
    let [mut adaptive, mut plain] = [true, false].map(|adaptive| {
        // With a value of its own the scene opens without its sentence, which would fade in one of them before the other.
        let own = [("contact.friction", "0.15")];
        let mut harness = paced("spcmm", &own, SIZE, Theme::Light, ticking_clock::<10>, 0.1);
        if adaptive {
            harness.state_mut().follow_frame_rate();
        }
        harness.remove_cursor();
        harness.run_steps(10);
        assert_eq!(harness.state().picture_quality(), Quality::FULL);
        click(&mut harness, "Play");
        harness.remove_cursor();
        harness.run_steps(80);
        harness
    });
    assert_eq!(adaptive.state().picture_quality(), LOWEST);
    assert_eq!(plain.state().picture_quality(), Quality::FULL);
    // The panel beside the picture keeps the full resolution.
    let panel = adaptive.get_by_label("Start of the run").rect().left() - 30.0;
    assert!(panel > 200.0, "{panel}");
    let [moving, full] = [&mut adaptive, &mut plain].map(|harness| split_pixels(harness, panel));
    assert!(moving[0] == full[0], "the resolution of the panel changed");
    assert!(moving[1] != full[1], "the resolution of the picture did not change");

    for harness in [&mut adaptive, &mut plain] {
        click(harness, "Pause");
        harness.remove_cursor();
        harness.run_steps(5);
    }
    assert_eq!(adaptive.state().picture_quality(), Quality::FULL);
    let [still, full] = [&mut adaptive, &mut plain].map(|harness| split_pixels(harness, panel));
    assert!(still == full, "at rest the picture lacks the full resolution");
    // Further frames without changes keep it.
    adaptive.run_steps(3);
    assert!(split_pixels(&mut adaptive, panel) == full);
    let hash = |harness: &Harness<'_, App>| {
        let player = harness.state().player();
        (player.steps(), player.simulation().state_hash())
    };
    assert_eq!(hash(&adaptive), hash(&plain), "the run depends on the resolution");

    // A rotation of the camera is motion, too; a changed option at rest changes the picture.
    adaptive.key_press(eframe::egui::Key::Num2);
    adaptive.run_steps(2);
    assert_eq!(adaptive.state().picture_quality(), LOWEST);
    adaptive.run_steps(60);
    assert_eq!(adaptive.state().picture_quality(), Quality::FULL);
    let rotated = split_pixels(&mut adaptive, panel);
    assert!(rotated[1] != full[1]);
    adaptive.key_press(eframe::egui::Key::X);
    adaptive.run_steps(6);
    assert!(split_pixels(&mut adaptive, panel)[1] != rotated[1]);
}

/// The limit displayed beside the speed after `frames` frames.
fn limit(harness: &mut Harness<'_, App>, frames: usize) -> Option<&'static str> {
    harness.run_steps(frames);
    let words = ["computing allows only 1:", "drawing allows only 1:"];
    let mut words = words.into_iter();
    words.find(|words| harness.query_by_label_contains(words).is_some())
}

#[test]
fn the_window_states_what_limits_the_speed() {
    // Steps of 10 us, one for each reading of the clock.
    let fixed = [("solver.method", "rk4"), ("solver.step", "10 us")];
    let window = |clock, dt| paced("spcmm", &fixed, [1280.0, 800.0], Theme::Light, clock, dt);
    // Each takes 4 ms: three per frame.
    let mut harness = window(ticking_clock::<4000>, 1.0 / 60.0);
    assert_eq!(limit(&mut harness, 3), None, "paused");
    harness.state_mut().player_mut().pacer.set_scale(1e-4);
    click(&mut harness, "Play");
    assert_eq!(limit(&mut harness, 60), None, "the run keeps up");
    harness.state_mut().player_mut().pacer.set_scale(1.0);
    assert_eq!(limit(&mut harness, 60), Some("computing allows only 1:"));
    click(&mut harness, "Pause");
    assert_eq!(limit(&mut harness, 3), None, "paused");

    // Each takes 20 us, enough for half of real time, but only a quarter of each frame of one second is left for steps.
    let mut harness = window(ticking_clock::<20>, 1.0);
    harness.state_mut().player_mut().pacer.set_scale(1.0);
    harness.state_mut().player_mut().set_playing(true);
    let displayed_limit = limit(&mut harness, 5);
    let player = harness.state().player();
    let speeds = (player.capacity(), player.pacer.reached_scale());
    assert_eq!(displayed_limit, Some("drawing allows only 1:"), "{speeds:?}");
}
