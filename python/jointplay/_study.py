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
        return dict(self._native.inputs)

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


@dataclass(frozen=True)
class Sensitivity:
    """Result of `sensitivity`."""

    inputs: dict[str, float]
    """Value in the scene, SI, of each parameter."""
    indices: dict[str, Indices | str]
    """Indices of each output, or why there are none."""
    values: NDArray[np.float64] = field(repr=False)
    """Values of the parameters in each run, SI."""
    results: NDArray[np.float64] = field(repr=False)
    """Outputs of each run, SI."""

    def to_pandas(self) -> pandas.DataFrame:
        """One row per output and parameter."""
        import pandas

        rows = [
            {"output": output, "parameter": key}
            | {f"{name}{end}": value for name in ("first", "total") for end, value in _ends(getattr(own, name)[key])}
            for output, own in self.indices.items()
            if isinstance(own, Indices)
            for key in self.inputs
        ]
        return pandas.DataFrame(rows)


def _ends(estimate: Estimate) -> list[tuple[str, float]]:
    return list(zip(("", "_low", "_high"), estimate, strict=True))


def sensitivity(
    scene: Scene,
    over: Over,
    output: str | Sequence[str] = "tip-error",
    *,
    rows: int = 64,
    seed: int = 1,
    duration: Quantity | None = None,
    start_after: Quantity | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Sensitivity:
    """First-order and total indices of uncertain parameters, as `jointplay sensitivity` computes them without a screening.

    The design has `rows` rows of a Sobol sequence, rows (k + 2) runs for k parameters; a power of two is best. The other
    arguments are those of `Study`.
    """
    study = Study(scene, over, output, duration=duration, start_after=start_after)
    found = study._native.indices(rows, seed, threads or os.cpu_count() or 1, progress)
    return Sensitivity(
        inputs=study.inputs,
        indices={name: _indices(study, own) for name, own in zip(study.outputs, found["indices"], strict=True)},
        values=found["values"],
        results=found["results"],
    )


def _indices(study: Study, own: dict[str, Any]) -> Indices | str:
    if "fault" in own:
        return str(own["fault"])
    by_key = {
        name: {key: Estimate(*one) for key, one in zip(study.inputs, own[name], strict=True)} for name in ("first", "total")
    }
    return Indices(own["mean"], own["variance"], **by_key)


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


@dataclass(frozen=True)
class Tolerance:
    """Result of `tolerance`."""

    yield_: Estimate
    """Part of the lot that holds all limits."""
    qualities: dict[str, Quality]
    """Statistics of each limited output."""
    drivers: dict[str, RejectDriver] | None
    """What distinguishes the rejects, by parameter; None if all units or none are accepted."""
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
    duration: Quantity | None = None,
    start_after: Quantity | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Tolerance:
    """What part of a lot of `units` units holds its limits, and what drives the rejects, as `jointplay tolerance` computes them.

    `limits` has an upper limit for each output, or a lower and an upper one, of which one may be None. `sampling` is `sobol`,
    `latin-hypercube` or `random`. The other arguments are those of `Study`.
    """
    study = Study(scene, over, list(limits), duration=duration, start_after=start_after)
    ends = [end if isinstance(end, tuple) else (None, end) for end in limits.values()]
    found = study._native.lot(ends, units, sampling, seed, threads or os.cpu_count() or 1, progress)
    drivers = found["drivers"]
    return Tolerance(
        yield_=Estimate(*found["yield"]),
        qualities={name: _quality(own) for name, own in zip(study.outputs, found["qualities"], strict=True)},
        drivers=None if drivers is None else {key: RejectDriver(*own) for key, own in zip(study.inputs, drivers, strict=True)},
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
