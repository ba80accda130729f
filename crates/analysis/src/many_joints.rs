//! Speed goals of machines with many loose joints, at the loosest tolerance that reproduces the peaks of the first impacts.

use super::timing::time_to;
use super::{AnalysisError, ReferenceSolution, RunContext, Setting, WorkBudget};
use jointplay_scene::Scene;

/// Tolerance of the reference.
const REFERENCE: f64 = 1e-9;
/// Tolerances tried, from the loosest that raises no doubt; and the acceptable relative error of the peaks.
const TOLERANCES: [f64; 13] = [1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5, 5e-6, 2e-6, 1e-6, 5e-7, 2e-7, 1e-7];
const ALLOWED: f64 = 0.01;
const BUDGET: WorkBudget = WorkBudget { measured: 0.1, ..WorkBudget::REFERENCE };

/// A machine and the speed required of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedGoal {
    /// Display name.
    pub label: &'static str,
    scene: &'static str,
    changes: &'static [(&'static str, &'static str)],
    /// Simulated time, s.
    pub span: f64,
    /// Required simulated seconds per clock second.
    pub asked: f64,
}

const fn goal(
    label: &'static str,
    scene: &'static str,
    changes: &'static [(&'static str, &'static str)],
    span: f64,
    asked: f64,
) -> SpeedGoal {
    SpeedGoal { label, scene, changes, span, asked }
}

/// All speed goals.
pub const SPEED_GOALS: [SpeedGoal; 7] = [
    goal("chain of 8", "chain", &[("chain.links", "8")], 0.1, 5.0),
    goal("chain of 32", "chain", &[("chain.links", "32")], 0.1, 1.0),
    goal("hexapod, 12 loose", "hexapod", &[], 1.0, 12.0),
    goal("hexapod, 1 loose", "hexapod", &[("contact.clearance", "0"), ("joint.A6.clearance", "0.1 mm")], 1.0, 40.0),
    // The rods are held by their balls alone.
    goal("delta, 12 loose", "delta", &[("parameter.grip", "0.001 N")], 0.5, 6.0),
    goal("four-bar, 2 loose", "four-bar", &[], 1.0, 120.0),
    goal("suspension, 4 loose", "suspension", &[], 1.0, 40.0),
];

/// Numbers of links of two chains whose costs per link and simulated second are compared, the span in s, and the allowed ratio.
pub const GROWTH: ([u32; 2], f64, f64) = ([32, 256], 10e-3, 1.5);

impl SpeedGoal {
    /// Loads the machine.
    ///
    /// # Errors
    /// Only a mistake in the machine's text or the changes.
    pub fn load(&self) -> Result<Scene, AnalysisError> {
        let owned = |(key, value): &(&str, &str)| ((*key).to_owned(), (*value).to_owned());
        let changes: Vec<_> = self.changes.iter().map(owned).collect();
        Ok(Scene::load(self.scene, &changes)?)
    }
}

/// A measured result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Speed {
    /// The machine.
    pub goal: SpeedGoal,
    /// The loosest tolerance with good peaks; the tightest one tried if none has them.
    pub tolerance: f64,
    /// Largest relative error of the first peaks at that tolerance; `None` if the run did not get that far.
    pub error: Option<f64>,
    /// Simulated seconds per clock second.
    pub speed: f64,
}

impl Speed {
    /// Whether the goal is met.
    pub fn met(&self) -> bool {
        self.speed >= self.goal.asked && self.error.is_some_and(|error| error <= ALLOWED)
    }
}

/// Measures the speed of the automatic selection of methods on one machine.
///
/// # Errors
/// As [`super::work_precision`].
pub fn speed(goal: SpeedGoal, context: &mut RunContext) -> Result<Speed, AnalysisError> {
    let scene = goal.load()?;
    let reference = ReferenceSolution::of_impacts(&scene, REFERENCE, &mut context.part(0, 2))?;
    let mut context = context.part(1, 2);
    let (mut tolerance, mut error) = (TOLERANCES[0], None);
    for tried in TOLERANCES {
        let setting = Setting::automatic(tried);
        let (_, errors, _) = reference.impacts_of(&setting, &BUDGET, &mut context)?;
        (tolerance, error) = (tried, errors.peak);
        if error.is_some_and(|error| error <= ALLOWED) {
            break;
        }
    }
    let setting = Setting::automatic(tolerance);
    let seconds = time_to(goal.span, &BUDGET, &mut context, |_| setting.start(&scene))?;
    Ok(Speed { goal, tolerance, error, speed: goal.span / seconds })
}

/// Clock seconds per link and simulated second of the longer chain of [`GROWTH`] over those of the shorter, at `tolerance`.
///
/// # Errors
/// As [`speed`].
pub fn growth(tolerance: f64, context: &mut RunContext) -> Result<f64, AnalysisError> {
    let (links, span, _) = GROWTH;
    let setting = Setting::automatic(tolerance);
    let mut cost = [0.0; 2];
    for (n, (links, cost)) in links.into_iter().zip(&mut cost).enumerate() {
        let mut scene = Scene::load("chain", &[])?;
        scene.set("chain.links", &links.to_string())?;
        let mut context = context.part(n, 2);
        *cost = time_to(span, &BUDGET, &mut context, |_| setting.start(&scene))? / f64::from(links);
    }
    Ok(cost[1] / cost[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_machine_has_the_loose_joints_that_it_is_named_for() {
        for goal in SPEED_GOALS {
            let scene = goal.load().unwrap_or_else(|e| panic!("{}: {e}", goal.label));
            let loose = scene.machine.ball_joints.iter().filter(|joint| joint.contact.clearance > 0.0);
            let count = loose.count().to_string();
            assert!(goal.label.split([' ', ',']).any(|word| word == count), "{}: {count}", goal.label);
        }
    }
}
