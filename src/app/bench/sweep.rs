//! A background sweep: its settings, its progress, and the points so far.

use eframe::egui::{Button, ComboBox, DragValue, ProgressBar, RichText, TextEdit, Ui, vec2};

use super::coordinate::Coordinate;
use super::diagram::Diagram;
use super::swept::{Swept, start_word};
use crate::analysis::grid::Start;
use crate::analysis::point::LOOSEST_FOR_EXPONENT;
use crate::analysis::source::SceneSource;
use crate::analysis::sweep_task::SweepTask;
use crate::analysis::task::{Job, Message};
use crate::app::host::{Host, Running};
use crate::app::layout::reserved;
use crate::app::load::Load;
use crate::app::player::Player;
use crate::app::{theme, value};
use crate::scene::{Kind, Parameter, Value};

/// Parameter varied by default, and its range.
const FIRST: (&str, &str, &str) = ("contact.clearance", "0.01 mm", "1 mm");

/// Width of the button that starts and ends a sweep, points; fixed, so that it does not move.
const GO: f32 = 120.0;

/// Settings of the next sweep.
struct Settings {
    /// Scene that they were made for.
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
    asked: Option<SweepTask>,
    running: Option<(Box<dyn Running>, SweepTask)>,
    progress: f64,
    swept: Option<Swept>,
    problem: Option<String>,
    diagram: Diagram,
}

impl SweepPanel {
    /// Starts a requested sweep and takes messages from a running one; returns whether one is running.
    pub fn update(&mut self, host: &mut dyn Host) -> bool {
        if let Some(task) = self.asked.take() {
            self.problem = None;
            self.progress = 0.0;
            match host.start(Job::Sweep(task.clone())) {
                Some(running) => self.running = Some((running, task)),
                None => self.problem = Some("Sweeps cannot be computed here".to_owned()),
            }
        }
        while let Some((running, task)) = &mut self.running {
            match running.poll() {
                None => return true,
                Some(Message::Progress(done)) => self.progress = done,
                Some(Message::Ranges(ranges)) => {
                    self.swept = ranges.into_iter().next().map(|range| Swept {
                        task: task.clone(),
                        points: vec![None; range.count],
                        scene: task.scene.scene().ok(),
                        range,
                    });
                    self.diagram.clear();
                }
                Some(Message::Point(point)) => {
                    if let Some(swept) = &mut self.swept
                        && let Some(slot) = swept.points.get_mut(point.index)
                    {
                        *slot = Some(*point);
                        self.diagram.renew();
                    }
                }
                Some(Message::Presets(_)) => {}
                Some(Message::Done) => self.running = None,
                Some(Message::Failed(why)) => {
                    self.problem = Some(in_words(&why, task));
                    self.running = None;
                }
            }
        }
        false
    }

    /// Whether a sweep is running.
    pub fn is_running(&self) -> bool {
        self.running.is_some() || self.asked.is_some()
    }

    /// The latest sweep.
    pub fn swept(&self) -> Option<&Swept> {
        self.swept.as_ref()
    }

    /// The diagram.
    pub fn diagram(&self) -> &Diagram {
        &self.diagram
    }

    /// Settings, progress and diagram; returns the run to a section that was clicked.
    pub fn ui(&mut self, ui: &mut Ui, player: &Player, coordinate: Coordinate) -> Option<Load> {
        match player.watch().period() {
            Err(why) => {
                ui.label(RichText::new(format!("No sweep: {why}")).weak());
                if self.is_running() {
                    self.go_ui(ui, player);
                }
            }
            Ok(_) => {
                self.settings_ui(ui, player);
                self.go_ui(ui, player);
            }
        }
        reserved(ui, "sweep says", 2, |ui| self.state_ui(ui, player));
        let swept = self.swept.as_ref()?;
        reserved(ui, "sweep of", 3, |ui| {
            ui.label(RichText::new(swept.caption()).small())
                .on_hover_text("What the diagram below was made of");
        });
        let (index, section) = self.diagram.ui(ui, swept, coordinate)?;
        Load::new(
            &swept.task.scene,
            |index| swept.points.get(index)?.as_ref(),
            index,
            swept.task.discard + section,
            swept.task.periods,
        )
    }

    /// What went wrong, or whether the diagram belongs to the displayed scene.
    fn state_ui(&self, ui: &mut Ui, player: &Player) {
        let small = |words: &str| RichText::new(words).small();
        if let Some(problem) = &self.problem {
            theme::error(ui, problem);
            return;
        }
        let running = self.running.as_ref().map(|(_, task)| task);
        let swept = self.swept.as_ref();
        let Some(swept) = swept.filter(|swept| running.is_none_or(|task| *task == swept.task))
        else {
            let words = if self.is_running() {
                "Begins…"
            } else {
                "Nothing swept yet"
            };
            ui.label(small(words).weak());
            return;
        };
        let differences = swept.differences(player);
        if differences.is_empty() {
            ui.label(small("For the scene shown, with its values").weak());
        } else {
            let words = format!("Not for what is shown. {}", differences.join("; "));
            theme::warning(ui, words)
                .on_hover_text("A click on a point asks before it changes this");
        }
    }

    fn settings_ui(&mut self, ui: &mut Ui, player: &Player) {
        let scene = player.wanted();
        let mut parameters = scene.parameters();
        parameters.retain(|parameter| varies(player, parameter));
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
                settings.vary(parameter);
            }
        });
        ui.horizontal_wrapped(|ui| {
            for (name, text, help) in [
                ("From", &mut settings.from, "First value, with its unit"),
                ("To", &mut settings.to, "Last value, with its unit"),
            ] {
                ui.label(name);
                ui.add(TextEdit::singleline(text).desired_width(72.0))
                    .on_hover_text(help)
                    .accessible_name(name);
            }
            number(
                ui,
                "Values",
                &mut settings.values,
                1..=2000,
                "Equally spaced values, both ends included",
            );
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
            ComboBox::from_id_salt("start")
                .width(120.0)
                .selected_text(start_word(settings.start))
                .show_ui(ui, |ui| {
                    for start in [Start::Cold, Start::FollowUp, Start::FollowDown] {
                        ui.selectable_value(&mut settings.start, start, start_word(start));
                    }
                })
                .response
                .on_hover_text(
                    "Every value from the scene's own start, or from where its neighbour ended, so that hysteresis shows",
                )
                .accessible_name("Start of each value");
            ui.checkbox(&mut settings.exponent, "Exponent").on_hover_text(
                "Measures the largest Lyapunov exponent of each value with a twin run: about twice the time",
            );
        });
        let solver = player.wanted().solver;
        if settings.exponent
            && solver.method.is_adaptive()
            && solver.tolerance > LOOSEST_FOR_EXPONENT * (1.0 + 1e-9)
        {
            let words = format!(
                "At a tolerance of {} integration error hides the exponents; use {} or less",
                value::power_of_ten(solver.tolerance),
                value::power_of_ten(LOOSEST_FOR_EXPONENT)
            );
            theme::warning(ui, words);
        }
    }

    fn go_ui(&mut self, ui: &mut Ui, player: &Player) {
        let running = self.is_running();
        let (name, help) = if running {
            (
                "Cancel sweep",
                "End the sweep; the points that are there stay",
            )
        } else {
            (
                "Start sweep",
                "Runs the scene with its present values at each value of the varied parameter, in the background, and \
                 draws the bifurcation diagram as points arrive",
            )
        };
        let clicked = ui.horizontal(|ui| {
            let button = Button::new(name).min_size(vec2(GO, 0.0));
            let clicked = ui.add(button).on_hover_text(help).clicked();
            if running {
                let bar = ProgressBar::new(self.progress as f32).show_percentage();
                ui.add(bar.desired_width(ui.available_width()))
                    .accessible_name("Swept so far");
            }
            clicked
        });
        let clicked = clicked.inner;
        if clicked && running {
            (self.running, self.asked) = (None, None);
        } else if clicked
            && let Some(settings) = &self.settings
            && let Ok(parameter) = player.wanted().parameter(settings.key)
        {
            let end = |text: &str| value::completed(text, &parameter.kind);
            let Settings {
                key,
                from,
                to,
                values,
                ..
            } = settings;
            self.asked = Some(SweepTask {
                scene: SceneSource::of(player.wanted()),
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
    fn new(scene: &str, parameters: &[&'static Parameter]) -> Option<Self> {
        let first = parameters.iter().find(|p| p.key == FIRST.0);
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
        settings.vary(first);
        Some(settings)
    }

    /// Selects another parameter, over the range of its slider.
    fn vary(&mut self, parameter: &'static Parameter) {
        self.key = parameter.key;
        (self.from, self.to) = match parameter.kind {
            _ if parameter.key == FIRST.0 => (FIRST.1.to_owned(), FIRST.2.to_owned()),
            Kind::Number { slider, .. } => {
                let end = |si| value::shown(&Value::Number(si), &parameter.kind);
                (end(slider.0), end(slider.1))
            }
            Kind::Count { min, .. } => (min.to_string(), (min + 3).to_string()),
            Kind::Choice(_) => Default::default(),
        };
    }
}

/// Whether the scene has `parameter` as a number that affects its motion.
fn varies(player: &Player, parameter: &Parameter) -> bool {
    let value = player.wanted().get(parameter.key);
    matches!(value, Ok(Value::Number(_) | Value::Count(_)))
        && !parameter.key.starts_with("view.")
        && !parameter.key.starts_with("solver.")
}

/// An integer field with its label.
fn number(
    ui: &mut Ui,
    name: &str,
    value: &mut usize,
    range: std::ops::RangeInclusive<usize>,
    help: &str,
) {
    ui.label(name);
    ui.add(DragValue::new(value).range(range))
        .on_hover_text(help)
        .accessible_name(name);
}

/// The error message without its command-line prefix.
fn in_words(why: &str, task: &SweepTask) -> String {
    let option = task.vary.first().map(|text| format!("--vary {text}: "));
    let words = option.and_then(|option| why.strip_prefix(option.as_str()));
    let words = words.unwrap_or(why);
    let mut letters = words.chars();
    let first = letters.next().map(|c| c.to_uppercase().collect::<String>());
    first.unwrap_or_default() + letters.as_str()
}
