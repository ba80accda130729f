//! The sound switch and the clicks heard during playback. Sound does not affect the run.

use eframe::egui::Ui;

use super::click::{Click, TimeWindow, clicks, mass};
use super::{App, Notice};

/// Sound switch and clicks.
#[derive(Default)]
pub struct Sound {
    on: bool,
    /// Clicks of the latest frame.
    clicks: Vec<Click>,
}

impl App {
    /// Whether impacts are heard.
    pub fn is_sounding(&self) -> bool {
        self.sound.on
    }

    /// Switches sound on or off.
    pub fn set_sound(&mut self, on: bool) {
        if on == self.sound.on {
            return;
        }
        self.sound.on = on;
        self.host.sound(on);
        let words = if on { "Sound on" } else { "Sound off" };
        self.notice = Some(Notice::new(words));
    }

    pub(super) fn sound_switch(&mut self, ui: &mut Ui) {
        let mut on = self.sound.on;
        let help = "A click for every impact that ends while the run plays forward. A larger impulse is louder, a \
                    shorter contact higher. Slow motion spreads the clicks without changing their pitch (key M)";
        if ui.checkbox(&mut on, "Sound").on_hover_text(help).clicked() {
            self.set_sound(on);
        }
    }

    /// Switches sound off, with a notice of the reason, if the host cannot play it.
    pub(super) fn check_sound(&mut self) {
        if self.sound.on
            && let Some(why) = self.host.no_sound()
        {
            self.sound.on = false;
            self.host.sound(false);
            self.notice = Some(Notice::new(format!("No sound: {why}")));
        }
    }

    /// Advances the run by `dt` seconds and plays the impacts that end meanwhile. Jumps back in time or to an impact are silent.
    pub(super) fn advance_with_sound(&mut self, dt: f64) {
        let player = &mut self.player;
        let plays = player.is_playing() && !player.is_playing_backwards() && !player.is_seeking();
        let from = player.pacer.shown_before();
        player.advance(dt);
        if !(self.sound.on && plays) {
            return;
        }
        let window = TimeWindow { from, to: player.pacer.shown(), lasts: dt };
        // The simulation may be a step ahead of the displayed instant.
        let impacts = player.simulation().impacts();
        clicks(impacts, &window, mass(player.running()), &mut self.sound.clicks);
        if !self.sound.clicks.is_empty() {
            self.host.click(&self.sound.clicks);
        }
    }
}
