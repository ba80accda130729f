//! The results of a report.

use super::Extent;
use super::record::{RecordedRun, SettledCurve, SettledPoint, SweepData};
use crate::paper::{Case, Comparison, PAPER, Published, Series, Variant};

/// The results of a report.
pub struct Report {
    /// With this program's model.
    pub corrected: Findings,
    /// With friction that uses (13) as printed.
    pub printed: Findings,
    /// The latter, each with a second change.
    pub combinations: Vec<Combination>,
}

/// Results of (13) as printed together with a second change.
pub struct Combination {
    /// The changes.
    pub variant: &'static Variant,
    /// Runs by clearance.
    pub runs: Vec<RecordedRun>,
    /// Their sections.
    pub sections: SweepData,
}

/// All results with one model.
pub struct Findings {
    /// How much was computed.
    pub extent: Extent,
    /// The model.
    pub variant: &'static Variant,
    /// The paper's runs, in the order of [`PAPER`].
    pub runs: Vec<RecordedRun>,
    /// The first of them with all bodies and multipliers.
    pub lagrange: RecordedRun,
    /// The run with ideal joints.
    pub ideal: RecordedRun,
    /// Settled curves, in the order of [`PAPER`].
    pub curves: Vec<SettledCurve>,
    /// Sweeps: [`Findings::sweep`] finds one by name.
    pub sweeps: Vec<SweepData>,
    /// Smallest differences in x (m) and beta (rad) that distinguish two sections.
    pub resolution: [f64; 2],
}

fn index(case: Case) -> usize {
    let found = PAPER.runs.iter().position(|of| *of == case);
    found.expect("the table names no other run")
}

impl Findings {
    /// The sweep called `name`.
    ///
    /// # Panics
    /// If there is none.
    pub fn sweep(&self, name: &str) -> &SweepData {
        let found = self.sweeps.iter().find(|s| s.name == name);
        found.expect("named as in Agenda::new")
    }

    /// Many sections of each run of a series.
    pub fn sections(&self, series: Series) -> &[SettledPoint] {
        &self.sweep(&format!("runs_by_{series}")).points
    }

    /// The sweep over a series' parameter from cold starts, with exponents.
    pub fn cold(&self, series: Series) -> &SweepData {
        self.sweep(&format!("{series}_cold"))
    }

    /// Points of that sweep.
    pub fn swept(&self, series: Series) -> &[SettledPoint] {
        &self.cold(series).points
    }

    /// Points of that sweep, and of those that follow the motion upward and downward.
    pub fn branches(&self, series: Series) -> [&[SettledPoint]; 3] {
        ["cold", "up", "down"].map(|start| &self.sweep(&format!("{series}_{start}")).points[..])
    }

    /// The run of `case`.
    ///
    /// # Panics
    /// If it is none of those in [`PAPER`].
    pub fn run(&self, case: Case) -> &RecordedRun {
        &self.runs[index(case)]
    }

    /// Settled curves of a series.
    pub fn loops(&self, series: Series) -> [&SettledCurve; 3] {
        series.cases().map(|case| &self.curves[index(case)])
    }

    /// Every number of the paper from a named run, beside this program's.
    pub fn comparisons(&self) -> Vec<Comparison> {
        let of = |published: &'static Published| {
            let response = &self.run(published.case).response;
            Comparison {
                published,
                full: published.quantity.of(response),
                sampled: published.quantity.sampled(response),
            }
        };
        PAPER.numbers.iter().map(of).collect()
    }
}
