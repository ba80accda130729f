//! A bench plot of one quantity against another: no legend, no dragging, units on the axes.

use eframe::egui::{self, Rangef, Role, Sense, Ui, Vec2b, WidgetInfo};
use egui_plot::{AxisHints, GridMark, HoverPosition, Plot, PlotResponse};

use crate::app::plots::{marks, still_plot, tick};
use crate::app::{spoken, value};

/// Name and unit of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisLabel {
    /// Name of the quantity.
    pub name: String,
    /// Unit; "" for a dimensionless quantity.
    pub unit: String,
}

impl AxisLabel {
    /// An axis.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        let (name, unit) = (name.into(), unit.into());
        Self { name, unit }
    }

    /// Name and unit, as in a title.
    pub fn title(&self) -> String {
        with_unit(&self.name, &self.unit, ", ")
    }
}

fn with_unit(text: &str, unit: &str, between: &str) -> String {
    if unit.is_empty() { text.to_owned() } else { format!("{text}{between}{unit}") }
}

/// The tick label of a mark.
fn tick_label(mark: GridMark, range: &std::ops::RangeInclusive<f64>) -> String {
    let most = range.start().abs().max(range.end().abs());
    tick(mark.value, mark.step_size, most)
}

/// Labels the plot `shown` of `up` over `across` as `what` for screen readers, with the visible ranges.
pub fn set_accessible_name<R>(shown: &PlotResponse<R>, what: &str, across: &AxisLabel, up: &AxisLabel) {
    let bounds = shown.transform.bounds();
    let range = |axis: &AxisLabel, d: usize| {
        let [least, most] = [bounds.min()[d], bounds.max()[d]].map(|end| value::number(end, 3));
        format!("{} from {least} to {}", axis.name, with_unit(&most, &axis.unit, " "))
    };
    let name = format!("Plot of {what}");
    shown.response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &name));
    spoken::value(&shown.response, &format!("{} over {}", range(up, 1), range(across, 0)));
}

/// A plot of `up` over `across`, `height` points high, over the full available width.
pub fn plane<'a>(ui: &Ui, id: &'static str, across: &AxisLabel, up: &AxisLabel, height: f32) -> Plot<'a> {
    let faint = ui.visuals().weak_text_color();
    let font = egui::TextStyle::Small.resolve(ui.style());
    let hints = |hints: AxisHints<'a>| hints.tick_label_color(faint).tick_label_font(font.clone());
    let unit = across.unit.clone();
    let below = hints(AxisHints::new_x())
        .label_spacing(Rangef::new(24.0, 28.0))
        .formatter(move |mark, range| with_unit(&tick_label(mark, range), &unit, " "));
    let beside =
        hints(AxisHints::new_y()).min_thickness(46.0).label_spacing(Rangef::new(14.0, 18.0)).formatter(tick_label);
    let (across, up) = (across.clone(), up.clone());
    still_plot(id)
        .width(ui.available_width() - 12.0)
        .height(height)
        // Dragging a finger over the plot scrolls the panel.
        .sense(Sense::hover())
        .auto_bounds(Vec2b::new(true, true))
        .custom_x_axes(vec![below])
        .custom_y_axes(vec![beside])
        .x_grid_spacer(|input| marks(&input, 4.0))
        .y_grid_spacer(|input| marks(&input, 5.0))
        .grid_spacing(Rangef::new(16.0, 300.0))
        .grid_color(faint.gamma_multiply(0.35))
        .grid_fade(0.0)
        .label_formatter(move |position| match position {
            HoverPosition::NearDataPoint { plot_name, position, .. } => {
                let line = |axis: &AxisLabel, value| {
                    let number = value::number(value, 6);
                    format!("{} {}", axis.name, with_unit(&number, &axis.unit, " "))
                };
                Some(format!("{plot_name}\n{}\n{}", line(&up, position.y), line(&across, position.x)))
            }
            HoverPosition::Elsewhere { .. } => None,
        })
}
