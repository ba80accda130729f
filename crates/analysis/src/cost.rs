//! Computing cost of each part of the model, from scenes with parts added and removed.

use super::timing::clock_time_to;
use super::{AnalysisError, RunContext, Setting, WorkBudget};
use jointplay_physics::integrate::System as _;
use jointplay_physics::machine::Preset;
use jointplay_physics::mechanism::{ActiveSet, Mechanism};
use jointplay_scene::Scene;

/// Solver preset of the runs.
const PRESET: Preset = Preset::Accurate;
/// Evaluations per timed batch.
const BATCH: u32 = 200;
/// Number of timed batches.
const BATCHES: u32 = 40;

/// A variation of a built-in scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CostCase {
    /// Built-in scene.
    pub scene: &'static str,
    /// Difference from the unchanged scene.
    pub label: &'static str,
    /// The parameter changes.
    pub changes: &'static [(&'static str, &'static str)],
    /// Instant of the timed evaluation, s; by then the contacts carry load.
    loaded: f64,
    /// Simulated time of the run, s.
    pub span: f64,
}

const fn spcmm(label: &'static str, changes: &'static [(&'static str, &'static str)]) -> CostCase {
    CostCase { scene: "spcmm", label, changes, loaded: 0.4, span: 0.4 }
}

const fn chain(label: &'static str, changes: &'static [(&'static str, &'static str)]) -> CostCase {
    CostCase { scene: "chain", label, changes, loaded: 2e-3, span: 10e-3 }
}

/// The variations; the first is the baseline.
const PARTS: [CostCase; 11] = [
    spcmm("3 joints with clearance, with friction, tree", &[]),
    spcmm("the same without the energy ledger", &[("solver.energy_ledger", "off")]),
    spcmm("2 joints with clearance", &[("joint.S3.clearance", "0")]),
    spcmm("1 joint with clearance", &[("joint.S2.clearance", "0"), ("joint.S3.clearance", "0")]),
    spcmm("all joints ideal", &[("contact.clearance", "0")]),
    spcmm("3 joints with clearance, without friction", &[("contact.friction", "0")]),
    spcmm("3 joints with clearance, lagrange", &[("formulation", "lagrange")]),
    chain("4 links", &[("chain.links", "4")]),
    chain("16 links", &[("chain.links", "16")]),
    chain("64 links", &[("chain.links", "64")]),
    chain("256 links", &[("chain.links", "256")]),
];

/// Measured cost of a variation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CaseCost {
    /// The variation.
    pub part: CostCase,
    /// Clock seconds per evaluation of the equations of motion.
    pub evaluation_s: f64,
    /// Clock seconds per simulated second over `part.span`.
    pub cost: f64,
    /// Evaluations over that span.
    pub evaluations: u64,
}

/// Measures all variations, with the preset `accurate`.
///
/// # Errors
/// As [`super::work_precision`].
pub fn model_costs(budget: &WorkBudget, context: &mut RunContext) -> Result<Vec<CaseCost>, AnalysisError> {
    let parts = PARTS.iter().enumerate();
    parts.map(|(n, part)| measure(part, budget, &mut context.part(n, PARTS.len()))).collect()
}

fn measure(part: &CostCase, budget: &WorkBudget, context: &mut RunContext) -> Result<CaseCost, AnalysisError> {
    let owned = |(key, value): &(&str, &str)| ((*key).to_owned(), (*value).to_owned());
    let changes: Vec<(String, String)> = part.changes.iter().map(owned).collect();
    let scene = Scene::load(part.scene, &changes)?;
    let setting = Setting::of_preset(PRESET, &scene.machine);
    let mut simulation = setting.start(&scene)?;
    // Counts the evaluations of the whole span, without a cap; the timed runs below cover the same span.
    while simulation.time() < part.span {
        simulation.step_until(part.span)?;
        context.report_progress(0.0)?;
    }
    let evaluations = simulation.statistics().evaluations;
    let seconds = clock_time_to(
        part.span,
        &WorkBudget { evaluations: u64::MAX / 2, seconds: f64::INFINITY, ..*budget },
        context,
        |_| setting.start(&scene),
    )?;
    Ok(CaseCost {
        part: *part,
        evaluation_s: evaluation(&setting, &scene, part.loaded, context)?,
        cost: seconds / part.span,
        evaluations,
    })
}

/// Clock seconds per evaluation at a new instant: the shortest average of several batches.
fn evaluation(setting: &Setting, scene: &Scene, loaded: f64, context: &mut RunContext) -> Result<f64, AnalysisError> {
    let mut simulation = setting.start(scene)?;
    simulation.advance_to(loaded)?;
    let (t, y) = (simulation.time(), simulation.state_vector());
    let mut mechanism = Mechanism::new(simulation.machine()).map_err(jointplay_physics::simulate::StartError)?;
    // The start determines the rank of the constraints.
    mechanism.start().map_err(jointplay_physics::simulate::StartError)?;
    let joints = 0..mechanism.contacts.len();
    let contact_states: Vec<_> = joints.map(|j| simulation.contact_state(j)).collect();
    let mut mechanism = mechanism.evaluator(ActiveSet::Located(&contact_states));
    let mut dy = vec![0.0; y.len()];
    let mut shortest = f64::INFINITY;
    let mut instant = 0.0;
    for _ in 0..BATCHES {
        let before = context.now();
        for _ in 0..BATCH {
            // Drives are re-evaluated only at a new instant.
            instant += 1e-15;
            mechanism.derivative(t + instant, std::hint::black_box(y), &mut dy);
            std::hint::black_box(&mut dy);
        }
        shortest = shortest.min(context.now() - before);
        context.report_progress(1.0)?;
    }
    Ok(shortest / f64::from(BATCH))
}
