//! The sentence that a scene opens with: what the machine is for, and what to watch. It leaves by itself.

use std::time::Duration;

use eframe::egui::{Align, Color32, Event, FontId, Label, Layout, Rect, RichText, Ui, UiBuilder};

use super::overlay;
use crate::scene::Scene;
use crate::view::{Palette, Theme};

/// Display time of an empty sentence, and of each character, s.
const READING_TIME: [f64; 2] = [4.0, 0.06];
/// Font sizes where its place is high enough, and otherwise, points.
const FONT_SIZES: [f32; 2] = [14.0, 12.0];
/// Length of the fade after it, s.
const FADE_TIME: f64 = 1.5;
/// Interval between pictures of the fade, s.
const FADE_INTERVAL: f64 = 1.0 / 30.0;

/// The sentence of the scene just opened, if it is still shown.
#[derive(Default)]
pub struct Hint {
    text: String,
    /// Time of its first display, s of viewing.
    since: Option<f64>,
    /// Reduced motion: it does not fade, but leaves at once, also at the first gesture.
    calm: bool,
}

impl Hint {
    /// None yet; `calm`: under reduced motion.
    pub fn new(calm: bool) -> Self {
        Self { calm, ..Self::default() }
    }

    /// Begins with the sentence of `scene`. With changed values it need not be true.
    pub fn begin(&mut self, scene: &Scene) {
        let text = if scene.changes.is_empty() { scene.watch.clone() } else { String::new() };
        *self = Self { text, ..Self::new(self.calm) };
    }

    /// The same of the scene of a first visit, whose three sliders leave it true.
    pub fn begin_after_visit(&mut self, scene: &Scene) {
        *self = Self { text: scene.watch.clone(), ..Self::new(self.calm) };
    }

    /// Removes the sentence.
    pub fn end(&mut self) {
        self.text.clear();
    }

    /// Shows the sentence in `place`, until it has left.
    pub fn ui(&mut self, ui: &mut Ui, place: Rect) {
        if self.text.is_empty() {
            return;
        }
        let now = ui.input(|input| input.time);
        let reading = READING_TIME[0] + READING_TIME[1] * self.text.chars().count() as f64;
        let left = *self.since.get_or_insert(now) + reading - now;
        let has_gesture = self.calm && ui.input(|input| input.events.iter().any(is_gesture));
        let fade = if self.calm { 0.0 } else { FADE_TIME };
        if left <= -fade || has_gesture {
            self.end();
            return;
        }
        let wait = if left > 0.0 { left } else { FADE_INTERVAL };
        ui.ctx().request_repaint_after(Duration::from_secs_f64(wait));
        let opacity = if left > 0.0 { 1.0 } else { (1.0 + left / fade) as f32 };
        // In a narrow picture the legend gives way.
        let theme = if ui.visuals().dark_mode { Theme::Dark } else { Theme::Light };
        let ground = overlay::colour(Palette::of(theme).sky).gamma_multiply(opacity);
        ui.painter().rect_filled(place, 0.0, ground);
        let height = |size: f32| {
            let font = FontId::proportional(size);
            ui.painter().layout(self.text.clone(), font, Color32::PLACEHOLDER, place.width()).size().y
        };
        let size = FONT_SIZES.into_iter().find(|size| height(*size) <= place.height()).unwrap_or(FONT_SIZES[1]);
        let inside = UiBuilder::new().max_rect(place).layout(Layout::left_to_right(Align::Center));
        ui.scope_builder(inside, |ui| {
            ui.set_opacity(opacity);
            ui.add(Label::new(RichText::new(&self.text).size(size).strong()).selectable(false).wrap());
        });
    }
}

/// Whether `event` is the beginning of a gesture.
pub(super) fn is_gesture(event: &Event) -> bool {
    matches!(
        event,
        Event::PointerButton { pressed: true, .. }
            | Event::Key { pressed: true, .. }
            | Event::MouseWheel { .. }
            | Event::Zoom(_)
            | Event::Touch { phase: eframe::egui::TouchPhase::Start, .. }
    )
}
