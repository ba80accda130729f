//! Cost and error of every method on one scene, at a range of steps and tolerances.

use serde_json::{Value as Json, json};

use super::timing::{End, advance_capped};
use super::{AnalysisError, Errors, ReferenceSolution, RunContext, Setting};
use jointplay_physics::integrate::{Method, StepControl};
use jointplay_physics::machine::{Machine, Preset};
use jointplay_physics::simulate::Statistics;
use jointplay_scene::Scene;

/// Runs of one setting that are timed, until they took [`MEASURED`] s together; the shortest counts.
const MAX_RUNS: usize = 5;
const MEASURED: f64 = 0.1;

/// The settings to measure, and how far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Simulated time from the start, s.
    pub span_s: f64,
    /// Cap on the counted cost of a run, in evaluations.
    pub max_cost: f64,
    /// Step sizes of the fixed-step methods, s.
    pub steps: &'static [f64],
    /// Tolerances of the adaptive methods.
    pub tolerances: &'static [f64],
    /// Steps per impact of the discrete-gradient method.
    pub steps_per_impact: &'static [f64],
}

impl Grid {
    /// A coarse grid over the first tenth of a second.
    pub const QUICK: Self = Self {
        span_s: 0.1,
        max_cost: 3e5,
        steps: &[20e-6, 10e-6],
        tolerances: &[1e-2, 1e-4, 1e-6, 1e-8],
        steps_per_impact: &[4.0, 8.0, 16.0],
    };
    /// The whole grid.
    pub const FULL: Self = Self {
        span_s: 0.5,
        max_cost: 1.5e6,
        steps: &[50e-6, 20e-6, 10e-6, 5e-6],
        tolerances: &[1e-2, 1e-3, 5e-4, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10],
        steps_per_impact: &[4.0, 8.0, 12.0, 16.0, 24.0, 32.0],
    };

    /// Settings of every method, from coarse to fine, and the preset with each, if any.
    fn settings(&self, machine: &Machine) -> Vec<(Setting, Option<Preset>)> {
        let presets = Preset::ALL.map(|preset| (Setting::of_preset(preset, machine), preset));
        let mut settings = Vec::new();
        for method in Method::ALL {
            let mut values = match method.control() {
                StepControl::Fixed => self.steps.to_vec(),
                StepControl::Error => self.tolerances.to_vec(),
                StepControl::PerImpact => self.steps_per_impact.to_vec(),
            };
            let of_presets = presets.iter().filter(|(setting, _)| setting.method == method);
            values.extend(of_presets.map(|(setting, _)| setting.value()));
            values.sort_by(|a, b| b.total_cmp(a));
            values.dedup();
            settings.extend(values.into_iter().map(|value| {
                let has = |(other, _): &&(Setting, Preset)| other.method == method && other.value() == value;
                (Setting::new(method, value), presets.iter().find(has).map(|(_, preset)| *preset))
            }));
        }
        settings
    }
}

/// One method at one setting.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Method and its setting.
    pub setting: Setting,
    /// The preset with this setting on this machine, if any.
    pub preset: Option<Preset>,
    /// How the run over the span ended. Unless it reached its end, there is neither time nor cost.
    pub end: End,
    /// Simulated time, s.
    pub span_s: f64,
    /// Clock seconds to step over the span.
    pub time_s: Option<f64>,
    /// Speed relative to Runge-Kutta 4 at 10 microseconds.
    pub ratio: Option<f64>,
    /// Counted cost of the span, in evaluations of the equations: the same on every computer.
    pub cost: Option<f64>,
    /// Counters over the span.
    pub statistics: Statistics,
    /// Errors against the reference.
    pub errors: Errors,
}

impl Row {
    /// Its values by name, as in files: what controls the steps, cost, counters and errors.
    pub fn values(&self) -> Vec<(&'static str, Json)> {
        let Self { setting, statistics, errors, .. } = self;
        let controls = |control: StepControl| setting.method.control() == control;
        vec![
            ("method", json!(setting.method)),
            ("step_s", json!(controls(StepControl::Fixed).then_some(setting.step_s))),
            ("tolerance", json!(controls(StepControl::Error).then_some(setting.tolerance))),
            ("steps_per_impact", json!(controls(StepControl::PerImpact).then_some(setting.steps_per_impact))),
            ("preset", json!(self.preset.map(Preset::word))),
            ("end", json!(self.end.word())),
            ("span_s", json!(self.span_s)),
            ("time_s", json!(self.time_s)),
            ("ratio", json!(self.ratio)),
            ("cost", json!(self.cost)),
            ("steps", json!(statistics.steps)),
            ("evaluations", json!(statistics.evaluations)),
            ("rejected", json!(statistics.rejected)),
            ("peak_error", json!(errors.peak)),
            ("position_error_m", json!(errors.position_m)),
            ("energy_error", json!(errors.energy)),
            ("force_error", json!(errors.force)),
        ]
    }

    /// Whether its peaks err by no more than `limit`; `None` if it did not reach them.
    pub fn keeps(&self, limit: f64) -> Option<bool> {
        self.errors.peak.map(|error| error <= limit)
    }
}

/// All rows of a scene.
#[derive(Clone, Debug)]
pub struct Tradeoff {
    /// The reference solution.
    pub reference: ReferenceSolution,
    /// Rows in the order of the methods, each from coarse to fine.
    pub rows: Vec<Row>,
}

impl Tradeoff {
    /// Runs every method on `scene` at each setting of `grid`, and those of the presets.
    ///
    /// # Errors
    /// A scene without a reference ([`ReferenceSolution::new`]); cancellation by [`RunContext`].
    pub fn measure(scene: &Scene, grid: &Grid, context: &mut RunContext) -> Result<Self, AnalysisError> {
        let settings = grid.settings(&scene.machine);
        let parts = settings.len() + 3;
        let reference = ReferenceSolution::new(scene, &mut context.part(0, parts / 3))?;
        let mut rows = Vec::with_capacity(settings.len());
        for (n, (setting, preset)) in settings.into_iter().enumerate() {
            rows.push(measure(&reference, scene, setting, preset, grid, &mut context.part(n + 3, parts))?);
        }
        let baseline = rows.iter().find(|row| row.setting == Setting::baseline()).and_then(|row| row.time_s);
        for row in &mut rows {
            row.ratio = baseline.zip(row.time_s).map(|(baseline, time)| baseline / time);
        }
        Ok(Self { reference, rows })
    }

    /// The row of a preset.
    pub fn preset(&self, preset: Preset) -> Option<&Row> {
        self.rows.iter().find(|row| row.preset == Some(preset))
    }
}

fn measure(
    reference: &ReferenceSolution,
    scene: &Scene,
    setting: Setting,
    preset: Option<Preset>,
    grid: &Grid,
    context: &mut RunContext,
) -> Result<Row, AnalysisError> {
    let mut row = Row {
        setting,
        preset,
        end: End::Reached,
        span_s: grid.span_s,
        time_s: None,
        ratio: None,
        cost: None,
        statistics: Statistics::default(),
        errors: Errors::default(),
    };
    row.errors = match reference.errors(&setting, grid.max_cost, &mut context.part(0, 2)) {
        Ok(errors) => errors,
        Err(AnalysisError::Start(refused)) => return Ok(Row { end: End::Refused(refused), ..row }),
        Err(error) => return Err(error),
    };
    let (mut shortest, mut all) = (f64::INFINITY, 0.0);
    for _ in 0..MAX_RUNS {
        let mut simulation = setting.start(scene)?;
        let before = context.now();
        row.end = advance_capped(&mut simulation, grid.span_s, grid.max_cost, &mut context.part(1, 2), |_| false)?;
        let time = context.now() - before;
        (shortest, all) = (time.min(shortest), all + time);
        row.cost = Some(simulation.counted_cost());
        row.statistics = simulation.statistics().clone();
        if all >= MEASURED || row.end != End::Reached {
            break;
        }
    }
    row.time_s = Some(shortest);
    if row.end != End::Reached {
        (row.time_s, row.cost) = (None, None);
    }
    Ok(row)
}
