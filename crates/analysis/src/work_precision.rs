//! Work-precision data: cost and error of every method on one scene.

use serde::Serialize;

use super::reference_solution::PhaseCost;
use super::timing::clock_time_to;
use super::{AnalysisError, End, Errors, ReferenceSolution, RunContext, Setting, WorkBudget, front};
use jointplay_physics::integrate::{Method, StepControl};
use jointplay_physics::machine::{Machine, Preset};
use jointplay_scene::Scene;

/// A run over the first impacts, or in settled motion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Phase {
    /// How the run ended. Unless it reached its end, there is no time and no error.
    pub end: End,
    /// Simulated time, s.
    pub simulated_s: f64,
    /// Clock seconds to step over the phase.
    pub wall_s: Option<f64>,
    /// Speed relative to Runge-Kutta 4 at 10 microseconds over the same span, measured alongside it.
    pub ratio: Option<f64>,
    /// Accepted steps.
    pub steps: u64,
    /// Evaluations of the equations of motion.
    pub evaluations: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Whether the point is on the Pareto front: no other point is both faster and more accurate in this phase.
    pub front: bool,
}

impl Phase {
    /// Simulated seconds per clock second.
    pub fn speed(&self) -> Option<f64> {
        self.wall_s.filter(|wall| *wall > 0.0).map(|wall| self.simulated_s / wall)
    }

    /// Clock seconds per simulated second.
    pub fn cost(&self) -> Option<f64> {
        self.wall_s.map(|wall| wall / self.simulated_s)
    }
}

/// One method at one setting.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Point {
    /// Method and its setting.
    pub setting: Setting,
    /// The preset with this setting, if any.
    pub preset: Option<Preset>,
    /// The first impacts.
    pub impacts: Phase,
    /// Settled motion, if the scene reaches it.
    pub settled: Option<Phase>,
    /// Errors against the reference.
    pub errors: Errors,
}

/// Selects a phase of a point and the relative error in it.
pub type View = fn(&Point) -> Option<(&Phase, f64)>;

impl Point {
    /// The first impacts and the error of the peak forces.
    pub fn in_impacts(&self) -> Option<(&Phase, f64)> {
        Some((&self.impacts, self.errors.peak?))
    }

    /// Settled motion and the error of the mean forces.
    pub fn in_settled(&self) -> Option<(&Phase, f64)> {
        Some((self.settled.as_ref()?, self.errors.settled?))
    }
}

/// All points of a scene.
#[derive(Clone, Debug)]
pub struct WorkPrecision {
    /// The reference solution.
    pub reference: ReferenceSolution,
    /// Points in the order of the methods, each method from coarse to fine.
    pub points: Vec<Point>,
}

impl WorkPrecision {
    /// The point of a preset.
    pub fn preset(&self, preset: Preset) -> Option<&Point> {
        self.points.iter().find(|p| p.preset == Some(preset))
    }

    /// The fastest point over the first impacts with a peak-force error of at most `error`.
    pub fn fastest_within(&self, error: f64) -> Option<&Point> {
        self.fastest(Point::in_impacts, error)
    }

    /// The fastest point in settled motion with a mean-force error of at most `error`.
    pub fn fastest_settled_within(&self, error: f64) -> Option<&Point> {
        self.fastest(Point::in_settled, error)
    }

    fn fastest(&self, view: View, limit: f64) -> Option<&Point> {
        let cost = |point: &Point| {
            let (phase, error) = view(point)?;
            (error <= limit).then(|| phase.wall_s.unwrap_or(f64::INFINITY))
        };
        let good = self.points.iter().filter_map(|p| Some((p, cost(p)?)));
        let fastest = good.min_by(|a, b| a.1.total_cmp(&b.1));
        fastest.map(|(point, _)| point)
    }
}

/// Runs every method at each of its settings, including those of the presets.
///
/// # Errors
/// A scene without a reference ([`ReferenceSolution::new`]); cancellation by [`RunContext`].
pub fn work_precision(
    scene: &Scene,
    budget: &WorkBudget,
    context: &mut RunContext,
) -> Result<WorkPrecision, AnalysisError> {
    let settings = grid(&scene.machine, budget)?;
    let parts = settings.len() + 3;
    let reference = ReferenceSolution::new(scene, &mut context.part(0, parts))?;
    let mut points = Vec::with_capacity(settings.len());
    let mut baseline = Baseline::new(&reference, budget, &mut context.part(1, parts))?;
    for (n, (setting, preset)) in settings.into_iter().enumerate() {
        let mut part = context.part(2 + n, parts);
        let mut point = measure(&reference, setting, budget, &mut part)?;
        point.preset = preset;
        points.push(point);
    }
    // The baseline is timed again after the points, so that other load on the machine affects the baseline and the points
    // alike.
    baseline.measure_again(&reference, budget, &mut context.part(parts - 1, parts))?;
    for point in &mut points {
        baseline.set_ratios(point);
    }
    mark_fronts(&mut points, &reference.floor);
    Ok(WorkPrecision { reference, points })
}

/// Settings of every method, including those of the presets.
fn grid(machine: &Machine, budget: &WorkBudget) -> Result<Vec<(Setting, Option<Preset>)>, AnalysisError> {
    let mut presets = Vec::new();
    for preset in Preset::ALL {
        presets.push((Setting::of_preset(preset, machine), preset));
    }
    let mut settings = Vec::new();
    for method in Method::ALL {
        let mut values = match method.control() {
            StepControl::Fixed => budget.steps.to_vec(),
            StepControl::Error => budget.tolerances.to_vec(),
            StepControl::PerImpact => budget.steps_per_impact.to_vec(),
        };
        let of_presets = presets.iter().filter(|(setting, _)| setting.method == method);
        values.extend(of_presets.map(|(setting, _)| setting.value()));
        values.sort_by(|a, b| b.total_cmp(a));
        values.dedup();
        for value in values {
            let setting = Setting::new(method, value);
            let preset = presets.iter().find(|(other, _)| other.method == method && other.value() == value);
            settings.push((setting, preset.map(|(_, preset)| *preset)));
        }
    }
    Ok(settings)
}

/// Runs one setting and compares it with `reference`: errors, work and time, without ratios and fronts.
pub(super) fn measure(
    reference: &ReferenceSolution,
    setting: Setting,
    budget: &WorkBudget,
    context: &mut RunContext,
) -> Result<Point, AnalysisError> {
    let (end, mut errors, work) = match reference.impact_errors(&setting, budget, context) {
        Ok(measured) => measured,
        Err(AnalysisError::Start(refused)) => {
            let (end, none) = (End::Refused(refused), PhaseCost::default());
            return Ok(Point {
                setting,
                preset: None,
                impacts: phase(end, reference.span, None, &none),
                settled: None,
                errors: Errors::default(),
            });
        }
        Err(error) => return Err(error),
    };
    let wall = match end {
        End::Reached => Some(clock_time_to(reference.span, budget, context, |_| setting.start(reference.scene()))?),
        _ => None,
    };
    let impacts = phase(end, reference.span, wall, &work);
    let mut settled = None;
    if let Some((end, error, work)) = reference.settled_error(&setting, budget, context)?
        && let Some(span) = &reference.settled
    {
        errors.settled = error;
        let wall = match end {
            End::Reached => Some(clock_time_to(span.to, budget, context, |context| {
                Ok(reference.resume(span, &setting, budget, context)?.1)
            })?),
            _ => None,
        };
        settled = Some(phase(end, span.to - span.from, wall, &work));
    }
    Ok(Point { setting, preset: None, impacts, settled, errors })
}

fn phase(end: End, simulated_s: f64, wall_s: Option<f64>, work: &PhaseCost) -> Phase {
    Phase {
        end,
        simulated_s,
        wall_s,
        ratio: None,
        steps: work.steps,
        evaluations: work.evaluations,
        rejected: work.rejected,
        front: false,
    }
}

/// Shortest times so far of Runge-Kutta 4 at 10 microseconds over both phases, s.
pub(super) struct Baseline {
    setting: Setting,
    impacts: Option<f64>,
    settled: Option<f64>,
}

impl Baseline {
    pub(super) fn new(
        reference: &ReferenceSolution,
        budget: &WorkBudget,
        context: &mut RunContext,
    ) -> Result<Self, AnalysisError> {
        let mut baseline = Self { setting: Setting::baseline(), impacts: None, settled: None };
        baseline.measure_again(reference, budget, context)?;
        Ok(baseline)
    }

    pub(super) fn measure_again(
        &mut self,
        reference: &ReferenceSolution,
        budget: &WorkBudget,
        context: &mut RunContext,
    ) -> Result<(), AnalysisError> {
        let point = measure(reference, self.setting, budget, context)?;
        let shorter = |a: Option<f64>, b: Option<f64>| match (a, b) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
        self.impacts = shorter(self.impacts, point.impacts.wall_s);
        self.settled = shorter(self.settled, point.settled.and_then(|p| p.wall_s));
        Ok(())
    }

    pub(super) fn set_ratios(&self, point: &mut Point) {
        let ratio = |wall: Option<f64>, baseline: Option<f64>| Some(baseline? / wall.filter(|w| *w > 0.0)?);
        point.impacts.ratio = ratio(point.impacts.wall_s, self.impacts);
        if let Some(settled) = &mut point.settled {
            settled.ratio = ratio(settled.wall_s, self.settled);
        }
    }
}

fn mark_fronts(points: &mut [Point], floor: &Errors) {
    let on_front = |view: View, floor: Option<f64>| {
        let pair = |point| {
            let selected = view(point);
            selected.map_or((f64::INFINITY, f64::NAN), |(phase, error)| (phase.wall_s.unwrap_or(f64::INFINITY), error))
        };
        let pairs: Vec<_> = points.iter().map(pair).collect();
        front(&pairs, floor.unwrap_or(0.0))
    };
    let impacts = on_front(Point::in_impacts, floor.peak);
    let settled = on_front(Point::in_settled, floor.settled);
    for ((point, impacts), settled) in points.iter_mut().zip(impacts).zip(settled) {
        point.impacts.front = impacts;
        if let Some(phase) = &mut point.settled {
            phase.front = settled;
        }
    }
}
