//! Cuts off tall peaks at the start of a run, which would flatten the rest of a plot. Each is marked, and a note states the height.

use eframe::egui::{
    self, Align2, Button, CursorIcon, Pos2, Rect, RichText, Role, Sense, Shape, Stroke, TextStyle, Ui, WidgetInfo, vec2,
};

use super::{ROUNDING, Trace, value};

/// Initial fractions of the visible record: peaks within the first are cut by default, those within the second on request.
const EARLY_FRACTIONS: [f64; 2] = [0.25, 0.5];
/// Least ratio of such a peak to the largest later value.
const MIN_PEAK_RATIO: f64 = 4.0;
/// Padding of the note about the largest, points.
const NOTE_PADDING: egui::Vec2 = vec2(5.0, 1.0);
/// Room for the note above the largest later value, as a factor of that value.
const HEADROOM: f64 = 1.2;
/// Least distance between two marks of a curve, points.
const MIN_MARK_DISTANCE: f32 = 9.0;
/// Width and height of a mark, points.
const MARK_SIZE: egui::Vec2 = vec2(8.0, 7.0);

/// First peaks far above all later values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peaks {
    /// The largest, and the largest later value, SI.
    pub largest: f64,
    pub later: f64,
    /// Whether all are so early that they are cut by default.
    pub brief: bool,
}

/// First peaks of `traces`, if they would flatten the rest.
pub fn peaks<'a>(traces: impl Iterator<Item = &'a Trace> + Clone) -> Option<Peaks> {
    EARLY_FRACTIONS.into_iter().find_map(|share| {
        let (largest, later) = within(traces.clone(), share)?;
        Some(Peaks { largest, later, brief: share == EARLY_FRACTIONS[0] })
    })
}

/// Largest values of `traces` in the first `share` of their time and after it, SI, if the first is far above the second.
fn within<'a>(traces: impl Iterator<Item = &'a Trace> + Clone, share: f64) -> Option<(f64, f64)> {
    let bins = traces.flat_map(|trace| &trace.bins).filter(|bin| !bin.greatest.is_nan());
    let ends = |(from, to): (f64, f64), bin: &crate::session::history::Bin| (from.min(bin.from), to.max(bin.to));
    let (from, to) = bins.clone().fold((f64::INFINITY, f64::NEG_INFINITY), ends);
    let until = from + share * (to - from);
    let (mut early, mut later) = (0.0_f64, 0.0_f64);
    for bin in bins {
        let part = if bin.to <= until { &mut early } else { &mut later };
        *part = part.max(bin.greatest);
    }
    (early > MIN_PEAK_RATIO * later && later > ROUNDING * early).then_some((early, later))
}

impl Peaks {
    /// The largest value on a cut axis, SI.
    pub fn most(&self) -> f64 {
        HEADROOM * self.later
    }
}

/// Draws marks at the upper edge of `frame` where `trace` exceeds `most`, SI; `x` maps an instant to its position.
pub fn mark(ui: &Ui, frame: Rect, trace: &Trace, most: f64, x: impl Fn(f64) -> f32) {
    let mut last = f32::NEG_INFINITY;
    for bin in trace.bins.iter().filter(|bin| bin.greatest > most) {
        let tip = egui::pos2(x(0.5 * (bin.from + bin.to)), frame.top() + 1.0);
        if tip.x - last < MIN_MARK_DISTANCE || !frame.x_range().contains(tip.x) {
            continue;
        }
        last = tip.x;
        let foot = |side: f32| -> Pos2 { tip + vec2(side * MARK_SIZE.x, MARK_SIZE.y) };
        let edge = Stroke::new(1.0, ui.visuals().panel_fill);
        ui.painter().add(Shape::convex_polygon(vec![tip, foot(0.5), foot(-0.5)], trace.colour, edge));
    }
}

/// Notes the height of the `peak` of `plot` at the upper right of `frame`, in units of `unit`; a click on the note `leads` to the peak.
/// Returns whether it was clicked.
pub fn note(ui: &Ui, plot: &str, frame: Rect, peak: f64, unit: (&str, f64), leads: bool) -> bool {
    let words = format!("Peak {} {} above", value::number(peak / unit.1, 3), unit.0);
    let ink = ui.visuals().strong_text_color();
    let words = ui.painter().layout_no_wrap(words, TextStyle::Small.resolve(ui.style()), ink);
    let plate = Align2::RIGHT_TOP.align_size_within_rect(words.size() + 2.0 * NOTE_PADDING, frame.shrink(2.0));
    let mut fill = ui.visuals().widgets.inactive.weak_bg_fill;
    let mut clicked = false;
    if leads {
        let name = format!("Peak {} {} above in {plot}", value::number(peak / unit.1, 3), unit.0);
        let note = ui.interact(plate.expand(3.0), ui.scope_id().with(("peak above", plot)), Sense::click());
        note.widget_info(|| WidgetInfo::labeled(Role::Button, ui.is_enabled(), &name));
        if note.hovered() || note.has_focus() {
            fill = ui.visuals().widgets.hovered.weak_bg_fill;
        }
        clicked = note.on_hover_cursor(CursorIcon::PointingHand).on_hover_text("Go to that instant").clicked();
    }
    ui.painter().rect_filled(plate, 4.0, fill);
    ui.painter().galley(plate.min + NOTE_PADDING, words, ink);
    clicked
}

/// The button that shows first peaks whole in all plots, in the title of `plot`; `on`: whether they are cut. Returns whether it was
/// clicked.
pub fn switch(ui: &mut Ui, plot: &str, on: bool) -> bool {
    let help = "Shows peaks in the first half of the range whole, which otherwise are cut off where they are more than four times any \
                later value, so that they do not flatten the rest. Until clicked, only those in the first quarter are cut. The axis then ends at 1.26 times the \
                largest later value; a mark at the upper edge stands for each peak beyond it. Readings and saved files have the \
                whole values, and a range that was zoomed is not cut";
    let button = Button::selectable(!on, RichText::new("Whole peaks").small());
    let button = ui.add(button).on_hover_text(help);
    ui.ctx().accesskit_node_builder(button.id, |node| node.set_label(format!("Whole first peaks in {plot}")));
    button.clicked()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::history::Bin;

    fn trace(values: &[f64]) -> Trace {
        let bin =
            |(at, &value): (usize, &f64)| Bin { from: at as f64, to: at as f64 + 1.0, least: 0.0, greatest: value };
        Trace { bins: values.iter().enumerate().map(bin).collect(), ..Trace::default() }
    }

    fn found(values: &[f64]) -> Option<Peaks> {
        peaks([trace(values)].iter())
    }

    #[test]
    fn only_early_peaks_far_above_all_later_values_are_cut() {
        assert_eq!(
            found(&[0.0, 900.0, 30.0, 20.0, 35.0, 30.0, 30.0, 30.0]),
            Some(Peaks { largest: 900.0, later: 35.0, brief: true })
        );
        let until_the_middle = found(&[0.0, 900.0, 30.0, 700.0, 35.0, 30.0, 30.0, 30.0]);
        assert_eq!(until_the_middle, Some(Peaks { largest: 900.0, later: 35.0, brief: false }));
        // Continuing impacts are not cut.
        assert_eq!(found(&[0.0, 900.0, 30.0, 20.0, 300.0, 30.0, 30.0, 30.0]), None);
        assert_eq!(found(&[0.0, 30.0, 30.0, 30.0, 900.0, 30.0, 30.0, 30.0]), None);
        // A single blow with nothing after it.
        assert_eq!(found(&[0.0, 900.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), None);
        assert_eq!(found(&[]), None);
    }

    #[test]
    fn the_curves_of_a_plot_are_judged_together() {
        let (first, second) = (trace(&[0.0, 900.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]), trace(&[300.0; 8]));
        assert_eq!(peaks([first.clone(), second].iter()), None);
        assert!(peaks([first.clone(), first].iter()).is_some());
    }
}
