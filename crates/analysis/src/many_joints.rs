//! Speed of machines with loose joints: the fastest settings that reproduce the peaks of the first impacts.

use super::timing::clock_time_to;
use super::{AnalysisError, ReferenceSolution, RunContext, Setting, WorkBudget};
use jointplay_physics::integrate::Method;
use jointplay_scene::Scene;

/// Tolerance of the reference solution.
const REFERENCE: f64 = 1e-9;
/// Steps per impact to try, fastest first.
const STEPS_PER_IMPACT: [f64; 12] = [3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 16.0, 24.0, 32.0, 48.0, 64.0];
/// Tolerances to try, fastest first.
const TOLERANCES: [f64; 8] = [1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 1e-5, 1e-6, 1e-7];
const BUDGET: WorkBudget = WorkBudget { measured: 0.3, ..WorkBudget::REFERENCE };
/// Allowed errors of the first peaks.
pub const LIMITS: [f64; 2] = [0.02, 0.08];

/// A machine whose speed is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LooseMachine {
    /// Display name.
    pub label: &'static str,
    scene: &'static str,
    changes: &'static [(&'static str, &'static str)],
    /// Simulated time, s.
    pub span: f64,
}

const fn machine(
    label: &'static str,
    scene: &'static str,
    changes: &'static [(&'static str, &'static str)],
    span: f64,
) -> LooseMachine {
    LooseMachine { label, scene, changes, span }
}

/// All measured machines.
pub const LOOSE_MACHINES: [LooseMachine; 7] = [
    machine("chain of 8", "chain", &[("chain.links", "8")], 0.1),
    machine("chain of 32", "chain", &[("chain.links", "32")], 0.1),
    machine("hexapod, 12 loose", "hexapod", &[], 1.0),
    machine("hexapod, 1 loose", "hexapod", &[("contact.clearance", "0"), ("joint.A6.clearance", "0.1 mm")], 1.0),
    // Only their balls hold the rods.
    machine("delta, 12 loose", "delta", &[("parameter.grip", "0.001 N")], 0.5),
    machine("four-bar, 2 loose", "four-bar", &[], 1.0),
    machine("suspension, 4 loose", "suspension", &[], 1.0),
];

/// Comparison of two chains by cost per link and simulated second: numbers of links, span in s, and allowed ratio.
pub const GROWTH: ([u32; 2], f64, f64) = ([32, 256], 10e-3, 1.5);

impl LooseMachine {
    /// Loads the machine.
    ///
    /// # Errors
    /// A mistake in the text of the scene or in the changes.
    pub fn load(&self) -> Result<Scene, AnalysisError> {
        let owned = |(key, value): &(&str, &str)| ((*key).to_owned(), (*value).to_owned());
        let changes: Vec<_> = self.changes.iter().map(owned).collect();
        Ok(Scene::load(self.scene, &changes)?)
    }
}

/// A setting with its error and its speed on a machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timed {
    /// Method and its accuracy setting.
    pub setting: Setting,
    /// Largest relative error of the first peaks; `None` if the run did not reach them.
    pub error: Option<f64>,
    /// Simulated seconds per clock second.
    pub speed: f64,
}

/// Measured speed of a machine.
#[derive(Clone, Debug, PartialEq)]
pub struct LooseSpeed {
    /// The machine.
    pub machine: LooseMachine,
    /// For each of [`LIMITS`], the fastest setting of each method that stays within it, the faster method first.
    pub fastest: [Vec<Timed>; LIMITS.len()],
    /// Runge-Kutta 4 at 10 microseconds, measured in the same run.
    pub baseline: Timed,
}

/// Measures one machine.
///
/// # Errors
/// As [`super::work_precision`].
pub fn loose_speed(machine: LooseMachine, context: &mut RunContext) -> Result<LooseSpeed, AnalysisError> {
    let scene = machine.load()?;
    let reference = ReferenceSolution::of_impacts(&scene, REFERENCE, &mut context.part(0, 2))?;
    let mut context = context.part(1, 2);
    let candidates = [(Method::DiscreteGradient, &STEPS_PER_IMPACT[..]), (Method::Automatic, &TOLERANCES[..])];
    let mut timed: Vec<Timed> = Vec::new();
    let mut time = |setting: Setting, error: Option<f64>, context: &mut RunContext| {
        if let Some(measured) = timed.iter().find(|measured| measured.setting == setting) {
            return Ok::<_, AnalysisError>(*measured);
        }
        let seconds = clock_time_to(machine.span, &BUDGET, context, |_| setting.start(&scene))?;
        timed.push(Timed { setting, error, speed: machine.span / seconds });
        Ok(timed[timed.len() - 1])
    };
    let mut fastest = LIMITS.map(|_| Vec::new());
    for (method, values) in candidates {
        let mut errors = Vec::with_capacity(values.len());
        for value in values {
            let setting = Setting::new(method, *value);
            errors.push((setting, reference.impact_errors(&setting, &BUDGET, &mut context)?.1.peak));
        }
        for (limit, fastest) in LIMITS.into_iter().zip(&mut fastest) {
            let within = errors.iter().find(|(_, error)| error.is_some_and(|error| error <= limit));
            if let Some((setting, error)) = within {
                fastest.push(time(*setting, *error, &mut context)?);
            }
        }
    }
    let baseline = Setting::baseline();
    let error = reference.impact_errors(&baseline, &BUDGET, &mut context)?.1.peak;
    let baseline = time(baseline, error, &mut context)?;
    for fastest in &mut fastest {
        fastest.sort_by(|a, b| b.speed.total_cmp(&a.speed));
    }
    Ok(LooseSpeed { machine, fastest, baseline })
}

/// Cost of the longer chain of [`GROWTH`] over cost of the shorter, each in clock seconds per link and simulated second, with
/// 16 steps per impact.
///
/// # Errors
/// As [`loose_speed`].
pub fn growth(context: &mut RunContext) -> Result<f64, AnalysisError> {
    let (links, span, _) = GROWTH;
    let setting = Setting::new(Method::DiscreteGradient, 16.0);
    let mut cost = [0.0; 2];
    for (n, (links, cost)) in links.into_iter().zip(&mut cost).enumerate() {
        let mut scene = Scene::load("chain", &[])?;
        scene.set("chain.links", &links.to_string())?;
        let mut context = context.part(n, 2);
        *cost = clock_time_to(span, &BUDGET, &mut context, |_| setting.start(&scene))? / f64::from(links);
    }
    Ok(cost[1] / cost[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_machine_has_the_number_of_loose_joints_in_its_label() {
        for machine in LOOSE_MACHINES {
            let scene = machine.load().unwrap_or_else(|e| panic!("{}: {e}", machine.label));
            let loose = scene.machine.joints_with_clearance();
            let count = loose.to_string();
            assert!(machine.label.split([' ', ',']).any(|word| word == count), "{}: {count}", machine.label);
        }
    }
}
