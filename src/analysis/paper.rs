//! What Sheng & Chen print in sections 4.2 and 4.3, number by number and statement by statement, and what this
//! program gets for the same. Nothing is tuned to match; the paper leaves one dimension out and contradicts itself in places.

pub mod chaos;
pub mod curves;
mod words;

pub use words::{Agreement, Comparison, compare};

use super::response::{Extremes, Response};

/// Simulated time of the paper's runs: one period of trajectory (59), s.
pub const DURATION: f64 = 2.0;
/// The paper's output step, s.
pub const SAMPLING: f64 = 1e-3;

/// Clearance (mm) and friction coefficient of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Case {
    /// Clearance of all three joints, mm.
    pub clearance: f64,
    /// Friction coefficient.
    pub friction: f64,
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

/// What a figure shows. SI units.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Largest deviation of beta from the ideal motion, rad.
    DeviationBeta,
    /// Largest |dx/dt|, m/s.
    RateX,
    /// Largest |d beta/dt|, rad/s.
    RateBeta,
    /// Largest |d2x/dt2|, m/s^2.
    AccelerationX,
    /// Largest |d2 beta/dt2|, rad/s^2.
    AccelerationBeta,
    /// Largest normal force of the joint with this index, N.
    Normal(usize),
    /// Time of the last separation of any joint, s.
    LastSeparation,
}

impl Quantity {
    /// Name and unit.
    pub fn label(self) -> (String, &'static str) {
        match self {
            Self::DeviationBeta => ("largest deviation of beta".to_owned(), "rad"),
            Self::RateX => ("largest velocity in x".to_owned(), "m/s"),
            Self::RateBeta => ("largest angular rate of beta".to_owned(), "rad/s"),
            Self::AccelerationX => ("largest acceleration in x".to_owned(), "m/s²"),
            Self::AccelerationBeta => ("largest acceleration of beta".to_owned(), "rad/s²"),
            Self::Normal(joint) => (format!("largest contact force in S{}", joint + 1), "N"),
            Self::LastSeparation => ("last separation".to_owned(), "s"),
        }
    }

    fn of_extremes(self, extremes: &Extremes) -> Option<f64> {
        const X: usize = 0;
        const BETA: usize = 4;
        match self {
            Self::DeviationBeta => Some(extremes.deviation[BETA]),
            Self::RateX => Some(extremes.rate[X]),
            Self::RateBeta => Some(extremes.rate[BETA]),
            Self::AccelerationX => Some(extremes.acceleration[X]),
            Self::AccelerationBeta => Some(extremes.acceleration[BETA]),
            Self::Normal(joint) => extremes.normal.get(joint).copied(),
            Self::LastSeparation => None,
        }
    }

    /// In continuous time, and sampled as the paper samples; the second is `None` where sampling does not enter.
    pub fn of(self, response: &Response) -> (f64, Option<f64>) {
        match self {
            Self::LastSeparation => {
                let last = response.last_separation.iter().copied();
                (last.fold(f64::NAN, f64::max), None)
            }
            _ => (
                self.of_extremes(&response.full).unwrap_or(f64::NAN),
                self.of_extremes(&response.sampled),
            ),
        }
    }
}

/// One number that the paper prints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Published {
    /// Figure that it belongs to.
    pub figure: &'static str,
    /// The run.
    pub case: Case,
    /// What it measures.
    pub quantity: Quantity,
    /// The value printed in the text of section 4.2, SI units.
    pub value: f64,
}

const fn published(
    figure: &'static str,
    (clearance, friction): (f64, f64),
    quantity: Quantity,
    value: f64,
) -> Published {
    Published {
        figure,
        case: Case::new(clearance, friction),
        quantity,
        value,
    }
}

/// Every number of section 4.2 whose run is named. (The case of Figure 17 is not.)
pub const PUBLISHED: &[Published] = {
    use Quantity::{
        AccelerationBeta, AccelerationX, DeviationBeta, LastSeparation, Normal, RateBeta, RateX,
    };
    &[
        published("5b", (0.3, 0.2), DeviationBeta, 0.006),
        published("5b", (0.5, 0.2), DeviationBeta, 0.008),
        published("5b", (0.7, 0.2), DeviationBeta, 0.012),
        published("6a", (0.3, 0.2), RateX, 0.147),
        published("6a", (0.5, 0.2), RateX, 0.167),
        published("6a", (0.7, 0.2), RateX, 0.186),
        published("6b", (0.3, 0.2), RateBeta, 0.906),
        published("6b", (0.5, 0.2), RateBeta, 1.104),
        published("6b", (0.7, 0.2), RateBeta, 1.511),
        published("7a", (0.3, 0.2), AccelerationX, 430.7),
        published("7a", (0.5, 0.2), AccelerationX, 446.2),
        published("7a", (0.7, 0.2), AccelerationX, 667.5),
        published("8", (0.3, 0.2), Normal(0), 809.7),
        published("8", (0.3, 0.2), Normal(1), 463.3),
        published("8", (0.3, 0.2), Normal(2), 755.8),
        published("8", (0.3, 0.2), LastSeparation, 0.21),
        published("9", (0.5, 0.2), Normal(0), 840.0),
        published("9", (0.5, 0.2), Normal(1), 1061.0),
        published("9", (0.5, 0.2), Normal(2), 982.7),
        published("9", (0.5, 0.2), LastSeparation, 0.33),
        published("10", (0.7, 0.2), Normal(0), 1094.0),
        published("10", (0.7, 0.2), Normal(1), 917.4),
        published("10", (0.7, 0.2), Normal(2), 1176.0),
        published("10", (0.7, 0.2), LastSeparation, 0.39),
        published("11b", (0.3, 0.15), DeviationBeta, 6.61e-3),
        published("11b", (0.3, 0.2), DeviationBeta, 6.77e-3),
        published("11b", (0.3, 0.25), DeviationBeta, 6.90e-3),
        published("12a", (0.3, 0.15), RateX, 0.149),
        published("12a", (0.3, 0.2), RateX, 0.156),
        published("12a", (0.3, 0.25), RateX, 0.161),
        published("12b", (0.3, 0.15), RateBeta, 1.265),
        published("12b", (0.3, 0.2), RateBeta, 1.277),
        published("12b", (0.3, 0.25), RateBeta, 1.279),
        published("13a", (0.3, 0.15), AccelerationX, 533.2),
        published("13a", (0.3, 0.2), AccelerationX, 430.7),
        published("13a", (0.3, 0.25), AccelerationX, 426.0),
        published("13b", (0.3, 0.15), AccelerationBeta, 993.1),
        published("13b", (0.3, 0.2), AccelerationBeta, 2193.0),
        published("13b", (0.3, 0.25), AccelerationBeta, 1582.0),
        published("14", (0.3, 0.15), Normal(0), 966.4),
        published("14", (0.3, 0.15), Normal(1), 1057.0),
        published("14", (0.3, 0.15), Normal(2), 866.8),
        published("15", (0.3, 0.2), Normal(0), 552.6),
        published("15", (0.3, 0.2), Normal(1), 922.3),
        published("15", (0.3, 0.2), Normal(2), 444.7),
        published("14", (0.3, 0.15), LastSeparation, 0.22),
        published("15", (0.3, 0.2), LastSeparation, 0.23),
        published("16", (0.3, 0.25), Normal(0), 719.4),
        published("16", (0.3, 0.25), Normal(1), 560.8),
        published("16", (0.3, 0.25), Normal(2), 500.2),
        published("16", (0.3, 0.25), LastSeparation, 0.22),
    ]
};

/// Peaks that the text gives for Figure 17, whose run it does not name: what is measured, the paper's own program (Matlab) and the
/// commercial one that it is compared with (Adams), SI units.
pub const VERIFICATION: [(&str, Quantity, f64, f64); 2] = [
    ("17e", Quantity::AccelerationX, 319.2, 291.0),
    ("17f", Quantity::AccelerationBeta, 1754.0, 1571.0),
];

/// Whether a statement of the paper holds here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It does.
    Confirmed,
    /// It does not.
    NotConfirmed,
}

/// A qualitative statement of the paper and what this program finds.
#[derive(Clone, Debug, PartialEq)]
pub struct Statement {
    /// Where the paper makes it.
    pub place: std::borrow::Cow<'static, str>,
    /// What it says, in other words.
    pub says: String,
    /// What must hold here for it to count as confirmed.
    pub criterion: String,
    /// Whether that holds here.
    pub verdict: Verdict,
    /// The numbers behind the verdict.
    pub evidence: String,
}

/// A run of each case, in any order.
pub type Runs = [(Case, Response)];

/// The full-resolution value of `quantity` over a series of cases.
fn series(runs: &Runs, cases: [Case; 3], quantity: Quantity) -> Option<[f64; 3]> {
    let value = |case| {
        let (_, response) = runs.iter().find(|(of, _)| *of == case)?;
        Some(quantity.of(response).0)
    };
    Some([value(cases[0])?, value(cases[1])?, value(cases[2])?])
}

/// The runs of Figures 5 to 10 and 18 to 20, clearance ascending.
pub const BY_CLEARANCE: [Case; 3] = [CASES[0], CASES[1], CASES[2]];
/// The runs of Figures 11 to 16 and 21 to 23, friction ascending.
pub const BY_FRICTION: [Case; 3] = [CASES[3], CASES[0], CASES[4]];

fn verdict(holds: bool) -> Verdict {
    if holds {
        Verdict::Confirmed
    } else {
        Verdict::NotConfirmed
    }
}

/// "It grows with the clearance", and the like.
fn grows(
    place: &'static str,
    cases: [Case; 3],
    what: &str,
    unit: &str,
    value: impl Fn(Case) -> Option<f64>,
) -> Option<Statement> {
    let values = [value(cases[0])?, value(cases[1])?, value(cases[2])?];
    let (cause, names) = if cases == BY_CLEARANCE {
        (
            "clearance",
            cases.map(|case| format!("{} mm", case.clearance)),
        )
    } else {
        (
            "friction",
            cases.map(|case| format!("cf {}", case.friction)),
        )
    };
    let listed: Vec<String> = names
        .iter()
        .zip(values)
        .map(|(name, value)| format!("{name}: {} {unit}", words::digits(value, 6)))
        .collect();
    Some(Statement {
        place: place.into(),
        says: format!("{what} grows with the {cause}"),
        criterion: "larger at each of the three values than at the one before, in continuous time"
            .to_owned(),
        verdict: verdict(values[0] < values[1] && values[1] < values[2]),
        evidence: listed.join(", "),
    })
}

/// The qualitative statements of section 4.2 and of the second conclusion, one by one; those whose runs are missing are left out.
pub fn response_statements(runs: &Runs) -> Vec<Statement> {
    let one = |cases: [Case; 3], quantity: Quantity| {
        move |case: Case| {
            let at = cases.iter().position(|of| *of == case)?;
            Some(series(runs, cases, quantity)?[at])
        }
    };
    let strongest = |case: Case| {
        let (_, response) = runs.iter().find(|(of, _)| *of == case)?;
        Some(response.full.normal.iter().copied().fold(0.0, f64::max))
    };
    let (c, f) = (BY_CLEARANCE, BY_FRICTION);
    let mut out = Vec::new();
    if let Some((_, widest)) = runs.iter().find(|(case, _)| *case == CASES[2]) {
        // Amplitude of x in (59).
        let share = widest.full.deviation[0] / 0.025;
        out.push(Statement {
            place: "4.2.1, Figure 5a".into(),
            says: "the displacement in x shows no obvious deviation whatever the clearance"
                .to_owned(),
            criterion: "at 0.7 mm, x leaves the ideal motion by less than 5 % of its amplitude"
                .to_owned(),
            verdict: verdict(share < 0.05),
            evidence: format!(
                "0.7 mm: at most {:.3} mm, {:.1} % of the amplitude",
                widest.full.deviation[0] * 1e3,
                share * 100.0
            ),
        });
    }
    use Quantity::{AccelerationX, DeviationBeta, LastSeparation, RateBeta, RateX};
    let more = [
        grows(
            "4.2.1, Figure 5b",
            c,
            "the largest deviation of beta",
            "rad",
            one(c, DeviationBeta),
        ),
        grows(
            "4.2.1, Figure 6a",
            c,
            "the largest velocity in x",
            "m/s",
            one(c, RateX),
        ),
        grows(
            "4.2.1, Figure 6b",
            c,
            "the largest angular rate of beta",
            "rad/s",
            one(c, RateBeta),
        ),
        grows(
            "4.2.1, Figure 7a",
            c,
            "the largest acceleration in x",
            "m/s²",
            one(c, AccelerationX),
        ),
        grows(
            "4.2.1, Figures 8 to 10",
            c,
            "the largest contact force of any joint",
            "N",
            strongest,
        ),
        grows(
            "4.2.1, Figures 8 to 10",
            c,
            "the time of the last separation",
            "s",
            one(c, LastSeparation),
        ),
        grows(
            "4.2.2, Figure 11b",
            f,
            "the largest deviation of beta",
            "rad",
            one(f, DeviationBeta),
        ),
        grows(
            "4.2.2, Figure 12a",
            f,
            "the largest velocity in x",
            "m/s",
            one(f, RateX),
        ),
        grows(
            "4.2.2, Figure 12b",
            f,
            "the largest angular rate of beta",
            "rad/s",
            one(f, RateBeta),
        ),
        // The paper's own numbers fall: 533.2, 430.7, 426 m/s².
        grows(
            "4.2.2, Figure 13a",
            f,
            "the largest acceleration in x",
            "m/s²",
            one(f, AccelerationX),
        ),
    ];
    out.extend(more.into_iter().flatten());
    out.extend(words::further_statements(runs));
    out
}

/// Puts statements in the paper's order: by section, then by the figure that they begin with; a section's last words stand
/// after its figures.
pub fn in_order(statements: &mut [Statement]) {
    statements.sort_by_cached_key(|statement| {
        let (section, rest) = statement
            .place
            .split_once(',')
            .unwrap_or((&statement.place, "Figure 0"));
        let figure = rest.split_once("Figure").map(|(_, number)| {
            let digits = number.chars().skip_while(|c| !c.is_ascii_digit());
            digits
                .map_while(|c| c.to_digit(10))
                .fold(0, |n, digit| n * 10 + digit)
        });
        (section.to_owned(), figure.unwrap_or(u32::MAX))
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::response::respond;
    use crate::scene::Scene;

    #[test]
    fn every_number_belongs_to_a_run() {
        for published in PUBLISHED {
            assert!(CASES.contains(&published.case), "{published:?}");
            assert!(published.value > 0.0);
        }
        assert!(PUBLISHED.len() > 40);
    }

    #[test]
    fn statements_stand_in_the_order_of_the_paper() {
        let places = [
            "5, second conclusion",
            "4.2.2, Figure 16",
            "4.2.1, Figures 8 to 10",
            "4.2.1, Figure 10",
            "4.3, Figure 18a",
            "5, third conclusion",
            "4.2.1, Figure 8",
            "4.2.3, first conclusion",
            "4.2.3, Figure 17a and b",
            "4.2.2",
        ];
        let mut statements = places.map(|place| Statement {
            place: place.into(),
            says: String::new(),
            criterion: String::new(),
            verdict: Verdict::Confirmed,
            evidence: String::new(),
        });
        in_order(&mut statements);
        assert_eq!(
            statements.map(|s| s.place.into_owned()),
            [
                "4.2.1, Figures 8 to 10",
                "4.2.1, Figure 8",
                "4.2.1, Figure 10",
                "4.2.2",
                "4.2.2, Figure 16",
                "4.2.3, Figure 17a and b",
                "4.2.3, first conclusion",
                "4.3, Figure 18a",
                "5, second conclusion",
                "5, third conclusion",
            ]
        );
    }

    #[test]
    fn statements_follow_the_numbers() {
        let scene = Scene::load("pendulum", &[]).expect("built in");
        let response = respond(&scene, 1e-3, 1e-3, |_| true).expect("runs");
        // The same run for every case but for what is put into it by hand.
        let with = |deviation: f64, force: f64| {
            let mut response = response.clone();
            response.full.deviation[4] = deviation;
            response.full.normal = vec![force];
            response.last_separation = vec![0.1];
            response
        };
        let runs = [
            (CASES[0], with(1e-3, 100.0)),
            (CASES[1], with(2e-3, 90.0)),
            (CASES[2], with(3e-3, 120.0)),
        ];
        let statements = response_statements(&runs);
        let find = |figure: &str, what: &str| {
            let found = statements
                .iter()
                .find(|s| s.place.contains(figure) && s.says.contains(what));
            found.map(|s| s.verdict)
        };
        assert_eq!(find("5b", "deviation of beta"), Some(Verdict::Confirmed));
        assert_eq!(
            find("8 to 10", "contact force"),
            Some(Verdict::NotConfirmed)
        );
        assert_eq!(
            find("8 to 10", "last separation"),
            Some(Verdict::NotConfirmed)
        );
        // Runs that are missing answer nothing.
        assert_eq!(find("11b", "deviation of beta"), None);
    }
}
