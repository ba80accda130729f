//! Everything that was found, and what the paper's statements come to with it.

use super::record::{Row, SweepData, Traced};
use super::{Extent, PICKED, Variant};
use crate::analysis::paper::chaos::{Found, Loop};
use crate::analysis::paper::curves::{Curves, Sample};
use crate::analysis::paper::{self, BY_CLEARANCE, BY_FRICTION, Case, Statement};
use crate::analysis::response::Response;

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
    /// Runs of [`BY_CLEARANCE`].
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
    /// The paper's runs, in the order of [`paper::CASES`].
    pub runs: Vec<Traced>,
    /// The first of them with all bodies and multipliers, and with ideal joints.
    pub lagrange: Traced,
    /// Ideal joints.
    pub ideal: Traced,
    /// Settled curves, in the order of [`paper::CASES`].
    pub curves: Vec<Loop>,
    /// Sweeps: [`Findings::sweep_data`] finds one by name.
    pub sweeps: Vec<SweepData>,
    /// What two sections must differ by in x (m) and beta (rad) to be different.
    pub resolution: [f64; 2],
}

impl Findings {
    /// The sweep called `name`.
    ///
    /// # Panics
    /// If there is none.
    pub fn sweep_data(&self, name: &str) -> &SweepData {
        let found = self.sweeps.iter().find(|s| s.name == name);
        found.expect("named as in Work::new")
    }

    /// Runs as [`paper`] takes them.
    pub fn responses(&self) -> Vec<(Case, Response)> {
        self.runs
            .iter()
            .map(|r| (r.case, r.response.clone()))
            .collect()
    }

    /// The run of `case`.
    pub fn run(&self, case: Case) -> Option<&Traced> {
        self.runs.iter().find(|run| run.case == case)
    }

    /// Settled curves of three runs.
    pub fn loops(&self, cases: [Case; 3]) -> Vec<Loop> {
        let of = |case: Case| self.curves.iter().find(|l| l.case == case).cloned();
        cases.into_iter().filter_map(of).collect()
    }

    /// What the statements of section 4.3 rest on.
    pub fn chaos(&self) -> Found {
        let mm = 1e3;
        let swept = |name, factor| self.sweep_data(name).swept(factor);
        Found {
            loops: [self.loops(BY_CLEARANCE), self.loops(BY_FRICTION)],
            runs: [
                swept("runs_by_clearance", mm),
                swept("runs_by_friction", 1.0),
            ],
            sweeps: [swept("clearance_cold", mm), swept("friction_cold", 1.0)],
            resolution: self.resolution,
        }
    }

    /// Runs at the paper's output step, as statements about whole curves take them.
    fn curves_sampled(&self) -> Curves {
        let samples = |run: &Traced| -> Vec<Sample> {
            let rows = run.rows.iter().filter(|row| row[14] == 1.0);
            rows.map(|row| std::array::from_fn(|k| row[k])).collect()
        };
        let of = |cases: [Case; 3]| {
            cases
                .iter()
                .filter_map(|&case| self.run(case).map(samples))
                .collect()
        };
        Curves {
            by_clearance: of(BY_CLEARANCE),
            by_friction: of(BY_FRICTION),
            verified: vec![samples(&self.runs[0]), samples(&self.lagrange)],
            ideal: samples(&self.ideal),
        }
    }

    /// Largest distance of the two formulations in x (m) and beta (rad) at the paper's output step.
    pub fn formulations_apart(&self) -> [f64; 2] {
        let samples = |run: &Traced| -> Vec<Row> {
            run.rows.iter().filter(|r| r[14] == 1.0).copied().collect()
        };
        let (tree, lagrange) = (samples(&self.runs[0]), samples(&self.lagrange));
        [1, 4].map(|i| {
            let pairs = tree.iter().zip(&lagrange);
            pairs.map(|(a, b)| (a[i] - b[i]).abs()).fold(0.0, f64::max)
        })
    }

    /// Every qualitative statement of section 4 and of the conclusions.
    pub fn statements(&self) -> Vec<Statement> {
        let mut all = paper::response_statements(&self.responses());
        let (apart, tree) = (self.formulations_apart(), &self.runs[0].response.full);
        let shares = [0, 1].map(|k| apart[k] / tree.deviation[PICKED[k]]);
        let verified = Statement {
            place: "4.2.3, first conclusion".into(),
            says: "an independent formulation of the same mechanism moves alike".to_owned(),
            criterion: "x and beta of the tree and the lagrange formulation stay within 5 % of their largest deviation from \
                        the ideal motion"
                .to_owned(),
            verdict: if shares.iter().all(|s| *s < 0.05) {
                paper::Verdict::Confirmed
            } else {
                paper::Verdict::NotConfirmed
            },
            evidence: format!(
                "x: {:.3e} mm, {:.2} %; beta: {:.3e} mrad, {:.2} %",
                apart[0] * 1e3,
                shares[0] * 100.0,
                apart[1] * 1e3,
                shares[1] * 100.0
            ),
        };
        let conclusion = paper::chaos::second_conclusion(&all);
        all.push(verified);
        all.extend(paper::curves::statements(&self.curves_sampled()));
        all.extend(conclusion);
        all.extend(paper::chaos::statements(&self.chaos()));
        paper::in_order(&mut all);
        all
    }
}
