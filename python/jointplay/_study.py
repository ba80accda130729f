"""Studies of uncertain parameters: which of them matter, and what part of a lot holds its limits."""

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
"""Parameters by key or pattern, each with a distribution as text, or None: half to one and a half of its value."""
Progress = Callable[[float], object]


class Estimate(NamedTuple):
    """An estimate with its interval of 95 %."""

    value: float
    """Best value."""
    low: float
    """Lower end of the interval."""
    high: float
    """Upper end of the interval."""


class Study:
    """Runs of a scene over uncertain parameters, reduced to a few numbers: the model that other libraries call."""

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
        `"normal(0.15, 0.02)"`, `"H7/g6"`, or None for half to one and a half of the value. `output` names what each run is
        reduced to: `tip-error`, `tip-error-rms`, `peak-force`, `impacts`, `energy-lost`, or CHANNEL:STATISTIC. A run takes
        `duration`, s, and is observed from `start_after`, s, on; by default three periods of the drives, the first a transient.
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
        """Ends, SI, of each range that was not given: half to one and a half of the value, within what is allowed."""
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
    """Mean size of the effect: the influence of the parameter."""
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
    """How far parameters must go for the first output to be no larger than a target."""

    target: float
    """Largest allowed value of the first output, SI."""
    single: list[Changes]
    """Changes of one parameter that suffice, each the smallest that was run."""
    together: Changes | None
    """Where none suffices: changes of several. Without values if the scene holds the target; None if nothing reaches it."""


@dataclass(frozen=True)
class Sensitivity:
    """Result of `sensitivity`."""

    inputs: dict[str, float]
    """Value in the scene, SI, of each parameter."""
    units: dict[str, str]
    """SI unit of each parameter and output."""
    assumed_ranges: dict[str, tuple[float, float]]
    """Ends, SI, of each range that was not given: half to one and a half of the value, within what is allowed."""
    nominal: dict[str, float]
    """Each output with the values of the scene, SI."""
    alone: dict[str, dict[str, Ends]]
    """For each output, every parameter alone."""
    together: dict[str, tuple[float, float]]
    """Each output with all parameters at their lower ends, and at their upper ends, SI."""
    screening: dict[str, Effects | None] | None
    """Effects of each parameter (None without results) on the first output; None without a screening."""
    kept: list[str]
    """Parameters of the indices; a screening leaves out the others."""
    indices: dict[str, Indices | str]
    """Indices of each output, or why there are none; empty with rows=0."""
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
                    found = getattr(indices, of_key).get(key) if isinstance(indices, Indices) else None
                    row |= dict(zip((name, f"{name}_low", f"{name}_high"), found or UNKNOWN, strict=True))
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

    Every parameter alone; a screening with `screen` trajectories (10 by default if more than 8 parameters vary, else none), which
    leaves out of the rest what hardly matters; first-order and total indices from `rows` rows of a Sobol sequence, rows (k + 2)
    runs for k parameters, for which a power of two is best (0 for none); changes after which the first output is at most
    `target`. `progress` is called with the part of each of these stages that is done. The other arguments are those of `Study`.
    """
    study = Study(scene, over, output, duration=duration, start_after=start_after)
    found = study._native.sensitivity(rows, screen, target, seed, threads or os.cpu_count() or 1, progress)
    keys, outputs = list(study.inputs), list(study.outputs)
    kept = [keys[i] for i in found["kept"]]
    effects = found["screening"]
    return Sensitivity(
        inputs=study.inputs,
        units=study.units | study.outputs,
        assumed_ranges=study.assumed_ranges,
        nominal=dict(zip(outputs, found["nominal"], strict=True)),
        alone={
            name: {
                key: Ends(low, at_low[o], high, at_high[o])
                for key, ((low, at_low), (high, at_high)) in zip(keys, found["alone"], strict=True)
            }
            for o, name in enumerate(outputs)
        },
        together=dict(zip(outputs, zip(*found["together"], strict=True), strict=True)),
        screening=effects and {key: own and Effects(*own) for key, own in zip(keys, effects, strict=True)},
        kept=kept,
        indices={name: _indices(kept, own) for name, own in zip(outputs, found["indices"])},
        target=found["target"] and _target(found["target"]),
        values=found["values"],
        results=found["results"],
    )


def _indices(kept: list[str], own: dict[str, Any]) -> Indices | str:
    if "fault" in own:
        return str(own["fault"])
    by_key = {name: {key: Estimate(*one) for key, one in zip(kept, own[name], strict=True)} for name in ("first", "total")}
    return Indices(own["mean"], own["variance"], **by_key)


def _target(own: dict[str, Any]) -> Target:
    def changes(found: tuple[list[tuple[str, float]], float]) -> Changes:
        return Changes(dict(found[0]), found[1])

    together = own["together"]
    return Target(own["target"], [changes(one) for one in own["single"]], None if together is None else changes(together))


@dataclass(frozen=True)
class Quality:
    """Statistics of one limited output over a lot."""

    yield_: Estimate
    """Part of the lot that holds this limit."""
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
    """Mean over the rejects less mean over the accepted, in standard deviations."""
    distance: float
    """Kolmogorov-Smirnov distance of the two distributions."""
    p_value: float
    """Probability of such a distance if the parameter has no influence."""


class FitChoice(NamedTuple):
    """A candidate for each parameter that has any."""

    fits: dict[str, str]
    """Fit of each parameter, as it was given."""
    cost: float
    """Sum of the costs."""
    yield_: Estimate
    """Part of the lot that holds all limits with these fits."""


@dataclass(frozen=True)
class Fits:
    """The cheapest fits that hold a required yield."""

    best: FitChoice | None
    """The cheapest choice found; None if not even the tightest fits hold the yield."""
    is_proven: bool
    """Whether every cheaper choice is known to fail, if a tighter fit never lowers the yield."""
    evaluations: int
    """Choices that were tried."""
    check: Estimate | None
    """Yield of the best choice in another lot."""
    verdict: str | None
    """What the check says about the required yield: `held` with 95 % confidence, `missed`, or `open` for too few units."""
    order_not_checked: list[str]
    """Parameters with a candidate without limits, of which it is not known whether it is tighter than the one before it."""


@dataclass(frozen=True)
class Tolerance:
    """Result of `tolerance`."""

    yield_: Estimate
    """Part of the lot that holds all limits."""
    qualities: dict[str, Quality]
    """Statistics of each limited output."""
    drivers: dict[str, RejectDriver] | None
    """What distinguishes the rejects, by parameter; None if all units or none are accepted."""
    fits: Fits | None
    """The cheapest fits; None without `cost`."""
    assumed_ranges: dict[str, tuple[float, float]]
    """Ends, SI, of each range that was not given: half to one and a half of the value, within what is allowed."""
    accepted: NDArray[np.bool_] = field(repr=False)
    """Whether each unit holds all limits."""
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
    """What part of a lot of `units` units holds its limits, and what drives the rejects, as `jointplay tolerance` computes them.

    `limits` has an upper limit for each output, or a lower and an upper one, of which one may be None. `sampling` is `sobol`,
    `latin-hypercube` or `random`.

    With `cost`, the result also has the cheapest fits with a yield of at least `required_yield`, of at most `evaluations` choices
    that are tried. It has the cost of each candidate of a parameter or pattern, from the loosest to the tightest:
    `{"joint.S1.clearance": {"H8/f7": 1.0, "H7/g6": 2.5}}`. `progress` is called with the part of each lot that is done. The other
    arguments are those of `Study`.
    """
    study = Study(scene, over, list(limits), duration=duration, start_after=start_after)
    ends = [end if isinstance(end, tuple) else (None, end) for end in limits.values()]
    priced = None if cost is None else [(key, fit, price) for key, of_key in cost.items() for fit, price in of_key.items()]
    found = study._native.tolerance(
        ends, units, sampling, seed, priced, required_yield, evaluations, threads or os.cpu_count() or 1, progress
    )
    drivers = found["drivers"]
    return Tolerance(
        yield_=Estimate(*found["yield"]),
        qualities={name: _quality(own) for name, own in zip(study.outputs, found["qualities"], strict=True)},
        drivers=None if drivers is None else {key: RejectDriver(*own) for key, own in zip(study.inputs, drivers, strict=True)},
        fits=found["fits"] and _fits(found["fits"]),
        assumed_ranges=study.assumed_ranges,
        accepted=np.array(found["accepted"]),
        values=found["values"],
        results=found["results"],
    )


def _quality(own: dict[str, Any]) -> Quality:
    def estimate(name: str) -> Estimate | None:
        return None if own[name] is None else Estimate(*own[name])

    return Quality(
        yield_=Estimate(*own["yield"]),
        mean=own["mean"],
        deviation=own["deviation"],
        percentiles={p: estimate(f"percentile_{p}") for p in (50, 95, 99)},
        cp=own["cp"],
        cpk=estimate("cpk"),
    )


def _fits(own: dict[str, Any]) -> Fits:
    best, check = own["best"], own["check"]
    return Fits(
        best=best and FitChoice(dict(best[1]), best[0], Estimate(*best[2])),
        is_proven=own["is_proven"],
        evaluations=own["evaluations"],
        check=check and Estimate(*check[0]),
        verdict=check and check[1],
        order_not_checked=own["order_not_checked"],
    )
