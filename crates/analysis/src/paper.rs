//! Figures, numbers and statements of Sheng & Chen, sections 4.2, 4.3 and 5, and the runs they refer to, from a table
//! (`assets/paper.toml`). Nothing is tuned to match; the paper omits one dimension and contradicts itself in places.

#![allow(missing_docs, reason = "the table explains its keys")]

mod quantity;

use std::f64::consts::PI;
use std::sync::LazyLock;

use serde::Deserialize;

pub use quantity::{Agreement, Comparison, FigureValue};

use jointplay_physics::words::words;

/// Clearance (mm) and friction coefficient of a run.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(from = "(f64, f64)")]
pub struct Case {
    /// Clearance of all three joints, mm.
    pub clearance: f64,
    /// Friction coefficient.
    pub friction: f64,
}

impl From<(f64, f64)> for Case {
    fn from((clearance, friction): (f64, f64)) -> Self {
        Self { clearance, friction }
    }
}

impl Case {
    /// The changes that turn the default scene into this case.
    pub fn changes(self) -> [(String, String); 2] {
        Series::ALL.map(|series| {
            let SeriesRow { key, unit, .. } = series.row();
            let value = format!("{} {unit}", series.of(self));
            (key.clone(), value.trim_end().to_owned())
        })
    }
}

/// Runs that differ in a single parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Series {
    /// Different clearances: Figures 5 to 10 and 18 to 20.
    Clearance,
    /// Different friction coefficients: Figures 11 to 16 and 21 to 23.
    Friction,
}

words!(Series {
    Clearance => "clearance",
    Friction => "friction",
});

impl Series {
    /// The row of the series in the table.
    pub fn row(self) -> &'static SeriesRow {
        &PAPER.series[self as usize]
    }

    /// The runs of the series, in ascending order of the parameter.
    pub fn cases(self) -> [Case; 3] {
        self.row().runs
    }

    /// Label of a parameter value in legends and tables.
    pub fn name(self, value: impl std::fmt::Display) -> String {
        self.row().value.replace("{}", &value.to_string())
    }

    /// Label of a run within the series.
    pub fn run_name(self, case: Case) -> String {
        self.name(self.of(case))
    }

    /// Value of the varied parameter in a run.
    pub fn of(self, case: Case) -> f64 {
        match self {
            Self::Clearance => case.clearance,
            Self::Friction => case.friction,
        }
    }

    /// `count` values between two ends, in the syntax of `sweep --vary`.
    pub fn vary(self, [from, to]: [f64; 2], count: usize) -> String {
        let SeriesRow { key, unit, .. } = self.row();
        format!("{key}={from}{unit}..{to}{unit}:{count}")
    }
}

/// Parameter and runs of a [`Series`].
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SeriesRow {
    pub key: String,
    pub label: String,
    pub unit: String,
    pub value: String,
    pub runs: [Case; 3],
    pub range: [f64; 2],
}

/// Changes to the default scene for the paper's runs.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Variant {
    pub prefix: String,
    pub title: String,
    pub changes: Vec<(String, String)>,
}

/// Variants of the model with which the paper's runs are computed.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Variants {
    pub corrected: Variant,
    pub printed: Variant,
    pub combinations: Vec<Variant>,
}

impl Variants {
    /// All variants, in the order of the table.
    pub fn all(&self) -> impl Iterator<Item = &Variant> {
        [&self.corrected, &self.printed].into_iter().chain(&self.combinations)
    }
}

/// One of the two coordinates plotted in the paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinate {
    /// Position, m.
    X,
    /// Angle, rad.
    Beta,
}

words!(Coordinate {
    X => "x",
    Beta => "beta",
});

impl Coordinate {
    /// Index among the coordinates of the output body.
    pub const fn index(self) -> usize {
        [0, 4][self as usize]
    }

    /// Amplitude of the coordinate (m or rad) or of its `nth` derivative in the ideal motion.
    pub fn amplitude(self, nth: usize) -> f64 {
        let rate = 2.0 * PI / PAPER.period;
        PAPER.amplitudes[self as usize] * [1.0, rate, rate * rate][nth]
    }
}

/// Curves to compare with each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Curves {
    /// The runs with different clearances.
    Clearance,
    /// The runs with different friction coefficients.
    Friction,
    /// The same run in two independent formulations of the equations of motion.
    Formulations,
}

/// Sections to compare with each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Sections {
    /// Sections of the paper's three runs.
    Runs,
    /// Sections at all values of a sweep from cold starts.
    Sweep,
}

/// A number printed in the paper.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Published {
    pub figure: String,
    #[serde(rename = "run")]
    pub case: Case,
    pub quantity: FigureValue,
    pub value: f64,
}

/// A peak of Figure 17, SI units. The paper does not say which run the figure shows.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Verification {
    pub figure: String,
    pub quantity: FigureValue,
    pub own: f64,
    pub commercial: f64,
}

/// Content of a figure. Columns are named as in [`super::reproduction::COLUMNS`].
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum FigureContent {
    /// Columns of three runs, over the whole period and during the initial impacts.
    Response { to: Series, whole: Vec<String>, early: Vec<String> },
    /// The contact forces of a run.
    Forces(Case),
    /// Columns of two formulations and the ideal motion.
    Verification(Vec<String>),
    /// Divergence of the formulations, and constraint violation.
    Drift,
    /// Phase portraits, after settling and during impacts.
    Portraits(Series),
    /// Sections of three runs.
    Sections(Series),
    /// Sections of a sweep, with their spread and hysteresis.
    Bifurcation(Series),
    /// Largest Lyapunov exponents of a sweep.
    Exponents(Series),
    /// A grid over clearance and friction.
    Map,
    /// Tip error against clearance.
    Probe,
}

/// A figure of the paper, or an additional one.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct Figure {
    pub name: String,
    pub heading: String,
    pub caption: String,
    pub shows: FigureContent,
    #[serde(default)]
    pub strongest_of: Vec<String>,
}

impl Figure {
    /// Whether `figure`, such as `6a`, is part of this figure.
    pub fn contains(&self, figure: &str) -> bool {
        let number = figure.trim_end_matches(char::is_alphabetic);
        self.name == format!("figure-{number:0>2}")
    }
}

/// A section of the page.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Section {
    pub id: String,
    pub title: String,
    #[serde(rename = "figure")]
    pub figures: Vec<Figure>,
}

/// Test of a statement; [`super::reproduction::Findings::statements`] applies the criteria.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Test {
    StaysNearIdeal { coordinate: Coordinate, run: Case },
    Grows { of: FigureValue, with: Series },
    AllGrow(Series),
    Exceeds { of: FigureValue, that: FigureValue, over: Series },
    NoRule { of: FigureValue, with: Series },
    DiffersMore { of: FigureValue, than: FigureValue, with: Series },
    ChangesMoreWith { of: FigureValue, with: Series, than: Series },
    Steady { after: f64, over: Series },
    Hardest { joint: usize, run: Case },
    Coincide { curves: Curves, ideal: Option<bool>, columns: Vec<String>, from: f64 },
    FormulationsAgree(Vec<Coordinate>),
    PortraitsCoincide { of: Coordinate, over: Series },
    PortraitsWide { of: Coordinate, over: Series, growing: Option<bool> },
    SectionsAscend { of: Coordinate, over: Series },
    SectionsSpread { of: Coordinate, over: Series },
    SectionsCrowd(Series),
    SectionsStay { of: Sections, over: Series },
    SectionsRepeat { of: Coordinate, over: Series },
    QuasiPeriodic(Series),
    AllPeriodic(Series),
    PeriodicToChaotic(Series),
    ChaosGrows(Series),
    ChaosAllOrNone(Series),
}

/// A statement of the paper and the test that decides it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    pub place: String,
    pub says: String,
    pub test: Test,
}

/// Everything compared with the paper, in the paper's order.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Paper {
    pub period: f64,
    pub amplitudes: [f64; 2],
    pub sampling: f64,
    pub runs: Vec<Case>,
    pub series: [SeriesRow; 2],
    pub variants: Variants,
    #[serde(rename = "number")]
    pub numbers: Vec<Published>,
    pub verification: Vec<Verification>,
    #[serde(rename = "section")]
    pub sections: Vec<Section>,
    #[serde(rename = "statement")]
    pub statements: Vec<Claim>,
}

/// The parsed table.
pub static PAPER: LazyLock<Paper> = LazyLock::new(|| {
    let text = include_str!("../../../assets/paper.toml");
    toml::from_str(text).expect("a test reads it")
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_belongs_to_a_run_and_to_a_figure() {
        let figures = || PAPER.sections.iter().flat_map(|s| &s.figures);
        for published in &PAPER.numbers {
            assert!(PAPER.runs.contains(&published.case), "{published:?}");
            assert!(published.value > 0.0);
            let matching = figures().filter(|f| f.contains(&published.figure));
            assert_eq!(matching.count(), 1, "{published:?}");
        }
        assert_eq!((PAPER.numbers.len(), PAPER.statements.len()), (51, 52));
    }

    #[test]
    fn the_runs_of_a_series_are_equally_spaced_and_among_all_runs() {
        for series in Series::ALL {
            let runs = series.cases();
            assert!(series.row().key.ends_with(series.word()));
            assert!(runs.iter().all(|run| PAPER.runs.contains(run)), "{series}");
            let [a, b, c] = runs.map(|run| series.of(run));
            assert!(a < b && (a + c - 2.0 * b).abs() < 1e-12, "{series}");
        }
        assert_eq!(Series::Clearance.vary([0.01, 1.0], 100), "contact.clearance=0.01mm..1mm:100");
        assert_eq!(Series::Friction.run_name(PAPER.runs[0]), "friction 0.2");
    }

    #[test]
    fn amplitudes_of_rates_follow_from_the_amplitude_of_the_coordinate() {
        let beta = [0, 1, 2].map(|nth| Coordinate::Beta.amplitude(nth));
        assert_eq!(beta, [0.025, 0.025 * PI, 0.025 * (PI * PI)]);
    }
}
