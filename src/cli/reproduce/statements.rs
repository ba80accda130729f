//! What must hold here for a statement of the paper to count as confirmed, and the numbers behind the verdict, in words.

use super::text::{self, join, regime};
use crate::analysis::paper::{Coordinate, Sections, Series, Test};
use crate::analysis::regime::Regime;
use crate::analysis::reproduction::{COLUMNS, Grounds, LITTLE, Statement, column_of};

/// The criterion of a statement and the evidence for its verdict.
pub(super) fn words(statement: &Statement) -> (String, String) {
    use Grounds::{Count, Crowds, Halves, Joints, Pairs, Regimes, Resolved, Values};
    let little = LITTLE * 100.0;
    match (&statement.claim.test, &statement.grounds) {
        (&Test::StaysNearIdeal { coordinate, run }, Pairs(found)) => {
            let (at, unit) = (Series::Clearance.run_name(run), unit(coordinate));
            let (most, share) = (found[0].0 * 1e3, percent(found[0].1, 1));
            (
                format!("at {at}, {coordinate} leaves the ideal motion by less than {little} % of its amplitude"),
                format!("{at}: at most {most:.3} m{unit}, {share} of the amplitude"),
            )
        }
        (&Test::Grows { of, with }, Values(values)) => (
            "larger at each of the three values than at the one before, in continuous time".to_owned(),
            each(with, values, |v| format!("{} {}", digits(*v, 6), of.unit())),
        ),
        (Test::AllGrow(_), Count(held, of)) => (
            "every measured quantity of section 4.2 grows at both steps".to_owned(),
            format!("{held} of {of} quantities do"),
        ),
        (&Test::Exceeds { of, that, over }, Pairs(pairs)) => {
            let (unit, other) = (of.unit(), that.unit());
            (
                format!("its peak is the larger number, {unit} against {other}, at all three {over}s"),
                each(over, pairs, |(large, small)| format!("{large:.0} {unit} and {small:.0} {other}")),
            )
        }
        (&Test::NoRule { of, with }, Values(values)) => (
            format!("the middle {with} has the largest or the smallest of the three peaks"),
            each(with, values, |v| format!("{v:.0} {}", of.unit())),
        ),
        (&Test::DiffersMore { of, than, with }, Values(shares)) => {
            let listed = [of, than].into_iter().zip(shares);
            (
                format!("over the three {with}s the {of} differs by a larger share of its mean than the {than}"),
                join(listed.map(|(of, share)| format!("{of}: {}", percent(*share, 1)))),
            )
        }
        (&Test::ChangesMoreWith { of, with, than }, Values(changes)) => {
            let [this, other] = [0, 1].map(|k| format!("{:.0} {}", changes[k], of.unit()));
            (
                format!("the {of} changes more over the three {with}s than over the three {than}s"),
                format!("by {this} over the {with}s, by {other} over the {than}s"),
            )
        }
        (&Test::Steady { after, over }, Values(last)) => (
            format!("no ball leaves its socket after {after} s"),
            each(over, last, |t| format!("last separation {t:.4} s")),
        ),
        (Test::Hardest { .. }, Joints(forces)) => (
            "that joint has the largest peak force, in continuous time".to_owned(),
            join(forces.iter().map(|(name, force)| format!("{name}: {force:.1} N"))),
        ),
        (Test::Coincide { columns, from, .. }, Values(shares)) => {
            let when = if *from > 0.0 { format!("from {from} s on") } else { "over the whole period".to_owned() };
            let labels = columns.iter().map(|name| COLUMNS[column_of(name)].label);
            (
                format!(
                    "{when} no two of the curves are further apart than {little} % of the amplitude of the ideal motion"
                ),
                listed(labels, shares),
            )
        }
        (Test::FormulationsAgree(coordinates), Pairs(found)) => {
            let each = coordinates.iter().zip(found).map(|(&c, (apart, share))| {
                let (apart, unit, share) = (apart * 1e3, unit(c), percent(*share, 2));
                format!("{c}: {apart:.3e} m{unit}, {share}")
            });
            (
                format!(
                    "x and beta of the tree and the lagrange formulation stay within {little} % of their largest deviation \
                     from the ideal motion"
                ),
                each.collect::<Vec<_>>().join("; "),
            )
        }
        (Test::PortraitsCoincide { .. }, Values(shares)) => (
            format!(
                "in settled motion no two of the three differ by more than {little} % of the amplitude at equal phases"
            ),
            format!("at most {}", percent(shares[0], 2)),
        ),
        (&Test::PortraitsWide { of, over, growing }, Resolved(widths, resolution)) => {
            let resolved = size(*resolution, of);
            let more = if growing {
                format!("its resolution of {resolved}, and more the larger the {over}")
            } else {
                format!("{resolved} at all three")
            };
            (
                format!("{of} differs between two successive settled periods by more than {more}"),
                each(over, widths, |w| size(*w, of)),
            )
        }
        (&Test::SectionsAscend { of, over }, Resolved(latest, _)) => (
            format!("{of} of the section grows with the {over} by more than the resolution"),
            each(over, latest, |v| format!("{:.4} m{}", v * 1e3, unit(of))),
        ),
        (&Test::SectionsSpread { of, over }, Resolved(spreads, resolution)) => (
            format!("their spread is above the resolution of {} and grows", size(*resolution, of)),
            each(over, spreads, |s| size(*s, of)),
        ),
        (&Test::SectionsCrowd(over), Crowds(crowds)) => (
            format!(
                "at all three {over}s they can be told apart, and more than half of them lie within half of the largest \
                 distance from their mean, in units of the resolution"
            ),
            each(over, crowds, |share| match share {
                Some(share) => percent(*share, 0),
                None => "all within the resolution".to_owned(),
            }),
        ),
        (Test::SectionsStay { of, .. }, Values(shares)) => (
            match of {
                Sections::Runs => {
                    format!("they lie within {little} % of the amplitude of each other")
                }
                Sections::Sweep => {
                    format!("over the whole range the sections move by less than {little} % of the amplitude")
                }
            },
            listed(Coordinate::ALL.map(Coordinate::word), shares),
        ),
        (&Test::SectionsRepeat { of, over }, Resolved(spreads, resolution)) => {
            let widest = spreads.iter().copied().fold(0.0, f64::max);
            let (widest, points) = (size(widest, of), spreads.len());
            (
                format!(
                    "at every point the latest half of the sections in {of} agree within {}",
                    size(*resolution, of)
                ),
                format!("largest spread {widest} over {points} {over}s"),
            )
        }
        (&Test::QuasiPeriodic(over), Regimes(runs, _)) => (
            "all three are of the regime quasi-periodic (exponent not told from 0, regular 0-1 \
             test, no period)"
                .to_owned(),
            each(over, runs, |run| regime(*run)),
        ),
        (Test::AllPeriodic(_), Regimes(points, exponents)) => {
            ("every point is periodic 1".to_owned(), format!("{}; {}", regimes(points), measured(*exponents)))
        }
        (Test::PeriodicToChaotic(over), Regimes(points, exponents)) => (
            format!(
                "the smallest {over} is periodic, the largest chaotic (exponent above 0 by more than its uncertainty)"
            ),
            format!("{}; {}", regimes(points), measured(*exponents)),
        ),
        (Test::ChaosGrows(over), Halves([(below, narrow), (above, wide)])) => {
            let [narrow, wide] = [narrow, wide].map(|spread| size(*spread, Coordinate::Beta));
            (
                format!("more chaotic points in the upper half of the {over}s than in the lower half"),
                format!(
                    "{below} chaotic points below, {above} above; largest spread of beta {narrow} below, {wide} above"
                ),
            )
        }
        (Test::ChaosAllOrNone(over), Regimes(points, exponents)) => {
            let chaotic = points.iter().filter(|p| **p == Some(Regime::Chaotic));
            let (chaotic, all) = (chaotic.count(), points.len());
            (
                format!("either every {over} is chaotic or none is"),
                format!("{chaotic} of {all} points chaotic; {}", measured(*exponents)),
            )
        }
        other => unreachable!("a test has grounds of its kind: {other:?}"),
    }
}

/// Number of points per regime.
fn regimes(points: &[Option<Regime>]) -> String {
    let mut counts = text::regimes(points.iter().copied());
    counts.sort();
    let total = points.len();
    join(counts.iter().map(|(w, n)| format!("{n} of {total} {w}")))
}

fn measured((least, most): (f64, f64)) -> String {
    if least > most {
        return "no exponents measured".to_owned();
    }
    format!("largest Lyapunov exponents from {least:.2} to {most:.2} 1/s")
}

/// `text` of the value of each run in a series.
fn each<T>(series: Series, values: &[T], text: impl Fn(&T) -> String) -> String {
    let runs = series.cases().into_iter().zip(values);
    join(runs.map(|(case, value)| format!("{}: {}", series.run_name(case), text(value))))
}

/// Shares of what has `labels`.
fn listed<'a>(labels: impl IntoIterator<Item = &'a str>, shares: &[f64]) -> String {
    let listed = labels.into_iter().zip(shares);
    join(listed.map(|(label, share)| format!("{label}: {}", percent(*share, 2))))
}

fn percent(share: f64, decimals: usize) -> String {
    format!("{:.decimals$} %", share * 100.0)
}

/// SI unit of a coordinate.
fn unit(coordinate: Coordinate) -> &'static str {
    ["m", "rad"][coordinate as usize]
}

/// A small distance in a coordinate.
fn size(value: f64, coordinate: Coordinate) -> String {
    format!("{} µ{}", digits(value / 1e-6, 2), unit(coordinate))
}

/// `value` with `n` significant digits.
fn digits(value: f64, n: usize) -> String {
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

#[cfg(test)]
mod tests {
    use super::digits;

    #[test]
    fn numbers_have_as_many_digits_as_asked() {
        for (value, text) in
            [(0.154_943_9, "0.154944"), (827.324_51, "827.325"), (-1.0, "-1.00000"), (3e-9, "3.00000e-9")]
        {
            assert_eq!(digits(value, 6), text);
        }
        assert_eq!(digits(1.0, 1), "1");
    }
}
