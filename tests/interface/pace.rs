//! What slow frames do to the picture and to the run, and what the window says of it.

use eframe::egui::Theme;
use egui_kittest::{Harness, kittest::Queryable as _};
use jointplay::app::App;
use jointplay::view::Quality;

use crate::common::ticking_clock;
use crate::hands::paced;
use crate::window::click;

const SIZE: [f32; 2] = [1000.0, 700.0];
const LEAST: Quality = Quality::LADDER[Quality::LADDER.len() - 1];

type Pixels = Vec<u8>;

/// Red, green, blue and opacity of all that is left of `to`, points, and of the rest.
fn parted(harness: &mut Harness<'_, App>, to: f32) -> [Pixels; 2] {
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
fn while_it_moves_slowly_the_picture_has_fewer_pixels_and_at_rest_all_of_them() {
    // The same frames, ten a second, with what a window does about them and without.
    let [mut follows, mut plain] = [true, false].map(|follows| {
        let mut harness = paced("spcmm", &[], SIZE, Theme::Light, ticking_clock::<10>, 0.1);
        if follows {
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
    assert_eq!(follows.state().picture_quality(), LEAST);
    assert_eq!(plain.state().picture_quality(), Quality::FULL);
    // The panel beside it is as sharp as ever.
    let panel = follows.get_by_label("Reset").rect().left() - 30.0;
    assert!(panel > 200.0, "{panel}");
    let [moving, full] = [&mut follows, &mut plain].map(|harness| parted(harness, panel));
    assert!(moving[0] == full[0], "the panel is drawn otherwise");
    assert!(moving[1] != full[1], "the picture is not");

    for harness in [&mut follows, &mut plain] {
        click(harness, "Pause");
        harness.remove_cursor();
        harness.run_steps(5);
    }
    assert_eq!(follows.state().picture_quality(), Quality::FULL);
    let [still, full] = [&mut follows, &mut plain].map(|harness| parted(harness, panel));
    assert!(still == full, "at rest it is drawn as ever");
    // Shown again without anything new it stays so.
    follows.run_steps(3);
    assert!(parted(&mut follows, panel) == full);
    let hash = |harness: &Harness<'_, App>| {
        let player = harness.state().player();
        (player.steps(), player.simulation().state_hash())
    };
    assert_eq!(hash(&follows), hash(&plain), "no bit of the run depends on it");

    // A turn of the view is motion, too, and a change of what is shown at rest is seen.
    follows.key_press(eframe::egui::Key::Num2);
    follows.run_steps(2);
    assert_eq!(follows.state().picture_quality(), LEAST);
    follows.run_steps(60);
    assert_eq!(follows.state().picture_quality(), Quality::FULL);
    let turned = parted(&mut follows, panel);
    assert!(turned[1] != full[1]);
    follows.key_press(eframe::egui::Key::X);
    follows.run_steps(6);
    assert!(parted(&mut follows, panel)[1] != turned[1]);
}

/// What stands beside the speed that is reached after `frames` frames.
fn limit(harness: &mut Harness<'_, App>, frames: usize) -> Option<&'static str> {
    harness.run_steps(frames);
    let words = ["limited by computing", "limited by drawing"];
    let mut found = words.into_iter();
    found.find(|words| harness.query_by_label(words).is_some())
}

#[test]
fn beside_the_speed_reached_stands_what_limits_it() {
    // Steps of 10 us, one for each look at the clock.
    let fixed = [("solver.method", "rk4"), ("solver.step", "10 us")];
    let window = |clock, dt| paced("spcmm", &fixed, [1280.0, 800.0], Theme::Light, clock, dt);
    // Each takes 4 ms: three a frame.
    let mut harness = window(ticking_clock::<4000>, 1.0 / 60.0);
    assert_eq!(limit(&mut harness, 3), None, "paused");
    harness.state_mut().player_mut().pacer.set_scale(1e-4);
    click(&mut harness, "Play");
    assert_eq!(limit(&mut harness, 60), None, "it keeps up");
    harness.state_mut().player_mut().pacer.set_scale(1.0);
    assert_eq!(limit(&mut harness, 60), Some("limited by computing"));
    click(&mut harness, "Pause");
    assert_eq!(limit(&mut harness, 3), None, "paused");

    // Each takes 20 us, which alone would reach half of real time, but they have a quarter of each frame of a second.
    let mut harness = window(ticking_clock::<20>, 1.0);
    harness.state_mut().player_mut().pacer.set_scale(1.0);
    harness.state_mut().player_mut().set_playing(true);
    let found = limit(&mut harness, 5);
    let player = harness.state().player();
    let speeds = (player.capacity(), player.pacer.reached_scale());
    assert_eq!(found, Some("limited by drawing"), "{speeds:?}");
}
