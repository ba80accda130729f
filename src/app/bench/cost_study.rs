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

/// A contact parameter that every joint with play has.
pub struct VariedParameter {
    /// Its row in the table, under the key of the whole scene.
    pub parameter: &'static Parameter,
    /// Whether it varies.
    pub on: bool,
    /// Ends of its range in the display unit.
    pub range: [f64; 2],
}

/// Digits of the values in a verdict.
const VERDICT_DIGITS: usize = 3;
/// Spread relative to the largest at which an input matters about as much.
const ABOUT_EQUAL: f64 = 0.9;
/// Spread relative to the result that is rounding.
const NO_EFFECT: f64 = 1e-9;

/// `words` within a sentence.
fn lower_first(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_lowercase().chain(letters).collect())
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
    /// The clearances of all joints by half of their values.
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
        for joint in 0..scene.machine.loose_joints.len() {
            let varied = self.varied.iter().filter(|varied| varied.on).flat_map(|varied| {
                let last = varied.parameter.key.rsplit('.').next().unwrap_or_default();
                // A pin and a block may have two plays.
                let second = (last == "clearance").then_some("second_clearance");
                [Some(last), second].into_iter().flatten().map(move |part| (varied, part))
            });
            for (VariedParameter { parameter, range, .. }, part) in varied {
                let key = scene.joint_key(joint, part);
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

/// Joint of a parameter's key: `J` of `joint.J.play.radial`.
pub fn joint_of(key: &str) -> Option<&str> {
    let (joint, _) = key.strip_prefix("joint.")?.rsplit_once('.')?;
    Some(joint.strip_suffix(".play").unwrap_or(joint))
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

    /// Least and greatest `output` of the runs at the scene's value and at both ends of `input`, SI; `None` without all three results.
    fn extent(&self, output: usize, input: usize) -> Option<[f64; 2]> {
        let ends = [0, 1].map(|end| self.end(output, input, end).flatten());
        let all = [self.base(output)?, ends[0]?, ends[1]?];
        Some([all.into_iter().fold(f64::INFINITY, f64::min), all.into_iter().fold(f64::NEG_INFINITY, f64::max)])
    }

    /// The unit in which values of `output` are shown.
    pub fn display_unit(&self, output: usize) -> &str {
        let all = self.runs.iter().flatten().filter_map(|run| run.get(output).copied().flatten());
        let most = all.fold(0.0_f64, |most, value| most.max(value.abs()));
        match self.plan.units[output].as_deref().unwrap_or_default() {
            "m" if most < 1e-3 => "um",
            "m" => "mm",
            other => other,
        }
    }

    /// Which input matters most to `output`, and by how much, in a sentence of the results; `None` before all runs are finished.
    pub fn verdict(&self, output: usize) -> Option<String> {
        let (finished, all) = self.run_counts();
        let base = self.base(output)?;
        if finished < all {
            return None;
        }
        let what = lower_first(NAMED[output].label);
        let failed = self.runs.iter().flatten().filter(|run| run.get(output).copied().flatten().is_none()).count();
        let without = match failed {
            0 => String::new(),
            1 => " One run has no result and does not count.".to_owned(),
            _ => format!(" {failed} runs have no result and do not count."),
        };
        let spread = |input: usize| self.extent(output, input).map(|[least, most]| most - least);
        let mut ranked = self.ranked_by_effect(output);
        ranked.retain(|&input| spread(input).is_some());
        let Some(&first) = ranked.first() else {
            return Some(format!("No changed value has a result.{without}"));
        };
        let most = spread(first).unwrap_or_default();
        if most <= NO_EFFECT * base.abs() {
            return Some(format!("None of these values moves the {what}.{without}"));
        }
        let name = |input: usize| {
            let key = &self.task.over[input].0;
            let joint = joint_of(key).unwrap_or(key);
            self.parameter(input)
                .map_or_else(|| joint.to_owned(), |parameter| format!("{} of {joint}", parameter.label))
        };
        let others: Vec<usize> = ranked[1..]
            .iter()
            .copied()
            .filter(|&other| spread(other).is_some_and(|own| own >= ABOUT_EQUAL * most))
            .collect();
        let lead = match &others[..] {
            [] => format!("{} matters most: ", name(first)),
            [second] => format!("{} and {} matter about equally: ", name(first), lower_first(&name(*second))),
            _ if others.len() + 1 == self.task.over.len() => "All matter about equally: ".to_owned(),
            _ => format!("{} and {} others matter about equally: ", name(first), others.len()),
        };
        let unit = self.parameter(first).map_or("", Parameter::display_unit);
        let ends = self.task.over[first].1;
        let nominal = self.plan.nominal[first];
        let halves = [nominal - ends[0], ends[1] - nominal];
        let by = if (halves[0] - halves[1]).abs() <= 1e-9 * (ends[1] - ends[0]) {
            format!("±{}", value::quantity(halves[1], unit, VERDICT_DIGITS))
        } else {
            format!(
                "from {} to {}",
                value::number(to_display(ends[0], unit), VERDICT_DIGITS),
                value::quantity(ends[1], unit, VERDICT_DIGITS)
            )
        };
        let place = if others.is_empty() { " there".to_owned() } else { format!(" of {}", lower_first(&name(first))) };
        let shown = self.display_unit(output);
        let number = |si: f64| value::number(to_display(si, shown), VERDICT_DIGITS);
        let last = |si: f64| value::quantity(si, shown, VERDICT_DIGITS);
        let [least, greatest] = self.extent(output, first)?;
        let [low, high] = [0, 1].map(|end| self.end(output, first, end).flatten());
        let (low, high) = (low?, high?);
        let moves = if low.min(high) == least && low.max(high) == greatest {
            format!("from {} to {}", number(low), last(high))
        } else {
            // Both ends lie on one side of the scene's own result.
            format!("between {} and {}", number(least), last(greatest))
        };
        Some(format!("{lead}{by}{place} moves the {what} {moves}.{without}"))
    }

    /// Inputs by their effect on `output`, the largest first; those with a run without result before all others.
    pub fn ranked_by_effect(&self, output: usize) -> Vec<usize> {
        let spread = |input: usize| self.extent(output, input).map_or(f64::INFINITY, |[least, most]| most - least);
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
