"""Scenes, machines with their parameters, and their runs from t = 0 to an instant."""

from __future__ import annotations

import html
import json
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

from . import _native, _show
from ._geometry import Shape, matrices, rotations_of, shapes_of
from ._link import frame_of
from ._options import library, whole, write
from .errors import ChannelError, DoubtWarning, OmissionWarning, OptionError, Stopped

if TYPE_CHECKING:
    import pandas
    import xarray

Quantity = float | int | str
"""A number in SI units, or text with a unit."""
Walls = Mapping[str, Sequence[NDArray[np.float64]]]
"""Worn depths of walls that wear by direction, m, by joint."""


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
    unit: str
    """SI unit; empty for a number without one and for a choice."""
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
        self.native = native
        """The compiled scene, for the modules of the package."""

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
        text = self.native.origin()[0]
        head = takewhile(lambda line: line.startswith("#"), text.splitlines())
        return [line.lstrip("# ") for line in head]

    @property
    def name(self) -> str:
        """Short name."""
        return self.native.name

    @property
    def title(self) -> str:
        """One-line title."""
        return self.native.title

    @property
    def description(self) -> str:
        """Description of the machine."""
        return self.native.description

    @property
    def toml(self) -> str:
        """Text of a scene file of this machine: that of its file, with the changes in it."""
        return self.native.text()

    def to_dict(self) -> dict[str, Any]:
        """The sections and keys of `toml`, from which `Scene.from_dict` makes the same machine."""
        sections: dict[str, Any] = json.loads(self.native.sections())
        return sections

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes `toml` into a file, from which `Scene.load` reads the same machine, and beside it the files that it names.

        The scene file replaces an earlier one; of the others, one with a different content is refused.
        """
        out = Path(path)
        files = {out.parent / name: content for name, content in self.native.files()}
        for file, content in files.items():
            if file.exists() and file.read_bytes() != content:
                raise OptionError(f"{file} exists already, and has not what the scene {self.name} reads from a file of this name")
        for file, content in {**files, out: self.toml.encode()}.items():
            write(file, content)

    @property
    def changes(self) -> dict[str, str]:
        """Parameters changed by `set`, as text with units."""
        return dict(self.native.origin()[3])

    @property
    def bodies(self) -> list[str]:
        """Names of the moving bodies."""
        return self.native.bodies

    @property
    def ball_joints(self) -> list[str]:
        """Names of the joints with play: balls, pins and blocks."""
        return self.native.ball_joints

    @property
    def sites(self) -> dict[str, list[str]]:
        """Places where each joint with play can touch: `{"J": ["J.a", "J.b"]}`; channels such as `J.a.normal` are theirs."""
        return dict(self.native.sites)

    @property
    def parameters(self) -> dict[str, Parameter]:
        """All parameters by key: those of the scene, then those of each joint with play."""
        return {key: self.parameter(key) for key in self.native.keys()}

    def parameter(self, key: str) -> Parameter:
        """The parameter `key`, which may also be a number of the file such as `body.rod.mass`."""
        return Parameter(**self.native.parameter(key))

    def __getitem__(self, key: str) -> float | int | str | None:
        """Value of the parameter `key`, SI."""
        return self.parameter(key).value

    @property
    def channels(self) -> list[Channel]:
        """Channels that a run can record."""
        return [Channel(*row) for row in self.native.channels()]

    def set(self, changes: Mapping[str, Quantity | None] | None = None, /, **by_name: Quantity | None) -> Scene:
        """Another scene with changed parameters.

        A keyword is the last part of a key of the scene: `set(clearance="0.5 mm")` changes `contact.clearance`. A mapping has
        whole keys: `set({"joint.A.clearance": 1e-4})`. Numbers are SI; None returns to the value of the file.
        """
        named = [(self._key_of(name), value) for name, value in by_name.items()]
        return Scene(self.native.set([*(changes or {}).items(), *named]))

    def _key_of(self, name: str) -> str:
        keys = [key for key in self.native.keys() if not key.startswith("joint.")]
        found = [key for key in keys if key.rsplit(".", 1)[-1] == name]
        if len(found) > 1:
            raise OptionError(f"{name}: several parameters have this name: {', '.join(found)}; give a mapping with the whole key")
        return found[0] if found else name

    def geometry(self) -> list[Shape]:
        """Drawn shapes of the world, then of each body, in body axes; a body without any has bars to its joints."""
        return shapes_of(self.native)

    def check(self) -> Check:
        """Assembles the machine, counts its bodies, degrees of freedom and constraints, and collects warnings."""
        return Check(**self.native.check())

    def run(
        self,
        duration: Quantity,
        every: Quantity | None = None,
        *,
        channels: Sequence[str] = (),
        progress: Callable[[float], object] | None = None,
        warn: bool = True,
        worn: Walls | None = None,
    ) -> Run:
        """Runs the scene for `duration`, s, with a row every `every`, s (a thousandth of the duration by default).

        `channels` are names or patterns (`"A.*"`); without any, the run records those that `jointplay run` writes. `progress`
        is called with the fraction done, from 0 to 1. Doubts about the results become warnings unless `warn` is False. `worn` are
        walls that have worn by direction (`contact.wear_shape = "profile"`), as in `Run.worn_walls` and `Wear.worn_walls`: the run starts with
        them.
        """
        return run_scene(self, duration, every, channels, progress=progress, warn=warn, worn=worn)[0]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Scene) and self.native == other.native

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpickle, (self.native.origin(),)

    def __repr__(self) -> str:
        changed = "".join(f", {key} = {value}" for key, value in self.changes.items())
        return f"<jointplay.Scene {self.name}{changed}>"

    def _repr_html_(self) -> str:
        frame = frame_of(self.native)
        if frame is not None:
            return frame
        rows = "".join(
            f"<tr><td>{html.escape(key)}</td><td>{html.escape(value.text)}</td><td>{html.escape(value.label)}</td></tr>"
            for key, value in self.parameters.items()
            if not key.startswith("joint.")
        )
        head = f"<b>{html.escape(self.title)}</b>"
        return f"{head}<table><tr><th>parameter</th><th>value</th><th></th></tr>{rows}</table>"


def read_walls(worn: Walls | None) -> dict[str, list[NDArray[np.float64]]]:
    """Worn walls as a caller gives them."""
    try:
        walls = {str(joint): [np.array(wall, dtype=np.float64) for wall in own] for joint, own in (worn or {}).items()}
    except (AttributeError, TypeError, ValueError) as error:
        raise OptionError(f"worn: {error}; allowed as in Run.worn_walls: by joint, an array of depths, m, for each wall") from error
    for joint, own in walls.items():
        if any(wall.ndim != 1 for wall in own):
            raise OptionError(f"worn: the walls of {joint}: allowed a one-dimensional array of depths, m, for each")
    return walls


def run_scene(
    scene: Scene,
    duration: Quantity,
    every: Quantity | None = None,
    channels: Sequence[str] = (),
    *,
    progress: Callable[[float], object] | None = None,
    warn: bool = True,
    worn: Walls | None = None,
    walls_from: float = 0.0,
) -> tuple[Run, Walls]:
    """As `Scene.run`; also the worn walls at `walls_from`, s, where a step ends."""
    names = [channels] if isinstance(channels, str) else list(channels)
    results = _native.run(scene.native, duration, every, names, progress, read_walls(worn), walls_from)
    run = Run(scene, results)
    if warn:
        for doubt in run.doubts:
            warnings.warn(f"{scene.name}: {doubt}", DoubtWarning, stacklevel=3)
    if results["fault"] is not None:
        raise Stopped(results["fault"], time=run.end, advice=results["advice"], run=run)
    return run, results["worn_walls_before"]


def _unpickle(origin: Any) -> Scene:
    return Scene(_native.Scene.read_again(origin))


class Run(Mapping[str, NDArray[np.float64]]):
    """Results of `Scene.run`: a mapping of channels to arrays, which share the memory of the run, are read-only, and outlive it."""

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
        """Steps, evaluations and rejected steps; under `joints` the `peak_normal`, N, `peak_time`, s, and `impacts` of each, and of
        each of its two plays what has `worn` off, m, and the `worn_volume`, m^3."""
        self.worn_walls: Walls = results["worn_walls"]
        """By joint, of each of its walls that wear by direction how deep, m: of a socket on a spiral about z, of a bearing in the sectors of its
        wear map. They are the heights of bumps whose sum is the worn depth; their mean is the volume over the area."""
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
        return self._values[self._place(channel), : self._rows].T

    def _place(self, channel: str) -> int | slice:
        """Row of a channel among the values, or the rows of a vector."""
        index = self._indices.get(channel)
        if index is not None:
            return index
        parts = [name.rsplit(".", 1) for name in self.channels]
        components = {part[1]: i for i, part in enumerate(parts) if part[0] == channel and part[1:] not in ([], ["size"])}
        first = components.get("x")
        if first is not None and components == {"x": first, "y": first + 1, "z": first + 2}:
            return slice(first, first + 3)
        raise ChannelError(explain(self, channel))

    def __iter__(self) -> Iterator[str]:
        return iter(self.channels)

    def __len__(self) -> int:
        """Number of channels."""
        return len(self._channels)

    # A comparison of arrays has no single answer.
    __eq__ = object.__eq__

    def __hash__(self) -> int:
        return object.__hash__(self)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        """The rows as a structured array with a field for each channel."""
        if copy is False:
            raise ValueError("a structured array of a run is a copy; run[channel] shares its memory")
        table = np.empty(self._rows, dtype=[(name, float) for name in self])
        for name in self:
            table[name] = self[name]
        return table if dtype is None else table.astype(dtype)

    @property
    def transforms(self) -> NDArray[np.float64]:
        """Poses of the bodies, in scene order, in each row, body to world: shape (rows, bodies, 4, 4). They need the channels
        `*.pose.*`."""
        poses = [[self[f"{body}.pose.{part}"] for part in _POSE] for body in self.scene.bodies]
        table = np.moveaxis(np.array(poses).reshape(-1, 6, self._rows), -1, 0)
        return matrices(table[..., :3], rotations_of(table[..., 3:]))

    def plot(self, *channels: str, axes: Any = None) -> Any:
        """Draws channels over time into Matplotlib's `axes`, by default new ones, which it returns."""
        rows = np.arange(len(self))
        places = [int(place) for channel in channels for place in rows[self._place(channel)].ravel()]
        curves = [(self._channels[i][0], self._channels[i][2], self._values[i, : self._rows]) for i in places]
        return _show.plot(axes, self.time, curves)

    def animate(self, frames: int = 60, *, slower: float | None = None) -> Any:
        """The moving machine, a Matplotlib animation that a notebook shows with controls, and `save` writes as a film.

        `frames` instants are shown, `slower` times slower than they passed, by default within four seconds. A run that has not
        recorded the poses of its bodies is repeated for them, with the same bits.
        """
        whole("frames", frames, 2, 10_000)
        poses = [f"{body}.pose.{part}" for body in self.scene.bodies for part in _POSE]
        run = self
        if not set(poses) <= set(self.channels):
            run = self.scene.run(self.end, self.end / (frames - 1) if self.end else None, channels=poses, warn=False)
        rows = np.unique(np.linspace(0, run._rows - 1, frames).round().astype(int))
        span = 4.0 if slower is None else slower * self.end
        shapes, names = self.scene.geometry(), self.scene.bodies
        if not shapes:
            raise OptionError(f"{self.scene.name}: nothing is drawn of this scene: give its bodies shapes")
        return _show.animate(self.scene.name, shapes, names, run.time[rows], run.transforms[rows], 1e3 * span / len(rows))

    def impacts_to_pandas(self) -> pandas.DataFrame:
        """The impacts as a data frame, one row per impact."""
        library("pandas", "pandas")
        import pandas

        return pandas.DataFrame(self.impacts)

    def to_xarray(self) -> xarray.Dataset:
        """The channels over the coordinate `time`, with their units."""
        library("xarray", "xarray")
        import xarray

        about = {name: {"units": unit, "long_name": text} for name, _, unit, text in self._channels}
        data = {name: ("time", self[name], about[name]) for name in self if name != "time"}
        coordinates = {"time": ("time", self.time, about["time"])}
        return xarray.Dataset(data, coordinates, {"scene": self.scene.name, "hash": self.hash})

    def to_pandas(self) -> pandas.DataFrame:
        """The rows as a data frame, with the columns of `jointplay run --out`."""
        library("pandas", "pandas")
        import pandas

        columns = [column for _, column, _, _ in self._channels]
        return pandas.DataFrame(self._values[:, : self._rows].T, columns=columns)

    def __repr__(self) -> str:
        return f"<jointplay.Run {self.scene.name}: {self._rows} rows, {len(self._channels)} channels, to {self.end:g} s>"

    def _repr_html_(self) -> str:
        return frame_of(self.scene.native, self.end) or html.escape(repr(self))


def recorded(run: Run) -> dict[str, str]:
    """The channels of a run by name and by column."""
    names = set(run.channels)
    return {text: one.name for one in run.scene.channels if one.name in names for text in (one.name, one.column)}


def explain(run: Run, channel: str) -> str:
    """Why a run has no channel of this name."""
    members = [name for name in run.channels if name.startswith(f"{channel}.")]
    if members:
        return f"`{channel}` stands for several channels: {', '.join(members)}"
    if any(channel in (known.name, known.column) for known in run.scene.channels):
        return f"`{channel}` was not recorded: pass channels=[{channel!r}, …] to Scene.run"
    near = get_close_matches(channel, recorded(run), n=1)
    hint = f" (did you mean `{near[0]}`?)" if near else ""
    return f"`{channel}` is not a channel of this run{hint}"


_POSE = ("x", "y", "z", "alpha", "beta", "gamma")
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
