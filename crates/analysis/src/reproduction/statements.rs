//! Whether the paper's statements hold here: a verdict by the test of each one in [`PAPER`], with its numbers.

use super::Findings;
use super::record::{RecordedRow, RecordedRun, SettledPoint, column_of, derivative, exponents, extent};
use crate::paper::{Case, Claim, Coordinate, Curves, FigureValue, PAPER, Sections, Series, Test};
use crate::regime::Regime;

/// A change below this fraction of the amplitude counts as none.
pub const LITTLE: f64 = 0.05;

/// A statement of the paper and this program's verdict.
#[derive(Clone, Debug)]
pub struct Statement {
    /// Where the paper makes it, what it says, and its test.
    pub claim: &'static Claim,
    /// Whether that test is met here.
    pub confirmed: bool,
    /// The numbers behind the verdict.
    pub grounds: Grounds,
}

/// The numbers behind a verdict, in SI units; shares are fractions of 1. The test says what they measure, and in which order.
#[derive(Clone, Debug, PartialEq)]
pub enum Grounds {
    /// A number for each run, or for each thing that the test names.
    Values(Vec<f64>),
    /// Two such numbers, or a distance and what share it is.
    Pairs(Vec<(f64, f64)>),
    /// A length or angle for each run or point, and the smallest one that counts.
    Resolved(Vec<f64>, f64),
    /// For each run the share of its sections that lie near their middle; `None` if they cannot be told apart.
    Crowds(Vec<Option<f64>>),
    /// The joints and their largest forces.
    Joints(Vec<(String, f64)>),
    /// The regime of every run or point, `None` where it did not reach its end; the smallest and the largest exponent, 1/s.
    Regimes(Vec<Option<Regime>>, (f64, f64)),
    /// Number of chaotic points and the largest spread of beta, in either half of the range.
    Halves([(usize, f64); 2]),
    /// How many quantities grow, and of how many.
    Count(usize, usize),
}

impl Findings {
    /// Every statement of the paper, in its order.
    pub fn statements(&self) -> Vec<Statement> {
        let of = |claim: &'static Claim| {
            let (confirmed, grounds) = self.judge(&claim.test);
            Statement { claim, confirmed, grounds }
        };
        PAPER.statements.iter().map(of).collect()
    }

    fn judge(&self, test: &Test) -> (bool, Grounds) {
        use Grounds::{Count, Crowds, Halves, Joints, Pairs, Resolved, Values};
        match *test {
            Test::StaysNearIdeal { coordinate, run } => {
                let most = self.run(run).response.full.deviation[coordinate.index()];
                let share = most / coordinate.amplitude(0);
                (share < LITTLE, Pairs(vec![(most, share)]))
            }
            Test::Grows { of, with } => {
                let values = self.values(of, with);
                (ascending(&values), Values(values))
            }
            Test::AllGrow(series) => {
                let tests = PAPER.statements.iter().map(|claim| &claim.test);
                let own = |test: &&Test| matches!(test, Test::Grows { with, .. } if *with == series);
                let grown: Vec<bool> = tests.filter(own).map(|test| self.judge(test).0).collect();
                let held = grown.iter().filter(|held| **held).count();
                (held == grown.len(), Count(held, grown.len()))
            }
            Test::Exceeds { of, that, over } => {
                let pairs = self.values(of, over).into_iter();
                let pairs: Vec<(f64, f64)> = pairs.zip(self.values(that, over)).collect();
                let larger = pairs.iter().all(|(large, small)| large > small);
                (larger, Pairs(pairs))
            }
            Test::NoRule { of, with } => {
                let v = self.values(of, with);
                ((v[1] - v[0]) * (v[2] - v[1]) < 0.0, Values(v))
            }
            Test::DiffersMore { of, than, with } => {
                let [this, other] = [of, than].map(|quantity| {
                    let values = self.values(quantity, with).into_iter();
                    extent(values.clone()) / (values.sum::<f64>() / 3.0)
                });
                (this > other, Values(vec![this, other]))
            }
            Test::ChangesMoreWith { of, with, than } => {
                let [this, other] = [with, than].map(|series| extent(self.values(of, series).into_iter()));
                (this > other, Values(vec![this, other]))
            }
            Test::Steady { after, over } => {
                let last = self.values(FigureValue::LastSeparation, over);
                (last.iter().all(|t| *t <= after), Values(last))
            }
            Test::Hardest { joint, run } => {
                let response = &self.run(run).response;
                let forces = &response.full.normal;
                let hardest = forces.iter().copied().reduce(f64::max);
                let holds = forces.get(joint - 1).copied() == hardest;
                let joints = response.joints.iter().cloned().zip(forces.iter().copied());
                (holds, Joints(joints.collect()))
            }
            Test::Coincide { curves, ideal, ref columns, from } => {
                let ideal = ideal.then_some(&self.ideal);
                let curves = self.curves_of(curves).into_iter().chain(ideal);
                let curves: Vec<Vec<&RecordedRow>> = curves.map(RecordedRun::samples).collect();
                little(columns.iter().map(|c| apart(&curves, column_of(c), from)))
            }
            Test::FormulationsAgree(ref coordinates) => {
                let tree = &self.runs[0].response.full;
                let found = coordinates.iter().map(|&c| {
                    let apart = self.formulations_apart(c);
                    (apart, apart / tree.deviation[c.index()])
                });
                let found: Vec<(f64, f64)> = found.collect();
                let near = found.iter().all(|(_, share)| *share < LITTLE);
                (near, Pairs(found))
            }
            Test::PortraitsCoincide { of, over } => {
                let (c, loops) = (of as usize, self.loops(over));
                let values = furthest(&loops.map(|l| &l.coordinates[c])) / of.amplitude(0);
                let rates = furthest(&loops.map(|l| &l.rates[c])) / of.amplitude(1);
                little([values.max(rates)])
            }
            Test::PortraitsWide { of, over, growing } => {
                let resolution = self.resolution[of as usize];
                let widths = self.loops(over).map(|l| l.width[of as usize]).to_vec();
                let wide = widths.iter().all(|w| *w > resolution);
                let holds = wide && (!growing || ascending(&widths));
                (holds, Resolved(widths, resolution))
            }
            Test::SectionsAscend { of, over } => {
                let resolution = self.resolution[of as usize];
                let latest: Vec<f64> = self.sections(over).iter().map(|r| r.latest(of)).collect();
                let further = |pair: &[f64]| pair[1] - pair[0] > resolution;
                (latest.windows(2).all(further), Resolved(latest, resolution))
            }
            Test::SectionsSpread { of, over } => {
                let resolution = self.resolution[of as usize];
                let spreads = spreads(self.sections(over), of);
                let wide = spreads.iter().all(|spread| *spread > resolution);
                (wide && ascending(&spreads), Resolved(spreads, resolution))
            }
            Test::SectionsCrowd(over) => {
                let runs = self.sections(over).iter();
                let crowds = runs.map(|run| crowd(run, self.resolution));
                let crowds: Vec<Option<f64>> = crowds.collect();
                let dense = crowds.iter().all(|share| share.is_some_and(|s| s > 0.5));
                (dense, Crowds(crowds))
            }
            Test::SectionsStay { of, over } => {
                let points = match of {
                    Sections::Runs => self.sections(over),
                    Sections::Sweep => self.swept(over),
                };
                little(Coordinate::ALL.map(|c| {
                    let latest = points.iter().map(|p| p.latest(c));
                    extent(latest) / c.amplitude(0)
                }))
            }
            Test::SectionsRepeat { of, over } => {
                let resolution = self.resolution[of as usize];
                let spreads = spreads(self.swept(over), of);
                let narrow = spreads.iter().all(|spread| *spread <= resolution);
                (narrow, Resolved(spreads, resolution))
            }
            Test::QuasiPeriodic(over) => {
                let runs = self.sections(over);
                let regular = runs.iter().all(|r| r.regime == Some(Regime::QuasiPeriodic));
                (regular, regimes(runs))
            }
            Test::AllPeriodic(over) => {
                let points = self.swept(over);
                (points.iter().all(|p| p.period() == 1), regimes(points))
            }
            Test::PeriodicToChaotic(over) => {
                let points = self.swept(over);
                let regular = points.first().is_some_and(|p| p.period() > 0);
                let chaotic = points.last().is_some_and(is_chaotic);
                (regular && chaotic, regimes(points))
            }
            Test::ChaosGrows(over) => {
                let points = self.swept(over);
                let (lower, upper) = points.split_at(points.len() / 2);
                let halves = [lower, upper].map(|half| {
                    let spreads = spreads(half, Coordinate::Beta);
                    (chaotic(half), spreads.into_iter().fold(0.0, f64::max))
                });
                (halves[1].0 > halves[0].0, Halves(halves))
            }
            Test::ChaosAllOrNone(over) => {
                let points = self.swept(over);
                let chaotic = chaotic(points);
                (chaotic == 0 || chaotic == points.len(), regimes(points))
            }
        }
    }

    /// A quantity in continuous time, per run.
    fn values(&self, quantity: FigureValue, series: Series) -> Vec<f64> {
        let of = |case: Case| quantity.of(&self.run(case).response);
        series.cases().map(of).to_vec()
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
        pairs.map(|(a, b)| (a[column] - b[column]).abs()).fold(0.0, f64::max)
    }
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
    (0..places).map(|k| extent(curves.iter().map(|c| c.as_ref()[k]))).fold(0.0, f64::max)
}

/// Fraction of the sections within half of the largest distance from their mean; `None` if they cannot be told apart.
fn crowd(run: &SettledPoint, resolution: [f64; 2]) -> Option<f64> {
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

/// Whether none of `shares` counts.
fn little(shares: impl IntoIterator<Item = f64>) -> (bool, Grounds) {
    let shares: Vec<f64> = shares.into_iter().collect();
    let little = shares.iter().all(|share| *share < LITTLE);
    (little, Grounds::Values(shares))
}

fn spreads(points: &[SettledPoint], coordinate: Coordinate) -> Vec<f64> {
    points.iter().map(|p| p.spread(coordinate)).collect()
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

fn regimes(points: &[SettledPoint]) -> Grounds {
    let regimes = points.iter().map(|p| p.regime).collect();
    Grounds::Regimes(regimes, exponents(points))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reproduction::{Agenda, COLUMNS, Extent, Outcome, ReportJob, SettledCurve};
    use crate::response::respond;
    use jointplay_scene::Scene;

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
            let mut own = statements.iter().filter(|s| s.claim.place.ends_with(place) && s.claim.says.contains(says));
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
            for values in [&mut response.full.deviation, &mut response.full.rate, &mut response.full.acceleration] {
                *values = [size; 6];
            }
            response.full.normal = vec![size];
            response.last_separation = vec![Some(size)];
        };
        for (case, size) in [2.0, 3.0, 4.0, 1.0, 3.0].into_iter().enumerate() {
            grow(&mut found, case, size);
        }
        let of = "second conclusion";
        expect(&found, &[(of, "with clearance", true), (of, "with friction", true)]);
        found.runs[2].response.full.rate[0] = 1.0;
        expect(&found, &[(of, "with clearance", false), (of, "with friction", true)]);
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
        let off = [(0.0, 0.0), (0.25, 0.0), (0.5, 0.0), (0.0, 0.02), (0.0, 0.04)];
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
        let runs =
            |regime, width: f64| [1.0, 2.0, 3.0].map(|n| point(n, regime, 0.2 + 0.01 * n, &wide(width * n))).to_vec();
        put(&mut found, "clearance_cold", as_printed.clone());
        put(&mut found, "runs_by_clearance", runs(Regime::QuasiPeriodic, 1e-4));
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
        let with = |size: f64| crowd(&point(0.2, Regime::Chaotic, 0.2, &near.map(|v| v * size)), [1e-7, 1e-6]);
        assert_eq!(with(1e-5), Some(7.0 / 9.0));
        assert_eq!(with(1e-9), None);
        let ring = point(0.2, Regime::Chaotic, 0.2, &[1e-4, -1e-4, 1e-4, -1e-4]);
        assert_eq!(crowd(&ring, [1e-7, 1e-6]), Some(0.0));
    }

    #[test]
    fn portraits_are_compared_at_equal_phases() {
        let mut found = nothing_moves();
        // By clearance 0.2 mm apart and increasingly wide; by friction 4 mm of 25 mm apart.
        let curves = [(0.0, 1e-3), (1e-4, 2e-3), (2e-4, 3e-3), (4e-3, 0.0), (0.0, 1e-3)];
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
        expect(&found, &[("Figure 18b", "width", false), ("Figure 21b", "wide", true)]);
        assert_eq!(found.loops(Series::Friction)[0].case, PAPER.runs[3]);
    }
}
