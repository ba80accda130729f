//! Measured error of the presets and of the default method on the built-in scenes, as stored in the program.

use std::collections::BTreeMap;
use std::sync::OnceLock;

use serde::{Deserialize, Serialize};

use super::timing::{End, advance_capped};
use super::{AnalysisError, Row, RunContext, Setting, Tradeoff};
use jointplay_physics::machine::{Preset, Solver};
use jointplay_scene::Scene;

/// Results of `jointplay tradeoff SCENE… --presets assets/presets.json`.
const RECORD: &str = include_str!("../assets/presets.json");

/// Word of the settings of a solver about which nothing is given, beside those of the presets.
pub const DEFAULT: &str = "default";

/// A setting measured on one scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Its method and the value that controls its steps, at the time of measurement.
    pub setting: (String, f64),
    /// Largest relative error of the peak forces of the first impacts.
    pub peak_error: Option<f64>,
    /// Largest relative error of the mean settled forces; `None` where the scene does not settle.
    pub settled_error: Option<f64>,
}

/// Measured presets as stored in the program.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Computer on which the presets were measured.
    pub machine: String,
    /// By scene, then by preset or [`DEFAULT`].
    pub scenes: BTreeMap<String, BTreeMap<String, Measured>>,
    /// By scene: simulated seconds per clock second of the preset `real-time`, as measured by [`pace`].
    pub pace: BTreeMap<String, f64>,
}

impl Record {
    /// Adds what `results` has about the presets on the scene `name`, with its [`pace`].
    pub fn add(&mut self, name: &str, results: &Tradeoff, pace: f64) {
        let default = Setting::automatic(Solver::default().tolerance);
        let word = |row: &Row| row.preset.map(Preset::word).or_else(|| (row.setting == default).then_some(DEFAULT));
        let measured = results.rows.iter().filter_map(|row| {
            let setting = (row.setting.method.word().to_owned(), row.setting.value());
            let (peak_error, settled_error) = (row.errors.peak, row.errors.force);
            Some((word(row)?.to_owned(), Measured { setting, peak_error, settled_error }))
        });
        self.scenes.insert(name.to_owned(), measured.collect());
        self.pace.insert(name.to_owned(), pace);
    }
}

/// Span over which the preset `real-time` is timed, s.
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
    let is_requested = scene.machine.solver.preset == Some(Preset::RealTime);
    let pace = record.pace.get(&scene.name).copied().filter(|_| scene.source.file.is_none());
    pace.filter(|pace| is_requested && *pace < 1.0).map(|pace| TooSlow {
        scene: scene.name.clone(),
        pace,
        machine: &record.machine,
    })
}

/// Simulated seconds per clock second of the preset `real-time` over the first second of `scene`.
///
/// # Errors
/// As [`Tradeoff::measure`].
pub fn pace(scene: &Scene, context: &mut RunContext) -> Result<f64, AnalysisError> {
    let mut simulation = Setting::of_preset(Preset::RealTime, &scene.machine).start(scene)?;
    let before = context.now();
    match advance_capped(&mut simulation, PACE_SPAN, f64::INFINITY, context, |_| false)? {
        End::Stopped(stopped) => Err(stopped.into()),
        _ => Ok(PACE_SPAN / (context.now() - before)),
    }
}

/// The stored record.
pub fn record() -> &'static Record {
    static PARSED: OnceLock<Record> = OnceLock::new();
    PARSED.get_or_init(|| serde_json::from_str(RECORD).expect("a test reads the same file"))
}

/// Measured errors of a preset or of [`DEFAULT`], by its word, on the built-in scene `scene` with its default parameters.
pub fn measured(scene: &str, word: &str) -> Option<&'static Measured> {
    record().scenes.get(scene)?.get(word)
}

/// Error of the peak forces of the first impacts that a preset must not exceed.
pub fn limit(preset: Preset) -> f64 {
    match preset {
        Preset::Preview => 0.05,
        Preset::RealTime => 0.02,
        Preset::Accurate => 1e-4,
        Preset::Reference => 1e-7,
    }
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
                panic!("{name}: run `jointplay tradeoff … --presets assets/presets.json`, see docs/checks.md");
            });
            let warning = slow(name, &[REAL_TIME]);
            assert_eq!(warning.as_ref().map(|slow| slow.pace), (pace < 1.0).then_some(pace));
            if let Some(warning) = warning {
                assert!(warning.to_string().contains(name), "{warning}");
            }
            // Not requested.
            assert_eq!(slow(name, &[]), None);
        }
    }
}
