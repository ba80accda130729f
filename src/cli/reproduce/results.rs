//! Tables of the page and of the data files: the paper's numbers and statements beside this program's, and the tables of each
//! figure.

use crate::analysis::paper::{
    Agreement, Case, Comparison, Coordinate, Figure, FigureContent, FigureValue, PAPER, Series,
};
use crate::analysis::reproduction::{Findings, RecordedRun, Report, SettledPoint, Statement, exponents, regime_counts};
use crate::cli::output::significant;
use crate::cli::tables::{Table, yes_or_no};

/// Counts of the paper's numbers with which a model agrees, nearly agrees and disagrees, of the statements that it confirms, and
/// of all statements.
pub(super) fn score(findings: &Findings) -> [usize; 5] {
    let (compared, statements) = (findings.comparisons(), findings.statements());
    let [agree, near, differ] =
        Agreement::ALL.map(|agreement| compared.iter().filter(|c| c.agreement() == agreement).count());
    [agree, near, differ, statements.iter().filter(|s| s.confirmed).count(), statements.len()]
}

/// Four digits for readability; a dash if there is no number.
fn four_digits(value: impl Into<Option<f64>>) -> String {
    let value = value.into().filter(|value| !value.is_nan());
    value.map_or_else(|| "\u{2013}".to_owned(), |value| significant(value, 4))
}

/// A distance, m or rad, in micrometres or microradians.
fn micro(value: f64) -> String {
    four_digits(value * 1e6)
}

/// Two decimals, or two significant digits below 0.1.
fn ratio(value: f64) -> String {
    if value < 0.1 { significant(value, 2) } else { format!("{value:.2}") }
}

/// Clearance and friction of a run, its label in tables.
fn run_of(comparison: &Comparison) -> String {
    let Case { clearance, friction } = comparison.published.case;
    format!("{clearance} mm, {friction}")
}

/// The tables that belong to a figure.
pub(super) fn of_figure(figure: &Figure, comparisons: &[Comparison], findings: &Findings) -> Vec<Table> {
    let own: Vec<&Comparison> = comparisons.iter().filter(|c| figure.contains(&c.published.figure)).collect();
    let more = match figure.shows {
        FigureContent::Verification(_) => Some(verification(findings)),
        FigureContent::Drift => Some(drift(findings)),
        FigureContent::Sections(series) => Some(sections(findings, series)),
        FigureContent::Bifurcation(series) => Some(branches(findings, series)),
        FigureContent::Probe => Some(probe(findings)),
        _ => (!figure.strongest_of.is_empty()).then(|| strongest(comparisons, &figure.strongest_of)),
    };
    (!own.is_empty()).then(|| numbers(&own)).into_iter().chain(more).collect()
}

fn numbers(rows: &[&Comparison]) -> Table {
    let row = |c: &&Comparison| {
        vec![
            c.published.figure.clone(),
            run_of(c),
            format!("{} ({})", c.published.quantity, c.published.quantity.unit()),
            four_digits(c.published.value),
            four_digits(c.full),
            ratio(c.ratio()),
            four_digits(c.sampled),
            c.sampled_ratio().map_or_else(|| four_digits(None), ratio),
            c.agreement().to_string(),
        ]
    };
    let heads = "Figure | Clearance, friction .run | Quantity .what | Paper .n | Here .n | Ratio .n | At 1 ms .n | Ratio .n | Verdict .verdict";
    Table::new(heads, rows.iter().map(row))
}

/// The largest force over all joints, which depends less on which joint is hit first.
fn strongest(comparisons: &[Comparison], figures: &[String]) -> Table {
    let row = |figure: &String| {
        let own = comparisons.iter().filter(|c| c.published.figure == *figure);
        let own: Vec<_> = own.filter(|c| FigureValue::NORMAL.contains(&c.published.quantity)).collect();
        let most = |of: fn(&Comparison) -> f64| own.iter().map(|c| of(c)).fold(0.0, f64::max);
        let (paper, here) = (most(|c| c.published.value), most(|c| c.full));
        let agreement = Agreement::of(here / paper).to_string();
        Some(vec![
            figure.clone(),
            run_of(own.first()?),
            four_digits(paper),
            four_digits(here),
            ratio(here / paper),
            agreement,
        ])
    };
    let heads = "Figure | Clearance, friction .run | Paper (N) .n | Here (N) .n | Ratio .n | Verdict .verdict";
    let table = Table::new(heads, figures.iter().filter_map(row));
    table.with_title("The largest contact force of any joint, whichever it is:")
}

fn verification(findings: &Findings) -> Table {
    let row = |figure: &str, quantity: FigureValue, paper: [Option<f64>; 2]| {
        let mut row = vec![figure.to_owned(), format!("{quantity} ({})", quantity.unit())];
        row.extend(paper.map(four_digits));
        for run in [&findings.runs[0], findings.lagrange()] {
            row.extend([four_digits(quantity.of(&run.response)), four_digits(quantity.sampled(&run.response))]);
        }
        row
    };
    let peaks = PAPER.verification.iter().map(|v| row(&v.figure, v.quantity, [Some(v.own), Some(v.commercial)]));
    let forces = FigureValue::NORMAL.map(|quantity| row("", quantity, [None, None]));
    let heads = "Figure | Quantity .what | Paper, own .n | Paper, commercial .n | Tree .n | Tree at 1 ms .n | Lagrange .n | Lagrange at 1 ms .n";
    let title = "The paper does not name the run of this figure. Its peaks, beside those of both formulations at 0.3 mm and friction 0.2:";
    Table::new(heads, peaks.chain(forces)).with_title(title)
}

fn drift(findings: &Findings) -> Table {
    let [x, beta] = Coordinate::ALL.map(|c| findings.formulations_apart(c));
    let rows = [
        ("Difference of the formulations in x", x, "µm"),
        ("Difference of the formulations in beta", beta, "µrad"),
        ("Violation of a constraint of the lagrange form", findings.lagrange().response.constraint_drift, "µm, µrad"),
    ];
    let rows = rows.map(|(what, size, unit)| vec![what.to_owned(), micro(size), unit.to_owned()]);
    Table::new("Quantity | At most .n | Unit", rows)
}

fn sections(findings: &Findings, series: Series) -> Table {
    let row = |run: &SettledPoint| {
        let exponent = format!("{} ± {}", four_digits(run.exponent.0), significant(run.exponent.1, 2));
        let mut row = vec![series.name(four_digits(run.value)), run.regime_word(), exponent];
        for c in Coordinate::ALL {
            row.extend([format!("{:.4}", run.latest(c) * 1e3), significant(run.spread(c) * 1e6, 2)]);
        }
        row
    };
    let heads =
        "Run | Regime | Exponent (1/s) .n | x (mm) .n | Spread of x (µm) .n | β (mrad) .n | Spread of β (µrad) .n";
    Table::new(heads, findings.sections(series).iter().map(row))
}

/// Largest distance of each followed branch from the cold starts.
fn branches(findings: &Findings, series: Series) -> Table {
    let [cold, up, down] = findings.branches(series);
    let row = |name: &str, other: &[SettledPoint]| {
        let most = Coordinate::ALL.map(|c| {
            let pairs = cold.iter().zip(other);
            pairs.map(|(a, b)| (a.latest(c) - b.latest(c)).abs()).fold(0.0, f64::max)
        });
        let within = (0..2).all(|c| most[c] <= findings.resolution[c]);
        vec![name.to_owned(), cold.len().to_string(), micro(most[0]), micro(most[1]), yes_or_no(!within)]
    };
    let [x, beta] = findings.resolution.map(micro);
    let resolution = vec!["resolution".to_owned(), String::new(), x, beta, String::new()];
    let heads =
        "Branch | Values .n | Distance from the cold start in x (µm) .n | In β (µrad) .n | Hysteresis, or a transient";
    Table::new(heads, [row("followed upward", up), row("followed downward", down), resolution])
}

fn probe(findings: &Findings) -> Table {
    let data = findings.cold(Series::Clearance);
    let [largest, rms] = ["probe_error_max_um", "probe_error_rms_um"].map(|name| data.values(name));
    let rows = 10.min(data.points.len());
    let row = |n: usize| {
        let k = n * (data.points.len() - 1) / (rows - 1).max(1);
        let clearance = data.points[k].value;
        vec![
            four_digits(clearance),
            four_digits(largest[k]),
            four_digits(rms[k]),
            significant(largest[k] / (clearance * 1e3), 3),
        ]
    };
    let heads = "Clearance (mm) .n | Largest error (µm) .n | Root mean square (µm) .n | Largest error / clearance .n";
    Table::new(heads, (0..rows).map(row))
}

fn evidence(statement: &Statement) -> String {
    let words = statement.evidence.iter().map(|(of, value, unit)| match value.is_nan() {
        true => format!("{of}: none"),
        false => format!("{of}: {} {unit}", significant(*value, 7)).trim_end().to_owned(),
    });
    words.collect::<Vec<_>>().join(", ")
}

fn verdict(statement: &Statement) -> String {
    if statement.confirmed { "confirmed" } else { "not confirmed" }.to_owned()
}

/// The paper's verbal statements with the criterion, the verdict and its numbers, under the headings `heads`.
pub(super) fn statements(heads: &str, findings: &Findings) -> Table {
    let row = |s: &Statement| {
        vec![s.claim.place.clone(), s.claim.says.clone(), s.criterion.to_owned(), verdict(s), evidence(s)]
    };
    Table::new(heads, findings.statements().iter().map(row))
}

/// Statements whose verdict changes with (13) as printed.
pub(super) fn changed_verdicts(report: &Report) -> Table {
    let [corrected, printed] = report.complete().map(Findings::statements);
    let both = corrected.iter().zip(&printed).filter(|(a, b)| a.confirmed != b.confirmed);
    let row = |(a, b): (&Statement, &Statement)| {
        vec![a.claim.place.clone(), a.claim.says.clone(), verdict(a), evidence(a), verdict(b), evidence(b)]
    };
    let table = Table::new("Place | Statement | As corrected | Evidence | (13) as printed | Evidence", both.map(row));
    table.with_title("Statements of the paper whose verdict differs with (13) as printed:")
}

/// Mean of x in trajectory (59), m.
const MEAN_X: f64 = 0.203;
/// Largest ratio to the settling times and rates of the paper that counts as near.
const NEAR: f64 = 1.25;

/// A quantity compared by clearance: heading, value for a run and its sections, and the paper's quantity if it prints one.
type Measure = (&'static str, fn(&RecordedRun, &SettledPoint) -> f64, Option<FigureValue>);

const MEASURES: [Measure; 6] = {
    use Coordinate::{Beta, X};
    use FigureValue::{LastSeparation, RateBeta};
    [
        ("Section in x, from 203 mm (µm)", |_, s| (s.latest(X) - MEAN_X) * 1e6, None),
        ("Spread of the sections in x (µm)", |_, s| s.spread(X) * 1e6, None),
        ("Spread of the sections in β (µrad)", |_, s| s.spread(Beta) * 1e6, None),
        ("Largest Lyapunov exponent (1/s)", |_, s| s.exponent.0, None),
        ("Last separation in the first period (s)", |run, _| LastSeparation.of(&run.response), Some(LastSeparation)),
        ("Largest angular rate of β (rad/s)", |run, _| RateBeta.of(&run.response), Some(RateBeta)),
    ]
};

/// A measure of a model at each clearance.
fn computed_values(findings: &Findings, (_, of, _): &Measure) -> [f64; 3] {
    let (cases, sections) = (Series::Clearance.cases(), findings.sections(Series::Clearance));
    std::array::from_fn(|k| of(findings.run(cases[k]), &sections[k]))
}

/// The paper's values of a measure; the first if it prints two.
fn published_values((_, _, quantity): &Measure) -> Option<[f64; 3]> {
    let of = |case| PAPER.numbers.iter().find(|p| p.case == case && Some(p.quantity) == *quantity);
    let [a, b, c] = Series::Clearance.cases().map(|case| of(case).map(|p| p.value));
    Some([a?, b?, c?])
}

/// The measures of all models, and of the paper.
pub(super) fn by_clearance(report: &Report) -> Table {
    let mut rows = Vec::new();
    for measure in &MEASURES {
        let paper = published_values(measure).map(|values| ("the paper", values));
        let models =
            report.models.iter().map(|findings| (findings.variant.title.as_str(), computed_values(findings, measure)));
        for (model, values) in paper.into_iter().chain(models) {
            rows.push([&[measure.0.to_owned(), model.to_owned()], &values.map(four_digits)[..]].concat());
        }
    }
    let heads = Series::Clearance.cases().map(|case| Series::Clearance.run_name(case));
    Table::new(&format!("Quantity .what | Model | {} .n", heads.join(" .n | ")), rows)
}

/// Both sweeps of both models.
pub(super) fn sweeps(report: &Report) -> Table {
    let mut rows = Vec::new();
    for series in Series::ALL {
        let ([from, to], unit) = (series.row().range, &series.row().unit);
        for findings in report.complete() {
            let points = findings.swept(series);
            let (least, most) = exponents(points);
            let regimes = regime_counts(points).into_iter().map(|(word, n)| format!("{n} {word}"));
            let mut row = vec![
                format!("{series}, {from} to {to} {unit}").trim_end().to_owned(),
                findings.variant.title.clone(),
                regimes.collect::<Vec<_>>().join(", "),
                format!("{} to {}", four_digits(least), four_digits(most)),
            ];
            row.extend(Coordinate::ALL.map(|c| micro(points.iter().map(|p| p.spread(c)).fold(0.0, f64::max))));
            rows.push(row);
        }
    }
    let heads =
        "Sweep | Model | Regimes | Exponents (1/s) .n | Widest spread of x (µm) .n | Widest spread of β (µrad) .n";
    Table::new(heads, rows)
}

/// Each model compared with the paper: whether its sections scatter, how long its impacts last, and how fast they rotate the platform.
pub(super) fn models(report: &Report) -> Table {
    let scattered_clearances = |findings: &Findings| {
        let runs = findings.sections(Series::Clearance).iter();
        runs.filter(|run| run.spread(Coordinate::Beta) > findings.resolution[1]).count()
    };
    let before = scattered_clearances(&report.models[0]);
    let row = |(n, findings): (usize, &Findings)| {
        // Combinations lack the runs behind most numbers and statements.
        let score = if n < 2 { score(findings).map(|count| count.to_string()) } else { [const { String::new() }; 5] };
        let deviation = |measure: &Measure| {
            let ratios = computed_values(findings, measure)
                .into_iter()
                .zip(published_values(measure)?)
                .map(|(own, paper)| own / paper);
            Some(ratios.map(|ratio| ratio.max(1.0 / ratio)).fold(1.0, f64::max))
        };
        let deviations: Vec<f64> = MEASURES.iter().filter_map(deviation).collect();
        let mut row = vec![findings.variant.title.clone()];
        row.extend_from_slice(&score[..4]);
        row.extend([
            format!("{} of 3", scattered_clearances(findings)),
            yes_or_no(scattered_clearances(findings) > before),
        ]);
        row.extend(deviations.iter().map(|deviation| significant(*deviation, 3)));
        row.push(yes_or_no(deviations.iter().all(|deviation| *deviation < NEAR)));
        row
    };
    let heads = "Model | Numbers within 10 % .n | Within a factor of 2 .n | Further off .n | Statements confirmed .n | Clearances with scatter in β .n | More than as corrected | Ratio of the last separation .n | Ratio of the rate of β .n | Both within a quarter";
    Table::new(heads, report.models.iter().enumerate().map(row))
}
