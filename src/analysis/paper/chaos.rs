//! What section 4.3 and the conclusions say of regimes and sections, held against sweeps and settled curves.

use std::collections::BTreeMap;

use super::words::{digits, range};
use super::{Case, Statement, Verdict, verdict};

/// Amplitudes of x (m) and of beta (rad) in trajectory (59).
pub const AMPLITUDES: [f64; 2] = [0.025, 0.025];
/// A change below this share of the amplitude counts as none.
pub const LITTLE: f64 = 0.05;
/// Names of the two coordinates.
const NAMES: [&str; 2] = ["x", "beta"];
const UNITS: [(&str, f64); 2] = [("µm", 1e-6), ("µrad", 1e-6)];

/// One value of the swept parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Swept {
    /// Value: clearance in mm, or friction.
    pub value: f64,
    /// Regime, in a word.
    pub regime: &'static str,
    /// Drive periods after which it repeats; 0 where it does not.
    pub period: usize,
    /// Largest Lyapunov exponent and its standard error, 1/s; NaN where none was measured.
    pub exponent: (f64, f64),
    /// Sections in x (m) and beta (rad), kept ones, in order of time.
    pub sections: [Vec<f64>; 2],
}

impl Swept {
    /// Latest section in a coordinate.
    pub fn latest(&self, coordinate: usize) -> f64 {
        self.sections[coordinate]
            .last()
            .copied()
            .unwrap_or(f64::NAN)
    }

    /// Distance between the extremes of the latest half of the sections in a coordinate.
    pub fn spread(&self, coordinate: usize) -> f64 {
        let all = &self.sections[coordinate];
        let (least, most) = range(all[all.len() / 2..].iter().copied());
        most - least
    }
}

/// Settled motion of one of the paper's runs over one period.
#[derive(Clone, Debug, PartialEq)]
pub struct Loop {
    /// The run.
    pub case: Case,
    /// x (m) and beta (rad) at equal drive phases, the same for every run.
    pub coordinates: [Vec<f64>; 2],
    /// Their rates, m/s and rad/s.
    pub rates: [Vec<f64>; 2],
    /// Largest difference of x and of beta at equal phases of this period and the one before: how wide the closed curve is.
    pub width: [f64; 2],
}

/// What the statements rest on.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// Settled loops by clearance and by friction.
    pub loops: [Vec<Loop>; 2],
    /// The three runs by clearance and by friction, many sections each.
    pub runs: [Vec<Swept>; 2],
    /// Sweeps over clearance and over friction, from cold starts.
    pub sweeps: [Vec<Swept>; 2],
    /// What two sections must differ by in x (m) and beta (rad) to be different.
    pub resolution: [f64; 2],
}

/// Largest distance of two loops of `loops` at equal phases over the amplitude, in a coordinate and its rate.
fn apart(loops: &[Loop], coordinate: usize) -> f64 {
    let amplitude = AMPLITUDES[coordinate];
    let most = |pick: fn(&Loop, usize) -> &Vec<f64>, amplitude: f64| {
        let phases = loops
            .iter()
            .map(|l| pick(l, coordinate).len())
            .min()
            .unwrap_or(0);
        (0..phases)
            .map(|k| {
                let (a, b) = range(loops.iter().map(|l| pick(l, coordinate)[k]));
                (b - a) / amplitude
            })
            .fold(0.0, f64::max)
    };
    // The drive turns at pi rad/s: rates have pi times the amplitude.
    most(|l, c| &l.coordinates[c], amplitude)
        .max(most(|l, c| &l.rates[c], amplitude * std::f64::consts::PI))
}

fn size(value: f64, coordinate: usize) -> String {
    let (unit, one) = UNITS[coordinate];
    format!("{} {unit}", digits(value / one, 2))
}

fn regimes(points: &[Swept]) -> String {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for point in points {
        *counts.entry(word(point)).or_default() += 1;
    }
    let total = points.len();
    let listed: Vec<String> = counts
        .iter()
        .map(|(w, n)| format!("{n} of {total} {w}"))
        .collect();
    listed.join(", ")
}

/// Regime with its period.
pub fn word(point: &Swept) -> String {
    if point.period > 0 {
        format!("{} {}", point.regime, point.period)
    } else {
        point.regime.to_owned()
    }
}

fn ascending(values: &[f64]) -> bool {
    values.windows(2).all(|pair| pair[0] < pair[1])
}

/// All regular: sections repeat after one period within the resolution in `coordinate`.
fn repeats(points: &[Swept], coordinate: usize, resolution: f64) -> bool {
    !points.is_empty() && points.iter().all(|p| p.spread(coordinate) <= resolution)
}

/// The statements of section 4.3 and of the conclusions that rest on it, one by one. Those without data are left out.
pub fn statements(found: &Found) -> Vec<Statement> {
    let mut out = Vec::new();
    for (which, (phase, section)) in [("Figure 18", "Figure 19"), ("Figure 21", "Figure 22")]
        .into_iter()
        .enumerate()
    {
        if found.loops[which].len() == 3 {
            portraits(found, which, phase, &mut out);
        }
        if found.runs[which].len() == 3 {
            sections(found, which, section, &mut out);
        }
    }
    if !found.sweeps[0].is_empty() {
        clearance(found, &mut out);
    }
    if !found.sweeps[1].is_empty() {
        friction(found, &mut out);
    }
    out
}

fn place(figure: &str, part: &str) -> String {
    format!("4.3, {figure}{part}")
}

fn statement(
    place: String,
    says: &str,
    criterion: String,
    holds: bool,
    evidence: String,
) -> Statement {
    Statement {
        place: place.into(),
        says: says.to_owned(),
        criterion,
        verdict: verdict(holds),
        evidence,
    }
}

fn portraits(found: &Found, which: usize, figure: &str, out: &mut Vec<Statement>) {
    let loops = &found.loops[which];
    let cause = ["clearance", "friction"][which];
    let little = |out: &mut Vec<Statement>, c: usize| {
        let share = apart(loops, c);
        out.push(statement(
            place(figure, ["a", "b"][c]),
            &format!("the phase portraits in {} coincide: {cause} has little effect on them", NAMES[c]),
            format!("in settled motion no two of the three differ by more than {:.0} % of the amplitude at equal phases", LITTLE * 100.0),
            share < LITTLE,
            format!("at most {:.2} %", share * 100.0),
        ));
    };
    little(out, 0);
    let widths: Vec<f64> = loops.iter().map(|l| l.width[1]).collect();
    let listed: Vec<String> = loops
        .iter()
        .map(|l| {
            format!(
                "{} mm, cf {}: {}",
                l.case.clearance,
                l.case.friction,
                size(l.width[1], 1)
            )
        })
        .collect();
    let wide = widths.iter().all(|w| *w > found.resolution[1]);
    if which == 0 {
        out.push(statement(
            place(figure, "b"),
            "the closed curves in beta have a width that grows with the clearance",
            format!(
                "beta differs between two successive settled periods by more than its resolution of {}, and more the larger the clearance",
                size(found.resolution[1], 1)
            ),
            wide && ascending(&widths),
            listed.join("; "),
        ));
    } else {
        little(out, 1);
        out.push(statement(
            place(figure, "b"),
            "the closed curves in beta are wide, as of a quasi-periodic motion",
            format!(
                "beta differs between two successive settled periods by more than {} at all three",
                size(found.resolution[1], 1)
            ),
            wide,
            listed.join("; "),
        ));
    }
}

fn sections(found: &Found, which: usize, figure: &str, out: &mut Vec<Statement>) {
    let runs = &found.runs[which];
    let told: Vec<String> = runs
        .iter()
        .map(|r| format!("{}: {}", r.value, word(r)))
        .collect();
    let quasi = runs.iter().all(|r| r.regime == "quasi-periodic");
    if which == 0 {
        let x: Vec<f64> = runs.iter().map(|r| r.latest(0)).collect();
        let apart = x
            .windows(2)
            .all(|pair| pair[1] - pair[0] > found.resolution[0]);
        let listed: Vec<String> = x.iter().map(|x| format!("{:.4} mm", x * 1e3)).collect();
        out.push(statement(
            place(figure, "a"),
            "the sections in x are three points, further right for a larger clearance",
            "x of the section grows with the clearance by more than the resolution".to_owned(),
            apart,
            listed.join(", "),
        ));
    }
    out.push(statement(
        place(figure, if which == 0 { "a" } else { "" }),
        "the motion is quasi-periodic",
        "all three are of the regime quasi-periodic (exponent not told from 0, regular 0-1 test, no period)".to_owned(),
        quasi,
        told.join("; "),
    ));
    if which == 1 {
        out.push(centre(runs, found.resolution));
    }
    let spreads: Vec<f64> = runs.iter().map(|r| r.spread(1)).collect();
    let listed: Vec<String> = spreads.iter().map(|s| size(*s, 1)).collect();
    if which == 0 {
        out.push(statement(
            place(figure, "b"),
            "the sections in beta fill areas that grow with the clearance",
            format!(
                "their spread is above the resolution of {} and grows",
                size(found.resolution[1], 1)
            ),
            spreads.iter().all(|s| *s > found.resolution[1]) && ascending(&spreads),
            format!("spreads {}", listed.join(", ")),
        ));
    } else {
        let shares = [0, 1].map(|c| {
            let (a, b) = range(runs.iter().map(|r| r.latest(c)));
            (b - a) / AMPLITUDES[c]
        });
        out.push(statement(
            place(figure, ""),
            "friction has little effect on the sections in x and in beta",
            format!(
                "they lie within {:.0} % of the amplitude of each other",
                LITTLE * 100.0
            ),
            shares.iter().all(|s| *s < LITTLE),
            format!(
                "x: {:.2} %, beta: {:.2} %",
                shares[0] * 100.0,
                shares[1] * 100.0
            ),
        ));
    }
}

/// Whether sections crowd around a centre, which needs sections that can be told apart.
fn centre(runs: &[Swept], resolution: [f64; 2]) -> Statement {
    let mut listed = Vec::new();
    let dense = |run: &Swept| {
        let middle = [0, 1].map(|c| {
            let all = &run.sections[c];
            all.iter().sum::<f64>() / all.len() as f64
        });
        let pairs = run.sections[0].iter().zip(&run.sections[1]);
        let distances: Vec<f64> = pairs
            .map(|(x, beta)| {
                let [x, beta] = [
                    (x - middle[0]) / resolution[0],
                    (beta - middle[1]) / resolution[1],
                ];
                (x * x + beta * beta).sqrt()
            })
            .collect();
        let furthest = distances.iter().copied().fold(0.0, f64::max);
        let within = distances.iter().filter(|d| **d < furthest / 2.0).count();
        let share = within as f64 / distances.len() as f64;
        let told = furthest > 0.5;
        listed.push(if told {
            format!("{}: {:.0} %", run.value, share * 100.0)
        } else {
            format!("{}: all within the resolution", run.value)
        });
        told && share > 0.5
    };
    let held = runs.iter().map(dense).filter(|dense| *dense).count();
    statement(
        place("Figure 22", ""),
        "the sections lie denser the nearer to their centre",
        "at all three frictions they can be told apart, and more than half of them lie within half of the largest distance from \
         their mean, in units of the resolution"
            .to_owned(),
        held == runs.len(),
        listed.join("; "),
    )
}

/// Points whose exponent is above its uncertainty, or whose regime is chaotic.
fn chaotic(points: &[Swept]) -> usize {
    points.iter().filter(|p| p.regime == "chaotic").count()
}

fn exponents(points: &[Swept]) -> String {
    let (least, most) = range(
        points
            .iter()
            .map(|p| p.exponent.0)
            .filter(|e| e.is_finite()),
    );
    if least > most {
        return "no exponents measured".to_owned();
    }
    format!("largest Lyapunov exponents from {least:.2} to {most:.2} 1/s")
}

fn clearance(found: &Found, out: &mut Vec<Statement>) {
    let points = &found.sweeps[0];
    let widest = points.iter().map(|p| p.spread(0)).fold(0.0, f64::max);
    out.push(statement(
        place("Figure 20", "a"),
        "the motion in x is periodic at every clearance from 0.01 to 1 mm",
        format!(
            "at every point the latest half of the sections in x agree within {}",
            size(found.resolution[0], 0)
        ),
        repeats(points, 0, found.resolution[0]),
        format!(
            "largest spread {} over {} clearances",
            size(widest, 0),
            points.len()
        ),
    ));
    let (lower, upper) = points.split_at(points.len() / 2);
    let from_regular = points.first().is_some_and(|p| p.period > 0);
    let to_chaos = points.last().is_some_and(|p| p.regime == "chaotic");
    out.push(statement(
        place("Figure 20", "b"),
        "the motion in beta goes from periodic to chaotic as the clearance grows",
        "the smallest clearance is periodic, the largest chaotic (exponent above 0 by more than its uncertainty)".to_owned(),
        from_regular && to_chaos,
        format!("{}; {}", regimes(points), exponents(points)),
    ));
    let spread = |half: &[Swept]| half.iter().map(|p| p.spread(1)).fold(0.0, f64::max);
    out.push(Statement {
        place: "5, third conclusion".into(),
        says: "chaos in beta becomes more obvious with a larger clearance".to_owned(),
        criterion: "more chaotic points in the upper half of the clearances than in the lower half"
            .to_owned(),
        verdict: verdict(chaotic(upper) > chaotic(lower)),
        evidence: format!(
            "{} chaotic points below, {} above; largest spread of beta {} below, {} above",
            chaotic(lower),
            chaotic(upper),
            size(spread(lower), 1),
            size(spread(upper), 1)
        ),
    });
}

fn friction(found: &Found, out: &mut Vec<Statement>) {
    let points = &found.sweeps[1];
    let all_periodic = points.iter().all(|p| p.period == 1);
    out.push(statement(
        place("Figure 23", ""),
        "the motion is periodic at every friction from 0.01 to 0.4",
        "every point is periodic 1".to_owned(),
        all_periodic,
        format!("{}; {}", regimes(points), exponents(points)),
    ));
    let shares = [0, 1].map(|c| {
        let (a, b) = range(points.iter().map(|p| p.latest(c)));
        (b - a) / AMPLITUDES[c]
    });
    out.push(statement(
        place("Figure 23", ""),
        "friction has little effect on the bifurcation diagrams in x and beta",
        format!(
            "over the whole range the sections move by less than {:.0} % of the amplitude",
            LITTLE * 100.0
        ),
        shares.iter().all(|s| *s < LITTLE),
        format!(
            "x: {:.2} %, beta: {:.2} %",
            shares[0] * 100.0,
            shares[1] * 100.0
        ),
    ));
    let chaotic = chaotic(points);
    out.push(Statement {
        place: "5, third conclusion".into(),
        says: "friction has little effect on chaos".to_owned(),
        criterion: "either every friction is chaotic or none is".to_owned(),
        verdict: verdict(chaotic == 0 || chaotic == points.len()),
        evidence: format!(
            "{chaotic} of {} points chaotic; {}",
            points.len(),
            exponents(points)
        ),
    });
}

/// The second conclusion: the statements of section 4.2 about peaks, taken together.
pub fn second_conclusion(of_section: &[Statement]) -> Vec<Statement> {
    ["clearance", "friction"]
        .into_iter()
        .filter_map(|cause| {
            let parts: Vec<&Statement> = of_section
                .iter()
                .filter(|s| s.says.ends_with(&format!("grows with the {cause}")))
                .collect();
            let held = parts
                .iter()
                .filter(|s| s.verdict == Verdict::Confirmed)
                .count();
            (!parts.is_empty()).then(|| Statement {
                place: "5, second conclusion".into(),
                says: format!("the response becomes more violent with {cause}"),
                criterion: "every measured quantity of section 4.2 grows at both steps".to_owned(),
                verdict: verdict(held == parts.len()),
                evidence: format!("{held} of {} quantities do", parts.len()),
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::paper::{BY_CLEARANCE, BY_FRICTION};

    fn point(value: f64, regime: &'static str, x: f64, beta: &[f64]) -> Swept {
        Swept {
            value,
            regime,
            period: usize::from(regime == "periodic"),
            exponent: (-1.0, 0.1),
            sections: [vec![x; beta.len()], beta.to_vec()],
        }
    }

    fn find(out: &[Statement], place: &str, says: &str) -> Option<Verdict> {
        let found = out
            .iter()
            .find(|s| s.place.contains(place) && s.says.contains(says));
        found.map(|s| s.verdict)
    }

    #[test]
    fn verdicts_follow_what_was_found() {
        use Verdict::{Confirmed, NotConfirmed};
        let wide = |w: f64| vec![0.0, w, 0.0, w, 0.0, w, 0.0, w];
        let mut found = Found {
            resolution: [1e-7, 1e-6],
            ..Found::default()
        };
        assert!(statements(&found).is_empty());
        // As the paper has it.
        found.sweeps[0] = vec![
            point(0.01, "periodic", 0.2, &wide(0.0)),
            point(0.5, "periodic", 0.2, &wide(0.0)),
            point(1.0, "chaotic", 0.2, &wide(1e-3)),
        ];
        found.runs[0] = vec![
            point(0.3, "quasi-periodic", 0.2, &wide(1e-4)),
            point(0.5, "quasi-periodic", 0.21, &wide(2e-4)),
            point(0.7, "quasi-periodic", 0.22, &wide(3e-4)),
        ];
        let out = statements(&found);
        assert_eq!(find(&out, "20a", "periodic"), Some(Confirmed));
        assert_eq!(find(&out, "20b", "chaotic"), Some(Confirmed));
        assert_eq!(find(&out, "third", "larger clearance"), Some(Confirmed));
        assert_eq!(find(&out, "19a", "further right"), Some(Confirmed));
        assert_eq!(find(&out, "19a", "quasi-periodic"), Some(Confirmed));
        assert_eq!(find(&out, "19b", "areas"), Some(Confirmed));
        assert_eq!(find(&out, "Figure 23", "periodic"), None);
        // All periodic.
        for points in [&mut found.sweeps[0], &mut found.runs[0]] {
            for p in points {
                *p = point(p.value, "periodic", 0.2, &wide(0.0));
            }
        }
        found.sweeps[1] = vec![
            point(0.01, "periodic", 0.2, &wide(0.0)),
            point(0.4, "periodic", 0.21, &wide(0.0)),
        ];
        let out = statements(&found);
        for (place, says, verdict) in [
            ("20a", "periodic", Confirmed),
            ("20b", "chaotic", NotConfirmed),
            ("third", "larger clearance", NotConfirmed),
            ("19a", "further right", NotConfirmed),
            ("19a", "quasi-periodic", NotConfirmed),
            ("19b", "areas", NotConfirmed),
            ("Figure 23", "motion is periodic", Confirmed),
            // 10 mm of 25 mm.
            ("Figure 23", "little effect", NotConfirmed),
            ("third", "friction has little", Confirmed),
        ] {
            assert_eq!(find(&out, place, says), Some(verdict), "{place} {says}");
        }
        // Chaos at one friction alone, and x that moves from section to section.
        found.sweeps[1][1] = point(0.4, "chaotic", 0.2, &wide(1e-3));
        found.sweeps[0][2].sections[0] = wide(1e-3);
        let out = statements(&found);
        assert_eq!(
            find(&out, "third", "friction has little"),
            Some(NotConfirmed)
        );
        assert_eq!(
            find(&out, "Figure 23", "motion is periodic"),
            Some(NotConfirmed)
        );
        assert_eq!(find(&out, "20a", "periodic"), Some(NotConfirmed));
    }

    #[test]
    fn sections_crowd_around_a_centre_only_where_they_can_be_told_apart() {
        let resolution = [1e-7, 1e-6];
        let near = [0.0, 1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 9.0, -9.0];
        let with = |size: f64| point(0.2, "chaotic", 0.2, &near.map(|v| v * size));
        let crowd = |runs: &[Swept]| centre(runs, resolution).verdict;
        assert_eq!(crowd(&[with(1e-5), with(1e-4)]), Verdict::Confirmed);
        assert_eq!(crowd(&[with(1e-5), with(1e-9)]), Verdict::NotConfirmed);
        let ring = point(0.2, "chaotic", 0.2, &[1e-4, -1e-4, 1e-4, -1e-4]);
        assert_eq!(crowd(&[ring]), Verdict::NotConfirmed);
    }

    #[test]
    fn portraits_are_compared_at_equal_phases() {
        let closed = |case: Case, shift: f64, width: f64| Loop {
            case,
            coordinates: [vec![shift; 4], vec![0.0; 4]],
            rates: [vec![0.0; 4], vec![0.0; 4]],
            width: [0.0, width],
        };
        let three = |cases: [Case; 3], shift: f64, width: f64| -> Vec<Loop> {
            let turn = [0.0, 1.0, 2.0];
            cases
                .into_iter()
                .zip(turn)
                .map(|(c, n)| closed(c, shift * n, width * (n + 1.0)))
                .collect()
        };
        let found = Found {
            loops: [
                three(BY_CLEARANCE, 1e-4, 1e-3),
                three(BY_FRICTION, 2e-3, 0.0),
            ],
            resolution: [1e-7, 1e-6],
            ..Found::default()
        };
        let out = statements(&found);
        assert_eq!(find(&out, "18a", "coincide"), Some(Verdict::Confirmed));
        assert_eq!(find(&out, "18b", "width"), Some(Verdict::Confirmed));
        // 4 mm of 25 mm apart.
        assert_eq!(find(&out, "21a", "coincide"), Some(Verdict::NotConfirmed));
        assert_eq!(find(&out, "21b", "coincide"), Some(Verdict::Confirmed));
        assert_eq!(find(&out, "21b", "wide"), Some(Verdict::NotConfirmed));
    }

    #[test]
    fn the_second_conclusion_needs_every_quantity() {
        let grows = |verdict| Statement {
            place: "4.2".into(),
            says: "a peak grows with the clearance".to_owned(),
            criterion: String::new(),
            verdict,
            evidence: String::new(),
        };
        let both = [grows(Verdict::Confirmed), grows(Verdict::NotConfirmed)];
        assert_eq!(second_conclusion(&both)[0].verdict, Verdict::NotConfirmed);
        assert_eq!(second_conclusion(&both[..1])[0].verdict, Verdict::Confirmed);
        assert_eq!(second_conclusion(&both).len(), 1);
    }
}
