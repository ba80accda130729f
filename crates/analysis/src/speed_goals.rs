//! Speed goals of the program: three time spans of the default scene, each with its required speed.

use super::reference_solution::{MeanForces, require_reached};
use super::timing::{advance_capped, clock_time_to};
use super::{AnalysisError, ReferenceSolution, RunContext, Setting, WorkBudget};
use jointplay_physics::simulate::Simulation;
use jointplay_scene::Scene;

/// Tolerance of the automatic method, which must reach the goals.
const TOLERANCE: f64 = 1e-5;
/// Tolerance of the reference run for the settled forces.
const REFERENCE_TOLERANCE: f64 = 1e-10;
/// Allowed relative error of goals whose error is measured.
const ALLOWED_ERROR: f64 = 0.01;
/// Number of instants over which settled forces are averaged.
const SAMPLES: u32 = 3000;

/// One of the three goals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Goal {
    /// 0 to 1 s, impacts included.
    FirstSecond,
    /// 1 s to 4 s, contacts settled.
    Settled,
    /// 0 to 10 s with all joints ideal.
    Ideal,
}

impl Goal {
    /// All goals.
    pub const ALL: [Self; 3] = [Self::FirstSecond, Self::Settled, Self::Ideal];

    /// Display name.
    pub fn label(self) -> &'static str {
        match self {
            Self::FirstSecond => "first second, impacts included",
            Self::Settled => "settled, 1 s to 4 s",
            Self::Ideal => "all joints ideal, 10 s",
        }
    }

    /// Quantity whose error is measured.
    pub fn error_quantity(self) -> &'static str {
        match self {
            Self::FirstSecond => "peaks of the first six impacts",
            Self::Settled => "mean contact forces",
            Self::Ideal => "-",
        }
    }

    /// Required simulated seconds per clock second.
    pub fn required_speed(self) -> f64 {
        match self {
            Self::FirstSecond => 40.0,
            Self::Settled => 300.0,
            Self::Ideal => 2000.0,
        }
    }

    fn span(self) -> (f64, f64) {
        match self {
            Self::FirstSecond => (0.0, 1.0),
            Self::Settled => (1.0, 4.0),
            Self::Ideal => (0.0, 10.0),
        }
    }
}

/// Measured result of a goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GoalResult {
    /// The goal.
    pub goal: Goal,
    /// Method and its setting.
    pub setting: Setting,
    /// Simulated seconds per clock second.
    pub speed: f64,
    /// Speed of Runge-Kutta 4 at 10 microseconds; `None` where no differential equation is solved and the stepper does not
    /// matter.
    pub baseline: Option<f64>,
    /// Relative error; `None` where nothing is approximated.
    pub error: Option<f64>,
}

impl GoalResult {
    /// Whether the goal is met.
    pub fn is_met(&self) -> bool {
        self.speed >= self.goal.required_speed() && self.error.is_none_or(|error| error <= ALLOWED_ERROR)
    }
}

/// Measures all goals on `scene`, the default scene.
///
/// # Errors
/// As [`super::work_precision`].
pub fn measure_speed_goals(scene: &Scene, context: &mut RunContext) -> Result<Vec<GoalResult>, AnalysisError> {
    let goals = Goal::ALL.iter().enumerate();
    goals
        .map(|(n, goal)| {
            let mut scene = scene.clone();
            if *goal == Goal::Ideal {
                scene.set("contact.clearance", "0")?;
            }
            measure_goal(&scene, *goal, &mut context.part(n, Goal::ALL.len()))
        })
        .collect()
}

fn measure_goal(scene: &Scene, goal: Goal, context: &mut RunContext) -> Result<GoalResult, AnalysisError> {
    let setting = Setting::automatic(TOLERANCE);
    let baseline = Setting::baseline();
    let integrates = !setting.start(scene)?.mechanism().is_kinematic();
    let budget = WorkBudget { measured: 0.5, ..WorkBudget::REFERENCE };
    let (from, to) = goal.span();
    let speed = |setting: &Setting, context: &mut RunContext| {
        let start = run_to(setting, scene, from, context, |_| {})?;
        let seconds = clock_time_to(to, &budget, context, |_| Ok(start.clone()))?;
        Ok::<_, AnalysisError>((to - from) / seconds)
    };
    // The setting is timed before and after the baseline, because load from other processes could slow a single measurement.
    let first = speed(&setting, &mut context.part(0, 4))?;
    let baseline = if integrates { Some(speed(&baseline, &mut context.part(1, 4))?) } else { None };
    let second = speed(&setting, &mut context.part(2, 4))?;
    let mut last = context.part(3, 4);
    let error = match goal {
        Goal::FirstSecond => {
            let reference = ReferenceSolution::new(scene, &mut last)?;
            let (_, errors, _) = reference.impact_errors(&setting, &budget, &mut last)?;
            errors.peak
        }
        Goal::Settled => {
            let converged = Setting::reference(REFERENCE_TOLERANCE);
            let expected = mean_forces(&converged, scene, (from, to), &mut last)?;
            let means = mean_forces(&setting, scene, (from, to), &mut last)?;
            let pairs = means.iter().zip(&expected);
            pairs.map(|(mean, expected)| (mean / expected - 1.0).abs()).reduce(f64::max)
        }
        Goal::Ideal => None,
    };
    Ok(GoalResult { goal, setting, speed: first.max(second), baseline, error })
}

/// Runs from the start to `end`; `after_step` is called after every step.
fn run_to(
    setting: &Setting,
    scene: &Scene,
    end: f64,
    context: &mut RunContext,
    mut after_step: impl FnMut(&mut Simulation),
) -> Result<Simulation, AnalysisError> {
    let mut simulation = setting.start(scene)?;
    let observe = |simulation: &mut Simulation| {
        after_step(simulation);
        false
    };
    let outcome = advance_capped(&mut simulation, end, &WorkBudget::REFERENCE, context, observe)?;
    require_reached(outcome)?;
    Ok(simulation)
}

fn mean_forces(
    setting: &Setting,
    scene: &Scene,
    span: (f64, f64),
    context: &mut RunContext,
) -> Result<Vec<f64>, AnalysisError> {
    let mut forces = MeanForces::new(scene, span, SAMPLES);
    run_to(setting, scene, span.1, context, |simulation| forces.sample_step(simulation))?;
    Ok(forces.means)
}
