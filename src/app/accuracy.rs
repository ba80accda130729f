//! How far the numbers on show can be trusted: what the preset was measured to do, and how the running scene does.

use eframe::egui::{Grid, RichText, Ui};

use super::player::Player;
use super::value;
use crate::simulate::Impact;

/// Fewer steps than this do not resolve an impact.
const STEPS_OF_AN_IMPACT: u64 = 10;
/// Share of the exchanged energy beyond which the balance is out.
const BALANCED: f64 = 1e-3;

/// A row: what it is, its value, whether that is reason for doubt, and what to know about it.
struct Row {
    label: &'static str,
    value: String,
    doubtful: bool,
    help: String,
}

/// The rows about the running scene.
pub fn ui(ui: &mut Ui, player: &Player) {
    Grid::new("accuracy")
        .num_columns(2)
        .spacing([12.0, 4.0])
        .show(ui, |ui| {
            for row in rows(player) {
                ui.label(row.label).on_hover_text(&row.help);
                let mut text = RichText::new(&row.value);
                if row.doubtful {
                    text = text.color(ui.visuals().warn_fg_color).strong();
                }
                ui.label(text).on_hover_text(&row.help);
                ui.end_row();
            }
        });
}

fn rows(player: &Player) -> Vec<Row> {
    let mut rows = vec![capacity(player)];
    if let Some(impact) = player.simulation().impacts().next_back() {
        rows.push(steps(player, impact));
        rows.push(restitution(player, impact));
    }
    rows.extend(residual(player));
    rows
}

/// Name of a ball joint.
fn joint(player: &Player, index: usize) -> &str {
    let joints = &player.scene().ball_joints;
    joints.get(index).map_or("", |joint| &joint.name)
}

fn capacity(player: &Player) -> Row {
    let (value, doubtful) = match player.capacity() {
        Some(ratio) => (
            format!("{} × real time", value::number(ratio, 2)),
            ratio < player.pacer.scale(),
        ),
        None => ("not measured yet".to_owned(), false),
    };
    Row {
        label: "Can run at",
        value,
        doubtful,
        help: "Simulated seconds per second of stepping on this machine, recording of the plots included, over the latest \
               second of stepping. Amber where it is less than the time scale asks for."
            .to_owned(),
    }
}

fn steps(player: &Player, impact: &Impact) -> Row {
    Row {
        label: "Steps in last impact",
        value: format!("{} ({})", impact.steps, joint(player, impact.joint)),
        doubtful: impact.steps < STEPS_OF_AN_IMPACT,
        help: format!(
            "Steps of the solver from the beginning to the end of the latest impact, and the ball joint that it was in. \
             Fewer than {STEPS_OF_AN_IMPACT} (amber) do not resolve its force (19)."
        ),
    }
}

fn restitution(player: &Player, impact: &Impact) -> Row {
    let given = impact.given();
    let mut help = format!(
        "Separation speed over approach speed of the latest impact, in {}: asked for {}, an undisturbed impact under its \
         normal-force law gives {}.",
        joint(player, impact.joint),
        value::number(impact.asked, 3),
        value::number(impact.law, 3),
    );
    if impact.disturbed {
        help.push_str(" Another joint touched meanwhile, or its parameters changed: the ratio is not the law's alone.");
    }
    if impact.floored {
        help.push_str(
            " It began slower than the impact speed floor, so it rebounds higher than asked.",
        );
    }
    let note = match (impact.disturbed, impact.floored) {
        (true, _) => ", disturbed",
        (false, true) => ", slow",
        (false, false) => "",
    };
    Row {
        label: "Its restitution",
        value: format!(
            "{} of {}{note}",
            value::number(given, 3),
            value::number(impact.asked, 3)
        ),
        // An impact that nothing disturbed gives what its law gives, or else the steps were too long.
        doubtful: !impact.disturbed && !impact.floored && (given - impact.law).abs() > 0.02,
        help,
    }
}

fn residual(player: &Player) -> Option<Row> {
    let ledger = player.frame().ledger?;
    let share = ledger.relative_residual().abs();
    Some(Row {
        label: "Energy residual",
        value: format!("{} of exchanged", value::power_of_ten(share)),
        doubtful: share > BALANCED,
        help: format!(
            "Energy that the ledger cannot account for since the start, over the energy exchanged ({}). Amber beyond {}.",
            crate::scene::format_quantity_digits(ledger.exchanged, "J", 3),
            value::power_of_ten(BALANCED)
        ),
    })
}
