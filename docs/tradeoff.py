"""Writes the tables of docs/tradeoff.md, its diagrams and docs/tradeoff.csv from a folder of `jointplay tradeoff`, or the table of pins from
the output of a benchmark: see docs/checks.md.

python docs/tradeoff.py FOLDER
python docs/tradeoff.py pins.txt
"""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import pandas as pd

DOCS = Path(__file__).parent
DRAWN = ("spcmm", "chain")
LIMITS = {"preview": 5e-2, "real-time": 2e-2, "accurate": 1e-4, "reference": 1e-7}
MARKERS = dict(zip(("discrete-gradient", "rk4", "dopri5", "radau5", "automatic"), "sD^vo", strict=True))


def setting(row: pd.Series) -> str:
    """Method and the value that controls its steps."""
    if pd.notna(row.step_s):
        return f"{row.method} {row.step_s * 1e6:g} us"
    return f"{row.method} {plain(row.tolerance)}" if pd.notna(row.tolerance) else f"{row.method} {row.steps_per_impact:g}"


def markdown(heads: str, rows: list[list[str]]) -> str:
    columns = heads.split(" | ")
    return "\n".join(["| " + " | ".join(cells) + " |" for cells in [columns, ["---"] * len(columns), *rows]]).replace(" --- ", "---") + "\n"


def exponent(value: float) -> str:
    return "-" if pd.isna(value) else f"{value:.1e}".replace("e-0", "e-").replace("e+0", "e")


def plain(limit: float) -> str:
    return f"{limit:.0e}".replace("e-0", "e-")


def choices(scene: str, rows: pd.DataFrame) -> list[str]:
    """Setting, cost and peak error of the fast presets, and the cost of the method not chosen."""
    cells = [f"`{scene}`"]
    for preset, tolerance, steps in (("preview", 1e-3, 16), ("real-time", 5e-4, 24)):
        own = rows[rows.preset == preset].iloc[0]
        discrete = (rows.method == "discrete-gradient") & (rows.steps_per_impact == steps)
        others = rows[(rows.method == "automatic") & (rows.tolerance == tolerance) if own.method == "discrete-gradient" else discrete]
        other = others.iloc[0]
        factor = f"{other.cost / own.cost:.2g}" if pd.notna(other.cost) else "capped"
        kept = other.peak_error <= LIMITS[preset] or pd.isna(other.peak_error)
        cells += [setting(own), exponent(own.cost), exponent(own.peak_error), factor if kept else f"({factor})"]
    return cells


def cheapest(scene: str, rows: pd.DataFrame) -> list[str]:
    cells = [f"`{scene}`"]
    for limit in LIMITS.values():
        within = rows[(rows.peak_error.isna() | (rows.peak_error <= limit)) & rows.cost.notna()]
        best = within.loc[within.cost.idxmin()] if len(within) else None
        cells.append("-" if best is None else f"{setting(best)}, {best.ratio:.2g}")
    return cells


def draw(scene: str, rows: pd.DataFrame) -> None:
    """Error against cost and against time of every method."""
    matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "jointplay", "font.size": 9})
    figure, axes = plt.subplots(1, 2, figsize=(10, 4.2), sharey=True, layout="constrained")
    for method, marker in MARKERS.items():
        own = rows[(rows.method == method) & rows.cost.notna() & (rows.peak_error <= 1)]
        for axis, x in zip(axes, (own.cost, 1 / own.ratio), strict=True):
            axis.loglog(x, own.peak_error, marker=marker, markersize=4, linewidth=1, label=method)
    for _, row in rows[rows.preset.notna() & rows.cost.notna()].iterrows():
        for axis, x in zip(axes, (row.cost, 1 / row.ratio), strict=True):
            axis.annotate(row.preset, (x, row.peak_error), textcoords="offset points", xytext=(4, 4), fontsize=8)
    axes[0].set(xlabel="Counted cost, evaluations", ylabel="Largest relative error of a peak force", title=f"{scene}: what accuracy costs")
    axes[1].set(xlabel="Time, that of rk4 at 10 us is 1")
    axes[1].legend(frameon=False)
    figure.savefig(DOCS / f"tradeoff-{scene}.svg", metadata={"Date": None})


def write(parts: dict[str, str]) -> None:
    """Exchanges parts of the page."""
    page = (DOCS / "tradeoff.md").read_text(encoding="utf-8")
    for name, text in parts.items():
        before, rest = page.split(f"<!-- {name} -->\n")
        page = f"{before}<!-- {name} -->\n{text}<!-- end -->{rest.split('<!-- end -->', 1)[1]}"
    (DOCS / "tradeoff.md").write_text(page, encoding="utf-8")


def pins(output: Path) -> None:
    """The table of pins: a line of the benchmark names method and kind, the second after it says how many times a ball it costs."""
    lines = output.read_text(encoding="utf-8").splitlines()
    costs = {}
    for line, times in zip(lines, lines[2:]):
        if " of a slider-crank, " in line:
            method, kind = line.split(" of a slider-crank, ")[1].split("/")
            costs.setdefault(method, {})[kind] = times.split()[0]
    kinds = list(next(iter(costs.values())))
    write({"pins": markdown(" | ".join(["Method", *kinds]), [[f"`{m}`", *own.values()] for m, own in costs.items()])})


def main(folder: Path) -> None:
    table = pd.read_csv(folder / "tradeoff.csv")
    scenes = list(table.groupby("scene", sort=False))
    record = json.loads((DOCS.parent / "assets/presets.json").read_text(encoding="utf-8"))
    baseline = table[(table.method == "rk4") & (table.step_s == 1e-5)].set_index("scene")
    per_cost = table.time_s / table.cost / table.scene.map(baseline.time_s / baseline.cost)
    largest = []
    for preset, limit in LIMITS.items():
        own = table[table.preset == preset]
        worst = own.loc[own.peak_error.idxmax()]
        force = exponent(own.force_error.max())
        largest.append([preset, plain(limit), exponent(worst.peak_error), f"`{worst.scene}`", force])
    fast = "Cost | Peak error | Other"
    machine = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))["machine"]
    scatter = per_cost.quantile(0.95) / per_cost.quantile(0.05)
    parts = {
        "machine": f"Measured on: {machine}. From scene to scene, times follow the counted cost within a factor of {scatter:.1f}.\n",
        "largest": markdown("Preset | Limit | Largest peak error | On | Largest force error", largest),
        "choices": markdown(f"Scene | `preview` | {fast} | `real-time` | {fast}", [choices(*scene) for scene in scenes]),
        "paces": markdown("Scene | Speed", [[f"`{scene}`", f"{pace:.3g}"] for scene, pace in record["pace"].items()]),
        "cheapest": markdown("Scene | " + " | ".join(map(plain, LIMITS.values())), [cheapest(*scene) for scene in scenes]),
    }
    write(parts)
    for scene, rows in scenes:
        if scene in DRAWN:
            draw(scene, rows)
    shutil.copyfile(folder / "tradeoff.csv", DOCS / "tradeoff.csv")


if __name__ == "__main__":
    given = Path(sys.argv[1])
    (main if given.is_dir() else pins)(given)
