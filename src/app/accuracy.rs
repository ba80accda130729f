//! Reliability of the displayed numbers: accuracy of the preset as measured, and indicators of the running scene.

use eframe::egui::{Label, RichText, Ui, vec2};

use super::layout::reserve_lines;
use super::player::Player;
use super::{theme, value};
use crate::analysis::presets;
use crate::machine::{Preset, Solver};
use crate::simulate::Impact;

/// Width of the labels, points.
const LABEL_WIDTH: f32 = 138.0;
/// Height of a row, points, and lines reserved for doubts.
const ROW_HEIGHT: f32 = 20.0;
const DOUBT_LINES: usize = 3;
/// Placeholder before the first impact.
const PLACEHOLDER: &str = "—";
/// Minimum number of steps to resolve an impact.
const MIN_STEPS_PER_IMPACT: u64 = 10;
/// Error above which a measured preset is doubtful.
const DOUBTFUL_ERROR: f64 = 0.05;
/// Energy residual, relative to stored and dissipated energy, above which the balance is doubtful.
const MAX_RESIDUAL: f64 = 1e-3;

/// A row: label, value, whether the value is doubtful, and tooltip. The set of rows is fixed, so that nothing moves during
/// playback.
struct AccuracyLine {
    label: &'static str,
    value: String,
    doubtful: bool,
    help: String,
}

impl AccuracyLine {
    fn ui(&self, ui: &mut Ui) {
        // Not a control; needs no touch height.
        ui.spacing_mut().interact_size.y = ROW_HEIGHT;
        ui.horizontal(|ui| {
            ui.allocate_ui(vec2(LABEL_WIDTH, ROW_HEIGHT), |ui| {
                ui.set_width(LABEL_WIDTH);
                ui.label(self.label).on_hover_text(&self.help);
            });
            let mut text = RichText::new(&self.value);
            if self.doubtful {
                text = text.color(ui.visuals().warn_fg_color).strong();
            }
            ui.add(Label::new(text).truncate()).on_hover_text(&self.help);
        });
    }
}

/// The panel below the selection of the preset.
pub fn ui(ui: &mut Ui, player: &Player) {
    let preset = player.pending().machine.solver.preset;
    let mut list = vec![solver(player, preset)];
    list.extend(measured(player, preset));
    list.push(capacity(player));
    list.extend(latest_impact(player));
    list.push(residual(player));
    ui.scope(|ui| list.iter().for_each(|row| row.ui(ui)));
    doubts_ui(ui, player);
}

/// Reasons to doubt the result, in a space of fixed height.
fn doubts_ui(ui: &mut Ui, player: &Player) {
    // A doubt already shown beside a control is not repeated.
    let already_shown: Vec<&str> = player.warnings().collect();
    let doubts = player.simulation().doubts().into_iter();
    let mut doubts: Vec<String> = doubts.map(|doubt| doubt.to_string()).collect();
    let none =
        if doubts.is_empty() { "No warnings so far" } else { "No warnings other than those beside the controls" };
    doubts.retain(|doubt| !already_shown.contains(&&**doubt));
    reserve_lines(ui, "doubts", DOUBT_LINES, |ui| {
        for doubt in &doubts {
            theme::warning(ui, value::typeset(doubt));
        }
        if doubts.is_empty() {
            ui.label(RichText::new(none).small().weak())
                .on_hover_text("Reasons to doubt the numbers, if there are any");
        }
    });
}

/// Measured accuracy of `preset`, or of the default method, on the present scene: on a built-in one with its default values.
fn measured(player: &Player, preset: Option<Preset>) -> [AccuracyLine; 2] {
    let scene = player.pending();
    let affects_model = |key: &str| !key.starts_with("solver.") && !key.starts_with("view.");
    let is_built_in = scene.source.file.is_none() && !scene.changes.iter().any(|(key, _)| affects_model(key));
    let (solver, default) = (&scene.machine.solver, Solver::default());
    let is_default = (solver.method, solver.tolerance) == (default.method, default.tolerance);
    let word = preset.map(Preset::word).or_else(|| is_default.then_some(presets::DEFAULT));
    let measured = word.filter(|_| is_built_in).and_then(|word| presets::measured(&scene.name, word));
    let row = |label, error: Option<f64>, what: &str| AccuracyLine {
        label,
        value: match (&measured, error) {
            (None, _) if word.is_none() => "no preset".to_owned(),
            (None, _) => "not measured".to_owned(),
            (Some(_), None) => "does not apply".to_owned(),
            (Some(_), Some(error)) => value::percent(error),
        },
        doubtful: error.is_some_and(|error| error > DOUBTFUL_ERROR),
        help: match measured {
            None if word.is_none() => what.to_owned(),
            None => {
                format!("{what} It was not measured for these values: `jointplay tradeoff` does it for any scene file.")
            }
            Some(_) => {
                format!("{what} Measured on this built-in scene with its default values, against a converged run.")
            }
        },
    };
    [
        row(
            "Peak force error",
            measured.and_then(|m| m.peak_error),
            "Largest relative error of the peak forces of the first six impacts with these settings of the solver.",
        ),
        row(
            "Settled force error",
            measured.and_then(|m| m.settled_error),
            "Largest relative error of the mean contact forces in settled motion with these settings of the solver; does not \
             apply where the motion does not settle soon.",
        ),
    ]
}

fn solver(player: &Player, preset: Option<Preset>) -> AccuracyLine {
    let name = preset.map_or_else(|| "no preset".to_owned(), |preset| format!("those of the preset {}", preset.word()));
    AccuracyLine {
        label: "Runs with",
        value: value::solver(player.pending()),
        doubtful: false,
        help: format!(
            "Method with its tolerance, or its fixed step: {name}. They are set under Solver; a measured error is given for presets \
             and the default only."
        ),
    }
}

fn capacity(player: &Player) -> AccuracyLine {
    let (value, doubtful) = match player.capacity() {
        Some(ratio) => (format!("{} × real time", value::number(ratio, 2)), ratio < player.pacer.scale()),
        None => ("not measured yet".to_owned(), false),
    };
    AccuracyLine {
        label: "Can run at",
        value,
        doubtful,
        help: "Simulated seconds per second of stepping on this machine, recording of the plots included, over the latest \
               second of stepping. Amber where it is less than the time scale asks for."
            .to_owned(),
    }
}

/// The latest impact: joint, resolution, and restitution.
fn latest_impact(player: &Player) -> [AccuracyLine; 3] {
    let impact = player.impact_record().last_ended(player.pacer.shown(), f64::INFINITY);
    let row = |label, value: Option<String>, doubtful, help: String| AccuracyLine {
        label,
        value: value.unwrap_or_else(|| PLACEHOLDER.to_owned()),
        doubtful,
        help,
    };
    let what = impact.map_or_else(
        || "none yet".to_owned(),
        |impact| format!("{}, {}", value::site(player.running(), impact.joint, impact.place), kind(impact)),
    );
    let ratio = |impact: &Impact| {
        let [measured, requested] = [impact.achieved(), impact.requested].map(|ratio| value::number(ratio, 3));
        // Only an undisturbed impact is comparable with the requested value.
        if impact.has_own_restitution() { format!("{measured}, asked {requested}") } else { measured }
    };
    let law = impact.map_or_else(String::new, |impact| {
        format!(" An undisturbed impact under its normal-force law gives {}.", value::number(impact.law, 3))
    });
    [
        row(
            "Latest impact",
            Some(what),
            false,
            "Joint of the latest impact that has ended. Disturbed: another joint was in contact meanwhile, or \
             the parameters of the \
             contact changed, so that the ratio of the speeds is not the law's alone. Slow: it began below the impact speed \
             floor, so it rebounds higher than asked. Soft: weight and drives did more than a hundredth of its energy as work \
             while it lasted. Undisturbed: none of these."
                .to_owned(),
        ),
        row(
            "Steps during impact",
            impact.map(|impact| impact.steps.to_string()),
            impact.is_some_and(|impact| impact.steps < MIN_STEPS_PER_IMPACT),
            format!(
                "Steps of the solver from the beginning to the end of the latest impact. Fewer than {MIN_STEPS_PER_IMPACT} \
                 (amber) do not resolve its force (19)."
            ),
        ),
        row(
            "Measured restitution",
            impact.map(ratio),
            // It has the law's restitution unless the steps were too long.
            impact.is_some_and(|impact| impact.has_own_restitution() && (impact.achieved() - impact.law).abs() > 0.02),
            format!(
                "Separation speed over approach speed of the latest impact, and what was asked for if it was undisturbed.{law} \
                 Amber: it is further than 0.02 from that, by too few steps or by friction."
            ),
        ),
    ]
}

/// Kind of an impact; only an undisturbed one has its law's restitution.
fn kind(impact: &Impact) -> &'static str {
    match (impact.disturbed, impact.below_speed_floor, impact.is_soft()) {
        (true, ..) => "disturbed",
        (_, true, _) => "slow",
        (_, _, true) => "soft",
        _ => "undisturbed",
    }
}

fn residual(player: &Player) -> AccuracyLine {
    let ledger = player.frame().ledger;
    let share = ledger.map(|ledger| ledger.share());
    let exchanged = ledger.map_or_else(
        || "Not recorded: see Energy ledger under Solver.".to_owned(),
        |ledger| {
            let energy = value::quantity(ledger.exchanged, "J", 3);
            format!("{energy} were exchanged.")
        },
    );
    AccuracyLine {
        label: "Energy residual",
        value: share
            .map_or_else(|| PLACEHOLDER.to_owned(), |share| format!("{}, relative", value::power_of_ten(share))),
        doubtful: share.is_some_and(|share| share > MAX_RESIDUAL),
        help: format!(
            "Unaccounted energy since the start, relative to the largest energy that the machine held at once plus \
             its losses since then. {exchanged} Amber beyond {}.",
            value::power_of_ten(MAX_RESIDUAL)
        ),
    }
}
