"""Sweeps: one scene at many parameter values."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._options import library, workers
from .errors import ChannelError, OptionError

if TYPE_CHECKING:
    import pandas
    import xarray

    from ._scene import Quantity, Scene

Vary = Mapping[str, "str | Sequence[Quantity] | NDArray[Any]"]
"""Values of parameters by key: text as in `jointplay sweep --vary`, or a list of numbers (SI) or texts."""
Points = Mapping[str, "Sequence[Quantity] | NDArray[Any]"]
"""A table of points: columns of equal length by key."""


class Sweep:
    """A sweep whose points can be computed in this or other processes.

    A sweep consists of independent blocks, which can be computed in any order, in any process: `compute(block)` returns the
    numbers of one block, and `assemble` combines all blocks into the result. A sweep can be pickled.
    """

    def __init__(
        self,
        scene: Scene,
        vary: Vary | None = None,
        *,
        points: Points | None = None,
        periods: int | None = None,
        discard: int | None = None,
        phase: Quantity | None = None,
        period: Quantity | None = None,
        exponent: bool = True,
        duration: Quantity | None = None,
        from_: Quantity | None = None,
        section: str | None = None,
        crossings: int | None = None,
        keep: str | Sequence[str] | None = None,
        start: str | Sequence[str] = "cold",
    ) -> None:
        """A sweep of `scene`.

        `vary` has the values of each parameter: text as in `jointplay sweep --vary` (`"0.1mm..1mm:10"`, `"0.1mm..1mm:10:log"`),
        or a list of numbers (SI) or texts. All combinations are run, the last parameter varying fastest. In place of it, `points`
        is a table with one row per point: a mapping or data frame of columns, each a list of numbers (SI) or texts.

        The run of a point is one of

        - `periods` drive periods, the first `discard` of them a transient, with a Poincaré section at the `phase` of each (a
          fraction of the period, 0 to below 1, or an angle such as "90deg"), a regime, and unless `exponent` is False the largest
          Lyapunov exponent; `period`, s, replaces the common period of the drives;
        - a `duration`, s, observed from `from_`, s, on;
        - `crossings` of `section` (`"crank.angle=90deg:up"`), the first `discard` of them a transient, within `duration`.

        `keep` names statistics of channels (`"A.normal:max"`) to record in place of the forces and impacts of the joints with play.
        `start` is `cold`, `follow-up` or `follow-down`, or several of them.
        """
        self.scene = scene
        if (vary is None) == (points is None):
            raise OptionError("give the values of parameters either as vary or as points")
        # A column of a data frame has the index of its rows.
        table = {} if points is None else {key: np.asarray(points[key]).tolist() for key in points}
        self._vary: list[tuple[str, Any]] = list((vary or table).items())
        self._is_table = points is not None
        self._options: dict[str, Any] = {
            "periods": periods,
            "discard": discard,
            "phase": phase,
            "period": period,
            "exponent": exponent,
            "duration": duration,
            "from_": from_,
            "section": section,
            "crossings": crossings,
            "keep": keep if keep is None or isinstance(keep, str) else ",".join(keep),
            "start": [start] if isinstance(start, str) else list(start),
        }
        self._is_checked = False
        # Raises errors here, not at the first use.
        _ = self.native

    @cached_property
    def native(self) -> _native.Sweep:
        """The compiled sweep, for the modules of the package."""
        return _native.Sweep(self.scene.native, self._vary, self._is_table, self._options, self._is_checked)

    def __getstate__(self) -> dict[str, Any]:
        state = {name: value for name, value in self.__dict__.items() if name != "native"}
        return {**state, "_is_checked": True}

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return self.native.blocks

    @property
    def points(self) -> int:
        """Number of points."""
        return self.native.points

    def describe(self, point: int) -> str:
        """Parameters of a point in words."""
        return self.native.describe(point)

    def compute(self, block: int) -> NDArray[np.float64]:
        """Numbers of the points of one block: shape (points of the block, numbers of a point)."""
        return self.native.compute(block)

    def assemble(self, blocks: Iterable[NDArray[np.float64]]) -> SweepResult:
        """Combines all blocks, given in order, into the result."""
        given = list(blocks)
        if len(given) != self.blocks:
            raise OptionError(f"blocks: {len(given)} given, but the sweep has {self.blocks}")
        for block, rows in enumerate(given):
            first, end = self.native.block(block)
            if len(rows) != end - first:
                raise OptionError(f"blocks: block {block} has {len(rows)} points, but should have {end - first}")
        return self._result(np.concatenate(given))

    def run(
        self,
        threads: int | None = None,
        progress: Callable[[float], object] | None = None,
        *,
        record: str | os.PathLike[str] | None = None,
    ) -> SweepResult:
        """Computes all blocks on `threads` threads (by default or with -1 one per core), which do not affect the result.

        `progress` is called with the fraction done, from 0 to 1. The file `record` has the finished blocks; a sweep that was
        interrupted resumes from it, with the same bits.
        """
        path = None if record is None else os.fspath(record)
        return self._result(self.native.run(workers(threads), progress, path))

    def _result(self, records: NDArray[np.float64]) -> SweepResult:
        return SweepResult(self, records, self._is_table, self._options["start"])

    def __repr__(self) -> str:
        return f"<jointplay.Sweep of {self.scene.name}: {self.points} points in {self.blocks} blocks>"


UNITS = {
    "m_s2": "m/s^2",
    "rad_s2": "rad/s^2",
    "m_s": "m/s",
    "rad_s": "rad/s",
    "per_s": "1/s",
    "Nm": "N m",
    "N": "N",
    "J": "J",
    "rad": "rad",
    "m": "m",
    "s": "s",
}
"""SI units by the ends of names of columns; the longer ones first."""


def unit_of(column: str) -> str:
    """SI unit of a column, by its name; empty for a number or a code."""
    return next((unit for end, unit in UNITS.items() if column.endswith(f"_{end}")), "")


class SweepResult(Mapping[str, NDArray[Any]]):
    """Result of a sweep: arrays by name, as in the archive that `jointplay sweep` writes (`docs/sweeps.md`)."""

    def __init__(self, sweep: Sweep, records: NDArray[np.float64], is_table: bool, starts: list[str]) -> None:
        self.axes: dict[str, NDArray[Any]] = {key: np.asarray(values) for key, values in sweep.native.axes()}
        """Values of each varied parameter, SI."""
        self._arrays: dict[str, NDArray[Any]] = dict(self.axes)
        self._single: list[str] = []
        shape, first = tuple(sweep.native.shape), 0
        for name, is_integer, count in sweep.native.columns():
            values = records[:, first : first + count]
            first += count
            if sweep.native.is_per_section(name):
                values = values.reshape(*shape, count)
            else:
                self._single.append(name)
                values = values.reshape(shape)
            self._arrays[name] = values.astype(np.int64) if is_integer else values
        self._is_table, self._starts = is_table, starts
        self.sweep = sweep
        """The sweep."""

    def __getitem__(self, name: str) -> NDArray[Any]:
        """An array over the axes of the sweep; an additional last axis counts sections."""
        if name not in self._arrays:
            raise ChannelError(f"`{name}` is not an array of this sweep, which has: {', '.join(self._arrays)}")
        return self._arrays[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    def to_pandas(self) -> pandas.DataFrame:
        """One row per point: its parameters, SI, and its results without a section axis."""
        library("pandas", "pandas")
        import pandas

        settings = pandas.DataFrame([dict(self.sweep.native.settings(point)) for point in range(self.sweep.points)])
        return settings.join(pandas.DataFrame({name: self._arrays[name].ravel() for name in self._single}))

    def to_xarray(self) -> xarray.Dataset:
        """All arrays over named axes with their units: one dimension per varied parameter, or `point` for a table of points; `start`
        if there are several; `section` where a point has several values."""
        library("xarray", "xarray")
        import xarray

        sweep = self.sweep
        shape = tuple(sweep.native.shape)
        keys = ["point"] if self._is_table else list(self.axes)
        start = ["start"] if len(shape) > len(keys) else []
        dims = start + keys
        coordinates: dict[str, Any] = {
            key: ("point" if self._is_table else key, values, {"units": sweep.scene.parameter(key).unit})
            for key, values in self.axes.items()
        }
        coordinates |= {"start": self._starts} if start else {}
        variables = {
            name: (dims if name in self._single else [*dims, "section"], values, {"units": unit_of(name)})
            for name, values in self._arrays.items()
            if name not in self.axes
        }
        return xarray.Dataset(variables, coordinates, {"scene": sweep.scene.name})

    def __repr__(self) -> str:
        return f"<jointplay.SweepResult: {self.sweep.points} points, {len(self)} arrays>"


def sweep(
    scene: Scene,
    vary: Vary | None = None,
    *,
    points: Points | None = None,
    periods: int | None = None,
    discard: int | None = None,
    phase: Quantity | None = None,
    period: Quantity | None = None,
    exponent: bool = True,
    duration: Quantity | None = None,
    from_: Quantity | None = None,
    section: str | None = None,
    crossings: int | None = None,
    keep: str | Sequence[str] | None = None,
    start: str | Sequence[str] = "cold",
    threads: int | None = None,
    progress: Callable[[float], object] | None = None,
    record: str | os.PathLike[str] | None = None,
) -> SweepResult:
    """Runs a sweep: the arguments of `Sweep`, then those of `Sweep.run`."""
    given = Sweep(
        scene,
        vary,
        points=points,
        periods=periods,
        discard=discard,
        phase=phase,
        period=period,
        exponent=exponent,
        duration=duration,
        from_=from_,
        section=section,
        crossings=crossings,
        keep=keep,
        start=start,
    )
    return given.run(threads, progress, record=record)
