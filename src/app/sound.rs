//! The sound switch and the clicks heard during playback. Sound does not affect the run.

use eframe::egui::Ui;

use super::click::{Click, TimeWindow, clicks, mass};
use super::host::Host;
use super::player::Player;

/// Sound switch and clicks.
#[derive(Default)]
pub struct Sound {
    on: bool,
    /// Clicks of the latest frame.
    clicks: Vec<Click>,
}

impl Sound {
    /// Whether impacts are heard.
    pub fn is_on(&self) -> bool {
        self.on
    }

    /// Switches sound on or off; returns the notice of a change.
    pub fn set(&mut self, on: bool, host: &mut dyn Host) -> Option<&'static str> {
        if on == self.on {
            return None;
        }
        self.on = on;
        host.sound(on);
        Some(if on { "Sound on" } else { "Sound off" })
    }

    /// Switches sound off if the host cannot play it; returns the notice of the reason.
    pub fn check(&mut self, host: &mut dyn Host) -> Option<String> {
        let why = if self.on { host.no_sound()? } else { return None };
        self.on = false;
        host.sound(false);
        Some(format!("No sound: {why}"))
    }

    /// Advances `player` by `dt` seconds and plays the impacts that end meanwhile. Jumps back in time or to an impact are silent.
    pub fn advance(&mut self, player: &mut Player, dt: f64, host: &mut dyn Host) {
        let plays = player.is_playing() && !player.is_playing_backwards() && !player.is_seeking();
        let from = player.pacer.shown_before();
        player.advance(dt);
        if !(self.on && plays) {
            return;
        }
        let window = TimeWindow { from, to: player.pacer.shown(), lasts: dt };
        // The simulation may be a step ahead of the displayed instant.
        let impacts = player.simulation().impacts();
        clicks(impacts, &window, mass(player.running()), &mut self.clicks);
        if !self.clicks.is_empty() {
            host.click(&self.clicks);
        }
    }
}

/// The switch, which is `on`; returns whether it was clicked.
pub fn switch(ui: &mut Ui, mut on: bool) -> bool {
    let help = "A click for every impact that ends while the run plays forward. A larger impulse is louder, a \
                shorter contact higher. Slow motion spreads the clicks without changing their pitch (key M)";
    ui.checkbox(&mut on, "Sound").on_hover_text(help).clicked()
}
