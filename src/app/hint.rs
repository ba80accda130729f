//! The sentence that a scene opens with: what the machine is for, and what to watch. It leaves by itself.

use std::sync::Arc;
use std::time::Duration;

use eframe::egui::{Align2, Event, Galley, Label, Rect, TextStyle, Ui, UiBuilder, Vec2, vec2};

use super::overlay;
use crate::scene::Scene;

/// Display time of an empty sentence, and of each character, s.
const READING_TIME: [f64; 2] = [4.0, 0.06];
/// Length of the fade after it, s.
const FADE_TIME: f64 = 1.5;
/// Interval between pictures of the fade, s.
const FADE_INTERVAL: f64 = 1.0 / 30.0;
/// Longest line, points.
const MAX_WIDTH: f32 = 460.0;
const PADDING: Vec2 = vec2(10.0, 5.0);

/// The sentence of the scene just opened, if it is still shown.
#[derive(Default)]
pub struct Hint {
    text: String,
    /// Time of its first display, s of viewing.
    since: Option<f64>,
    /// Reduced motion: it does not fade, but leaves at once, also at the first gesture.
    calm: bool,
}

/// The sentence laid out over the picture.
pub struct ShownHint {
    words: Arc<Galley>,
    /// Its plate.
    pub plate: Rect,
    opacity: f32,
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

    /// Whether it has been shown and has not left yet.
    pub fn is_shown(&self) -> bool {
        !self.text.is_empty() && self.since.is_some()
    }

    /// Removes the sentence.
    pub fn end(&mut self) {
        self.text.clear();
    }

    /// The sentence in the picture in `area`, below its buttons; `None` once it has left, or without room for it.
    pub fn place(&mut self, ui: &Ui, area: Rect) -> Option<ShownHint> {
        if self.text.is_empty() || !overlay::fits_labels(area) {
            return None;
        }
        let now = ui.input(|input| input.time);
        let reading = READING_TIME[0] + READING_TIME[1] * self.text.chars().count() as f64;
        let left = *self.since.get_or_insert(now) + reading - now;
        let has_gesture = self.calm && ui.input(|input| input.events.iter().any(is_gesture));
        let fade = if self.calm { 0.0 } else { FADE_TIME };
        if left <= -fade || has_gesture {
            self.end();
            return None;
        }
        let wait = if left > 0.0 { left } else { FADE_INTERVAL };
        ui.ctx().request_repaint_after(Duration::from_secs_f64(wait));
        let opacity = if left > 0.0 { 1.0 } else { (1.0 + left / fade) as f32 };
        let mut inside = area.shrink(12.0);
        inside.min.y += overlay::plate(2)[1].max(ui.spacing().interact_size.y + 8.0);
        let width = (inside.width() - 2.0 * PADDING.x).min(MAX_WIDTH);
        let font = TextStyle::Body.resolve(ui.style());
        let words = ui.painter().layout(self.text.clone(), font, ui.visuals().strong_text_color(), width);
        let place = Align2::CENTER_TOP.align_size_within_rect(words.size(), inside);
        Some(ShownHint { words, plate: place.expand2(PADDING), opacity })
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

impl ShownHint {
    /// Shows it.
    pub fn ui(self, ui: &mut Ui) {
        let fill = ui.visuals().window_fill.gamma_multiply(0.92 * self.opacity);
        ui.painter().rect_filled(self.plate, 6.0, fill);
        let inside = UiBuilder::new().max_rect(self.plate.shrink2(PADDING));
        ui.scope_builder(inside, |ui| {
            ui.set_opacity(self.opacity);
            ui.add(Label::new(self.words).selectable(false));
        });
    }
}
