"""Studies: runs of a scene at values of its uncertain parameters, reduced to a few numbers."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._distribution import Distribution, Request, resolve
from ._options import is_a, library, workers
from .errors import DoubtWarning, OptionError

if TYPE_CHECKING:
    from ._scene import Quantity, Scene

Over = Mapping[str, str | None] | Sequence[str | Request]
"""Parameters by key or pattern, each with a distribution as text, or None for 0.5 to 1.5 times its value."""
Progress = Callable[[float], object]

DIVERGED = 1
"""Status of a run that the divergence guard stopped."""
NOT_STARTED = 2
"""Status of a run that did not start."""


class Estimate(NamedTuple):
    """An estimate with its 95 % interval."""

    value: float
    """Best value."""
    low: float
    """Lower end of the interval; -inf if unknown."""
    high: float
    """Upper end of the interval; inf if unknown."""


class Runs(NamedTuple):
    """Runs of one stage of a study."""

    values: NDArray[np.float64]
    """Values of the parameters, SI: one row per run, one column per parameter."""
    results: NDArray[np.float64]
    """Outputs, SI: one row per run, one column per output; NaN for a run that fails."""
    status: NDArray[np.int64]
    """How each run ended: 0 at its end, 1 stopped by the divergence guard, 2 not started."""


class Study:
    """Runs of a scene over uncertain parameters, reduced to a few numbers: a model function for other libraries."""

    def __init__(
        self,
        scene: Scene,
        over: Over,
        output: str | Sequence[str] = "tip-error",
        *,
        duration: Quantity | None = None,
        from_: Quantity | None = None,
    ) -> None:
        """A study of `scene` over parameters with distributions.

        `over` has a distribution for each key or pattern: `"0.05mm..0.2mm"`, `"normal(0.15, 0.02)"`, `"H7/g6"` …
        (`docs/uncertainty.md`), or None for 0.5 to 1.5 times the value. `output` names the numbers recorded of each run:
        `tip-error`, `tip-error-rms`, `peak-force`, `impacts`, `energy-lost`, or CHANNEL:STATISTIC. A run takes `duration`, s, and
        is observed from `from_`, s, on; by default three periods of the drives, the first of them a transient.
        """
        self.scene = scene
        """The scene."""
        self._over = requests(over)
        names = output.split(",") if isinstance(output, str) else output
        if not is_a(names, Sequence) or not all(is_a(name, str) for name in names):
            raise OptionError(f"output = {output!r}: expected text such as \"tip-error\", or a list of texts")
        self._entries = [entry.strip() for entry in names]
        self._span = duration, from_
        # Raises errors here, not at the first use. The ends of all distributions are checked.
        self.native.alone([one.ends for one in self.distributions.values()])

    @cached_property
    def distributions(self) -> dict[str, Distribution]:
        """Distribution of each parameter."""
        found: dict[str, Distribution] = {}
        for request in self._over:
            found |= resolve(self.scene, request)
        if not found:
            raise OptionError("over: give at least one parameter")
        return found

    @cached_property
    def native(self) -> _native.Study:
        """The compiled study, for the modules of the package."""
        return _native.Study(self.scene.native, list(self.distributions), self._entries, *self._span)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name not in ("native", "distributions")}

    @property
    def inputs(self) -> dict[str, float]:
        """Value in the scene, SI, of each parameter."""
        return {key: value for key, (value, _) in zip(self.distributions, self.native.inputs, strict=True)}

    @property
    def units(self) -> dict[str, str]:
        """SI unit of each parameter; empty for one without."""
        return {key: unit for key, (_, unit) in zip(self.distributions, self.native.inputs, strict=True)}

    @property
    def assumed_ranges(self) -> dict[str, tuple[float, float]]:
        """Ends, SI, of each range that was not given: 0.5 to 1.5 times the value, within the allowed range."""
        return {key: one.ends for key, one in self.distributions.items() if one.is_assumed}

    @property
    def outputs(self) -> dict[str, str]:
        """Unit of each output."""
        return {name: unit for name, unit, _ in self.native.outputs}

    @property
    def span(self) -> tuple[float, float]:
        """Length of each run and end of its transient, s."""
        return self.native.span

    def run(
        self,
        values: Any,
        *,
        threads: int | None = None,
        progress: Progress | None = None,
        record: str | os.PathLike[str] | None = None,
    ) -> NDArray[np.float64]:
        """Outputs, SI, at `values`, one row per run and one column per parameter, SI.

        A flat list is one run, or with one parameter one run per value. A row with a value that is not finite, or whose run fails,
        gives NaN, and a `jp.DoubtWarning` names it. With `record`, finished runs are kept in this file, and an interrupted call resumes when it is repeated. The file stays.
        """
        runs = compute(self, values, threads, progress, None if record is None else Path(record))
        if failed := [f"values[{i}] {self._why(runs, i)}" for i in np.flatnonzero(runs.status).tolist()]:
            more = f" and {len(failed) - 8} more" if len(failed) > 8 else ""
            warnings.warn(f"{self.scene.name}: no result: {', '.join(failed[:8])}{more}", DoubtWarning, stacklevel=2)
        return runs.results

    def _why(self, runs: Runs, row: int) -> str:
        if not np.isfinite(runs.values[row]).all():
            return f"= {runs.values[row].tolist()} is not finite"
        return "diverged" if runs.status[row] == DIVERGED else "did not start"

    def __repr__(self) -> str:
        return f"<jointplay.Study of {self.scene.name}: {', '.join(self.outputs)} over {len(self.distributions)} parameters>"


def compute(study: Study, values: Any, threads: int | None, progress: Progress | None, record: Path | None) -> Runs:
    """Runs at `values`, one row per run."""
    table, count = _table(study, values), workers(threads)
    finite = np.isfinite(table).all(axis=1)
    given = table[finite]
    status = np.full(len(table), NOT_STARTED, dtype=np.int64)
    results = np.full((len(table), len(study.outputs)), np.nan)
    if len(given) or not len(table):
        if len(given):
            # All values are allowed if the extremes are.
            study.native.alone(list(zip(given.min(0).tolist(), given.max(0).tolist(), strict=True)))
        finished = study.native.run(given.tolist(), count, progress, record)
        status[finite] = finished[:, -1]
        results[finite] = np.where(finished[:, -1:] == 0, finished[:, :-1], np.nan)
    return Runs(table, results, status)


def _table(study: Study, values: Any) -> NDArray[np.float64]:
    """Values with one row per run."""
    keys = list(study.distributions)
    expected = f"expected numbers in SI units, one row per run and one column for each of {', '.join(keys)}"
    try:
        table = np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise OptionError(f"values: {expected}: {error}") from None
    if table.ndim < 2:
        table = table.reshape(-1, 1) if len(keys) == 1 else table.reshape(1, -1)
    if table.ndim != 2 or table.shape[1] != len(keys):
        given = f"{table.shape[1]} numbers are given for {len(keys)} parameters" if table.ndim == 2 else f"shape {table.shape}"
        raise OptionError(f"values: {given}: {expected}")
    return table


def requests(over: Over) -> list[Request]:
    """`over` in its general form."""
    if isinstance(over, Mapping):
        return [Request("over", key, text) for key, text in over.items()]
    entries: Sequence[Any] = [over] if isinstance(over, str) else over
    if not is_a(entries, Sequence) or not all(isinstance(one, (str, Request)) for one in entries):
        raise OptionError(f"over = {over!r}: expected a mapping of keys to distributions, or a list of keys")
    return [one if isinstance(one, Request) else Request("over", one, None) for one in entries]


def record_of(path: str | os.PathLike[str], stage: str) -> Path:
    """Record of one stage of a study whose records begin with `path`."""
    return Path(f"{os.fspath(path)}.{stage}.partial")


class Stages:
    """Runs of a study, stage by stage."""

    def __init__(
        self,
        study: Study,
        threads: int | None,
        progress: Progress | None,
        record: str | os.PathLike[str] | None,
    ) -> None:
        self.study = study
        self.threads = threads
        self.progress = progress
        self.record = record
        self.runs: dict[str, Runs] = {}

    def run(self, stage: str, values: Any) -> NDArray[np.float64]:
        """Outputs at `values`, SI."""
        record = None if self.record is None else record_of(self.record, stage)
        self.runs[stage] = compute(self.study, values, self.threads, self.progress, record)
        return self.runs[stage].results

    def count(self, status: int) -> int:
        """Number of runs that ended with a status."""
        return sum(int((runs.status == status).sum()) for runs in self.runs.values())

    def at(self, u: NDArray[np.float64], kept: Sequence[int] | None = None) -> NDArray[np.float64]:
        """Values of all parameters where those that are `kept`, by default all, have the quantiles `u`."""
        study = self.study
        values = np.tile(list(study.inputs.values()), (len(u), 1))
        distributions = list(study.distributions.values())
        for column, i in enumerate(range(len(distributions)) if kept is None else kept):
            values[:, i] = distributions[i].quantile(u[:, column])
        return values


SAMPLINGS = ("sobol", "latin-hypercube", "random")


def sample(sampling: str, dimensions: int, points: int, seed: int) -> NDArray[np.float64]:
    """Points in the unit cube, away from its faces, where the quantiles of distributions without limits are infinite."""
    if sampling not in SAMPLINGS:
        raise OptionError(f"sampling = {sampling!r}: there are: {', '.join(SAMPLINGS)}")
    if sampling == "random":
        unit = np.random.default_rng(seed).random((points, dimensions))
    elif sampling == "sobol":
        # The whole sequence up to a power of two: SciPy warns about a part of it.
        unit = library("scipy.stats.qmc").Sobol(dimensions, rng=seed).random_base2(max(points - 1, 1).bit_length())[:points]
    else:
        unit = library("scipy.stats.qmc").LatinHypercube(dimensions, rng=seed).random(points)
    return np.clip(unit, 2.0**-31, 1.0 - 2.0**-31)


def read_quantity(study: Study, o: int, value: Quantity) -> float:
    """A value of output `o`: a number in SI units, or text with a unit."""
    if isinstance(value, str):
        return study.native.read_output(o, value)
    if isinstance(value, bool) or not np.isfinite(value):
        raise OptionError(f"{value!r}: expected a finite number in SI units, or text with a unit")
    return float(value)
