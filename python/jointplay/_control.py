"""Motors, loads, springs and lubricants of a running simulation, and its motion linearised."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from .errors import OptionError

if TYPE_CHECKING:
    from ._native import Simulation


class Element:
    """A force element of a running simulation. What is set acts from that instant on; floats in SI units."""

    __slots__ = ("_control", "_controlled", "_index", "_on_angle", "name")

    def __init__(self, simulation: Simulation, index: int, name: str, on_angle: bool) -> None:
        self._control = simulation._control
        self._controlled = simulation._controlled
        self._index = index
        self._on_angle = on_angle
        self.name = name
        """Name in the scene."""

    def _get(self, number: str) -> float:
        value = self._controlled(self._index, number)
        if value is None:
            raise OptionError(f"{self.name} has no {number}: a curve stands in its place")
        return value

    def _set(self, number: str, value: float) -> None:
        try:
            self._control(self._index, number, value)
        except TypeError:
            raise OptionError(f"{number} of {self.name} = {value!r}: expected a number in SI units") from None

    @staticmethod
    def _number(number: str, doc: str) -> Any:
        def read(self: Element) -> float:
            return self._get(number)

        def write(self: Element, value: float) -> None:
            self._set(number, value)

        return property(read, write, doc=doc)

    def __repr__(self) -> str:
        return f"<jointplay.{type(self).__name__} {self.name}>"


class Motor(Element):
    """A motor: force or torque + stiffness (target - q) + damping (target_rate - q'), at most the limit."""

    __slots__ = ()

    def _of(self, on_angle: bool) -> str:
        if self._on_angle != on_angle:
            here, there = ("hinge", "torque") if self._on_angle else ("slide", "force")
            raise OptionError(f"{self.name} acts on a {here}: set its {there}")
        return "force"

    @property
    def torque(self) -> float:
        """Constant part on a hinge, N m."""
        return self._get(self._of(True))

    @torque.setter
    def torque(self, value: float) -> None:
        self._set(self._of(True), value)

    @property
    def force(self) -> float:
        """Constant part on a slide, N."""
        return self._get(self._of(False))

    @force.setter
    def force(self, value: float) -> None:
        self._set(self._of(False), value)

    stiffness: float = Element._number("stiffness", "Gain on the distance from the target, N/m or N m/rad.")
    damping: float = Element._number("damping", "Gain on the difference from the target's rate, N s/m or N m s/rad.")
    limit: float = Element._number("limit", "Largest force or torque, N or N m; `math.inf` for none.")
    target: float = Element._number("target", "Where the target is now, m or rad. It moves on from there at `target_rate`.")
    target_rate: float = Element._number("target_rate", "Rate of the target, m/s or rad/s.")


class Spring(Element):
    """A spring with a damper, between two points or on a joint."""

    __slots__ = ()

    stiffness: float = Element._number("stiffness", "N/m, or N m/rad on a hinge.")
    damping: float = Element._number("damping", "N s/m, or N m s/rad on a hinge.")
    preload: float = Element._number("preload", "Tension at `length`, or force to lower coordinates at `position`, N or N m.")
    length: float = Element._number("length", "Distance of the points without stretch, m; of a spring between two points.")
    position: float = Element._number("position", "Coordinate without stretch, m or rad; of a spring on a joint.")


class Lubricant(Element):
    """A lubricant in a joint with play."""

    __slots__ = ()

    viscosity: float = Element._number("viscosity", "Dynamic viscosity, Pa s.")


class Load(Element):
    """An external force and torque on a body, in the load's axes; times its factor of time, if it has one."""

    __slots__ = ()

    def _vector(self, number: str) -> NDArray[np.float64]:
        vector = np.array([self._get(f"{number}_{axis}") for axis in "xyz"])
        vector.flags.writeable = False
        return vector

    def _set_vector(self, number: str, value: Sequence[float] | NDArray[np.float64]) -> None:
        numbers = np.asarray(value, dtype=float)
        if numbers.shape != (3,):
            raise OptionError(f"{number} of {self.name} = {value!r}: expected three numbers, SI")
        for axis, component in zip("xyz", numbers.tolist(), strict=True):
            self._set(f"{number}_{axis}", component)

    @property
    def force(self) -> NDArray[np.float64]:
        """N."""
        return self._vector("force")

    @force.setter
    def force(self, value: Sequence[float] | NDArray[np.float64]) -> None:
        self._set_vector("force", value)

    @property
    def torque(self) -> NDArray[np.float64]:
        """N m."""
        return self._vector("torque")

    @torque.setter
    def torque(self, value: Sequence[float] | NDArray[np.float64]) -> None:
        self._set_vector("torque", value)


E = TypeVar("E", bound=Element)


class Elements(Mapping[str, E], Generic[E]):
    """Elements of one kind by name."""

    def __init__(self, simulation: Simulation, make: Callable[[Simulation, int, str, bool], E], *kinds: str) -> None:
        all_elements = enumerate(simulation._elements())
        self._all = {name: make(simulation, i, name, angle) for i, (name, kind, angle) in all_elements if kind in kinds}
        self._kind = kinds[0]

    def __getitem__(self, name: str) -> E:
        try:
            return self._all[name]
        except KeyError:
            known = ", ".join(self._all) or "none"
            raise OptionError(f"no {self._kind} is called {name!r}; there are: {known}") from None

    def __contains__(self, name: object) -> bool:
        return name in self._all

    def __iter__(self) -> Iterator[str]:
        return iter(self._all)

    def __len__(self) -> int:
        return len(self._all)

    def __repr__(self) -> str:
        return f"<{', '.join(self._all) or 'none'}>"


@dataclass(frozen=True)
class Linearisation:
    """Small motions about a state: with displacements `x = directions @ a` in velocity space, `d/dt (a, a') = matrix @ (a, a')`."""

    matrix: NDArray[np.float64]
    """Shape (2 n, 2 n)."""
    directions: NDArray[np.float64]
    """Directions of free motion, one a column: shape (velocities, n). The identity where no joint closes a loop."""

    @property
    def eigenvalues(self) -> NDArray[np.complex128]:
        """Of the matrix, 1/s, by ascending magnitude."""
        values = np.linalg.eigvals(self.matrix).astype(np.complex128)
        return values[np.argsort(np.abs(values), kind="stable")]

    @property
    def frequencies(self) -> NDArray[np.float64]:
        """Of the oscillations, Hz, ascending."""
        imaginary = np.sort(self.eigenvalues.imag)
        return imaginary[imaginary > 0.0] / (2.0 * np.pi)
