"""Parameters with which a scene moves as measured."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field
from functools import partial
from threading import Event
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._compare import Comparison, Measured, compare_at, filtered, read_measured
from ._distribution import resolve
from ._options import library, whole, workers
from ._study import Estimate, Over, Progress, requests, sample
from .errors import OptionError, SceneError, Stopped

if TYPE_CHECKING:
    from ._scene import Scene

Array = NDArray[np.float64]
CONFIDENCE = 0.95
SHIFT = "shift"
"""Name of the unknown time between the clocks, among the parameters."""
FAILED = 1e3
"""Residual of a run that fails, in units of the signal's deviation: worse than any other."""
FINER = 4
"""Rows of a run between two samples that are not at its rows."""


class FitStart(NamedTuple):
    """One of the points from which a fit started."""

    start: dict[str, float]
    """Parameters at the start, SI."""
    end: dict[str, float]
    """Parameters at the minimum found, SI."""
    misfit: float
    """Root mean square of the residuals there, each in units of the deviation of its measured signal; infinite if all runs failed."""


@dataclass(frozen=True)
class ParameterFit:
    """Result of `fit`."""

    values: dict[str, Estimate]
    """Each parameter with its 95 % interval, SI; without limits if the signals do not depend on it, or on several only together.
    With `max_shift`, the last one is `shift`, s."""
    units: dict[str, str]
    """SI unit of each parameter."""
    at_limit: list[str]
    """Parameters at an end of their range, whose interval says little."""
    correlation: Array = field(repr=False)
    """Correlation of the errors of the parameters."""
    scene: Scene
    """The scene with these values."""
    comparison: Comparison = field(repr=False)
    """Its run beside the measurement; `comparison.plot()` draws both, and the residuals."""
    starts: list[FitStart] = field(repr=False)
    """All starts, the best first."""
    runs: int
    """Number of runs."""


class _Model:
    """Residuals of a scene as a function of the places of its parameters within their ranges, 0 to 1. The last one is the time that
    is added to those of the measurement, s, if its range is not a point."""

    def __init__(
        self, scene: Scene, ranges: dict[str, tuple[float, float]], time: Array, measured: dict[str, Array], cutoff: float | None
    ) -> None:
        self.scene, self.cutoff = scene, cutoff
        self.keys = list(ranges)
        self.low, self.high = np.array(list(ranges.values())).T
        kept = time + self.low[-1] > -1e-9
        self.time, self.measured = time[kept], {name: own[kept] for name, own in measured.items()}
        if len(self.time) < 4 or len(self.time) * len(measured) <= len(ranges):
            raise OptionError(f"measured: {len(self.time)} samples from the start of the scene on are too few")
        is_known = self.low[-1] == self.high[-1]
        self.free = len(ranges) - int(is_known)
        times, step = self.time + self.high[-1], float(np.median(np.diff(self.time)))
        is_at_rows = is_known and np.allclose(times / step, (times / step).round(), rtol=0.0, atol=1e-6)
        self.every = step if is_at_rows else step / FINER
        self.duration = float(times[-1]) + 0.5 * self.every
        self.scales = {name: float(values.std()) or 1.0 for name, values in measured.items()}
        self.ended = Event()
        self.runs = 0

    def values(self, u: Array) -> dict[str, float]:
        """Parameters and shift at a place, SI."""
        place = np.zeros(len(self.keys))
        place[: self.free] = np.clip(u, 0.0, 1.0)
        return dict(zip(self.keys, (self.low + place * (self.high - self.low)).tolist(), strict=True))

    def signals(self, u: Array) -> tuple[Array, Array, dict[str, Array]]:
        """Times of the samples and of the rows, and values of the channels."""
        if self.ended.is_set():
            raise InterruptedError
        self.runs += 1
        values = self.values(u)
        times = (self.time + values.pop(SHIFT)).clip(0.0)
        run = self.scene.set(values).run(self.duration, self.every, channels=list(self.measured), warn=False)
        signals = {name: run[name] for name in self.measured}
        return times, *((run.time, signals) if self.cutoff is None else filtered("run", run.time, signals, self.cutoff))

    def residuals(self, u: Array) -> Array:
        """Computed minus measured values, each in units of the scale of its signal."""
        try:
            times, time, signals = self.signals(u)
        except (SceneError, Stopped):
            return np.full(len(self.time) * len(self.measured), FAILED)
        parts = [(np.interp(times, time, signals[name]) - own) / self.scales[name] for name, own in self.measured.items()]
        return np.concatenate(parts)

    def jacobian(self, u: Array, step: float) -> Array:
        """Derivatives of the residuals, by differences over `step` of each range to both sides, within it."""
        columns: list[Array] = []
        for i in range(len(u)):
            ends = np.clip([u[i] - step, u[i] + step], 0.0, 1.0)
            low, high = (self.residuals(np.where(np.arange(len(u)) == i, end, u)) for end in ends)
            columns.append((high - low) / (ends[1] - ends[0]))
        return np.stack(columns, axis=1)

    def minimum(self, start: Array, step: float) -> Any:
        """The minimum that SciPy finds from a start."""
        solve = library("scipy.optimize").least_squares
        return solve(
            self.residuals, start, partial(self.jacobian, step=step), bounds=(0.0, 1.0), x_scale=1.0, xtol=1e-9, ftol=1e-9
        )


def fit(
    scene: Scene,
    measured: Measured,
    over: Over,
    *,
    channels: Sequence[str] | None = None,
    shift: float = 0.0,
    max_shift: float = 0.0,
    cutoff: float | None = None,
    starts: int = 8,
    diff_step: float = 1e-3,
    seed: int = 1,
    threads: int | None = None,
    progress: Progress | None = None,
) -> ParameterFit:
    """Parameters with which `scene` moves as measured, by SciPy's `least_squares`.

    `measured`, `channels`, `shift` and `cutoff` are those of `compare`; times count from the start of the scene. With `max_shift`, s,
    the shift is one of the unknowns, at most so far from `shift`: a comparison with a scene whose parameters are wrong gives it only
    roughly. `over` has a range for each parameter, as in `Study`. The search begins at the values of the scene and at `starts` - 1 points spread over the
    ranges. Derivatives are differences over `diff_step` of each range to both sides: impacts make the motion depend on the
    parameters in kinks, past which the step must see. The best minimum is refined with each signal in units of its residuals.
    Its 95 % intervals are those of the linearised problem, for independent normal errors; with a `cutoff`, for as many
    independent samples as pass it. `threads` search from several starts at once, with the same result. `progress` is called with
    the fraction of the starts.
    """
    whole("starts", starts, 1, 1000)
    whole("seed", seed, 0, 2**63 - 1)
    if not 0.0 < diff_step <= 0.5:
        raise OptionError(f"diff_step = {diff_step}: allowed above 0 up to 0.5, a part of each range")
    ranges = {key: one.ends for request in requests(over) for key, one in resolve(scene, request).items()}
    if fixed := [key for key, (low, high) in ranges.items() if not low < high] or ([] if ranges else ["over"]):
        raise OptionError(f"{', '.join(fixed)}: give at least one parameter, and a range to each")
    channels_of = scene.channels
    known = {text: one.name for one in channels_of for text in (one.name, one.column)}
    time, values = read_measured(measured, known, channels, lambda name: f"`{name}` is not a channel of the scene")
    if cutoff is not None:
        time, values = filtered("measured", time, values, cutoff)
    model = _Model(scene, {**ranges, SHIFT: (shift - max_shift, shift + max_shift)}, time, values, cutoff)
    span = (model.high - model.low)[: model.free]
    at_scene = [float(scene.parameter(key).value or 0.0) for key in ranges] + [shift]
    own = ((np.array(at_scene) - model.low)[: model.free] / span).clip(0.0, 1.0)
    places = np.concatenate([own[None], sample("latin-hypercube", len(span), starts - 1, seed)]) if starts > 1 else own[None]
    found = _search(lambda start: model.minimum(start, diff_step), places, workers(threads), progress, model.ended)
    order = sorted(range(len(found)), key=lambda i: float(found[i].cost))
    count = len(model.time) * len(values)
    misfits = [float(np.sqrt(2.0 * one.cost / count)) for one in found]
    ends = [
        FitStart(model.values(places[i]), model.values(found[i].x), misfits[i] if misfits[i] < FAILED else np.inf) for i in order
    ]
    best = found[order[0]].x
    if not np.isfinite(ends[0].misfit):
        raise OptionError("over: no run from any start reaches the end of the measurement; give other ranges")
    parts = model.residuals(best).reshape(len(values), -1)
    for name, residual in zip(values, parts, strict=True):
        model.scales[name] *= float(np.sqrt(np.mean(residual**2))) or 1.0
    refined = model.minimum(best, diff_step)
    u, errors, correlation = refined.x, *_errors(refined, model.jacobian(refined.x, diff_step), cutoff, time)
    answer, keys, half = model.values(u), model.keys[: model.free], (errors * span).tolist()
    times, rows, signals = model.signals(u)
    units = {one.name: one.unit for one in channels_of}
    return ParameterFit(
        values={key: Estimate(answer[key], answer[key] - h, answer[key] + h) for key, h in zip(keys, half, strict=True)},
        units={key: "s" if key == SHIFT else scene.parameter(key).unit for key in keys},
        at_limit=[key for key, place in zip(keys, u, strict=True) if min(place, 1.0 - place) < diff_step],
        correlation=correlation,
        scene=scene.set({key: answer[key] for key in ranges}),
        comparison=compare_at(rows, signals, times, model.measured, units, answer[SHIFT], cutoff),
        starts=ends,
        runs=model.runs,
    )


def _search(minimum: Callable[[Array], Any], places: Array, threads: int, progress: Progress | None, ended: Event) -> list[Any]:
    """Minima from all places, in their order."""
    with ThreadPoolExecutor(min(threads, len(places))) as pool:
        tasks = [pool.submit(minimum, place) for place in places]
        try:
            for done, _ in enumerate(as_completed(tasks), 1):
                if progress is not None:
                    progress(done / len(tasks))
            return [task.result() for task in tasks]
        except BaseException:
            ended.set()
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def _errors(refined: Any, jacobian: Array, cutoff: float | None, time: Array) -> tuple[Array, Array]:
    """Half widths of the intervals, as parts of the ranges, and correlations of the errors."""
    n, k = map(int, jacobian.shape)
    rate = 1.0 / float(np.median(np.diff(time)))
    independent = n if cutoff is None else n * min(1.0, 2.0 * cutoff / rate)
    free = max(independent - k, 1.0)
    sizes = np.linalg.svd(jacobian, compute_uv=False)
    if not sizes[-1] > 1e-9 * sizes[0]:
        return np.full(k, np.inf), np.full((k, k), np.nan)
    # Each of the independent samples counts as n / independent of those here.
    covariance: Array = 2.0 * refined.cost / free * np.linalg.inv(jacobian.T @ jacobian)
    deviation: Array = np.sqrt(np.diag(covariance))
    student = float(library("scipy.stats").t.ppf(0.5 + 0.5 * CONFIDENCE, free))
    return student * deviation, covariance / np.outer(deviation, deviation)
