//! Verdicts on the paper's statements: the tests of [`PAPER`], with their criteria and numbers.

use super::Findings;
use super::record::{
    COLUMNS, RecordedRow, RecordedRun, SettledPoint, column_of, derivative, exponents, extent, regime_counts,
};
use crate::paper::{Claim, Coordinate, Curves, FigureValue, PAPER, Sections, Series, Test};
use crate::regime::Regime;

/// Fraction of the amplitude below which a change is negligible; the criteria state it as 5 %.
const NEGLIGIBLE_SHARE: f64 = 0.05;

/// A statement of the paper and this program's verdict.
#[derive(Clone, Debug)]
pub struct Statement {
    /// The statement's place in the paper, wording and test.
    pub claim: &'static Claim,
    /// Whether this program's results meet the criterion.
    pub confirmed: bool,
    /// Criterion for confirmation.
    pub criterion: &'static str,
    /// The numbers behind the verdict.
    pub evidence: Vec<Reading>,
}

/// A number behind a verdict: its description, its value (NaN if there is none) and its unit.
pub type Reading = (String, f64, &'static str);

impl Findings {
    /// Every statement, in the order of the paper.
    pub fn statements(&self) -> Vec<Statement> {
        let statement = |claim: &'static Claim| {
            let (confirmed, criterion, evidence) = self.evaluate(&claim.test);
            Statement { claim, confirmed, criterion, evidence }
        };
        PAPER.statements.iter().map(statement).collect()
    }

    /// Evaluates a test. Returns whether the criterion is met, the criterion, and the compared numbers.
    fn evaluate(&self, test: &Test) -> (bool, &'static str, Vec<Reading>) {
        match *test {
            Test::StaysNearIdeal { coordinate, run } => {
                let most = self.run(run).response.full.deviation[coordinate.index()];
                let share = most / coordinate.amplitude(0);
                let evidence = vec![
                    distance_reading("at most", most, coordinate),
                    ("of the amplitude".to_owned(), share * 100.0, "%"),
                ];
                (share < NEGLIGIBLE_SHARE, "leaves the ideal motion by less than 5 % of its amplitude", evidence)
            }
            Test::Grows { of, with } => {
                let values = self.values(of, with);
                let criterion = "larger at each value than at the one before, in continuous time";
                (is_ascending(&values), criterion, readings_per_run(with, &values, of.unit()))
            }
            Test::AllGrow(series) => {
                let tests = PAPER.statements.iter().map(|claim| &claim.test);
                let of_series = |test: &&Test| matches!(test, Test::Grows { with, .. } if *with == series);
                let grows: Vec<bool> = tests.filter(of_series).map(|test| self.evaluate(test).0).collect();
                let growing = grows.iter().filter(|grows| **grows).count();
                let evidence = vec![count_reading("that grow", growing), count_reading("measured", grows.len())];
                (growing == grows.len(), "every measured quantity of section 4.2 grows at both steps", evidence)
            }
            Test::Exceeds { of, that, over } => {
                let [large, small] = [of, that].map(|quantity| self.values(quantity, over));
                let larger = large.iter().zip(&small).all(|(large, small)| large > small);
                let evidence =
                    [readings_per_run(over, &large, of.unit()), readings_per_run(over, &small, that.unit())].concat();
                (larger, "its peak is the larger number, in SI units, at all three values", evidence)
            }
            Test::NoRule { of, with } => {
                let v = self.values(of, with);
                let extreme = (v[1] - v[0]) * (v[2] - v[1]) < 0.0;
                (
                    extreme,
                    "the middle value has the largest or the smallest peak",
                    readings_per_run(with, &v, of.unit()),
                )
            }
            Test::DiffersMore { of, than, with } => {
                let shares = [of, than].map(|quantity| {
                    let values = self.values(quantity, with);
                    extent(values) / (values.iter().sum::<f64>() / 3.0)
                });
                let evidence = percent_readings([of, than].map(FigureValue::word), &shares);
                (shares[0] > shares[1], "over the three values it differs by a larger share of its mean", evidence)
            }
            Test::ChangesMoreWith { of, with, than } => {
                let changes = [with, than].map(|series| extent(self.values(of, series)));
                let evidence = [0, 1].map(|n| ([with, than][n].to_string(), changes[n], of.unit()));
                let criterion = "it changes more over the three values of this parameter than over those of the other";
                (changes[0] > changes[1], criterion, evidence.to_vec())
            }
            Test::Steady { after, over } => {
                let last = self.values(FigureValue::LastSeparation, over);
                let steady = last.iter().all(|t| *t <= after);
                (steady, "no ball leaves its socket after that instant", readings_per_run(over, &last, "s"))
            }
            Test::Hardest { joint, run } => {
                let response = &self.run(run).response;
                let forces = &response.full.normal;
                let hardest = forces.get(joint - 1).copied() == forces.iter().copied().reduce(f64::max);
                let evidence = response.joints.iter().zip(forces).map(|(name, force)| (name.clone(), *force, "N"));
                (hardest, "that joint has the largest peak force, in continuous time", evidence.collect())
            }
            Test::Coincide { curves, ideal, ref columns, from } => {
                let ideal = (ideal == Some(true)).then_some(&self.ideal);
                let curves = self.curves_of(curves).into_iter().chain(ideal);
                let curves: Vec<Vec<&RecordedRow>> = curves.map(RecordedRun::samples).collect();
                let columns: Vec<usize> = columns.iter().map(|name| column_of(name)).collect();
                let shares: Vec<f64> = columns.iter().map(|&c| largest_distance(&curves, c, from)).collect();
                let mut evidence = percent_readings(columns.iter().map(|&c| COLUMNS[c].label), &shares);
                evidence.push(("from".to_owned(), from, "s"));
                (
                    are_negligible(&shares),
                    "no two curves are further apart than 5 % of the ideal motion's amplitude",
                    evidence,
                )
            }
            Test::FormulationsAgree(ref coordinates) => {
                let apart: Vec<f64> = coordinates.iter().map(|&c| self.formulations_apart(c)).collect();
                let most = &self.runs[0].response.full.deviation;
                let shares = coordinates.iter().zip(&apart).map(|(c, apart)| apart / most[c.index()]);
                let shares: Vec<f64> = shares.collect();
                let mut evidence = percent_readings(coordinates.iter().map(|c| c.word()), &shares);
                evidence.extend(coordinates.iter().zip(apart).map(|(&c, apart)| distance_reading(c.word(), apart, c)));
                let criterion = "tree and lagrange agree within 5 % of the largest deviation from the ideal motion";
                (are_negligible(&shares), criterion, evidence)
            }
            Test::PortraitsCoincide { of, over } => {
                let (c, loops) = (of as usize, self.loops(over));
                let values = largest_difference(&loops.map(|l| &l.coordinates[c])) / of.amplitude(0);
                let share = [values.max(largest_difference(&loops.map(|l| &l.rates[c])) / of.amplitude(1))];
                let criterion = "no two settled curves are further apart than 5 % of the amplitude at equal phases";
                (are_negligible(&share), criterion, percent_readings(["at most"], &share))
            }
            Test::PortraitsWide { of, over, growing } => {
                let widths = self.loops(over).map(|l| l.width[of as usize]);
                let wide = widths.iter().all(|w| *w > self.resolution[of as usize]);
                let evidence = self.distance_readings(of, over, &widths);
                if growing == Some(true) {
                    let criterion = "successive settled periods differ by more than the resolution, and increasingly";
                    return (wide && is_ascending(&widths), criterion, evidence);
                }
                (wide, "successive settled periods differ by more than the resolution", evidence)
            }
            Test::SectionsAscend { of, over } => {
                let latest: Vec<f64> = self.sections(over).iter().map(|r| r.latest(of)).collect();
                let further = |pair: &[f64]| pair[1] - pair[0] > self.resolution[of as usize];
                let evidence = self.distance_readings(of, over, &latest);
                (latest.windows(2).all(further), "from value to value it grows by more than the resolution", evidence)
            }
            Test::SectionsSpread { of, over } => {
                let spreads = spreads(self.sections(over), of);
                let wide = spreads.iter().all(|spread| *spread > self.resolution[of as usize]);
                let evidence = self.distance_readings(of, over, &spreads);
                (wide && is_ascending(&spreads), "their spread is above the resolution and grows", evidence)
            }
            Test::SectionsCrowd(over) => {
                let runs = self.sections(over).iter();
                let crowds: Vec<f64> =
                    runs.map(|run| 100.0 * share_near_mean(run, self.resolution).unwrap_or(f64::NAN)).collect();
                let criterion = "they can be told apart, and more than half lie within half of the largest distance \
                                 from their mean, in units of the resolution";
                (crowds.iter().all(|share| *share > 50.0), criterion, readings_per_run(over, &crowds, "%"))
            }
            Test::SectionsStay { of, over } => {
                let points = match of {
                    Sections::Runs => self.sections(over),
                    Sections::Sweep => self.swept(over),
                };
                let shares = Coordinate::ALL.map(|c| extent(points.iter().map(|p| p.latest(c))) / c.amplitude(0));
                let evidence = percent_readings(Coordinate::ALL.map(Coordinate::word), &shares);
                (are_negligible(&shares), "they lie within 5 % of the amplitude of each other", evidence)
            }
            Test::SectionsRepeat { of, over } => {
                let (resolution, spreads) = (self.resolution[of as usize], spreads(self.swept(over), of));
                let narrow = spreads.iter().all(|spread| *spread <= resolution);
                let widest = spreads.iter().copied().fold(0.0, f64::max);
                let evidence = vec![
                    distance_reading("largest spread", widest, of),
                    distance_reading("resolution", resolution, of),
                ];
                (narrow, "at every point the latest half of the sections agree within the resolution", evidence)
            }
            Test::QuasiPeriodic(over) => {
                let runs = self.sections(over);
                let regular = runs.iter().all(|r| r.regime == Some(Regime::QuasiPeriodic));
                (
                    regular,
                    "exponent not told from 0, regular 0-1 test, no period, in all three runs",
                    regime_readings(runs),
                )
            }
            Test::AllPeriodic(over) => {
                let points = self.swept(over);
                (points.iter().all(|p| p.period() == 1), "every point is periodic 1", regime_readings(points))
            }
            Test::PeriodicToChaotic(over) => {
                let points = self.swept(over);
                let regular = points.first().is_some_and(|p| p.period() > 0);
                let criterion = "the smallest value is periodic; at the largest the exponent is above its uncertainty";
                (regular && points.last().is_some_and(is_chaotic), criterion, regime_readings(points))
            }
            Test::ChaosGrows(over) => {
                let points = self.swept(over);
                let (lower, upper) = points.split_at(points.len() / 2);
                let [below, above] = [lower, upper].map(count_chaotic);
                let mut evidence =
                    vec![count_reading("chaotic in the lower half", below), count_reading("in the upper half", above)];
                for (half, of) in [(lower, "spread in the lower half"), (upper, "in the upper half")] {
                    let widest = spreads(half, Coordinate::Beta).into_iter().fold(0.0, f64::max);
                    evidence.push(distance_reading(of, widest, Coordinate::Beta));
                }
                (above > below, "more chaotic points in the upper half of the values than in the lower half", evidence)
            }
            Test::ChaosAllOrNone(over) => {
                let points = self.swept(over);
                let chaotic = count_chaotic(points);
                (chaotic == 0 || chaotic == points.len(), "all points are chaotic or none is", regime_readings(points))
            }
        }
    }

    /// Distances in a coordinate, run by run, and the resolution.
    fn distance_readings(&self, of: Coordinate, over: Series, sizes: &[f64]) -> Vec<Reading> {
        let runs = over.cases().map(|case| over.run_name(case)).into_iter().zip(sizes);
        let runs = runs.map(|(name, size)| distance_reading(&name, *size, of));
        runs.chain([distance_reading("resolution", self.resolution[of as usize], of)]).collect()
    }

    /// A quantity in continuous time, per run.
    fn values(&self, quantity: FigureValue, series: Series) -> [f64; 3] {
        series.cases().map(|case| quantity.of(&self.run(case).response))
    }

    fn curves_of(&self, curves: Curves) -> Vec<&RecordedRun> {
        let series = |series: Series| series.cases().map(|case| self.run(case)).to_vec();
        match curves {
            Curves::Clearance => series(Series::Clearance),
            Curves::Friction => series(Series::Friction),
            Curves::Formulations => vec![&self.runs[0], self.lagrange()],
        }
    }

    /// Largest difference between the two formulations in a coordinate at the paper's output step, m or rad.
    pub fn formulations_apart(&self, coordinate: Coordinate) -> f64 {
        let column = derivative(coordinate, 0);
        let (tree, lagrange) = (self.runs[0].samples(), self.lagrange().samples());
        let pairs = tree.iter().zip(&lagrange);
        pairs.map(|(a, b)| (a[column] - b[column]).abs()).fold(0.0, f64::max)
    }
}

/// Largest distance between any two of `curves` at any instant from `from` (s) on, relative to the amplitude.
fn largest_distance(curves: &[Vec<&RecordedRow>], column: usize, from: f64) -> f64 {
    let coordinate = Coordinate::ALL[(column - 1) / 3];
    let late = curves.iter().map(|c| {
        let late = c.iter().filter(|row| row[0] >= from);
        late.map(|row| row[column]).collect()
    });
    let late: Vec<Vec<f64>> = late.collect();
    largest_difference(&late) / coordinate.amplitude((column - 1) % 3)
}

/// Largest distance between any two of `curves` at equal indices.
fn largest_difference<C: AsRef<[f64]>>(curves: &[C]) -> f64 {
    let places = curves.iter().map(|c| c.as_ref().len()).min().unwrap_or(0);
    (0..places).map(|k| extent(curves.iter().map(|c| c.as_ref()[k]))).fold(0.0, f64::max)
}

/// Fraction of the sections within half of the largest distance from their mean; `None` if the sections cannot be
/// distinguished.
fn share_near_mean(run: &SettledPoint, resolution: [f64; 2]) -> Option<f64> {
    let middle = [0, 1].map(|c| {
        let all = &run.sections[c];
        all.iter().sum::<f64>() / all.len() as f64
    });
    let distance = |(x, beta): (&f64, &f64)| {
        let [x, beta] = [(x - middle[0]) / resolution[0], (beta - middle[1]) / resolution[1]];
        (x * x + beta * beta).sqrt()
    };
    let pairs = run.sections[0].iter().zip(&run.sections[1]);
    let distances: Vec<f64> = pairs.map(distance).collect();
    let furthest = distances.iter().copied().fold(0.0, f64::max);
    let within = distances.iter().filter(|d| **d < furthest / 2.0).count();
    (furthest > 0.5).then(|| within as f64 / distances.len() as f64)
}

/// One value per run of a series.
fn readings_per_run(series: Series, values: &[f64], unit: &'static str) -> Vec<Reading> {
    let runs = series.cases().into_iter().zip(values);
    runs.map(|(case, value)| (series.run_name(case), *value, unit)).collect()
}

/// Readings in percent of `shares`, which are fractions.
fn percent_readings<'a>(of: impl IntoIterator<Item = &'a str>, shares: &[f64]) -> Vec<Reading> {
    let shares = of.into_iter().zip(shares);
    shares.map(|(of, share)| (of.to_owned(), share * 100.0, "%")).collect()
}

/// Reading in µm or µrad of a distance in a coordinate, m or rad.
fn distance_reading(of: &str, size: f64, coordinate: Coordinate) -> Reading {
    (of.to_owned(), size * 1e6, ["µm", "µrad"][coordinate as usize])
}

fn count_reading(of: &str, number: usize) -> Reading {
    (of.to_owned(), number as f64, "")
}

/// Whether all `shares` are negligible.
fn are_negligible(shares: &[f64]) -> bool {
    shares.iter().all(|share| *share < NEGLIGIBLE_SHARE)
}

fn spreads(points: &[SettledPoint], coordinate: Coordinate) -> Vec<f64> {
    points.iter().map(|p| p.spread(coordinate)).collect()
}

fn is_chaotic(point: &SettledPoint) -> bool {
    point.regime == Some(Regime::Chaotic)
}

fn count_chaotic(points: &[SettledPoint]) -> usize {
    points.iter().filter(|p| is_chaotic(p)).count()
}

fn is_ascending(values: &[f64]) -> bool {
    values.windows(2).all(|pair| pair[0] < pair[1])
}

/// Readings of the number of points per regime and of the range of exponents.
fn regime_readings(points: &[SettledPoint]) -> Vec<Reading> {
    let mut counts: Vec<Reading> = regime_counts(points).into_iter().map(|(word, n)| count_reading(&word, n)).collect();
    let (least, most) = exponents(points);
    if least <= most {
        counts.extend([("smallest exponent".to_owned(), least, "1/s"), ("largest exponent".to_owned(), most, "1/s")]);
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reproduction::{Agenda, COLUMNS, Extent, Outcome, ReportJob, SettledCurve};
    use crate::response::respond;
    use jointplay_scene::Scene;

    /// Findings with the same short run for every case, settled curves at rest and sweeps of zeros. Each test fills in the
    /// results it needs.
    fn findings_at_rest() -> Findings {
        let (runs, sweep, map_periods) = ((9, 1), (3, 1), (2, 1));
        let work = Agenda::new(Extent { settle: 1, runs, values: [2, 2], sweep, map: [2, 2], map_periods });
        let scene = Scene::load("spcmm", &[]).expect("built in");
        let response = respond(&scene, 1e-3, 1e-3, |_| (), |_| true).expect("runs");
        let outcome = |job: &ReportJob| match *job {
            ReportJob::Run(n) => {
                let at_rest = || [vec![0.0; 4], vec![0.0; 4]];
                let settled = Some(SettledCurve { coordinates: at_rest(), rates: at_rest(), width: [0.0; 2] });
                let (response, case) = (response.clone(), work.runs[n].case);
                Outcome::Run(Box::new(RecordedRun { name: String::new(), case, response, rows: Vec::new(), settled }))
            }
            ReportJob::Block(s, b) => {
                let sweep = &work.sweeps()[s].sweep;
                let values = sweep.design().block(b).len() * sweep.layout().record_length();
                Outcome::Block(vec![0.0; values])
            }
        };
        let outcomes = work.jobs.iter().map(outcome).collect();
        let mut findings = work.gather(outcomes).models.swap_remove(0);
        findings.resolution = [1e-7, 1e-6];
        findings
    }

    impl Findings {
        /// Asserts verdicts, given by the place and words of the statement.
        #[track_caller]
        fn expect(&self, verdicts: &[(&str, &str, bool)]) {
            let statements = self.statements();
            for (place, says, confirmed) in verdicts {
                let matches = |s: &&Statement| s.claim.place.ends_with(place) && s.claim.says.contains(says);
                let matching: Vec<bool> = statements.iter().filter(matches).map(|s| s.confirmed).collect();
                assert_eq!(matching, [*confirmed], "{place}, {says}");
            }
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

    fn set_points(findings: &mut Findings, name: &str, points: Vec<SettledPoint>) {
        let sweep = findings.sweeps.iter_mut().find(|s| s.name == name);
        sweep.expect("a sweep").points = points;
    }

    #[test]
    fn verdicts_on_runs_follow_the_numbers() {
        let mut findings = findings_at_rest();
        let runs = [
            ([3.0, 2.0, 1.0], 0.1, [1.0, 2.0], 1e-3),
            ([3.0, 2.0, 1.0], 0.2, [1.0, 3.0], 2e-3),
            ([1.0, 2.0, 3.0], 0.5, [4.0, 3.0], 3e-3),
            // Over friction, x is constant and beta grows from 1 to 3; the forces grow from 3 N to 5 N, more than over clearance.
            ([2.0, 1.0, 1.0], 0.1, [1.0, 1.0], 3e-3),
            ([5.0, 1.0, 1.0], 0.1, [1.0, 3.0], 2e-3),
        ];
        for (run, (forces, last, [x, beta], deviation)) in findings.runs.iter_mut().zip(runs) {
            let response = &mut run.response;
            response.full.normal = forces.to_vec();
            response.last_separation = vec![Some(0.01), Some(last)];
            response.full.acceleration[0] = x;
            response.full.acceleration[4] = beta;
            response.full.deviation[0] = deviation;
            response.full.deviation[4] = deviation;
        }
        findings.expect(&[
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
        ]);
        findings.runs[0].response.full.acceleration[4] = 9.0;
        findings.runs[1].response.full.normal[0] = 9.0;
        findings.runs[4].response.full.acceleration[0] = 99.0;
        findings.expect(&[
            ("Figure 13b", "no rule", true),
            ("Figure 13", "changes the acceleration", false),
            ("4.2.2", "main influence", false),
        ]);
    }

    #[test]
    fn a_conclusion_requires_every_quantity() {
        let mut findings = findings_at_rest();
        let grow = |findings: &mut Findings, case: usize, size: f64| {
            let response = &mut findings.runs[case].response;
            for values in [&mut response.full.deviation, &mut response.full.rate, &mut response.full.acceleration] {
                *values = [size; 6];
            }
            response.full.normal = vec![size];
            response.last_separation = vec![Some(size)];
        };
        for (case, size) in [2.0, 3.0, 4.0, 1.0, 3.0].into_iter().enumerate() {
            grow(&mut findings, case, size);
        }
        let place = "second conclusion";
        findings.expect(&[(place, "with clearance", true), (place, "with friction", true)]);
        findings.runs[2].response.full.rate[0] = 1.0;
        findings.expect(&[(place, "with clearance", false), (place, "with friction", true)]);
    }

    #[test]
    fn curves_are_compared_from_the_given_instant() {
        // A curve that deviates by `early` until 0.35 s and by `late` afterwards, in every coordinate and derivative.
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
        let mut findings = findings_at_rest();
        // Over clearance the curves differ only at first, until shortly after 0.3 s; over friction they differ by 4 % after
        // that.
        let off = [(0.0, 0.0), (0.25, 0.0), (0.5, 0.0), (0.0, 0.02), (0.0, 0.04)];
        for (run, (early, late)) in findings.runs.iter_mut().zip(off) {
            run.rows = curve(early, late);
        }
        findings.runs[5].rows = curve(0.0, 0.0);
        findings.ideal.rows = curve(0.0, 0.06);
        findings.expect(&[
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
        ]);
        // The formulations differ by at most 12.5 mm of 100 mm.
        for run in &mut findings.runs {
            run.response.full.deviation = [0.1; 6];
        }
        findings.expect(&[("first conclusion", "alike", true)]);
        findings.runs[5].rows = curve(0.5, 0.0);
        findings.expect(&[("first conclusion", "alike", false)]);
    }

    #[test]
    fn verdicts_on_sections_follow_the_sweeps() {
        // Results that agree with the paper.
        let mut findings = findings_at_rest();
        let as_printed = vec![
            point(0.01, Regime::Periodic(1), 0.2, &wide(0.0)),
            point(0.5, Regime::Periodic(1), 0.2, &wide(0.0)),
            point(1.0, Regime::Chaotic, 0.2, &wide(1e-3)),
        ];
        let runs =
            |regime, width: f64| [1.0, 2.0, 3.0].map(|n| point(n, regime, 0.2 + 0.01 * n, &wide(width * n))).to_vec();
        set_points(&mut findings, "clearance_cold", as_printed.clone());
        set_points(&mut findings, "runs_by_clearance", runs(Regime::QuasiPeriodic, 1e-4));
        findings.expect(&[
            ("Figure 20a", "periodic", true),
            ("Figure 20b", "chaotic", true),
            ("third conclusion", "larger clearance", true),
            ("Figure 19a", "further right", true),
            ("Figure 19a", "quasi-periodic", true),
            ("Figure 19b", "areas", true),
        ]);
        // All motions are periodic: at the same place over clearance, and 10 mm of 25 mm apart over friction.
        let at_rest = [0.01, 0.5, 1.0].map(|c| point(c, Regime::Periodic(1), 0.2, &wide(0.0)));
        set_points(&mut findings, "clearance_cold", at_rest.to_vec());
        set_points(&mut findings, "runs_by_clearance", at_rest.to_vec());
        set_points(&mut findings, "runs_by_friction", at_rest.to_vec());
        let mut apart = at_rest[..2].to_vec();
        apart[1].sections[0] = vec![0.21; 8];
        set_points(&mut findings, "friction_cold", apart);
        findings.expect(&[
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
        ]);
        // Chaos at a single friction value, and an x that moves from section to section.
        set_points(&mut findings, "friction_cold", as_printed.clone());
        let mut moving = as_printed;
        moving[2].sections[0] = wide(1e-3).to_vec();
        set_points(&mut findings, "clearance_cold", moving);
        findings.expect(&[
            ("third conclusion", "friction has little", false),
            ("Figure 23", "motion is periodic", false),
            ("Figure 20a", "periodic", false),
        ]);
    }

    #[test]
    fn sections_crowd_around_a_centre_only_if_they_can_be_distinguished() {
        let near = [0.0, 1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 9.0, -9.0];
        let with =
            |size: f64| share_near_mean(&point(0.2, Regime::Chaotic, 0.2, &near.map(|v| v * size)), [1e-7, 1e-6]);
        assert_eq!(with(1e-5), Some(7.0 / 9.0));
        assert_eq!(with(1e-9), None);
        let ring = point(0.2, Regime::Chaotic, 0.2, &[1e-4, -1e-4, 1e-4, -1e-4]);
        assert_eq!(share_near_mean(&ring, [1e-7, 1e-6]), Some(0.0));
    }

    #[test]
    fn portraits_are_compared_at_equal_phases() {
        let mut findings = findings_at_rest();
        // Over clearance the curves are 0.2 mm apart and increasingly wide; over friction they are 4 mm of 25 mm apart.
        let curves = [(0.0, 1e-3), (1e-4, 2e-3), (2e-4, 3e-3), (4e-3, 0.0), (0.0, 1e-3)];
        let settled = |findings: &mut Findings, run: usize, (x, width): (f64, f64)| {
            let curve = findings.runs[run].settled.as_mut().expect("given above");
            curve.coordinates[0] = vec![x; 4];
            curve.width[1] = width;
        };
        (0..).zip(curves).for_each(|(run, curve)| settled(&mut findings, run, curve));
        findings.expect(&[
            ("Figure 18a", "coincide", true),
            ("Figure 18b", "width", true),
            ("Figure 21a", "coincide", false),
            ("Figure 21b", "coincide", true),
            ("Figure 21b", "wide", false),
        ]);
        settled(&mut findings, 1, (1e-4, 4e-3));
        settled(&mut findings, 3, (4e-3, 1e-5));
        findings.expect(&[("Figure 18b", "width", false), ("Figure 21b", "wide", true)]);
        assert_eq!(findings.runs[3].case, PAPER.runs[3]);
        assert_eq!(Some(findings.loops(Series::Friction)[0]), findings.runs[3].settled.as_ref());
    }
}
