//! What sections 4.2.1 to 4.2.3 say of whole curves: where they coincide, and from when on.

use std::f64::consts::PI;

use super::chaos::{AMPLITUDES, LITTLE};
use super::{Statement, verdict};

/// One instant of a run: time (s), x, its velocity and acceleration, beta, its rate and acceleration (SI units).
pub type Sample = [f64; 7];

/// Runs at the same instants, the paper's output step apart.
#[derive(Clone, Debug, Default)]
pub struct Curves {
    /// Clearance ascending, at the same friction.
    pub by_clearance: Vec<Vec<Sample>>,
    /// Friction ascending, at the same clearance.
    pub by_friction: Vec<Vec<Sample>>,
    /// The same run by two formulations that share no equations of motion, and with ideal joints.
    pub verified: Vec<Vec<Sample>>,
    /// With ideal joints.
    pub ideal: Vec<Sample>,
}

const NAMES: [&str; 7] = [
    "time",
    "x",
    "velocity in x",
    "acceleration in x",
    "beta",
    "rate of beta",
    "acceleration of beta",
];

/// Amplitude of a column in the ideal motion, which turns at pi rad/s.
fn amplitude(column: usize) -> f64 {
    let turned = [1.0, PI, PI * PI][(column - 1) % 3];
    AMPLITUDES[(column - 1) / 3] * turned
}

/// Largest distance of any two of `curves` at an instant from `from` (s) on, over the amplitude.
fn apart(curves: &[&[Sample]], column: usize, from: f64) -> f64 {
    let instants = curves.iter().map(|c| c.len()).min().unwrap_or(0);
    let at = |k: usize| {
        let (least, most) = super::words::range(curves.iter().map(|c| c[k][column]));
        (most - least) / amplitude(column)
    };
    let late = (0..instants).filter(|&k| curves[0][k][0] >= from);
    late.map(at).fold(0.0, f64::max)
}

fn coincide(
    place: &'static str,
    says: &str,
    curves: &[&[Sample]],
    columns: &[usize],
    from: f64,
) -> Option<Statement> {
    if curves.len() < 2 || curves.iter().any(|c| c.is_empty()) {
        return None;
    }
    let shares: Vec<f64> = columns.iter().map(|&c| apart(curves, c, from)).collect();
    let listed = columns.iter().zip(&shares);
    let listed: Vec<String> = listed
        .map(|(&c, share)| format!("{}: {:.2} %", NAMES[c], share * 100.0))
        .collect();
    let when = if from > 0.0 {
        format!("from {from} s on")
    } else {
        "over the whole period".to_owned()
    };
    Some(Statement {
        place: place.into(),
        says: says.to_owned(),
        criterion: format!(
            "{when} no two of the curves are further apart than {:.0} % of the amplitude of the ideal motion",
            LITTLE * 100.0
        ),
        verdict: verdict(shares.iter().all(|share| *share < LITTLE)),
        evidence: listed.join(", "),
    })
}

fn slices(runs: &[Vec<Sample>]) -> Vec<&[Sample]> {
    runs.iter().map(Vec::as_slice).collect()
}

/// The statements about whole curves; those whose runs are missing are left out.
pub fn statements(curves: &Curves) -> Vec<Statement> {
    const X: usize = 1;
    const BETA: usize = 4;
    let with_ideal = |runs| [slices(runs), vec![&curves.ideal[..]]].concat();
    let (c, f) = (slices(&curves.by_clearance), slices(&curves.by_friction));
    let two = slices(&curves.verified);
    let mut out = Vec::new();
    let mut say = |place, says, curves: &[&[Sample]], columns: &[usize], from| {
        out.extend(coincide(place, says, curves, columns, from));
    };
    say(
        "4.2.1, Figure 5b",
        "after 0.3 s the curves of beta coincide whatever the clearance",
        &c,
        &[BETA],
        0.3,
    );
    say(
        "4.2.1, Figure 6",
        "after 0.4 s the velocities coincide whatever the clearance",
        &c,
        &[X + 1, BETA + 1],
        0.4,
    );
    say(
        "4.2.1, Figure 7",
        "after 0.4 s the accelerations no longer fluctuate, at all three clearances",
        &with_ideal(&curves.by_clearance),
        &[X + 2, BETA + 2],
        0.4,
    );
    say(
        "4.2.2, Figure 11a",
        "the curves of x coincide whatever the friction",
        &f,
        &[X],
        0.0,
    );
    say(
        "4.2.2, Figure 11b",
        "after 0.3 s the curves of beta coincide whatever the friction",
        &f,
        &[BETA],
        0.3,
    );
    say(
        "4.2.2, Figure 12",
        "after 0.3 s friction has little effect on the velocities",
        &f,
        &[X + 1, BETA + 1],
        0.3,
    );
    say(
        "4.2.2, Figure 13",
        "after 0.3 s the accelerations no longer fluctuate, at all three frictions",
        &with_ideal(&curves.by_friction),
        &[X + 2, BETA + 2],
        0.3,
    );
    say(
        "4.2.3, Figure 17a and b",
        "two programs and the motion without clearance agree in x and beta",
        &with_ideal(&curves.verified),
        &[X, BETA],
        0.0,
    );
    say(
        "4.2.3, Figure 17c to f",
        "in steady motion velocities and accelerations of two programs agree",
        &two,
        &[X + 1, BETA + 1, X + 2, BETA + 2],
        0.3,
    );
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::paper::Verdict::{self, Confirmed, NotConfirmed};

    /// A curve that is `early` off until 0.35 s and `late` off afterwards, in every column.
    fn curve(early: f64, late: f64) -> Vec<Sample> {
        let instants = (0..=20).map(|k| f64::from(k) * 0.1);
        instants
            .map(|t| {
                let off = if t < 0.35 { early } else { late };
                std::array::from_fn(|c| if c == 0 { t } else { off * amplitude(c) })
            })
            .collect()
    }

    fn find(out: &[Statement], place: &str) -> Option<Verdict> {
        out.iter()
            .find(|s| s.place.ends_with(place))
            .map(|s| s.verdict)
    }

    #[test]
    fn curves_coincide_from_the_instant_that_is_asked_for() {
        assert!(statements(&Curves::default()).is_empty());
        let three =
            |early: f64, late: f64| [0.0, 0.5, 1.0].map(|n| curve(early * n, late * n)).to_vec();
        let curves = Curves {
            // Apart in the beginning only, and until after 0.3 s.
            by_clearance: three(0.5, 0.0),
            by_friction: three(0.0, 0.04),
            verified: three(0.0, 0.0)[..2].to_vec(),
            ideal: curve(0.0, 0.06),
        };
        let out = statements(&curves);
        for (place, verdict) in [
            ("Figure 5b", NotConfirmed),
            ("Figure 6", Confirmed),
            // 6 % from the ideal motion, though not from each other.
            ("Figure 7", NotConfirmed),
            ("Figure 11a", Confirmed),
            ("Figure 11b", Confirmed),
            ("Figure 12", Confirmed),
            ("Figure 13", NotConfirmed),
            ("Figure 17a and b", NotConfirmed),
            ("Figure 17c to f", Confirmed),
        ] {
            assert_eq!(find(&out, place), Some(verdict), "{place}");
        }
        assert_eq!(out.len(), 9);
        // Runs that are missing answer nothing.
        let part = Curves {
            by_clearance: Vec::new(),
            ..curves
        };
        assert_eq!(find(&statements(&part), "Figure 6"), None);
    }

    #[test]
    fn rates_are_held_against_the_amplitude_of_the_rate() {
        assert_eq!([1, 2, 5].map(amplitude), [0.025, 0.025 * PI, 0.025 * PI]);
    }
}
