//! The paper's numbers beside this program's, and the smaller statements of section 4.2.

use super::{
    BY_CLEARANCE, BY_FRICTION, CASES, Case, PUBLISHED, Published, Runs, Statement, verdict,
};
use crate::analysis::response::Response;

/// How near two numbers are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Agreement {
    /// Within 10 % of the paper's.
    Agrees,
    /// Between half and twice the paper's.
    Near,
    /// Further off.
    Differs,
}

impl Agreement {
    /// Of a number over the paper's.
    pub fn of(ratio: f64) -> Self {
        if (0.9..=1.1).contains(&ratio) {
            Self::Agrees
        } else if (0.5..=2.0).contains(&ratio) {
            Self::Near
        } else {
            Self::Differs
        }
    }

    /// In words.
    pub fn word(self) -> &'static str {
        match self {
            Self::Agrees => "agrees within 10 %",
            Self::Near => "within a factor of 2",
            Self::Differs => "differs",
        }
    }
}

/// A number of the paper with the same of this program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// The paper's.
    pub published: Published,
    /// In continuous time.
    pub full: f64,
    /// As a solver with the paper's output step would report; `None` where sampling does not enter.
    pub sampled: Option<f64>,
}

impl Comparison {
    /// Continuous time over the paper's.
    pub fn ratio(&self) -> f64 {
        self.full / self.published.value
    }

    /// Sampled over the paper's.
    pub fn sampled_ratio(&self) -> Option<f64> {
        self.sampled.map(|value| value / self.published.value)
    }

    /// In continuous time: impacts are so short that samples see their peaks by chance.
    pub fn agreement(&self) -> Agreement {
        Agreement::of(self.ratio())
    }
}

/// Every number of the paper whose run is there.
pub fn compare(runs: &Runs) -> Vec<Comparison> {
    let of = |published: &Published| {
        let (full, sampled) = published.quantity.of(response(runs, published.case)?);
        Some(Comparison {
            published: *published,
            full,
            sampled,
        })
    };
    PUBLISHED.iter().filter_map(of).collect()
}

/// `value` with `n` significant digits.
pub(super) fn digits(value: f64, n: usize) -> String {
    let size = value.abs();
    if size == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e6).contains(&size) {
        let whole = libm::floor(libm::log10(size)) as i32;
        format!("{value:.*}", (n as i32 - 1 - whole).max(0) as usize)
    } else {
        format!("{value:.*e}", n - 1)
    }
}

fn response(runs: &Runs, case: Case) -> Option<&Response> {
    runs.iter().find(|(of, _)| *of == case).map(|(_, r)| r)
}

/// Statements of 4.2 that are not of the form "it grows".
pub(super) fn further_statements(runs: &Runs) -> Vec<Statement> {
    let mut out = Vec::new();
    for (place, case, joint) in [
        ("4.2.1, Figure 8", CASES[0], 0),
        ("4.2.1, Figure 9", CASES[1], 1),
        ("4.2.1, Figure 10", CASES[2], 2),
        ("4.2.2, Figure 14", CASES[3], 1),
        ("4.2.2, Figure 15", CASES[0], 1),
        ("4.2.2, Figure 16", CASES[4], 0),
    ] {
        out.extend(response(runs, case).and_then(|r| hardest(place, case, joint, r)));
    }
    let all = |cases: [Case; 3]| -> Option<[&Response; 3]> {
        Some([
            response(runs, cases[0])?,
            response(runs, cases[1])?,
            response(runs, cases[2])?,
        ])
    };
    if let Some(responses) = all(BY_CLEARANCE) {
        out.push(beta_above_x(&responses));
        out.push(settled(
            "4.2.1, Figures 6 to 10",
            "clearances",
            0.4,
            &responses,
        ));
    }
    if let Some(responses) = all(BY_FRICTION) {
        out.push(settled(
            "4.2.2, Figures 11 to 16",
            "frictions",
            0.3,
            &responses,
        ));
        out.push(no_rule(&responses));
        out.push(more_sensitive(&responses));
        if let Some(by_clearance) = all(BY_CLEARANCE) {
            out.push(main_influence(&by_clearance, &responses));
        }
    }
    out
}

fn hardest(
    place: &'static str,
    case: Case,
    joint: usize,
    response: &Response,
) -> Option<Statement> {
    let forces = &response.full.normal;
    let largest = forces.iter().copied().fold(0.0, f64::max);
    let listed: Vec<String> = response
        .joints
        .iter()
        .zip(forces)
        .map(|(name, force)| format!("{name}: {force:.1} N"))
        .collect();
    Some(Statement {
        place: place.into(),
        says: format!(
            "at {} mm and friction {} the hardest impacts are in S{}",
            case.clearance,
            case.friction,
            joint + 1
        ),
        criterion: "that joint has the largest peak force, in continuous time".to_owned(),
        verdict: verdict(*forces.get(joint)? == largest),
        evidence: listed.join(", "),
    })
}

fn beta_above_x(responses: &[&Response; 3]) -> Statement {
    let pairs = responses.map(|r| (r.full.acceleration[0], r.full.acceleration[4]));
    let listed = pairs.map(|(x, beta)| format!("{beta:.0} rad/s² and {x:.0} m/s²"));
    Statement {
        place: "4.2.1, Figure 7".into(),
        says: "the acceleration of beta is larger than that in x".to_owned(),
        criterion: "its peak is the larger number, rad/s² against m/s², at all three clearances"
            .to_owned(),
        verdict: verdict(pairs.iter().all(|(x, beta)| beta > x)),
        evidence: listed.join(", "),
    }
}

fn settled(place: &'static str, what: &str, limit: f64, responses: &[&Response; 3]) -> Statement {
    let last = responses.map(|r| r.last_separation.iter().copied().fold(f64::NAN, f64::max));
    Statement {
        place: place.into(),
        says: format!("after {limit} s the motion is steady, at all three {what}"),
        criterion: format!("no ball leaves its socket after {limit} s"),
        verdict: verdict(last.iter().all(|t| *t <= limit)),
        evidence: format!(
            "last separations {}",
            last.map(|t| format!("{t:.4} s")).join(", ")
        ),
    }
}

fn no_rule(responses: &[&Response; 3]) -> Statement {
    let beta = responses.map(|r| r.full.acceleration[4]);
    Statement {
        place: "4.2.2, Figure 13b".into(),
        says: "the peak acceleration of beta follows no rule as friction grows".to_owned(),
        criterion: "the middle friction has the largest or the smallest of the three peaks"
            .to_owned(),
        verdict: verdict((beta[1] - beta[0]) * (beta[2] - beta[1]) < 0.0),
        evidence: beta.map(|b| format!("{b:.0} rad/s²")).join(", "),
    }
}

/// Largest less smallest.
fn extent(values: [f64; 3]) -> f64 {
    let (least, most) = range(values.into_iter());
    most - least
}

fn more_sensitive(responses: &[&Response; 3]) -> Statement {
    let share = |coordinate: usize| {
        let peaks = responses.map(|r| r.full.acceleration[coordinate]);
        extent(peaks) / (peaks.iter().sum::<f64>() / 3.0)
    };
    let (x, beta) = (share(0), share(4));
    Statement {
        place: "4.2.2, Figure 13".into(),
        says: "friction changes the acceleration of beta more than that in x".to_owned(),
        criterion: "the three peaks of beta differ by a larger share of their mean than those of x"
            .to_owned(),
        verdict: verdict(beta > x),
        evidence: format!("beta: {:.1} %, x: {:.1} %", beta * 100.0, x * 100.0),
    }
}

fn main_influence(by_clearance: &[&Response; 3], by_friction: &[&Response; 3]) -> Statement {
    let strongest = |r: &Response| r.full.normal.iter().copied().fold(0.0, f64::max);
    let clearance = extent(by_clearance.map(strongest));
    let friction = extent(by_friction.map(strongest));
    Statement {
        place: "4.2.2".into(),
        says: "friction is the main influence on the contact force".to_owned(),
        criterion:
            "the largest force of any joint changes more over the three frictions than over the three clearances"
                .to_owned(),
        verdict: verdict(friction > clearance),
        evidence: format!(
            "by {friction:.0} N over the frictions, by {clearance:.0} N over the clearances"
        ),
    }
}

/// Least and largest.
pub(super) fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
        (a.min(v), b.max(v))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::response::respond;
    use crate::scene::Scene;

    #[test]
    fn numbers_have_as_many_digits_as_asked() {
        for (value, text) in [
            (0.154_943_9, "0.154944"),
            (827.324_51, "827.325"),
            (-1.0, "-1.00000"),
            (3e-9, "3.00000e-9"),
        ] {
            assert_eq!(digits(value, 6), text);
        }
        assert_eq!(digits(1.0, 1), "1");
    }

    #[test]
    fn ratios_have_their_words() {
        for (ratio, word) in [
            (1.0, Agreement::Agrees),
            (0.89, Agreement::Near),
            (2.0, Agreement::Near),
            (2.1, Agreement::Differs),
            (0.3, Agreement::Differs),
            (f64::NAN, Agreement::Differs),
        ] {
            assert_eq!(Agreement::of(ratio), word, "{ratio}");
        }
    }

    #[test]
    fn further_statements_follow_the_numbers() {
        let scene = Scene::load("spcmm", &[]).expect("built in");
        let base = respond(&scene, 1e-3, 1e-3, |_| true).expect("runs");
        let with = |forces: [f64; 3], last: f64, accelerations: [f64; 2]| {
            let mut response = base.clone();
            response.full.normal = forces.to_vec();
            response.last_separation = vec![0.01, last];
            response.full.acceleration[0] = accelerations[0];
            response.full.acceleration[4] = accelerations[1];
            response
        };
        let runs = [
            (CASES[0], with([3.0, 2.0, 1.0], 0.1, [1.0, 2.0])),
            (CASES[1], with([3.0, 2.0, 1.0], 0.2, [1.0, 3.0])),
            (CASES[2], with([1.0, 2.0, 3.0], 0.5, [4.0, 3.0])),
        ];
        let found = further_statements(&runs);
        let confirmed = |part: &str, says: &str| {
            let s = found
                .iter()
                .find(|s| s.place.contains(part) && s.says.contains(says));
            s.map(|s| s.verdict == verdict(true))
        };
        assert_eq!(confirmed("Figure 8", "S1"), Some(true));
        assert_eq!(confirmed("Figure 9", "S2"), Some(false));
        assert_eq!(confirmed("Figure 10", "S3"), Some(true));
        assert_eq!(confirmed("Figure 15", "S2"), Some(false));
        assert_eq!(confirmed("Figure 7", "larger"), Some(false));
        assert_eq!(confirmed("Figures 6", "steady"), Some(false));
        assert_eq!(confirmed("Figure 14", "S2"), None);
        // Nothing is said about friction before all three frictions are there.
        assert_eq!(confirmed("Figure 13", "changes the acceleration"), None);
        assert_eq!(confirmed("4.2.2", "main influence"), None);
        let mut more = runs.to_vec();
        // Over the frictions x stays and beta goes from 1 to 3; the forces from 3 N to 5 N, as much as over the clearances.
        more.push((CASES[3], with([2.0, 1.0, 1.0], 0.1, [1.0, 1.0])));
        more.push((CASES[4], with([5.0, 1.0, 1.0], 0.1, [1.0, 3.0])));
        let further = further_statements(&more);
        let confirmed = |says: &str| {
            let s = further.iter().find(|s| s.says.contains(says));
            s.map(|s| s.verdict == verdict(true))
        };
        assert_eq!(confirmed("changes the acceleration"), Some(true));
        assert_eq!(confirmed("main influence"), Some(true));
        more[1].1.full.normal[0] = 9.0;
        more[4].1.full.acceleration[0] = 9.0;
        let further = further_statements(&more);
        for says in ["changes the acceleration", "main influence"] {
            let s = further
                .iter()
                .find(|s| s.says.contains(says))
                .expect("said");
            assert_eq!(s.verdict, verdict(false), "{says}");
        }
        assert_eq!(
            compare(&runs).len(),
            PUBLISHED.iter().filter(|p| p.case.friction == 0.2).count()
        );
    }
}
