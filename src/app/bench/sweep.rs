//! Background sweep: settings, progress, and the points so far.

use eframe::egui::{Align, ComboBox, DragValue, RichText, TextEdit, Ui};

use super::computation::Computation;
use super::coordinate::BenchCoordinate;
use super::diagram::Diagram;
use super::in_words;
use super::sweep_results::{SweepResults, start_label};
use crate::analysis::design::Start;
use crate::analysis::point::MAX_EXPONENT_TOLERANCE;
use crate::analysis::ready_sweeps::{READY_SWEEPS, ReadySweep};
use crate::analysis::source::SceneSource;
use crate::analysis::sweep_task::SweepTask;
use crate::analysis::task::{Job, Message};
use crate::app::command::Command;
use crate::app::host::Host;
use crate::app::layout::{self, reserve_lines};
use crate::app::load::Load;
use crate::app::player::Player;
use crate::app::{theme, value};
use crate::scene::{Kind, Parameter, Scene, Value};

/// Parameter varied by default, and its range.
const DEFAULT_RANGE: (&str, &str, &str) = ("contact.clearance", "0.01 mm", "1 mm");

/// Settings of the next sweep.
struct Settings {
    /// Name of the scene they belong to.
    scene: String,
    key: &'static str,
    from: String,
    to: String,
    values: usize,
    periods: usize,
    discard: usize,
    start: Start,
    exponent: bool,
}

/// The panel.
#[derive(Default)]
pub struct SweepPanel {
    settings: Option<Settings>,
    pub(super) computation: Computation<SweepTask>,
    results: Option<SweepResults>,
    diagram: Diagram,
    /// Whether to scroll to the diagram.
    reveal: bool,
}

impl SweepPanel {
    /// Starts a requested sweep and takes messages from a running one; returns whether one is running.
    pub fn update(&mut self, host: &mut dyn Host) -> bool {
        let Self { computation, results, diagram, .. } = self;
        let take = |task: &SweepTask, message| match message {
            Message::Ranges(ranges) => {
                *results = ranges.into_iter().next().map(|range| SweepResults {
                    task: task.clone(),
                    points: vec![None; range.count],
                    scene: task.scene.scene().ok(),
                    range,
                });
                diagram.clear();
            }
            Message::Point(point) => {
                if let Some(results) = results
                    && let Some(slot) = results.points.get_mut(point.index)
                {
                    *slot = Some(*point);
                    diagram.invalidate();
                }
            }
            _ => {}
        };
        let explain = |task: &SweepTask, why: String| in_words(&why, "--vary", &task.vary);
        computation.update(host, "Sweeps", |_| usize::MAX, Job::Sweep, take, explain)
    }

    /// The latest sweep.
    pub fn results(&self) -> Option<&SweepResults> {
        self.results.as_ref()
    }

    /// The diagram.
    pub fn diagram(&self) -> &Diagram {
        &self.diagram
    }

    /// Starts a ready sweep over its `scene`, replacing any running sweep.
    pub fn start(&mut self, ready: &'static ReadySweep, scene: &Scene) {
        self.settings = Some(Settings::of(ready));
        self.computation.requested = Some(ready.task(scene));
        self.reveal = true;
    }

    /// Ready sweeps, settings, progress and diagram; returns the user's request to the run.
    pub fn ui(&mut self, ui: &mut Ui, player: &Player, coordinate: BenchCoordinate) -> Option<Command> {
        let ready = ready_ui(ui).map(Command::AskSweep);
        let load = self.sweep_ui(ui, player, coordinate);
        ready.or(load.map(|load| Command::AskSection(Box::new(load))))
    }

    fn sweep_ui(&mut self, ui: &mut Ui, player: &Player, coordinate: BenchCoordinate) -> Option<Load> {
        let mut progress = ui.cursor().top();
        match player.watch().period() {
            Err(why) => {
                ui.label(RichText::new(format!("No sweep: {why}")).weak());
                if self.computation.is_running() {
                    self.start_ui(ui, player);
                }
            }
            Ok(_) => {
                self.settings_ui(ui, player);
                progress = ui.cursor().top();
                self.start_ui(ui, player);
            }
        }
        reserve_lines(ui, "sweep says", 2, |ui| self.state_ui(ui, player));
        let diagram = ui.cursor().top();
        let load = self.diagram_ui(ui, coordinate);
        if self.reveal {
            self.reveal = !self.computation.has_current_results();
            let room = ui.clip_rect().height();
            let all = ui.min_rect().with_min_y(progress);
            // Includes the progress, and the items above and below it if they fit.
            let mut shown = vec![all, all.with_min_y(diagram)];
            shown.extend(self.diagram.plane());
            let fits = shown.iter().find(|rect| rect.height() <= room);
            if let Some(rect) = fits.or(shown.last()) {
                let top = (rect.height() > room).then_some(Align::TOP);
                ui.scroll_to_rect(*rect, top);
            }
        }
        load
    }

    /// The diagram; returns the clicked section.
    fn diagram_ui(&mut self, ui: &mut Ui, coordinate: BenchCoordinate) -> Option<Load> {
        let results = self.results.as_ref()?;
        reserve_lines(ui, "sweep of", 3, |ui| {
            ui.label(RichText::new(results.caption()).small()).on_hover_text("Scene and settings of the diagram below");
        });
        let (index, section) = self.diagram.ui(ui, results, coordinate)?;
        Load::new(
            &results.task.scene,
            |index| results.points.get(index)?.as_ref(),
            index,
            results.task.discard + section,
            results.task.periods,
        )
    }

    /// The error message, or whether the diagram belongs to the displayed scene.
    fn state_ui(&self, ui: &mut Ui, player: &Player) {
        let small = |words: &str| RichText::new(words).small();
        if let Some(problem) = &self.computation.problem {
            theme::error(ui, problem);
            return;
        }
        let running = self.computation.running.as_ref().map(|running| &running.task);
        let results = self.results.as_ref();
        let Some(results) = results.filter(|results| running.is_none_or(|task| *task == results.task)) else {
            let words = if self.computation.is_running() { "Starting…" } else { "No results yet" };
            ui.label(small(words).weak());
            return;
        };
        let differences = results.differences(player);
        if differences.is_empty() {
            ui.label(small("This sweep belongs to the current scene").weak());
        } else {
            let words = format!("This sweep belongs to another scene. {}", differences.join("; "));
            theme::warning(ui, words).on_hover_text("A click on a point asks before it changes this");
        }
    }

    fn settings_ui(&mut self, ui: &mut Ui, player: &Player) {
        let scene = player.pending();
        let mut parameters = scene.parameters();
        parameters.retain(|parameter| is_variable(player, parameter));
        let known = |settings: &&mut Settings| settings.scene == scene.name;
        let settings = match self.settings.as_mut().filter(known) {
            Some(_) => self.settings.as_mut(),
            None => {
                self.settings = Settings::new(&scene.name, &parameters);
                self.settings.as_mut()
            }
        };
        let Some(settings) = settings else {
            return;
        };
        ui.horizontal_wrapped(|ui| {
            ui.label("Vary");
            let mut key = settings.key;
            let label = |key: &str| {
                let found = parameters.iter().find(|parameter| parameter.key == key);
                found.map_or("", |parameter| parameter.label)
            };
            ComboBox::from_id_salt("varied")
                .width(150.0)
                .selected_text(label(key))
                .show_ui(ui, |ui| {
                    for parameter in &parameters {
                        ui.selectable_value(&mut key, parameter.key, parameter.label)
                            .on_hover_text(value::typeset(parameter.help));
                    }
                })
                .response
                .on_hover_text("Parameter that the sweep varies")
                .accessible_name("Varied parameter");
            if key != settings.key
                && let Some(parameter) = parameters.iter().find(|p| p.key == key)
            {
                settings.select_parameter(parameter);
            }
        });
        ui.horizontal_wrapped(|ui| {
            for (name, text, help) in [
                ("From", &mut settings.from, "First value, with its unit"),
                ("To", &mut settings.to, "Last value, with its unit"),
            ] {
                ui.label(name);
                ui.add(TextEdit::singleline(text).desired_width(72.0)).on_hover_text(help).accessible_name(name);
            }
            number(ui, "Values", &mut settings.values, 1..=2000, "Equally spaced values, both ends included");
        });
        ui.horizontal_wrapped(|ui| {
            let help = "Periods of the drive that each value runs, those discarded included";
            number(ui, "Periods", &mut settings.periods, 2..=2000, help);
            let most = settings.periods - 1;
            settings.discard = settings.discard.min(most);
            let help = "Periods at the beginning whose sections are left out: the transient";
            number(ui, "Discard", &mut settings.discard, 0..=most, help);
        });
        ui.horizontal_wrapped(|ui| {
            ui.label("Start");
            let help = "Each value starts from the scene's own start, or from the end state of its neighbour, so that \
                        hysteresis shows";
            let all = [Start::Cold, Start::FollowUp, Start::FollowDown];
            layout::choice(ui, ["Start of each value", help], Some(120.0), &mut settings.start, all, start_label);
            ui.checkbox(&mut settings.exponent, "Exponent").on_hover_text(
                "Computes the largest Lyapunov exponent at each value with a twin run, which about doubles the time",
            );
        });
        let solver = player.pending().machine.solver;
        if settings.exponent && solver.method.is_adaptive() && solver.tolerance > MAX_EXPONENT_TOLERANCE * (1.0 + 1e-9)
        {
            let words = format!(
                "At a tolerance of {} integration error hides the exponents; use {} or less",
                value::power_of_ten(solver.tolerance),
                value::power_of_ten(MAX_EXPONENT_TOLERANCE)
            );
            theme::warning(ui, words);
        }
    }

    fn start_ui(&mut self, ui: &mut Ui, player: &Player) {
        let start = [
            "Start sweep",
            "Runs the scene with its current settings at each value of the varied parameter, in the background, \
             and draws the bifurcation diagram as points arrive",
        ];
        let stop = ["Cancel sweep", "Stops the sweep; points computed so far remain"];
        if self.computation.button(ui, start, stop, ["Swept so far", "points"])
            && let Some(settings) = &self.settings
            && let Ok(parameter) = player.pending().parameter(settings.key)
        {
            self.reveal = true;
            let end = |text: &str| value::with_display_unit(text, &parameter.kind);
            let Settings { key, from, to, values, .. } = settings;
            self.computation.requested = Some(SweepTask {
                scene: SceneSource::of(player.pending()),
                vary: vec![format!("{key}={}..{}:{values}", end(from), end(to))],
                periods: settings.periods,
                discard: settings.discard,
                phase: player.watch().phase(),
                start: settings.start,
                exponent: settings.exponent,
            });
        }
    }
}

impl Settings {
    fn of(ready: &ReadySweep) -> Self {
        Self {
            scene: ready.scene.to_owned(),
            key: ready.key,
            from: ready.from.to_owned(),
            to: ready.to.to_owned(),
            values: ready.values,
            periods: ready.periods,
            discard: ready.discard,
            start: Start::Cold,
            exponent: false,
        }
    }

    fn new(scene: &str, parameters: &[&'static Parameter]) -> Option<Self> {
        let first = parameters.iter().find(|p| p.key == DEFAULT_RANGE.0);
        let first = first.or_else(|| parameters.first())?;
        let mut settings = Self {
            scene: scene.to_owned(),
            key: first.key,
            from: String::new(),
            to: String::new(),
            values: 40,
            periods: 30,
            discard: 10,
            start: Start::Cold,
            exponent: false,
        };
        settings.select_parameter(first);
        Some(settings)
    }

    /// Selects another parameter, with the range of its slider.
    fn select_parameter(&mut self, parameter: &'static Parameter) {
        self.key = parameter.key;
        (self.from, self.to) = match parameter.kind {
            _ if parameter.key == DEFAULT_RANGE.0 => (DEFAULT_RANGE.1.to_owned(), DEFAULT_RANGE.2.to_owned()),
            Kind::Number { slider, .. } => {
                let end = |si| value::shown(&Value::Number(si), &parameter.kind);
                (end(slider.0), end(slider.1))
            }
            Kind::Count { min, .. } => (min.to_string(), (min + 3).to_string()),
            Kind::Choice(_) => Default::default(),
        };
    }
}

/// Buttons of the ready sweeps with descriptions; returns the clicked one.
fn ready_ui(ui: &mut Ui) -> Option<&'static ReadySweep> {
    let mut chosen = None;
    for ready in &READY_SWEEPS {
        ui.horizontal_wrapped(|ui| {
            let help =
                "Opens its scene in place of the running one, and starts the sweep; asks first if that loses changes";
            if ui.small_button(ready.name).on_hover_text(help).clicked() {
                chosen = Some(ready);
            }
            ui.label(RichText::new(ready.shows).small().weak());
        });
    }
    chosen
}

/// Whether the scene has `parameter` as a number that affects the motion.
fn is_variable(player: &Player, parameter: &Parameter) -> bool {
    let value = player.pending().get(parameter.key);
    matches!(value, Ok(Value::Number(_) | Value::Count(_)))
        && !parameter.key.starts_with("view.")
        && !parameter.key.starts_with("solver.")
}

/// A labelled integer field.
fn number(ui: &mut Ui, name: &str, value: &mut usize, range: std::ops::RangeInclusive<usize>, help: &str) {
    ui.label(name);
    ui.add(DragValue::new(value).range(range)).on_hover_text(help).accessible_name(name);
}
