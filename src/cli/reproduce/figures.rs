//! The figures of the paper and the additional ones, as sheets.

use crate::analysis::paper::{Coordinate, FigureContent, PAPER, Series, SeriesRow, Variant};
use crate::analysis::regime::Regime;
use crate::analysis::reproduction::{COLUMNS, Findings, NO_REGIME, RecordedRun, SettledPoint, column_of, derivative};
use crate::chart::{Axis, Chart, Level, Map, Marker, PALETTE, Series as Curve, Sheet};
use crate::cli::output::significant;
use crate::cli::tables::typeset;

/// Width of a sheet and height of a row of charts, pixels.
const WIDTH: u32 = 1120;
const ROW: u32 = 290;
/// Length of the initial part of a run, in which the balls bounce, and of the comparison of formulations, s.
const EARLY: f64 = 0.15;
const EARLIEST: f64 = 0.1;

/// Every figure by name, in the order of the page.
pub(super) fn all(findings: &Findings) -> impl Iterator<Item = (String, Sheet)> {
    let figures = PAPER.sections.iter().flat_map(|section| &section.figures);
    figures.map(|figure| {
        let charts = match figure.shows {
            FigureContent::Response { to, ref whole, ref early } => response(findings, to, whole, early),
            FigureContent::Forces(case) => forces(findings.run(case)),
            FigureContent::Verification(ref columns) => verification(findings, columns),
            FigureContent::Drift => drift(findings),
            FigureContent::Portraits(series) => portraits(findings, series),
            FigureContent::Sections(series) => sections(findings, series),
            FigureContent::Bifurcation(series) => bifurcation(findings, series),
            FigureContent::Exponents(series) => exponents(findings, series),
            FigureContent::Map => map(findings),
            FigureContent::Probe => probe(findings),
        };
        // In rows of two.
        let size = (WIDTH, ROW * charts.len().div_ceil(2) as u32 + 34);
        let sheet =
            Sheet { title: String::new(), charts, columns: 2, size, note: String::new(), separate_legends: false };
        (picture_name(findings.variant, &figure.name), sheet)
    })
}

/// Name of a figure's picture in files and on the page.
pub(super) fn picture_name(variant: &Variant, name: &str) -> String {
    format!("{}{name}", variant.prefix.replace('_', "-"))
}

fn of_column(column: usize) -> Axis {
    Axis::new(&typeset(&capital(COLUMNS[column].label)), COLUMNS[column].unit)
}

/// Capitalised, except for names of coordinates.
fn capital(text: &str) -> String {
    let (first, rest) = text.split_at(1);
    let coordinate = ["x", "beta"].contains(&text.split(' ').next().unwrap_or_default());
    if coordinate { text.to_owned() } else { first.to_uppercase() + rest }
}

fn parameter(series: Series) -> Axis {
    let SeriesRow { label, unit, .. } = series.row();
    Axis::new(label, unit)
}

/// Curves over the first `to` seconds.
fn over_time(title: &str, to: f64, y: Axis, series: Vec<Curve>) -> Chart {
    let time = Axis { range: Some((0.0, to)), ..Axis::new("Time", "s") };
    Chart::new(title, time, y, series)
}

/// One column of each run over the first `to` seconds, one colour per run.
fn columns(runs: &[(String, &RecordedRun, usize)], to: f64, title: &str, colour: usize) -> Chart {
    let series = runs.iter().enumerate().map(|(n, (name, run, column))| {
        let early = run.curve(*column).take_while(|(time, _)| *time <= to);
        Curve::line(name, early.collect(), PALETTE[colour + n])
    });
    over_time(title, to, of_column(runs[0].2), series.collect())
}

fn of_series(findings: &Findings, series: Series, column: usize) -> [(String, &RecordedRun, usize); 3] {
    series.cases().map(|case| (series.run_name(case), findings.run(case), column))
}

/// The whole run in the upper row, its initial part in the lower.
fn response(findings: &Findings, to: Series, whole: &[String], early: &[String]) -> Vec<Chart> {
    let row = |names: &[String], end: f64, title: &str| -> Vec<Chart> {
        let runs = names.iter().map(|name| of_series(findings, to, column_of(name)));
        runs.map(|runs| columns(&runs, end, title, 1)).collect()
    };
    [row(whole, PAPER.period, "One period"), row(early, EARLY, "While the balls bounce")].concat()
}

fn forces(run: &RecordedRun) -> Vec<Chart> {
    let joints = ["S1", "S2", "S3"].map(|j| (j.to_owned(), run, column_of(&format!("{j}_normal_N"))));
    vec![columns(&joints, PAPER.period, "One period", 1), columns(&joints, EARLY, "While the balls bounce", 1)]
}

fn verification(findings: &Findings, names: &[String]) -> Vec<Chart> {
    let runs = [
        ("ideal joints", &findings.ideal),
        ("tree formulation", &findings.runs[0]),
        ("lagrange formulation", findings.lagrange()),
    ];
    let of = |name: &String| runs.map(|(label, run)| (label.to_owned(), run, column_of(name)));
    // The ideal motion is the reference and has the first colour.
    names.iter().map(|name| columns(&of(name), EARLIEST, "", 0)).collect()
}

fn drift(findings: &Findings) -> Vec<Chart> {
    let (tree, lagrange) = (findings.runs[0].samples(), findings.lagrange().samples());
    let difference = Coordinate::ALL.map(|c| {
        let column = derivative(c, 0);
        let difference = tree.iter().zip(&lagrange).map(|(a, b)| (a[0], (a[column] - b[column]).abs() * 1e6));
        Curve::line(["x", "β"][c as usize], difference.collect(), PALETTE[1 + c as usize])
    });
    let violation = findings.lagrange().curve(column_of("constraint_drift")).map(|(time, size)| (time, size * 1e6));
    let violation = Curve::line("constraints", violation.collect(), PALETTE[3]);
    let size = |label: &str| Axis::logarithmic(label, "µm, µrad");
    let largest = size("Largest violation so far");
    vec![
        over_time("Difference of the formulations", PAPER.period, size("|tree − lagrange|"), difference.to_vec()),
        over_time("Drift of the lagrange formulation", PAPER.period, largest, vec![violation]),
    ]
}

/// Rate against value of a coordinate, one curve per run.
fn phases(coordinate: Coordinate, title: &str, series: impl Iterator<Item = Curve>) -> Chart {
    let [x, y] = [0, 1].map(|nth| of_column(derivative(coordinate, nth)));
    Chart::new(title, x, y, series.collect())
}

/// Points (value, rate), with the values in thousandths of SI units.
fn pairs<'a>(values: impl IntoIterator<Item = &'a f64>, rates: impl IntoIterator<Item = &'a f64>) -> Vec<(f64, f64)> {
    values.into_iter().zip(rates).map(|(value, rate)| (value * 1e3, *rate)).collect()
}

fn portraits(findings: &Findings, series: Series) -> Vec<Chart> {
    let runs = || (1..).zip(series.cases());
    let settled = Coordinate::ALL.map(|c| {
        let curves = runs().zip(findings.loops(series)).map(|((n, case), l)| {
            let points = pairs(&l.coordinates[c as usize], &l.rates[c as usize]);
            Curve::line(&series.run_name(case), points, PALETTE[n])
        });
        phases(c, "Settled", curves)
    });
    let first = Coordinate::ALL.map(|c| {
        let [value, rate] = [0, 1].map(|nth| derivative(c, nth));
        let curves = runs().map(|(n, case)| {
            let rows = &findings.run(case).rows;
            let points = pairs(rows.iter().map(|row| &row[value]), rows.iter().map(|row| &row[rate]));
            Curve::line(&series.run_name(case), points, PALETTE[n])
        });
        phases(c, "First period, with its impacts", curves)
    });
    [settled, first].concat()
}

fn sections(findings: &Findings, series: Series) -> Vec<Chart> {
    let data = findings.sweep(&format!("runs_by_{series}"));
    let kept = data.sweep.layout().kept();
    let charts = Coordinate::ALL.map(|c| {
        let [values, rates] = [0, 1].map(|nth| data.values(&format!("section_{}", COLUMNS[derivative(c, nth)].name)));
        let styles = [Marker::Disc, Marker::Square, Marker::Triangle].into_iter().enumerate();
        let dots = styles.zip(series.cases()).map(|((n, marker), case)| {
            let part = n * kept..(n + 1) * kept;
            let points = without_duplicates(pairs(&values[part.clone()], &rates[part]));
            Curve::dots(&series.run_name(case), points, PALETTE[n + 1], marker)
        });
        phases(c, &format!("{kept} sections each"), dots)
    });
    charts.to_vec()
}

/// Removes points that coincide in print.
fn without_duplicates(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let mut cells = std::collections::HashSet::new();
    points.into_iter().filter(|(x, y)| cells.insert(format!("{x:.6} {y:.6}"))).collect()
}

fn bifurcation(findings: &Findings, series: Series) -> Vec<Chart> {
    let all = findings.branches(series);
    // Each start is drawn on top of the previous one and smaller, so that all remain visible.
    let styles = [
        ("cold start", PALETTE[0], Marker::Disc),
        ("followed upward", PALETTE[5], Marker::Point),
        ("followed downward", PALETTE[6], Marker::Dot),
    ];
    let diagrams = Coordinate::ALL.map(|c| {
        let dots = all.iter().zip(styles).map(|(points, (start, colour, marker))| {
            let points = points.iter().flat_map(|p| p.sections[c as usize].iter().map(|s| (p.value, s * 1e3)));
            Curve::dots(start, points.collect(), colour, marker)
        });
        let value = of_column(derivative(c, 0));
        Chart::new(&format!("Sections in {}", value.label), parameter(series), value, dots.collect())
    });
    let differences = Coordinate::ALL.map(|c| {
        let along = |label: &str, colour: usize, size: &dyn Fn(usize, &SettledPoint) -> f64| {
            let points = all[0].iter().enumerate().map(|(k, p)| (p.value, size(k, p) * 1e6));
            Curve::line(label, points.collect(), PALETTE[colour])
        };
        let apart = |branch: usize| {
            let label = format!("{} against cold", styles[branch].0);
            along(&label, branch + 4, &|k, cold| (cold.latest(c) - all[branch][k].latest(c)).abs())
        };
        let spread = along("spread of the sections of a point", 0, &|_, p| p.spread(c));
        let (name, unit) = [("x", "µm"), ("β", "µrad")][c as usize];
        let title = format!("Spread and hysteresis in {name}");
        let distance = Axis::logarithmic("Distance", unit);
        let resolution = findings.resolution[c as usize] * 1e6;
        Chart {
            levels: vec![Level { y: resolution, text: "resolution: less counts as equal".to_owned() }],
            ..Chart::new(&title, parameter(series), distance, vec![spread, apart(1), apart(2)])
        }
    });
    [diagrams, differences].concat()
}

/// Smallest exponent plotted, 1/s: the smallest clearances would squeeze all others against 0.
const MIN_EXPONENT: f64 = -10.0;

fn exponents(findings: &Findings, series: Series) -> Vec<Chart> {
    let data = findings.cold(series);
    let points = &data.points;
    let (kept, discard) = (data.sweep.layout().kept(), data.plan.discard);
    let running = data.values("exponent_running_per_s");
    let legible: Vec<usize> = (0..points.len()).filter(|&k| points[k].exponent.0 > MIN_EXPONENT).collect();
    let chosen = 5.min(legible.len());
    let convergence = (0..chosen).map(|n| {
        let k = legible[n * (legible.len() - 1) / (chosen - 1).max(1)];
        let values = running[k * kept..(k + 1) * kept].iter().enumerate();
        let values = values.map(|(i, v)| ((discard + i + 1) as f64, *v));
        Curve::line(&series.name(significant(points[k].value, 3)), values.collect(), PALETTE[n + 1])
    });
    let most = points.iter().map(|p| p.exponent.0).fold(0.0, f64::max);
    let exponents = |title: &str, x: Axis, lines: Vec<Curve>| {
        let range = Some((MIN_EXPONENT, 1.1 * most + 1.0));
        let y = Axis { range, ..Axis::new("Largest Lyapunov exponent", "1/s") };
        let zero = Level { y: 0.0, text: "chaos lies above".to_owned() };
        Chart { levels: vec![zero], ..Chart::new(title, x, y, lines) }
    };
    let along = points.iter().map(|p| (p.value, p.exponent.0)).collect();
    let along = Curve::line("exponent", along, PALETTE[0]).marked(Marker::Dot);
    vec![
        exponents("Along the sweep", parameter(series), vec![along]),
        exponents("Convergence", Axis::new("Periods run", ""), convergence.collect()),
    ]
}

fn map(findings: &Findings) -> Vec<Chart> {
    let data = findings.sweep("map");
    let axes = data.sweep.design().axes();
    let heat = |title: &str, values: Vec<f64>, scale: Axis, names: Vec<(f64, String)>| {
        let (xs, ys) = (axes[1].numbers().map(|v| v * 1e3).collect(), axes[0].numbers().collect());
        let [x, y] = [Series::Clearance, Series::Friction].map(parameter);
        Chart { map: Some(Map { xs, ys, values, scale, names }), ..Chart::new(title, x, y, Vec::new()) }
    };
    let size = |title: &str, values: Vec<f64>, scale: Axis| heat(title, values, scale, Vec::new());
    let regimes = data.values("regime");
    let codes: std::collections::BTreeSet<i64> = regimes.iter().map(|r| *r as i64).collect();
    let word = |code| Regime::of_code(code, 1).map_or(NO_REGIME, Regime::word);
    let names = codes.into_iter().map(|c| (c as f64, word(c).to_owned())).collect();
    let joints = &findings.runs[0].response.joints;
    let peaks: Vec<Vec<f64>> = joints.iter().map(|j| data.values(&format!("{j}_peak_N"))).collect();
    let largest_peak = (0..regimes.len()).map(|k| peaks.iter().map(|p| p[k]).fold(f64::NAN, f64::max)).collect();
    // NaN, drawn in grey, where disturbances grow.
    let decay_time = data.values("exponent_per_s").into_iter().map(|e| if e < 0.0 { -1.0 / e } else { f64::NAN });
    vec![
        heat("Regime", regimes, Axis::default(), names),
        size("Peak contact force of any joint", largest_peak, Axis::new("", "N")),
        size("Largest tip error, settled", data.values("probe_error_max_um"), Axis::new("", "µm")),
        size("Time in which a disturbance falls to 1/e", decay_time.collect(), Axis::logarithmic("", "s")),
    ]
}

fn probe(findings: &Findings) -> Vec<Chart> {
    let data = findings.cold(Series::Clearance);
    let along = |label: &str, name: &str, colour: usize| {
        let values = data.points.iter().map(|p| p.value).zip(data.values(name));
        Curve::line(label, values.collect(), PALETTE[colour])
    };
    let error = column_of("probe_error_m");
    let settled = vec![along("largest", "probe_error_max_um", 4), along("root mean square", "probe_error_rms_um", 0)];
    let first = of_series(findings, Series::Clearance, error);
    vec![
        Chart::new("Settled, against clearance", parameter(Series::Clearance), of_column(error), settled),
        columns(&first, PAPER.period, "The first period", 1),
    ]
}

#[cfg(test)]
mod tests {
    use super::capital;

    #[test]
    fn labels_begin_with_a_capital_except_for_coordinates() {
        for (text, set) in [("rate of beta", "Rate of beta"), ("x", "x"), ("beta less ideal", "beta less ideal")] {
            assert_eq!(capital(text), set);
        }
    }
}
