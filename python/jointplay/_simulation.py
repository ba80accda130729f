"""Simulations that are stepped, changed and read one instant at a time."""

from __future__ import annotations

import html
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import wraps
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._control import Elements, Linearisation, Load, Lubricant, Motor, Spring
from ._geometry import matrices
from ._link import frame_of
from ._scene import impact_table
from .errors import InUseError

if TYPE_CHECKING:
    from typing import Self

    from ._scene import Quantity, Scene

    Numbers = float | Sequence[float] | NDArray[np.float64]
    Positions = Mapping[str, Numbers] | Sequence[float] | NDArray[np.float64]

E = TypeVar("E", Motor, Load, Spring, Lubricant)
P = ParamSpec("P")
T = TypeVar("T")


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
    lubricant_forces: NDArray[np.float64]
    """Force of the lubricant on each ball or pin, N: shape (joints, 3)."""
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

    @property
    def transforms(self) -> NDArray[np.float64]:
        """Poses of the bodies, body to world: shape (bodies, 4, 4)."""
        return matrices(self.positions, self.rotations)


def in_one_thread(use: Callable[P, T]) -> Callable[P, T]:
    """A method of a simulation that says so when another thread is using it."""

    @wraps(use)
    def guarded(*arguments: P.args, **named: P.kwargs) -> T:
        try:
            return use(*arguments, **named)
        except RuntimeError as error:
            # Of PyO3: "Already borrowed", "Already mutably borrowed".
            if type(error) is not RuntimeError or "borrowed" not in str(error):
                raise
            raise InUseError("this simulation is in use in another thread; give each thread its own") from None

    return guarded


class _Guarded(_native.Simulation):
    """Its methods and properties are refused while another thread uses it."""


for _name, _member in vars(_native.Simulation).items():
    if callable(_member) and not _name.startswith("__"):
        setattr(_Guarded, _name, in_one_thread(_member))
    elif hasattr(_member, "__set__"):
        setattr(_Guarded, _name, property(in_one_thread(_member.__get__), doc=_member.__doc__))


class Simulation(_Guarded):
    """A running simulation. Simulations in different threads step at the same time; each belongs to one thread at a time."""

    scene: Scene
    """The scene as it was given."""
    _is_plain: bool
    _elements_of: dict[type, Any]

    def __new__(cls, scene: Scene) -> Self:
        self = super().__new__(cls, scene.native)
        self.scene = scene
        self._is_plain = True
        self._elements_of = {}
        return self

    @property
    def motors(self) -> Elements[Motor]:
        """Motors by name: `motors["elbow"].torque = 3.0`."""
        return self._by_name(Motor, "motor")

    @property
    def loads(self) -> Elements[Load]:
        """Loads by name: `loads["wind"].force = (0, 0, -5)`."""
        return self._by_name(Load, "load")

    @property
    def springs(self) -> Elements[Spring]:
        """Springs between points and on joints by name: `springs["coil"].stiffness = 2e3`."""
        return self._by_name(Spring, "spring", "joint_spring")

    @property
    def lubricants(self) -> Elements[Lubricant]:
        """Lubricants by name: `lubricants["oil"].viscosity = 0.02`."""
        return self._by_name(Lubricant, "lubricant")

    def _by_name(self, kind: type[E], *kinds: str) -> Elements[E]:
        own: Elements[E] | None = self._elements_of.get(kind)
        if own is None:
            own = self._elements_of[kind] = Elements(self, kind, *kinds)
            self._is_plain = False
        return own

    def set_state(self, q: Positions | None = None, v: Positions | None = None, time: Quantity | None = None) -> None:
        """Starts again at positions `q` and velocities `v`, by name of coordinate or all in the order of `vector`.

        What is not given stays, as does the time. Loops are closed, contacts are found anew, counters and ledger begin again.
        """
        super().set_state(q, v, time)
        self._is_plain = False

    def linearise(self) -> Linearisation:
        """The motion linearised about this state by central differences: small motions about a state at rest."""
        return Linearisation(*self._linearise())

    def reset(self) -> None:
        """Restarts at t = 0 with all changes of parameters, including those that wait for a reset."""
        super().reset()
        self._elements_of.clear()

    def set(self, key: str, value: Quantity) -> str:
        """Changes a parameter of the running machine: SI, or text with a unit.

        Returns "now" if it takes effect from the next step on, or "at reset".
        """
        effect = self._change(key, value)
        self._is_plain = False
        return effect

    def restore(self, state: _native.State) -> None:
        """Returns to a state of a simulation of the same scene, with the same bits.

        From a state of another scene with the same coordinates, such as one with other parameters, it starts at their values and time.
        """
        super().restore(state)
        self._elements_of.clear()
        # The state may contain changes.
        self._is_plain = False

    def __reduce__(self) -> tuple[Any, ...]:
        return self._resumed, (self.scene, self.state, self._is_plain)

    @staticmethod
    def _resumed(scene: Scene, state: _native.State, is_plain: bool) -> Simulation:
        simulation = Simulation(scene)
        simulation.restore(state)
        simulation._is_plain = is_plain
        return simulation

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
        frame = frame_of(self.scene.native, self.time) if self._is_plain else None
        return frame or html.escape(repr(self))

    def __repr__(self) -> str:
        return f"<jointplay.Simulation {self.scene.name} at {self.time:g} s>"
