"""Runs: a scene from t = 0 to an instant, with rows at equal intervals."""

from __future__ import annotations

import html
import warnings
from collections.abc import Callable, Iterator, Sequence
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._link import frame_of
from .errors import ChannelError, DoubtWarning, Stopped

if TYPE_CHECKING:
    import pandas

    from ._scene import Quantity, Scene


class Run:
    """Results of `Scene.run`. Arrays share the memory of the run, are read-only, and outlive it."""

    def __init__(self, scene: Scene, results: dict[str, Any]) -> None:
        self.scene = scene
        """The scene that was run."""
        self._values: NDArray[np.float64] = results["values"]
        self._rows: int = results["rows"]
        self._channels: list[tuple[str, str, str, str]] = results["channels"]
        self._indices = {column: i for i, (_, column, _, _) in enumerate(self._channels)}
        self._indices.update({name: i for i, (name, _, _, _) in enumerate(self._channels)})
        self.hash: str = results["hash"]
        """State hash at the end: the 16 digits that `jointplay run` prints."""
        self.end: float = results["end"]
        """Simulated time at the end, s."""
        self.doubts: list[str] = results["doubts"]
        """Reasons to doubt the results."""
        self.ledger: dict[str, float] | None = results["ledger"]
        """Energy exchanged, J, as in the summary of `jointplay run`; None if `solver.energy_ledger` is off."""
        self.statistics: dict[str, Any] = results["statistics"]
        """Steps, evaluations and rejected steps; under `joints` the `peak_normal`, N, `peak_time`, s, and `impacts` of each."""
        self.impacts = impact_table(*results["impacts"])
        """One row per finished impact: the columns of `jointplay run --impacts`, with the names of the joints."""

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        # Pickling loses this flag.
        self._values.flags.writeable = False

    @property
    def time(self) -> NDArray[np.float64]:
        """Time of each row, s."""
        return self["time"]

    @property
    def channels(self) -> list[str]:
        """Names of the recorded channels."""
        return [name for name, _, _, _ in self._channels]

    @property
    def units(self) -> dict[str, str]:
        """SI unit of each recorded channel; empty for a code."""
        return {name: unit for name, _, unit, _ in self._channels}

    def __getitem__(self, channel: str) -> NDArray[np.float64]:
        """Values of a channel, by its name (`A.normal`) or column (`A_normal_N`), SI: shape (rows,).

        A name without its component (`A.force`) gives all three of a vector: shape (rows, 3).
        """
        index = self._indices.get(channel)
        if index is not None:
            return self._values[index, : self._rows]
        parts = [name.rsplit(".", 1) for name in self.channels]
        components = {part[1]: i for i, part in enumerate(parts) if part[0] == channel and part[1:] not in ([], ["size"])}
        first = components.get("x")
        if first is not None and components == {"x": first, "y": first + 1, "z": first + 2}:
            return self._values[first : first + 3, : self._rows].T
        raise ChannelError(self._explain(channel))

    def _explain(self, channel: str) -> str:
        members = [name for name in self.channels if name.startswith(f"{channel}.")]
        if members:
            return f"`{channel}` stands for several channels: {', '.join(members)}"
        if any(channel in (known.name, known.column) for known in self.scene.channels()):
            return f"`{channel}` was not recorded: pass channels=[{channel!r}, …] to Scene.run"
        near = get_close_matches(channel, self._indices, n=1)
        hint = f" (did you mean `{near[0]}`?)" if near else ""
        return f"`{channel}` is not a channel of this run{hint}"

    def __iter__(self) -> Iterator[str]:
        return iter(self.channels)

    def __len__(self) -> int:
        """Number of rows."""
        return self._rows

    def to_pandas(self) -> pandas.DataFrame:
        """The rows as a data frame, with the columns of `jointplay run --out`."""
        import pandas

        columns = [column for _, column, _, _ in self._channels]
        return pandas.DataFrame(self._values[:, : self._rows].T, columns=columns)

    def __repr__(self) -> str:
        return f"<jointplay.Run {self.scene.name}: {self._rows} rows, {len(self._channels)} channels, to {self.end:g} s>"

    def _repr_html_(self) -> str:
        return frame_of(self.scene, self.end) or html.escape(repr(self))


INTEGERS = ("steps",)
FLAGS = ("floored", "disturbed")


def impact_table(ball_joints: list[str], names: list[str], values: NDArray[np.float64]) -> NDArray[Any]:
    """Structured array of impacts; each row of `values` becomes a column."""
    joints = np.array(ball_joints or [""])
    types: dict[str, Any] = {name: float for name in names}
    types.update({name: int for name in INTEGERS}, joint=joints.dtype, **{name: bool for name in FLAGS})
    table = np.zeros(values.shape[1], dtype=list(types.items()))
    for name, column in zip(names, values, strict=True):
        table[name] = joints[column.astype(int)] if name == "joint" else column
    return table


def run_scene(
    scene: Scene,
    native: _native.Scene,
    duration: Quantity,
    every: Quantity | None,
    channels: Sequence[str],
    progress: Callable[[float], object] | None,
    warn: bool,
) -> Run:
    """Implements `Scene.run`."""
    names = [channels] if isinstance(channels, str) else list(channels)
    results = _native.run(native, duration, every, names, progress)
    run = Run(scene, results)
    if warn:
        for doubt in run.doubts:
            warnings.warn(f"{scene.name}: {doubt}", DoubtWarning, stacklevel=3)
    if results["fault"] is not None:
        raise Stopped(results["fault"], time=run.end, advice=results["advice"], run=run)
    return run
