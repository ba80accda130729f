//! What Sheng & Chen show, print and say in sections 4.2, 4.3 and 5, as a table (`assets/paper.toml`), and the runs that it
//! names. Nothing is tuned to match; the paper leaves one dimension out and contradicts itself in places.

mod quantity;

use std::f64::consts::PI;
use std::sync::LazyLock;

use serde::Deserialize;

pub use quantity::{Agreement, Comparison, Quantity};

use crate::words::words;

/// Simulated time of the paper's runs: one period of trajectory (59), s.
pub const DURATION: f64 = 2.0;
/// The paper's output step, s.
pub const SAMPLING: f64 = 1e-3;
/// Amplitudes of x (m) and of beta (rad) in trajectory (59).
const AMPLITUDES: [f64; 2] = [0.025, 0.025];

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
        Self::new(clearance, friction)
    }
}

impl Case {
    const fn new(clearance: f64, friction: f64) -> Self {
        Self {
            clearance,
            friction,
        }
    }

    /// The changes that make the default scene this case.
    pub fn changes(self) -> Vec<(String, String)> {
        vec![
            (
                "contact.clearance".to_owned(),
                format!("{} mm", self.clearance),
            ),
            ("contact.friction".to_owned(), self.friction.to_string()),
        ]
    }
}

/// Every run that the figures need, each once.
pub const CASES: [Case; 5] = [
    Case::new(0.3, 0.2),
    Case::new(0.5, 0.2),
    Case::new(0.7, 0.2),
    Case::new(0.3, 0.15),
    Case::new(0.3, 0.25),
];

/// Runs that differ in one parameter alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Series {
    /// Figures 5 to 10 and 18 to 20.
    Clearance,
    /// Figures 11 to 16 and 21 to 23.
    Friction,
}

words!(Series {
    Clearance => "clearance",
    Friction => "friction",
});

impl Series {
    /// Its runs, by the parameter ascending.
    pub const fn cases(self) -> [Case; 3] {
        match self {
            Self::Clearance => [CASES[0], CASES[1], CASES[2]],
            Self::Friction => [CASES[3], CASES[0], CASES[4]],
        }
    }

    /// What its parameter is called with a value, in the unit of [`Case`].
    pub fn name(self, value: impl std::fmt::Display) -> String {
        match self {
            Self::Clearance => format!("{value} mm"),
            Self::Friction => format!("friction {value}"),
        }
    }

    /// Value of its parameter in a run.
    pub fn of(self, case: Case) -> f64 {
        match self {
            Self::Clearance => case.clearance,
            Self::Friction => case.friction,
        }
    }

    /// More than one value of its parameter.
    pub fn values(self) -> &'static str {
        match self {
            Self::Clearance => "clearances",
            Self::Friction => "frictions",
        }
    }
}

/// One of the two coordinates that the paper shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
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
    /// Its index among the coordinates of the output body.
    pub const fn index(self) -> usize {
        [0, 4][self as usize]
    }

    /// Amplitude in the ideal motion of the coordinate (m or rad) or its `nth` derivative: the drive turns at pi rad/s.
    pub fn amplitude(self, nth: usize) -> f64 {
        AMPLITUDES[self as usize] * [1.0, PI, PI * PI][nth]
    }
}

/// Curves that are compared with each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Curves {
    /// The runs by clearance.
    Clearance,
    /// The runs by friction.
    Friction,
    /// The same run by two formulations that share no equations of motion.
    Formulations,
}

/// Sections that are compared with each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Sections {
    /// Those of the paper's three runs.
    Runs,
    /// Those of all values of a sweep from cold starts.
    Sweep,
}

/// One number that the paper prints.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Published {
    /// Figure that it belongs to.
    pub figure: String,
    /// The run.
    #[serde(rename = "run")]
    pub case: Case,
    /// What it measures.
    pub quantity: Quantity,
    /// The value printed in the text of section 4.2, SI units.
    pub value: f64,
}

/// A peak of Figure 17, whose run the paper does not name, SI units.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Verification {
    /// Part of the figure.
    pub figure: String,
    /// What is measured.
    pub quantity: Quantity,
    /// By the paper's own program.
    pub own: f64,
    /// By the commercial one that it is compared with.
    pub commercial: f64,
}

/// What a figure shows. Columns are named as in [`super::reproduction::COLUMNS`].
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Shows {
    /// Columns of three runs over the whole period, and as the balls bounce.
    Response {
        /// The runs.
        to: Series,
        /// Columns above.
        whole: Vec<String>,
        /// Columns below.
        early: Vec<String>,
    },
    /// The contact forces of a run.
    Forces(Case),
    /// Columns of two formulations and the ideal motion.
    Verification(Vec<String>),
    /// How far the formulations part, and by how much constraints are violated.
    Drift,
    /// Phase portraits, settled and with impacts.
    Portraits(Series),
    /// Sections of three runs.
    Sections(Series),
    /// Sections of a sweep, their spread and hysteresis.
    Bifurcation(Series),
    /// Largest Lyapunov exponents of a sweep.
    Exponents(Series),
    /// Clearance and friction together.
    Map,
    /// Error of the probe against clearance.
    Probe,
}

/// A figure of the paper, or one beyond it.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct Figure {
    /// Name in files: `figure-` and two digits for those of the paper.
    pub name: String,
    /// Heading.
    pub heading: String,
    /// Caption.
    pub caption: String,
    /// What is drawn.
    pub shows: Shows,
    /// Figures whose largest forces are compared below it.
    #[serde(default)]
    pub strongest_of: Vec<String>,
}

impl Figure {
    /// Whether it is the figure of the paper that `figure`, such as `6a`, is a part of.
    pub fn contains(&self, figure: &str) -> bool {
        let number = figure.trim_end_matches(char::is_alphabetic);
        self.name == format!("figure-{number:0>2}")
    }
}

/// A section of the page.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Section {
    /// Name in links.
    pub id: String,
    /// Heading.
    pub title: String,
    /// Its figures.
    #[serde(rename = "figure")]
    pub figures: Vec<Figure>,
}

/// What must hold here for a statement to count as confirmed; [`super::reproduction::Findings::statements`] has the criteria in
/// words.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[allow(missing_docs, reason = "fields read as the sentences of the table")]
pub enum Test {
    /// A coordinate of a run leaves the ideal motion by little of its amplitude.
    StaysNearIdeal { coordinate: Coordinate, run: Case },
    /// A quantity grows from run to run.
    Grows { of: Quantity, with: Series },
    /// All quantities do that are said to grow.
    AllGrow(Series),
    /// One quantity is the larger number in every run.
    Exceeds {
        of: Quantity,
        that: Quantity,
        over: Series,
    },
    /// The middle run has an extreme of a quantity.
    NoRule { of: Quantity, with: Series },
    /// One quantity differs by a larger share of its mean than another.
    DiffersMore {
        of: Quantity,
        than: Quantity,
        with: Series,
    },
    /// A quantity changes more over one series than over the other.
    ChangesMoreWith {
        of: Quantity,
        with: Series,
        than: Series,
    },
    /// No ball leaves its socket after an instant, s.
    Steady { after: f64, over: Series },
    /// A joint, counted from 1, has the largest peak force of a run.
    Hardest { joint: usize, run: Case },
    /// Curves are close to each other, and to the ideal motion, from an instant (s) on.
    Coincide {
        curves: Curves,
        #[serde(default)]
        ideal: bool,
        columns: Vec<String>,
        from: f64,
    },
    /// Two formulations stay close, measured by the largest deviation from the ideal motion.
    FormulationsAgree(Vec<Coordinate>),
    /// Settled curves are close to each other.
    PortraitsCoincide { of: Coordinate, over: Series },
    /// Settled curves do not close, and if `growing`, the less the larger the parameter.
    PortraitsWide {
        of: Coordinate,
        over: Series,
        #[serde(default)]
        growing: bool,
    },
    /// The last sections of three runs ascend.
    SectionsAscend { of: Coordinate, over: Series },
    /// The sections of three runs spread, and more from run to run.
    SectionsSpread { of: Coordinate, over: Series },
    /// Sections lie denser the nearer to their centre.
    SectionsCrowd(Series),
    /// Sections move little over a series.
    SectionsStay { of: Sections, over: Series },
    /// Sections of every value of a sweep agree.
    SectionsRepeat { of: Coordinate, over: Series },
    /// Three runs are quasi-periodic.
    QuasiPeriodic(Series),
    /// Every value of a sweep repeats after one period.
    AllPeriodic(Series),
    /// The first value of a sweep is periodic, the last chaotic.
    PeriodicToChaotic(Series),
    /// More chaos in the upper half of a sweep.
    ChaosGrows(Series),
    /// Every value of a sweep is chaotic, or none.
    ChaosAllOrNone(Series),
}

/// A statement of the paper in words.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// Where the paper makes it.
    pub place: String,
    /// What it says, in other words.
    pub says: String,
    /// What it is held against.
    pub test: Test,
}

/// Everything that is held against the paper, in its order.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Paper {
    /// Numbers whose run is named.
    #[serde(rename = "number")]
    pub numbers: Vec<Published>,
    /// Numbers whose run is not.
    pub verification: Vec<Verification>,
    /// Figures.
    #[serde(rename = "section")]
    pub sections: Vec<Section>,
    /// Statements.
    #[serde(rename = "statement")]
    pub statements: Vec<Claim>,
}

/// The table.
pub static PAPER: LazyLock<Paper> = LazyLock::new(|| {
    let text = include_str!("../../assets/paper.toml");
    toml::from_str(text).expect("a test reads it")
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_belongs_to_a_run_and_to_a_figure() {
        let figures = || PAPER.sections.iter().flat_map(|s| &s.figures);
        for published in &PAPER.numbers {
            assert!(CASES.contains(&published.case), "{published:?}");
            assert!(published.value > 0.0);
            let of = figures().filter(|f| f.contains(&published.figure));
            assert_eq!(of.count(), 1, "{published:?}");
        }
        assert_eq!((PAPER.numbers.len(), PAPER.statements.len()), (51, 52));
    }

    #[test]
    fn rates_are_held_against_the_amplitude_of_the_rate() {
        let beta = [0, 1, 2].map(|nth| Coordinate::Beta.amplitude(nth));
        assert_eq!(beta, [0.025, 0.025 * PI, 0.025 * (PI * PI)]);
    }
}
