"""Cost and error of the stepping methods."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from . import _native
from ._options import library

if TYPE_CHECKING:
    import pandas

    from ._scene import Scene


@dataclass(frozen=True)
class TradeoffRow:
    """One method at one step or tolerance; a row of `tradeoff.csv` (`docs/tradeoff.md`). `None`: no value."""

    method: str
    """Word of `solver.method`."""
    step_s: float | None
    """Step of a method with fixed steps, s."""
    tolerance: float | None
    """Tolerance of a method that controls its error."""
    steps_per_impact: int | None
    """Steps per impact of `discrete-gradient`."""
    preset: str | None
    """The preset with this setting on this scene."""
    end: str
    """How the run ended: "reached", "capped" (too costly) or "stopped". Only a run that reached its end has time and cost."""
    span_s: float
    """Simulated time from the start, s."""
    time_s: float | None
    """Processor time to step over it, s."""
    ratio: float | None
    """Speed over that of `rk4` at 10 microseconds."""
    cost: float | None
    """Counted cost of the span, in evaluations of the equations: the same on every computer."""
    steps: int
    """Accepted steps over the span."""
    evaluations: int
    """Evaluations of the equations of motion over the span."""
    rejected: int
    """Rejected steps over the span."""
    peak_error: float | None
    """Largest relative error of the peak forces of the first impacts."""
    position_error_m: float | None
    """Error of the output body's position at the third impact, m."""
    energy_error: float | None
    """Residual of the energy balance over the first impacts, relative to the energy exchanged."""
    force_error: float | None
    """Largest relative error of the mean contact forces in settled motion, if the scene settles."""


@dataclass(frozen=True)
class Tradeoff:
    """Result of `tradeoff`."""

    rows: list[TradeoffRow]
    """In the order of the methods, each from coarse to fine."""

    def to_pandas(self) -> pandas.DataFrame:
        """One line per row."""
        library("pandas", "pandas")
        import pandas

        return pandas.DataFrame([asdict(row) for row in self.rows])

    def __repr__(self) -> str:
        return f"<jointplay.Tradeoff: {len(self.rows)} rows>"


def tradeoff(scene: Scene, *, quick: bool = False, progress: Callable[[float], object] | None = None) -> Tradeoff:
    """Runs every method on `scene` over its steps or tolerances, and measures cost and error, as `jointplay tradeoff` does.

    A `quick` measurement uses a coarse grid over a tenth of a second and takes seconds; a full one, the default, takes a minute. Times are
    processor times of the calling thread. `progress` is called with the fraction done, from 0 to 1.
    """
    rows = json.loads(_native.tradeoff(scene.native, quick, time.thread_time, progress))
    return Tradeoff([TradeoffRow(**row) for row in rows])
