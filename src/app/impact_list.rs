//! The list of impacts: one row per finished impact, sorted by any column; and the badge over the picture at an impact's instant.

use std::fmt::Write as _;

use eframe::egui::{
    self, Align, Button, Label, Layout, Panel, RichText, ScrollArea, Sense, Shape, Stroke, Ui, WidgetInfo, accesskit,
    vec2,
};
use serde_json::json;

use super::files::{file_stem, meta};
use super::host::SaveFile;
use super::player::Player;
use super::player::impact_record::RecordedImpact;
use super::plots::HARDEST_HELP;
use super::run::Run;
use super::{spoken, theme, value};
use crate::analysis::impact_row;
use crate::simulate::{ContactMode, Impact};

/// Height of a row for a mouse and for touch, points.
const ROW_HEIGHTS: (f32, f32) = (20.0, 32.0);
/// Rows shown at first, and the share of the height that the list takes at most.
const FIRST_ROWS: f32 = 5.0;
const MAX_SHARE: f32 = 0.5;

/// A column.
struct Column {
    heading: &'static str,
    /// Points.
    width: f32,
    help: &'static str,
}

const fn column(heading: &'static str, width: f32, help: &'static str) -> Column {
    Column { heading, width, help }
}

const COLUMNS: [Column; 10] = [
    column("No.", 44.0, "Number of the impact in this run, in the order of their beginnings"),
    column("Joint", 58.0, "Joint with play, and where it touched if it can at several places"),
    column("Time", 82.0, "Instant at which it began"),
    column("Duration", 66.0, "From its beginning to its end"),
    column("Peak", 66.0, "Largest normal force"),
    column("Approach", 76.0, "Approach speed: penetration rate when it began"),
    column("Rebound", 76.0, "Rebound speed: minus the penetration rate when it ended"),
    column("Restitution", 80.0, "Rebound speed over approach speed"),
    column("Undisturbed", 84.0, "Restitution that the contact law gives if nothing else acts during the impact"),
    column("Remark", 300.0, "Why the restitution may differ from that of an undisturbed impact"),
];

/// Order of the rows.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Order {
    /// Index of the column.
    column: usize,
    /// Whether the greatest value comes first.
    falls: bool,
}

impl Default for Order {
    /// The latest first.
    fn default() -> Self {
        Self { column: 0, falls: true }
    }
}

/// State of the panel.
#[derive(Default)]
pub struct ImpactList {
    open: bool,
    order: Order,
    /// End of what is listed while the pointer is over the rows, s: they do not move under it.
    held: Option<f64>,
}

/// A row: number, record and data.
type Listed<'a> = (u64, &'a RecordedImpact, &'a Impact);

/// Formats a duration to three digits.
fn duration(seconds: f64) -> String {
    let unit = match seconds {
        _ if seconds < 1e-3 => "us",
        _ if seconds < 1.0 => "ms",
        _ => "s",
    };
    value::quantity(seconds, unit, 3)
}

/// Formats a speed to three digits.
fn speed(speed: f64) -> String {
    value::quantity(speed, "mm/s", 3)
}

/// Why the restitution of an impact may differ from that of its law.
fn remark(impact: &Impact) -> &'static str {
    match (impact.disturbed, impact.below_speed_floor) {
        (true, _) if impact.achieved() > 1.0 => "left faster: another contact or a change meanwhile",
        (true, _) => "another contact or a change meanwhile",
        (false, true) => "began below the impact speed floor",
        (false, false) => "",
    }
}

/// Cells of an impact's row.
fn cells(player: &Player, (number, _, impact): Listed<'_>) -> [String; COLUMNS.len()] {
    [
        number.to_string(),
        value::site(player.running(), impact.joint, impact.place),
        value::time(impact.start),
        duration(impact.end - impact.start),
        value::quantity(impact.peak, "N", 3),
        speed(impact.approach_speed),
        speed(impact.separation_speed),
        value::number(impact.achieved(), 3),
        value::number(impact.law, 3),
        remark(impact).to_owned(),
    ]
}

/// The value by which `column` sorts.
fn sorting_value((number, _, impact): &Listed<'_>, column: usize) -> f64 {
    match column {
        0 => *number as f64,
        1 => impact.joint as f64 + f64::from(impact.place) / 256.0,
        2 => impact.start,
        3 => impact.end - impact.start,
        4 => impact.peak,
        5 => impact.approach_speed,
        6 => impact.separation_speed,
        7 => impact.achieved(),
        8 => impact.law,
        _ => f64::from(u8::from(impact.disturbed) + u8::from(impact.disturbed || impact.below_speed_floor)),
    }
}

/// A row of cells with the column widths, `height` points high.
fn row(ui: &mut Ui, height: f32, mut cell: impl FnMut(&mut Ui, usize)) {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        for (index, Column { width, .. }) in COLUMNS.iter().enumerate() {
            ui.allocate_ui_with_layout(vec2(*width, height), Layout::left_to_right(Align::Center), |ui| {
                ui.set_width(*width);
                cell(ui, index);
            });
        }
    });
}

impl Order {
    /// The headings: a click sorts by the column, another one turns the order round.
    fn headings(&mut self, ui: &mut Ui, height: f32) {
        row(ui, height, |ui, index| {
            let Column { heading, help, .. } = COLUMNS[index];
            let sorts = self.column == index;
            ui.spacing_mut().button_padding.x = 0.0;
            let text = RichText::new(heading).small().strong();
            let heading_button = ui.add(Button::new(text).frame(false).min_size(vec2(0.0, height)));
            if sorts {
                // A triangle that points to where the values are smaller.
                let tip = heading_button.rect.right_center() + vec2(8.0, if self.falls { 3.0 } else { -3.0 });
                let foot = |side: f32| tip + vec2(3.5 * side, if self.falls { -6.0 } else { 6.0 });
                let fill = ui.visuals().strong_text_color();
                ui.painter().add(Shape::convex_polygon(vec![tip, foot(-1.0), foot(1.0)], fill, Stroke::NONE));
            }
            let sorted = match (sorts, self.falls) {
                (false, _) => None,
                (true, true) => Some(accesskit::SortDirection::Descending),
                (true, false) => Some(accesskit::SortDirection::Ascending),
            };
            ui.ctx().accesskit_node_builder(heading_button.id, |node| {
                node.set_label(format!("Sort by {}", if index == 0 { "number" } else { heading }));
                if let Some(direction) = sorted {
                    node.set_sort_direction(direction);
                }
            });
            if heading_button.on_hover_text(format!("{help}. A click sorts by it")).clicked() {
                *self = Self { column: index, falls: !(sorts && self.falls) };
            }
        });
    }
}

impl ImpactList {
    /// The table in the rest of `ui`. Returns the instant of a clicked row, s.
    fn table(&mut self, ui: &mut Ui, player: &Player) -> Option<f64> {
        let row_height = if theme::has_fingers(ui) { ROW_HEIGHTS.1 } else { ROW_HEIGHTS.0 };
        let reached = player.reached();
        let known = self.held.map_or(reached, |held| held.min(reached));
        let shown = player.pacer.shown();
        let record = player.impact_record();
        let mut clicked_time = None;
        ui.spacing_mut().interact_size.y = row_height;
        ui.spacing_mut().item_spacing.y = 0.0;
        let width = COLUMNS.iter().map(|column| column.width + 4.0).sum::<f32>();
        let sideways = ScrollArea::horizontal().id_salt("impacts sideways").auto_shrink([false, false]);
        let whole = sideways.show(ui, |ui| {
            ui.set_min_width(width);
            self.order.headings(ui, ROW_HEIGHTS.0.max(0.75 * row_height));
            ui.separator();
            let Order { column, falls } = self.order;
            let count = record.until(known).count();
            if count == 0 {
                ui.label(RichText::new("No impact has ended yet").weak());
                return;
            }
            let mut all: Vec<Listed<'_>> = Vec::new();
            if column > 0 {
                all.extend(record.until(known));
                all.sort_by(|a, b| {
                    let order = sorting_value(a, column).total_cmp(&sorting_value(b, column));
                    if falls { order.reverse() } else { order }
                });
            }
            let listed = |rows: std::ops::Range<usize>| -> Vec<Listed<'_>> {
                match (column, falls) {
                    (0, true) => record.until(known).rev().skip(rows.start).take(rows.len()).collect(),
                    (0, false) => record.until(known).skip(rows.start).take(rows.len()).collect(),
                    _ => all[rows].to_vec(),
                }
            };
            let place = ScrollArea::vertical().id_salt("impacts").auto_shrink([false, false]);
            place.show_rows(ui, row_height, count, |ui, rows| {
                for impact in listed(rows) {
                    let (number, own, _) = impact;
                    let words = cells(player, impact);
                    let later = own.end > shown;
                    let top = ui.cursor().min;
                    let place = egui::Rect::from_min_size(top, vec2(width, row_height));
                    let response = ui.interact(place, ui.scope_id().with(("impact", number)), Sense::click());
                    let hovered = response.hovered();
                    if hovered || response.has_focus() {
                        ui.painter().rect_filled(place, 3.0, ui.visuals().widgets.hovered.weak_bg_fill);
                    }
                    let all = format!("Impact {}", words.join(", "));
                    let all = all.trim_end_matches(", ");
                    response.widget_info(|| WidgetInfo::labeled(egui::Role::Button, true, all));
                    if response.on_hover_text("Go to its peak").clicked() {
                        clicked_time = Some(own.force_peak.time);
                    }
                    row(ui, row_height, |ui, index| {
                        let mut text = RichText::new(&words[index]).small();
                        if later && !hovered {
                            text = text.weak();
                        }
                        ui.add(Label::new(text).truncate().selectable(false));
                    });
                }
            });
        });
        let is_pointed_at = ui.rect_contains_pointer(whole.inner_rect);
        self.held = is_pointed_at.then_some(self.held.unwrap_or(reached));
        clicked_time
    }

    /// Shows or closes it.
    pub fn toggle(&mut self) {
        self.open = !self.open;
    }

    /// Closes it; returns whether it was shown.
    pub fn close(&mut self) -> bool {
        std::mem::take(&mut self.open)
    }

    /// Whether it is shown.
    pub fn is_open(&self) -> bool {
        self.open
    }

    /// The switch in the view menu.
    pub fn switch(&mut self, ui: &mut Ui) {
        ui.checkbox(&mut self.open, "Impact list").on_hover_text(
            "A row for each impact: time, duration, peak force, approach and rebound speed, restitution (key I)",
        );
    }
}

impl Run {
    /// The list at the lower edge of `ui`, which leaves the rest to the picture. Returns whether to save the impacts.
    pub(super) fn impact_list_ui(&mut self, ui: &mut Ui, is_free: bool) -> bool {
        if !self.impact_list.open {
            return false;
        }
        let (mut clicked_time, mut save, mut close) = (None, false, false);
        let fingers = theme::has_fingers(ui);
        let row_height = if fingers { ROW_HEIGHTS.1 } else { ROW_HEIGHTS.0 };
        let most = MAX_SHARE * ui.available_height();
        let height = (ui.spacing().interact_size.y + 50.0 + FIRST_ROWS * row_height).min(most);
        let frame = theme::panel(ui).inner_margin(egui::Margin::symmetric(12, 6));
        Panel::bottom("impact list")
            .frame(frame)
            .resizable(!fingers)
            .default_size(height)
            .size_range(height.min(100.0)..=most)
            .show(ui, |ui| {
                spoken::landmark(ui, "Impacts");
                ui.add_enabled_ui(is_free, |ui| {
                    ui.horizontal(|ui| {
                        spoken::heading(&ui.label(RichText::new("Impacts").strong()), "Impacts");
                        let hardest = self.player.impact_record().hardest(self.player.reached());
                        let button = ui.add_enabled(hardest.is_some(), Button::new("Hardest impact"));
                        if button.on_hover_text(HARDEST_HELP).clicked()
                            && let Some((_, own)) = hardest
                        {
                            self.plots.show_around(own);
                            clicked_time = Some(own.force_peak.time);
                        }
                        let help = "All of them, CSV, with the columns of `run --impacts`";
                        save = ui.button("Save impacts…").on_hover_text(help).clicked();
                        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                            close = ui.button("Close").on_hover_text("Close the list (Esc, key I)").clicked();
                            let dropped = self.player.impact_record().dropped();
                            if dropped > 0 {
                                let words = format!("The first {dropped} impacts are no longer stored");
                                ui.add(Label::new(RichText::new(words).small().weak()).truncate());
                            } else if self.impact_list.held.is_some_and(|held| held < self.player.reached()) {
                                let words = "Newer impacts follow when the pointer leaves the list";
                                ui.add(Label::new(RichText::new(words).small().weak()).truncate());
                            }
                        });
                    });
                    clicked_time = self.impact_list.table(ui, &self.player).or(clicked_time);
                });
            });
        self.impact_list.open = !close;
        if let Some(time) = clicked_time {
            self.show_instant(time);
        }
        save
    }

    /// One line about the impact at the displayed instant, e.g. after `>>` or `<<`. `None` during playback and in a film, whose
    /// frames are not instants chosen by the user.
    pub fn impact_badge(&self, is_filmed: bool) -> Option<String> {
        let player = &self.player;
        if player.is_playing() || is_filmed {
            return None;
        }
        let shown = player.pacer.shown();
        let record = player.impact_record();
        // The impact of the followed joint, while that is in contact.
        let touches =
            |joint: &usize| player.frame().joints.get(*joint).is_some_and(|own| own.state != ContactMode::Free);
        let (number, own) = record.in_progress(self.viewport.focus().filter(touches), shown)?;
        let report = player.frame().joints.get(own.joint)?;
        let site = value::site(player.running(), own.joint, own.place);
        let onset = format!("Impact {number}, {site}: {}", value::time(own.start));
        if shown < own.force_peak.time {
            // What comes is not told.
            let now = value::quantity(report.normal_force.norm(), "N", 3);
            return Some(format!("{onset}, force now {now}"));
        }
        let peak = value::quantity(own.force_peak.force.norm(), "N", 3);
        Some(match own.finished() {
            // The peak is told once it has been reached.
            _ if own.force_peak.time > shown => format!("{onset}, before its peak"),
            Some(impact) => format!(
                "{onset}, peak {peak}, {}, approach {}, rebound {}",
                duration(impact.end - impact.start),
                speed(impact.approach_speed),
                speed(impact.separation_speed)
            ),
            // A change may have removed the wall.
            None if report.state == ContactMode::Free => return None,
            None => format!("{onset}, peak {peak}, stays in contact"),
        })
    }
}

/// Files with the impacts up to the displayed instant.
pub fn files(player: &Player) -> Vec<SaveFile> {
    let mut text = impact_row::COLUMNS.join(",");
    text.push('\n');
    let mut rows = 0;
    for (_, _, impact) in player.impact_record().until(player.pacer.shown()) {
        rows += 1;
        let values = impact_row::row(impact).map(|value| value.to_string());
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{}", values.join(","));
    }
    let joints = player.running().machine.loose_joints.iter();
    let names: Vec<&str> = joints.clone().map(|joint| joint.name.as_str()).collect();
    let extra = [
        ("rows", json!(rows)),
        // Indices in the column `joint` start at 0.
        ("ball_joints", json!(names)),
        // By joint, the names of the indices in the column `site`.
        ("sites", joints.map(|joint| json!(joint.sites())).collect()),
        ("impacts_no_longer_kept", json!(player.impact_record().dropped())),
    ];
    let name = format!("{}-impacts.csv", file_stem(player));
    let meta = meta(player, extra);
    vec![
        SaveFile { name: name.clone(), mime: "text/csv", bytes: text.into_bytes() },
        SaveFile { name: format!("{name}.meta.json"), mime: "application/json", bytes: meta.into_bytes() },
    ]
}
