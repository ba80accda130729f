//! The axes of one plot, and its values in words.

use eframe::egui::{self, Rangef, Ui, Vec2b};
use egui_plot::{AxisHints, GridInput, GridMark, Plot};

use super::{
    LETTER_WIDTH, MAX_MARKS, MIN_MARK_DISTANCE, PLOT_GAP, Panel, Trace, largest, marks, short_tick, still_plot, theme,
    tick, value,
};

/// Ranges and units of the two axes of a plot.
pub struct Scale<'a> {
    pub panel: &'a Panel<'a>,
    /// Time range, s.
    pub from: f64,
    pub to: f64,
    /// Unit of the time axis, and its value in seconds.
    pub time_unit: (&'static str, f64),
    /// Range of values, in the unit of the panel.
    pub least: f64,
    pub greatest: f64,
}

impl Scale<'_> {
    /// Values of both units in SI units.
    pub fn units(&self) -> [f64; 2] {
        [self.time_unit.1, self.panel.unit.1]
    }

    fn time(&self, time: f64) -> String {
        value::number(time / self.time_unit.1, value::digits_within(self.to - self.from, self.to))
    }

    /// The instant `time`, s, with its unit.
    pub fn instant(&self, time: f64) -> String {
        format!("{} {}", self.time(time), self.time_unit.0)
    }

    fn value(&self, si: f64) -> String {
        let digits = value::digits_within(self.greatest - self.least, self.least.abs().max(self.greatest.abs()));
        value::number(si / self.panel.unit.1, digits)
    }

    /// The `traces` at `time`, s, each after `between`, appended to `words`.
    pub fn reading(&self, traces: &[Trace], time: f64, mut words: String, between: &str) -> String {
        for ((_, member), trace) in self.panel.members.iter().zip(traces) {
            let Some((least, greatest)) = trace.at(time) else {
                continue;
            };
            let ([least, greatest], unit) = ([least, greatest].map(|v| self.value(v)), self.panel.unit.0);
            words += &if least == greatest {
                format!("{between}{member} {least} {unit}")
            } else {
                format!("{between}{member} {least} to {greatest} {unit}")
            };
        }
        words
    }

    /// The time range, and the range of the `traces`.
    pub fn summary(&self, traces: &[Trace]) -> String {
        let mut words = format!("{} to {}", self.time(self.from), self.instant(self.to));
        if let Some((member, least, most, time)) = largest(&self.panel.members, traces) {
            let ([least, most], unit) = ([least, most].map(|v| self.value(v)), self.panel.unit.0);
            words += &format!(", from {least} to {most} {unit}, largest in {member} at {}", self.instant(time));
        }
        words
    }

    /// A plot without curves in `space`, points, below its title.
    pub fn plot<'a>(&self, ui: &Ui, space: egui::Vec2) -> Plot<'a> {
        let faint = ui.visuals().weak_text_color();
        let font = egui::TextStyle::Small.resolve(ui.style());
        let axis = |hints: AxisHints<'static>| hints.tick_label_color(faint).tick_label_font(font.clone());
        let width = space.x;
        let (to, (time_unit, time_size)) = (self.to, self.time_unit);
        let time_mark =
            move |mark: &GridMark| format!("{} {time_unit}", tick(mark.value, mark.step_size, to / time_size));
        let frame = f64::from(width - 52.0);
        let x_axis = axis(AxisHints::new_x()).label_spacing(Rangef::new(0.0, 1.0)).formatter(move |mark, range| {
            let words = time_mark(&mark);
            let beyond = (range.end() - mark.value) / (range.end() - range.start()) * frame;
            // Omits a mark that would extend into the next plot, or beyond the window.
            if 0.5 * LETTER_WIDTH * words.chars().count() as f64 > beyond + f64::from(0.5 * PLOT_GAP) {
                return String::new();
            }
            words
        });
        let y_axis = axis(AxisHints::new_y()).min_thickness(40.0).label_spacing(Rangef::new(0.0, 1.0)).formatter(
            |mark, range| {
                let most = range.start().abs().max(range.end().abs());
                short_tick(mark.value, mark.step_size, most)
            },
        );
        // Marks at late times have long labels, so fewer fit side by side.
        let label_length = move |mark: &GridMark| time_mark(mark).chars().count();
        let marks_across = move |input: GridInput| {
            let marks = marks(&input, MAX_MARKS);
            let longest = marks.iter().map(label_length).max().unwrap_or(1);
            let room = frame / (LETTER_WIDTH * longest as f64 + 8.0);
            if room < MAX_MARKS { super::marks(&input, room.max(1.0)) } else { marks }
        };
        still_plot(("plot", self.panel.label, self.panel.unit.0))
            .width(width)
            .height((space.y - 20.0 - theme::side(ui, 18.0)).max(60.0))
            .auto_bounds(Vec2b::FALSE)
            .custom_x_axes(vec![x_axis])
            .custom_y_axes(vec![y_axis])
            .x_grid_spacer(marks_across)
            .y_grid_spacer(|input| self::marks(&input, MAX_MARKS))
            .grid_spacing(Rangef::new(MIN_MARK_DISTANCE, 300.0))
            .grid_color(faint.gamma_multiply(0.35))
            .grid_fade(0.0)
    }
}
