"""Scenes, machines with their parameters, and their runs from t = 0 to an instant."""

from __future__ import annotations

import html
import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._link import frame_of
from .errors import ChannelError, DoubtWarning, OmissionWarning, OptionError, Stopped

if TYPE_CHECKING:
    import pandas

Quantity = float | int | str
"""A number in SI units, or text with a unit."""


@dataclass(frozen=True)
class Parameter:
    """A parameter of a scene, as `docs/parameters.md` lists it."""

    key: str
    """Key, such as `contact.clearance` or `joint.A.friction`."""
    label: str
    """Name in the interface."""
    group: str
    """Heading under which it is listed."""
    value: float | int | str | None
    """Value, SI; a word for a choice."""
    text: str
    """Value with its unit."""
    default: float | int | str | None
    """Value if the scene gives none, SI."""
    allowed: str
    """Range and units in words."""
    range: tuple[float, float] | None
    """Range, SI; None for a choice."""
    words: list[str]
    """Choices; empty for a number."""
    at_reset: bool
    """Whether a change takes effect at the next reset only."""
    help: str
    """Description."""
    equation: str
    """Equations in which it appears."""


@dataclass(frozen=True)
class Check:
    """Counts and warnings of the assembled scene."""

    bodies: int
    """Moving bodies."""
    degrees_of_freedom: int
    """Degrees of freedom at the start."""
    velocity_coordinates: int
    """Velocity coordinates of the formulation."""
    constraint_rows: int
    """Constraint rows of the formulation."""
    dependent_rows: int
    """Constraint rows that the others imply."""
    contacts: int
    """Places where joints with play can touch: one of a ball, several of a pin or a block."""
    ideal_joints: int
    """Joints whose play is 0."""
    warnings: list[str]
    """Warnings of `jointplay check` about probable mistakes."""
    not_unique: str | None
    """Which reactions and actuator forces are not unique; None if all are."""
    doubts: list[str]
    """Reasons to doubt the results of its runs."""


@dataclass(frozen=True)
class Channel:
    """A channel that runs of a scene can record."""

    name: str
    """Name, such as `A.normal`."""
    column: str
    """Name of its column in files and data frames, with the unit: `A_normal_N`."""
    unit: str
    """SI unit."""
    help: str
    """Description."""
    unasked: bool
    """Whether a run records it if no channels are named."""


class Scene:
    """A machine with its parameters. A scene never changes: `set` returns another one."""

    def __init__(self, native: _native.Scene) -> None:
        self._native = native

    @staticmethod
    def names() -> list[str]:
        """Names of the built-in scenes, then of the benchmarks."""
        scenes, benchmarks = _native.scenes()
        return scenes + benchmarks

    @classmethod
    def load(cls, name: str | os.PathLike[str]) -> Scene:
        """A built-in scene or benchmark by name, or a file: its name contains `/` or ends in `.toml`."""
        return cls(_native.Scene.load(os.fspath(name)))

    @classmethod
    def from_toml(cls, text: str, *, file: str | None = None, folder: str | os.PathLike[str] | None = None) -> Scene:
        """A scene from the text of a scene file. `file` is its name in errors; files that it names are read in `folder`."""
        return cls(_native.Scene.parse(text, file, None if folder is None else Path(folder)))

    @classmethod
    def from_dict(cls, machine: Mapping[str, Any], *, folder: str | os.PathLike[str] | None = None) -> Scene:
        """A machine built in code: the sections and keys of a scene file (`docs/scene-format.md`) as dictionaries and lists.

        Numbers in place of quantities are SI. `toml` of the scene is the file that describes the same machine.
        """
        return cls.from_toml(_native.Scene.text_of(dict(machine)), folder=folder)

    @classmethod
    def from_mjcf(cls, source: str | os.PathLike[str]) -> Scene:
        """The machine of an MJCF file, or of its text, compiled by MuJoCo (extra `robots`), with its meshes.

        `notes` says what the scene does not have of it; a `jp.OmissionWarning` repeats that.
        """
        from . import _robots

        return cls._imported(_robots.scene_of(source, "mujoco")[0])

    @classmethod
    def from_urdf(cls, source: str | os.PathLike[str]) -> Scene:
        """The machine of a URDF file, or of its text, as `from_mjcf`. Meshes of packages are sought in the folders above the file."""
        from . import _robots

        return cls._imported(_robots.scene_of(source, "robot")[0])

    @classmethod
    def _imported(cls, native: _native.Scene) -> Scene:
        """The scene of a robot, after a warning about what it does not have of it."""
        scene = cls(native)
        if len(scene.notes) > 1:
            warnings.warn("\n".join(scene.notes), OmissionWarning, stacklevel=3)
        return scene

    @property
    def notes(self) -> list[str]:
        """Comments at the head of its text: of an imported robot, what the scene does not have."""
        head = takewhile(lambda line: line.startswith("#"), self.toml.splitlines())
        return [line.lstrip("# ") for line in head]

    @property
    def name(self) -> str:
        """Short name."""
        return self._native.name

    @property
    def title(self) -> str:
        """One-line title."""
        return self._native.title

    @property
    def description(self) -> str:
        """Description of the machine."""
        return self._native.description

    @property
    def toml(self) -> str:
        """Text of its file, without the changes."""
        return self._native.origin()[0]

    @property
    def changes(self) -> dict[str, str]:
        """Parameters changed by `set`, as text with units."""
        return dict(self._native.origin()[3])

    @property
    def bodies(self) -> list[str]:
        """Names of the moving bodies."""
        return self._native.bodies

    @property
    def ball_joints(self) -> list[str]:
        """Names of the joints with play: balls, pins and blocks."""
        return self._native.ball_joints

    @property
    def sites(self) -> dict[str, list[str]]:
        """Places where each joint with play can touch: `{"J": ["J.a", "J.b"]}`; channels such as `J.a.normal` are theirs."""
        return dict(self._native.sites)

    @property
    def parameters(self) -> dict[str, Parameter]:
        """All parameters by key: those of the scene, then those of each joint with play."""
        return {key: self.parameter(key) for key in self._native.keys()}

    def parameter(self, key: str) -> Parameter:
        """The parameter `key`, which may also be a number of the file such as `body.rod.mass`."""
        return Parameter(**self._native.parameter(key))

    def __getitem__(self, key: str) -> float | int | str | None:
        """Value of the parameter `key`, SI."""
        return self.parameter(key).value

    def channels(self) -> list[Channel]:
        """Channels that a run can record."""
        return [Channel(*row) for row in self._native.channels()]

    def set(self, changes: Mapping[str, Quantity | None] | None = None, /, **by_name: Quantity | None) -> Scene:
        """Another scene with changed parameters.

        A keyword is the last part of a key of the scene: `set(clearance="0.5 mm")` changes `contact.clearance`. A mapping has
        whole keys: `set({"joint.A.clearance": 1e-4})`. Numbers are SI; None returns to the value of the file.
        """
        named = [(self._key_of(name), value) for name, value in by_name.items()]
        return Scene(self._native.set([*(changes or {}).items(), *named]))

    def _key_of(self, name: str) -> str:
        keys = [key for key in self._native.keys() if not key.startswith("joint.")]
        found = [key for key in keys if key.rsplit(".", 1)[-1] == name]
        if len(found) > 1:
            raise OptionError(f"{name}: several parameters have this name: {', '.join(found)}; give a mapping with the whole key")
        return found[0] if found else name

    def check(self) -> Check:
        """Assembles the machine, counts its bodies, degrees of freedom and constraints, and collects warnings."""
        return Check(**self._native.check())

    def run(
        self,
        duration: Quantity,
        every: Quantity | None = None,
        *,
        channels: Sequence[str] = (),
        progress: Callable[[float], object] | None = None,
        warn: bool = True,
    ) -> Run:
        """Runs the scene for `duration`, s, with a row every `every`, s (a thousandth of the duration by default).

        `channels` are names or patterns (`"A.*"`); without any, the run records those that `jointplay run` writes. `progress`
        is called with the fraction done, from 0 to 1. Doubts about the results become warnings unless `warn` is False.
        """
        names = [channels] if isinstance(channels, str) else list(channels)
        results = _native.run(self._native, duration, every, names, progress)
        run = Run(self, results)
        if warn:
            for doubt in run.doubts:
                warnings.warn(f"{self.name}: {doubt}", DoubtWarning, stacklevel=2)
        if results["fault"] is not None:
            raise Stopped(results["fault"], time=run.end, advice=results["advice"], run=run)
        return run

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Scene) and self._native == other._native

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpickle, (self._native.origin(),)

    def __repr__(self) -> str:
        changed = "".join(f", {key} = {value}" for key, value in self.changes.items())
        return f"<jointplay.Scene {self.name}{changed}>"

    def _repr_html_(self) -> str:
        frame = frame_of(self._native)
        if frame is not None:
            return frame
        rows = "".join(
            f"<tr><td>{html.escape(key)}</td><td>{html.escape(value.text)}</td><td>{html.escape(value.label)}</td></tr>"
            for key, value in self.parameters.items()
            if not key.startswith("joint.")
        )
        head = f"<b>{html.escape(self.title)}</b>"
        return f"{head}<table><tr><th>parameter</th><th>value</th><th></th></tr>{rows}</table>"


def _unpickle(origin: Any) -> Scene:
    return Scene(_native.Scene.read_again(origin))


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
        return frame_of(self.scene._native, self.end) or html.escape(repr(self))


INTEGERS = ("steps",)
FLAGS = ("floored", "disturbed")


def impact_table(joints: list[tuple[str, list[str]]], names: list[str], values: NDArray[np.float64]) -> NDArray[Any]:
    """Structured array of impacts; each row of `values` becomes a column. `joints` are the joints with play and their sites."""
    columns = dict(zip(names, values, strict=True))
    which = [(int(joint), int(site)) for joint, site in zip(columns["joint"], columns["site"], strict=True)]
    words = {
        "joint": np.array([joints[joint][0] for joint, _ in which] or [""]),
        "site": np.array([joints[joint][1][site] for joint, site in which] or [""]),
    }
    types: dict[str, Any] = {name: float for name in names}
    types.update({name: int for name in INTEGERS}, **{name: bool for name in FLAGS})
    types.update({name: text.dtype for name, text in words.items()})
    table = np.zeros(values.shape[1], dtype=list(types.items()))
    for name, column in columns.items():
        table[name] = words[name][: len(table)] if name in words else column
    return table
