//! Whether the paper's statements hold here: one criterion for each kind of statement in [`paper::PAPER`].

use std::collections::BTreeMap;

use super::Findings;
use super::record::{
    COLUMNS, RecordedRow, RecordedRun, SettledPoint, column_of, derivative, exponents, extent,
};
use crate::analysis::paper::{
    Case, Claim, Coordinate, Curves, FigureValue, PAPER, Sections, Series, Test,
};
use crate::analysis::regime::Regime;

/// A change below this fraction of the amplitude counts as none.
const LITTLE: f64 = 0.05;

/// A statement of the paper and this program's verdict.
#[derive(Clone, Debug)]
pub struct Statement {
    /// Where the paper makes it, what it says, and its test.
    pub claim: &'static Claim,
    /// What must hold here for it to count as confirmed.
    pub criterion: String,
    /// Whether that holds here.
    pub confirmed: bool,
    /// The numbers behind the verdict.
    pub evidence: String,
}

/// A criterion in words, whether it is met, and the numbers behind that.
type Judged = (String, bool, String);

impl Findings {
    /// Every statement of the paper, in its order.
    pub fn statements(&self) -> Vec<Statement> {
        let mut out: Vec<Statement> = Vec::new();
        for claim in &PAPER.statements {
            let (criterion, confirmed, evidence) = match claim.test {
                Test::AllGrow(with) => all_grow(with, &out),
                _ => self.judge(&claim.test),
            };
            out.push(Statement {
                claim,
                criterion,
                confirmed,
                evidence,
            });
        }
        out
    }

    fn judge(&self, test: &Test) -> Judged {
        let little = LITTLE * 100.0;
        match *test {
            Test::StaysNearIdeal { coordinate, run } => {
                let most = self.run(run).response.full.deviation[coordinate.index()];
                let share = most / coordinate.amplitude(0);
                let at = Series::Clearance.name(run.clearance);
                (
                    format!(
                        "at {at}, {coordinate} leaves the ideal motion by less than {little} % of its amplitude"
                    ),
                    share < LITTLE,
                    format!(
                        "{at}: at most {:.3} {}, {:.1} % of the amplitude",
                        most * 1e3,
                        ["mm", "mrad"][coordinate as usize],
                        share * 100.0
                    ),
                )
            }
            Test::Grows { of, with } => {
                let values = self.values(of, with);
                (
                    "larger at each of the three values than at the one before, in continuous time"
                        .to_owned(),
                    ascending(&values),
                    each(with, &values, |v| {
                        format!("{} {}", digits(*v, 6), of.unit())
                    }),
                )
            }
            Test::AllGrow(_) => unreachable!("judged by the statements before it"),
            Test::Exceeds { of, that, over } => {
                let (large, small) = (self.values(of, over), self.values(that, over));
                let pairs = [0, 1, 2].map(|k| (large[k], small[k]));
                let (unit, other) = (of.unit(), that.unit());
                (
                    format!(
                        "its peak is the larger number, {unit} against {other}, at all three {}",
                        over.values()
                    ),
                    pairs.iter().all(|(large, small)| large > small),
                    each(over, &pairs, |(large, small)| {
                        format!("{large:.0} {unit} and {small:.0} {other}")
                    }),
                )
            }
            Test::NoRule { of, with } => {
                let v = self.values(of, with);
                (
                    format!("the middle {with} has the largest or the smallest of the three peaks"),
                    (v[1] - v[0]) * (v[2] - v[1]) < 0.0,
                    each(with, &v, |v| format!("{v:.0} {}", of.unit())),
                )
            }
            Test::DiffersMore { of, than, with } => {
                let [this, other] = [of, than].map(|quantity| {
                    let values = self.values(quantity, with);
                    extent(values.into_iter()) / (values.iter().sum::<f64>() / 3.0)
                });
                (
                    format!(
                        "over the three {} the {of} differs by a larger share of its mean than the {than}",
                        with.values()
                    ),
                    this > other,
                    format!(
                        "{of}: {:.1} %, {than}: {:.1} %",
                        this * 100.0,
                        other * 100.0
                    ),
                )
            }
            Test::ChangesMoreWith { of, with, than } => {
                let [this, other] =
                    [with, than].map(|series| extent(self.values(of, series).into_iter()));
                let (with, than, unit) = (with.values(), than.values(), of.unit());
                (
                    format!(
                        "the {of} changes more over the three {with} than over the three {than}"
                    ),
                    this > other,
                    format!(
                        "by {this:.0} {unit} over the {with}, by {other:.0} {unit} over the {than}"
                    ),
                )
            }
            Test::Steady { after, over } => {
                let last = self.values(FigureValue::LastSeparation, over);
                (
                    format!("no ball leaves its socket after {after} s"),
                    last.iter().all(|t| *t <= after),
                    each(over, &last, |t| format!("last separation {t:.4} s")),
                )
            }
            Test::Hardest { joint, run } => {
                let response = &self.run(run).response;
                let forces = &response.full.normal;
                let listed = response.joints.iter().zip(forces);
                let listed = listed.map(|(name, force)| format!("{name}: {force:.1} N"));
                (
                    "that joint has the largest peak force, in continuous time".to_owned(),
                    forces.get(joint - 1).copied() == forces.iter().copied().reduce(f64::max),
                    join(listed),
                )
            }
            Test::Coincide {
                curves,
                ideal,
                ref columns,
                from,
            } => {
                let ideal = ideal.then_some(&self.ideal);
                let curves = self.curves_of(curves).into_iter().chain(ideal);
                let curves: Vec<Vec<&RecordedRow>> = curves.map(RecordedRun::samples).collect();
                let columns: Vec<usize> = columns.iter().map(|name| column_of(name)).collect();
                let shares: Vec<f64> = columns.iter().map(|&c| apart(&curves, c, from)).collect();
                let when = if from > 0.0 {
                    format!("from {from} s on")
                } else {
                    "over the whole period".to_owned()
                };
                let listed = columns.iter().zip(&shares);
                (
                    format!(
                        "{when} no two of the curves are further apart than {little} % of the amplitude of the ideal motion"
                    ),
                    shares.iter().all(|share| *share < LITTLE),
                    join(
                        listed.map(|(&c, share)| {
                            format!("{}: {}", COLUMNS[c].label, percent(*share))
                        }),
                    ),
                )
            }
            Test::FormulationsAgree(ref coordinates) => {
                let tree = &self.runs[0].response.full;
                let found = coordinates.iter().map(|&c| {
                    let apart = self.formulations_apart(c);
                    (c, apart, apart / tree.deviation[c.index()])
                });
                let found: Vec<(Coordinate, f64, f64)> = found.collect();
                let listed = found.iter().map(|(c, apart, share)| {
                    let unit = ["mm", "mrad"][*c as usize];
                    format!("{c}: {:.3e} {unit}, {}", apart * 1e3, percent(*share))
                });
                (
                    format!(
                        "x and beta of the tree and the lagrange formulation stay within {little} % of their largest deviation \
                         from the ideal motion"
                    ),
                    found.iter().all(|(_, _, share)| *share < LITTLE),
                    listed.collect::<Vec<_>>().join("; "),
                )
            }
            Test::PortraitsCoincide { of, over } => {
                let c = of as usize;
                let loops = self.loops(over);
                let [values, rates] = [
                    loops.map(|l| &l.coordinates[c][..]),
                    loops.map(|l| &l.rates[c][..]),
                ];
                let share =
                    (furthest(&values) / of.amplitude(0)).max(furthest(&rates) / of.amplitude(1));
                (
                    format!(
                        "in settled motion no two of the three differ by more than {little} % of the amplitude at equal phases"
                    ),
                    share < LITTLE,
                    format!("at most {}", percent(share)),
                )
            }
            Test::PortraitsWide { of, over, growing } => {
                let resolution = self.resolution[of as usize];
                let widths = self.loops(over).map(|l| l.width[of as usize]);
                let resolved = size(resolution, of);
                let more = if growing {
                    format!("its resolution of {resolved}, and more the larger the {over}")
                } else {
                    format!("{resolved} at all three")
                };
                (
                    format!(
                        "{of} differs between two successive settled periods by more than {more}"
                    ),
                    widths.iter().all(|w| *w > resolution) && (!growing || ascending(&widths)),
                    each(over, &widths, |w| size(*w, of)),
                )
            }
            Test::SectionsAscend { of, over } => {
                let resolution = self.resolution[of as usize];
                let latest: Vec<f64> = self.sections(over).iter().map(|r| r.latest(of)).collect();
                (
                    format!(
                        "{of} of the section grows with the {over} by more than the resolution"
                    ),
                    latest.windows(2).all(|pair| pair[1] - pair[0] > resolution),
                    each(over, &latest, |v| format!("{:.4} mm", v * 1e3)),
                )
            }
            Test::SectionsSpread { of, over } => {
                let resolution = self.resolution[of as usize];
                let spreads: Vec<f64> = self.sections(over).iter().map(|r| r.spread(of)).collect();
                (
                    format!(
                        "their spread is above the resolution of {} and grows",
                        size(resolution, of)
                    ),
                    spreads.iter().all(|s| *s > resolution) && ascending(&spreads),
                    each(over, &spreads, |s| size(*s, of)),
                )
            }
            Test::SectionsCrowd(over) => {
                let crowds: Vec<Option<f64>> = self
                    .sections(over)
                    .iter()
                    .map(|run| crowd(run, self.resolution))
                    .collect();
                (
                    format!(
                        "at all three {} they can be told apart, and more than half of them lie within half of the largest \
                         distance from their mean, in units of the resolution",
                        over.values()
                    ),
                    crowds.iter().all(|share| share.is_some_and(|s| s > 0.5)),
                    each(over, &crowds, |share| match share {
                        Some(share) => format!("{:.0} %", share * 100.0),
                        None => "all within the resolution".to_owned(),
                    }),
                )
            }
            Test::SectionsStay { of, over } => {
                let (points, criterion) = match of {
                    Sections::Runs => (
                        self.sections(over),
                        format!("they lie within {little} % of the amplitude of each other"),
                    ),
                    Sections::Sweep => (
                        self.swept(over),
                        format!(
                            "over the whole range the sections move by less than {little} % of the amplitude"
                        ),
                    ),
                };
                let shares = Coordinate::ALL.map(|c| {
                    let latest = points.iter().map(|p| p.latest(c));
                    (c, extent(latest) / c.amplitude(0))
                });
                (
                    criterion,
                    shares.iter().all(|(_, share)| *share < LITTLE),
                    join(
                        shares
                            .iter()
                            .map(|(c, share)| format!("{c}: {}", percent(*share))),
                    ),
                )
            }
            Test::SectionsRepeat { of, over } => {
                let (points, resolution) = (self.swept(over), self.resolution[of as usize]);
                let widest = widest(points, of);
                (
                    format!(
                        "at every point the latest half of the sections in {of} agree within {}",
                        size(resolution, of)
                    ),
                    widest <= resolution,
                    format!(
                        "largest spread {} over {} {}",
                        size(widest, of),
                        points.len(),
                        over.values()
                    ),
                )
            }
            Test::QuasiPeriodic(over) => {
                let runs = self.sections(over);
                (
                    "all three are of the regime quasi-periodic (exponent not told from 0, regular 0-1 test, no period)".to_owned(),
                    runs.iter().all(|r| r.regime == Some(Regime::QuasiPeriodic)),
                    each(over, runs, SettledPoint::word),
                )
            }
            Test::AllPeriodic(over) => {
                let points = self.swept(over);
                (
                    "every point is periodic 1".to_owned(),
                    points.iter().all(|p| p.period() == 1),
                    regimes(points),
                )
            }
            Test::PeriodicToChaotic(over) => {
                let points = self.swept(over);
                let regular = points.first().is_some_and(|p| p.period() > 0);
                (
                    format!(
                        "the smallest {over} is periodic, the largest chaotic (exponent above 0 by more than its uncertainty)"
                    ),
                    regular && points.last().is_some_and(is_chaotic),
                    regimes(points),
                )
            }
            Test::ChaosGrows(over) => {
                let points = self.swept(over);
                let (lower, upper) = points.split_at(points.len() / 2);
                let [below, above] = [lower, upper].map(chaotic);
                let [narrow, wide] = [lower, upper]
                    .map(|half| size(widest(half, Coordinate::Beta), Coordinate::Beta));
                (
                    format!(
                        "more chaotic points in the upper half of the {} than in the lower half",
                        over.values()
                    ),
                    above > below,
                    format!(
                        "{below} chaotic points below, {above} above; largest spread of beta {narrow} below, {wide} above"
                    ),
                )
            }
            Test::ChaosAllOrNone(over) => {
                let points = self.swept(over);
                let (chaotic, all) = (chaotic(points), points.len());
                (
                    format!("either every {over} is chaotic or none is"),
                    chaotic == 0 || chaotic == all,
                    format!("{chaotic} of {all} points chaotic; {}", measured(points)),
                )
            }
        }
    }

    /// A quantity in continuous time, per run.
    fn values(&self, quantity: FigureValue, series: Series) -> [f64; 3] {
        let of = |case: Case| quantity.of(&self.run(case).response);
        series.cases().map(of)
    }

    fn curves_of(&self, curves: Curves) -> Vec<&RecordedRun> {
        let series = |series: Series| series.cases().map(|case| self.run(case)).to_vec();
        match curves {
            Curves::Clearance => series(Series::Clearance),
            Curves::Friction => series(Series::Friction),
            Curves::Formulations => vec![&self.runs[0], &self.lagrange],
        }
    }

    /// Largest difference between the two formulations in a coordinate at the paper's output step, m or rad.
    pub fn formulations_apart(&self, coordinate: Coordinate) -> f64 {
        let column = derivative(coordinate, 0);
        let (tree, lagrange) = (self.runs[0].samples(), self.lagrange.samples());
        let pairs = tree.iter().zip(&lagrange);
        pairs
            .map(|(a, b)| (a[column] - b[column]).abs())
            .fold(0.0, f64::max)
    }
}

/// The growth statements of section 4.2 taken together.
fn all_grow(series: Series, before: &[Statement]) -> Judged {
    let parts = before
        .iter()
        .filter(|s| matches!(s.claim.test, Test::Grows { with, .. } if with == series));
    let (all, held) = (parts.clone().count(), parts.filter(|s| s.confirmed).count());
    (
        "every measured quantity of section 4.2 grows at both steps".to_owned(),
        held == all,
        format!("{held} of {all} quantities do"),
    )
}

/// Largest distance between any two of `curves` at any instant from `from` (s) on, over the amplitude.
fn apart(curves: &[Vec<&RecordedRow>], column: usize, from: f64) -> f64 {
    let coordinate = Coordinate::ALL[(column - 1) / 3];
    let late = curves.iter().map(|c| {
        let late = c.iter().filter(|row| row[0] >= from);
        late.map(|row| row[column]).collect()
    });
    let late: Vec<Vec<f64>> = late.collect();
    furthest(&late) / coordinate.amplitude((column - 1) % 3)
}

/// Largest distance between any two of `curves` at equal indices.
fn furthest<C: AsRef<[f64]>>(curves: &[C]) -> f64 {
    let places = curves.iter().map(|c| c.as_ref().len()).min().unwrap_or(0);
    (0..places)
        .map(|k| extent(curves.iter().map(|c| c.as_ref()[k])))
        .fold(0.0, f64::max)
}

/// Fraction of the sections within half of the largest distance from their mean; `None` if they cannot be told apart.
fn crowd(run: &SettledPoint, resolution: [f64; 2]) -> Option<f64> {
    let middle = [0, 1].map(|c| {
        let all = &run.sections[c];
        all.iter().sum::<f64>() / all.len() as f64
    });
    let distance = |(x, beta): (&f64, &f64)| {
        let [x, beta] = [
            (x - middle[0]) / resolution[0],
            (beta - middle[1]) / resolution[1],
        ];
        (x * x + beta * beta).sqrt()
    };
    let pairs = run.sections[0].iter().zip(&run.sections[1]);
    let distances: Vec<f64> = pairs.map(distance).collect();
    let furthest = distances.iter().copied().fold(0.0, f64::max);
    let within = distances.iter().filter(|d| **d < furthest / 2.0).count();
    (furthest > 0.5).then(|| within as f64 / distances.len() as f64)
}

fn widest(points: &[SettledPoint], coordinate: Coordinate) -> f64 {
    let spreads = points.iter().map(|p| p.spread(coordinate));
    spreads.fold(0.0, f64::max)
}

fn is_chaotic(point: &SettledPoint) -> bool {
    point.regime == Some(Regime::Chaotic)
}

fn chaotic(points: &[SettledPoint]) -> usize {
    points.iter().filter(|p| is_chaotic(p)).count()
}

fn ascending(values: &[f64]) -> bool {
    values.windows(2).all(|pair| pair[0] < pair[1])
}

/// Number of points per regime, and their exponents.
fn regimes(points: &[SettledPoint]) -> String {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for point in points {
        *counts.entry(point.word()).or_default() += 1;
    }
    let total = points.len();
    let listed = counts.iter().map(|(w, n)| format!("{n} of {total} {w}"));
    format!("{}; {}", join(listed), measured(points))
}

fn measured(points: &[SettledPoint]) -> String {
    let (least, most) = exponents(points);
    if least > most {
        return "no exponents measured".to_owned();
    }
    format!("largest Lyapunov exponents from {least:.2} to {most:.2} 1/s")
}

/// `text` of the value of each run in a series.
fn each<T>(series: Series, values: &[T], text: impl Fn(&T) -> String) -> String {
    let runs = series.cases().into_iter().zip(values);
    join(runs.map(|(case, value)| format!("{}: {}", series.name(series.of(case)), text(value))))
}

fn join(parts: impl Iterator<Item = String>) -> String {
    parts.collect::<Vec<_>>().join(", ")
}

fn percent(share: f64) -> String {
    format!("{:.2} %", share * 100.0)
}

/// A small distance in a coordinate.
fn size(value: f64, coordinate: Coordinate) -> String {
    let unit = ["µm", "µrad"][coordinate as usize];
    format!("{} {unit}", digits(value / 1e-6, 2))
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
    use super::*;
    use crate::analysis::paper::CASES;
    use crate::analysis::reproduction::{Agenda, Extent, Outcome, ReportJob, SettledCurve};
    use crate::analysis::response::respond;
    use crate::scene::Scene;

    /// The same short run for every case, settled curves at rest, and sweeps of zeros: each test fills in what it needs.
    fn nothing_moves() -> Findings {
        let work = Agenda::new(Extent {
            settle: 1,
            runs: (9, 1),
            values: [2, 2],
            sweep: (3, 1),
            map: [2, 2],
            map_periods: (2, 1),
        })
        .expect("an extent");
        let scene = Scene::load("spcmm", &[]).expect("built in");
        let response = respond(&scene, 1e-3, 1e-3, |_| (), |_| true).expect("runs");
        let outcome = |job: &ReportJob| match *job {
            ReportJob::Run(_) => Outcome::Run(Box::new((response.clone(), Vec::new()))),
            ReportJob::Curve(n) => Outcome::Curve(SettledCurve {
                case: work.curves[n].0,
                coordinates: [vec![0.0; 4], vec![0.0; 4]],
                rates: [vec![0.0; 4], vec![0.0; 4]],
                width: [0.0; 2],
            }),
            ReportJob::Block(s, b) => {
                let sweep = &work.sweeps()[s].sweep;
                let values = sweep.grid().block(b).len() * sweep.layout().record_length();
                Outcome::Block(vec![0.0; values])
            }
        };
        let outcomes = work.jobs.iter().map(outcome).collect();
        let mut found = work.gather(outcomes).corrected;
        found.resolution = [1e-7, 1e-6];
        found
    }

    /// Expected verdicts by place and words of the statement.
    #[track_caller]
    fn expect(found: &Findings, verdicts: &[(&str, &str, bool)]) {
        let statements = found.statements();
        for (place, says, confirmed) in verdicts {
            let mut own = statements
                .iter()
                .filter(|s| s.claim.place.ends_with(place) && s.claim.says.contains(says));
            let (one, more) = (own.next(), own.next());
            assert!(one.is_some() && more.is_none(), "{place}, {says}");
            let verdict = one.map(|s| s.confirmed);
            assert_eq!(verdict, Some(*confirmed), "{place}, {says}");
        }
    }

    fn point(value: f64, regime: Regime, x: f64, beta: &[f64]) -> SettledPoint {
        SettledPoint {
            value,
            regime: Some(regime),
            exponent: (-1.0, 0.1),
            sections: [vec![x; beta.len()], beta.to_vec()],
        }
    }

    fn wide(width: f64) -> [f64; 8] {
        std::array::from_fn(|k| if k % 2 == 0 { 0.0 } else { width })
    }

    fn put(found: &mut Findings, name: &str, points: Vec<SettledPoint>) {
        let sweep = found.sweeps.iter_mut().find(|s| s.name == name);
        sweep.expect("a sweep").points = points;
    }

    #[test]
    fn verdicts_on_runs_follow_the_numbers() {
        let mut found = nothing_moves();
        let runs = [
            ([3.0, 2.0, 1.0], 0.1, [1.0, 2.0], 1e-3),
            ([3.0, 2.0, 1.0], 0.2, [1.0, 3.0], 2e-3),
            ([1.0, 2.0, 3.0], 0.5, [4.0, 3.0], 3e-3),
            // Over friction x stays and beta goes from 1 to 3; the forces go from 3 N to 5 N, more than over clearance.
            ([2.0, 1.0, 1.0], 0.1, [1.0, 1.0], 3e-3),
            ([5.0, 1.0, 1.0], 0.1, [1.0, 3.0], 2e-3),
        ];
        for (run, (forces, last, [x, beta], deviation)) in found.runs.iter_mut().zip(runs) {
            let response = &mut run.response;
            response.full.normal = forces.to_vec();
            response.last_separation = vec![Some(0.01), Some(last)];
            response.full.acceleration[0] = x;
            response.full.acceleration[4] = beta;
            response.full.deviation[0] = deviation;
            response.full.deviation[4] = deviation;
        }
        expect(
            &found,
            &[
                // 3 mm of 25 mm.
                ("Figure 5a", "no obvious deviation", false),
                ("Figure 5b", "deviation of beta grows", true),
                ("Figure 11b", "deviation of beta grows", false),
                ("Figures 8 to 10", "contact force of any joint", false),
                ("Figures 8 to 10", "last separation", true),
                ("Figure 8", "S1", true),
                ("Figure 9", "S2", false),
                ("Figure 10", "S3", true),
                ("Figure 15", "S2", false),
                ("Figure 7", "larger", false),
                ("Figures 6 to 10", "steady", false),
                ("Figures 11 to 16", "steady", true),
                ("Figure 13b", "no rule", false),
                ("Figure 13", "changes the acceleration", true),
                ("4.2.2", "main influence", true),
                ("second conclusion", "with clearance", false),
            ],
        );
        found.runs[0].response.full.acceleration[4] = 9.0;
        found.runs[1].response.full.normal[0] = 9.0;
        found.runs[4].response.full.acceleration[0] = 99.0;
        expect(
            &found,
            &[
                ("Figure 13b", "no rule", true),
                ("Figure 13", "changes the acceleration", false),
                ("4.2.2", "main influence", false),
            ],
        );
    }

    #[test]
    fn a_conclusion_needs_every_quantity() {
        let mut found = nothing_moves();
        let grow = |found: &mut Findings, case: usize, size: f64| {
            let response = &mut found.runs[case].response;
            for values in [
                &mut response.full.deviation,
                &mut response.full.rate,
                &mut response.full.acceleration,
            ] {
                *values = [size; 6];
            }
            response.full.normal = vec![size];
            response.last_separation = vec![Some(size)];
        };
        for (case, size) in [2.0, 3.0, 4.0, 1.0, 3.0].into_iter().enumerate() {
            grow(&mut found, case, size);
        }
        let of = "second conclusion";
        expect(
            &found,
            &[(of, "with clearance", true), (of, "with friction", true)],
        );
        found.runs[2].response.full.rate[0] = 1.0;
        expect(
            &found,
            &[(of, "with clearance", false), (of, "with friction", true)],
        );
    }

    #[test]
    fn curves_coincide_from_the_instant_that_is_asked_for() {
        // A curve that is off by `early` until 0.35 s and by `late` afterwards, in every coordinate and derivative.
        let curve = |early: f64, late: f64| -> Vec<RecordedRow> {
            let instants = (0..=20).map(|k| f64::from(k) * 0.1);
            let row = |t: f64| {
                let off = if t < 0.35 { early } else { late };
                let mut row = [1.0; COLUMNS.len()];
                row[0] = t;
                for c in Coordinate::ALL {
                    for nth in 0..3 {
                        row[derivative(c, nth)] = off * c.amplitude(nth);
                    }
                }
                row
            };
            instants.map(row).collect()
        };
        let mut found = nothing_moves();
        // By clearance apart only at the beginning, and until after 0.3 s; by friction 4 % apart from there on.
        let off = [
            (0.0, 0.0),
            (0.25, 0.0),
            (0.5, 0.0),
            (0.0, 0.02),
            (0.0, 0.04),
        ];
        for (run, (early, late)) in found.runs.iter_mut().zip(off) {
            run.rows = curve(early, late);
        }
        found.lagrange.rows = curve(0.0, 0.0);
        found.ideal.rows = curve(0.0, 0.06);
        expect(
            &found,
            &[
                ("Figure 5b", "coincide", false),
                ("Figure 6", "coincide", true),
                // 6 % from the ideal motion, though not from each other.
                ("Figure 7", "fluctuate", false),
                ("Figure 11a", "coincide", true),
                ("Figure 11b", "coincide", true),
                ("Figure 12", "little effect", true),
                ("Figure 13", "fluctuate", false),
                ("Figure 17a and b", "agree", false),
                ("Figure 17c to f", "agree", true),
            ],
        );
        // The formulations part by 12.5 mm of 100 mm at most.
        for run in &mut found.runs {
            run.response.full.deviation = [0.1; 6];
        }
        expect(&found, &[("first conclusion", "alike", true)]);
        found.lagrange.rows = curve(0.5, 0.0);
        expect(&found, &[("first conclusion", "alike", false)]);
    }

    #[test]
    fn verdicts_on_sections_follow_the_sweeps() {
        // As the paper has it.
        let mut found = nothing_moves();
        let as_printed = vec![
            point(0.01, Regime::Periodic(1), 0.2, &wide(0.0)),
            point(0.5, Regime::Periodic(1), 0.2, &wide(0.0)),
            point(1.0, Regime::Chaotic, 0.2, &wide(1e-3)),
        ];
        let runs = |regime, width: f64| {
            [1.0, 2.0, 3.0]
                .map(|n| point(n, regime, 0.2 + 0.01 * n, &wide(width * n)))
                .to_vec()
        };
        put(&mut found, "clearance_cold", as_printed.clone());
        put(
            &mut found,
            "runs_by_clearance",
            runs(Regime::QuasiPeriodic, 1e-4),
        );
        expect(
            &found,
            &[
                ("Figure 20a", "periodic", true),
                ("Figure 20b", "chaotic", true),
                ("third conclusion", "larger clearance", true),
                ("Figure 19a", "further right", true),
                ("Figure 19a", "quasi-periodic", true),
                ("Figure 19b", "areas", true),
            ],
        );
        // All periodic: by clearance all at one place, by friction at places 10 mm of 25 mm apart.
        let still = [0.01, 0.5, 1.0].map(|c| point(c, Regime::Periodic(1), 0.2, &wide(0.0)));
        put(&mut found, "clearance_cold", still.to_vec());
        put(&mut found, "runs_by_clearance", still.to_vec());
        put(&mut found, "runs_by_friction", still.to_vec());
        let mut apart = still[..2].to_vec();
        apart[1].sections[0] = vec![0.21; 8];
        put(&mut found, "friction_cold", apart);
        expect(
            &found,
            &[
                ("Figure 20a", "periodic", true),
                ("Figure 20b", "chaotic", false),
                ("third conclusion", "larger clearance", false),
                ("Figure 19a", "further right", false),
                ("Figure 19a", "quasi-periodic", false),
                ("Figure 19b", "areas", false),
                ("Figure 22", "little effect", true),
                ("Figure 22", "quasi-periodic", false),
                ("Figure 22", "denser", false),
                ("Figure 23", "motion is periodic", true),
                ("Figure 23", "little effect", false),
                ("third conclusion", "friction has little", true),
            ],
        );
        // Chaos at a single friction value, and an x that moves from section to section.
        put(&mut found, "friction_cold", as_printed.clone());
        let mut moving = as_printed;
        moving[2].sections[0] = wide(1e-3).to_vec();
        put(&mut found, "clearance_cold", moving);
        expect(
            &found,
            &[
                ("third conclusion", "friction has little", false),
                ("Figure 23", "motion is periodic", false),
                ("Figure 20a", "periodic", false),
            ],
        );
    }

    #[test]
    fn sections_crowd_around_a_centre_only_where_they_can_be_told_apart() {
        let near = [0.0, 1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 9.0, -9.0];
        let with = |size: f64| {
            crowd(
                &point(0.2, Regime::Chaotic, 0.2, &near.map(|v| v * size)),
                [1e-7, 1e-6],
            )
        };
        assert_eq!(with(1e-5), Some(7.0 / 9.0));
        assert_eq!(with(1e-9), None);
        let ring = point(0.2, Regime::Chaotic, 0.2, &[1e-4, -1e-4, 1e-4, -1e-4]);
        assert_eq!(crowd(&ring, [1e-7, 1e-6]), Some(0.0));
    }

    #[test]
    fn portraits_are_compared_at_equal_phases() {
        let mut found = nothing_moves();
        // By clearance 0.2 mm apart and increasingly wide; by friction 4 mm of 25 mm apart.
        let curves = [
            (0.0, 1e-3),
            (1e-4, 2e-3),
            (2e-4, 3e-3),
            (4e-3, 0.0),
            (0.0, 1e-3),
        ];
        for (found, (x, width)) in found.curves.iter_mut().zip(curves) {
            found.coordinates[0] = vec![x; 4];
            found.width[1] = width;
        }
        expect(
            &found,
            &[
                ("Figure 18a", "coincide", true),
                ("Figure 18b", "width", true),
                ("Figure 21a", "coincide", false),
                ("Figure 21b", "coincide", true),
                ("Figure 21b", "wide", false),
            ],
        );
        found.curves[1].width[1] = 4e-3;
        found.curves[3].width[1] = 1e-5;
        expect(
            &found,
            &[("Figure 18b", "width", false), ("Figure 21b", "wide", true)],
        );
        assert_eq!(found.loops(Series::Friction)[0].case, CASES[3]);
    }

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
}
