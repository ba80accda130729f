//! The list of impacts: one row per finished impact, latest first; and the badge over the picture at an impact's instant.

use std::fmt::Write as _;

use eframe::egui::{self, Align, Label, Layout, RichText, ScrollArea, Sense, Ui, WidgetInfo, vec2};
use serde_json::json;

use super::files::{file_stem, meta};
use super::host::SaveFile;
use super::player::Player;
use super::run::Run;
use super::value;
use crate::analysis::impact_row;
use crate::simulate::{ContactMode, Impact};

/// Height of a row, points.
const ROW_HEIGHT: f32 = 20.0;
/// Most visible rows at first.
const MAX_VISIBLE_ROWS: f32 = 9.0;

/// Columns: heading, width in points, tooltip.
const COLUMNS: [(&str, f32, &str); 9] = [
    ("No.", 44.0, "Number of the impact in this run, in the order of their beginnings"),
    ("Joint", 58.0, "Ball joint"),
    ("Time", 82.0, "Instant at which it began"),
    ("Duration", 62.0, "From its beginning to its end"),
    ("Peak", 62.0, "Largest normal force"),
    ("Approach", 74.0, "Approach speed: penetration rate when it began"),
    ("Rebound", 74.0, "Rebound speed: minus the penetration rate when it ended"),
    ("Restitution", 70.0, "Rebound speed over approach speed"),
    (
        "Law",
        132.0,
        "Restitution that the normal-force law gives an undisturbed impact. Disturbed: another joint was in contact meanwhile or \
         a parameter changed, so the law alone does not set the ratio. Slow: it began below the impact speed floor and rebounds \
         higher.",
    ),
];

/// State of the panel.
#[derive(Default)]
pub struct ImpactList {
    open: bool,
    /// Height of the window without its rows in the latest frame, points.
    frame: f32,
}

/// Formats a duration to three digits.
fn duration(seconds: f64) -> String {
    let unit = match seconds {
        _ if seconds < 1e-3 => "us",
        _ if seconds < 1.0 => "ms",
        _ => "s",
    };
    value::quantity(seconds, unit, 3)
}

/// Formats a speed in mm/s to three digits, without unit.
fn millimetres(speed: f64) -> String {
    value::number(1e3 * speed, 3)
}

/// The law's coefficient of restitution, and why an impact's may differ.
fn law(impact: &Impact) -> String {
    let law = value::number(impact.law, 3);
    match (impact.disturbed, impact.below_speed_floor) {
        (true, _) => format!("{law}, disturbed"),
        (false, true) => format!("{law}, slow"),
        (false, false) => law,
    }
}

/// Cells of an impact's row.
fn cells(player: &Player, number: u64, impact: &Impact) -> [String; COLUMNS.len()] {
    [
        number.to_string(),
        joint(player, impact.joint),
        value::time(impact.start),
        duration(impact.end - impact.start),
        value::quantity(impact.peak, "N", 3),
        format!("{} mm/s", millimetres(impact.approach_speed)),
        format!("{} mm/s", millimetres(impact.separation_speed)),
        value::number(impact.achieved(), 3),
        law(impact),
    ]
}

fn joint(player: &Player, joint: usize) -> String {
    let joints = &player.running().machine.loose_joints;
    joints.get(joint).map_or_else(String::new, |joint| joint.name.clone())
}

/// A row of cells with the column widths.
fn row(ui: &mut Ui, mut cell: impl FnMut(&mut Ui, usize)) {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        for (index, (_, width, _)) in COLUMNS.iter().enumerate() {
            ui.allocate_ui_with_layout(vec2(*width, ROW_HEIGHT), Layout::left_to_right(Align::Center), |ui| {
                ui.set_width(*width);
                cell(ui, index);
            });
        }
    });
}

impl ImpactList {
    /// The table with rows up to `height`, points. Returns the instant of a clicked row, s, and the height of the rows.
    fn table(ui: &mut Ui, player: &Player, height: f32) -> (Option<f64>, f32) {
        let (shown, known) = (player.pacer.shown(), player.reached());
        let record = player.impact_record();
        let count = record.until(known).count();
        let (mut clicked_time, mut rows_height) = (None, 0.0);
        ui.spacing_mut().interact_size.y = ROW_HEIGHT;
        ui.spacing_mut().item_spacing.y = 0.0;
        let width = COLUMNS.iter().map(|(_, width, _)| width + 4.0).sum::<f32>();
        ScrollArea::horizontal().id_salt("impacts sideways").auto_shrink([false, true]).show(ui, |ui| {
            ui.set_min_width(width);
            row(ui, |ui, index| {
                let (heading, _, help) = COLUMNS[index];
                ui.label(RichText::new(heading).small().strong()).on_hover_text(help);
            });
            ui.separator();
            if count == 0 {
                ui.label(RichText::new("No impact has ended yet").weak());
                return;
            }
            let place = ScrollArea::vertical().id_salt("impacts").auto_shrink([false, true]);
            let place = place.max_height(height).min_scrolled_height(height);
            let output = place.show_rows(ui, ROW_HEIGHT, count, |ui, rows| {
                let visible = record.until(known).rev().skip(rows.start).take(rows.len());
                for (number, own, impact) in visible {
                    let words = cells(player, number, impact);
                    let later = impact.end > shown;
                    let top = ui.cursor().min;
                    let place = egui::Rect::from_min_size(top, vec2(width, ROW_HEIGHT));
                    let response = ui.interact(place, ui.scope_id().with(("impact", number)), Sense::click());
                    let hovered = response.hovered();
                    if hovered {
                        ui.painter().rect_filled(place, 3.0, ui.visuals().widgets.hovered.weak_bg_fill);
                    }
                    let all = format!("Impact {}", words.join(", "));
                    response.widget_info(|| WidgetInfo::labeled(egui::Role::Button, true, &all));
                    if response.on_hover_text("Go to its peak").clicked() {
                        clicked_time = Some(own.force_peak.time);
                    }
                    row(ui, |ui, index| {
                        let mut text = RichText::new(&words[index]).small();
                        if later && !hovered {
                            text = text.weak();
                        }
                        ui.add(Label::new(text).truncate().selectable(false));
                    });
                }
            });
            rows_height = output.inner_rect.height();
        });
        if record.dropped() > 0 {
            let words = format!("The first {} impacts are no longer stored", record.dropped());
            ui.label(RichText::new(words).small().weak());
        }
        (clicked_time, rows_height)
    }

    /// Shows or closes it.
    pub fn toggle(&mut self) {
        self.open = !self.open;
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
    /// The list, in a window over the lower left of the picture in `area`, never over the transport below it. Returns whether to
    /// save the impacts.
    pub(super) fn impact_list_ui(&mut self, ctx: &egui::Context, area: egui::Rect, is_free: bool) -> bool {
        let (mut open, mut clicked_time, mut save) = (self.impact_list.open, None, false);
        let room = egui::Rect::from_x_y_ranges(ctx.content_rect().x_range(), area.y_range());
        let rows = ((room.height() - self.impact_list.frame) / ROW_HEIGHT).floor().clamp(1.0, MAX_VISIBLE_ROWS);
        let mut rows_height = 0.0;
        let shown = egui::Window::new("Impacts")
            .id(egui::Id::unique("impact list"))
            .open(&mut open)
            .resizable([true, false])
            .collapsible(false)
            .pivot(egui::Align2::LEFT_BOTTOM)
            .default_pos(area.left_bottom() + vec2(10.0, -10.0))
            .default_width((area.width() - 40.0).clamp(220.0, 680.0))
            .constrain_to(room)
            .enabled(is_free)
            .show(ctx, |ui| {
                (clicked_time, rows_height) = ImpactList::table(ui, &self.player, rows * ROW_HEIGHT);
                ui.add_space(4.0);
                save = ui
                    .button("Save impacts…")
                    .on_hover_text("All of them, CSV, with the columns of `run --impacts`")
                    .clicked();
            });
        self.impact_list.open = open;
        if let Some(shown) = shown {
            let frame = shown.response.rect.height() - rows_height;
            if (frame - self.impact_list.frame).abs() > 0.5 {
                self.impact_list.frame = frame;
                ctx.request_repaint();
            }
        }
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
        // The impact of the followed ball joint, while that is in contact.
        let touches =
            |joint: &usize| player.frame().joints.get(*joint).is_some_and(|own| own.state != ContactMode::Free);
        let (number, own) = record.in_progress(self.viewport.focus().filter(touches), shown)?;
        let report = player.frame().joints.get(own.joint)?;
        let onset = format!("Impact {number}, {}: {}", joint(player, own.joint), value::time(own.start));
        if shown < own.force_peak.time {
            // What comes is not told.
            let now = value::quantity(report.normal_force.norm(), "N", 3);
            return Some(format!("{onset}, force now {now}"));
        }
        let peak = value::quantity(own.force_peak.force.norm(), "N", 3);
        Some(match own.finished() {
            Some(impact) => format!(
                "{onset}, peak {peak}, {}, approach {}, rebound {} mm/s",
                duration(impact.end - impact.start),
                millimetres(impact.approach_speed),
                millimetres(impact.separation_speed)
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
    let names: Vec<&str> = player.running().machine.loose_joints.iter().map(|joint| joint.name.as_str()).collect();
    let extra = [
        ("rows", json!(rows)),
        // Indices in the column `joint` start at 0.
        ("ball_joints", json!(names)),
        ("impacts_no_longer_kept", json!(player.impact_record().dropped())),
    ];
    let name = format!("{}-impacts.csv", file_stem(player));
    let meta = meta(player, extra);
    vec![
        SaveFile { name: name.clone(), mime: "text/csv", bytes: text.into_bytes() },
        SaveFile { name: format!("{name}.meta.json"), mime: "application/json", bytes: meta.into_bytes() },
    ]
}
