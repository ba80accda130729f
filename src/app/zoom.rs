//! Zooming with wheel and pinch: the same everywhere.

use eframe::egui::{PointerButton, Pos2, Response, Ui};

/// Zoom factor of wheel and pinch in this frame; 1 where they rest.
pub fn factor(ui: &Ui) -> f32 {
    let (wheel, pinch) = ui.input(|i| (i.smooth_scroll_delta().y, i.zoom_delta()));
    (wheel * 0.004).exp() * pinch
}

/// What wheel and pinch do to a time range in this frame.
pub struct Zoom {
    factor: f32,
    /// The place that stays, but for the shift.
    pub place: Pos2,
    /// How far two fingers move it, points.
    shift: f32,
}

impl Zoom {
    /// Over `response`: about the pointer, or midway between two fingers.
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

    /// The time range (`from`, `to`), s, drawn over `width` points, after it; `time` is the instant at the place. No shorter
    /// than `least`.
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

/// (`from`, `to`) moved into (0, `end`), with its length unchanged.
pub fn within((from, to): (f64, f64), end: f64) -> (f64, f64) {
    let length = to - from;
    let from = from.clamp(0.0, (end - length).max(0.0));
    (from, from + length)
}
