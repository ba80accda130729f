//! Zoom by wheel and pinch, shared by all views.

use eframe::egui::{PointerButton, Pos2, Response, Ui};

/// Zoom factor of wheel and pinch in this frame; 1 without input.
pub fn factor(ui: &Ui) -> f32 {
    let (wheel, pinch) = ui.input(|i| (i.smooth_scroll_delta().y, i.zoom_delta()));
    (wheel * 0.004).exp() * pinch
}

/// Change of a time range by wheel and pinch in this frame.
pub struct Zoom {
    factor: f32,
    /// Fixed point of the zoom, before the shift.
    pub place: Pos2,
    /// Shift by two fingers, points.
    shift: f32,
}

impl Zoom {
    /// Zoom over `response` about the pointer, or about the midpoint of two fingers.
    pub fn over(ui: &Ui, response: &Response) -> Option<Self> {
        let factor = factor(ui);
        let (place, shift) = match ui.input(|input| input.multi_touch()) {
            Some(fingers) => {
                let centre = Some(fingers.center_pos).filter(|pos| response.rect.contains(*pos))?;
                let shift = fingers.translation_delta;
                (centre - shift, shift.x)
            }
            None => (response.hover_pos()?, 0.0),
        };
        (factor != 1.0 || shift != 0.0).then_some(Self { factor, place, shift })
    }

    /// The zoomed time range, s, of (`from`, `to`) drawn over `width` points; `time` is the instant at the fixed point. The
    /// result is at least `least` long.
    pub fn apply(&self, (from, to): (f64, f64), time: f64, width: f32, least: f64) -> (f64, f64) {
        let length = ((to - from) / f64::from(self.factor)).max(least);
        let share = (time - from) / (to - from) + f64::from(self.shift / width);
        let from = time - share * length;
        (from, from + length)
    }
}

/// Whether `response` is dragged by the primary button or by one finger.
pub fn drags(ui: &Ui, response: &Response) -> bool {
    response.dragged_by(PointerButton::Primary) && ui.input(|input| input.multi_touch()).is_none()
}

/// (`from`, `to`) shifted into (0, `end`) with its length unchanged.
pub fn clamp_range((from, to): (f64, f64), end: f64) -> (f64, f64) {
    let length = to - from;
    let from = from.clamp(0.0, (end - length).max(0.0));
    (from, from + length)
}
