"""The page of the report: each figure of the paper beside its data, and every number and statement with its verdict."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from html import escape
from importlib import metadata, resources
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ._paper_figures import BRANCHES, write_figures
from ._paper_results import (
    COLUMNS,
    DERIVATIVES,
    FULL,
    JOINTS,
    NUMBERS,
    PAPER,
    PERIOD,
    QUANTITIES,
    SERIES,
    Findings,
    Published,
    Settled,
)
from ._paper_statements import Statement, statements

BADGES = {"agrees within 10 %": "ok", "within a factor of 2": "near", "differs": "off", "confirmed": "ok", "not confirmed": "off"}
"""Verdicts and their classes in the page."""
AGREEMENTS = tuple(BADGES)[:3]
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Comparison(NamedTuple):
    """A number of the paper beside that of this program."""

    published: Published
    """The paper's number."""
    full: float
    """This program's number in continuous time, SI."""
    sampled: float
    """What a solver with the paper's output step would report, SI; NaN where that step does not matter."""

    @property
    def agreement(self) -> str:
        """Agreement in continuous time: impacts are so short that samples catch their peaks only by chance."""
        return agreement(self.full / self.published.value)


def agreement(ratio: float) -> str:
    """Agreement of a number with the paper's, from their ratio."""
    return AGREEMENTS[0] if 0.9 <= ratio <= 1.1 else AGREEMENTS[1] if 0.5 <= ratio <= 2.0 else AGREEMENTS[2]


def comparisons(findings: Findings) -> list[Comparison]:
    """Every published number with this program's."""
    records = [(published, findings.runs[published.run]) for published in NUMBERS]
    return [Comparison(p, record.value(p.quantity), record.sampled(p.quantity)) for p, record in records]


def write_report(folder: Path, findings: Findings) -> tuple[list[Comparison], list[Statement]]:
    """Writes all files into `folder`, and returns what the page compares."""
    (folder / "data").mkdir()
    (folder / "plots").mkdir()
    compared, stated = comparisons(findings), statements(findings)
    write_data(folder / "data", findings, compared, stated)
    write_figures(folder / "plots", findings)
    (folder / "index.html").write_text(page(findings, compared, stated), encoding="utf-8")
    return compared, stated


# --- Data files ---


def write_table(path: Path, heads: Iterable[str], rows: Iterable[Iterable[Any]]) -> None:
    """Writes a CSV file, numbers with 12 digits and NaN as an empty cell."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(heads)
        for row in rows:
            cells = [f"{cell:.12g}" if isinstance(cell, float) else cell for cell in row]
            writer.writerow(["" if cell == "nan" else cell for cell in cells])


def write_data(folder: Path, findings: Findings, compared: list[Comparison], stated: list[Statement]) -> None:
    """Writes the comparison, the statements, the runs every 1 ms, the settled curves and the sweeps."""
    heads = ["figure", "clearance_mm", "friction", "quantity", "unit", "paper", "full", "sampled", "agreement"]
    rows = [
        [p.figure, *p.run, p.quantity, QUANTITIES[p.quantity][0], p.value, full, s, c.agreement]
        for c in compared
        for p, full, s in [c]
    ]
    write_table(folder / "numbers.csv", heads, rows)
    heads = ["place", "statement", "criterion", "verdict", "evidence"]
    write_table(
        folder / "statements.csv", heads, ([s.place, s.says, s.verdict.criterion, verdict(s), evidence(s)] for s in stated)
    )
    named = {f"response_c{run[0]:g}mm_cf{run[1]:g}": record for run, record in findings.runs.items()}
    for name, record in {**named, "lagrange": findings.lagrange, "ideal": findings.ideal}.items():
        columns = [record.time[:: record.stride], *(record.samples(column) for column in COLUMNS)]
        write_table(folder / f"{name}.csv", ["t_s", *COLUMNS], np.column_stack(columns).tolist())
    curves = [(run, record.settled) for run, record in findings.runs.items()]
    heads = ["clearance_mm", "friction", "phase", *next(settled.columns for _, settled in curves if settled)]
    write_table(
        folder / "settled_curves.csv", heads, (row for run, settled in curves if settled for row in curve_rows(run, settled))
    )
    for name, result in findings.results.items():
        [(key, values)] = result.axes.items()
        single, sections = ([column for column in result if result[column].ndim == n and column != key] for n in (1, 2))
        write_table(
            folder / f"{name}.csv", [key, *single], zip(values.tolist(), *(result[c].tolist() for c in single), strict=True)
        )
        places = [(k, n) for k in range(len(values)) for n in range(result[sections[0]].shape[1])]
        rows_of = ([float(values[k]), n, *(float(result[column][k, n]) for column in sections)] for k, n in places)
        write_table(folder / f"{name}_sections.csv", [key, "section", *sections], rows_of)


def curve_rows(run: tuple[float, float], settled: Settled) -> Iterable[list[float]]:
    """Rows of a settled curve, at equal phases of the drive."""
    values = np.column_stack(list(settled.columns.values())).tolist()
    return ([*run, n / (len(values) - 1), *row] for n, row in enumerate(values))


# --- The page ---


def number(value: float, digits: int = 4) -> str:
    """A number in print; a dash if there is none."""
    if not np.isfinite(value):
        return "–"
    text = f"{value:#.{digits}g}" if value == 0.0 or 1e-4 <= abs(value) < 1e6 else f"{value:.{digits - 1}e}"
    mantissa, _, power = text.rstrip(".").partition("e")
    return mantissa + "·10" + str(int(power)).translate(SUPERSCRIPTS) if power else mantissa


def verdict(statement: Statement) -> str:
    return "confirmed" if statement.verdict.confirmed else "not confirmed"


def evidence(statement: Statement) -> str:
    """The numbers behind a verdict."""
    readings = statement.verdict.evidence
    return ", ".join(f"{of}: {'none' if np.isnan(value) else f'{value:.7g} {unit}'.rstrip()}" for of, value, unit in readings)


def table(heads: str, rows: Iterable[Sequence[str]], title: str = "") -> str:
    """A table; heads are separated by bars, those of columns of numbers end in ` #`."""
    names = heads.split(" | ")
    classes = [' class="n"' if name.endswith(" #") else "" for name in names]

    def cell(tag: str, of_column: str, text: str) -> str:
        words = escape(text.replace("beta", "β"))
        return f"<{tag}{of_column}>" + (f'<span class="{BADGES[text]}">{words}</span>' if text in BADGES else words) + f"</{tag}>"

    def line(tag: str, cells: Sequence[str]) -> str:
        return "<tr>" + "".join(cell(tag, *pair) for pair in zip(classes, cells, strict=True)) + "</tr>\n"

    head = line("th", [name.removesuffix(" #") for name in names])
    caption = f"<p>{escape(title)}</p>\n" if title else ""
    body = "".join(line("td", row) for row in rows)
    return f'{caption}<div class="scroll"><table>\n<thead>{head}</thead>\n<tbody>\n{body}</tbody></table></div>\n'


def number_row(c: Comparison) -> list[str]:
    """A comparison as a row of the page."""
    p = c.published
    run, quantity = f"{p.run[0]:g} mm, {p.run[1]:g}", f"{p.quantity} ({QUANTITIES[p.quantity][0]})"
    ratios = [number(value / p.value, 2 if value < p.value else 3) for value in (c.full, c.sampled)]
    return [p.figure, run, quantity, number(p.value), number(c.full), ratios[0], number(c.sampled), ratios[1], c.agreement]


def tables_of(figure: dict[str, Any], findings: Findings, compared: list[Comparison]) -> Iterable[str]:
    """The tables that belong to a figure."""
    own = [c for c in compared if figure["name"] == f"figure-{int(c.published.figure.rstrip('abcdef')):02}"]
    heads = "Figure | Clearance, friction | Quantity | Paper # | Here # | Ratio # | At 1 ms # | Ratio # | Verdict"
    if own:
        yield table(heads, map(number_row, own))
    if figure.get("strongest-of"):
        yield strongest(figure["strongest-of"], compared)
    over: str = figure.get("with", {}).get("over", "")
    if figure["shows"] == "verification":
        yield verification(findings)
    elif figure["shows"] == "sections":
        yield sections(findings, over)
    elif figure["shows"] == "bifurcation":
        yield branches(findings, over)


def strongest(figures: list[str], compared: list[Comparison]) -> str:
    """The largest force of any joint, which depends less on which joint is hit first."""
    rows: list[list[str]] = []
    for figure in figures:
        own = [c for c in compared if c.published.figure == figure and "contact force" in c.published.quantity]
        paper, here = max(c.published.value for c in own), max(c.full for c in own)
        run = own[0].published.run
        rows.append(
            [figure, f"{run[0]:g} mm, {run[1]:g}", number(paper), number(here), f"{here / paper:.2f}", agreement(here / paper)]
        )
    heads = "Figure | Clearance, friction | Paper (N) # | Here (N) # | Ratio # | Verdict"
    return table(heads, rows, "The largest contact force of any joint, whichever it is:")


def verification(findings: Findings) -> str:
    """Peaks of Figure 17, and of the contact forces, in both formulations."""
    records = [next(iter(findings.runs.values())), findings.lagrange]
    forces = [("", f"largest contact force in {joint}", np.nan, np.nan) for joint in JOINTS]
    peaks: list[tuple[str, str, float, float]] = [*PAPER["verification"], *forces]
    rows: list[list[str]] = []
    for figure, quantity, own, commercial in peaks:
        ours = [value for record in records for value in (record.value(quantity), record.sampled(quantity))]
        rows.append([figure, f"{quantity} ({QUANTITIES[quantity][0]})", *map(number, [own, commercial, *ours])])
    heads = "Figure | Quantity | Paper, own # | Paper, commercial # | Tree # | Tree at 1 ms # | Lagrange # | Lagrange at 1 ms #"
    title = (
        "The paper does not name the run of this figure. Its peaks, beside those of both formulations at 0.3 mm and friction 0.2:"
    )
    return table(heads, rows, title)


def sections(findings: Findings, over: str) -> str:
    """Regime, exponent and sections of three runs."""
    points = findings.points[f"runs_by_{over}"]
    rows: list[list[str]] = []
    for k, run in enumerate(SERIES[over].runs):
        row = [SERIES[over].name(run), points.regimes[k], f"{number(points.exponents[k])} ± {number(points.errors[k], 2)}"]
        for coordinate in DERIVATIVES:
            row += [f"{points.latest(coordinate)[k] * 1e3:.4f}", number(points.spread(coordinate)[k] * 1e6, 2)]
        rows.append(row)
    return table("Run | Regime | Exponent (1/s) # | x (mm) # | Spread of x (µm) # | β (mrad) # | Spread of β (µrad) #", rows)


def branches(findings: Findings, over: str) -> str:
    """Largest distance of each followed branch from the cold starts."""
    cold = findings.points[f"{over}_cold"]
    rows: list[list[str]] = []
    for branch in ("up", "down"):
        other = findings.points[f"{over}_{branch}"]
        most = {c: float(np.abs(cold.latest(c) - other.latest(c)).max()) for c in DERIVATIVES}
        within = all(most[c] <= findings.resolution[c] for c in DERIVATIVES)
        values = [number(size * 1e6) for size in most.values()]
        rows.append([BRANCHES[branch], str(len(cold.values)), *values, "no" if within else "yes"])
    rows.append(["resolution", "", *(number(size * 1e6) for size in findings.resolution.values()), ""])
    heads = "Branch | Values # | Distance from the cold start in x (µm) # | In β (µrad) # | Hysteresis, or a transient"
    return table(heads, rows)


def provenance(findings: Findings) -> str:
    """What was computed."""
    e, scene = findings.extent, next(iter(findings.results.values())).sweep.scene
    length = {name: e.runs if name.startswith("runs") else e.sweep for name in findings.results}
    periods = sum(result.sweep.points * length[name][0] for name, result in findings.results.items())
    periods += len(findings.runs) * (1 + e.settle + 2) + 2

    def of(run: tuple[int, int]) -> str:
        return f"{run[0]} periods each, {run[1]} of them discarded"

    rows = [
        ("Command", "python -m jointplay paper --out paper" + ("" if e == FULL else " --quick")),
        ("Version", f"jointplay {metadata.version('jointplay')}"),
        ("Scene", scene.name),
        ("Formulation, unless stated otherwise", scene.parameter("formulation").text),
        ("Method, tolerance", f"{scene.parameter('solver.method').text}, {scene.parameter('solver.tolerance').text}"),
        ("Simulated altogether, without twins", f"{periods * PERIOD:g} s"),
        ("A period, and each run of section 4.2", f"{PERIOD:g} s"),
        ("Rows of a run", f"every {PAPER['sampling'] / e.rows * 1e6:g} µs"),
        ("Settled curves", f"after {e.settle} periods"),
        ("Runs of Figures 19 and 22", of(e.runs)),
        ("Sweeps, in three ways", f"{e.values[0]} clearances, {e.values[1]} frictions; {of(e.sweep)}"),
    ]
    return table("What | Value", rows)


def page(findings: Findings, compared: list[Comparison], stated: list[Statement]) -> str:
    """The whole page."""
    counts = [sum(c.agreement == word for c in compared) for word in AGREEMENTS]
    confirmed = sum(s.verdict.confirmed for s in stated)
    contents: list[str] = []
    body: list[str] = []
    for section in PAPER["section"]:
        entries = [f'<li><a href="#{row["name"]}">{escape(row["heading"])}</a></li>' for row in section["figure"]]
        contents.append(f'<li><a href="#{section["id"]}">{escape(section["title"])}</a><ol>{"".join(entries)}</ol></li>')
        body.append(f'<h2 id="{section["id"]}">{escape(section["title"])}</h2>')
        for row in section["figure"]:
            name, heading = row["name"], escape(row["heading"])
            picture = f'<a href="plots/{name}.png"><img src="plots/{name}.png" alt="{heading}" loading="lazy"></a>'
            body.append(
                f'<h3 id="{name}">{heading}</h3>\n<figure>{picture}<figcaption>{escape(row["caption"])}</figcaption></figure>'
            )
            body.extend(tables_of(row, findings, compared))
    rows = [[s.place, s.says, s.verdict.criterion, verdict(s), evidence(s)] for s in stated]
    gaps = {
        "NOTICE": "" if findings.extent == FULL else SHORTENED,
        "CARDS": "".join(
            f'<div class="card"><b>{value}</b><span>{text}</span></div>'
            for value, text in [
                (f"{counts[0]} of {len(compared)}", "printed numbers agree within 10 %"),
                (counts[1], "more lie within a factor of 2"),
                (counts[2], "differ by more"),
                (f"{confirmed} of {len(stated)}", "statements confirmed"),
            ]
        ),
        "CONTENTS": "\n".join(contents),
        "FIGURES": "\n".join(body),
        "STATEMENTS": table("Place | Statement | Criterion | Verdict | Evidence", rows),
        "PROVENANCE": provenance(findings),
    }
    text = resources.files("jointplay").joinpath("paper.html").read_text(encoding="utf-8")
    for gap, content in gaps.items():
        text = text.replace("{" + gap + "}", content)
    return text


SHORTENED = """<p class="notice">This is a quick report: few values and few periods, which shows that everything works.
Transients have not ended everywhere, so regimes, sections and diagrams may differ from those of the whole report, which
<code>python -m jointplay paper --out paper</code> computes.</p>
"""
