//! Live plots of the recorded channels: one plot per quantity with one line per joint, axis or kind; and one plot per picked
//! channel name and unit.

use eframe::egui::{
    self, AsIdSalt, ComboBox, EventFilter, Id, Key, Pos2, RichText, Role, ScrollArea, TextEdit, Ui, WidgetInfo,
    accesskit::Live, vec2,
};
use egui_plot::{FilledArea, GridInput, GridMark, HoverPosition, Plot, PlotPoint, PlotResponse, PlotTransform};

use super::compare::{Comparison, EarlierRun};
use super::curve::{Curves, Path, Trace};
use super::player::Player;
use super::player::impact_record::RecordedImpact;
use super::stack::stack;
use super::zoom::{self, Zoom};
use super::{curve, layout, opening};
use super::{spoken, theme, value};
use crate::scene::Scene;
use crate::session::history::Bin;
use crate::session::link::settings::PlotWindow;
use crate::simulate::{ChannelInfo, MAX_PICKED, Quantity, RECORDED_JOINTS, channels_of};
pub(super) use quantity::plot_of;
use quantity::{PlotKind, QuantityPlot};
use scale::Scale;

mod cut;
mod quantity;
mod scale;
#[cfg(not(target_arch = "wasm32"))]
mod sheet;
#[cfg(not(target_arch = "wasm32"))]
pub use sheet::{PlotFormat, format_buttons};

/// Selectable windows, s.
const WINDOWS: [f64; 6] = [1e-3, 1e-2, 0.05, 0.1, 1.0, 10.0];
/// The shortest zoomed time range, s.
const MIN_WINDOW: f64 = 1e-6;
/// Least useful height of a plot, points.
const MIN_HEIGHT: f32 = 110.0;
/// Least distance between two marks on an axis, points: the text height of their labels.
const MIN_MARK_DISTANCE: f32 = 16.0;
/// Least width of a plot beside another, and room between them, points.
const MIN_WIDTH: f32 = 230.0;
const PLOT_GAP: f32 = 20.0;
/// Upper estimate of the width of a label's character, points.
const LETTER_WIDTH: f64 = 7.0;
/// Least room for the switch of the cut in a title, points.
const MIN_SWITCH_WIDTH: f32 = 70.0;
/// Room for the button to the hardest impact in a title, points. Without it, the note on cut peaks leads there.
const MIN_HARDEST_WIDTH: f32 = 96.0;
/// Time shown before and after an impact: in its durations, and at least and at most, s.
const IMPACT_DURATIONS: f64 = 10.0;
const IMPACT_MARGINS: [f64; 2] = [1e-3, 0.05];
/// What the button to the hardest impact does.
pub(super) const HARDEST_HELP: &str = "To the peak of the impact with the largest normal force so far, with a few milliseconds around it \
                                       in the plots. Double-click on a plot for its whole window";
/// Fraction of the time range by which an arrow key moves the cursor.
const KEY_FRACTION: f64 = 0.01;
/// Approximate maximum number of marks on an axis.
const MAX_MARKS: f64 = 5.0;
/// A range below this fraction of the values, or below this in axis units, is rounding error rather than motion.
const ROUNDING: f64 = 1e-9;
/// The record holds single precision: relative difference of a recorded peak from that of its impact.
const PEAK_ROUNDING: f64 = 1e-5;

/// The plots and their settings.
#[derive(Default)]
pub struct Plots {
    /// Displayed quantities, from top to bottom.
    pub chosen: Vec<Quantity>,
    /// Names or patterns of channels displayed after them, as in `run --channels`.
    pub picked: Vec<String>,
    /// Search text of the channel list, and its result.
    search: String,
    found: Option<(String, Vec<Entry>)>,
    /// Time window.
    pub window: PlotWindow,
    /// Channels whose lines are hidden.
    hidden: Vec<usize>,
    /// Traces of one plot at a time, and their points for the hit test.
    traces: Vec<Trace>,
    levels: Vec<Trace>,
    readings: Vec<Vec<PlotPoint>>,
    /// Traces of the same plot in the runs before a change.
    earlier: Vec<Vec<Trace>>,
    /// Runs before a change; their curves are drawn as well.
    pub comparison: Comparison,
    /// Latest screen position of each quantity's plot.
    places: Vec<(Quantity, Place)>,
    /// Zoomed time range, s, which replaces the window.
    zoomed: Option<(f64, f64)>,
    /// ID of the focused plot, and its cursor position set by arrow keys, s.
    cursor: Option<(Id, f64)>,
    /// Whether tall first peaks are cut; `None` if only brief ones are.
    cut: Option<bool>,
}

/// Selection of the plots: quantities, channels, time window, hidden lines.
pub struct PlotChoice {
    chosen: Vec<Quantity>,
    picked: Vec<String>,
    window: PlotWindow,
    hidden: Vec<usize>,
}

/// A name for picking channels.
struct Entry {
    name: String,
    /// Units of the matching channels, separated by commas.
    units: String,
}

/// Contents of a plot.
struct Panel<'a> {
    /// `None` for channels picked by name.
    quantity: Option<Quantity>,
    label: &'a str,
    help: &'a str,
    /// Axis unit, and its value in SI units.
    unit: (&'static str, f64),
    kind: PlotKind,
    /// Channels of the record, with their names.
    members: Vec<(usize, &'a str)>,
}

impl<'a> Panel<'a> {
    /// Panel of `quantity`; `None` if the scene does not have it.
    fn for_quantity(quantity: Quantity, player: &'a Player) -> Option<Self> {
        let list = player.channels().list().iter().enumerate();
        let members: Vec<(usize, &str)> = list
            .filter(|(_, channel)| channel.quantity == quantity)
            .map(|(index, channel)| (index, channel.member.as_str()))
            .collect();
        let QuantityPlot { label, unit, kind, help } = plot_of(quantity);
        (!members.is_empty()).then_some(Self { quantity: Some(quantity), label, help, unit, kind, members })
    }

    /// Panels of the channels picked by `name`, one per unit.
    fn for_pick(name: &'a str, player: &'a Player) -> Vec<Self> {
        let mut panels: Vec<Self> = Vec::new();
        let picked = player.channels().picked().iter().zip(player.picked());
        for (channel, index) in picked.filter(|(channel, _)| channel.is_matched_by(name)) {
            let rest = channel.name.strip_prefix(name);
            let member = rest.and_then(|rest| rest.strip_prefix('.'));
            let member = (index, member.unwrap_or(&channel.name));
            let unit = axis_unit(channel);
            match panels.iter_mut().find(|panel| panel.unit == unit) {
                Some(panel) => panel.members.push(member),
                None => panels.push(Self {
                    quantity: None,
                    label: name,
                    help: channel.help,
                    unit,
                    kind: PlotKind::Curves,
                    members: vec![member],
                }),
            }
        }
        panels
    }

    /// Accessible name; for picked channels the title, since each unit has its own plot.
    fn name(&self) -> String {
        if self.quantity.is_some() { self.label.to_owned() } else { self.title() }
    }

    /// Label with the unit.
    fn title(&self) -> String {
        match self.unit.0 {
            "" => self.label.to_owned(),
            unit => format!("{}, {unit}", self.label),
        }
    }
}

/// Axis unit of a channel, and its value in SI units.
fn axis_unit(channel: &ChannelInfo) -> (&'static str, f64) {
    match channel.unit {
        "m" => ("mm", 1e-3),
        "m/s2" => ("m/s²", 1.0),
        "rad/s2" => ("rad/s²", 1.0),
        unit => (unit, 1.0),
    }
}

/// Maximum length of the channel list.
const MAX_LISTED: usize = 60;

/// Names of channels that contain `search` or match it as a pattern; all component groups if it is empty.
fn find_channels(player: &Player, search: &str) -> Vec<Entry> {
    let list = channels_of(&player.running().machine, player.frame());
    let wanted = search.to_lowercase();
    let mut entries: Vec<Entry> = Vec::new();
    let mut add = |name: &str, unit: &'static str| {
        if let Some(entry) = entries.iter_mut().find(|entry| entry.name == name) {
            if !entry.units.split(", ").any(|own| own == unit) {
                entry.units += &format!(", {unit}");
            }
        } else if entries.len() < MAX_LISTED {
            entries.push(Entry { name: name.to_owned(), units: unit.to_owned() });
        }
    };
    let pattern = search.contains(['*', '?']);
    for channel in &list {
        let unit = axis_unit(channel).0;
        if pattern && channel.is_matched_by(search) {
            add(search, unit);
        } else if channel.group().to_lowercase().contains(&wanted) {
            add(channel.group(), unit);
        } else if channel.name.to_lowercase().contains(&wanted) {
            add(&channel.name, unit);
        }
    }
    entries
}

/// Position of a plot on the screen, and its units in SI.
struct Place {
    transform: PlotTransform,
    units: [f64; 2],
}

impl Plots {
    /// The chosen quantities and the window, where they differ from the initial ones of a window on `scene`.
    pub fn changes_from_initial(&self, scene: &Scene) -> (Option<Vec<Quantity>>, Option<PlotWindow>) {
        let first = Self::of(scene);
        let chosen = (self.chosen != first.chosen).then(|| self.chosen.clone());
        (chosen, (self.window != first.window).then_some(self.window))
    }

    /// Initial plots of a window on `scene`.
    pub fn of(scene: &Scene) -> Self {
        Self { chosen: opening::plots(scene), ..Self::default() }
    }

    /// Whether the distance from the ideal motion is chosen, which needs that motion alongside.
    pub fn has_tip_error(&self) -> bool {
        self.chosen.contains(&Quantity::TipError)
    }

    /// Restores the initial plots of a window on `scene`; picked channels stay.
    pub fn restore_initial(&mut self, scene: &Scene) {
        let picked = std::mem::take(&mut self.picked);
        *self = Self { picked, ..Self::of(scene) };
    }

    /// Screen position, points, of a value (SI) at `time`, s, in the latest plot of `quantity`. `None` if it is not displayed.
    pub fn place(&self, quantity: Quantity, time: f64, value: f64) -> Option<Pos2> {
        let (_, place) = self.places.iter().find(|(shown, _)| *shown == quantity)?;
        let point = PlotPoint::new(time / place.units[0], value / place.units[1]);
        Some(place.transform.position_from_point(&point))
    }

    /// Selection of the quantities and of the time window.
    pub fn header(&mut self, ui: &mut Ui, player: &Player) {
        ui.horizontal_wrapped(|ui| {
            spoken::heading(&ui.label(RichText::new("Plots").strong()), "Plots");
            let menu =
                egui::containers::menu::MenuConfig::new().close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside);
            egui::containers::menu::MenuButton::new("Choose plots")
                .config(menu)
                .ui(ui, |ui| layout::entries(ui, |ui| self.menu(ui, player)));
            ui.label("Window");
            ComboBox::from_id_salt("window")
                .width(110.0)
                .selected_text(self.window_label())
                .show_ui(ui, |ui| {
                    let all = [PlotWindow::Automatic]
                        .into_iter()
                        .chain(WINDOWS.map(PlotWindow::Last))
                        .chain([PlotWindow::Everything]);
                    for window in all {
                        let chosen = self.window == window && self.zoomed.is_none();
                        if ui.selectable_label(chosen, window.label()).clicked() {
                            (self.window, self.zoomed) = (window, None);
                        }
                    }
                })
                .response
                .on_hover_text(
                    "Time window of the plots. Over a plot: wheel or pinch to zoom, drag to pan, click to go to an \
                     instant, double-click to restore the window chosen here",
                )
                .accessible_name("Window");
            self.comparison.ui(ui, player);
        });
    }

    fn menu(&mut self, ui: &mut Ui, player: &Player) {
        for quantity in Quantity::ALL {
            if !player.channels().list().iter().any(|c| c.quantity == quantity) {
                continue;
            }
            let mut on = self.chosen.contains(&quantity);
            let QuantityPlot { label, unit, help, .. } = plot_of(quantity);
            if ui.checkbox(&mut on, format!("{label}, {}", unit.0)).on_hover_text(help).changed() {
                self.chosen.retain(|q| *q != quantity);
                if on {
                    // Below the others, which stay where they are.
                    self.chosen.push(quantity);
                }
            }
        }
        if player.running().machine.loose_joints.len() > RECORDED_JOINTS {
            ui.label(
                RichText::new(format!("The first {RECORDED_JOINTS} joints with play are recorded")).small().weak(),
            );
        }
        ui.separator();
        self.channels(ui, player);
    }

    /// Controls for picking channels by name.
    fn channels(&mut self, ui: &mut Ui, player: &Player) {
        ui.add(
            TextEdit::singleline(&mut self.search).hint_text("Search channels: angle, *.force").desired_width(220.0),
        )
        .on_hover_text(
            "Any channel by its name, as for `run --channels`. It is recorded from the moment it is picked; * matches \
             any characters, ? one character",
        )
        .accessible_name("Search channels");
        let search = self.search.trim().to_owned();
        if self.found.as_ref().is_none_or(|(of, _)| *of != search) {
            self.found = Some((search.clone(), find_channels(player, &search)));
        }
        let Self { picked, found, .. } = self;
        let found = found.as_ref().map_or(&[][..], |(_, entries)| entries);
        let unlisted = picked.iter().filter(|name| !found.iter().any(|entry| entry.name == **name));
        let unlisted: Vec<String> = unlisted.cloned().collect();
        let mut toggled = None;
        ScrollArea::vertical().id_salt("channels").max_height(180.0).show(ui, |ui| {
            let listed = found.iter().map(|entry| (&entry.name, &*entry.units));
            for (name, units) in unlisted.iter().map(|name| (name, "")).chain(listed) {
                let mut on = picked.contains(name);
                let label = match units {
                    "" => name.clone(),
                    units => format!("{name}, {units}"),
                };
                if ui.checkbox(&mut on, label).changed() {
                    toggled = Some((name.clone(), on));
                }
            }
            if found.is_empty() {
                ui.label(RichText::new("No such channel").small().weak());
            }
        });
        if player.channels().picked().len() == MAX_PICKED {
            let note = format!("At most {MAX_PICKED} channels are recorded");
            ui.label(RichText::new(note).small().weak());
        }
        if let Some((name, on)) = toggled {
            // Their indices in the record will change.
            let first = player.picked().start;
            self.hidden.retain(|channel| *channel < first);
            self.picked.retain(|picked| *picked != name);
            if on && self.picked.len() < MAX_PICKED {
                self.picked.push(name);
            }
        }
    }

    /// The present selection.
    pub fn choice(&self) -> PlotChoice {
        let Self { chosen, picked, window, hidden, .. } = self;
        PlotChoice { chosen: chosen.clone(), picked: picked.clone(), window: *window, hidden: hidden.clone() }
    }

    /// Restores a selection.
    pub fn restore_choice(&mut self, choice: PlotChoice) {
        PlotChoice { chosen: self.chosen, picked: self.picked, window: self.window, hidden: self.hidden } = choice;
        self.reset();
    }

    /// Returns to the chosen window.
    pub fn reset(&mut self) {
        self.zoomed = None;
        self.found = None;
    }

    fn window_label(&self) -> String {
        match self.zoomed {
            Some((from, to)) => format!("{} zoomed", value::time(to - from)),
            None => self.window.label(),
        }
    }

    /// Length of the chosen window, s.
    fn window_length(&self, player: &Player) -> f64 {
        match self.window {
            PlotWindow::Automatic => player.automatic_window(),
            PlotWindow::Last(length) => length,
            PlotWindow::Everything => player.known_to().max(1e-4),
        }
    }

    /// Length of the time range of the plots, s.
    pub fn length(&self, player: &Player) -> f64 {
        self.zoomed.map_or_else(|| self.window_length(player), |(from, to)| to - from)
    }

    /// Time range of the plots, s. It ends at the displayed instant, or up to a quarter of its length later if recorded.
    pub(super) fn range(&self, player: &Player) -> (f64, f64) {
        if let Some(range) = self.zoomed {
            return range;
        }
        let shown = player.pacer.shown();
        let known = player.known_to();
        let length = self.window_length(player);
        let end = if self.window == PlotWindow::Everything { known } else { shown };
        let end = end.max(known.min(shown + 0.25 * length));
        // A window that would start before t = 0 fills from the left.
        if end < length { (0.0, length) } else { (end - length, end) }
    }

    /// Shows a few of its durations around `impact`, until a double click on a plot or another window.
    pub fn show_around(&mut self, impact: &RecordedImpact) {
        let duration = if impact.end.is_finite() { impact.end - impact.start } else { 0.0 };
        let [least, most] = IMPACT_MARGINS;
        let margin = (IMPACT_DURATIONS * duration).clamp(least, most);
        let peak = impact.force_peak.time;
        self.zoomed = Some(((peak - margin).max(0.0), peak + margin));
    }

    /// Titles of the chosen plots in order.
    pub fn titles(&self, player: &Player) -> Vec<String> {
        panels(&self.chosen, &self.picked, player).iter().map(Panel::title).collect()
    }

    /// The chosen plots, side by side if there is room, otherwise stacked. Returns the clicked instant, s.
    pub fn ui(&mut self, ui: &mut Ui, player: &Player) -> Option<f64> {
        self.show(ui, player, None)
    }

    /// Only the chosen plot number `index`. Returns as [`Self::ui`].
    pub fn single(&mut self, ui: &mut Ui, player: &Player, index: usize) -> Option<f64> {
        self.show(ui, player, Some(index))
    }

    /// The same in a second window; recorded plot positions of the first window are preserved.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn second(&mut self, ui: &mut Ui, player: &Player, index: usize) {
        let places = std::mem::take(&mut self.places);
        self.show(ui, player, Some(index));
        self.places = places;
    }

    fn show(&mut self, ui: &mut Ui, player: &Player, single: Option<usize>) -> Option<f64> {
        self.places.clear();
        let (quantities, picked) = (self.chosen.clone(), self.picked.clone());
        let mut chosen = panels(&quantities, &picked, player);
        if let Some(index) = single {
            chosen = chosen.into_iter().skip(index).take(1).collect();
        }
        if chosen.is_empty() {
            ui.label(RichText::new("No plot chosen").weak());
            return None;
        }
        let mut clicked_time = None;
        let space = ui.available_size();
        let columns = ((space.x / MIN_WIDTH).floor() as usize).clamp(1, chosen.len());
        let rows = chosen.len().div_ceil(columns);
        ui.spacing_mut().item_spacing.x = PLOT_GAP;
        let gap = ui.spacing().item_spacing;
        // The last plot of a row reaches the right edge, as the timeline does.
        let width = (space.x - gap.x * (columns - 1) as f32) / columns as f32;
        let height = ((space.y - gap.y * (rows - 1) as f32) / rows as f32).max(MIN_HEIGHT);
        egui::ScrollArea::vertical().id_salt("plots").show(ui, |ui| {
            for row in chosen.chunks(columns) {
                ui.horizontal_top(|ui| {
                    for panel in row {
                        let shown =
                            ui.allocate_ui(vec2(width, height), |ui| self.plot(ui, player, panel, vec2(width, height)));
                        clicked_time = clicked_time.or(shown.inner);
                    }
                });
            }
        });
        clicked_time
    }

    /// Shows `panel` in `space`, points; returns an instant, s, that was clicked.
    fn plot(&mut self, ui: &mut Ui, player: &Player, panel: &Panel<'_>, space: egui::Vec2) -> Option<f64> {
        let (from, to) = self.range(player);
        self.collect(ui, player, panel, (from, to), space.x);
        let (time_unit, size) = (time_axis_until(to - from, to), panel.unit.1);
        let stacked = panel.kind == PlotKind::Bands;
        let bands = if stacked { self.bands(&panel.members, [time_unit.1, size]) } else { Vec::new() };
        let (values, cut_off) = self.values(panel, &bands);
        let from_zero = matches!(panel.kind, PlotKind::FromZero | PlotKind::FromZeroWithClearances);
        let (least, greatest) = range(values, from_zero);
        let scale = Scale { panel, from, to, time_unit, least, greatest };
        self.readings.resize_with(panel.members.len(), Vec::new);
        for (trace, readings) in self.traces.iter().zip(&mut self.readings) {
            readings.clear();
            readings.extend(trace.bins.iter().flat_map(|bin| {
                let time = 0.5 * (bin.from + bin.to) / time_unit.1;
                let ends = [bin.least, bin.greatest].map(|v| PlotPoint::new(time, v / size));
                ends.into_iter().take(1 + usize::from(bin.least != bin.greatest))
            }));
        }
        ui.vertical(|ui| {
            let hardest = self.title(ui, player, panel, cut_off.is_some());
            let PlotResponse { response, transform, .. } = self.curves(ui, &scale, &bands, space);
            let cursor = self.cursor.and_then(|(plot, time)| (plot == response.id).then_some(time));
            self.describe(ui, &response, &scale, cursor);
            self.move_cursor(ui, &response, player);
            let clicked_time = self.pointer(ui, &response, &transform, time_unit.1, player);
            let frame = *transform.frame();
            let x = |time: f64| transform.position_from_point(&PlotPoint::new(time / time_unit.1, 0.0)).x;
            if cut_off.is_some() {
                for trace in self.earlier.iter().flatten().chain(&self.traces) {
                    cut::mark(ui, frame, trace, greatest * size, x);
                }
            }
            self.instants(ui, player, &scale, cursor, frame, x);
            let mut clicked_time = clicked_time.or(hardest);
            if let Some(peaks) = cut_off {
                let peak = self.instant_of(player, peaks.largest);
                if cut::note(ui, &panel.name(), frame, peaks.largest, panel.unit, peak.is_some()) {
                    clicked_time = peak;
                }
            }
            if let Some(quantity) = panel.quantity {
                self.places.push((quantity, Place { transform, units: scale.units() }));
            }
            clicked_time
        })
        .inner
    }

    /// The instant of the value `largest`, SI, of this run's curves, s; that of the impact which has it, if one does. `None` if only an
    /// earlier run has it.
    fn instant_of(&self, player: &Player, largest: f64) -> Option<f64> {
        let bin = self.traces.iter().flat_map(|trace| &trace.bins).find(|bin| bin.greatest == largest)?;
        let within = player.impact_record().peaks(bin.from, bin.to);
        let nearest = within.map(|(_, peak)| (peak.force.norm(), peak.time));
        let hardest = nearest.filter(|(force, _)| (force / largest - 1.0).abs() < PEAK_ROUNDING);
        let time = hardest.max_by(|a, b| a.0.total_cmp(&b.0)).map_or(0.5 * (bin.from + bin.to), |(_, time)| time);
        Some(time).filter(|time| *time <= player.reached())
    }

    /// Collects the curves of `panel` between the instants `from` and `to`, s, for a plot `width` points wide.
    fn collect(&mut self, ui: &Ui, player: &Player, panel: &Panel<'_>, (from, to): (f64, f64), width: f32) {
        // No bin is wider than a pixel column, if the record's resolution permits.
        let bins = (2.0 * width * ui.ctx().pixels_per_point()) as usize;
        let dark = ui.visuals().dark_mode;
        let query = |channel: usize, out: &mut Vec<Bin>| {
            out.clear();
            player.bins(channel, from, to, bins, out);
        };
        self.traces.resize_with(panel.members.len(), Trace::default);
        for (index, (channel, _)) in panel.members.iter().enumerate() {
            let trace = &mut self.traces[index];
            trace.colour = theme::series(index, dark);
            trace.bins.clear();
            if !self.hidden.contains(channel) {
                query(*channel, &mut trace.bins);
            }
        }
        self.earlier.clear();
        if panel.kind == PlotKind::Bands {
            // A stack of ranges would mean nothing.
            let widest = f64::from(curve::MAX_BIN_WIDTH / width) * (to - from);
            self.traces.iter_mut().for_each(|trace| trace.bins.retain(|bin| curve::is_narrow(bin, widest)));
        } else {
            let shown = self.comparison.shown();
            self.earlier
                .extend(shown.map(|run| earlier_traces(run, player, panel, &self.hidden, dark, (from, to, bins))));
        }
        self.levels.clear();
        if panel.kind == PlotKind::FromZeroWithClearances {
            // The recorded clearance: the present value may differ from the past one.
            for index in player.clearances() {
                let mut trace = Trace { colour: ui.visuals().weak_text_color(), ..Trace::default() };
                query(index, &mut trace.bins);
                let closed = trace.bins.iter().all(|bin| bin.greatest <= 0.0);
                if !closed && !self.levels.iter().any(|level| level.bins == trace.bins) {
                    self.levels.push(trace);
                }
            }
        }
    }

    /// Least and greatest value shown, in the unit of `panel`, and the first peaks that are cut.
    fn values(&self, panel: &Panel<'_>, bands: &[Band<'_>]) -> (Option<(f64, f64)>, Option<cut::Peaks>) {
        let size = panel.unit.1;
        let values = if bands.is_empty() {
            extremes(self.traces.iter().chain(&self.levels).chain(self.earlier.iter().flatten()), size)
        } else {
            let edges = bands.iter().flat_map(|band| band.low.iter().chain(&band.high));
            edges.fold(None, |all, &edge| extended(all, edge, edge))
        };
        let first_peaks = (panel.kind == PlotKind::FromZero && self.zoomed.is_none())
            .then(|| cut::peaks(self.traces.iter().chain(self.earlier.iter().flatten())))
            .flatten();
        let cut_off = first_peaks.filter(|peaks| self.cut.unwrap_or(peaks.brief));
        let values = values.map(|(least, most)| (least, cut_off.map_or(most, |peaks| peaks.most() / size)));
        (values, cut_off)
    }

    /// Draws axes and curves, or `bands`.
    fn curves(&self, ui: &mut Ui, scale: &Scale<'_>, bands: &[Band<'_>], space: egui::Vec2) -> PlotResponse<()> {
        let Self { traces, levels, readings, hidden, comparison, earlier, .. } = self;
        let (panel, units) = (scale.panel, scale.units());
        let plot = scale.plot(ui, space).label_formatter(|position: &HoverPosition<'_>| {
            let (HoverPosition::NearDataPoint { position, .. } | HoverPosition::Elsewhere { position }) = position;
            let time = position.x * units[0];
            Some(scale.reading(traces, time, scale.instant(time), "\n"))
        });
        let shown = plot.show(ui, |plot| {
            plot.set_plot_bounds_x(scale.from / units[0]..=scale.to / units[0]);
            plot.set_plot_bounds_y(scale.least..=scale.greatest);
            if panel.kind == PlotKind::Bands {
                for band in bands {
                    plot.add(
                        FilledArea::new(band.member, &band.times, &band.low, &band.high)
                            .fill_color(band.colour.gamma_multiply(0.75))
                            // Strokes would jump where a term changes sign.
                            .stroke(egui::Stroke::NONE),
                    );
                }
                return;
            }
            plot.add(Curves::new(levels, units).dashed(1.0, curve::DASH));
            for (run, traces) in comparison.shown().zip(earlier) {
                let curves = Curves::new(traces, units);
                plot.add(match run.dashes() {
                    Some(length) => curves.dashed(curve::WIDTH, length),
                    None => curves,
                });
            }
            plot.add(Curves::new(traces, units));
            for ((channel, member), (trace, points)) in panel.members.iter().zip(traces.iter().zip(readings)) {
                if !hidden.contains(channel) {
                    plot.add(Path::readings(member, points, trace.colour));
                }
            }
        });
        let name = format!("Plot of {}", panel.name());
        shown.response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &name));
        shown
    }

    /// Describes the plot to screen readers: the values at `cursor`, s, or the range of all.
    fn describe(&self, ui: &Ui, response: &egui::Response, scale: &Scale<'_>, cursor: Option<f64>) {
        ui.ctx().accesskit_node_builder(response.id, |node| {
            if let Some(time) = cursor {
                // Read aloud as the cursor moves.
                node.set_live(Live::Polite);
                let values = scale.reading(&self.traces, time, String::new(), ", ");
                let values = values.trim_start_matches(", ");
                node.set_label(spoken::words(&format!("{values} at {}", scale.instant(time))));
            } else {
                node.set_value(spoken::words(&scale.summary(&self.traces)));
            }
        });
    }

    /// Draws over `frame` the present and the future, flags, and the values at `cursor`, s; `x` maps a time, s, to its position.
    fn instants(
        &self,
        ui: &Ui,
        player: &Player,
        scale: &Scale<'_>,
        cursor: Option<f64>,
        frame: egui::Rect,
        x: impl Fn(f64) -> f32,
    ) {
        let (painter, now) = (ui.painter_at(frame), player.pacer.shown());
        if (scale.from..scale.to).contains(&now)
            && (player.has_future() || self.zoomed.is_some() || player.abandoned_future().is_some())
        {
            // Fades the future.
            let veil = ui.visuals().panel_fill.gamma_multiply(0.65);
            painter.rect_filled(frame.with_min_x(x(now)), 0.0, veil);
            let line = egui::Stroke::new(1.0, ui.visuals().strong_text_color());
            painter.vline(x(now), frame.y_range(), line);
        }
        for flag in player.flags().filter(|flag| (scale.from..=scale.to).contains(&flag.time)) {
            let line = egui::Stroke::new(1.0, ui.visuals().warn_fg_color.gamma_multiply(0.7));
            painter.vline(x(flag.time), frame.y_range(), line);
        }
        if let Some(time) = cursor {
            painter.vline(x(time), frame.y_range(), ui.visuals().selection.stroke);
            let words = scale.reading(&self.traces, time, scale.instant(time), "\n");
            let font = egui::TextStyle::Small.resolve(ui.style());
            let words = painter.layout_no_wrap(words, font, ui.visuals().strong_text_color());
            let left = (x(time) + 4.0).min(frame.right() - words.size().x);
            painter.galley(egui::pos2(left, frame.top()), words, ui.visuals().strong_text_color());
        }
    }

    /// Arrow keys on a focused plot move the cursor to an instant.
    fn move_cursor(&mut self, ui: &Ui, response: &egui::Response, player: &Player) {
        if !response.has_focus() {
            self.cursor = self.cursor.filter(|(plot, _)| *plot != response.id);
            return;
        }
        let arrows = EventFilter { horizontal_arrows: true, ..EventFilter::default() };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, arrows));
        let pressed = |key| ui.input(|input| input.num_presses(key)) as f64;
        let by = pressed(Key::ArrowRight) - pressed(Key::ArrowLeft);
        if by != 0.0 {
            let (from, to) = self.range(player);
            let before = self.cursor.map_or(player.pacer.shown(), |(_, time)| time);
            let wanted = before + by * KEY_FRACTION * (to - from);
            // A recorded instant, and always a new one.
            let all = self.traces.iter().flat_map(|trace| &trace.bins).map(|bin| 0.5 * (bin.from + bin.to));
            let ahead = all.filter(|time| (time - before) * by > 0.0);
            let nearest = ahead.min_by(|a, b| (a - wanted).abs().total_cmp(&(b - wanted).abs()));
            if let Some(time) = nearest {
                self.cursor = Some((response.id, time));
                ui.ctx().request_repaint();
            }
        }
    }

    /// Pointer input on a plot: changes the time range, or returns an instant, s.
    fn pointer(
        &mut self,
        ui: &Ui,
        response: &egui::Response,
        transform: &PlotTransform,
        time_size: f64,
        player: &Player,
    ) -> Option<f64> {
        let (from, to) = self.range(player);
        let time = |pos: Pos2| transform.value_from_position(pos).x * time_size;
        let end = player.known_to();
        if response.double_clicked() {
            self.zoomed = None;
            return None;
        }
        if let Some(zoom) = Zoom::over(ui, response) {
            let width = transform.frame().width();
            let range = zoom.apply((from, to), time(zoom.place), width, MIN_WINDOW);
            let part = range.1 - range.0 < end.max(self.window_length(player));
            self.zoomed = part.then(|| zoom::clamp_range(range, f64::INFINITY));
        }
        if zoom::drags(ui, response) {
            let width = f64::from(transform.frame().width());
            let length = to - from;
            let by = f64::from(response.drag_delta().x) / width * length;
            if by != 0.0 {
                self.zoomed = Some(zoom::clamp_range((from - by, to - by), end));
            }
        }
        let clicked = response.clicked().then(|| response.interact_pointer_pos());
        clicked.flatten().map(time).filter(|time| *time <= player.reached())
    }

    /// The stacked terms of the energy balance: supplied energy above zero, absorbed or stored energy below.
    fn bands<'a>(&self, members: &[(usize, &'a str)], units: [f64; 2]) -> Vec<Band<'a>> {
        let mut bands: Vec<Band<'a>> = Vec::new();
        let mut terms = Vec::new();
        for ((_, member), trace) in members.iter().zip(&self.traces) {
            let sign = if Quantity::takes(member) { -0.5 } else { 0.5 };
            let value = |bin: &Bin| sign * (bin.least + bin.greatest) / units[1];
            let terms_of: Vec<f64> = trace.bins.iter().map(value).collect();
            if terms_of.is_empty() {
                continue;
            }
            terms.push(terms_of);
            let middle = |bin: &Bin| 0.5 * (bin.from + bin.to) / units[0];
            bands.push(Band {
                member,
                colour: trace.colour,
                times: trace.bins.iter().map(middle).collect(),
                low: Vec::new(),
                high: Vec::new(),
            });
        }
        for (band, (low, high)) in bands.iter_mut().zip(stack(&terms)) {
            (band.low, band.high) = (low, high);
        }
        bands
    }

    /// Title with unit, and switches of the members in the colours of their lines. `is_cut`: whether first peaks are cut.
    /// Returns the instant of the hardest impact, s, if the user asks for it.
    fn title(&mut self, ui: &mut Ui, player: &Player, panel: &Panel<'_>, is_cut: bool) -> Option<f64> {
        let mut asked = None;
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            ui.spacing_mut().button_padding = vec2(4.0, 1.0);
            let height = theme::side(ui, 18.0);
            ui.spacing_mut().interact_size.y = height;
            ui.label(RichText::new(panel.title()).small()).on_hover_text(panel.help);
            ui.add_space(4.0);
            for (index, (channel, member)) in panel.members.iter().enumerate() {
                let on = !self.hidden.contains(channel);
                let colour = theme::series_text(index, ui.visuals().dark_mode);
                let mut text = RichText::new(*member).small().strong().color(colour);
                if !on {
                    text = text.strikethrough().color(ui.visuals().weak_text_color());
                }
                let response = ui.add(egui::Button::new(text).frame(false).min_size(vec2(theme::side(ui, 0.0), 0.0)));
                ui.ctx().accesskit_node_builder(response.id, |node| {
                    node.set_toggled(on.into());
                    node.set_label(format!("{member} in {}", panel.name()));
                });
                if response.on_hover_text("Line shown or hidden").clicked() {
                    if on {
                        self.hidden.push(*channel);
                    } else {
                        self.hidden.retain(|hidden| hidden != channel);
                    }
                }
            }
            if panel.quantity == Some(Quantity::NormalForce)
                && ui.available_width() > MIN_HARDEST_WIDTH + MIN_SWITCH_WIDTH
            {
                let hardest = player.impact_record().hardest(player.reached());
                let button =
                    ui.add_enabled(hardest.is_some(), egui::Button::new(RichText::new("Hardest impact").small()));
                if button.on_hover_text(HARDEST_HELP).on_disabled_hover_text("No impact so far").clicked()
                    && let Some((_, own)) = hardest
                {
                    self.show_around(own);
                    asked = Some(own.force_peak.time);
                }
            }
            if panel.kind == PlotKind::FromZero && ui.available_width() > MIN_SWITCH_WIDTH {
                let on = is_cut || self.cut == Some(true);
                if cut::switch(ui, &panel.name(), on) {
                    self.cut = Some(!on);
                }
            }
            if panel.kind != PlotKind::Bands {
                self.comparison.legend(ui, player, height, &panel.name());
            }
        });
        asked
    }
}

/// Least and greatest value of all curves, SI, with the curve and the time, s, of the greatest.
fn largest<'a>(members: &[(usize, &'a str)], traces: &[Trace]) -> Option<(&'a str, f64, f64, f64)> {
    let mut found: Option<(&str, f64, f64, f64)> = None;
    for ((_, member), trace) in members.iter().zip(traces) {
        for bin in trace.bins.iter().filter(|bin| !bin.greatest.is_nan()) {
            let (_, least, most, _) = found.unwrap_or((member, bin.least, f64::NEG_INFINITY, 0.0));
            if bin.greatest > most {
                found = Some((member, least, bin.greatest, 0.5 * (bin.from + bin.to)));
            }
            if let Some(found) = &mut found {
                found.1 = found.1.min(bin.least);
            }
        }
    }
    found
}

/// Record of the members of `panel` in `run` between two instants, s, with a limited number of bins.
fn earlier_traces(
    run: &EarlierRun,
    player: &Player,
    panel: &Panel<'_>,
    hidden: &[usize],
    dark: bool,
    (from, to, bins): (f64, f64, usize),
) -> Vec<Trace> {
    let visible_members = panel.members.iter().enumerate().filter(|(_, (channel, _))| !hidden.contains(channel));
    let trace = |(index, (channel, _)): (usize, &(usize, &str))| {
        let mut trace = Trace { colour: run.colour(theme::series(index, dark), dark), ..Trace::default() };
        if let Some(channel) = run.channel(player, *channel) {
            run.run().bins(channel, from, to, bins, &mut trace.bins);
        }
        trace
    };
    visible_members.map(trace).collect()
}

/// Panels of the `chosen` quantities and of the channels `picked` by name.
fn panels<'a>(chosen: &[Quantity], picked: &'a [String], player: &'a Player) -> Vec<Panel<'a>> {
    let of_quantity = |quantity: &Quantity| Panel::for_quantity(*quantity, player);
    let of_picks = picked.iter().flat_map(|name| Panel::for_pick(name, player));
    chosen.iter().filter_map(of_quantity).chain(of_picks).collect()
}

/// One term of a stack, in axis units.
struct Band<'a> {
    member: &'a str,
    colour: egui::Color32,
    times: Vec<f64>,
    low: Vec<f64>,
    high: Vec<f64>,
}

fn extended(all: Option<(f64, f64)>, least: f64, greatest: f64) -> Option<(f64, f64)> {
    let (a, b) = all.unwrap_or((least, greatest));
    Some((a.min(least), b.max(greatest)))
}

/// Least and greatest value in `traces`, in units of `size`.
fn extremes<'a>(traces: impl Iterator<Item = &'a Trace>, size: f64) -> Option<(f64, f64)> {
    let bins = traces.flat_map(|trace| &trace.bins);
    bins.fold(None, |all, bin| extended(all, bin.least / size, bin.greatest / size))
}

/// Axis range for a range of values, or for none: with a margin, or wide enough to look flat if the values differ only by
/// rounding.
fn range(values: Option<(f64, f64)>, from_zero: bool) -> (f64, f64) {
    let (mut least, mut greatest) = values.unwrap_or((0.0, 0.0));
    if from_zero {
        (least, greatest) = (least.min(0.0), greatest.max(0.0));
    }
    let size = least.abs().max(greatest.abs());
    if !size.is_finite() || size <= ROUNDING {
        (least, greatest) = (if from_zero { 0.0 } else { -1.0 }, 1.0);
    } else if greatest - least <= ROUNDING * size {
        let middle = 0.5 * (least + greatest);
        let half = 0.05 * 10_f64.powf(size.log10().floor());
        (least, greatest) = (middle - half, middle + half);
    }
    let margin = 0.05 * (greatest - least);
    (least - margin, greatest + margin)
}

/// A plot that no gesture moves.
pub(super) fn still_plot<'a>(id: impl AsIdSalt) -> Plot<'a> {
    Plot::new(id)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .allow_axis_zoom_drag(false)
        .allow_double_click_reset(false)
}

/// About `count` marks at 1, 2 or 5 times a power of ten, no closer than the axis allows; at least two if there is room.
pub(super) fn marks(input: &GridInput, count: f64) -> Vec<GridMark> {
    const ROUND: &[f64] = &[1.0, 2.0, 5.0, 10.0];
    const ROUND_ENOUGH: &[f64] = &[1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0];
    let (least, greatest) = input.bounds;
    let rough = ((greatest - least) / count).max(input.base_step_size);
    if !(rough.is_finite() && rough > 0.0) {
        return Vec::new();
    }
    let power = 10_f64.powf(rough.log10().floor());
    let marks = |factors: &[f64]| -> Vec<GridMark> {
        let steps = factors.iter().map(|factor| factor * power);
        let step = steps.into_iter().find(|step| *step >= rough * 0.999);
        let step = step.unwrap_or(10.0 * power);
        let first = (least / step).ceil() as i64;
        let last = (greatest / step).floor() as i64;
        (first..=last).map(|index| GridMark { value: index as f64 * step, step_size: step }).collect()
    };
    let round = marks(ROUND);
    if round.len() < 2 { marks(ROUND_ENOUGH) } else { round }
}

impl PlotWindow {
    fn label(self) -> String {
        match self {
            Self::Automatic => "Automatic".to_owned(),
            Self::Last(length) => {
                let (unit, size) = match length {
                    _ if length >= 1.0 => ("s", 1.0),
                    _ if length >= 1e-3 => ("ms", 1e-3),
                    _ => ("µs", 1e-6),
                };
                format!("{} {unit}", value::number(length / size, 4))
            }
            Self::Everything => "Everything".to_owned(),
        }
    }
}

/// Unit of a time axis of this length, and its value in seconds.
pub(super) fn time_axis(length: f64) -> (&'static str, f64) {
    if length >= 0.5 {
        ("s", 1.0)
    } else if length >= 5e-4 {
        ("ms", 1e-3)
    } else {
        ("µs", 1e-6)
    }
}

/// The same for an axis that ends at `to`, s: late times use a larger unit with decimals.
fn time_axis_until(length: f64, to: f64) -> (&'static str, f64) {
    // Limits labels to five digits before the decimal point.
    let longest = [5e-4, 0.5].into_iter().zip([0.1, 100.0]);
    let least = longest.filter(|(_, end)| to >= *end).map(|(length, _)| length);
    time_axis(least.fold(length, f64::max))
}

/// Label of a mark on an axis up to `most` with mark distance `step`: enough digits to distinguish neighbours.
pub(super) fn tick(mark: f64, step: f64, most: f64) -> String {
    value::mark(mark, step, (1e-4..1e9).contains(&most))
}

/// The same beside a plot, with room for six digits. More would move the plot at a high peak.
fn short_tick(mark: f64, step: f64, most: f64) -> String {
    value::mark(mark, step, (1e-4..1e6).contains(&most))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(least: f64, greatest: f64, height: f64) -> Vec<String> {
        let input = GridInput {
            bounds: (least, greatest),
            base_step_size: f64::from(MIN_MARK_DISTANCE) * (greatest - least) / height,
        };
        let most = least.abs().max(greatest.abs());
        let marks = marks(&input, MAX_MARKS);
        assert!(marks.iter().all(|m| (least..=greatest).contains(&m.value)));
        let are_spaced = marks.windows(2).all(|w| w[1].value - w[0].value >= 0.99 * input.base_step_size);
        assert!(are_spaced, "{marks:?}");
        marks.iter().map(|m| tick(m.value, m.step_size, most)).collect()
    }

    #[test]
    fn labels_beside_a_plot_have_six_digits_at_most() {
        assert_eq!(short_tick(7.5e4, 2.5e4, 9.3e4), "75\u{202f}000");
        assert_eq!(short_tick(8e5, 2e5, 9.9e5), "800\u{202f}000");
        assert_eq!(short_tick(1e6, 2e5, 1.1e6), "1.0×10^6");
    }

    #[test]
    fn marks_are_round_few_and_distinguishable() {
        assert_eq!(words(0.0, 871.0, 120.0), ["0", "200", "400", "600", "800"]);
        assert_eq!(words(-0.015, 0.315, 120.0), ["0", "0.1", "0.2", "0.3"]);
        assert_eq!(words(203.44080, 203.44120, 120.0), ["203.4408", "203.4409", "203.4410", "203.4411", "203.4412"]);
        assert_eq!(words(-1e-7, 2e-7, 120.0), ["-1×10^-7", "0", "1×10^-7", "2×10^-7"]);
        for height in [36.0, 45.0, 60.0, 200.0] {
            for (least, greatest) in [
                (0.0, 100.0),
                (-3.3, 8.1),
                (202.9, 203.4),
                (1e9, 1e9 + 1.0),
                (-0.05, 1.05),
                (-44.0, 914.0),
                (0.203, 0.203 + 1e-9),
            ] {
                let words = words(least, greatest, height);
                assert!((2..=7).contains(&words.len()), "{height}: {words:?}");
                let different: std::collections::HashSet<_> = words.iter().collect();
                assert_eq!(different.len(), words.len(), "{words:?}");
            }
        }
        let nothing = GridInput { bounds: (1.0, 1.0), base_step_size: 0.0 };
        assert!(marks(&nothing, 5.0).is_empty());
    }

    #[test]
    fn rounding_is_drawn_flat_and_motion_is_not() {
        // An empty plot also has an axis that includes zero.
        assert_eq!(range(None, true), (-0.05, 1.05));
        assert_eq!(range(Some((0.0, 0.0)), true), (-0.05, 1.05));
        assert_eq!(range(Some((0.0, 0.0)), false), (-1.1, 1.1));
        let (least, greatest) = range(Some((-3e-13, 8e-13)), false);
        assert!(greatest - least > 1.0);
        let (least, greatest) = range(Some((203.441, 203.441 + 1e-11)), false);
        assert!(least > 190.0 && greatest < 220.0 && greatest - least > 5.0);
        let (least, greatest) = range(Some((203.441, 203.442)), false);
        assert!((greatest - least - 1.1e-3).abs() < 1e-9);
        let (least, greatest) = range(Some((5.0, 5.0)), true);
        assert!((least, greatest) == (-0.25, 5.25));
    }

    #[test]
    fn windows_are_labelled_in_a_suitable_unit() {
        let all = WINDOWS.map(|length| PlotWindow::Last(length).label());
        assert_eq!(all, ["1 ms", "10 ms", "50 ms", "100 ms", "1 s", "10 s"]);
    }

    #[test]
    fn late_times_have_a_larger_unit() {
        assert_eq!(time_axis_until(4e-4, 0.01).0, "µs");
        assert_eq!(time_axis_until(4e-4, 1.0929).0, "ms");
        assert_eq!(time_axis_until(4e-4, 120.0).0, "s");
        assert_eq!(time_axis_until(0.04, 2.0).0, "ms");
        assert_eq!(time_axis_until(2.0, 2.0).0, "s");
    }
}
