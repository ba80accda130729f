//! Measured speed and error of the presets: stored in the program for the built-in scenes, computed on request for any scene.

use std::collections::BTreeMap;
use std::sync::OnceLock;

use serde::{Deserialize, Serialize};

use super::timing::clock_time_to;
use super::work_precision::{Baseline, measure as measure_point};
use super::{AnalysisError, Point, ReferenceSolution, RunContext, Setting, WorkBudget, WorkPrecision};
use jointplay_physics::machine::{Preset, Solver};
use jointplay_scene::Scene;

/// Results of `jointplay tradeoff --all --write`.
const RECORD: &str = include_str!("../../../assets/presets.json");

/// A preset measured on one scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Largest relative error of the peak forces of the first impacts.
    pub peak_error: Option<f64>,
    /// Error of the output body's position at the third impact, m.
    pub position_error_m: Option<f64>,
    /// Largest relative error of the mean settled forces; `None` where the scene does not settle.
    pub settled_error: Option<f64>,
    /// Speed over the first impacts, relative to Runge-Kutta 4 at 10 microseconds.
    pub impacts_ratio: Option<f64>,
    /// Speed in settled motion, relative to Runge-Kutta 4 at 10 microseconds.
    pub settled_ratio: Option<f64>,
}

impl Measured {
    /// The values to store for a point.
    pub fn of(point: &Point) -> Self {
        Self {
            peak_error: point.errors.peak,
            position_error_m: point.errors.position_m,
            settled_error: point.errors.settled,
            impacts_ratio: point.impacts.ratio,
            settled_ratio: point.settled.as_ref().and_then(|phase| phase.ratio),
        }
    }
}

/// Measured presets as stored in the program.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Computer on which the presets were measured.
    pub machine: String,
    /// By scene, then by preset: method and accuracy value at the time of measurement.
    pub points: BTreeMap<String, BTreeMap<String, (String, f64)>>,
    /// By scene, then by preset: the measurement.
    pub scenes: BTreeMap<String, BTreeMap<String, Measured>>,
    /// By scene: simulated seconds per clock second of the preset `real-time`, as measured by [`pace`].
    pub pace: BTreeMap<String, f64>,
}

/// Span over which the preset `real-time` is measured, s.
const PACE_SPAN: f64 = 1.0;

/// A scene that requests the preset `real-time` but ran slower than real time when measured.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "solver.preset real-time does not keep up with {scene}: its first second, with its default values, ran at \
     {pace:.2} times \
     real time on one core of {machine}; preview is faster"
)]
pub struct TooSlow {
    /// Name of the scene.
    pub scene: String,
    /// Simulated seconds per clock second.
    pub pace: f64,
    /// Computer on which it was measured.
    pub machine: &'static str,
}

/// Returns the measurement of a built-in `scene` that requests the preset `real-time` but ran slower than real time.
pub fn too_slow(scene: &Scene) -> Option<TooSlow> {
    let record = record();
    let real_time = Preset::RealTime.solver(scene.machine.joints_with_clearance());
    let settings = |solver: &Solver| (solver.preset, solver.method, solver.tolerance, solver.steps_per_impact);
    let is_requested = settings(&scene.machine.solver) == settings(&real_time) && scene.source.file.is_none();
    let pace = record.pace.get(&scene.name).copied();
    pace.filter(|pace| is_requested && *pace < 1.0).map(|pace| TooSlow {
        scene: scene.name.clone(),
        pace,
        machine: &record.machine,
    })
}

/// Simulated seconds per clock second of the preset `real-time` over the first second of `scene`.
///
/// # Errors
/// As [`super::work_precision`].
pub fn pace(scene: &Scene, budget: &WorkBudget, context: &mut RunContext) -> Result<f64, AnalysisError> {
    let setting = Setting::of_preset(Preset::RealTime, &scene.machine);
    let budget = WorkBudget { measured: budget.measured, ..WorkBudget::REFERENCE };
    let seconds = clock_time_to(PACE_SPAN, &budget, context, |_| setting.start(scene))?;
    Ok(PACE_SPAN / seconds)
}

/// The stored record.
pub fn record() -> &'static Record {
    static PARSED: OnceLock<Record> = OnceLock::new();
    PARSED.get_or_init(|| serde_json::from_str(RECORD).expect("a test reads the same file"))
}

/// Measured performance of `preset` on the built-in scene `scene` with its default parameters.
pub fn measured(scene: &str, preset: Preset) -> Option<Measured> {
    record().scenes.get(scene)?.get(preset.word()).copied()
}

/// Error of the peak forces of the first impacts that a preset must not exceed on any built-in scene.
pub fn limit(preset: Preset) -> f64 {
    match preset {
        Preset::Preview => 0.05,
        Preset::RealTime => 0.02,
        Preset::Accurate => 1e-4,
        Preset::Reference => 1e-7,
    }
}

/// The fastest setting within a limit. Among the settings whose peak-force error is at most `limit` on every scene of
/// `results`, it has the largest product of speed ratios over the impacts and the settled motion of every scene.
pub fn choose(results: &[&WorkPrecision], limit: f64) -> Option<Setting> {
    let candidates = results.first()?.points.iter().map(|point| point.setting);
    let score = |setting: &Setting| {
        let mut product = 1.0;
        for scene in results {
            let point = scene.points.iter().find(|p| p.setting == *setting)?;
            if !point.errors.peak.is_some_and(|error| error <= limit) {
                return None;
            }
            product *= point.impacts.ratio?;
            if let Some(settled) = &point.settled {
                product *= settled.ratio?;
            }
        }
        Some(product)
    };
    candidates
        .filter_map(|setting| Some((setting, score(&setting)?)))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(setting, _)| setting)
}

/// Measures `presets` on `scene` in its current form, within seconds. Results are in the same order.
///
/// # Errors
/// As [`super::work_precision`].
pub fn measure(scene: &Scene, presets: &[Preset], context: &mut RunContext) -> Result<Vec<Point>, AnalysisError> {
    let budget = WorkBudget::QUICK;
    let parts = presets.len() + 2;
    let reference = ReferenceSolution::new(scene, &mut context.part(0, parts))?;
    let baseline = Baseline::new(&reference, &budget, &mut context.part(1, parts))?;
    let mut points = Vec::with_capacity(presets.len());
    for (n, preset) in presets.iter().enumerate() {
        let setting = Setting::of_preset(*preset, &scene.machine);
        let mut point = measure_point(&reference, setting, &budget, &mut context.part(n + 2, parts))?;
        point.preset = Some(*preset);
        baseline.set_ratios(&mut point);
        points.push(point);
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;
    use jointplay_scene::BUILT_IN;

    #[test]
    fn a_built_in_scene_slower_than_real_time_is_reported_before_it_runs() {
        const REAL_TIME: (&str, &str) = ("solver.preset", "real-time");
        let slow = |name: &str, changes: &[(&str, &str)]| {
            let owned = |(key, value): &(&str, &str)| ((*key).to_owned(), (*value).to_owned());
            let changes: Vec<_> = changes.iter().map(owned).collect();
            too_slow(&Scene::load(name, &changes).expect("loads"))
        };
        for name in BUILT_IN {
            let pace = *record().pace.get(name).unwrap_or_else(|| {
                panic!("{name}: run `jointplay tradeoff --all --write .`");
            });
            let warning = slow(name, &[REAL_TIME]);
            assert_eq!(warning.as_ref().map(|slow| slow.pace), (pace < 1.0).then_some(pace));
            if let Some(warning) = warning {
                assert!(warning.to_string().contains(name), "{warning}");
            }
            // The preset is not requested, or its values are overridden.
            assert_eq!(slow(name, &[]), None);
            assert_eq!(slow(name, &[REAL_TIME, ("solver.tolerance", "1e-4")]), None);
        }
    }
}
