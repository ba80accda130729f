//! Joints that touch at several places, in the window: the microscope, the timeline and the list of impacts tell them apart.

use eframe::egui::{self, Key, Rect};
use egui_kittest::{Harness, kittest::Queryable as _};
use jointplay::app::App;

use crate::hands::opened;
use crate::pixels::Picture;

/// A pin thrown into a bearing with spin and tilt.
const PIN: &str = "thrown-pin";

fn window(scene: &str) -> Harness<'static, App> {
    opened(scene, &[], [1280.0, 800.0], egui::Theme::Light, crate::common::ticking_clock::<10>)
}

fn picture(harness: &mut Harness<'_, App>) -> Picture {
    harness.remove_cursor();
    harness.run();
    let picture = harness.render().expect("drawn");
    Picture::new(picture.width(), picture.into_raw())
}

fn area(rect: Rect) -> [usize; 4] {
    [rect.left(), rect.top(), rect.right(), rect.bottom()].map(|edge| edge as usize)
}

/// Whether the ends of the pin touch now.
fn touching(harness: &Harness<'_, App>) -> [bool; 2] {
    let frame = harness.state().player().frame();
    [0, 1].map(|place| frame.sites[place].gap < 0.0)
}

#[test]
fn the_microscope_shows_which_end_of_a_pin_touches() {
    let mut harness = window(PIN);
    harness.key_press(Key::L);
    harness.run();
    let mut seen = [false; 2];
    for _ in 0..4000 {
        harness.state_mut().player_mut().single_step();
        let now = touching(&harness);
        let expected = match now {
            [true, false] if !seen[0] => 0,
            [false, true] if !seen[1] => 1,
            _ => continue,
        };
        seen[expected] = true;
        let picture = picture(&mut harness);
        let shown = harness.get_by_label_contains("Pin J under the microscope. ").rect();
        let words = ["J.a", "J.b"][expected];
        harness.get_by_label_contains(&format!("it touches at {words}"));
        // The circles are side by side; the words on the axial play are below.
        let circles = shown.with_max_y(shown.top() + 0.7 * shown.height());
        let (left, right) = circles.split_left_right_at_fraction(0.5);
        let red = [left, right].map(|half| picture.coloured(area(half), [0xB8, 0x38, 0x18], 24).len());
        assert!(red[expected] > 40 && red[1 - expected] == 0, "{words}: {red:?}");
        if seen == [true; 2] {
            return;
        }
    }
    panic!("both ends touch, one after the other: {seen:?}");
}

#[test]
fn the_timeline_marks_a_contact_in_the_band_of_its_end_and_the_list_names_it() {
    let mut harness = window(PIN);
    harness.state_mut().player_mut().run_to(1.2e-3);
    let picture = picture(&mut harness);
    let strip = harness.get_by_label("Timeline, s").rect();
    let player = harness.state().player();
    let touches: Vec<(f64, u8)> = player.contact_history().place_touches(0, 0.0, 1.2e-3).collect();
    assert!(touches.iter().any(|(_, place)| *place == 0) && touches.iter().any(|(_, place)| *place == 1));
    // Below the row of flags, from above: a, front, back, b.
    let lane = strip.with_min_y(strip.top() + 9.0);
    let at = |time: f64, band: f32| {
        let x = lane.left() + (time / player.known_to()) as f32 * lane.width();
        picture.at((x + 1.5) as usize, (lane.top() + band * lane.height()) as usize)
    };
    let empty = at(touches[0].0 - 1e-5, 0.1);
    for (time, place) in &touches {
        // A little later.
        let during: Vec<u8> = player.contact_history().places_at(0, time + 2e-6).collect();
        for (name, band) in [(0, 0.1), (2, 0.35), (3, 0.6), (1, 0.85)] {
            assert_eq!(at(*time, band) != empty, during.contains(&name), "{place} at {time} s, band of {name}");
        }
    }
    harness.key_press(Key::I);
    harness.run();
    let record = harness.state().player().impact_record();
    let ended: Vec<(u64, u8)> = record.until(1.2e-3).map(|(number, own, _)| (number, own.place)).collect();
    assert!(ended.len() > 1);
    for (number, place) in ended {
        let name = ["J.a", "J.b", "J.front", "J.back"][usize::from(place)];
        harness.get_by_label_contains(&format!("Impact {number}, {name}, "));
    }
}
