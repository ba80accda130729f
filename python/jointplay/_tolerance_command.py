"""`python -m jointplay tolerance`."""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from . import _study_command as common
from ._options import library
from ._scene import Scene
from ._study import SAMPLINGS, Estimate
from ._study_command import show
from ._tolerance import Fits, Limits, Price, Tolerance, statistics, tolerance
from .errors import OptionError

LABELS = {"deviation": "standard deviation", "cp": "Cp", "cpk": "Cpk"}
VERDICTS = {"held": "it holds", "missed": "it does not hold", "open": "too few runs to tell whether it holds"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments."""
    common.add_arguments(parser)
    add = parser.add_argument
    add(
        "--limit",
        action="append",
        required=True,
        metavar="OUTPUT=LIMIT",
        help="limit of an output: an upper one (tip-error=50um), both (S1.normal:max=20N..500N) or a lower one "
        "(tip-error-rms=1um..); outputs as in sensitivity --output; may be repeated for other outputs",
    )
    add(
        "--tolerances", type=Path, metavar="FILE", help="uncertain parameters: a CSV file with the heading parameter,distribution"
    )
    add("--runs", type=int, default=1000, metavar="N", help="units of the lot, one run each (default: 1000)")
    add("--sampling", choices=SAMPLINGS, default="sobol", help="how the values of the lot are drawn (default: sobol)")
    add(
        "--cost",
        type=Path,
        metavar="FILE",
        help="find the cheapest fits that reach --yield: a CSV file with the heading parameter,fit,cost; candidates of a parameter "
        "from the loosest to the tightest",
    )
    add(
        "--yield",
        dest="yield_",
        default="99%",
        metavar="FRACTION",
        help="yield that the fits must reach, e.g. 99%% or 0.99 (default)",
    )
    add("--evaluations", type=int, default=64, metavar="N", help="largest number of choices of fits to try (default: 64)")


def main(arguments: argparse.Namespace) -> None:
    """Runs the command."""
    limits: dict[str, Any] = {}
    for option in arguments.limit:
        name, sign, limit = (part.strip() for part in option.partition("="))
        if not sign:
            raise OptionError(f"--limit {option}: expected OUTPUT=LIMIT, e.g. tip-error=50um")
        if name in limits:
            raise OptionError(f"--limit {option}: {name} has a limit already; LOW..HIGH gives both")
        limits[name] = limit
    required = read_fraction(arguments.yield_)
    scene, over = common.load(arguments), common.requests(arguments)
    cost = None
    if arguments.cost is not None:
        cost = [Price(*row) for row in common.read_rows("--cost", arguments.cost, ("parameter", "fit", "cost"))]
    options = {name: getattr(arguments, name) for name in ("runs", "sampling", "seed", "evaluations", "duration", "from_")}
    found = common.perform(arguments, partial(tolerance, scene, over, limits, cost=cost, yield_=required, **options))
    results = summary(found)
    settings = {name: getattr(arguments, name) for name in ("limit", "over", "sampling")}
    settings |= {name: path and str(path) for name in ("tolerances", "cost") for path in [getattr(arguments, name)]}
    common.write(arguments, scene, found, "tolerance", settings | {"lot": arguments.runs}, results, draw(scene, found))
    common.finish(arguments, results, describe(scene, found, arguments.evaluations))


def read_fraction(text: str) -> float:
    """A part of the lot above 0 and up to 1: `99%` or `0.99`."""
    try:
        part = float(text.strip().removesuffix("%")) / (100.0 if text.strip().endswith("%") else 1.0)
    except ValueError:
        part = np.nan
    if not 0.0 < part <= 1.0:
        raise OptionError(f"--yield {text}: expected a part of the lot above 0 and up to 100 %, e.g. 99% or 0.99")
    return part


def summary(found: Tolerance) -> dict[str, Any]:
    """Everything but the runs, SI."""
    outputs: list[dict[str, Any]] = []
    for name, quality in found.qualities.items():
        lower, upper = found.limits[name]
        outputs.append({"name": name, "unit": found.units[name], "lower": lower, "upper": upper, **statistics(quality)})
    fits = found.fits and {
        "required_yield": found.fits.required_yield,
        "best": found.fits.best
        and {
            "cost": found.fits.best.cost,
            "fits": [{"key": key, "fit": fit, "cost": found.fits.best.costs[key]} for key, fit in found.fits.best.fits.items()],
            "yield": found.fits.best.yield_,
        },
        "is_proven": found.fits.is_proven,
        "evaluations": found.fits.evaluations,
        "check": found.fits.check and {"yield": found.fits.check, "verdict": found.fits.verdict},
        "order_not_checked": found.fits.order_not_checked,
    }
    return {
        "units": len(found.accepted),
        "accepted": int(found.accepted.sum()),
        "missed": found.missed,
        "not_started": found.not_started,
        "diverged": found.diverged,
        "yield": found.yield_,
        "outputs": outputs,
        "reject_drivers": found.drivers and [{"key": key, **found.drivers[key]._asdict()} for key in ranked(found)],
        "fits": fits,
        "runs": sum(len(runs.status) for runs in found.runs.values()),
    }


def ranked(found: Tolerance) -> list[str]:
    """Parameters, the one that differs most between rejects and accepted units first."""
    drivers = found.drivers or {}
    return sorted(drivers, key=lambda key: -drivers[key].distance)


def percent(part: Estimate) -> str:
    """A fraction with its interval."""
    value, low, high = (show(100.0 * number, "%") for number in part)
    return f"{value} ({low} to {high})"


def limits_in_words(limits: Limits, unit: str) -> str:
    """Limits for people."""
    lower, upper = limits
    if lower is None:
        return f"at most {show(upper, unit)}"
    return f"at least {show(lower, unit)}" if upper is None else f"from {show(lower, unit)} to {show(upper, unit)}"


def describe(scene: Scene, found: Tolerance, evaluations: int) -> str:
    """The result for a terminal."""
    units, accepted = len(found.accepted), int(found.accepted.sum())
    text = common.describe(scene, found)
    causes = [(found.missed, "missed a limit"), (found.not_started, "did not start"), (found.diverged, "diverged")]
    why = ", ".join(f"{count} {how}" for count, how in causes if count)
    text += f"Lot               {units} units, {units - accepted} rejected" + (f": {why}" if why else "") + "\n"
    text += f"Yield             {percent(found.yield_)}, interval of 95 %\n"
    if lost := found.not_started + found.diverged:
        text += f"Statistics        of the {units - lost} units with a result\n"
    for name, quality in found.qualities.items():
        unit = found.units[name]
        rows: list[list[str]] = []
        text += f"\n{name} {limits_in_words(found.limits[name], unit)}: {percent(quality.yield_)} of the lot\n"
        for statistic, value in list(statistics(quality).items())[1:]:
            own = "" if statistic in ("cp", "cpk") else unit
            numbers = value if isinstance(value, tuple) else (value, None, None)
            label = LABELS.get(statistic, f"{statistic[11:]}th percentile" if statistic.startswith("percentile") else statistic)
            rows.append([label, *(show(number, own) for number in numbers)])
        text += common.table(("statistic", "value", "95 % from", "to"), rows)
    if found.drivers:
        rows = [
            [key, show(one.mean_shift, ""), f"{one.distance:.2f}", "<0.0001" if one.p_value < 1e-4 else f"{one.p_value:.4f}"]
            for key in ranked(found)
            for one in [found.drivers[key]]
        ]
        heads = "parameter", "mean of the rejects off by (deviations)", "Kolmogorov-Smirnov distance", "p-value"
        text += f"\nWhat drives the rejects\n{common.table(heads, rows)}"
    elif accepted == units:
        text += "\nNo rejects\n"
    else:
        text += "\nAll units are rejected, so nothing shows what drives the rejects\n"
    return text + (fits_in_words(found.fits, evaluations) if found.fits else "")


def fits_in_words(fits: Fits, evaluations: int) -> str:
    """The cheapest fits for people."""
    required = show(100.0 * fits.required_yield, "%")
    effort = f"{fits.evaluations} choice{'' if fits.evaluations == 1 else 's'}"
    if fits.best is None:
        text = f"\nNo choice of fits holds a yield of {required}: the tightest do not ({effort} tried)\n"
    else:
        proof = "proven the cheapest if a tighter fit never lowers the yield"
        if not fits.is_proven:
            proof = f"not proven the cheapest: --evaluations {evaluations} ended the search"
        text = f"\nFits for a yield of {required}: cost {fits.best.cost:g}, {proof}; {effort} tried\n"
        rows = [[key, fit, f"{fits.best.costs[key]:g}"] for key, fit in fits.best.fits.items()]
        text += common.table(("parameter", "fit", "cost"), rows)
        text += f"Yield {percent(fits.best.yield_)} in the lot of the search\n"
    if fits.check and fits.verdict:
        text += f"Yield {percent(fits.check)} in another lot: {VERDICTS[fits.verdict]}\n"
    for key in fits.order_not_checked:
        text += f"The order of the candidates of {key} is not checked: a distribution without limits has no width\n"
    return text


def draw(scene: Scene, found: Tolerance) -> Any:
    """The distribution function of each limited output, with its limits."""
    count = len(found.qualities)
    columns = min(count, 2)
    rows = -(-count // columns)
    figure = library("matplotlib.figure").Figure(figsize=(6.4 * columns, 4.2 * rows + 0.3), layout="constrained")
    figure.suptitle(f"{scene.name}: a lot of {len(found.accepted)}")
    for o, (name, axes) in enumerate(zip(found.qualities, figure.subplots(rows, columns, squeeze=False).flat)):
        label, factor = common.axis(name, found.units[name])
        finite = np.sort(found.results[np.isfinite(found.results[:, o]), o])
        # Units without a result count, so that the function stays below 100 % with them.
        share = 100.0 * np.arange(len(finite) + 1) / len(found.accepted)
        if len(finite):
            axes.step(
                factor * np.concatenate([finite[:1], finite]),
                share,
                where="post",
                color=common.BLUE,
                label="part of the lot below",
            )
        for end, words in zip(found.limits[name], ("lower limit", "upper limit"), strict=True):
            if end is not None:
                axes.axvline(factor * end, color=common.ORANGE, linestyle="--", label=words)
        axes.set(xlabel=label, ylabel="part of the lot, %", ylim=(0.0, 100.0))
        axes.legend(loc="best", frameon=False, fontsize="small")
        axes.spines[["top", "right"]].set_visible(False)
    for unused in figure.axes[count:]:
        unused.set_visible(False)
    return figure
