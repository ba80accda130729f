//! The figures of the paper and the additional ones, as sheets.

use super::text::{NO_REGIME, capital, typeset};
use crate::analysis::paper::{Case, Coordinate, PAPER, Series, SeriesRow, Shows, Variant};
use crate::analysis::regime::Regime;
use crate::analysis::reproduction::{COLUMNS, Column, Findings, RecordedRun, SettledPoint, column_of, derivative};
use crate::chart::{Axis, Chart, Colour, Level, Map, Marker, PALETTE, Scale, Series as Curve, Sheet};
use crate::cli::output::significant;

/// Width of a sheet and height of a row of charts, pixels.
const WIDTH: u32 = 1120;
const ROW: u32 = 290;
/// First part of a run, in which the balls bounce, s; and that of the comparison of formulations.
const EARLY: f64 = 0.15;
const EARLIEST: f64 = 0.1;

type Points = Vec<(f64, f64)>;

/// Every figure by name, in the order of the page.
pub(super) fn all(found: &Findings) -> Vec<(String, Sheet)> {
    let figures = PAPER.sections.iter().flat_map(|section| &section.figures);
    figures
        .map(|figure| {
            let charts = match figure.shows {
                Shows::Response { to, ref whole, ref early } => response(found, to, whole, early),
                Shows::Forces(case) => forces(found.run(case)),
                Shows::Verification(ref columns) => verification(found, columns),
                Shows::Drift => drift(found),
                Shows::Portraits(series) => portraits(found, series),
                Shows::Sections(series) => sections(found, series),
                Shows::Bifurcation(series) => bifurcation(found, series),
                Shows::Exponents(series) => exponents(found, series),
                Shows::Map => map(found),
                Shows::Probe => probe(found),
            };
            (picture_name(found.variant, &figure.name), sheet(charts))
        })
        .collect()
}

/// Name of a figure's picture in files and on the page.
pub(super) fn picture_name(variant: &Variant, name: &str) -> String {
    format!("{}{name}", variant.prefix.replace('_', "-"))
}

/// Charts in rows of two.
fn sheet(charts: Vec<Chart>) -> Sheet {
    let rows = charts.len().div_ceil(2) as u32;
    Sheet {
        title: String::new(),
        charts,
        columns: 2,
        size: (WIDTH, ROW * rows + 34),
        note: String::new(),
        apart: false,
    }
}

fn axis(label: &str, unit: &str) -> Axis {
    Axis { label: label.to_owned(), unit: unit.to_owned(), ..Axis::default() }
}

fn logarithmic(label: &str, unit: &str) -> Axis {
    Axis { scale: Scale::Logarithmic, ..axis(label, unit) }
}

fn of_column(column: usize) -> Axis {
    let Column { label, unit, .. } = COLUMNS[column];
    axis(&typeset(&capital(label)), unit)
}

fn parameter(series: Series) -> Axis {
    let SeriesRow { label, unit, .. } = series.row();
    axis(label, unit)
}

fn line(label: &str, points: Points, colour: Colour) -> Curve {
    Curve { label: label.to_owned(), points, colour, line: true, marker: None }
}

fn dots(label: &str, points: Points, colour: Colour, marker: Marker) -> Curve {
    Curve { line: false, marker: Some(marker), ..line(label, points, colour) }
}

fn chart(title: &str, x: Axis, y: Axis, series: Vec<Curve>) -> Chart {
    Chart { title: title.to_owned(), x, y, series, ..Chart::default() }
}

/// Curves over the first `to` seconds.
fn over_time(title: &str, to: f64, y: Axis, series: Vec<Curve>) -> Chart {
    let time = Axis { range: Some((0.0, to)), ..axis("Time", "s") };
    chart(title, time, y, series)
}

/// Columns of runs over the first `to` seconds, each run in its colour.
fn columns(runs: &[(String, &RecordedRun, usize)], to: f64, title: &str, colour: usize) -> Chart {
    let series = runs.iter().enumerate().map(|(n, (name, run, column))| {
        let early = run.curve(*column).take_while(|(time, _)| *time <= to);
        line(name, early.collect(), PALETTE[colour + n])
    });
    over_time(title, to, of_column(runs[0].2), series.collect())
}

fn of_series(found: &Findings, series: Series, column: usize) -> [(String, &RecordedRun, usize); 3] {
    series.cases().map(|case| (series.run_name(case), found.run(case), column))
}

/// The whole run above, its beginning below.
fn response(found: &Findings, to: Series, whole: &[String], early: &[String]) -> Vec<Chart> {
    let row = |names: &[String], end: f64, title: &str| -> Vec<Chart> {
        let chart = |name: &String| columns(&of_series(found, to, column_of(name)), end, title, 1);
        names.iter().map(chart).collect()
    };
    [row(whole, PAPER.period, "One period"), row(early, EARLY, "While the balls bounce")].concat()
}

fn forces(run: &RecordedRun) -> Vec<Chart> {
    let joints = ["S1", "S2", "S3"];
    let joints = joints.map(|j| (j.to_owned(), run, column_of(&format!("{j}_normal_N"))));
    vec![columns(&joints, PAPER.period, "One period", 1), columns(&joints, EARLY, "While the balls bounce", 1)]
}

fn verification(found: &Findings, names: &[String]) -> Vec<Chart> {
    let chart = |name: &String| {
        let runs = [
            ("ideal joints", &found.ideal),
            ("tree formulation", &found.runs[0]),
            ("lagrange formulation", &found.lagrange),
        ];
        let runs = runs.map(|(label, run)| (label.to_owned(), run, column_of(name)));
        // The ideal motion, with which the others are compared, has the first colour.
        columns(&runs, EARLIEST, "", 0)
    };
    names.iter().map(chart).collect()
}

fn drift(found: &Findings) -> Vec<Chart> {
    let (tree, lagrange) = (found.runs[0].samples(), found.lagrange.samples());
    let apart = |coordinate: Coordinate| {
        let column = derivative(coordinate, 0);
        let pairs = tree.iter().zip(&lagrange);
        let apart = pairs.map(|(a, b)| (a[0], (a[column] - b[column]).abs() * 1e6));
        let (label, colour) = [("x", PALETTE[1]), ("β", PALETTE[2])][coordinate as usize];
        line(label, apart.collect(), colour)
    };
    let violation = found.lagrange.curve(column_of("constraint_drift"));
    let violation = violation.map(|(time, size)| (time, size * 1e6)).collect();
    let unit = "µm, µrad";
    vec![
        over_time(
            "Difference of the formulations",
            PAPER.period,
            logarithmic("|tree − lagrange|", unit),
            Coordinate::ALL.map(apart).to_vec(),
        ),
        over_time(
            "Drift of the lagrange formulation",
            PAPER.period,
            logarithmic("Largest violation so far", unit),
            vec![line("constraints", violation, PALETTE[3])],
        ),
    ]
}

/// Rate against value of a coordinate, one curve per run.
fn phases(coordinate: Coordinate, title: &str, series: Vec<Curve>) -> Chart {
    let [x, y] = [0, 1].map(|nth| of_column(derivative(coordinate, nth)));
    chart(title, x, y, series)
}

/// Points of values in thousandths of SI units.
fn pairs<'a>(values: impl IntoIterator<Item = &'a f64>, rates: impl IntoIterator<Item = &'a f64>) -> Points {
    let pairs = values.into_iter().zip(rates);
    pairs.map(|(value, rate)| (value * 1e3, *rate)).collect()
}

fn portraits(found: &Findings, series: Series) -> Vec<Chart> {
    let each = |points: &dyn Fn(usize, Case) -> Points| {
        let cases = series.cases().into_iter().enumerate();
        cases.map(|(n, case)| line(&series.run_name(case), points(n, case), PALETTE[n + 1])).collect()
    };
    let settled = Coordinate::ALL.map(|c| {
        let loops = found.loops(series);
        let points = |n: usize, _| pairs(&loops[n].coordinates[c as usize], &loops[n].rates[c as usize]);
        phases(c, "Settled", each(&points))
    });
    let first = Coordinate::ALL.map(|c| {
        let [value, rate] = [0, 1].map(|nth| derivative(c, nth));
        let points = |_, case| {
            let rows = &found.run(case).rows;
            pairs(rows.iter().map(|row| &row[value]), rows.iter().map(|row| &row[rate]))
        };
        phases(c, "First period, with its impacts", each(&points))
    });
    settled.into_iter().chain(first).collect()
}

fn sections(found: &Findings, series: Series) -> Vec<Chart> {
    let data = found.sweep(&format!("runs_by_{series}"));
    let kept = data.sweep.layout().kept();
    let charts = Coordinate::ALL.map(|c| {
        let [values, rates] = [0, 1].map(|nth| {
            let column = &COLUMNS[derivative(c, nth)];
            data.values(&format!("section_{}", column.name))
        });
        let looks = [Marker::Disc, Marker::Square, Marker::Triangle].into_iter().enumerate();
        let dots = looks.zip(series.cases()).map(|((n, marker), case)| {
            let part = n * kept..(n + 1) * kept;
            let points = seen(pairs(&values[part.clone()], &rates[part]));
            dots(&series.run_name(case), points, PALETTE[n + 1], marker)
        });
        phases(c, &format!("{kept} sections each"), dots.collect())
    });
    charts.to_vec()
}

/// Points that a picture can resolve, once each.
fn seen(points: Points) -> Points {
    let mut cells = std::collections::HashSet::new();
    let cell = |v: f64| format!("{v:.6}");
    points.into_iter().filter(|p| cells.insert((cell(p.0), cell(p.1)))).collect()
}

fn bifurcation(found: &Findings, series: Series) -> Vec<Chart> {
    let all = found.branches(series);
    // Each start is drawn over the previous one, and smaller, so that all of them show.
    let looks = [
        ("cold start", PALETTE[0], Marker::Disc),
        ("followed upward", PALETTE[5], Marker::Point),
        ("followed downward", PALETTE[6], Marker::Dot),
    ];
    let diagram = |c: Coordinate| {
        let dots = all.iter().zip(looks).map(|(points, (start, colour, marker))| {
            let points = points.iter().flat_map(|p| p.sections[c as usize].iter().map(|s| (p.value, s * 1e3)));
            dots(start, points.collect(), colour, marker)
        });
        let value = of_column(derivative(c, 0));
        let title = format!("Sections in {}", value.label);
        chart(&title, parameter(series), value, dots.collect())
    };
    let differences = |c: Coordinate| {
        let along = |label: &str, colour: usize, size: &dyn Fn(usize, &SettledPoint) -> f64| {
            let points = all[0].iter().enumerate();
            let points = points.map(|(k, p)| (p.value, size(k, p) * 1e6));
            line(label, points.collect(), PALETTE[colour])
        };
        let apart = |branch: usize| {
            let label = format!("{} against cold", looks[branch].0);
            along(&label, branch + 4, &|k, cold| (cold.latest(c) - all[branch][k].latest(c)).abs())
        };
        let spread = along("spread of the sections of a point", 0, &|_, p| p.spread(c));
        let (name, unit) = [("x", "µm"), ("β", "µrad")][c as usize];
        Chart {
            levels: vec![Level {
                y: found.resolution[c as usize] * 1e6,
                text: "resolution: less counts as equal".to_owned(),
            }],
            ..chart(
                &format!("Spread and hysteresis in {name}"),
                parameter(series),
                logarithmic("Distance", unit),
                vec![spread, apart(1), apart(2)],
            )
        }
    };
    let diagrams = Coordinate::ALL.map(diagram).into_iter();
    diagrams.chain(Coordinate::ALL.map(differences)).collect()
}

/// Lower exponents are left out of the picture, 1/s: the smallest clearances would squeeze all others against 0.
const LEAST_EXPONENT: f64 = -10.0;

fn exponents(found: &Findings, series: Series) -> Vec<Chart> {
    let data = found.cold(series);
    let points = &data.points;
    let along = points.iter().map(|p| (p.value, p.exponent.0)).collect();
    let kept = data.sweep.layout().kept();
    let running = data.values("exponent_running_per_s");
    let discard = data.sweep.plan().discard;
    let legible: Vec<usize> = (0..points.len()).filter(|&k| points[k].exponent.0 > LEAST_EXPONENT).collect();
    let chosen = 5.min(legible.len());
    let convergence = (0..chosen).map(|n| {
        let k = legible[n * (legible.len() - 1) / (chosen - 1).max(1)];
        let values = running[k * kept..(k + 1) * kept].iter().enumerate();
        let values = values.map(|(i, v)| ((discard + i + 1) as f64, *v));
        let name = series.name(significant(points[k].value, 3));
        line(&name, values.collect(), PALETTE[n + 1])
    });
    let most = points.iter().map(|p| p.exponent.0).fold(0.0, f64::max);
    let exponents = |title: &str, x: Axis, lines: Vec<Curve>| {
        let y = Axis { range: Some((LEAST_EXPONENT, 1.1 * most + 1.0)), ..axis("Largest Lyapunov exponent", "1/s") };
        Chart { levels: vec![Level { y: 0.0, text: "chaos lies above".to_owned() }], ..chart(title, x, y, lines) }
    };
    let along = Curve { marker: Some(Marker::Dot), ..line("exponent", along, PALETTE[0]) };
    vec![
        exponents("Along the sweep", parameter(series), vec![along]),
        exponents("How it converges", axis("Periods run", ""), convergence.collect()),
    ]
}

fn map(found: &Findings) -> Vec<Chart> {
    let data = found.sweep("map");
    let axes = data.sweep.grid().axes();
    let heat = |title: &str, values: Vec<f64>, scale: Axis, names: Vec<(f64, String)>| Chart {
        map: Some(Map {
            xs: axes[1].values().map(|v| v * 1e3).collect(),
            ys: axes[0].values().collect(),
            values,
            scale,
            names,
        }),
        ..chart(title, parameter(Series::Clearance), parameter(Series::Friction), Vec::new())
    };
    let regimes = data.values("regime");
    let mut codes: Vec<i64> = regimes.iter().map(|r| *r as i64).collect();
    codes.sort_unstable();
    codes.dedup();
    let word = |code| Regime::of_code(code, 1).map_or(NO_REGIME, Regime::word);
    let names = codes.iter().map(|&c| (c as f64, word(c).to_owned()));
    let joints = &found.runs[0].response.joints;
    let peaks = joints.iter().map(|j| data.values(&format!("{j}_peak_N")));
    let peaks: Vec<Vec<f64>> = peaks.collect();
    let hardest = (0..regimes.len()).map(|k| peaks.iter().map(|p| p[k]).fold(f64::NAN, f64::max));
    let exponents = data.values("exponent_per_s").into_iter();
    // Grey where disturbances grow.
    let memory = exponents.map(|e| if e < 0.0 { -1.0 / e } else { f64::NAN });
    let size = |title: &str, values: Vec<f64>, scale: Axis| heat(title, values, scale, Vec::new());
    vec![
        heat("Regime", regimes.clone(), Axis::default(), names.collect()),
        size("Peak contact force of any joint", hardest.collect(), axis("", "N")),
        size("Largest tip error, settled", data.values("probe_error_max_um"), axis("", "µm")),
        size("Time in which a disturbance falls to 1/e", memory.collect(), logarithmic("", "s")),
    ]
}

fn probe(found: &Findings) -> Vec<Chart> {
    let data = found.cold(Series::Clearance);
    let along = |label: &str, name: &str, colour: usize| {
        let values = data.points.iter().map(|p| p.value).zip(data.values(name));
        line(label, values.collect(), PALETTE[colour])
    };
    let error = column_of("probe_error_m");
    let settled = vec![along("largest", "probe_error_max_um", 4), along("root mean square", "probe_error_rms_um", 0)];
    let first = of_series(found, Series::Clearance, error);
    vec![
        chart("Settled, against clearance", parameter(Series::Clearance), of_column(error), settled),
        columns(&first, PAPER.period, "The first period", 1),
    ]
}
