"""Cost and error of the stepping methods."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from . import _native

if TYPE_CHECKING:
    import pandas

    from ._scene import Scene


class Tradeoff:
    """Result of `tradeoff`."""

    def __init__(self, points: list[dict[str, Any]]) -> None:
        self.points = points
        """One per method and step or tolerance, as in `tradeoff.json` (`docs/tradeoff.md`)."""

    def to_pandas(self) -> pandas.DataFrame:
        """One row per point; nested names are joined by dots: `impacts.ratio`, `errors.peak`."""
        import pandas

        return pandas.json_normalize(self.points)

    def __repr__(self) -> str:
        return f"<jointplay.Tradeoff: {len(self.points)} points>"


def tradeoff(scene: Scene, *, quick: bool = True, progress: Callable[[float], object] | None = None) -> Tradeoff:
    """Runs every method on `scene` over its steps or tolerances, and measures cost and error, as `jointplay tradeoff` does.

    A `quick` measurement uses a coarse grid and takes seconds; a full one takes minutes. Times are processor times of the calling
    thread. `progress` is called with the fraction done, from 0 to 1.
    """
    return Tradeoff(json.loads(_native.tradeoff(scene._native, quick, time.thread_time, progress)))
