"""Simulations that are stepped, changed and read one instant at a time."""

from __future__ import annotations

import html
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._link import frame_of
from ._scene import impact_table

if TYPE_CHECKING:
    from typing import Self

    from ._scene import Quantity, Scene


@dataclass(frozen=True)
class Frame:
    """One instant. SI units, world axes; bodies and joints with play in scene order."""

    time: float
    """Simulated time, s."""
    positions: NDArray[np.float64]
    """Origins of the body frames, m: shape (bodies, 3)."""
    rotations: NDArray[np.float64]
    """Rotation matrices, body axes as columns: shape (bodies, 3, 3)."""
    velocities: NDArray[np.float64]
    """Velocities of the origins, m/s: shape (bodies, 3)."""
    angular_velocities: NDArray[np.float64]
    """Angular velocities, rad/s: shape (bodies, 3)."""
    eccentricities: NDArray[np.float64]
    """From the centre of each socket to that of its ball, m, or across the axis of another joint: shape (joints, 3)."""
    normal_forces: NDArray[np.float64]
    """Normal force on each ball, pin or block, N, or the reaction of an ideal joint: shape (joints, 3)."""
    friction_forces: NDArray[np.float64]
    """Friction force on each ball, pin or block, N: shape (joints, 3)."""
    axial: NDArray[np.float64]
    """Displacement of each pin or block along the joint's axis, m; 0 for a ball: shape (joints,)."""
    tilts: NDArray[np.float64]
    """Angle between each pin and its bearing, or block and guide, rad; 0 for a ball: shape (joints,)."""
    sites: list[str]
    """Names of all places where a joint with play can touch, by joint, as in `Scene.sites`; the next arrays have a row for each."""
    gaps: NDArray[np.float64]
    """Distance to the wall, m; negative in contact, infinite in a joint or direction without play: shape (sites,)."""
    site_normal_forces: NDArray[np.float64]
    """Normal force on the ball, pin or block there, N; 0 in an ideal joint: shape (sites, 3)."""
    site_friction_forces: NDArray[np.float64]
    """Friction force on it there, N: shape (sites, 3)."""
    contact_points: NDArray[np.float64]
    """Where they act, m: shape (sites, 3)."""
    values: NDArray[np.float64] = field(repr=False)
    """All channels, in the order of `Simulation.channels`."""


class Simulation(_native.Simulation):
    """A running simulation. Simulations in different threads step at the same time; each belongs to one thread at a time."""

    scene: Scene
    """The scene as it was given."""

    def __new__(cls, scene: Scene) -> Self:
        self = super().__new__(cls, scene._native)
        self.scene = scene
        self._is_plain = True
        return self

    def set(self, key: str, value: Quantity) -> str:
        """Changes a parameter of the running machine: SI, or text with a unit.

        Returns "now" if it takes effect from the next step on, or "at reset".
        """
        effect = self._change(key, value)
        self._is_plain = False
        return effect

    def restore(self, state: _native.State) -> None:
        """Returns to a state of a simulation of the same scene."""
        super().restore(state)
        # The state may contain changes.
        self._is_plain = False

    def frame(self) -> Frame:
        """The machine at this instant."""
        return Frame(**self._instant())

    def __getitem__(self, channel: str) -> float:
        """Value of a channel at this instant, SI."""
        return self._read(channel)

    def take_impacts(self) -> NDArray[Any]:
        """One row per impact that finished since the last call, as `Run.impacts`. At least the latest 64 are available."""
        return impact_table(*self._take_impacts())

    def _repr_html_(self) -> str:
        # The link does not contain changes during the run.
        frame = frame_of(self.scene._native, self.time) if self._is_plain else None
        return frame or html.escape(repr(self))

    def __repr__(self) -> str:
        return f"<jointplay.Simulation {self.scene.name} at {self.time:g} s>"
