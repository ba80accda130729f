"""Measured signals beside those of a run: aligned in time, filtered, and compared."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._options import library
from ._scene import Run, explain, recorded
from ._table import read_cells
from .errors import ChannelError, OptionError

if TYPE_CHECKING:
    import pandas

Array = NDArray[np.float64]
Measured = str | os.PathLike[str] | Mapping[str, Any]
"""A CSV file, or columns by name (a mapping or data frame): `time` or `t_s`, s, and channels by name or column, SI."""
ORDER = 4
"""Order of the Butterworth filter, which is applied forwards and backwards."""
TIME = ("time", "t_s")


@dataclass(frozen=True)
class Comparison:
    """Result of `compare`. SI, on the clock of the run; arrays by channel have one value per sample within the run."""

    shift: float
    """Time that is added to those of the measurement, s."""
    cutoff: float | None
    """Cut-off frequency of the filter, Hz; None without one."""
    rms: dict[str, float]
    """Root mean square of the difference of each channel."""
    correlation: dict[str, float]
    """Pearson's correlation of both signals of each channel; NaN if one is constant."""
    units: dict[str, str]
    """Unit of each channel."""
    time: Array = field(repr=False)
    """Time of each sample, s."""
    measured: dict[str, Array] = field(repr=False)
    """Measured values, filtered."""
    computed: dict[str, Array] = field(repr=False)
    """Values of the run at these times, filtered."""

    @property
    def residuals(self) -> dict[str, Array]:
        """Computed minus measured values."""
        return {name: values - self.measured[name] for name, values in self.computed.items()}

    def plot(self, axes: Any = None) -> Any:
        """Draws both signals and their difference, a row for each channel, into new axes of Matplotlib, or `axes` of this shape:
        (channels, 2). Returns the axes."""
        if axes is None:
            shape = {"squeeze": False, "sharex": True, "figsize": (10.0, 0.6 + 2.6 * len(self.rms)), "layout": "constrained"}
            axes = library("matplotlib.pyplot").subplots(len(self.rms), 2, **shape)[1]
        for (name, unit), (both, difference) in zip(self.units.items(), axes, strict=True):
            both.plot(self.time, self.measured[name], label="measured")
            both.plot(self.time, self.computed[name], label="computed")
            difference.plot(self.time, self.residuals[name])
            label = f"{name}, {unit}" if unit else name
            both.set(xlabel="time, s", ylabel=label)
            difference.set(xlabel="time, s", ylabel=f"computed - measured, {unit}" if unit else "computed - measured")
            both.legend()
        return axes

    def to_pandas(self) -> pandas.DataFrame:
        """One row per channel."""
        library("pandas", "pandas")
        import pandas

        rows = [(name, self.units[name], self.shift, self.rms[name], self.correlation[name]) for name in self.rms]
        return pandas.DataFrame(rows, columns=["channel", "unit", "shift_s", "rms", "correlation"])


def compare(
    run: Run,
    measured: Measured,
    channels: Sequence[str] | None = None,
    *,
    shift: float | None = None,
    max_shift: float | None = None,
    cutoff: float | None = None,
) -> Comparison:
    """Measured signals beside those of a run.

    `measured` is a CSV file or a mapping of columns; all its columns are compared, or `channels`. `shift`, s, is added to its
    times; by default it is the one, of at most `max_shift`, with the largest correlation of both signals, averaged over the
    channels, where at least half of the shorter one overlaps. With `cutoff`, Hz, both pass a Butterworth filter of fourth order,
    forwards and backwards: without a delay, and with half the amplitude at the cut-off. Between its rows the run is interpolated
    linearly.
    """
    time, values = read_measured(measured, recorded(run), channels, lambda name: explain(run, name))
    computed = {name: run[name] for name in values}
    if cutoff is not None:
        time, values = filtered("measured", time, values, cutoff)
        _, computed = filtered("run", run.time, computed, cutoff)
    if shift is None:
        shift = find_shift(run.time, computed, time, values, max_shift)
    return compare_at(run.time, computed, time + shift, values, run.units, shift, cutoff)


def compare_at(
    time: Array,
    computed: Mapping[str, Array],
    times: Array,
    measured: Mapping[str, Array],
    units: Mapping[str, str],
    shift: float,
    cutoff: float | None,
) -> Comparison:
    """Compares signals on the same clock."""
    within = (times >= time[0] - 1e-9) & (times <= time[-1] + 1e-9)
    if within.sum() < 2:
        spans = f"{times[0]:.6g} s to {times[-1]:.6g} s, the run {time[0]:.6g} s to {time[-1]:.6g} s"
        raise OptionError(f"measured: with the shift its times are {spans}: fewer than two samples are within it")
    own = {name: np.interp(times[within], time, values) for name, values in computed.items()}
    other = {name: values[within] for name, values in measured.items()}
    rms = {name: float(np.sqrt(np.mean((own[name] - other[name]) ** 2))) for name in own}
    return Comparison(
        shift=float(shift),
        cutoff=cutoff,
        rms=rms,
        correlation={name: _pearson(own[name], other[name]) for name in own},
        units={name: units[name] for name in own},
        time=times[within],
        measured=other,
        computed=own,
    )


def _pearson(a: Array, b: Array) -> float:
    a, b = a - a.mean(), b - b.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / size if size else np.nan


def read_measured(
    measured: Measured, known: Mapping[str, str], channels: Sequence[str] | None, explain: Callable[[str], str]
) -> tuple[Array, dict[str, Array]]:
    """Times, s, and values by channel. `known` has the channels by name and column; `explain` says why one is not known."""
    if isinstance(measured, (str, os.PathLike)):
        file = os.fspath(measured)
        (_, heads), *rows = read_cells(file, Path(file), "a heading of time and channels, and below it one row per sample")
        table = [[_number(place, head, cell) for head, cell in zip(heads, cells, strict=True)] for place, cells in rows]
        columns = dict(zip(heads, np.array(table).T, strict=True))
    else:
        file = "measured"
        columns = {str(name): np.asarray(measured[name], dtype=float) for name in measured}
    clock = next((name for name in TIME if name in columns), None)
    if clock is None:
        raise OptionError(
            f"{file}: a column {' or '.join(TIME)} is missing, with the times in s; there are: {', '.join(columns)}"
        )
    time = columns.pop(clock)
    wanted = list(columns) if channels is None else [channels] if isinstance(channels, str) else list(channels)
    found: dict[str, Array] = {}
    for name in wanted:
        if name not in known:
            raise ChannelError(f"{file}: {explain(name)}; channels=[…] selects the columns to compare")
        column = next((one for one in columns if known.get(one) == known[name]), None)
        if column is None:
            near = get_close_matches(name, columns, n=1)
            raise ChannelError(f"{file}: it has no column {name}" + (f" (did you mean `{near[0]}`?)" if near else ""))
        found[known[name]] = columns[column]
    if not found:
        raise OptionError(f"{file}: it has no column besides the time")
    for name, values in found.items():
        if values.shape != time.shape or time.ndim != 1:
            raise OptionError(
                f"{file}: {name} has the shape {values.shape}, the time {time.shape}: expected two flat lists, equally long"
            )
        if not np.isfinite(values).all():
            raise OptionError(f"{file}: {name} has no finite number in row {int(np.flatnonzero(~np.isfinite(values))[0]) + 1}")
    if len(time) < 4 or not np.isfinite(time).all() or not (np.diff(time) > 0.0).all():
        raise OptionError(f"{file}: the times must rise from row to row, and there must be four or more")
    return time, found


def _number(place: str, head: str, cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        raise OptionError(f"{place}: {head} = {cell!r}: expected a number in SI units") from None


def evenly(time: Array, values: Mapping[str, Array], step: float) -> tuple[Array, dict[str, Array]]:
    """The signals at equal intervals."""
    grid = time[0] + step * np.arange(int((time[-1] - time[0]) / step + 1e-6) + 1)
    return grid, {name: np.interp(grid, time, own) for name, own in values.items()}


def filtered(what: str, time: Array, values: Mapping[str, Array], cutoff: float) -> tuple[Array, dict[str, Array]]:
    """The signals behind the filter, at equal intervals if they were at others."""
    step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    if not 0.0 < cutoff < (0.5 / step if step else 0.0):
        limit = f"above 0 Hz to below {0.5 / step:.6g} Hz, half the rate of the samples" if step else "none for one row"
        raise OptionError(f"cutoff = {cutoff} ({what}): allowed {limit}")
    if not np.allclose(np.diff(time), step, rtol=1e-6, atol=0.0):
        time, values = evenly(time, values, step)
    signal = library("scipy.signal")
    stages = signal.butter(ORDER, cutoff, fs=1.0 / step, output="sos")
    length = min(len(time) - 1, int(3.0 / (cutoff * step)))
    return time, {name: signal.sosfiltfilt(stages, own, padlen=length) for name, own in values.items()}


def find_shift(
    time: Array, computed: Mapping[str, Array], times: Array, measured: Mapping[str, Array], most: float | None
) -> float:
    """Time to add to `times`, s, for the largest correlation, averaged over the channels."""
    correlate = library("scipy.signal").correlate
    step = min(float(np.median(np.diff(one))) for one in (time, times))
    start, own = evenly(time, computed, step)
    other_start, other = evenly(times, measured, step)
    lags = start[0] - other_start[0] + step * np.arange(1 - len(other_start), len(start))
    ones, other_ones = np.ones(len(start)), np.ones(len(other_start))
    count = correlate(ones, other_ones).round()
    allowed = count >= 0.5 * min(len(start), len(other_start))
    if most is not None:
        allowed &= np.abs(lags) <= most + 1e-9 * step
    if not allowed.any():
        raise OptionError(f"max_shift = {most}: no such shift leaves an overlap of half of the shorter signal; give the shift")
    quality = np.zeros(len(lags))
    for name in own:
        a, b = (one[name] - one[name].mean() for one in (own, other))
        a, b = (one / (one.std() or 1.0) for one in (a, b))
        # Pearson's correlation over the overlap of each lag.
        of_a, of_b = correlate(a, other_ones), correlate(ones, b)
        both = correlate(a, b) - of_a * of_b / count.clip(1.0)
        spread_a = correlate(a * a, other_ones) - of_a**2 / count.clip(1.0)
        spread_b = correlate(ones, b * b) - of_b**2 / count.clip(1.0)
        size = np.sqrt((spread_a * spread_b).clip(0.0))
        quality += np.divide(both, size, out=np.zeros_like(both), where=size > 1e-6 * count)
    quality[~allowed] = -np.inf
    best = int(quality.argmax())
    # The top of the parabola through the best lag and its neighbours.
    offset = 0.0
    if 0 < best < len(lags) - 1 and np.isfinite(quality[best - 1 : best + 2]).all():
        low, top, high = quality[best - 1 : best + 2]
        bend = low - 2.0 * top + high
        offset = 0.5 * (low - high) / bend if bend < 0.0 else 0.0
    return float(lags[best] + offset * step)
