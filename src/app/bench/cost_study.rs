//! Settings and results of a study of what play costs.

use crate::analysis::one_at_a_time_task::{OneAtATimeReport, OneAtATimeRun, OneAtATimeTask};
use crate::analysis::source::SceneSource;
use crate::analysis::study::{NAMED, RunSpan};
use crate::app::player::Player;
use crate::app::{controls, value};
use crate::scene::{Kind, Parameter, Scene, Value};
use crate::units::{from_display, to_display};

/// Initial variation of a parameter, percent of its value.
const INITIAL_VARIATION: f64 = 50.0;

/// A contact parameter that every ball joint has.
pub struct VariedParameter {
    /// Its row in the table, under the key of the whole scene.
    pub parameter: &'static Parameter,
    /// Whether it varies.
    pub on: bool,
    /// Ends of its range in the display unit.
    pub range: [f64; 2],
}

/// Settings of the next study.
pub struct CostSettings {
    /// Parameters to choose from.
    pub varied: Vec<VariedParameter>,
    /// Whether every joint takes the same range instead of a percentage of its own value.
    pub ranges: bool,
    /// The percentage.
    pub percent: f64,
    /// Observed part of each run.
    pub span: RunSpan,
}

impl CostSettings {
    /// The clearances of all ball joints by half of their values.
    pub fn new(scene: &Scene) -> Self {
        let varied = controls::FIRST.into_iter().filter_map(|key| {
            let (parameter, Ok(Value::Number(now))) = (scene.parameter(key).ok()?, scene.get(key)) else {
                return None;
            };
            let Kind::Number { slider, min, max, display, .. } = parameter.kind else {
                return None;
            };
            let own = [1.0 - INITIAL_VARIATION / 100.0, 1.0 + INITIAL_VARIATION / 100.0]
                .map(|part| (part * now).clamp(min, max));
            let range = if own[0] < own[1] { own } else { [slider.0, slider.1] };
            Some(VariedParameter { parameter, on: false, range: range.map(|si| to_display(si, display)) })
        });
        let mut varied: Vec<VariedParameter> = varied.collect();
        if let Some(first) = varied.first_mut() {
            first.on = true;
        }
        Self { varied, ranges: false, percent: INITIAL_VARIATION, span: RunSpan::of(scene) }
    }

    /// The study with these settings.
    ///
    /// # Errors
    /// As a message: a reversed range, or nothing that varies.
    pub fn task(&self, scene: &Scene) -> Result<OneAtATimeTask, String> {
        let mut over = Vec::new();
        let reversed = |varied: &&VariedParameter| self.ranges && varied.on && varied.range[0] >= varied.range[1];
        if let Some(VariedParameter { parameter, .. }) = self.varied.iter().find(reversed) {
            return Err(format!("{}: the first value must be below the second", parameter.label));
        }
        for joint in &scene.machine.loose_joints {
            for VariedParameter { parameter, range, .. } in self.varied.iter().filter(|varied| varied.on) {
                let last = parameter.key.rsplit('.').next().unwrap_or_default();
                let key = format!("joint.{}.{last}", joint.name);
                let (Ok(Value::Number(now)), Kind::Number { min, max, display, .. }) =
                    (scene.get(&key), parameter.kind)
                else {
                    continue;
                };
                let part = self.percent / 100.0;
                let ends = if self.ranges {
                    range.map(|shown| from_display(shown, display))
                } else {
                    [1.0 - part, 1.0 + part].map(|part| (part * now).clamp(min, max))
                };
                // A percentage of zero gives an empty range.
                if ends[0] < ends[1] {
                    over.push((key, ends));
                }
            }
        }
        if over.is_empty() {
            return Err("Nothing varies: choose a parameter, and a range where its value is 0".to_owned());
        }
        let outputs = NAMED.iter().map(|named| named.name.to_owned()).collect();
        Ok(OneAtATimeTask { scene: SceneSource::of(scene), over, outputs, span: self.span })
    }
}

/// A started study and its results so far.
pub struct CostStudy {
    /// The requested task.
    pub task: OneAtATimeTask,
    /// The accepted runs.
    pub plan: OneAtATimeReport,
    /// Outputs of each run, SI; `None` for pending runs.
    runs: Vec<Option<Vec<Option<f64>>>>,
    /// The scene as it was at the start.
    scene: Option<Scene>,
}

impl CostStudy {
    /// A study without results.
    pub fn new(task: OneAtATimeTask, plan: OneAtATimeReport) -> Self {
        let runs = vec![None; 1 + 2 * task.over.len()];
        Self { scene: task.scene.scene().ok(), runs, task, plan }
    }

    /// Takes the results of a run.
    pub fn take(&mut self, run: OneAtATimeRun) {
        if let Some(slot) = self.runs.get_mut(run.index) {
            *slot = Some(run.outputs);
        }
    }

    /// Output `output` with the values of the scene, SI; `None` while unknown.
    pub fn base(&self, output: usize) -> Option<f64> {
        self.runs.first()?.as_ref()?.get(output).copied().flatten()
    }

    /// The same with input `input` at its lower (`end` 0) or upper end (1); `Some(None)` if that run has no result.
    pub fn end(&self, output: usize, input: usize, end: usize) -> Option<Option<f64>> {
        let run = self.runs.get(1 + 2 * input + end)?.as_ref()?;
        Some(run.get(output).copied().flatten())
    }

    /// Numbers of finished runs and of all runs.
    pub fn run_counts(&self) -> (usize, usize) {
        (self.runs.iter().flatten().count(), self.runs.len())
    }

    /// Inputs by their effect on `output`, the largest first; those with a run without result before all others.
    pub fn ranked_by_effect(&self, output: usize) -> Vec<usize> {
        let spread = |input: usize| {
            let ends = [0, 1].map(|end| self.end(output, input, end).flatten());
            let all: Option<Vec<f64>> = [self.base(output), ends[0], ends[1]].into_iter().collect();
            all.map_or(f64::INFINITY, |all| {
                all.iter().copied().fold(f64::NEG_INFINITY, f64::max)
                    - all.iter().copied().fold(f64::INFINITY, f64::min)
            })
        };
        let mut order: Vec<usize> = (0..self.task.over.len()).collect();
        order.sort_by(|&a, &b| spread(b).total_cmp(&spread(a)));
        order
    }

    /// Row of the table of an input.
    pub fn parameter(&self, input: usize) -> Option<&'static Parameter> {
        self.scene.as_ref()?.parameter(&self.task.over[input].0).ok()
    }

    /// Differences from the displayed scene, one phrase each.
    pub fn differences(&self, player: &Player) -> Vec<String> {
        self.scene.as_ref().map_or_else(Vec::new, |scene| value::differences(scene, player.pending(), &[]))
    }
}
