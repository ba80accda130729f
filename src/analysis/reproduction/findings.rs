//! Everything that was found.

use super::record::{Loop, SweepData, Swept, Traced};
use super::{Extent, Variant};
use crate::analysis::paper::{CASES, Case, Comparison, PAPER, Published, Series};

/// Everything that was found.
pub struct Report {
    /// With the model of this program.
    pub corrected: Findings,
    /// With friction that reads (13) as printed.
    pub printed: Findings,
    /// The latter with a second change each.
    pub combinations: Vec<Combination>,
}

/// What (13) as printed gives together with a second change.
pub struct Combination {
    /// The changes.
    pub variant: Variant,
    /// Runs by clearance.
    pub runs: Vec<Traced>,
    /// Their sections.
    pub sections: SweepData,
}

/// Everything that was found with one model.
pub struct Findings {
    /// How much was computed.
    pub extent: Extent,
    /// The model.
    pub variant: Variant,
    /// The paper's runs, in the order of [`CASES`].
    pub runs: Vec<Traced>,
    /// The first of them with all bodies and multipliers, and with ideal joints.
    pub lagrange: Traced,
    /// Ideal joints.
    pub ideal: Traced,
    /// Settled curves, in the order of [`CASES`].
    pub curves: Vec<Loop>,
    /// Sweeps: [`Findings::sweep`] finds one by name.
    pub sweeps: Vec<SweepData>,
    /// What two sections must differ by in x (m) and beta (rad) to be different.
    pub resolution: [f64; 2],
}

fn index(case: Case) -> usize {
    let found = CASES.iter().position(|of| *of == case);
    found.expect("the table names no other run")
}

impl Findings {
    /// The sweep called `name`.
    ///
    /// # Panics
    /// If there is none.
    pub fn sweep(&self, name: &str) -> &SweepData {
        let found = self.sweeps.iter().find(|s| s.name == name);
        found.expect("named as in Work::new")
    }

    /// Many sections of each run of a series.
    pub fn sections(&self, series: Series) -> &[Swept] {
        &self.sweep(&format!("runs_by_{series}")).points
    }

    /// The sweep over the parameter of a series from cold starts, with exponents.
    pub fn cold(&self, series: Series) -> &SweepData {
        self.sweep(&format!("{series}_cold"))
    }

    /// Its points.
    pub fn swept(&self, series: Series) -> &[Swept] {
        &self.cold(series).points
    }

    /// The same, and then with the motion followed upward and downward.
    pub fn branches(&self, series: Series) -> [&[Swept]; 3] {
        ["cold", "up", "down"].map(|start| &self.sweep(&format!("{series}_{start}")).points[..])
    }

    /// The run of `case`.
    ///
    /// # Panics
    /// If it is none of [`CASES`].
    pub fn run(&self, case: Case) -> &Traced {
        &self.runs[index(case)]
    }

    /// Settled curves of a series.
    pub fn loops(&self, series: Series) -> [&Loop; 3] {
        series.cases().map(|case| &self.curves[index(case)])
    }

    /// Every number of the paper whose run is named, beside this program's.
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
