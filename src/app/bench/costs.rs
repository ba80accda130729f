//! What play costs: how far an output moves with the play of each joint alone, as a tornado that fills while it is computed.

use std::sync::Arc;

use eframe::egui::{Align, ComboBox, DragValue, RichText, Ui};

use super::computation::Computation;
use super::cost_study::{CostSettings, CostStudy, VariedParameter};
use super::tornado::Tornado;
use crate::analysis::one_at_a_time_task::OneAtATimeTask;
use crate::analysis::study::NAMED;
use crate::analysis::task::{Job, Message};
use crate::app::command::Command;
use crate::app::host::Host;
use crate::app::layout::reserve_lines;
use crate::app::player::Player;
use crate::app::{field, theme, value};
use crate::scene::{Kind, Scene, Value};
use crate::simulate::MAX_RUN_DURATION;
use crate::units::Dimension;

/// Largest part of a run that is a transient.
const MAX_TRANSIENT: f64 = 0.99;
/// Shortest run, s.
const MIN_DURATION: f64 = 1e-3;

/// The panel. It exists while it is open.
#[derive(Default)]
pub struct Costs {
    /// Whether it was asked and not drawn since.
    unseen: bool,
    /// Whether another panel takes its place while the results are retained.
    is_set_aside: bool,
    /// Text of the scene that the settings belong to.
    scene: Arc<str>,
    settings: Option<CostSettings>,
    pub(super) computation: Computation<OneAtATimeTask>,
    study: Option<CostStudy>,
    /// Index of the displayed output.
    output: usize,
    /// Whether to scroll to the tornado.
    reveal: bool,
    tornado: Tornado,
}

impl Costs {
    /// Whether it is still open: drawn since the last call, or set aside. A hidden panel computes nothing.
    pub fn was_shown(&mut self) -> bool {
        let drawn = !std::mem::replace(&mut self.unseen, true);
        if !drawn {
            self.computation.stop();
        }
        drawn || self.is_set_aside
    }

    /// Retains the results while another panel takes its place, until it is drawn again.
    pub fn set_aside(&mut self) {
        self.is_set_aside = true;
    }

    /// Whether another panel takes its place.
    pub fn is_set_aside(&self) -> bool {
        self.is_set_aside
    }

    /// The latest study.
    pub fn study(&self) -> Option<&CostStudy> {
        self.study.as_ref()
    }

    /// Starts a requested study and takes messages from a running one; returns whether one is running.
    pub fn update(&mut self, host: &mut dyn Host) -> bool {
        let Self { computation, study, output, tornado, .. } = self;
        let take = |task: &OneAtATimeTask, message| match message {
            Message::Plan(plan) => {
                // An output missing from the scene is replaced by the first available one.
                let has = |output: &usize| plan.units[*output].is_some();
                *output = Some(*output).filter(has).or((0..NAMED.len()).find(has)).unwrap_or_default();
                *study = Some(CostStudy::new(task.clone(), plan));
                tornado.clear();
            }
            Message::Run(run) => {
                if let Some(study) = study {
                    study.take(run);
                }
            }
            _ => {}
        };
        computation.update(host, "Runs", |task| 1 + 2 * task.over.len(), Job::OneAtATime, take, |_, why| why)
    }

    /// Settings, progress and tornado; returns the user's request to the run.
    pub fn ui(&mut self, ui: &mut Ui, player: &Player) -> Option<Command> {
        (self.unseen, self.is_set_aside) = (false, false);
        let scene = player.pending();
        if self.scene != scene.source.text {
            let output = self.output;
            *self = Self { scene: scene.source.text.clone(), output, ..Self::default() };
        }
        if scene.machine.loose_joints.is_empty() {
            ui.label(RichText::new("This scene has no joint with play").weak());
            return None;
        }
        ui.scope(|ui| {
            // All settings and the first bars fit on a phone.
            theme::use_dense_rows(ui);
            self.settings_ui(ui, scene);
        });
        let progress = ui.cursor().top();
        self.start_ui(ui, scene);
        let differences = self.study.as_ref().map_or_else(Vec::new, |study| study.differences(player));
        reserve_lines(ui, "costs say", 3, |ui| self.state_ui(ui, &differences));
        let study = self.study.as_ref()?;
        let choice = ui.cursor().top();
        output_ui(ui, &mut self.output, study);
        let verdict = study.verdict(self.output);
        reserve_lines(ui, "verdict", 3, |ui| match &verdict {
            Some(verdict) if differences.is_empty() => drop(ui.label(RichText::new(verdict).strong())),
            Some(verdict) => drop(ui.label(RichText::new(format!("At the earlier setting: {verdict}")).weak())),
            None => drop(
                ui.label(RichText::new("Which value matters most is said once all runs are finished").small().weak()),
            ),
        });
        let tornado = ui.cursor().top();
        let clicked = self.tornado.ui(ui, study, self.output, player, !differences.is_empty());
        if self.reveal && self.computation.has_current_results() {
            self.reveal = false;
            let (all, room) = (ui.min_rect(), ui.clip_rect().height());
            let fits = [progress, choice, tornado].into_iter().find(|top| all.bottom() - top <= room);
            let rect = all.with_min_y(fits.unwrap_or(progress));
            ui.scroll_to_rect(rect, (rect.height() > room).then_some(Align::TOP));
        }
        let (input, end) = clicked?;
        let (key, ends) = &study.task.over[input];
        let text = study.parameter(input)?.write(&Value::Number(ends[end]));
        Some(Command::SetValue { key: key.clone(), text })
    }

    fn settings_ui(&mut self, ui: &mut Ui, scene: &Scene) {
        let settings = self.settings.get_or_insert_with(|| CostSettings::new(scene));
        ui.horizontal_wrapped(|ui| {
            ui.label("Vary");
            for VariedParameter { parameter, on, .. } in &mut settings.varied {
                let help = format!("Of each joint alone. {}", value::typeset(parameter.help));
                ui.checkbox(on, parameter.label).on_hover_text(help);
            }
        });
        ui.horizontal_wrapped(|ui| {
            ui.label("By");
            let part = "A part of the value that each joint has, as far as its parameter allows";
            ui.selectable_value(&mut settings.ranges, false, "Percent").on_hover_text(part);
            let range = "The same two values for every joint";
            ui.selectable_value(&mut settings.ranges, true, "Range").on_hover_text(range);
            if !settings.ranges {
                ui.add(DragValue::new(&mut settings.percent).range(1.0..=100.0).prefix("± ").suffix(" %"))
                    .on_hover_text(part)
                    .accessible_name("Part of each value");
            }
        });
        for VariedParameter { parameter, range, .. } in
            settings.varied.iter_mut().filter(|varied| settings.ranges && varied.on)
        {
            ui.horizontal_wrapped(|ui| {
                let Kind::Number { min, max, display, slider, dimension, .. } = parameter.kind else {
                    return;
                };
                ui.label(parameter.label).on_hover_text(value::typeset(parameter.help));
                let shown = |si| crate::units::to_display(si, display);
                for (end, word) in range.iter_mut().zip(["from", "to"]) {
                    ui.label(word);
                    let speed = 0.002 * (shown(slider.1) - shown(slider.0));
                    ui.add(field::quantity(end, dimension, display).range(shown(min)..=shown(max)).speed(speed))
                        .on_hover_text(format!("{}: {word} this value", parameter.label))
                        .accessible_name(format!("{} {word}", parameter.label));
                }
            });
        }
        ui.horizontal_wrapped(|ui| {
            let span = &mut settings.span;
            let mut time = |name: &str, time: &mut f64, range, help: &str| {
                ui.label(name);
                ui.add(field::quantity(time, Dimension::Time, "s").range(range).speed(0.01))
                    .on_hover_text(help)
                    .accessible_name(name);
            };
            let help = "Length of each run, from the scene's own start; at first three periods of its drives, or 1 s";
            time("Duration", &mut span.duration, MIN_DURATION..=MAX_RUN_DURATION, help);
            let help = "End of the transient: what happens before it does not count; energy is counted from the start";
            time("Observed from", &mut span.from, 0.0..=MAX_TRANSIENT * span.duration, help);
        });
    }

    fn start_ui(&mut self, ui: &mut Ui, scene: &Scene) {
        let start = [
            "Start runs",
            "Runs the scene with its current settings, then with each value alone at its lower and at its upper end, in the \
             background; the numbers are those of `./run lab sensitivity`",
        ];
        let stop = ["Stop runs", "Ends the computation; bars so far remain"];
        if self.computation.button(ui, start, stop, ["Computed so far", "runs"]) {
            let (requested, problem) = match self.settings.as_ref().map(|settings| settings.task(scene)) {
                Some(Ok(task)) => (Some(task), None),
                refused => (None, refused.and_then(Result::err)),
            };
            (self.computation.requested, self.computation.problem) = (requested, problem);
            self.reveal = self.computation.requested.is_some();
        }
    }

    /// The error message, or whether the tornado belongs to the current setting.
    fn state_ui(&self, ui: &mut Ui, differences: &[String]) {
        let weak = |ui: &mut Ui, words: String| ui.label(RichText::new(words).small().weak());
        if let Some(problem) = &self.computation.problem {
            theme::error(ui, value::typeset(problem));
            return;
        }
        match self.study.as_ref().filter(|_| self.computation.has_current_results()) {
            None if self.computation.is_running() => drop(weak(ui, "Starting…".to_owned())),
            None => drop(weak(ui, "No results yet".to_owned())),
            Some(_) if !differences.is_empty() => {
                let words = format!("Of an earlier setting. {}", differences.join("; "));
                theme::warning(ui, words).on_hover_text("Start the runs again for bars of the current setting");
            }
            Some(study) => {
                let (finished, all) = study.run_counts();
                let help = "Number of runs computed so far, all with the settings of the scene except for one value";
                weak(ui, format!("Of the current setting; {finished} of {all} runs")).on_hover_text(help);
            }
        }
    }
}

/// Selection of the displayed output.
fn output_ui(ui: &mut Ui, output: &mut usize, study: &CostStudy) {
    ui.horizontal(|ui| {
        ui.label("Effect on");
        ComboBox::from_id_salt("output")
            .selected_text(NAMED[*output].label)
            .show_ui(ui, |ui| {
                for (index, named) in NAMED.iter().enumerate() {
                    let has = study.plan.units[index].is_some();
                    ui.add_enabled_ui(has, |ui| ui.selectable_value(output, index, named.label))
                        .inner
                        .on_hover_text(named.help)
                        .on_disabled_hover_text("The scene has no such output");
                }
            })
            .response
            .on_hover_text("The number that every run is reduced to; all are computed at once")
            .accessible_name("Effect on");
    });
}
