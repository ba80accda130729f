//! The page: each figure of the paper beside this program's. One file, nothing from the network.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::figures::picture_name;
use super::statements::words;
use super::text::{self, NONE, capital, escape, shown, typeset};
use super::{Score, command, meta, scatter};
use crate::analysis::paper::{Agreement, Comparison, Coordinate, Figure, FigureValue, PAPER, Series, Shows, Variant};
use crate::analysis::reproduction::{Extent, Findings, Report, SettledPoint, Statement};
use crate::analysis::response::Response;
use crate::cli::output::significant;
use crate::cli::tables::{fill, html};

/// Shown above a shortened report.
const SHORTENED: &str = "<p class=\"notice\">This is a quick report: few values and few periods, which shows that everything works. \
    Transients have not ended everywhere, so regimes, sections and diagrams may differ from those of the whole report, which \
    <code>jointplay reproduce --out report/</code> computes.</p>\n";

/// SVG by the name of the picture.
pub(super) type Pictures = BTreeMap<String, String>;

/// The whole page.
pub(super) fn page(report: &Report, pictures: &Pictures) -> String {
    let found = &report.corrected;
    let statements = found.statements();
    let score = Score::of(found, &statements);
    let whole = found.extent == Extent::FULL;
    let mut gaps = vec![
        ("style", include_str!("page.css").to_owned()),
        ("notice", if whole { "" } else { SHORTENED }.to_owned()),
        ("contents", contents()),
        ("agree", score.agree.to_string()),
        ("near", score.near.to_string()),
        ("differ", score.differ().to_string()),
        ("numbers", score.numbers.to_string()),
        ("confirmed", score.confirmed.to_string()),
        ("stated", statements.len().to_string()),
        ("figures", figures(found, pictures)),
        ("printed_figures", figures(&report.printed, pictures)),
        ("statements", statement_table(&statements)),
    ];
    gaps.extend(scatter::gaps(report, &statements));
    gaps.extend(provenance(report));
    fill(include_str!("page.html"), &gaps)
}

fn contents() -> String {
    let mut out = String::new();
    for section in &PAPER.sections {
        // Writing to a String cannot fail.
        let _ = writeln!(out, "<li><a href=\"#{}\">{}</a><ol>", section.id, section.title);
        for Figure { name, heading, .. } in &section.figures {
            let _ = writeln!(out, "<li><a href=\"#{name}\">{heading}</a></li>");
        }
        out.push_str("</ol></li>\n");
    }
    out
}

/// Every figure of a model, section by section, with the tables that belong to it.
fn figures(found: &Findings, pictures: &Pictures) -> String {
    let comparisons = found.comparisons();
    let (level, of) = if *found.variant == PAPER.variants.corrected { (2, "") } else { (3, ", (13) as printed") };
    let mut out = String::new();
    for section in &PAPER.sections {
        let (id, title) = (picture_name(found.variant, &section.id), &section.title);
        let _ = writeln!(out, "<h{level} id=\"{id}\">{title}{of}</h{level}>");
        for entry in &section.figures {
            out += &figure(entry, found.variant, pictures);
            out += &after(entry, &comparisons, found);
        }
    }
    out
}

fn figure(entry: &Figure, variant: &Variant, pictures: &Pictures) -> String {
    let name = picture_name(variant, &entry.name);
    let Figure { heading, caption, .. } = entry;
    // The height follows the width of the page.
    let svg = pictures[&name].replacen("<svg ", &format!("<svg role=\"img\" aria-label=\"{heading}\" "), 1);
    format!(
        "<h3 id=\"{name}\">{heading}</h3>\n<figure>\n<div class=\"plot\">{}</div>\n<figcaption>{caption} <a href=\"plots/{name}.svg\">SVG</a>, \
         <a href=\"plots/{name}.png\">PNG</a>.</figcaption>\n</figure>\n",
        svg.trim()
    )
}

/// The tables that belong to a figure.
fn after(figure: &Figure, comparisons: &[Comparison], found: &Findings) -> String {
    let own = |c: &&Comparison| figure.contains(&c.published.figure);
    let own: Vec<&Comparison> = comparisons.iter().filter(own).collect();
    let numbers = if own.is_empty() { String::new() } else { numbers(&own) };
    let more = match figure.shows {
        Shows::Verification(_) => verification(found),
        Shows::Drift => drift(found),
        Shows::Sections(series) => runs(found, series),
        Shows::Bifurcation(series) => branches(found, series),
        Shows::Probe => probe(found),
        _ if !figure.strongest_of.is_empty() => strongest(comparisons, &figure.strongest_of),
        _ => String::new(),
    };
    numbers + &more
}

fn badge(agreement: Agreement) -> String {
    let class = match agreement {
        Agreement::Agrees => "ok",
        Agreement::Near => "near",
        Agreement::Differs => "off",
    };
    format!("<span class=\"{class}\">{agreement}</span>")
}

/// Two decimals, or two digits of a small number.
fn ratio(value: f64) -> String {
    if value < 0.1 { typeset(&significant(value, 2)) } else { format!("{value:.2}") }
}

/// Clearance and friction of the run, as tables name it.
fn run_of(comparison: &Comparison) -> String {
    let case = comparison.published.case;
    format!("{} mm, {}", case.clearance, case.friction)
}

fn what(quantity: FigureValue) -> String {
    typeset(&format!("{quantity} ({})", quantity.unit()))
}

fn numbers(rows: &[&Comparison]) -> String {
    html(
        "Figure | Clearance, friction .run | Quantity .what | Paper .n | Here .n | Ratio .n | At 1 ms .n | Ratio .n | Verdict .verdict",
        rows.iter().map(|c| {
            vec![
                c.published.figure.clone(),
                run_of(c),
                what(c.published.quantity),
                shown(c.published.value),
                shown(c.full),
                ratio(c.ratio()),
                shown(c.sampled),
                c.sampled_ratio().map_or_else(|| NONE.to_owned(), ratio),
                badge(c.agreement()),
            ]
        }),
    )
}

/// The largest force of any joint, which depends less on which joint happens to be hit first.
fn strongest(comparisons: &[Comparison], figures: &[String]) -> String {
    let row = |figure: &String| {
        let own =
            |c: &&Comparison| c.published.figure == *figure && FigureValue::NORMAL.contains(&c.published.quantity);
        let own: Vec<&Comparison> = comparisons.iter().filter(own).collect();
        let most = |of: fn(&Comparison) -> f64| own.iter().map(|c| of(c)).fold(0.0, f64::max);
        let (paper, here) = (most(|c| c.published.value), most(|c| c.full));
        Some(vec![
            figure.clone(),
            run_of(own.first()?),
            shown(paper),
            shown(here),
            ratio(here / paper),
            badge(Agreement::of(here / paper)),
        ])
    };
    format!(
        "<p>The largest contact force of any joint, whichever it is:</p>\n{}",
        html(
            "Figure | Clearance, friction .run | Paper (N) .n | Here (N) .n | Ratio .n | Verdict .verdict",
            figures.iter().filter_map(row)
        )
    )
}

fn verification(found: &Findings) -> String {
    let row = |figure: &str, quantity: FigureValue, paper: [Option<f64>; 2]| {
        let of = |run: &Response| [shown(quantity.of(run)), shown(quantity.sampled(run))];
        let mut row = vec![figure.to_owned(), what(quantity)];
        row.extend(paper.map(shown));
        row.extend([&found.runs[0], &found.lagrange].map(|run| of(&run.response)).concat());
        row
    };
    let peaks = PAPER.verification.iter().map(|v| row(&v.figure, v.quantity, [Some(v.own), Some(v.commercial)]));
    let forces = FigureValue::NORMAL.map(|quantity| row("", quantity, [None, None]));
    format!(
        "<p>The paper does not name the run of this figure. Its peaks, beside those of both formulations at 0.3 mm and friction 0.2:</p>\n{}",
        html(
            "Figure | Quantity .what | Paper, own .n | Paper, commercial .n | Tree .n | Tree at 1 ms .n | Lagrange .n | Lagrange at 1 ms .n",
            peaks.chain(forces)
        )
    )
}

fn drift(found: &Findings) -> String {
    let [x, beta] = Coordinate::ALL.map(|c| found.formulations_apart(c));
    format!(
        "<p>The formulations differ by at most {} µm in x and {} µrad in β. The largest violation of a constraint of the lagrange form is {} µm \
         (µrad for directions); the tree form has none by construction, but for its loops, which are closed at every step.</p>\n",
        shown(x * 1e6),
        shown(beta * 1e6),
        shown(found.lagrange.response.constraint_drift * 1e6)
    )
}

fn runs(found: &Findings, series: Series) -> String {
    let head = match series {
        Series::Clearance => "Clearance (mm)",
        Series::Friction => "Friction",
    };
    let two = |value: f64| typeset(&significant(value, 2));
    html(
        &format!(
            "{head} .n | Regime | Exponent (1/s) .n | x (mm) .n | Spread of x (µm) .n | β (mrad) .n | Spread of β (µrad) .n"
        ),
        found.sections(series).iter().map(|run| {
            let (exponent, error) = run.exponent;
            let mut row =
                vec![shown(run.value), text::regime(run.regime), format!("{} ± {}", shown(exponent), two(error))];
            for c in Coordinate::ALL {
                row.push(typeset(&format!("{:.4}", run.latest(c) * 1e3)));
                row.push(two(run.spread(c) * 1e6));
            }
            row
        }),
    )
}

fn branches(found: &Findings, series: Series) -> String {
    let [cold, up, down] = found.branches(series);
    let most = |other: &[SettledPoint]| {
        Coordinate::ALL.map(|c| {
            let pairs = cold.iter().zip(other);
            pairs.map(|(a, b)| (a.latest(c) - b.latest(c)).abs() * 1e6).fold(0.0, f64::max)
        })
    };
    let (up, down) = (most(up), most(down));
    let resolution = found.resolution.map(|r| r * 1e6);
    let within = (0..2).all(|c| up[c].max(down[c]) <= resolution[c]);
    format!(
        "<p>{} values. Followed upward, the last section differs from that of a cold start by at most {} µm in x and {} µrad in β; downward, by {} µm \
         and {} µrad. The resolution is {} µm and {} µrad: {}</p>\n",
        cold.len(),
        shown(up[0]),
        shown(up[1]),
        shown(down[0]),
        shown(down[1]),
        shown(resolution[0]),
        shown(resolution[1]),
        if within {
            "there is no hysteresis."
        } else {
            "the branches are apart somewhere, by hysteresis or because a transient has not ended; the lower diagrams show where."
        }
    )
}

fn probe(found: &Findings) -> String {
    let data = found.cold(Series::Clearance);
    let [largest, rms] = ["probe_error_max_um", "probe_error_rms_um"].map(|name| data.values(name));
    let rows = 10.min(data.points.len());
    html(
        "Clearance (mm) .n | Largest error (µm) .n | Root mean square (µm) .n | Largest error / clearance .n",
        (0..rows).map(|n| {
            let k = n * (data.points.len() - 1) / (rows - 1).max(1);
            let clearance = data.points[k].value;
            vec![shown(clearance), shown(largest[k]), shown(rms[k]), significant(largest[k] / (clearance * 1e3), 3)]
        }),
    )
}

fn statement_table(statements: &[Statement]) -> String {
    html(
        "Place | Statement and criterion | Verdict .verdict",
        statements.iter().map(|s| {
            let class = if s.confirmed { "ok" } else { "off" };
            let (criterion, evidence) = words(s);
            vec![
                escape(&s.claim.place),
                format!(
                    "<b>{}.</b> Criterion: {}.<br><span class=\"evidence\">{}</span>",
                    escape(&typeset(&capital(&s.claim.says))),
                    escape(&typeset(&criterion)),
                    escape(&typeset(&evidence))
                ),
                format!("<span class=\"{class}\">{}</span>", text::verdict(s.confirmed)),
            ]
        }),
    )
}

fn provenance(report: &Report) -> Vec<(&'static str, String)> {
    let meta = meta(report);
    let mut gaps = ["version", "scene", "formulation", "method", "tolerance"]
        .map(|key| {
            let value = meta.get(key).cloned().unwrap_or_default();
            let word = value.as_str().map(str::to_owned);
            (key, word.unwrap_or_else(|| value.to_string()))
        })
        .to_vec();
    let e = &report.corrected.extent;
    gaps.extend([
        ("command", command(report).to_owned()),
        ("simulated", text::simulated(report).to_string()),
        ("duration", PAPER.period.to_string()),
        ("period", PAPER.period.to_string()),
    ]);
    let counts = [
        ("settle", e.settle),
        ("run_periods", e.runs.0),
        ("run_discard", e.runs.1),
        ("clearance_values", e.values[0]),
        ("friction_values", e.values[1]),
        ("sweep_periods", e.sweep.0),
        ("sweep_discard", e.sweep.1),
        ("map_frictions", e.map[0]),
        ("map_clearances", e.map[1]),
        ("map_periods", e.map_periods.0),
        ("map_discard", e.map_periods.1),
    ];
    gaps.extend(counts.map(|(gap, count)| (gap, count.to_string())));
    gaps
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::paper::{Claim, Test};
    use crate::analysis::reproduction::Grounds;

    #[test]
    fn words_stay_words() {
        let hostile = "<script>alert(1)</script> & <b>".to_owned();
        let claim = Claim {
            place: hostile.clone(),
            says: hostile.clone(),
            test: Test::Hardest { joint: 1, run: PAPER.runs[0] },
        };
        let statement = Statement {
            claim: Box::leak(Box::new(claim)),
            confirmed: true,
            grounds: Grounds::Joints(vec![(hostile, 1.0)]),
        };
        let out = statement_table(&[statement]);
        assert!(!out.contains("<script>") && !out.contains(" & "), "{out}");
        assert_eq!(out.matches("&lt;script&gt;").count(), 3, "{out}");
    }
}
