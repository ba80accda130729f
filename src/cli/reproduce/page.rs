//! The page: each figure of the paper beside this program's. One file, nothing from the network.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::figures::picture_name;
use super::meta;
use super::results;
use crate::analysis::paper::{Figure, PAPER, Section};
use crate::analysis::reproduction::{Extent, Findings, Report};
use crate::cli::tables::{Table, fill};

/// Shown above a shortened report.
const SHORTENED: &str = "<p class=\"notice\">This is a quick report: few values and few periods, which shows that everything works. \
    Transients have not ended everywhere, so regimes, sections and diagrams may differ from those of the whole report, which \
    <code>jointplay reproduce --out report/</code> computes.</p>\n";

/// SVG by the name of the picture.
pub(super) type Pictures = BTreeMap<String, String>;

/// The whole page.
pub(super) fn page(report: &Report, pictures: &Pictures) -> String {
    let [corrected, printed] = report.complete();
    let [agree, near, differ, confirmed, stated] = results::score(corrected);
    let notice = if report.extent == Extent::FULL { "" } else { SHORTENED };
    let statements = "Place | Statement | Criterion | Verdict .verdict | Evidence .evidence";
    let gaps = [
        ("style", include_str!("page.css").to_owned()),
        ("notice", notice.to_owned()),
        ("contents", contents()),
        ("agree", agree.to_string()),
        ("near", near.to_string()),
        ("differ", differ.to_string()),
        ("numbers", (agree + near + differ).to_string()),
        ("confirmed", confirmed.to_string()),
        ("stated", stated.to_string()),
        ("figures", figures(corrected, pictures, "h2", "")),
        ("clearances", results::by_clearance(report).html()),
        ("sweeps", results::sweeps(report).html()),
        ("changed_verdicts", results::changed_verdicts(report).html()),
        ("models", results::models(report).html()),
        ("printed_figures", figures(printed, pictures, "h3", ", (13) as printed")),
        ("statements", results::statements(statements, corrected).html()),
        ("provenance", provenance(report).html()),
    ];
    fill(include_str!("page.html"), &gaps)
}

fn contents() -> String {
    let mut out = String::new();
    for Section { id, title, figures } in &PAPER.sections {
        let entry = |figure: &Figure| format!("<li><a href=\"#{}\">{}</a></li>\n", figure.name, figure.heading);
        let entries: String = figures.iter().map(entry).collect();
        // Writing to a String cannot fail.
        let _ = writeln!(out, "<li><a href=\"#{id}\">{title}</a><ol>\n{entries}</ol></li>");
    }
    out
}

/// Every figure of a model, section by section, with the tables that belong to it.
fn figures(findings: &Findings, pictures: &Pictures, tag: &str, of: &str) -> String {
    let comparisons = findings.comparisons();
    let mut out = String::new();
    for section in &PAPER.sections {
        let (id, title) = (picture_name(findings.variant, &section.id), &section.title);
        let _ = writeln!(out, "<{tag} id=\"{id}\">{title}{of}</{tag}>");
        for figure in &section.figures {
            let Figure { heading, caption, .. } = figure;
            let name = picture_name(findings.variant, &figure.name);
            // The height follows the width of the page.
            let svg = pictures[&name].replacen("<svg ", &format!("<svg role=\"img\" aria-label=\"{heading}\" "), 1);
            let _ = writeln!(
                out,
                "<h3 id=\"{name}\">{heading}</h3>\n<figure>\n<div class=\"plot\">{}</div>\n<figcaption>{caption} \
                 <a href=\"plots/{name}.svg\">SVG</a>, <a href=\"plots/{name}.png\">PNG</a>.</figcaption>\n</figure>",
                svg.trim()
            );
            out.extend(results::of_figure(figure, &comparisons, findings).iter().map(Table::html));
        }
    }
    out
}

fn provenance(report: &Report) -> Table {
    let meta = meta(report);
    let of_meta = |key: &str| {
        let value = meta.get(key).cloned().unwrap_or_default();
        value.as_str().map_or_else(|| value.to_string(), str::to_owned)
    };
    let e = &report.extent;
    let periods = |(all, discarded): (usize, usize)| format!("{all} periods each, {discarded} of them discarded");
    let rows = [
        ("Command", of_meta("command")),
        ("Version", of_meta("version")),
        ("Scene", of_meta("scene")),
        ("Formulation, unless stated otherwise", of_meta("formulation")),
        ("Method", of_meta("method")),
        ("Tolerance", of_meta("tolerance")),
        ("Simulated altogether", format!("{} s", report.simulated())),
        ("A period, and each run of section 4.2", format!("{} s", PAPER.period)),
        ("Settled curves", format!("after {} periods", e.settle)),
        ("Runs of Figures 19 and 22", periods(e.runs)),
        (
            "Sweeps, in three ways",
            format!("{} clearances, {} frictions; {}", e.values[0], e.values[1], periods(e.sweep)),
        ),
        ("Map", format!("{} frictions by {} clearances; {}", e.map[0], e.map[1], periods(e.map_periods))),
    ];
    Table::new("What | Value", rows.map(|(what, value)| vec![what.to_owned(), value]))
}
