"""Wear over many cycles, of which a few are run and the others extrapolated (cycle jumps)."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._options import library, whole
from ._scene import run_scene
from .errors import DoubtWarning, OptionError

if TYPE_CHECKING:
    import pandas

    from collections.abc import Iterator

    from ._scene import Quantity, Run, Scene, Walls

Array = NDArray[np.float64]

MAX_CYCLES = 1e15
"""Most cycles; their number is a float."""
MAX_JUMPS = 10_000
"""Most accepted jumps."""
SLOWED, SLOWED_WALLS = 1e-6, 1e-4
"""Part of the wear coefficients with which rates are measured: the clearances stay as they are, and the rate is proportional to it. The
second where walls wear by direction, whose depths do not begin at 0: less would drown in their rounding."""
LEAST_FACTOR, MOST_FACTOR, SAFETY = 0.2, 4.0, 0.8
"""Largest changes of the jump from one to the next, and the part of the tolerance that it aims at."""
MAX_SHORTENED = 4
"""How often a jump is shortened. A rate that scatters from run to run has differences that no shorter jump lessens."""
ROUNDING = 1e-12
"""Part of the cycles by which the last jump may miss the end."""


class Play(NamedTuple):
    """A play that wears."""

    key: str
    """Key of the parameter that it is: `joint.S.clearance`, `joint.J.play.axial`."""
    joint: str
    """Name of the joint."""
    channel: str
    """Channel of its worn depth."""
    walls: tuple[int, ...] = ()
    """Where it wears by direction, the number of depths of each of its walls."""


class Measured(NamedTuple):
    """What the observed periods of a run with given worn depths say."""

    rates: Array
    """Growth of each worn depth in a cycle, m: of each play, or of all depths of its walls."""
    peaks: dict[str, float]
    """Largest normal force on each joint that wears, N."""
    tip_error: float | None
    """Largest tip error, m; None where the scene has none."""


@dataclass(frozen=True)
class Wear:
    """Result of `wear`: a row for the start and for the end of each jump."""

    cycles: Array
    """Number of cycles so far."""
    clearance: dict[str, Array]
    """Play by the key of its parameter, m."""
    depth: dict[str, Array]
    """The worn part of it, m; where it wears by direction, the mean over its walls."""
    peak_force: dict[str, Array]
    """Largest normal force in the observed periods, N, by joint."""
    tip_error: Array | None
    """Largest distance of the probe tip from where the ideal mechanism has it in those periods, m; None where the scene has none."""
    difference: Array = field(repr=False)
    """Of each jump the largest difference between the depths after the whole jump and after two halves, over the largest growth in
    it."""
    scene: Scene
    """The scene with the last clearances; those that wear by direction stay as they are set."""
    worn_walls: Walls
    """The walls that have worn by direction in the end, for `Scene.run(..., worn=...)`."""
    runs: int
    """Number of runs."""

    def to_pandas(self) -> pandas.DataFrame:
        """One line per row: cycles, clearances, forces and the tip error, with units in the names of the columns."""
        library("pandas", "pandas")
        import pandas

        columns: dict[str, Any] = {"cycles": self.cycles}
        columns |= {f"{key}_m": own for key, own in self.clearance.items()}
        columns |= {f"{joint}_peak_N": own for joint, own in self.peak_force.items()}
        if self.tip_error is not None:
            columns["tip_error_m"] = self.tip_error
        columns["difference"] = np.concatenate([[0.0], self.difference])
        return pandas.DataFrame(columns)

    def plot(self, axes: Any = None) -> Any:
        """Clearances, forces and the tip error against cycles, one above the other; the axes, by Matplotlib."""
        pyplot = library("matplotlib.pyplot")
        parts: list[tuple[str, dict[str, Array]]] = [
            ("clearance, mm", {key: 1e3 * own for key, own in self.clearance.items()}),
            ("peak force, N", self.peak_force),
        ]
        if self.tip_error is not None:
            parts.append(("tip error, mm", {"tip": 1e3 * self.tip_error}))
        if axes is None:
            _, axes = pyplot.subplots(len(parts), 1, sharex=True, squeeze=False, layout="constrained")
            axes = axes[:, 0]
        for own, (label, curves) in zip(axes, parts, strict=True):
            for name, values in curves.items():
                own.plot(self.cycles, values, marker=".", label=name)
            own.set_ylabel(label)
            own.legend()
        axes[-1].set_xlabel("cycles")
        return axes

    def __repr__(self) -> str:
        return f"<jointplay.Wear: {self.cycles[-1]:g} cycles in {len(self.cycles) - 1} jumps, {self.runs} runs>"


def wearing_plays(scene: Scene) -> list[Play]:
    """The plays of a scene that wear."""
    plays: list[Play] = []
    keys = set(scene.parameters)
    for joint in scene.ball_joints:
        if value_of(scene, f"joint.{joint}.wear_coefficient") > 0.0:
            own = ((f"joint.{joint}.{part}", channel) for part, channel in PLAY_CHANNELS.items())
            plays += [
                Play(key, joint, f"{joint}.{channel}") for key, channel in own if key in keys and value_of(scene, key) > 0.0
            ]
    if any(scene[f"joint.{joint}.wear_shape"] == "profile" for joint in scene.ball_joints):
        walls = run_scene(scene, 0.0, channels=["time"], warn=False)[1]
        by_direction = {joint: tuple(len(wall) for wall in own) for joint, own in walls.items()}
        plays = [
            play._replace(walls=by_direction.get(play.joint, ())) if play.channel == f"{play.joint}.worn" else play
            for play in plays
        ]
    return plays


PLAY_CHANNELS = {
    "clearance": "worn",
    "play.radial": "worn",
    "play.axial": "second_worn",
    "play.y": "worn",
    "play.z": "second_worn",
}
"""Last parts of the keys of plays, and of the channels of what has worn off them."""


def value_of(scene: Scene, key: str) -> float:
    """Value of a parameter that is a number, SI."""
    value = scene[key]
    assert isinstance(value, (int, float)), key
    return float(value)


def seconds_of(name: str, value: Quantity) -> float:
    """A time above 0, s."""
    seconds = _native.read_duration(name, value)
    if seconds == 0.0:
        raise OptionError(f"{name} = {value!r}: allowed times above 0 s")
    return seconds


def amount(name: str, value: float, least: float, most: float) -> float:
    """A number from `least` to `most`."""
    if isinstance(value, bool) or not least <= float(value) <= most:
        raise OptionError(f"{name} = {value!r}: allowed numbers from {least:g} to {most:g}")
    return float(value)


class WearingScene:
    """A scene that has worn by given depths: one of each play, or all those of its walls."""

    def __init__(self, scene: Scene, period: float, settle: int, observe: int, rows: int) -> None:
        self.scene, self.period, self.settle, self.observe, self.rows = scene, period, settle, observe, rows
        self.plays = wearing_plays(scene)
        if not self.plays:
            raise OptionError("scene: nothing wears; set contact.wear_coefficient, or joint.NAME.wear_coefficient, above 0 m^2/N")
        self.set = np.array([value_of(scene, play.key) for play in self.plays])
        self.counts = np.array([sum(play.walls) or 1 for play in self.plays])
        self.slowed = SLOWED_WALLS if any(play.walls for play in self.plays) else SLOWED
        ends = np.cumsum(self.counts)
        self.parts = [slice(end - count, end) for end, count in zip(ends, self.counts, strict=True)]
        self.joints = list(dict.fromkeys(play.joint for play in self.plays))
        names = {channel.name for channel in scene.channels}
        self.has_tip = "tip_error" in names
        self.runs = 0

    def means(self, depths: Array) -> Array:
        """Of each play the mean of its depths, m."""
        return np.array([np.mean(depths[part]) for part in self.parts], dtype=np.float64)

    def at(self, depths: Array) -> Scene:
        """The scene with plays wider by `depths`, m, but for those that wear by direction."""
        wider = {play.key: float(own + depths[part][0]) for play, own, part in self._each() if not play.walls}
        return self.scene.set(wider)

    def walls(self, depths: Array) -> Walls:
        """The walls that have worn by direction to `depths`, m."""
        return {
            play.joint: np.split(depths[part], np.cumsum(play.walls)[:-1]) for play, _, part in self._each() if play.walls
        }

    def after(self, depths: Array, rates: Array, cycles: float) -> Array:
        """Depths after `cycles` more at these rates, m; where a wall wears by direction, the volumes go on at theirs in each."""
        grown = depths + cycles * rates
        for play, _, part in self._each():
            if play.walls:
                ends = np.cumsum(play.walls)[:-1]
                walls, growth = (np.split(own[part], ends) for own in (depths, np.maximum(rates, 0.0)))
                grown[part] = np.concatenate(_native.wear_on(self.scene.native, play.joint, walls, growth, cycles))
        return grown

    def combined(self, whole: Array, halves: Array) -> Array:
        """Depths after a jump, from those after the whole of it and after two halves, m. Each is wrong in proportion to its length: twice the
        halves less the whole cancels that. The difference of two walls need not be one that the part can touch: there the halves."""
        grown = 2.0 * halves - whole
        for play, _, part in self._each():
            if play.walls:
                grown[part] = halves[part]
        return grown

    def _each(self) -> Iterator[tuple[Play, float, slice]]:
        return zip(self.plays, self.set, self.parts, strict=True)

    def measure(self, depths: Array) -> Measured:
        """Rates and forces at these worn depths, m, from a run in which the clearances stay as they are."""
        coefficients = [f"joint.{joint}.wear_coefficient" for joint in self.joints]
        slowed = {key: self.slowed * value_of(self.scene, key) for key in coefficients}
        tip = ["tip_error"] if self.has_tip else []
        normal = [f"{joint}.normal" for joint in self.joints]
        channels = [play.channel for play in self.plays] + normal + tip
        periods = self.settle + self.observe
        every = self.period / self.rows
        scene, walls = self.at(depths).set(slowed), self.walls(depths)
        begin = self.settle * self.period if walls else 0.0
        run, before = run_scene(scene, periods * self.period, every, channels, warn=False, worn=walls, walls_from=begin)
        self.runs += 1
        first = self.settle * self.rows
        growth = [
            np.concatenate(run.worn_walls[play.joint]) - np.concatenate(before[play.joint])
            if play.walls
            else np.array([run[play.channel][-1] - run[play.channel][first]])
            for play in self.plays
        ]
        return Measured(
            rates=np.concatenate(growth) / (self.slowed * self.observe),
            peaks={joint: self._peak(run, joint, first) for joint in self.joints},
            tip_error=float(np.max(run["tip_error"][first:])) if self.has_tip else None,
        )

    def _peak(self, run: Run, joint: str, first: int) -> float:
        """Largest normal force from row `first` on, N: at the rows, and of the impacts between them."""
        own = run.impacts[(run.impacts["joint"] == joint) & (run.impacts["start_s"] >= run.time[first])]
        return float(max(np.max(run[f"{joint}.normal"][first:]), np.max(own["peak_N"], initial=0.0)))


def wear(
    scene: Scene,
    cycles: float,
    *,
    period: Quantity,
    jump: float | None = None,
    tolerance: float = 0.01,
    settle: int = 1,
    observe: int = 1,
    rows: int = 1000,
    progress: Callable[[float], object] | None = None,
) -> Wear:
    """What `scene` wears in `cycles` cycles of `period`, s: clearances, tip error and peak forces against cycles.

    A run of `settle` periods, which are a transient, and `observe` more says how much each play grows in a cycle, at clearances that stay
    as they are. This growth is extrapolated over `jump` cycles, once in one jump and once in two halves, each with its own run. The two
    are combined to second order, but for walls that wear by direction, where the halves alone count; their difference, over the growth, is in
    `difference`. Without a `jump` it is chosen so that the difference
    stays below `tolerance`; a given one is kept.

    Each run starts from the start of the scene, whose clearances are wider by what has worn off, or its walls deeper where they wear by
    direction: that is the state of a run in which the walls have worn, but for the stiffness of collars that touch, which is that of the
    radial play at the start of a run. Forces are the
    largest at `rows` rows of each period and of the impacts between them. A jump is shortened a few times at most: where rates scatter
    from run to run, only more periods to `observe` help, and a `DoubtWarning` says so. A run that stops raises `Stopped`. `progress` is
    called with the fraction done, from 0 to 1.
    """
    end = amount("cycles", cycles, 1.0, MAX_CYCLES)
    fixed = None if jump is None else amount("jump", jump, 1.0, MAX_CYCLES)
    allowed = amount("tolerance", tolerance, 1e-6, 1.0)
    times = (whole("settle", settle, 0, 1000), whole("observe", observe, 1, 1000), whole("rows", rows, 10, 100_000))
    model = WearingScene(scene, seconds_of("period", period), *times)

    done, depths = 0.0, np.zeros(int(np.sum(model.counts)))
    now = model.measure(depths)
    entries = [(done, depths, now)]
    differences: list[float] = []
    # The first jump widens the play that grows fastest, relative to its size, by the tolerance.
    fastest = float(np.max(now.rates / np.repeat(model.set, model.counts)))
    size = fixed or (allowed / fastest if fastest > 0.0 else end)
    shortened = 0
    while done < end * (1.0 - ROUNDING):
        if len(differences) == MAX_JUMPS:
            raise OptionError(
                f"cycles = {cycles!r}: more than {MAX_JUMPS} jumps, of {size:g} cycles now; allow a larger jump or tolerance"
            )
        size = min(max(size, 1.0), end - done)
        half = model.after(depths, now.rates, 0.5 * size)
        whole_jump = model.after(depths, now.rates, size)
        halves = model.after(half, model.measure(half).rates, 0.5 * size)
        growth = float(np.max(halves - depths))
        difference = float(np.max(np.abs(halves - whole_jump))) / growth if growth > 0.0 else 0.0
        factor = float(np.clip(SAFETY * allowed / max(difference, 1e-300), LEAST_FACTOR, MOST_FACTOR))
        if fixed is None and difference > allowed and size > 1.0 and shortened < MAX_SHORTENED:
            size *= min(factor, SAFETY)
            shortened += 1
            continue
        shortened = 0
        depths, done = np.maximum(model.combined(whole_jump, halves), depths), done + size
        now = model.measure(depths)
        entries.append((done, depths, now))
        differences.append(difference)
        size = fixed or size * factor
        if progress is not None:
            progress(min(done / end, 1.0))

    worst = max(differences, default=0.0)
    if worst > allowed:
        text = (
            f"{scene.name}: a jump and two halves of it differ by {worst:.2g} of what wears, more than the tolerance {allowed:g}"
        )
        warnings.warn(f"{text}: observe more periods, or choose a shorter jump", DoubtWarning, stacklevel=2)
    of_play = np.array([model.means(own) for _, own, _ in entries]).T
    return Wear(
        cycles=np.array([own for own, _, _ in entries]),
        clearance={play.key: at + own for play, at, own in zip(model.plays, model.set, of_play, strict=True)},
        depth={play.key: own for play, own in zip(model.plays, of_play, strict=True)},
        peak_force={joint: np.array([own.peaks[joint] for _, _, own in entries]) for joint in model.joints},
        tip_error=np.array([own.tip_error for _, _, own in entries], dtype=float) if model.has_tip else None,
        difference=np.array(differences),
        scene=model.at(depths),
        worn_walls=model.walls(depths),
        runs=model.runs,
    )
