"""Pictures without a window, in wheels that were built with graphics."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._simulation import in_one_thread

if TYPE_CHECKING:
    from ._simulation import Simulation

NO_GRAPHICS = (
    "this jointplay was built without graphics: "
    "pip install ./python --config-settings=maturin.build-args='--features render' builds one with graphics"
)


def render(simulation: Simulation, size: tuple[int, int] = (960, 540)) -> NDArray[np.uint8]:
    """The machine of `simulation` now, as `jointplay render --hide trail,peaks` draws it.

    The array has the shape (height, width, 4): red, green, blue, opacity. `size` is width and height in pixels. Needs a wheel
    that was built with graphics, and a graphics adapter, which may be a software driver.
    """
    draw = getattr(_native, "render", None)
    if draw is None:
        raise ImportError(NO_GRAPHICS)
    pixels: NDArray[np.uint8] = in_one_thread(draw)(simulation, *size)
    return pixels
