//! The visible plots as charts in a file for print or editing.

use eframe::egui::Ui;

use super::{Panel, PlotKind, Plots, earlier_traces, time_axis};
use crate::app::curve;
use crate::app::files::{describe, file_stem};
use crate::app::host::SaveFile;
use crate::app::layout;
use crate::app::player::Player;
use crate::chart::{Axis, Chart, Colour, PALETTE, Series, Sheet};
use crate::session::history::Bin;

/// Size of a chart, pixels, and its maximum number of instants; more would not be visible.
const CHART_SIZE: (u32, u32) = (520, 320);
const MAX_INSTANTS: usize = 1000;
/// Charts side by side.
const COLUMNS: usize = 2;
/// Space for the legend and the line below the charts, pixels.
const FOOTER_HEIGHT: u32 = 60;
/// Colour of clearance lines.
const CLEARANCE_COLOUR: Colour = (150, 150, 150);
/// PNG pixels per sheet pixel.
const PNG_SCALE: f32 = 2.0;

/// File format of saved plots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlotFormat {
    /// SVG, for editing.
    Svg,
    /// PNG.
    Png,
}

impl PlotFormat {
    const ALL: [(Self, &'static str, &'static str, &'static str); 2] =
        [(Self::Svg, "SVG", "svg", "image/svg+xml"), (Self::Png, "PNG", "png", "image/png")];
}

/// A button for each file format of the visible plots; returns that of the clicked one.
pub fn format_buttons(ui: &mut Ui) -> Option<PlotFormat> {
    let mut chosen = None;
    ui.horizontal(|ui| {
        layout::aligned(ui, |ui| ui.label("Plots"));
        for (format, name, ..) in PlotFormat::ALL {
            let button = ui.button(format!("{name}…")).on_hover_text(format!("The plots on show, {name}"));
            if button.accessible_name(format!("Plots as {name}")).clicked() {
                chosen = Some(format);
                layout::close_menu(ui);
            }
        }
    });
    chosen
}

impl Plots {
    /// A file with the visible plots.
    ///
    /// # Errors
    /// No plot is chosen, or they cannot be drawn; as a message.
    pub fn file(&self, player: &Player, format: PlotFormat) -> Result<SaveFile, String> {
        let sheet = self.sheet(player, describe(player)).ok_or("No plot is chosen")?;
        let bytes = match format {
            PlotFormat::Svg => sheet.svg().map(String::into_bytes),
            PlotFormat::Png => sheet.png(PNG_SCALE),
        };
        let (_, _, ending, mime) = PlotFormat::ALL[format as usize];
        let name = format!("{}-plots.{ending}", file_stem(player));
        let bytes = bytes.map_err(|error| format!("The plots cannot be saved: {error}"))?;
        Ok(SaveFile { name, mime, bytes })
    }

    /// The visible plots with their time range, and `note` below; `None` without plots.
    pub fn sheet(&self, player: &Player, note: String) -> Option<Sheet> {
        let of_quantity = |quantity: &_| Panel::for_quantity(*quantity, player);
        let mut panels: Vec<Panel<'_>> = self.chosen.iter().filter_map(of_quantity).collect();
        panels.extend(self.picked.iter().flat_map(|name| Panel::for_pick(name, player)));
        let charts: Vec<Chart> = panels.iter().map(|panel| self.chart(player, panel)).collect();
        let columns = COLUMNS.min(charts.len());
        let rows = charts.len().div_ceil(columns.max(1)) as u32;
        let size = (CHART_SIZE.0 * columns as u32, CHART_SIZE.1 * rows + FOOTER_HEIGHT);
        (!charts.is_empty()).then_some(Sheet { charts, columns, size, note })
    }

    fn chart(&self, player: &Player, panel: &Panel<'_>) -> Chart {
        let (from, to) = self.range(player);
        let (time_unit, time_size) = time_axis(to - from);
        let (unit, size) = panel.unit;
        let widest = (to - from) * f64::from(curve::MAX_BIN_WIDTH) / f64::from(CHART_SIZE.0);
        let ends = |bins: &[Bin]| -> Vec<(f64, f64)> {
            let ends = |bin: &Bin| {
                let time = 0.5 * (bin.from + bin.to) / time_size;
                [bin.least, bin.greatest].map(|value| (time, value / size))
            };
            let ends = bins
                .iter()
                .filter(|bin| curve::is_narrow(bin, widest))
                .flat_map(|bin| ends(bin).into_iter().take(1 + usize::from(bin.least != bin.greatest)));
            ends.collect()
        };
        let mut bins: Vec<Bin> = Vec::new();
        let mut points = |channel: usize| {
            bins.clear();
            player.bins(channel, from, to, MAX_INSTANTS, &mut bins);
            ends(&bins)
        };
        let mut series = Vec::new();
        if panel.kind == PlotKind::FromZeroWithClearances {
            for channel in player.clearances() {
                let level =
                    Series::line(if series.is_empty() { "clearance" } else { "" }, points(channel), CLEARANCE_COLOUR);
                let closed = level.points.iter().all(|(_, value)| *value <= 0.0);
                if !closed && !series.iter().any(|other: &Series| other.points == level.points) {
                    series.push(level);
                }
            }
        }
        if panel.kind != PlotKind::Bands {
            for run in self.comparison.shown() {
                let traces = earlier_traces(run, player, panel, &self.hidden, false, (from, to, MAX_INSTANTS));
                for (index, trace) in traces.iter().enumerate() {
                    let [r, g, b, _] = trace.colour.to_array();
                    let label = if index == 0 { run.name() } else { String::new() };
                    series.push(Series::line(&label, ends(&trace.bins), (r, g, b)));
                }
            }
        }
        for (index, (channel, member)) in panel.members.iter().enumerate() {
            if !self.hidden.contains(channel) {
                // The first colour is reserved for a reference.
                let colour = PALETTE[1 + index % (PALETTE.len() - 1)];
                series.push(Series::line(member, points(*channel), colour));
            }
        }
        let time = Axis { range: Some((from / time_size, to / time_size)), ..Axis::new("Time", time_unit) };
        Chart::new(panel.label, time, Axis::new(panel.label, unit), series)
    }
}
