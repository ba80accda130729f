"""`python -m jointplay sensitivity`."""

from __future__ import annotations

import argparse
import sys
from functools import partial
from typing import Any

import numpy as np

from . import _study_command as common
from ._options import library
from ._scene import Scene
from ._sensitivity import Indices, Sensitivity, Target, sensitivity
from ._study import Estimate
from ._study_command import show

MAX_BARS = 20
"""Largest number of parameters in the picture: those with the largest effects."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments."""
    common.add_arguments(parser)
    add = parser.add_argument
    add(
        "--output",
        default="tip-error",
        metavar="LIST",
        help="what to explain: tip-error (largest, the default), tip-error-rms, peak-force, impacts, energy-lost, or "
        "CHANNEL:STATISTIC as in sweep --keep; several, separated by commas",
    )
    add(
        "--rows",
        type=int,
        default=64,
        metavar="N",
        help="rows of the design for the indices (default: 64), N (k + 2) runs; 0: none",
    )
    add(
        "--screen",
        type=int,
        metavar="N",
        help="trajectories of the screening (default: 10 if more than 8 parameters vary, else 0)",
    )
    add("--target", metavar="VALUE", help="largest allowed value of the first output, e.g. 100um: which changes reach it")


def main(arguments: argparse.Namespace) -> None:
    """Runs the command."""
    rows = arguments.rows
    if rows > 0 and rows & (rows - 1) and not arguments.quiet:
        print(f"warning: --rows {rows}: a Sobol sequence is evenly distributed only for a power of two", file=sys.stderr)
    scene, over = common.load(arguments), common.requests(arguments)
    options = {"screen": arguments.screen, "target": arguments.target, "seed": arguments.seed}
    span = {"duration": arguments.duration, "from_": arguments.from_}
    compute = partial(sensitivity, scene, over, arguments.output, rows=rows, **options, **span)
    found = common.perform(arguments, compute)
    results = summary(found)
    common.write(arguments, scene, found, "sensitivity", {"over": arguments.over, "rows": rows}, results, draw(scene, found))
    common.finish(arguments, results, describe(scene, found))


def summary(found: Sensitivity) -> dict[str, Any]:
    """Everything but the runs, SI."""

    def of_output(name: str) -> dict[str, Any]:
        indices = found.indices.get(name)
        known = indices if isinstance(indices, Indices) else None
        parameters = [
            {"key": key, "value": found.inputs[key], "low": low, "high": high, "alone_low": at_low, "alone_high": at_high}
            | {"first_order": known and known.first.get(key), "total": known and known.total.get(key)}
            for key, (low, at_low, high, at_high) in found.alone[name].items()
        ]
        low, high = found.together[name]
        return {
            "name": name,
            "unit": found.units[name],
            "value": found.nominal[name],
            "all_low": low,
            "all_high": high,
            "parameters": parameters,
            "no_indices": indices if isinstance(indices, str) else None,
            **{key: known and getattr(known, key) for key in ("rows", "incomplete_rows", "mean", "variance")},
        }

    def changes(values: dict[str, float]) -> list[dict[str, Any]]:
        return [{"key": key, "value": value} for key, value in values.items()]

    target = found.target and {
        "target": found.target.target,
        "single": [{"change": changes(one.values)[0], "output": one.output} for one in found.target.single],
        "together": found.target.together
        and {"changes": changes(found.target.together.values), "output": found.target.together.output},
    }
    names = ("mean", "mean_magnitude", "deviation", "low", "high", "ends")
    screening = found.screening and [
        {"key": key} | {name: effects and getattr(effects, name) for name in names} for key, effects in found.screening.items()
    ]
    return {
        "outputs": [of_output(name) for name in found.alone],
        "screening": screening,
        "target": target,
        "runs": sum(len(runs.status) for runs in found.runs.values()),
        "not_started": found.not_started,
        "diverged": found.diverged,
    }


def describe(scene: Scene, found: Sensitivity) -> str:
    """The result for a terminal."""
    text = common.describe(scene, found)
    if found.screening is not None:
        first = next(iter(found.alone))
        rows: list[list[str]] = []
        for key, effects in found.screening.items():
            numbers = effects and [show(n, found.units[first]) for n in (effects.mean_magnitude, effects.mean, effects.deviation)]
            ends = effects and [show(effects.low, found.units[key]), show(effects.high, found.units[key]), effects.ends]
            rows.append([key, *(numbers or ["-"] * 3), *(ends or ["-"] * 3), "kept" if key in found.kept else "left out"])
        heads = "parameter", "mean size of effect", "mean effect", "deviation", "from", "to", "ends", "for the indices"
        text += (
            f"\nScreening of {first}: from the one end of each parameter to the other, limits or quantiles of 2.5 % and 97.5 %\n"
        )
        text += common.table(heads, rows)
    for name, alone in found.alone.items():
        unit, nominal, indices = found.units[name], found.nominal[name], found.indices.get(name)
        known = indices if isinstance(indices, Indices) else None
        all_low, all_high = found.together[name]
        digits = common.distinguishing_digits(
            nominal, [*(at for e in alone.values() for at in (e.at_low, e.at_high)), all_low, all_high]
        )
        text += f"\n{name}: {show(nominal, unit, digits)} with the values of the scene\n"
        rows = []
        for key, (low, at_low, high, at_high) in alone.items():
            at_ends = (
                show(low, found.units[key]),
                show(at_low, unit, digits),
                show(high, found.units[key]),
                show(at_high, unit, digits),
            )
            shares = (known.first.get(key), known.total.get(key)) if known else (None, None)
            rows.append([key, *at_ends, *map(interval, shares)])
        rows.append(
            ["all together", "lower ends", show(all_low, unit, digits), "upper ends", show(all_high, unit, digits), "-", "-"]
        )
        text += common.table(("parameter", "from", "output alone", "to", "output alone", "first-order", "total"), rows)
        if known:
            left_out = f", {known.incomplete_rows} left out" if known.incomplete_rows else ""
            spread = f"mean {show(known.mean, unit)}, standard deviation {show(float(np.sqrt(known.variance)), unit)}"
            text += f"Indices from {known.rows} rows{left_out}; {spread}; intervals of 95 %\n"
        elif indices:
            text += f"No indices: {indices}\n"
    return text + (f"\n{sentence(found, found.target)}\n" if found.target else "")


def interval(estimate: Estimate | None) -> str:
    """An index with its interval, in hundredths."""
    if estimate is None:
        return "-"
    # Adding 0 turns -0 into 0.
    value, low, high = (f"{round(number, 2) + 0.0:.2f}" for number in estimate)
    return f"{value} ({low} to {high})"


def sentence(found: Sensitivity, target: Target) -> str:
    """The answer to `--target` in words."""
    name = next(iter(found.alone))
    unit = found.units[name]
    goal = f"{name} of at most {show(target.target, unit)}"

    def words(values: dict[str, float]) -> str:
        return ", ".join(f"{key} = {show(value, found.units[key])}" for key, value in values.items())

    if target.single:
        ways = [f"  {words(one.values)} alone gives {show(one.output, unit)}" for one in target.single]
        return f"{goal} is reached by one of\n" + "\n".join(ways)
    if target.together is None:
        return f"{goal} is not reached within the ranges"
    if not target.together.values:
        return f"{goal} is already met by the values of the scene: {show(target.together.output, unit)}"
    return f"{goal} requires several changes together: {words(target.together.values)}, which give {show(target.together.output, unit)}"


BELOW: dict[str, Any] = {"loc": "upper right", "bbox_to_anchor": (1.0, -0.22), "ncols": 2, "frameon": False, "fontsize": "small"}
"""Place of a legend, where it covers no bar."""


def draw(scene: Scene, found: Sensitivity) -> Any:
    """The tornado of each parameter alone and, beside it, the indices, for every output."""
    has_indices = any(isinstance(indices, Indices) for indices in found.indices.values())
    count, bars = len(found.alone), min(len(found.inputs), MAX_BARS)
    height = 1.6 + 0.42 * bars
    figure = library("matplotlib.figure").Figure(
        figsize=(11.0 if has_indices else 7.0, height * count + 0.5), layout="constrained"
    )
    axes = figure.subplots(count, 2 if has_indices else 1, squeeze=False)
    figure.suptitle(f"{scene.name}: influences on the output")
    for (name, alone), row in zip(found.alone.items(), axes, strict=True):
        nominal = found.nominal[name]
        spread = {key: float(np.ptp([one.at_low, one.at_high, nominal])) for key, one in alone.items()}
        keys = sorted(alone, key=lambda key: -spread[key] if np.isfinite(spread[key]) else -np.inf)[:bars]
        label, factor = common.axis(name, found.units[name])
        places = np.arange(len(keys))
        for i, key in enumerate(keys):
            low, high = alone[key].at_low - nominal, alone[key].at_high - nominal
            # Side by side where both ends are on the same side of the value of the scene.
            thick, shift = (0.7, 0.0) if low * high < 0.0 else (0.35, 0.175)
            for change, colour, side in ((low, common.BLUE, -1.0), (high, common.ORANGE, 1.0)):
                row[0].barh(i + side * shift, factor * change, thick, factor * nominal, color=colour)
        row[0].axvline(factor * nominal, color=common.GREY, linewidth=1.0)
        row[0].set(title="each parameter alone", xlabel=label)
        handles = [library("matplotlib.patches").Patch(color=colour) for colour in (common.BLUE, common.ORANGE)]
        row[0].legend(handles, ["lower end", "upper end"], **BELOW)
        indices = found.indices.get(name)
        if has_indices and isinstance(indices, Indices):
            for side, colour, of, words in (
                (-1.0, common.BLUE, indices.first, "first-order"),
                (1.0, common.ORANGE, indices.total, "total"),
            ):
                known = [(i, of[key]) for i, key in enumerate(keys) if key in of]
                where = [i + 0.175 * side for i, _ in known]
                values = np.array([one for _, one in known]).reshape(-1, 3).T
                row[1].barh(where, values[0], 0.35, color=colour, label=words)
                row[1].errorbar(
                    values[0], where, xerr=[values[0] - values[1], values[2] - values[0]], fmt="none", ecolor=common.GREY
                )
            row[1].legend(**BELOW)
            row[1].axvline(0.0, color=common.GREY, linewidth=1.0)
            row[1].set_xlim(-0.1, 1.1)
        if has_indices:
            title = "all parameters together" + ("" if isinstance(indices, Indices) else ": no indices")
            row[1].set(title=title, xlabel="share of the variance, with intervals of 95 %")
        for own in row:
            own.set_yticks(places, keys)
            own.set_ylim(len(keys) - 0.4, -0.6)
            own.spines[["top", "right"]].set_visible(False)
    return figure
