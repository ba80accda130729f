"""The figures of the paper and the additional ones."""

# Most of Matplotlib's methods take named arguments that have no types.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ._paper_results import COLUMNS, DERIVATIVES, JOINTS, NUMBERS, PAPER, PERIOD, QUANTITIES, SERIES, Case, Findings, Record

COLOURS = ("#0072b2", "#d55e00", "#009e73")
"""Of the three runs, joints or formulations; distinct for the colour-blind (Okabe and Ito)."""
INK = "#222222"
PAPERS = "#cc3311"
"""Of the paper's numbers, and of limits."""
EARLY = 0.15
"""Length of the initial part of a run in which the balls bounce, s."""
EARLIEST = 0.1
"""Length of the comparison of formulations, s."""
MIN_EXPONENT = -10.0
"""Smallest exponent drawn, 1/s: those of the smallest clearances would squeeze all others against 0."""
STYLE: Any = {
    "font.size": 9,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 9,
    "legend.fontsize": 8,
    "legend.edgecolor": "none",
    "legend.framealpha": 0.85,
    "axes.formatter.useoffset": False,
    "lines.linewidth": 1.0,
}


def write_figures(folder: Path, findings: Findings) -> None:
    """Writes every figure, in the order of the page."""
    for section in PAPER["section"]:
        for row in section["figure"]:
            with mpl.rc_context(STYLE):
                figure = FIGURES[row["shows"]](findings, **row.get("with", {}))
                figure.savefig(folder / f"{row['name']}.png", dpi=150)


def sheet(rows: int, columns: int) -> tuple[Figure, list[list[Axes]]]:
    """A figure with `rows` by `columns` diagrams."""
    figure = Figure(figsize=(10.5, 2.75 * rows), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False)
    return figure, [list(row) for row in axes]


def label_of(column: str) -> str:
    """Label of an axis; names of coordinates keep their case."""
    label, unit, _, _ = COLUMNS[column]
    return f"{label if label[1:2] in ('', ' ') else label[0].upper() + label[1:]} ({unit})"


def curve(axes: Axes, record: Record, column: str, end: float, colour: str, label: str, **style: Any) -> None:
    """A column over the first `end` seconds; of each of 1500 intervals the smallest and the largest value, to lose no peak."""
    rows = int(np.searchsorted(record.time, end * (1.0 + 1e-9), side="right"))
    values = record.columns[column][:rows] / COLUMNS[column].size
    length = max(rows // 1500, 1)
    bins = values[: rows // length * length].reshape(-1, length)
    first = np.arange(len(bins)) * length
    kept = np.unique(np.concatenate([first + bins.argmin(axis=1), first + bins.argmax(axis=1), [0, rows - 1]]))
    axes.plot(record.time[kept], values[kept], color=colour, label=label, **style)
    axes.set(xlim=(0.0, end), xlabel="Time (s)", ylabel=label_of(column))


def peaks(
    axes: Axes, places: Sequence[float], here: Sequence[float], at_step: Sequence[float], paper: Sequence[list[float]]
) -> None:
    """Peaks of three runs or joints: here, at the paper's output step, and as the paper prints them."""
    printed = [(place, value) for place, values in zip(places, paper, strict=True) for value in values]
    if printed:
        axes.plot(*zip(*printed, strict=True), "D", color=PAPERS, mfc="none", mew=1.4, ms=8, label="paper")
    axes.plot(places, here, "o", color=INK, ms=5, label="here")
    axes.plot(places, at_step, "_", color=INK, ms=11, label="here, every 1 ms")
    axes.set_ylim(0.0, 1.25 * max([*here, *(value for _, value in printed)]))
    low, high = min(places), max(places)
    axes.set_xlim(low - 0.25 * (high - low), high + 0.25 * (high - low))
    axes.set_xticks(list(places))
    axes.legend(loc="upper center", ncols=3, columnspacing=1.0, handletextpad=0.2)


def published(quantity: str, run: Case, figure: str) -> list[float]:
    """What the paper prints for a quantity in a figure such as `6`, SI."""
    return [n.value for n in NUMBERS if (n.quantity, n.run, n.figure.rstrip("abcdef")) == (quantity, run, figure)]


def response(findings: Findings, over: str, columns: list[str], early: list[str], number: str) -> Figure:
    """Two columns of three runs: over one period, while the balls bounce, and their peaks beside the paper's."""
    figure, axes = sheet(2, 3)
    series = SERIES[over]
    for row, whole, first in zip(axes, columns, early, strict=True):
        for run, colour in zip(series.runs, COLOURS, strict=True):
            curve(row[0], findings.runs[run], whole, PERIOD, colour, series.name(run))
            curve(row[1], findings.runs[run], first, EARLY, colour, series.name(run))
        row[0].set_title("One period")
        row[1].set_title("While the balls bounce")
        row[1].legend()
        quantity, size = next(name for name, (_, column) in QUANTITIES.items() if column == first), COLUMNS[first].size
        records = [findings.runs[run] for run in series.runs]
        here, at_step = [r.value(quantity) / size for r in records], [r.sampled(quantity) / size for r in records]
        paper = [[value / size for value in published(quantity, run, number)] for run in series.runs]
        peaks(row[2], [series.of(run) for run in series.runs], here, at_step, paper)
        row[2].set(title="Largest magnitude", xlabel=parameter(over), ylabel=label_of(first))
    return figure


def forces(findings: Findings, run: list[float], number: str) -> Figure:
    """Contact forces of a run, and their peaks beside the paper's."""
    figure, [axes] = sheet(1, 3)
    case = (run[0], run[1])
    record = findings.runs[case]
    names = [f"largest contact force in {joint}" for joint in JOINTS]
    for joint, colour in zip(JOINTS, COLOURS, strict=True):
        curve(axes[0], record, f"{joint}_normal_N", PERIOD, colour, joint)
        curve(axes[1], record, f"{joint}_normal_N", EARLY, colour, joint)
    for time in published("last separation", case, number):
        axes[0].axvline(time, color=PAPERS, ls="--", label="last separation: paper")
    axes[0].axvline(record.last_separation, color=INK, ls=":", label="last separation: here")
    axes[0].set(title="One period", ylabel="Contact force (N)")
    axes[1].set(title="While the balls bounce", ylabel="Contact force (N)")
    axes[0].legend()
    here, at_step = [record.value(name) for name in names], [record.sampled(name) for name in names]
    peaks(axes[2], [1, 2, 3], here, at_step, [published(name, case, number) for name in names])
    axes[2].set_xticks([1, 2, 3], JOINTS)
    axes[2].set(title="Largest force", ylabel="Contact force (N)")
    return figure


def verification(findings: Findings, columns: list[str]) -> Figure:
    """Columns of both formulations and of the ideal motion."""
    figure, axes = sheet(3, 2)
    nominal = next(iter(findings.runs.values()))
    for place, column in zip((axes_ for row in axes for axes_ in row), columns, strict=True):
        curve(place, findings.ideal, column, EARLIEST, INK, "ideal joints", ls=":", lw=1.4)
        curve(place, nominal, column, EARLIEST, COLOURS[0], "tree formulation", lw=2.0)
        curve(place, findings.lagrange, column, EARLIEST, COLOURS[1], "lagrange formulation", ls="--")
        for _, quantity, own, commercial in PAPER["verification"]:
            if QUANTITIES[quantity][1] == column:
                # The paper prints magnitudes; they are drawn on the side of the largest peak here.
                values = nominal.columns[column]
                side = np.sign(values[np.abs(values).argmax()])
                place.axhline(side * own, color=PAPERS, ls="-.", label="paper's peak: own program")
                place.axhline(side * commercial, color=PAPERS, ls=":", label="paper's peak: commercial program")
        place.legend()
    return figure


def parameter(over: str) -> str:
    series = SERIES[over]
    return series.label + (f" ({series.unit})" if series.unit else "")


def portraits(findings: Findings, over: str) -> Figure:
    """Rates against coordinates: settled, and over the first period."""
    figure, axes = sheet(2, 2)
    for place, columns in enumerate(DERIVATIVES.values()):
        for run, colour in zip(SERIES[over].runs, COLOURS, strict=True):
            record = findings.runs[run]
            step = slice(None, None, max(record.stride // 20, 1))
            for row, title, source in [
                (0, "Settled", record.settled.columns if record.settled else {}),
                (1, "First period, with its impacts", {name: record.columns[name][step] for name in columns}),
            ]:
                values, rates = (source[column] / COLUMNS[column].size for column in columns[:2])
                axes[row][place].plot(values, rates, color=colour, lw=0.8, label=SERIES[over].name(run))
                axes[row][place].set(title=title, xlabel=label_of(columns[0]), ylabel=label_of(columns[1]))
        axes[0][place].legend()
    return figure


def sections(findings: Findings, over: str) -> Figure:
    """Poincaré sections of three runs."""
    figure, [axes] = sheet(1, 2)
    points = findings.points[f"runs_by_{over}"]
    for place, columns in zip(axes, DERIVATIVES.values(), strict=True):
        for n, (run, colour) in enumerate(zip(SERIES[over].runs, COLOURS, strict=True)):
            values, rates = (points.sections[column][n] / COLUMNS[column].size for column in columns[:2])
            place.plot(values, rates, "os^"[n], color=colour, mfc="none", ms=6, label=SERIES[over].name(run))
        count = points.sections[columns[0]].shape[1]
        place.set(title=f"{count} sections each", xlabel=label_of(columns[0]), ylabel=label_of(columns[1]))
        place.margins(0.15)
        place.locator_params(axis="x", nbins=5)
        place.legend()
    return figure


BRANCHES = {"cold": "cold start", "up": "followed upward", "down": "followed downward"}


def bifurcation(findings: Findings, over: str) -> Figure:
    """All sections of a sweep; their spread, and the distance of the followed branches from the cold start."""
    figure, axes = sheet(2, 2)
    cold = findings.points[f"{over}_cold"]
    for place, (coordinate, columns) in enumerate(DERIVATIVES.items()):
        column, unit = columns[0], {"x": "µm", "beta": "µrad"}[coordinate]
        diagram, differences = axes[0][place], axes[1][place]
        for branch, colour, size in zip(BRANCHES, (INK, *COLOURS), (14.0, 6.0, 1.5), strict=False):
            values = findings.points[f"{over}_{branch}"].sections[column] / COLUMNS[column].size
            diagram.scatter(np.repeat(cold.values, values.shape[1]), values, s=size, color=colour, label=BRANCHES[branch])
        diagram.set(title=f"Sections in {label_of(column).split()[0]}", xlabel=parameter(over), ylabel=label_of(column))
        diagram.margins(y=0.2)
        diagram.legend(loc="upper center", ncols=3, markerscale=1.5)
        resolution = findings.resolution[coordinate] * 1e6
        lines = {"spread of the sections of a point": cold.spread(coordinate)}
        for branch in ("up", "down"):
            other = findings.points[f"{over}_{branch}"].latest(coordinate)
            lines[f"{BRANCHES[branch]} against cold"] = np.abs(other - cold.latest(coordinate))
        differences.set_yscale("log")
        differences.axhline(resolution, color=PAPERS, ls="--", label="resolution: less counts as equal")
        for (text, sizes), colour, marker in zip(lines.items(), (INK, *COLOURS), "o^v", strict=False):
            # A logarithmic axis cannot show the frequent 0.
            differences.plot(
                cold.values, np.maximum(sizes * 1e6, 1e-6 * resolution), marker + "-", color=colour, ms=3, label=text
            )
        differences.set(
            title=f"Spread and hysteresis in {label_of(column).split()[0]}", xlabel=parameter(over), ylabel=f"Distance ({unit})"
        )
        differences.legend()
    return figure


def exponents(findings: Findings, over: str) -> Figure:
    """Largest Lyapunov exponents along a sweep, and convergence of their estimates."""
    figure, [axes] = sheet(1, 2)
    series, points = SERIES[over], findings.points[f"{over}_cold"]
    errors = np.where(np.isfinite(points.errors), points.errors, 0.0)
    axes[0].errorbar(points.values, points.exponents, errors, fmt="o-", color=INK, ms=3, lw=0.8, elinewidth=0.8)
    axes[0].set(title="Along the sweep, ± standard error", xlabel=parameter(over))
    running, discard = findings.results[f"{over}_cold"]["exponent_running_per_s"], findings.extent.sweep[1]
    legible = np.flatnonzero(points.exponents > MIN_EXPONENT)
    shades = mpl.colormaps["viridis"](np.linspace(0.0, 0.85, 5))
    for point, colour in zip(legible[np.linspace(0, len(legible) - 1, min(5, len(legible))).astype(int)], shades, strict=False):
        periods = discard + 1 + np.arange(int(running.shape[1]))
        axes[1].plot(periods, running[point], color=colour, label=series.value.format(float(f"{points.values[point]:.3g}")))
    axes[1].set(title="Convergence", xlabel="Periods run")
    axes[1].legend()
    for place in axes:
        place.axhline(0.0, color=PAPERS, ls="--", lw=0.8)
        place.text(0.01, 0.0, "chaos lies above", color=PAPERS, va="bottom", transform=place.get_yaxis_transform(), fontsize=8)
        place.set(
            ylim=(MIN_EXPONENT, 1.1 * max(0.0, float(np.nanmax(points.exponents))) + 1.0),
            ylabel="Largest Lyapunov exponent (1/s)",
        )
    return figure


FIGURES: dict[str, Callable[..., Figure]] = {
    "response": response,
    "forces": forces,
    "verification": verification,
    "portraits": portraits,
    "sections": sections,
    "bifurcation": bifurcation,
    "exponents": exponents,
}
"""What a figure may show, by the names that the table of the paper uses."""
