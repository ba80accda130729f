//! The window in tests of the desktop's interface.

use eframe::egui::{self, accesskit::Role};
use egui_kittest::{Harness, kittest::Queryable as _};
use jointplay::app::App;

use super::opened;
use crate::pixels::Picture;

/// The wide window on `scene` at t = 0, paused.
pub fn window(scene: &str) -> Harness<'static, App> {
    sized(scene, [1280.0, 800.0], egui::Theme::Light)
}

pub fn sized(scene: &str, size: [f32; 2], theme: egui::Theme) -> Harness<'static, App> {
    opened(scene, &[], size, theme, crate::common::ticking_clock::<10>)
}

pub fn shown(harness: &Harness<'_, App>) -> f64 {
    harness.state().player().pacer.shown()
}

pub fn click(harness: &mut Harness<'_, App>, label: &str) {
    harness.get_by_role_and_label(Role::Button, label).click();
    harness.step();
    harness.step();
}

/// Colours of the first three curves in the light theme.
pub const CURVES: [[u8; 3]; 3] = [[0x00, 0x72, 0xB2], [0xD5, 0x5E, 0x00], [0x00, 0x8F, 0x68]];

pub fn picture(harness: &mut Harness<'_, App>) -> Picture {
    let image = harness.render().expect("drawn");
    Picture::new(image.width(), image.into_raw())
}

pub const WHITE: [u8; 3] = [255; 3];
