from collections.abc import Callable
from os import PathLike
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

_Array = NDArray[np.float64]
_Impacts = tuple[list[str], list[str], _Array]
_Origin = tuple[str, str | None, dict[str, str], list[tuple[str, str]]]

def scenes() -> tuple[list[str], list[str]]: ...
def run(
    scene: Scene,
    duration: float | str,
    every: float | str | None = None,
    channels: list[str] = ...,
    progress: Callable[[float], object] | None = None,
) -> dict[str, Any]: ...
def tradeoff(scene: Scene, quick: bool, clock: Callable[[], float], progress: Callable[[float], object] | None = None) -> str: ...

class Scene:
    @staticmethod
    def load(name: str | PathLike[str]) -> Scene: ...
    @staticmethod
    def parse(text: str, file: str | None = None, folder: PathLike[str] | None = None) -> Scene: ...
    @staticmethod
    def text_of(machine: dict[str, Any]) -> str: ...
    @staticmethod
    def read_again(origin: _Origin) -> Scene: ...
    def origin(self) -> _Origin: ...
    @property
    def name(self) -> str: ...
    @property
    def title(self) -> str: ...
    @property
    def description(self) -> str: ...
    @property
    def ball_joints(self) -> list[str]: ...
    @property
    def bodies(self) -> list[str]: ...
    def keys(self) -> list[str]: ...
    def parameter(self, key: str) -> dict[str, Any]: ...
    def set(self, changes: list[tuple[str, float | int | str | None]]) -> Scene: ...
    def check(self) -> dict[str, Any]: ...
    def channels(self) -> list[tuple[str, str, str, str, bool]]: ...

class State:
    @property
    def time(self) -> float:
        """Simulated time, s."""
    @property
    def hash(self) -> str:
        """State hash, 16 hexadecimal digits."""

class Simulation:
    def __new__(cls, scene: Scene) -> Self: ...
    def step(self, count: int = 1) -> None:
        """Takes `count` steps, each as long as the method chooses."""
    def run_until(self, time: float | str) -> None:
        """Steps to exactly `time`, s, at which the last step ends; does nothing if that has passed."""
    @property
    def time(self) -> float:
        """Simulated time, s."""
    @property
    def hash(self) -> str:
        """State hash, 16 hexadecimal digits."""
    @property
    def state(self) -> State:
        """The whole state, to which `restore` returns with the same bits."""
    def restore(self, state: State) -> None:
        """Returns to a state of a simulation of the same scene."""
    def _change(self, key: str, value: float | int | str) -> str: ...
    def reset(self) -> None:
        """Restarts at t = 0 with all changes, including those that wait for a reset."""
    @property
    def channels(self) -> list[str]:
        """Names of all channels."""
    def _read(self, channel: str) -> float: ...
    def _instant(self) -> dict[str, Any]: ...
    @property
    def vector(self) -> _Array:
        """Coordinates, then velocities, as the formulation orders them, SI."""
    def _take_impacts(self) -> _Impacts: ...
    @property
    def doubts(self) -> list[str]:
        """Reasons to doubt the results so far."""
    @property
    def ledger(self) -> dict[str, float] | None:
        """Energy exchanged so far, J."""
    @property
    def statistics(self) -> dict[str, Any]:
        """Counters so far, as `Run.statistics`."""

class Study:
    def __new__(
        cls,
        scene: Scene,
        over: list[tuple[str, str | None]],
        output: str,
        length: float | str | None,
        start_after: float | str | None,
    ) -> Study: ...
    @property
    def inputs(self) -> list[tuple[str, float, str]]: ...
    @property
    def outputs(self) -> list[tuple[str, str]]: ...
    @property
    def span(self) -> tuple[float, float]: ...
    def run(self, rows: list[list[float]], threads: int, progress: Callable[[float], object] | None = None) -> _Array: ...
    def sensitivity(
        self,
        rows: int,
        screen: int | None,
        target: float | str | None,
        seed: int,
        threads: int,
        progress: Callable[[float], object] | None = None,
    ) -> dict[str, Any]: ...
    def tolerance(
        self,
        limits: list[tuple[float | str | None, float | str | None]],
        units: int,
        sampling: str,
        seed: int,
        cost: list[tuple[str, str, float]] | None,
        required_yield: float,
        evaluations: int,
        threads: int,
        progress: Callable[[float], object] | None = None,
    ) -> dict[str, Any]: ...

class Sweep:
    def __new__(cls, scene: Scene, vary: list[tuple[str, Any]], options: dict[str, Any], tried: bool) -> Sweep: ...
    @property
    def blocks(self) -> int: ...
    @property
    def points(self) -> int: ...
    @property
    def shape(self) -> list[int]: ...
    def axes(self) -> list[tuple[str, Any]]: ...
    def columns(self) -> list[tuple[str, bool, int]]: ...
    def is_per_section(self, name: str) -> bool: ...
    def block(self, block: int) -> tuple[int, int]: ...
    def settings(self, point: int) -> list[tuple[str, Any]]: ...
    def describe(self, point: int) -> str: ...
    def compute(self, block: int) -> _Array: ...
    def run(self, threads: int, progress: Callable[[float], object] | None = None) -> _Array: ...
