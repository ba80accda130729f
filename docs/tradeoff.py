"""Writes docs/tradeoff.md, its diagrams and docs/tradeoff.csv from a folder of `jointplay tradeoff`: see docs/checks.md.

python docs/tradeoff.py FOLDER
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

PAGE = """# Speed for accuracy

Cost and error of every method on the built-in scenes and on machines that no setting was chosen on (`tests/trials/`).
[`tradeoff.csv`](tradeoff.csv) has all rows. `jointplay tradeoff SCENE… --out FOLDER` measures any scene;
`python docs/tradeoff.py FOLDER` draws this page from the result (`docs/checks.md`).

Measured on: {machine}. A ratio is the speed over that of Runge-Kutta 4 at 10 us on the same span, in the same run.

## How it is measured

- **Cost** is counted over the first {span:g} s, in evaluations of the equations of motion: these, 6 for what is done once a step
  (12 with error control and events), and the linear algebra of implicit steps and coupled contacts by the number of its products. It is
  the same on every computer; times follow it within a factor of about {scatter:.1f} from scene to scene.
- **Peak error**: the largest relative error among the peak forces of the first six impacts (of `chain`, five: its sixth overlaps that of
  a neighbour by 25 us, and its peak depends on which comes first), each within its own time window (up to half-way to the previous and
  next contact of the same joint). After some tens of impacts two accurate runs have diverged, and only statistics could be compared.
- **Position error**: of the output body at the third impact. **Energy error**: residual of the energy balance over the first impacts,
  relative to the energy exchanged. **Force error**: the largest relative error among the joints' mean contact forces over 0.2 s of settled
  motion, from a common state.
- Errors are relative to `dopri5` at 1e-12. A run that costs more than {cap:.1e} evaluations, or that the divergence guard stops, has no
  time and no cost.

## Presets

A preset must keep the peak error of the first impacts within its limit. Largest errors of all scenes below:

{largest}
`preview` and `real-time` are `discrete-gradient` with 12 and 24 steps per impact where at least four loose balls act on one another
(they hold the same body, or bodies that ideal joints connect), and otherwise `automatic` at 1e-2 and 1e-3. The reasons, by counted
cost and peak error (also of 250 variants of these machines with other clearances, restitution, friction and gravity):

- Error-controlled steps follow the events of all joints. Where impacts set off others, n steps per impact cost about 0.3 + 0.02 n times as
  much as `automatic`, and less the larger the machine. Where no joint acts on another they cost as much or more.
- The error of an impact grows with the number of impacts of the same joint before it. With up to three loose balls the first six impacts are
  two to six of each, and the number of steps that keeps the limits costs as much as `automatic`.
- The explicit steps of `automatic` never use a tolerance above 1e-5, so its peaks are the same at 1e-2 and 1e-4; only settled motion is
  cheaper.

*Cost* is that of the preset's setting; *other* is that of the method not chosen, with its setting for this preset, over it (below 1: the
other would be cheaper; in brackets: it exceeds the limit).

{choices}
## Real time

Simulated seconds per second of stepping with the preset `real-time`, over the first second, on the computer named above. `check`, `run`
and the window warn where a built-in scene does not reach real time.

{paces}
## Cheapest settings

The setting with the least counted cost among all that keep the peak error within a limit, and its ratio.

{cheapest}
## Diagrams

{diagrams}
"""


def setting(row: pd.Series) -> str:
    """Method and the value that controls its steps."""
    if pd.notna(row.step_s):
        return f"{row.method} {row.step_s * 1e6:g} us"
    return f"{row.method} {row.tolerance:.0e}".replace("e-0", "e-") if pd.notna(row.tolerance) else f"{row.method} {row.steps_per_impact:g}"


def markdown(heads: str, rows: list[list[str]]) -> str:
    columns = heads.split(" | ")
    return "\n".join(["| " + " | ".join(cells) + " |" for cells in [columns, ["---"] * len(columns), *rows]]) + "\n"


def exponent(value: float) -> str:
    return "-" if pd.isna(value) else f"{value:.1e}".replace("e-0", "e-")


def choices(scene: str, rows: pd.DataFrame) -> list[str]:
    """Setting, cost and peak error of the fast presets, and the cost of the method not chosen."""
    cells = [f"`{scene}`"]
    for preset, tolerance, steps in (("preview", 1e-2, 12), ("real-time", 1e-3, 24)):
        own = rows[rows.preset == preset].iloc[0]
        discrete = (rows.method == "discrete-gradient") & (rows.steps_per_impact == steps)
        others = rows[(rows.method == "automatic") & (rows.tolerance == tolerance) if own.method == "discrete-gradient" else discrete]
        other = others.iloc[0]
        factor = f"{other.cost / own.cost:.2g}" if pd.notna(other.cost) else "capped"
        kept = other.peak_error <= LIMITS[preset] or pd.isna(other.peak_error)
        cells += [setting(own), f"{own.cost:.2g}", exponent(own.peak_error), factor if kept else f"({factor})"]
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


def main(folder: Path) -> None:
    table = pd.read_csv(folder / "tradeoff.csv")
    scenes = list(table.groupby("scene", sort=False))
    record = json.loads((DOCS.parent / "assets/presets.json").read_text(encoding="utf-8"))
    baseline = table[(table.method == "rk4") & (table.step_s == 1e-5)].set_index("scene")
    per_cost = table.time_s / table.cost / table.scene.map(baseline.time_s / baseline.cost)
    largest = [[preset, f"{limit:.0e}".replace("e-0", "e-"), exponent(table[table.preset == preset].peak_error.max()),
                table.loc[table[table.preset == preset].peak_error.idxmax()].scene,
                exponent(table[table.preset == preset].force_error.max())] for preset, limit in LIMITS.items()]
    fast = "Cost | Peak error | Other"
    page = PAGE.format(
        machine=json.loads((folder / "manifest.json").read_text(encoding="utf-8"))["machine"],
        span=table.span_s.max(), cap=1.5e6, scatter=per_cost.quantile(0.95) / per_cost.quantile(0.05),
        largest=markdown("Preset | Limit | Largest peak error | On | Largest force error", largest),
        choices=markdown(f"Scene | `preview` | {fast} | `real-time` | {fast}", [choices(*scene) for scene in scenes]),
        paces=markdown("Scene | Speed", [[f"`{scene}`", f"{pace:.3g}"] for scene, pace in record["pace"].items()]),
        cheapest=markdown("Scene | " + " | ".join(f"{limit:g}" for limit in LIMITS.values()), [cheapest(*scene) for scene in scenes]),
        diagrams="\n\n".join(f"![Error against cost and time of every method, {scene}](tradeoff-{scene}.svg)" for scene in DRAWN),
    )
    for scene, rows in scenes:
        if scene in DRAWN:
            draw(scene, rows)
    (DOCS / "tradeoff.md").write_text(page.rstrip() + "\n", encoding="utf-8")
    shutil.copyfile(folder / "tradeoff.csv", DOCS / "tradeoff.csv")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
