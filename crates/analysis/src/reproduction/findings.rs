//! The results of a report.

use super::Extent;
use super::record::{RecordedRun, SettledCurve, SettledPoint, SweepData};
use crate::paper::{Case, Comparison, PAPER, Published, Series, Variant};

/// The results of a report.
pub struct Report {
    /// Extent of the computation.
    pub extent: Extent,
    /// Results of each variant of the model, in the order of [`PAPER`].
    pub models: Vec<Findings>,
}

impl Report {
    /// The variants with all figures and statements: this program's model, and the model whose friction uses (13) as printed.
    pub fn complete(&self) -> [&Findings; 2] {
        [&self.models[0], &self.models[1]]
    }

    /// Total simulated time of all runs, without twins, s.
    pub fn simulated(&self) -> f64 {
        let of_sweep = |data: &SweepData| data.plan.periods * data.sweep.design().points();
        let of_run = |run: &RecordedRun| if run.settled.is_some() { 1 + self.extent.settle + 2 } else { 1 };
        let of_model = |findings: &Findings| {
            findings.runs.iter().map(of_run).sum::<usize>() + findings.sweeps.iter().map(of_sweep).sum::<usize>()
        };
        // One more period for the run with ideal joints.
        PAPER.period * (1 + self.models.iter().map(of_model).sum::<usize>()) as f64
    }
}

/// Results of one variant of the model. Combinations have only the runs by clearance and their sections.
pub struct Findings {
    /// The variant.
    pub variant: &'static Variant,
    /// The paper's runs, in the order of [`PAPER`]; then the first of them in the `lagrange` formulation.
    pub runs: Vec<RecordedRun>,
    /// The run with ideal joints.
    pub ideal: RecordedRun,
    /// Sweeps, which [`Findings::sweep`] finds by name.
    pub sweeps: Vec<SweepData>,
    /// Smallest distinguishable differences in x (m) and beta (rad) between two sections.
    pub resolution: [f64; 2],
}

impl Findings {
    /// The sweep called `name`.
    ///
    /// # Panics
    /// If there is no such sweep.
    pub fn sweep(&self, name: &str) -> &SweepData {
        let sweep = self.sweeps.iter().find(|s| s.name == name);
        sweep.expect("named as in Agenda::new")
    }

    /// Sections of each run of a series over many periods.
    pub fn sections(&self, series: Series) -> &[SettledPoint] {
        &self.sweep(&format!("runs_by_{series}")).points
    }

    /// The sweep over a series' parameter from cold starts, with exponents.
    pub fn cold(&self, series: Series) -> &SweepData {
        self.sweep(&format!("{series}_cold"))
    }

    /// Points of the sweep over a series' parameter from cold starts.
    pub fn swept(&self, series: Series) -> &[SettledPoint] {
        &self.cold(series).points
    }

    /// Points of the sweep from cold starts, and of the sweeps that follow the motion upwards and downwards.
    pub fn branches(&self, series: Series) -> [&[SettledPoint]; 3] {
        ["cold", "up", "down"].map(|start| &self.sweep(&format!("{series}_{start}")).points[..])
    }

    /// The run of `case`.
    ///
    /// # Panics
    /// If [`PAPER`] has no such run.
    pub fn run(&self, case: Case) -> &RecordedRun {
        self.runs.iter().find(|run| run.case == case).expect("the table names no other run")
    }

    /// The nominal run in the `lagrange` formulation.
    pub fn lagrange(&self) -> &RecordedRun {
        &self.runs[PAPER.runs.len()]
    }

    /// Settled curves of a series.
    ///
    /// # Panics
    /// For a combination, which has none.
    pub fn loops(&self, series: Series) -> [&SettledCurve; 3] {
        series.cases().map(|case| self.run(case).settled.as_ref().expect("recorded for all runs of the paper"))
    }

    /// Every published number, with this program's result for the same run.
    pub fn comparisons(&self) -> Vec<Comparison> {
        let comparison = |published: &'static Published| {
            let response = &self.run(published.case).response;
            Comparison {
                published,
                full: published.quantity.of(response),
                sampled: published.quantity.sampled(response),
            }
        };
        PAPER.numbers.iter().map(comparison).collect()
    }
}
