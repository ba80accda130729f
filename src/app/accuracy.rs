//! How far the numbers on show can be trusted: what the preset was measured to do, and how the running scene does.

use eframe::egui::{Label, ProgressBar, RichText, Ui, vec2};

use super::host::{Host, Running};
use super::player::Player;
use super::value;
use crate::analysis::presets::{self, Measured};
use crate::analysis::task::{Job, Message, SceneSource};
use crate::scene::{Preset, Value};
use crate::simulate::Impact;

/// Width of the names, points.
const LABELS: f32 = 122.0;
/// Fewer steps than this do not resolve an impact.
const STEPS_OF_AN_IMPACT: u64 = 10;
/// Error beyond which a measured preset is to be doubted.
const DOUBTFUL_ERROR: f64 = 0.05;
/// Share of the exchanged energy beyond which the balance is out.
const BALANCED: f64 = 1e-3;

/// A row: what it is, its value, whether that is reason for doubt, and what to know about it.
struct Row {
    label: &'static str,
    value: String,
    doubtful: bool,
    help: String,
}

impl Row {
    fn ui(&self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            let height = ui.spacing().interact_size.y * 0.8;
            ui.allocate_ui(vec2(LABELS, height), |ui| {
                ui.set_width(LABELS);
                ui.label(self.label).on_hover_text(&self.help);
            });
            let mut text = RichText::new(&self.value);
            if self.doubtful {
                text = text.color(ui.visuals().warn_fg_color).strong();
            }
            ui.add(Label::new(text).truncate())
                .on_hover_text(&self.help);
        });
    }
}

/// What the preset was measured to do on a scene.
struct Found {
    scene: SceneSource,
    preset: Preset,
    measured: Measured,
}

/// The panel: a measurement under way, and the latest one.
#[derive(Default)]
pub struct Accuracy {
    asked: Option<(Job, SceneSource, Preset)>,
    running: Option<(Box<dyn Running>, SceneSource, Preset)>,
    progress: f64,
    found: Option<Found>,
    problem: Option<String>,
}

impl Accuracy {
    /// Starts what was asked for, and takes in what a measurement said; whether one is under way.
    pub fn update(&mut self, host: &mut dyn Host) -> bool {
        if let Some((job, scene, preset)) = self.asked.take() {
            self.progress = 0.0;
            self.problem = None;
            match host.start(job) {
                Some(running) => self.running = Some((running, scene, preset)),
                None => self.problem = Some("It cannot be measured here".to_owned()),
            }
        }
        while let Some((running, scene, preset)) = &mut self.running {
            match running.poll() {
                None => return true,
                Some(Message::Progress(done)) => self.progress = done,
                Some(Message::Presets(list)) => {
                    self.found = list.first().map(|(_, measured)| Found {
                        scene: scene.clone(),
                        preset: *preset,
                        measured: *measured,
                    });
                }
                Some(Message::Done) => self.running = None,
                Some(Message::Ranges(_) | Message::Point(_)) => {}
                Some(Message::Failed(why)) => {
                    self.problem = Some(why);
                    self.running = None;
                }
            }
        }
        false
    }

    /// Everything below the choice of the preset.
    pub fn ui(&mut self, ui: &mut Ui, player: &Player) {
        let preset = preset_of(player);
        let mut list = vec![solver(player, preset)];
        if let Some(preset) = preset {
            list.extend(self.measured(player, preset));
        }
        list.extend(rows(player));
        for row in list {
            row.ui(ui);
        }
        if let Some(preset) = preset {
            self.measure_ui(ui, player, preset);
        }
        // What a control says already is not said again.
        let said = player.warnings();
        let doubts = player.simulation().doubts().into_iter();
        let doubts = doubts.map(|doubt| doubt.to_string());
        for doubt in doubts.filter(|doubt| !said.contains(doubt)) {
            let words = RichText::new(value::typeset(&doubt)).small();
            ui.label(words.color(ui.visuals().warn_fg_color));
        }
    }

    fn measure_ui(&mut self, ui: &mut Ui, player: &Player, preset: Preset) {
        if self.running.is_some() {
            ui.horizontal(|ui| {
                if ui
                    .button("Cancel")
                    .on_hover_text("End the measurement")
                    .clicked()
                {
                    self.running = None;
                }
                ui.add(
                    ProgressBar::new(self.progress as f32)
                        .show_percentage()
                        .desired_width(ui.available_width()),
                )
                .accessible_name("Measured so far");
            });
        } else if ui
            .button("Measure preset")
            .on_hover_text(
                "Runs this scene with its present values under the preset and under a reference that is converged, beside the \
                 running one, and compares forces and speed. Takes seconds.",
            )
            .clicked()
        {
            let scene = model_of(player);
            let job = Job::Presets {
                scene: scene.clone(),
                presets: vec![preset.word().to_owned()],
            };
            self.asked = Some((job, scene, preset));
        }
        if let Some(problem) = &self.problem {
            ui.label(
                RichText::new(problem)
                    .small()
                    .color(ui.visuals().error_fg_color),
            );
        }
    }

    /// What `preset` was measured to do on the scene as it is.
    fn measured(&self, player: &Player, preset: Preset) -> Vec<Row> {
        let scene = model_of(player);
        let own = self.found.as_ref();
        let here = own.filter(|found| found.preset == preset && found.scene == scene);
        let (measured, place) = match here {
            Some(found) => (
                Some(found.measured),
                "on this scene with its present values",
            ),
            None if scene.changes.is_empty() && player.wanted().source.file.is_none() => (
                presets::measured(&player.wanted().name, preset),
                "on this scene as it comes with the program",
            ),
            None => (None, ""),
        };
        let row = |label, error: Option<f64>, what: &str| Row {
            label,
            value: match (&measured, error) {
                (None, _) => "not measured".to_owned(),
                (Some(_), None) => "does not apply".to_owned(),
                (Some(_), Some(error)) => value::percent(error),
            },
            doubtful: error.is_some_and(|error| error > DOUBTFUL_ERROR),
            help: match measured {
                None => {
                    format!("{what} It was not measured for these values: press Measure preset.")
                }
                Some(_) => format!("{what} Measured {place}, against a converged run."),
            },
        };
        vec![
            row(
                "Peak force error",
                measured.and_then(|m| m.peak_error),
                "Largest relative error of the peak forces of the first six impacts under this preset.",
            ),
            row(
                "Settled force error",
                measured.and_then(|m| m.settled_error),
                "Largest relative error of the mean contact forces in settled motion under this preset; does not apply where \
                 the motion does not settle soon.",
            ),
        ]
    }
}

/// The preset whose method and tolerance are in force, chosen by its name or not.
pub fn preset_of(player: &Player) -> Option<Preset> {
    let solver = &player.wanted().solver;
    let is = |preset: &Preset| {
        let (method, step, tolerance) = preset.point();
        method == solver.method
            && if method.is_adaptive() {
                tolerance == solver.tolerance
            } else {
                step == solver.step
            }
    };
    let chosen = solver.preset.filter(|preset| is(preset));
    chosen.or_else(|| Preset::ALL.into_iter().find(is))
}

/// The scene with what makes its motion, without choices of solver and view.
fn model_of(player: &Player) -> SceneSource {
    let mut scene = SceneSource::of(player.wanted());
    let kept = |key: &str| !key.starts_with("solver.") && !key.starts_with("view.");
    scene.changes.retain(|(key, _)| kept(key));
    scene
}

fn rows(player: &Player) -> Vec<Row> {
    let mut rows = vec![capacity(player)];
    if let Some(impact) = player.simulation().impacts().next_back() {
        rows.push(steps(player, impact));
        rows.push(restitution(player, impact));
        rows.extend(flags(impact));
    }
    rows.extend(residual(player));
    rows
}

/// Name of a ball joint.
fn joint(player: &Player, index: usize) -> &str {
    let joints = &player.scene().ball_joints;
    joints.get(index).map_or("", |joint| &joint.name)
}

fn solver(player: &Player, preset: Option<Preset>) -> Row {
    let solver = &player.wanted().solver;
    let method = match player.wanted().get("solver.method") {
        Ok(Value::Choice(word)) => word,
        _ => "",
    };
    let size = if solver.method.is_adaptive() {
        value::power_of_ten(solver.tolerance)
    } else {
        value::quantity(solver.step, "us", 6)
    };
    let name = preset.map_or_else(
        || "no preset".to_owned(),
        |preset| format!("what the preset {} has", preset.word()),
    );
    Row {
        label: "Runs with",
        value: format!("{method} {size}"),
        doubtful: false,
        help: format!(
            "Method with its tolerance, or its fixed step: {name}. They stand under Solver; a measured error is given for presets \
             only."
        ),
    }
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
    let help = format!(
        "Separation speed over approach speed of the latest impact, in {}: asked for {}, an undisturbed impact under its \
         normal-force law gives {}.",
        joint(player, impact.joint),
        value::number(impact.asked, 3),
        value::number(impact.law, 3),
    );
    Row {
        label: "Its restitution",
        value: format!(
            "{} of {}",
            value::number(given, 3),
            value::number(impact.asked, 3)
        ),
        // An impact that nothing disturbed gives what its law gives, or else the steps were too long.
        doubtful: !impact.disturbed && !impact.floored && (given - impact.law).abs() > 0.02,
        help,
    }
}

/// Why the restitution of an impact is not its law's.
fn flags(impact: &Impact) -> Option<Row> {
    let (value, help) = match (impact.disturbed, impact.floored) {
        (true, _) => (
            "disturbed",
            "Another joint touched meanwhile, or the parameters of the contact changed: the ratio is not the law's alone.",
        ),
        (false, true) => (
            "slow",
            "The impact began slower than the impact speed floor, so it rebounds higher than asked.",
        ),
        (false, false) => return None,
    };
    Some(Row {
        label: "",
        value: value.to_owned(),
        doubtful: false,
        help: help.to_owned(),
    })
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
            value::quantity(ledger.exchanged, "J", 3),
            value::power_of_ten(BALANCED)
        ),
    })
}
