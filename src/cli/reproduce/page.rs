//! The page: each figure of the paper beside what this program gets. One file, nothing from the network.

use std::fmt::Write as _;

use super::figures::picture_name;
use super::html::{CLOSE, NONE, escape, number, open, shown};
use super::sections::{Entry, SECTIONS};
use super::text::{self, Compared, typeset};
use super::{command, meta, scatter};
use crate::analysis::paper::chaos::word;
use crate::analysis::paper::{Agreement, Quantity, Statement, VERIFICATION, Verdict};
use crate::analysis::reproduction::{CORRECTED, Extent, Findings, PERIOD, Report, Variant};
use crate::cli::output::significant;

const STYLE: &str = include_str!("page.css");

/// Stands above a report that is not the whole one.
const SHORTENED: &str = "<p class=\"notice\">This is a quick report: few values and few periods, which shows that everything works. \
    Transients have not ended everywhere, so regimes, sections and diagrams may differ from those of the whole report, which \
    <code>jointplay reproduce --out report/</code> computes.</p>\n";

/// The whole page.
pub(super) fn page(report: &Report, pictures: &[(String, String)]) -> String {
    let found = &report.corrected;
    let compared = text::compared(found);
    let statements = found.statements();
    let mut out = String::with_capacity(1 << 20);
    // Writing to a String cannot fail.
    let _ = write!(
        out,
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>Section 4 of Sheng &amp; Chen, reproduced</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n"
    );
    header(&mut out, &compared, &statements);
    out.push_str("<main>\n");
    if found.extent != Extent::FULL {
        out.push_str(SHORTENED);
    }
    contents(&mut out);
    caveats(&mut out);
    figures(&mut out, found, pictures);
    scatter::section(&mut out, report);
    let _ = writeln!(
        out,
        "<h2 id=\"printed\">The same figures with equation (13) as printed</h2>"
    );
    figures(&mut out, &report.printed, pictures);
    statement_table(&mut out, &statements);
    provenance(&mut out, report);
    out.push_str("</main>\n</body>\n</html>\n");
    out
}

/// Every figure of a model, section by section, with the tables that belong to it.
fn figures(out: &mut String, found: &Findings, pictures: &[(String, String)]) {
    let compared = text::compared(found);
    let (level, of) = if found.variant == CORRECTED {
        (2, "")
    } else {
        (3, ", (13) as printed")
    };
    for (id, title, entries) in SECTIONS {
        let id = picture_name(found.variant, id);
        let _ = writeln!(out, "<h{level} id=\"{id}\">{title}{of}</h{level}>");
        for entry in entries {
            figure(out, entry, found.variant, pictures);
            after(out, entry, &compared, found);
        }
    }
}

fn header(out: &mut String, compared: &[Compared], statements: &[Statement]) {
    let with = |word: &str| {
        compared
            .iter()
            .filter(|c| c.agreement.starts_with(word))
            .count()
    };
    let confirmed = statements
        .iter()
        .filter(|s| s.verdict == Verdict::Confirmed)
        .count();
    let _ = write!(
        out,
        "<header>\n<h1>Clearance in a parallel measuring machine: section 4, reproduced</h1>\n\
         <p class=\"lead\">Every figure and number of section 4 of Sheng &amp; Chen's study of a spatial parallel coordinate measuring \
         machine with clearance in its ball joints, beside what Jointplay computes for the same. \
         Where they disagree, the page says so.</p>\n\
         <div class=\"cards\">\n\
         <div class=\"card\"><b>{} of {}</b><span>printed numbers agree within 10 %</span></div>\n\
         <div class=\"card\"><b>{}</b><span>more lie within a factor of 2</span></div>\n\
         <div class=\"card\"><b>{}</b><span>differ by more</span></div>\n\
         <div class=\"card\"><b>{confirmed} of {}</b><span>qualitative statements confirmed</span></div>\n\
         </div>\n</header>\n",
        with("agrees"),
        compared.len(),
        with("within"),
        with("differs"),
        statements.len()
    );
}

fn contents(out: &mut String) {
    out.push_str("<nav aria-label=\"Contents\"><ol>\n<li><a href=\"#caveats\">What a comparison can mean</a></li>\n");
    for (id, title, entries) in SECTIONS {
        let _ = writeln!(out, "<li><a href=\"#{id}\">{title}</a><ol>");
        for (_, name, heading, _) in entries {
            let _ = writeln!(out, "<li><a href=\"#{name}\">{heading}</a></li>");
        }
        out.push_str("</ol></li>\n");
    }
    out.push_str(
        "<li><a href=\"#scatter\">The scatter: is it equation (13) as printed?</a></li>\n<li><a href=\"#printed\">The same figures with equation (13) as \
         printed</a></li>\n<li><a href=\"#statements\">Statements, one by one</a></li>\n<li><a href=\"#provenance\">How this was made</a></li>\n</ol></nav>\n",
    );
}

fn caveats(out: &mut String) {
    out.push_str(
        "<h2 id=\"caveats\">What a comparison can mean</h2>\n\
         <ul>\n\
         <li>The paper does not print one dimension of the mechanism, a<sub>1</sub>, the distance of the sliders' plane from the origin. \
         The value used here, 32 mm, keeps the prescribed trajectory within reach all period long, and among such \
         values brings peak velocity and peak force nearest to the printed ones: it is the only number chosen with an eye on the results. Orders of magnitude and trends can be expected to agree, \
         last digits cannot.</li>\n\
         <li>It contradicts itself: Figures 8 and 15 are the same run (0.3 mm, friction 0.2) with different peaks, and so are Figures 5b and 11b, \
         6 and 12 for that run. Where the paper has two values no program can match both; both are compared.</li>\n\
         <li>For Figure 13a the text says that peaks rise with friction; the numbers beside it fall.</li>\n\
         <li>The text about Figures 19 and 22 calls the same motions quasi-periodic that it calls periodic at Figures 18, 20 and 23.</li>\n\
         <li>Its runs are reported every 1 ms; an impact is much shorter. Peaks are therefore given twice: in continuous time, and at whole \
         milliseconds alone, as a solver with that output step would report them. Accelerations and forces of the second kind are a matter of chance, so \
         verdicts go by continuous time: <span class=\"ok\">agrees within 10 %</span>, <span class=\"near\">within a factor of 2</span>, \
         <span class=\"off\">differs</span>.</li>\n\
         </ul>\n",
    );
}

fn figure(
    out: &mut String,
    (_, name, heading, caption): &Entry,
    variant: Variant,
    pictures: &[(String, String)],
) {
    let name = &picture_name(variant, name);
    let svg = pictures
        .iter()
        .find(|(of, _)| of == name)
        .map_or("", |(_, svg)| svg);
    // The height follows the width of the page.
    let svg = svg.replacen(
        "<svg ",
        &format!("<svg role=\"img\" aria-label=\"{heading}\" "),
        1,
    );
    let _ = write!(
        out,
        "<h3 id=\"{name}\">{heading}</h3>\n<figure>\n<div class=\"plot\">{}</div>\n<figcaption>{caption} <a href=\"plots/{name}.svg\">SVG</a>, \
         <a href=\"plots/{name}.png\">PNG</a>.</figcaption>\n</figure>\n",
        svg.trim()
    );
}

fn badge(agreement: &str) -> String {
    let class = match agreement {
        word if word.starts_with("agrees") => "ok",
        word if word.starts_with("within") => "near",
        _ => "off",
    };
    format!("<span class=\"{class}\">{agreement}</span>")
}

/// Two decimals, and two digits of what is small.
fn ratio(value: f64) -> String {
    if value < 0.1 {
        typeset(&significant(value, 2))
    } else {
        format!("{value:.2}")
    }
}

fn optional(value: Option<f64>) -> String {
    value.map_or_else(|| NONE.to_owned(), shown)
}

/// The tables that belong to a figure.
fn after(out: &mut String, entry: &Entry, compared: &[Compared], found: &Findings) {
    let (number, name, ..) = *entry;
    let own = |c: &&Compared| {
        !number.is_empty() && c.figure.trim_end_matches(char::is_alphabetic) == number
    };
    let rows: Vec<&Compared> = compared.iter().filter(own).collect();
    if !rows.is_empty() {
        table_of(out, &rows);
    }
    match name {
        "figure-17" => verification(out, found),
        "figure-17-drift" => drift(out, found),
        "figure-19" => runs(out, found, 0),
        "figure-22" => runs(out, found, 1),
        "figure-20" => branches(out, found, 0),
        "figure-23" => branches(out, found, 1),
        "figure-10" => strongest(out, compared, &["8", "9", "10"]),
        "figure-16" => strongest(out, compared, &["14", "15", "16"]),
        "probe" => probe(out, found),
        _ => {}
    }
}

fn table_of(out: &mut String, rows: &[&Compared]) {
    open(
        out,
        &[
            ("Figure", false),
            ("Clearance, friction", false),
            ("Quantity", false),
            ("Paper", true),
            ("Here", true),
            ("Ratio", true),
            ("At 1 ms", true),
            ("Ratio", true),
            ("Verdict", false),
        ],
    );
    for c in rows {
        let unit = format!("{} ({})", c.what, c.unit);
        let run = format!("{} mm, {}", c.case.clearance, c.case.friction);
        let sampled_ratio = c
            .sampled
            .map_or_else(|| NONE.to_owned(), |s| ratio(s / c.paper));
        let _ = writeln!(
            out,
            "<tr><td>{}</td><td class=\"run\">{run}</td><td class=\"what\">{}</td>{}{}{}{}{}<td class=\"verdict\">{}</td></tr>",
            c.figure,
            typeset(&unit),
            number(&shown(c.paper)),
            number(&shown(c.full)),
            number(&ratio(c.full / c.paper)),
            number(&optional(c.sampled)),
            number(&sampled_ratio),
            badge(c.agreement)
        );
    }
    out.push_str(CLOSE);
}

/// The largest force of any joint, which depends less on which joint happens to be hit first.
fn strongest(out: &mut String, compared: &[Compared], figures: &[&str]) {
    out.push_str("<p>The largest contact force of any joint, whichever it is:</p>\n");
    open(
        out,
        &[
            ("Figure", false),
            ("Clearance, friction", false),
            ("Paper (N)", true),
            ("Here (N)", true),
            ("Ratio", true),
            ("Verdict", false),
        ],
    );
    for figure in figures {
        let own = || {
            compared
                .iter()
                .filter(|c| c.figure == *figure && c.unit == "N")
        };
        let Some(first) = own().next() else {
            continue;
        };
        let paper = own().map(|c| c.paper).fold(0.0, f64::max);
        let here = own().map(|c| c.full).fold(0.0, f64::max);
        let _ = writeln!(
            out,
            "<tr><td>{figure}</td><td class=\"run\">{} mm, {}</td>{}{}{}<td class=\"verdict\">{}</td></tr>",
            first.case.clearance,
            first.case.friction,
            number(&shown(paper)),
            number(&shown(here)),
            number(&ratio(here / paper)),
            badge(Agreement::of(here / paper).word())
        );
    }
    out.push_str(CLOSE);
}

fn verification(out: &mut String, found: &Findings) {
    out.push_str("<p>The paper does not name the run of this figure. Its peaks, beside those of both formulations at 0.3 mm and friction 0.2:</p>\n");
    open(
        out,
        &[
            ("Figure", false),
            ("Quantity", false),
            ("Paper, own", true),
            ("Paper, commercial", true),
            ("Tree", true),
            ("Tree at 1 ms", true),
            ("Lagrange", true),
            ("Lagrange at 1 ms", true),
        ],
    );
    let two = |q: Quantity, run: &crate::analysis::response::Response| {
        let (full, sampled) = q.of(run);
        format!("{}{}", number(&shown(full)), number(&optional(sampled)))
    };
    for (figure, quantity, own, other) in VERIFICATION {
        let (what, unit) = quantity.label();
        let _ = writeln!(
            out,
            "<tr><td>{figure}</td><td class=\"what\">{} ({unit})</td>{}{}{}{}</tr>",
            typeset(&what),
            number(&shown(own)),
            number(&shown(other)),
            two(quantity, &found.runs[0].response),
            two(quantity, &found.lagrange.response)
        );
    }
    for joint in 0..3 {
        let (what, unit) = Quantity::Normal(joint).label();
        let none = number(NONE);
        let _ = writeln!(
            out,
            "<tr><td></td><td class=\"what\">{what} ({unit})</td>{none}{none}{}{}</tr>",
            two(Quantity::Normal(joint), &found.runs[0].response),
            two(Quantity::Normal(joint), &found.lagrange.response)
        );
    }
    out.push_str(CLOSE);
}

fn drift(out: &mut String, found: &Findings) {
    let [x, beta] = found.formulations_apart();
    let _ = writeln!(
        out,
        "<p>The formulations differ by at most {} µm in x and {} µrad in β. The largest violation of a constraint of the lagrange form is {} µm \
         (µrad for directions); the tree form has none by construction, but for its loops, which are closed at every step.</p>",
        shown(x * 1e6),
        shown(beta * 1e6),
        shown(found.lagrange.response.constraint_drift * 1e6)
    );
}

fn runs(out: &mut String, found: &Findings, which: usize) {
    let chaos = found.chaos();
    open(
        out,
        &[
            (["Clearance (mm)", "Friction"][which], true),
            ("Regime", false),
            ("Exponent (1/s)", true),
            ("x (mm)", true),
            ("Spread of x (µm)", true),
            ("β (mrad)", true),
            ("Spread of β (µrad)", true),
        ],
    );
    for run in &chaos.runs[which] {
        let _ = writeln!(
            out,
            "<tr>{}<td>{}</td>{}{}{}{}{}</tr>",
            number(&shown(run.value)),
            word(run),
            number(&format!(
                "{} ± {}",
                shown(run.exponent.0),
                typeset(&significant(run.exponent.1, 2))
            )),
            number(&format!("{:.4}", run.latest(0) * 1e3)),
            number(&typeset(&significant(run.spread(0) * 1e6, 2))),
            number(&typeset(&format!("{:.4}", run.latest(1) * 1e3))),
            number(&typeset(&significant(run.spread(1) * 1e6, 2)))
        );
    }
    out.push_str(CLOSE);
}

fn branches(out: &mut String, found: &Findings, which: usize) {
    let names = [
        ["clearance_cold", "clearance_up", "clearance_down"],
        ["friction_cold", "friction_up", "friction_down"],
    ][which];
    let all = names.map(|name| found.sweep_data(name).swept(1.0));
    let most = |other: usize, c: usize| {
        let pairs = all[0].iter().zip(&all[other]);
        pairs
            .map(|(a, b)| (a.latest(c) - b.latest(c)).abs() * 1e6)
            .fold(0.0, f64::max)
    };
    let (up, down) = ([most(1, 0), most(1, 1)], [most(2, 0), most(2, 1)]);
    let within = (0..2).all(|c| up[c].max(down[c]) <= found.resolution[c] * 1e6);
    let _ = writeln!(
        out,
        "<p>{} values. Followed upward, the last section differs from that of a cold start by at most {} µm in x and {} µrad in β; downward, by {} µm \
         and {} µrad. The resolution is {} µm and {} µrad: {}</p>",
        all[0].len(),
        shown(up[0]),
        shown(up[1]),
        shown(down[0]),
        shown(down[1]),
        shown(found.resolution[0] * 1e6),
        shown(found.resolution[1] * 1e6),
        if within {
            "there is no hysteresis."
        } else {
            "the branches are apart somewhere, by hysteresis or because a transient has not ended; the lower diagrams show where."
        }
    );
}

fn probe(out: &mut String, found: &Findings) {
    let data = found.sweep_data("clearance_cold");
    let (largest, rms) = (
        data.values("probe_error_max_um"),
        data.values("probe_error_rms_um"),
    );
    let points = data.swept(1e3);
    open(
        out,
        &[
            ("Clearance (mm)", true),
            ("Largest error (µm)", true),
            ("Root mean square (µm)", true),
            ("Largest error / clearance", true),
        ],
    );
    let rows = 10.min(points.len());
    for n in 0..rows {
        let k = n * (points.len() - 1) / (rows - 1).max(1);
        let _ = writeln!(
            out,
            "<tr>{}{}{}{}</tr>",
            number(&shown(points[k].value)),
            number(&shown(largest[k])),
            number(&shown(rms[k])),
            number(&significant(largest[k] / (points[k].value * 1e3), 3))
        );
    }
    out.push_str(CLOSE);
}

fn statement_table(out: &mut String, statements: &[Statement]) {
    out.push_str("<h2 id=\"statements\">Statements, one by one</h2>\n<p>What the paper says in words, with the criterion that it is held against here and the numbers behind the verdict.</p>\n");
    open(
        out,
        &[
            ("Place", false),
            ("Statement and criterion", false),
            ("Verdict", false),
        ],
    );
    for s in statements {
        let class = if s.verdict == Verdict::Confirmed {
            "ok"
        } else {
            "off"
        };
        let _ = writeln!(
            out,
            "<tr><td>{}</td><td><b>{}.</b> Criterion: {}.<br><span class=\"evidence\">{}</span></td><td class=\"verdict\"><span class=\"{class}\">{}</span></td></tr>",
            escape(&s.place),
            escape(&typeset(&capital(&s.says))),
            escape(&typeset(&s.criterion)),
            escape(&typeset(&s.evidence)),
            text::verdict(s.verdict)
        );
    }
    out.push_str(CLOSE);
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    // Names of coordinates stay as they are.
    match letters.next() {
        Some(first) if !text.starts_with("x ") && !text.starts_with("beta ") => {
            first.to_uppercase().chain(letters).collect()
        }
        _ => text.to_owned(),
    }
}

fn provenance(out: &mut String, report: &Report) {
    let meta = meta(report);
    let value = |key: &str| {
        let value = meta.get(key).cloned().unwrap_or_default();
        value
            .as_str()
            .map_or_else(|| value.to_string(), str::to_owned)
    };
    let e = &report.corrected.extent;
    let _ = write!(
        out,
        "<h2 id=\"provenance\">How this was made</h2>\n<pre>{}</pre>\n\
         <p>Jointplay {}, scene <code>{}</code>, {} formulation but where another is named, method {} at a tolerance of {}. {} simulated seconds \
         altogether: the paper's runs over {} s; settled curves after {} periods; {} periods of each run of Figures 19 and 22, {} of them discarded; {} \
         clearances and {} frictions in three ways, {} periods each, {} discarded; a map of {} by {} points, {} periods each, {} discarded; all that twice, with \
         <code>contact.friction_velocity=printed</code> the second time. A period takes {} s.</p>\n\
         <p>The same program gives the same bytes on any number of threads. All numbers of this page are in <code>data/</code>: \
         <a href=\"data/numbers.csv\">the comparison</a>, <a href=\"data/statements.csv\">the statements</a>, the runs (every 1 ms as CSV, at every \
         instant that was looked at as NumPy archives), and the sweeps with all sections, in the form that <code>jointplay sweep</code> writes.</p>\n\
         <p>The paper: Y. Sheng and X. Chen on the dynamics and chaos of a spatial parallel coordinate measuring mechanism with several spherical \
         clearance joints. Captions and statements are in words of our own.</p>\n",
        command(report),
        value("version"),
        value("scene"),
        value("formulation"),
        value("method"),
        value("tolerance"),
        text::simulated(report),
        crate::analysis::paper::DURATION,
        e.settle,
        e.runs.0,
        e.runs.1,
        e.values[0],
        e.values[1],
        e.sweep.0,
        e.sweep.1,
        e.map[0],
        e.map[1],
        e.map_periods.0,
        e.map_periods.1,
        PERIOD
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_stay_words() {
        let hostile = "<script>alert(1)</script> & <b>".to_owned();
        let statement = Statement {
            place: hostile.clone().into(),
            says: hostile.clone(),
            criterion: hostile.clone(),
            verdict: Verdict::Confirmed,
            evidence: hostile,
        };
        let mut out = String::new();
        statement_table(&mut out, &[statement]);
        assert!(!out.contains("<script>") && !out.contains(" & "), "{out}");
        assert_eq!(out.matches("&lt;script&gt;").count(), 4, "{out}");
    }
}
