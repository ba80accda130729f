"""Studies of uncertain parameters: which of them matter, and what fraction of a lot meets its limits."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import _native

if TYPE_CHECKING:
    import pandas

    from ._scene import Quantity, Scene

Over = Mapping[str, str | None] | Sequence[str]
"""Parameters by key or pattern, each with a distribution as text, or None for 0.5 to 1.5 times its value."""
Progress = Callable[[float], object]


class Estimate(NamedTuple):
    """An estimate with its 95 % interval."""

    value: float
    """Best value."""
    low: float
    """Lower end of the interval."""
    high: float
    """Upper end of the interval."""


class Study:
    """Runs of a scene over uncertain parameters, reduced to a few numbers: a model function for other libraries."""

    def __init__(
        self,
        scene: Scene,
        over: Over,
        output: str | Sequence[str] = "tip-error",
        *,
        duration: Quantity | None = None,
        start_after: Quantity | None = None,
    ) -> None:
        """A study of `scene` over parameters with distributions.

        `over` has a distribution for each key or pattern, as in `jointplay sensitivity --over`: `"0.05mm..0.2mm"`,
        `"normal(0.15, 0.02)"`, `"H7/g6"`, or None for 0.5 to 1.5 times the value. `output` names the numbers recorded of each
        run: `tip-error`, `tip-error-rms`, `peak-force`, `impacts`, `energy-lost`, or CHANNEL:STATISTIC. A run takes
        `duration`, s, and is observed from `start_after`, s, on; by default three periods of the drives, the first of them a
        transient.
        """
        requested: list[tuple[str, str | None]] = []
        requested += over.items() if isinstance(over, Mapping) else [(key, None) for key in over]
        names = output if isinstance(output, str) else ",".join(output)
        self._native = _native.Study(scene._native, requested, names, duration, start_after)

    @property
    def inputs(self) -> dict[str, float]:
        """Value in the scene, SI, of each parameter."""
        return {key: value for key, value, _ in self._native.inputs}

    @property
    def units(self) -> dict[str, str]:
        """SI unit of each parameter; empty for one without."""
        return {key: unit for key, _, unit in self._native.inputs}

    @property
    def assumed_ranges(self) -> dict[str, tuple[float, float]]:
        """Ends, SI, of each range that was not given: 0.5 to 1.5 times the value, within the allowed range."""
        return dict(self._native.assumed_ranges)

    @property
    def outputs(self) -> dict[str, str]:
        """Unit of each output."""
        return dict(self._native.outputs)

    def run(self, values: Any, *, threads: int | None = None, progress: Progress | None = None) -> NDArray[np.float64]:
        """Outputs, SI, at `values`, one row per run and one column per parameter, SI; NaN for a run that fails."""
        return self._native.run(np.asarray(values, dtype=float).tolist(), threads or os.cpu_count() or 1, progress)


@dataclass(frozen=True)
class Indices:
    """Sensitivity of one output to each parameter."""

    mean: float
    """Mean of the output, SI."""
    variance: float
    """Variance of the output, SI squared."""
    first: dict[str, Estimate]
    """First-order index: the share of the variance that vanishes on average when the parameter is fixed."""
    total: dict[str, Estimate]
    """Total index: the share that remains on average when all other parameters are fixed."""


class Ends(NamedTuple):
    """One parameter at the ends of its distribution, the others at their values in the scene."""

    low: float
    """Lower end of the parameter, SI."""
    at_low: float
    """Output there, SI; NaN for a run that fails."""
    high: float
    """Upper end of the parameter, SI."""
    at_high: float
    """Output there, SI; NaN for a run that fails."""


class Effects(NamedTuple):
    """Elementary effects of one parameter on the first output, from end to end of its distribution, SI."""

    mean: float
    """Mean effect."""
    mean_magnitude: float
    """Mean magnitude of the effect: the influence of the parameter."""
    deviation: float
    """Standard deviation: interactions and curvature."""


class Changes(NamedTuple):
    """Changed parameters that were run together."""

    values: dict[str, float]
    """Value of each changed parameter, SI."""
    output: float
    """First output there, SI."""


@dataclass(frozen=True)
class Target:
    """Changes of parameters with which the first output does not exceed a target."""

    target: float
    """Largest allowed value of the first output, SI."""
    single: list[Changes]
    """For each parameter that suffices alone, the smallest sufficient change that was run."""
    together: Changes | None
    """Changes of several parameters if none suffices alone. Empty if the scene meets the target; None if nothing reaches it."""


@dataclass(frozen=True)
class Sensitivity:
    """Result of `sensitivity`."""

    inputs: dict[str, float]
    """Value in the scene, SI, of each parameter."""
    units: dict[str, str]
    """SI unit of each parameter and output."""
    assumed_ranges: dict[str, tuple[float, float]]
    """Ends, SI, of each range that was not given: 0.5 to 1.5 times the value, within the allowed range."""
    nominal: dict[str, float]
    """Each output with the values of the scene, SI."""
    alone: dict[str, dict[str, Ends]]
    """For each output, the effect of every parameter alone."""
    together: dict[str, tuple[float, float]]
    """Each output with all parameters at their lower ends, and at their upper ends, SI."""
    screening: dict[str, Effects | None] | None
    """Effects of each parameter on the first output (None if the runs failed); None without a screening."""
    kept: list[str]
    """Parameters with indices; a screening omits the others."""
    indices: dict[str, Indices | str]
    """Indices of each output, or the reason why there are none; empty with rows=0."""
    target: Target | None
    """Changes that reach the target; None if none was given."""
    values: NDArray[np.float64] = field(repr=False)
    """Values of the parameters in each run of the indices, SI."""
    results: NDArray[np.float64] = field(repr=False)
    """Outputs of each run of the indices, SI."""

    def to_pandas(self) -> pandas.DataFrame:
        """One row per output and parameter, SI: the columns of `sensitivity.csv`."""
        import pandas

        rows = []
        for output, alone in self.alone.items():
            indices = self.indices.get(output)
            for key, (low, at_low, high, at_high) in alone.items():
                row: dict[str, Any] = {"output": output, "unit": self.units[output]}
                row |= {"parameter": key, "parameter_unit": self.units[key]}
                row |= {"low": low, "high": high, "alone_low": at_low, "alone_high": at_high}
                for name, of_key in (("first_order", "first"), ("total", "total")):
                    estimate = getattr(indices, of_key).get(key) if isinstance(indices, Indices) else None
                    row |= dict(zip((name, f"{name}_low", f"{name}_high"), estimate or UNKNOWN, strict=True))
                rows.append(row)
        return pandas.DataFrame(rows)


UNKNOWN = Estimate(np.nan, np.nan, np.nan)


def sensitivity(
    scene: Scene,
    over: Over,
    output: str | Sequence[str] = "tip-error",
    *,
    rows: int = 64,
    screen: int | None = None,
    target: Quantity | None = None,
    seed: int = 1,
    duration: Quantity | None = None,
    start_after: Quantity | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Sensitivity:
    """Which uncertain parameters move an output most, as `jointplay sensitivity` computes it.

    The stages are: every parameter alone; a screening with `screen` trajectories (by default 10 if more than 8 parameters vary,
    otherwise none), after which unimportant parameters are omitted; first-order and total indices from `rows` rows of a Sobol
    sequence (rows (k + 2) runs for k parameters; a power of two is best, 0 for none); changes with which the first output is at
    most `target`. `progress` is called with the fraction of the present stage. The other arguments are those of `Study`.
    """
    study = Study(scene, over, output, duration=duration, start_after=start_after)
    results = study._native.sensitivity(rows, screen, target, seed, threads or os.cpu_count() or 1, progress)
    keys, outputs = list(study.inputs), list(study.outputs)
    kept = [keys[i] for i in results["kept"]]
    effects = results["screening"]
    return Sensitivity(
        inputs=study.inputs,
        units=study.units | study.outputs,
        assumed_ranges=study.assumed_ranges,
        nominal=dict(zip(outputs, results["nominal"], strict=True)),
        alone={
            name: {
                key: Ends(low, at_low[o], high, at_high[o])
                for key, ((low, at_low), (high, at_high)) in zip(keys, results["alone"], strict=True)
            }
            for o, name in enumerate(outputs)
        },
        together=dict(zip(outputs, zip(*results["together"], strict=True), strict=True)),
        screening=effects and {key: one and Effects(*one) for key, one in zip(keys, effects, strict=True)},
        kept=kept,
        indices={name: _indices(kept, data) for name, data in zip(outputs, results["indices"])},
        target=results["target"] and _target(results["target"]),
        values=results["values"],
        results=results["results"],
    )


def _indices(kept: list[str], data: dict[str, Any]) -> Indices | str:
    if "fault" in data:
        return str(data["fault"])
    by_key = {name: {key: Estimate(*one) for key, one in zip(kept, data[name], strict=True)} for name in ("first", "total")}
    return Indices(data["mean"], data["variance"], **by_key)


def _target(data: dict[str, Any]) -> Target:
    def changes(pair: tuple[list[tuple[str, float]], float]) -> Changes:
        return Changes(dict(pair[0]), pair[1])

    together = data["together"]
    return Target(data["target"], [changes(one) for one in data["single"]], None if together is None else changes(together))


@dataclass(frozen=True)
class Quality:
    """Statistics of one limited output over a lot."""

    yield_: Estimate
    """Fraction of the lot that meets this limit."""
    mean: float
    """Mean of the units with a result, SI."""
    deviation: float
    """Standard deviation of the units with a result, SI."""
    percentiles: dict[int, Estimate | None]
    """50th, 95th and 99th percentile, SI; None without results."""
    cp: float | None
    """Process capability Cp; None with one limit, or without spread."""
    cpk: Estimate | None
    """Process capability Cpk; None without spread."""


class RejectDriver(NamedTuple):
    """How one parameter differs between rejected and accepted units."""

    mean_shift: float
    """Mean of the rejected minus mean of the accepted units, in standard deviations."""
    distance: float
    """Kolmogorov-Smirnov distance of the two distributions."""
    p_value: float
    """Probability of such a distance if the parameter has no influence."""


class FitChoice(NamedTuple):
    """One of the candidates of each parameter that has candidates."""

    fits: dict[str, str]
    """Fit of each parameter, as it was given."""
    cost: float
    """Sum of the costs."""
    yield_: Estimate
    """Fraction of the lot that meets all limits with these fits."""


@dataclass(frozen=True)
class Fits:
    """The cheapest fits that reach a required yield."""

    best: FitChoice | None
    """The cheapest choice found; None if even the tightest fits miss the yield."""
    is_proven: bool
    """Whether every cheaper choice is known to fail, provided that a tighter fit never lowers the yield."""
    evaluations: int
    """Number of choices that were evaluated."""
    check: Estimate | None
    """Yield of the best choice in another lot."""
    verdict: str | None
    """Whether the check confirms the required yield: `held` with 95 % confidence, `missed`, or `open` with too few units."""
    order_not_checked: list[str]
    """Parameters with a candidate without limits, which may not be tighter than the one before it."""


@dataclass(frozen=True)
class Tolerance:
    """Result of `tolerance`."""

    yield_: Estimate
    """Fraction of the lot that meets all limits."""
    qualities: dict[str, Quality]
    """Statistics of each limited output."""
    drivers: dict[str, RejectDriver] | None
    """How rejects differ from accepted units, by parameter; None if all units or none are accepted."""
    fits: Fits | None
    """The cheapest fits; None without `cost`."""
    assumed_ranges: dict[str, tuple[float, float]]
    """Ends, SI, of each range that was not given: 0.5 to 1.5 times the value, within the allowed range."""
    accepted: NDArray[np.bool_] = field(repr=False)
    """Whether each unit meets all limits."""
    values: NDArray[np.float64] = field(repr=False)
    """Values of the parameters of each unit, SI."""
    results: NDArray[np.float64] = field(repr=False)
    """Limited outputs of each unit, SI."""


def tolerance(
    scene: Scene,
    over: Over,
    limits: Mapping[str, Quantity | tuple[Quantity | None, Quantity | None]],
    *,
    units: int = 200,
    sampling: str = "latin-hypercube",
    seed: int = 1,
    cost: Mapping[str, Mapping[str, float]] | None = None,
    required_yield: float = 0.99,
    evaluations: int = 64,
    duration: Quantity | None = None,
    start_after: Quantity | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Tolerance:
    """Which fraction of a lot meets its limits, and what drives the rejects, as `jointplay tolerance` computes it.

    The lot has `units` units. `limits` has an upper limit for each output, or a lower and an upper one, of which one may be None.
    `sampling` is `sobol`, `latin-hypercube` or `random`.

    `cost` has the cost of each candidate of a parameter or pattern, from the loosest to the tightest:
    `{"joint.S1.clearance": {"H8/f7": 1.0, "H7/g6": 2.5}}`. With it, the result also has the cheapest fits with a yield of at
    least `required_yield`, found with at most `evaluations` evaluated choices. `progress` is called with the fraction of each
    lot. The other arguments are those of `Study`.
    """
    study = Study(scene, over, list(limits), duration=duration, start_after=start_after)
    ends = [end if isinstance(end, tuple) else (None, end) for end in limits.values()]
    priced = None if cost is None else [(key, fit, price) for key, of_key in cost.items() for fit, price in of_key.items()]
    results = study._native.tolerance(
        ends, units, sampling, seed, priced, required_yield, evaluations, threads or os.cpu_count() or 1, progress
    )
    drivers = results["drivers"]
    return Tolerance(
        yield_=Estimate(*results["yield"]),
        qualities={name: _quality(data) for name, data in zip(study.outputs, results["qualities"], strict=True)},
        drivers=None if drivers is None else {key: RejectDriver(*one) for key, one in zip(study.inputs, drivers, strict=True)},
        fits=results["fits"] and _fits(results["fits"]),
        assumed_ranges=study.assumed_ranges,
        accepted=np.array(results["accepted"]),
        values=results["values"],
        results=results["results"],
    )


def _quality(data: dict[str, Any]) -> Quality:
    def estimate(name: str) -> Estimate | None:
        return None if data[name] is None else Estimate(*data[name])

    return Quality(
        yield_=Estimate(*data["yield"]),
        mean=data["mean"],
        deviation=data["deviation"],
        percentiles={p: estimate(f"percentile_{p}") for p in (50, 95, 99)},
        cp=data["cp"],
        cpk=estimate("cpk"),
    )


def _fits(data: dict[str, Any]) -> Fits:
    best, check = data["best"], data["check"]
    return Fits(
        best=best and FitChoice(dict(best[1]), best[0], Estimate(*best[2])),
        is_proven=data["is_proven"],
        evaluations=data["evaluations"],
        check=check and Estimate(*check[0]),
        verdict=check and check[1],
        order_not_checked=data["order_not_checked"],
    )
