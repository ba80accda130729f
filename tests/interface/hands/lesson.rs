//! Lessons, stepped through in a window.

use std::sync::Arc;

use eframe::egui::{Key, vec2};
use egui_kittest::{Harness, kittest::Queryable as _};
use jointplay::app::{App, AppOptions, Lesson};

use super::page;

pub const WIDE: [f32; 2] = [1280.0, 720.0];

pub const PHONE: [f32; 2] = [390.0, 844.0];

/// Time between two frames, s: the longest that playback catches up with, since lessons are long.
pub const DT: f32 = 0.25;

/// Largest number of frames that a step may take.
pub const FRAMES: usize = 4000;

/// The window in a lesson at step `step`, counted from 0.
pub fn open_lesson(name: &str, step: usize, size: [f32; 2]) -> Harness<'static, App> {
    let lesson = Lesson::built_in(name).unwrap_or_else(|error| panic!("{error}"));
    open_window(lesson, step, size)
}

pub fn open_window(lesson: Arc<Lesson>, step: usize, size: [f32; 2]) -> Harness<'static, App> {
    let (mut harness, _) = page::paced(AppOptions::for_lesson(lesson, step), size, DT);
    settle(&mut harness);
    harness
}

/// Runs frames until the machine is set up for the step.
pub fn settle(harness: &mut Harness<'_, App>) {
    for _ in 0..FRAMES {
        harness.step();
        if harness.state().course().is_none_or(|course| !course.is_busy()) {
            // Camera motion and highlights take a few more frames.
            harness.run_steps(3);
            return;
        }
    }
    panic!("the machine is never set up");
}

pub fn press(harness: &mut Harness<'_, App>, key: Key) {
    harness.key_press(key);
    settle(harness);
}

/// Plays to the end of the step; returns whether it has one.
pub fn play(harness: &mut Harness<'_, App>) -> bool {
    let Some(end) = harness.state().course().expect("a lesson").until() else {
        return false;
    };
    press(harness, Key::Space);
    for _ in 0..FRAMES {
        if harness.state().course().expect("a lesson").is_reached() {
            harness.run_steps(2);
            let player = harness.state().player();
            assert!(!player.is_playing());
            assert_eq!(player.pacer.shown(), end);
            return true;
        }
        harness.step();
    }
    panic!("{end} s is never reached");
}

/// Whether a label on show contains `words`.
pub fn shows_text(harness: &Harness<'_, App>, words: &str) -> bool {
    harness.query_all_by_label_contains(words).next().is_some()
}

/// Presses F5 and resizes the window for its new zoom.
pub fn present(harness: &mut Harness<'_, App>, screen: [f32; 2]) {
    harness.key_press(Key::F5);
    harness.step();
    let zoom = harness.ctx.zoom_factor();
    harness.set_size(vec2(screen[0], screen[1]) / zoom);
    harness.set_pixels_per_point(zoom);
    settle(harness);
}
