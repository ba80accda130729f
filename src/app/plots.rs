//! Live plots of the recorded channels: one plot per quantity, one line per joint, axis or kind.

use eframe::egui::{self, ComboBox, RichText, Ui, Vec2b, vec2};
use egui_plot::{
    AxisHints, FilledArea, GridInput, GridMark, HLine, HoverPosition, Line, LineStyle, Plot,
    PlotPoint, PlotPoints,
};

use super::layout;
use super::player::Player;
use super::stack::{middles, stack};
use super::{theme, value};
use crate::simulate::{Quantity, RECORDED_JOINTS};

/// Bins asked of the record for one line: two points each.
const BINS: usize = 400;
/// Windows to choose from, s.
const WINDOWS: [f64; 6] = [1e-3, 1e-2, 0.05, 0.1, 1.0, 10.0];
/// Height below which a plot says nothing.
const LEAST_HEIGHT: f32 = 110.0;

/// How much of the past the plots show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Window {
    /// The last seconds of viewing, whatever the time scale.
    Automatic,
    /// The last so many simulated seconds.
    Last(f64),
    /// Since the reset.
    Everything,
}

/// Which plots are shown and how.
pub struct Plots {
    /// Quantities on show, in the order of [`Quantity::ALL`].
    pub chosen: Vec<Quantity>,
    /// Time window.
    pub window: Window,
    /// Channels whose lines are hidden.
    hidden: Vec<usize>,
    points: Vec<[f64; 2]>,
    lines: Vec<Vec<PlotPoint>>,
}

impl Default for Plots {
    fn default() -> Self {
        Self {
            chosen: vec![Quantity::NormalForce, Quantity::Eccentricity],
            window: Window::Automatic,
            hidden: Vec::new(),
            points: Vec::new(),
            lines: Vec::new(),
        }
    }
}

impl Plots {
    /// Which quantities and how much of the past.
    pub fn header(&mut self, ui: &mut Ui, player: &Player) {
        ui.horizontal_wrapped(|ui| {
            ui.label(RichText::new("Plots").strong());
            let menu = egui::containers::menu::MenuConfig::new()
                .close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside);
            egui::containers::menu::MenuButton::new("Choose plots")
                .config(menu)
                .ui(ui, |ui| layout::entries(ui, |ui| self.menu(ui, player)));
            ui.label("Window");
            ComboBox::from_id_salt("window")
                .width(110.0)
                .selected_text(self.window.label())
                .show_ui(ui, |ui| {
                    let all = [Window::Automatic]
                        .into_iter()
                        .chain(WINDOWS.map(Window::Last))
                        .chain([Window::Everything]);
                    for window in all {
                        ui.selectable_value(&mut self.window, window, window.label());
                    }
                })
                .response
                .on_hover_text("Simulated time that the plots show")
                .accessible_name("Window");
        });
    }

    fn menu(&mut self, ui: &mut Ui, player: &Player) {
        for quantity in Quantity::ALL {
            if !player
                .channels()
                .list()
                .iter()
                .any(|c| c.quantity == quantity)
            {
                continue;
            }
            let mut on = self.chosen.contains(&quantity);
            let label = format!("{}, {}", quantity.label(), quantity.unit().0);
            if ui
                .checkbox(&mut on, label)
                .on_hover_text(quantity.help())
                .changed()
            {
                self.chosen.retain(|q| *q != quantity);
                if on {
                    self.chosen.push(quantity);
                    self.chosen
                        .sort_by_key(|q| Quantity::ALL.iter().position(|a| a == q));
                }
            }
        }
        if player.scene().ball_joints.len() > RECORDED_JOINTS {
            ui.label(
                RichText::new(format!(
                    "The first {RECORDED_JOINTS} ball joints are recorded"
                ))
                .small()
                .weak(),
            );
        }
    }

    /// The chosen plots, beside each other where there is room, else below each other.
    pub fn ui(&mut self, ui: &mut Ui, player: &Player) {
        let chosen: Vec<Quantity> = self
            .chosen
            .iter()
            .copied()
            .filter(|q| player.channels().list().iter().any(|c| c.quantity == *q))
            .collect();
        if chosen.is_empty() {
            ui.label(RichText::new("No plot chosen").weak());
            return;
        }
        let space = ui.available_size();
        let columns = ((space.x / 300.0).floor() as usize).clamp(1, chosen.len());
        let rows = chosen.len().div_ceil(columns);
        let gap = ui.spacing().item_spacing;
        // The last mark of the axis below reaches beyond the plot.
        let width = (space.x - 16.0 - gap.x * (columns - 1) as f32) / columns as f32;
        let height = ((space.y - gap.y * (rows - 1) as f32) / rows as f32).max(LEAST_HEIGHT);
        egui::ScrollArea::vertical()
            .id_salt("plots")
            .show(ui, |ui| {
                for row in chosen.chunks(columns) {
                    ui.horizontal_top(|ui| {
                        for quantity in row {
                            ui.allocate_ui(vec2(width, height), |ui| {
                                self.plot(ui, player, *quantity, vec2(width, height))
                            });
                        }
                    });
                }
            });
    }

    fn plot(&mut self, ui: &mut Ui, player: &Player, quantity: Quantity, space: egui::Vec2) {
        let (unit, size) = quantity.unit();
        let end = player.pacer.shown();
        let length = match self.window {
            Window::Automatic => player.automatic_window(),
            Window::Last(length) => length,
            Window::Everything => end.max(1e-4),
        };
        // A window that starts before t = 0 fills from the left.
        let (from, to) = if end < length {
            (0.0, length)
        } else {
            (end - length, end)
        };
        let (time_unit, time_size) = time_axis(length);

        let members: Vec<(usize, &str)> = player
            .channels()
            .list()
            .iter()
            .enumerate()
            .filter(|(_, channel)| channel.quantity == quantity)
            .map(|(index, channel)| (index, channel.member.as_str()))
            .collect();
        self.lines
            .resize_with(members.len().max(self.lines.len()), Vec::new);
        for ((channel, _), line) in members.iter().zip(&mut self.lines) {
            self.points.clear();
            player
                .history()
                .query(*channel, from, to, BINS, &mut self.points);
            line.clear();
            line.extend(
                self.points
                    .iter()
                    .map(|p| PlotPoint::new(p[0] / time_size, p[1] / size)),
            );
        }

        ui.vertical(|ui| {
            self.title(ui, quantity, &members);
            let dark = ui.visuals().dark_mode;
            let faint = ui.visuals().weak_text_color();
            let font = egui::TextStyle::Small.resolve(ui.style());
            let axis = |hints: AxisHints<'static>| {
                hints.tick_label_color(faint).tick_label_font(font.clone())
            };
            let across = axis(AxisHints::new_x())
                .label_spacing(egui::Rangef::new(20.0, 24.0))
                .formatter(move |mark, _| format!("{} {time_unit}", tick(mark.value)));
            let up = axis(AxisHints::new_y())
                .min_thickness(40.0)
                .label_spacing(egui::Rangef::new(14.0, 18.0))
                .formatter(|mark, _| tick(mark.value));
            let mut plot = Plot::new(("plot", quantity))
                .width(space.x - 12.0)
                .height((space.y - 20.0 - theme::side(ui, 18.0)).max(60.0))
                .allow_drag(false)
                .allow_zoom(false)
                .allow_scroll(false)
                .allow_boxed_zoom(false)
                .allow_axis_zoom_drag(false)
                .allow_double_click_reset(false)
                .auto_bounds(Vec2b::new(false, true))
                .custom_x_axes(vec![across])
                .custom_y_axes(vec![up])
                .x_grid_spacer(|input| marks(&input, 5.0))
                .y_grid_spacer(|input| marks(&input, 5.0))
                .grid_color(faint.gamma_multiply(0.35))
                .grid_fade(0.0)
                .label_formatter(move |position| match position {
                    HoverPosition::NearDataPoint {
                        plot_name,
                        position,
                        ..
                    } => Some(format!(
                        "{plot_name}\n{} {unit}\nat {} {time_unit}",
                        value::number(position.y, 4),
                        value::number(position.x, 5)
                    )),
                    HoverPosition::Elsewhere { .. } => None,
                });
            if matches!(
                quantity,
                Quantity::NormalForce | Quantity::FrictionForce | Quantity::Eccentricity
            ) {
                plot = plot.include_y(0.0);
            }
            plot.show(ui, |plot| {
                plot.set_plot_bounds_x(from / time_size..=to / time_size);
                if quantity == Quantity::Eccentricity {
                    for clearance in clearances(player) {
                        plot.hline(
                            HLine::new("clearance", clearance / size)
                                .color(faint)
                                .style(LineStyle::dashed_loose())
                                .width(1.0),
                        );
                    }
                }
                if quantity == Quantity::EnergyBalance {
                    self.balance(plot, &members, dark);
                    return;
                }
                for (index, ((channel, member), line)) in
                    members.iter().zip(&self.lines).enumerate()
                {
                    if !self.hidden.contains(channel) {
                        plot.line(
                            Line::new(*member, PlotPoints::Borrowed(line))
                                .color(theme::series(index, dark))
                                .width(1.4),
                        );
                    }
                }
            });
        });
    }

    /// The terms of the energy balance, stacked: what gives energy above zero, what takes or holds it below.
    fn balance(&self, plot: &mut egui_plot::PlotUi<'_>, members: &[(usize, &str)], dark: bool) {
        let mut times = Vec::new();
        let shown: Vec<(usize, &str)> = (0..members.len())
            .filter(|&index| !self.hidden.contains(&members[index].0))
            .map(|index| (index, members[index].1))
            .collect();
        let terms: Vec<Vec<f64>> = shown
            .iter()
            .map(|&(index, member)| {
                let points: Vec<[f64; 2]> = self.lines[index].iter().map(|p| [p.x, p.y]).collect();
                let mut values = Vec::new();
                times = middles(&points, &mut values);
                if Quantity::TAKES.contains(&member) {
                    values.iter_mut().for_each(|value| *value = -*value);
                }
                values
            })
            .collect();
        for (&(index, member), (low, high)) in shown.iter().zip(stack(&terms)) {
            let colour = theme::series(index, dark);
            if low.len() == times.len() {
                plot.add(
                    FilledArea::new(member, &times, &low, &high)
                        .fill_color(colour.gamma_multiply(0.75))
                        // Edges would jump where a term changes sides.
                        .stroke(egui::Stroke::NONE),
                );
            }
        }
    }

    /// Quantity with its unit, and its members as switches in the colours of their lines.
    fn title(&mut self, ui: &mut Ui, quantity: Quantity, members: &[(usize, &str)]) {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            ui.spacing_mut().button_padding = vec2(4.0, 1.0);
            let height = theme::side(ui, 18.0);
            ui.spacing_mut().interact_size.y = height;
            ui.label(RichText::new(format!("{}, {}", quantity.label(), quantity.unit().0)).small())
                .on_hover_text(quantity.help());
            ui.add_space(4.0);
            for (index, (channel, member)) in members.iter().enumerate() {
                let on = !self.hidden.contains(channel);
                let colour = theme::series(index, ui.visuals().dark_mode);
                let mut text = RichText::new(*member).small().strong().color(colour);
                if !on {
                    text = text.strikethrough().color(ui.visuals().weak_text_color());
                }
                let response = ui.add(
                    egui::Button::new(text)
                        .frame(false)
                        .min_size(vec2(theme::side(ui, 0.0), 0.0)),
                );
                if response.on_hover_text("Line shown or hidden").clicked() {
                    if on {
                        self.hidden.push(*channel);
                    } else {
                        self.hidden.retain(|hidden| hidden != channel);
                    }
                }
            }
        });
    }
}

/// The different clearances of the joints now, m.
fn clearances(player: &Player) -> Vec<f64> {
    let mut found = Vec::new();
    for joint in &player.frame().joints {
        if joint.clearance > 0.0 && !found.contains(&joint.clearance) {
            found.push(joint.clearance);
        }
    }
    found
}

/// About `count` marks at 1, 2 or 5 times a power of ten.
pub(super) fn marks(input: &GridInput, count: f64) -> Vec<GridMark> {
    let (least, greatest) = input.bounds;
    let rough = (greatest - least) / count;
    if !(rough.is_finite() && rough > 0.0) {
        return Vec::new();
    }
    let power = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|factor| factor * power)
        .find(|step| *step >= rough * 0.999)
        .unwrap_or(10.0 * power);
    let first = (least / step).ceil() as i64;
    let last = (greatest / step).floor() as i64;
    (first..=last)
        .map(|index| GridMark {
            value: index as f64 * step,
            step_size: step,
        })
        .collect()
}

impl Window {
    fn label(self) -> String {
        match self {
            Self::Automatic => "Automatic".to_owned(),
            Self::Last(length) => {
                let (unit, size) = time_axis(length * 0.1);
                format!("{} {unit}", value::number(length / size, 4))
            }
            Self::Everything => "Everything".to_owned(),
        }
    }
}

/// Unit of a time axis of this length, and its size in seconds.
pub(super) fn time_axis(length: f64) -> (&'static str, f64) {
    if length >= 0.5 {
        ("s", 1.0)
    } else if length >= 5e-4 {
        ("ms", 1e-3)
    } else {
        ("µs", 1e-6)
    }
}

/// A mark on an axis.
pub(super) fn tick(mark: f64) -> String {
    value::number(mark, 6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_round_and_few() {
        for bounds in [(0.0, 100.0), (-3.3, 8.1), (202.9, 203.4), (0.0, 871.0)] {
            let marks = marks(
                &GridInput {
                    bounds,
                    base_step_size: 1.0,
                },
                5.0,
            );
            assert!(
                (2..=7).contains(&marks.len()),
                "{bounds:?}: {}",
                marks.len()
            );
            assert!(
                marks
                    .iter()
                    .all(|m| m.value >= bounds.0 && m.value <= bounds.1)
            );
        }
        assert!(
            marks(
                &GridInput {
                    bounds: (1.0, 1.0),
                    base_step_size: 1.0
                },
                5.0
            )
            .is_empty()
        );
    }
}
