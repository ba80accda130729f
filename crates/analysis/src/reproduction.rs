//! All computations for section 4 of the paper, as jobs that any number of threads may run in any order, and their results.

mod findings;
mod record;
mod statements;

pub use findings::{Combination, Findings, Report};
use record::row;
pub use record::{
    COLUMNS, Column, RecordedRow, RecordedRun, SettledCurve, SettledPoint, SweepData, column_of, derivative, exponents,
};
pub use statements::{Grounds, LITTLE, Statement};

use super::grid::{Grid, ParameterRange, RangeError, Start};
use super::paper::{Case, Coordinate, PAPER, Series, Variant};
use super::point::{Plan, resolution};
use super::response::{Observation, Response, ResponseError, derivatives, respond};
use super::sweep::{Sweep, SweepError};
use jointplay_physics::simulate::{Frame, Simulation};
use jointplay_scene::{Scene, SceneError};

/// Points per period of a settled curve.
const CURVE_POINTS: usize = 800;

/// Extent of the computation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Extent {
    /// Periods run before a settled curve is taken.
    pub settle: usize,
    /// Periods of the paper's runs, and how many of them are discarded.
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

/// Why there is no report.
#[derive(Clone, Debug, thiserror::Error)]
pub enum ReproductionError {
    /// A scene that does not load.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// An invalid axis.
    #[error(transparent)]
    Range(#[from] RangeError),
    /// An invalid sweep.
    #[error(transparent)]
    Sweep(#[from] SweepError),
    /// A run that did not reach its end.
    #[error("{name}: {error}")]
    Run {
        /// Its name in files.
        name: String,
        /// Why.
        error: Box<ResponseError>,
    },
}

/// The work of a report.
pub struct Agenda {
    extent: Extent,
    /// Runs of section 4.2 by name: for each variant in the order of [`PAPER`], then with all bodies and multipliers; for
    /// each combination by clearance; with ideal joints.
    runs: Vec<(String, Case, Scene)>,
    /// Scenes of the settled curves, for each variant in the order of [`PAPER`].
    curves: Vec<(Case, Scene)>,
    /// [`SWEEPS`] for each variant, one for each combination.
    sweeps: Vec<SweepData>,
    jobs: Vec<ReportJob>,
}

/// Number of sweeps per variant.
const SWEEPS: usize = 9;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ReportJob {
    Run(usize),
    Curve(usize),
    Block(usize, usize),
}

/// Result of a job.
pub enum Outcome {
    /// A run of section 4.2.
    Run(Box<(Response, Vec<RecordedRow>)>),
    /// A settled curve.
    Curve(SettledCurve),
    /// Records of a block.
    Block(Vec<f64>),
}

const SCENE: &str = "spcmm";

fn scene(variant: &Variant, case: Case, more: &[(&str, &str)]) -> Result<Scene, SceneError> {
    let more = more.iter().map(|&(k, v)| (k.to_owned(), v.to_owned()));
    let changes = case.changes().into_iter();
    let changes = changes.chain(variant.changes.iter().cloned()).chain(more);
    Scene::load(SCENE, &changes.collect::<Vec<_>>())
}

fn sweep_data(
    variant: &'static Variant,
    name: &'static str,
    case: Case,
    vary: &[String],
    start: Start,
    (periods, discard): (usize, usize),
    exponent: bool,
) -> Result<SweepData, ReproductionError> {
    let scene = scene(variant, case, &[])?;
    let axes = vary.iter().map(|text| ParameterRange::parse(&scene, text));
    let grid = Grid::new(&scene, axes.collect::<Result<Vec<_>, _>>()?, start)?;
    let plan = Plan { periods, discard, phase: 0.0, exponent };
    Ok(SweepData { variant, name, sweep: Sweep::new(scene, grid, plan)?, records: Vec::new(), points: Vec::new() })
}

impl Agenda {
    /// All jobs of a report.
    ///
    /// # Errors
    /// An extent that gives an invalid sweep.
    pub fn new(extent: Extent) -> Result<Self, ReproductionError> {
        let variants = &PAPER.variants;
        let both = [&variants.corrected, &variants.printed];
        let mut runs = Vec::new();
        let mut run = |variant: &Variant, name: String, case: Case, more: &[(&str, &str)]| {
            let name = format!("{}{name}", variant.prefix);
            runs.push((name, case, scene(variant, case, more)?));
            Ok::<_, SceneError>(())
        };
        let mut curves = Vec::new();
        let nominal = PAPER.runs[0];
        for variant in both {
            for &case in &PAPER.runs {
                run(variant, file_name(case), case, &[])?;
                curves.push((case, scene(variant, case, &[])?));
            }
            let multipliers = [("formulation", "lagrange")];
            run(variant, "lagrange".to_owned(), nominal, &multipliers)?;
        }
        for variant in &variants.combinations {
            for case in Series::Clearance.cases() {
                run(variant, file_name(case), case, &[])?;
            }
        }
        let closed = [("contact.clearance", "0")];
        run(both[0], "ideal".to_owned(), nominal, &closed)?;
        let over = |series: Series, count: usize| series.vary(series.row().range, count);
        let [c, f] = Series::ALL.map(|series| vec![over(series, extent.values[series as usize])]);
        let [map_f, map_c] = extent.map;
        let map = vec![over(Series::Friction, map_f), over(Series::Clearance, map_c)];
        let cases = Series::ALL.map(|series| {
            let [first, _, last] = series.cases().map(|case| series.of(case));
            vec![series.vary([first, last], 3)]
        });
        let (up, down, cold) = (Start::FollowUp, Start::FollowDown, Start::Cold);
        let (runs_of, sweep_of) = (extent.runs, extent.sweep);
        let sweeps: [_; SWEEPS] = [
            ("runs_by_clearance", &cases[0], cold, runs_of, true),
            ("runs_by_friction", &cases[1], cold, runs_of, true),
            ("clearance_up", &c, up, sweep_of, false),
            ("clearance_down", &c, down, sweep_of, false),
            ("friction_up", &f, up, sweep_of, false),
            ("friction_down", &f, down, sweep_of, false),
            ("clearance_cold", &c, cold, sweep_of, true),
            ("friction_cold", &f, cold, sweep_of, true),
            ("map", &map, cold, extent.map_periods, true),
        ];
        let of = |variant, &(name, vary, start, periods, exponent): &(_, &Vec<String>, _, _, _)| {
            sweep_data(variant, name, nominal, vary, start, periods, exponent)
        };
        let all = both.into_iter();
        let all = all.flat_map(|variant| sweeps.iter().map(move |s| (variant, s)));
        let combinations = variants.combinations.iter();
        let all = all.chain(combinations.map(|variant| (variant, &sweeps[0])));
        let sweeps = all.map(|(variant, s)| of(variant, s)).collect::<Result<Vec<_>, ReproductionError>>()?;
        // Blocks take longest and come first, so that no thread is left with one at the end.
        let mut jobs: Vec<ReportJob> = Vec::new();
        for (s, data) in sweeps.iter().enumerate() {
            jobs.extend((0..data.sweep.grid().blocks()).map(|b| ReportJob::Block(s, b)));
        }
        jobs.extend((0..curves.len()).map(ReportJob::Curve));
        jobs.extend((0..runs.len()).map(ReportJob::Run));
        Ok(Self { extent, runs, curves, sweeps, jobs })
    }

    /// Number of jobs.
    pub fn jobs(&self) -> usize {
        self.jobs.len()
    }

    /// Its sweeps, without records.
    pub fn sweeps(&self) -> &[SweepData] {
        &self.sweeps
    }

    /// Sweep number and block number that job `job` computes, if any.
    pub fn block(&self, job: usize) -> Option<(usize, usize)> {
        match self.jobs[job] {
            ReportJob::Block(s, b) => Some((s, b)),
            _ => None,
        }
    }

    /// Simulated time of a job, s; a twin counts as a second run.
    pub fn length(&self, job: usize) -> f64 {
        match self.jobs[job] {
            ReportJob::Run(_) => PAPER.period,
            ReportJob::Curve(_) => PAPER.period * (self.extent.settle + 2) as f64,
            ReportJob::Block(s, b) => {
                let sweep = &self.sweeps[s].sweep;
                let twin = if sweep.plan().exponent { 2.0 } else { 1.0 };
                let points = sweep.grid().block(b).len();
                PAPER.period * twin * (sweep.plan().periods * points) as f64
            }
        }
    }

    /// Runs job `job`; `go_on` receives how much of [`Self::length`] is done and returns false to cancel.
    ///
    /// # Errors
    /// A run stopped by the divergence guard; cancellation by `go_on`. Points of a sweep that diverge are no error.
    pub fn run(&self, job: usize, mut go_on: impl FnMut(f64) -> bool) -> Result<Outcome, ReproductionError> {
        let failed = |name: &str, error| ReproductionError::Run { name: name.to_owned(), error: Box::new(error) };
        match self.jobs[job] {
            ReportJob::Run(n) => {
                let (name, _, scene) = &self.runs[n];
                let mut rows = Vec::new();
                let observe = |look: &Observation| rows.push(row(look));
                let response = respond(scene, PAPER.period, PAPER.sampling, observe, go_on);
                let response = response.map_err(|e| failed(name, e))?;
                Ok(Outcome::Run(Box::new((response, rows))))
            }
            ReportJob::Curve(n) => {
                let (case, scene) = &self.curves[n];
                let curve = curve(*case, scene, self.extent.settle, go_on);
                Ok(Outcome::Curve(curve.map_err(|e| failed("settled curve", e))?))
            }
            ReportJob::Block(s, b) => {
                let sweep = &self.sweeps[s].sweep;
                let all = sweep.plan().periods as f64;
                let share = self.length(job) / sweep.grid().block(b).len() as f64;
                let mut block = sweep.begin(b);
                while !block.is_done() {
                    block.advance(2048);
                    let now = block.current().map_or(0.0, |run| run.taken() as f64 / all);
                    if !go_on(share * (block.finished().len() as f64 + now)) {
                        return Err(failed(&self.sweeps[s].file_name(), ResponseError::Cancelled));
                    }
                }
                Ok(Outcome::Block(block.records()))
            }
        }
    }

    /// Assembles the outcomes of all jobs, in job order.
    ///
    /// # Panics
    /// If there is not one outcome for each job.
    pub fn gather(mut self, outcomes: Vec<Outcome>) -> Report {
        assert_eq!(outcomes.len(), self.jobs.len(), "an outcome a job");
        let mut runs = Vec::new();
        let mut curves = Vec::new();
        for (job, outcome) in self.jobs.iter().zip(outcomes) {
            match (job, outcome) {
                (ReportJob::Run(n), Outcome::Run(found)) => {
                    let (name, case, _) = &self.runs[*n];
                    let (response, rows) = *found;
                    runs.push(RecordedRun { name: name.clone(), case: *case, response, rows });
                }
                (ReportJob::Curve(_), Outcome::Curve(curve)) => curves.push(curve),
                // Blocks of a sweep come in the order of their points.
                (ReportJob::Block(s, _), Outcome::Block(records)) => {
                    self.sweeps[*s].records.extend(records);
                }
                _ => unreachable!("a job has an outcome of its kind"),
            }
        }
        let (_, _, nominal) = &self.runs[0];
        let all = resolution(&nominal.machine, nominal.machine.solver.tolerance);
        let resolution = Coordinate::ALL.map(|c| all[c.index()]);
        self.sweeps.iter_mut().for_each(SweepData::read_points);
        let ideal = runs.pop().expect("the last run is the ideal one");
        let (mut runs, mut curves) = (runs.into_iter(), curves.into_iter());
        let mut sweeps = self.sweeps.into_iter();
        let mut findings = |variant| Findings {
            extent: self.extent,
            variant,
            runs: runs.by_ref().take(PAPER.runs.len()).collect(),
            lagrange: runs.next().expect("then one with multipliers"),
            ideal: ideal.clone(),
            curves: curves.by_ref().take(PAPER.runs.len()).collect(),
            sweeps: sweeps.by_ref().take(SWEEPS).collect(),
            resolution,
        };
        let variants = &PAPER.variants;
        let (corrected, printed) = (findings(&variants.corrected), findings(&variants.printed));
        let combination = |variant| Combination {
            variant,
            runs: runs.by_ref().take(3).collect(),
            sections: sweeps.next().expect("one a combination"),
        };
        Report { corrected, printed, combinations: variants.combinations.iter().map(combination).collect() }
    }
}

/// File name of a run.
fn file_name(case: Case) -> String {
    format!("response_c{}mm_cf{}", case.clearance, case.friction)
}

/// The period after `settle` periods and the next one, at equal phases.
fn curve(
    case: Case,
    scene: &Scene,
    settle: usize,
    mut go_on: impl FnMut(f64) -> bool,
) -> Result<SettledCurve, ResponseError> {
    let mut simulation = Simulation::new(&scene.machine)?;
    let mut frame = Frame::default();
    let mut found =
        SettledCurve { case, coordinates: [Vec::new(), Vec::new()], rates: [Vec::new(), Vec::new()], width: [0.0; 2] };
    for n in 0..=2 * CURVE_POINTS {
        let time = PAPER.period * (settle as f64 + n as f64 / CURVE_POINTS as f64);
        while simulation.time() < time {
            if !go_on(simulation.time()) {
                return Err(ResponseError::Cancelled);
            }
            simulation.step()?;
        }
        simulation.sample(time, &mut frame);
        let [coordinates, rates, _] = derivatives(&frame.pose);
        for c in Coordinate::ALL {
            found.coordinates[c as usize].push(coordinates[c.index()]);
            found.rates[c as usize].push(rates[c.index()]);
        }
    }
    for c in 0..2 {
        let (before, settled) = found.coordinates[c].split_at(CURVE_POINTS);
        let pairs = before.iter().zip(settled);
        found.width[c] = pairs.map(|(a, b)| (b - a).abs()).fold(0.0, f64::max);
        found.coordinates[c].drain(..CURVE_POINTS);
        found.rates[c].drain(..CURVE_POINTS);
    }
    Ok(found)
}
