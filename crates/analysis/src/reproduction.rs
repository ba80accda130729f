//! Computations for section 4 of the paper, as jobs that any number of threads can run in any order, and their results.

mod findings;
mod record;
mod statements;

pub use findings::{Findings, Report};
pub use record::{
    COLUMNS, NO_REGIME, RecordedRow, RecordedRun, SettledCurve, SettledPoint, SweepData, column_of, derivative,
    exponents, regime_counts,
};
pub use statements::Statement;

use super::axis::Axis;
use super::design::{Design, Start};
use super::paper::{Case, Coordinate, PAPER, Series, Variant};
use super::point::{Plan, resolution};
use super::response::{Observation, ResponseError, derivatives, respond};
use super::sweep::Sweep;
use jointplay_physics::simulate::{Frame, Simulation};
use jointplay_scene::Scene;

/// Points per period of a settled curve.
const CURVE_POINTS: usize = 800;

/// Extent of the computation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Extent {
    /// Periods before a settled curve is recorded.
    pub settle: usize,
    /// Periods of the paper's runs for sections, and how many of them are discarded.
    pub runs: (usize, usize),
    /// Number of clearance and of friction values in the bifurcation diagrams.
    pub values: [usize; 2],
    /// Periods and discarded periods per value.
    pub sweep: (usize, usize),
    /// Number of friction and of clearance values in the map.
    pub map: [usize; 2],
    /// Periods and discarded periods per point.
    pub map_periods: (usize, usize),
}

impl Extent {
    /// The full report.
    pub const FULL: Self =
        Self { settle: 30, runs: (200, 50), values: [100, 40], sweep: (100, 40), map: [16, 16], map_periods: (40, 16) };
    /// A shortened report that shows the layout within a minute.
    pub const QUICK: Self =
        Self { settle: 1, runs: (4, 1), values: [2, 2], sweep: (3, 1), map: [2, 2], map_periods: (2, 1) };
}

/// A run that did not reach its end.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{name}: {error}")]
pub struct RunError {
    /// Name of the run in files.
    pub name: String,
    /// The reason.
    pub error: Box<ResponseError>,
}

/// The jobs of a report.
pub struct Agenda {
    extent: Extent,
    /// Runs of section 4.2 by variant; the last run has ideal joints.
    runs: Vec<PlannedRun>,
    sweeps: Vec<SweepData>,
    jobs: Vec<ReportJob>,
}

struct PlannedRun {
    variant: &'static Variant,
    name: String,
    case: Case,
    scene: Scene,
    /// Whether to record the settled motion, too.
    records_settled: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ReportJob {
    Run(usize),
    Block(usize, usize),
}

/// Result of a job.
pub enum Outcome {
    /// A run of section 4.2.
    Run(Box<RecordedRun>),
    /// Records of a block.
    Block(Vec<f64>),
}

const SCENE: &str = "spcmm";
const LOADS: &str = "a test plans all runs and sweeps";

fn plan_run(variant: &'static Variant, name: &str, case: Case, more: &[(&str, &str)]) -> PlannedRun {
    let more = more.iter().map(|&(k, v)| (k.to_owned(), v.to_owned()));
    let changes = case.changes().into_iter().chain(variant.changes.iter().cloned()).chain(more);
    let scene = Scene::load(SCENE, &changes.collect::<Vec<_>>()).expect(LOADS);
    PlannedRun { variant, name: format!("{}{name}", variant.prefix), case, scene, records_settled: false }
}

fn plan_case(variant: &'static Variant, case: Case, records_settled: bool) -> PlannedRun {
    let name = format!("response_c{}mm_cf{}", case.clearance, case.friction);
    PlannedRun { records_settled, ..plan_run(variant, &name, case, &[]) }
}

/// Name, axes, start, periods and discarded periods of a sweep, and whether it measures exponents.
type SweepRow<'a> = (&'static str, &'a [String], Start, (usize, usize), bool);

fn sweep_data(variant: &'static Variant, row: &SweepRow) -> SweepData {
    let &(name, vary, start, (periods, discard), exponent) = row;
    let scene = plan_run(variant, name, PAPER.runs[0], &[]).scene;
    let axes = vary.iter().map(|text| Axis::parse(&scene, text).expect(LOADS));
    let design = Design::crossed(&scene, axes.collect(), &[start]).expect(LOADS);
    let plan = Plan { periods, discard, phase: 0.0, exponent };
    let sweep = Sweep::new(scene, design, plan).expect(LOADS);
    SweepData { variant, name, plan, sweep, records: Vec::new(), points: Vec::new() }
}

impl Agenda {
    /// All jobs of a report.
    ///
    /// # Panics
    /// If the table of the paper, or `extent`, describes an invalid run or sweep.
    pub fn new(extent: Extent) -> Self {
        let over = |series: Series, count: usize| series.vary(series.row().range, count);
        let [c, f] = Series::ALL.map(|series| [over(series, extent.values[series as usize])]);
        let map = [over(Series::Friction, extent.map[0]), over(Series::Clearance, extent.map[1])];
        let [cases_c, cases_f] = Series::ALL.map(|series| {
            let [first, _, last] = series.cases().map(|case| series.of(case));
            [series.vary([first, last], 3)]
        });
        let (up, down, cold) = (Start::FollowUp, Start::FollowDown, Start::Cold);
        let rows: [SweepRow; 9] = [
            ("runs_by_clearance", &cases_c, cold, extent.runs, true),
            ("runs_by_friction", &cases_f, cold, extent.runs, true),
            ("clearance_up", &c, up, extent.sweep, false),
            ("clearance_down", &c, down, extent.sweep, false),
            ("friction_up", &f, up, extent.sweep, false),
            ("friction_down", &f, down, extent.sweep, false),
            ("clearance_cold", &c, cold, extent.sweep, true),
            ("friction_cold", &f, cold, extent.sweep, true),
            ("map", &map, cold, extent.map_periods, true),
        ];
        let variants = &PAPER.variants;
        let nominal = PAPER.runs[0];
        let (mut runs, mut sweeps) = (Vec::new(), Vec::new());
        for variant in [&variants.corrected, &variants.printed] {
            runs.extend(PAPER.runs.iter().map(|&case| plan_case(variant, case, true)));
            runs.push(plan_run(variant, "lagrange", nominal, &[("formulation", "lagrange")]));
            sweeps.extend(rows.iter().map(|row| sweep_data(variant, row)));
        }
        for variant in &variants.combinations {
            runs.extend(Series::Clearance.cases().map(|case| plan_case(variant, case, false)));
            sweeps.push(sweep_data(variant, &rows[0]));
        }
        runs.push(plan_run(&variants.corrected, "ideal", nominal, &[("contact.clearance", "0")]));
        // Blocks take longest and come first, so that no single thread is left with one at the end.
        let blocks =
            |(s, data): (usize, &SweepData)| (0..data.sweep.design().blocks()).map(move |b| ReportJob::Block(s, b));
        let jobs = sweeps.iter().enumerate().flat_map(blocks).chain((0..runs.len()).map(ReportJob::Run)).collect();
        Self { extent, runs, sweeps, jobs }
    }

    /// Number of jobs.
    pub fn jobs(&self) -> usize {
        self.jobs.len()
    }

    /// The sweeps, without records.
    pub fn sweeps(&self) -> &[SweepData] {
        &self.sweeps
    }

    /// Sweep number and block number of job `job`, if it computes a block.
    pub fn block(&self, job: usize) -> Option<(usize, usize)> {
        match self.jobs[job] {
            ReportJob::Block(s, b) => Some((s, b)),
            _ => None,
        }
    }

    /// Simulated time of a job, s; a twin counts as a second run.
    pub fn length(&self, job: usize) -> f64 {
        let periods = match self.jobs[job] {
            ReportJob::Run(n) if self.runs[n].records_settled => 1 + self.extent.settle + 2,
            ReportJob::Run(_) => 1,
            ReportJob::Block(s, b) => {
                let SweepData { plan, sweep, .. } = &self.sweeps[s];
                let twin = if plan.exponent { 2 } else { 1 };
                twin * plan.periods * sweep.design().block(b).len()
            }
        };
        PAPER.period * periods as f64
    }

    /// Runs job `job`; `may_continue` receives the completed part of [`Self::length`] and returns false to cancel.
    ///
    /// # Errors
    /// A run stopped by the divergence guard; cancellation by `may_continue`. Diverging points of a sweep are not errors.
    pub fn run(&self, job: usize, mut may_continue: impl FnMut(f64) -> bool) -> Result<Outcome, RunError> {
        let failed = |name: &str, error| RunError { name: name.to_owned(), error: Box::new(error) };
        match self.jobs[job] {
            ReportJob::Run(n) => {
                let run = &self.runs[n];
                let recorded =
                    record(run, self.extent.settle, may_continue).map_err(|error| failed(&run.name, error))?;
                Ok(Outcome::Run(Box::new(recorded)))
            }
            ReportJob::Block(s, b) => {
                let SweepData { plan, sweep, .. } = &self.sweeps[s];
                let all = plan.periods as f64;
                let share = self.length(job) / sweep.design().block(b).len() as f64;
                let mut block = sweep.begin(b);
                while !block.is_done() {
                    block.advance(2048);
                    let now = block.current().map_or(0.0, |run| run.taken() as f64 / all);
                    if !may_continue(share * (block.finished().len() as f64 + now)) {
                        return Err(failed(&self.sweeps[s].file_name(), ResponseError::Cancelled));
                    }
                }
                Ok(Outcome::Block(block.records()))
            }
        }
    }

    /// Assembles the outcomes of all jobs, given in job order.
    ///
    /// # Panics
    /// If there is not exactly one outcome for each job.
    pub fn gather(self, outcomes: Vec<Outcome>) -> Report {
        assert_eq!(outcomes.len(), self.jobs.len(), "one outcome for each job");
        let (mut runs, mut sweeps) = (Vec::new(), self.sweeps);
        for (job, outcome) in self.jobs.iter().zip(outcomes) {
            match (*job, outcome) {
                (ReportJob::Run(n), Outcome::Run(run)) => runs.push((self.runs[n].variant, *run)),
                // Blocks of a sweep are in the order of their points.
                (ReportJob::Block(s, _), Outcome::Block(records)) => sweeps[s].records.extend(records),
                _ => unreachable!("a job has an outcome of its kind"),
            }
        }
        sweeps.iter_mut().for_each(SweepData::read_points);
        let (_, ideal) = runs.pop().expect("the last run is the ideal one");
        let nominal = &self.runs[0].scene;
        let all = resolution(&nominal.machine, nominal.machine.solver.tolerance);
        let models = PAPER.variants.all().map(|variant| Findings {
            variant,
            runs: runs.extract_if(.., |(of, _)| *of == variant).map(|(_, run)| run).collect(),
            ideal: ideal.clone(),
            sweeps: sweeps.extract_if(.., |sweep| sweep.variant == variant).collect(),
            resolution: Coordinate::ALL.map(|c| all[c.index()]),
        });
        Report { extent: self.extent, models: models.collect() }
    }
}

/// Records a run of section 4.2, with its settled motion if requested.
fn record(
    run: &PlannedRun,
    settle: usize,
    mut may_continue: impl FnMut(f64) -> bool,
) -> Result<RecordedRun, ResponseError> {
    let mut rows = Vec::new();
    let observe = |observation: &Observation| rows.push(COLUMNS.map(|column| (column.value)(observation)));
    let response = respond(&run.scene, PAPER.period, PAPER.sampling, observe, &mut may_continue)?;
    let settled = run.records_settled.then(|| settled(&run.scene, settle, |time| may_continue(PAPER.period + time)));
    Ok(RecordedRun { name: run.name.clone(), case: run.case, response, rows, settled: settled.transpose()? })
}

/// Settled motion over the second of the two periods after `settle` periods; its width is the difference from the first of the
/// two at equal phases.
fn settled(
    scene: &Scene,
    settle: usize,
    mut may_continue: impl FnMut(f64) -> bool,
) -> Result<SettledCurve, ResponseError> {
    let mut simulation = Simulation::new(&scene.machine)?;
    let mut frame = Frame::default();
    let mut curve = SettledCurve::default();
    for n in 0..=2 * CURVE_POINTS {
        let time = PAPER.period * (settle as f64 + n as f64 / CURVE_POINTS as f64);
        while simulation.time() < time {
            if !may_continue(simulation.time()) {
                return Err(ResponseError::Cancelled);
            }
            simulation.step()?;
        }
        simulation.sample(time, &mut frame);
        let [coordinates, rates, _] = derivatives(&frame.pose);
        for c in Coordinate::ALL {
            curve.coordinates[c as usize].push(coordinates[c.index()]);
            curve.rates[c as usize].push(rates[c.index()]);
        }
    }
    for c in 0..2 {
        let (before, settled) = curve.coordinates[c].split_at(CURVE_POINTS);
        curve.width[c] = before.iter().zip(settled).map(|(a, b)| (b - a).abs()).fold(0.0, f64::max);
        curve.coordinates[c].drain(..CURVE_POINTS);
        curve.rates[c].drain(..CURVE_POINTS);
    }
    Ok(curve)
}

#[cfg(test)]
mod tests {
    use super::{Agenda, Extent};

    #[test]
    fn the_full_report_can_be_planned() {
        assert!(Agenda::new(Extent::FULL).jobs() > Agenda::new(Extent::QUICK).jobs());
    }
}
