"""The computations behind section 4 of the paper (`paper.toml`), and their results."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from importlib import resources
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._scene import Scene
from ._study import record_of
from ._sweep import Sweep, SweepResult

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

Array = NDArray[np.float64]
Case = tuple[float, float]
"""Clearance (mm) and friction coefficient of a run."""


@dataclass(frozen=True)
class Series:
    """Three runs that differ in one parameter."""

    key: str
    """Key of the parameter."""
    label: str
    """Name of the parameter."""
    unit: str
    """Unit of its values; empty for a pure number."""
    size: float
    """SI size of the unit."""
    value: str
    """Format of a value in legends and tables."""
    range: tuple[float, float]
    """Ends of the diagrams over the parameter, in its unit."""
    runs: tuple[Case, Case, Case]
    """The runs, in ascending order of the parameter."""

    def of(self, run: Case) -> float:
        """Value of the parameter in `run`, in its unit."""
        return run[0] if self.key == "contact.clearance" else run[1]

    def name(self, run: Case) -> str:
        """Label of `run` in legends and tables."""
        return self.value.format(self.of(run))

    def vary(self, ends: tuple[float, float], values: int) -> dict[str, str]:
        """Equally spaced values for a sweep."""
        return {self.key: f"{ends[0]}{self.unit}..{ends[1]}{self.unit}:{values}"}


class Published(NamedTuple):
    """A number printed in the paper."""

    figure: str
    """Figure with its part: `6a`."""
    run: Case
    """The run."""
    quantity: str
    """One of `QUANTITIES`."""
    value: float
    """The number, SI."""


PAPER: dict[str, Any] = tomllib.loads(resources.files("jointplay").joinpath("paper.toml").read_text(encoding="utf-8"))
"""The table of the paper."""
PERIOD: float = PAPER["period"]
"""Period of the drives, s."""
RUNS: list[Case] = [(run[0], run[1]) for run in PAPER["runs"]]
"""The paper's runs; the first one is the nominal one."""
SERIES = {
    name: Series(**(row | {"runs": tuple((run[0], run[1]) for run in row["runs"])})) for name, row in PAPER["series"].items()
}
"""The two series of runs, over clearance and over friction."""
NUMBERS = [Published(figure, tuple(run), quantity, value) for figure, run, quantity, value in PAPER["number"]]
"""Every number of section 4.2 whose run is named."""


class Column(NamedTuple):
    """A column of a run."""

    label: str
    """Label in plots."""
    unit: str
    """Unit in plots."""
    size: float
    """SI size of that unit."""
    channel: str
    """The recorded channel; with a leading `-`, less that of the run with ideal joints."""


COLUMNS = {
    "x_m": Column("x", "mm", 1e-3, "platform.pose.x"),
    "vx_m_s": Column("velocity in x", "m/s", 1.0, "platform.velocity.x"),
    "ax_m_s2": Column("acceleration in x", "m/s²", 1.0, "platform.acceleration.x"),
    "beta_rad": Column("β", "mrad", 1e-3, "platform.pose.beta"),
    "beta_rate_rad_s": Column("rate of β", "rad/s", 1.0, "platform.velocity.beta"),
    "beta_accel_rad_s2": Column("acceleration of β", "rad/s²", 1.0, "platform.acceleration.beta"),
    "S1_normal_N": Column("contact force in S1", "N", 1.0, "S1.normal"),
    "S2_normal_N": Column("contact force in S2", "N", 1.0, "S2.normal"),
    "S3_normal_N": Column("contact force in S3", "N", 1.0, "S3.normal"),
    "x_deviation_m": Column("x less ideal", "mm", 1e-3, "-platform.pose.x"),
    "beta_deviation_rad": Column("β less ideal", "mrad", 1e-3, "-platform.pose.beta"),
}
"""Columns of a run by their names in files."""
DERIVATIVES = {"x": ("x_m", "vx_m_s", "ax_m_s2"), "beta": ("beta_rad", "beta_rate_rad_s", "beta_accel_rad_s2")}
"""Columns of the two coordinates that the paper plots, with their derivatives."""
JOINTS = ("S1", "S2", "S3")
QUANTITIES = {
    "largest deviation of x": ("m", "x_deviation_m"),
    "largest deviation of beta": ("rad", "beta_deviation_rad"),
    "largest velocity in x": ("m/s", "vx_m_s"),
    "largest angular rate of beta": ("rad/s", "beta_rate_rad_s"),
    "largest acceleration in x": ("m/s²", "ax_m_s2"),
    "largest acceleration of beta": ("rad/s²", "beta_accel_rad_s2"),
    **{f"largest contact force in {joint}": ("N", f"{joint}_normal_N") for joint in JOINTS},
    "largest contact force of any joint": ("N", ""),
    "last separation": ("s", ""),
}
"""Scalars of a run that the paper reports: SI unit, and column of which it is the largest magnitude, if it is one."""


def amplitude(coordinate: str, nth: int = 0) -> float:
    """Amplitude of a coordinate, m or rad, or of its `nth` derivative, in the ideal motion (59)."""
    return float(PAPER["amplitudes"][coordinate] * (2.0 * np.pi / PERIOD) ** nth)


class Extent(NamedTuple):
    """How much is computed."""

    rows: int
    """Rows of a run per output step of the paper."""
    settle: int
    """Periods before a settled curve is recorded."""
    runs: tuple[int, int]
    """Periods of the paper's runs for sections, and how many of them are discarded."""
    values: tuple[int, int]
    """Number of clearance and of friction values in the bifurcation diagrams."""
    sweep: tuple[int, int]
    """Periods and discarded periods per value."""


# An impact lasts about 0.1 ms, and accelerations have kinks in it: rows 20 µs apart miss up to 4 % of a peak, rows 5 µs apart
# up to 0.5 %.
FULL = Extent(200, 30, (200, 50), (100, 40), (100, 40))
QUICK = Extent(200, 4, (24, 8), (9, 7), (16, 6))


@dataclass
class Settled:
    """Settled motion of a run over one period."""

    columns: dict[str, Array]
    """x, beta and their rates at equal phases of the drive, SI."""
    width: dict[str, float]
    """Largest difference of x (m) and of beta (rad) from the period before, at equal phases."""


@dataclass
class Record:
    """A run of section 4.2 over one period."""

    columns: dict[str, Array]
    """`COLUMNS` at equal intervals, SI."""
    stride: int
    """Rows per output step of the paper."""
    peaks: dict[str, float]
    """Largest normal force of each joint in continuous time, N."""
    last_separation: float
    """Time at which a ball last left its socket, s; NaN if none did."""
    settled: Settled | None = None
    """Settled motion, if recorded."""

    @cached_property
    def time(self) -> Array:
        """Time of each row, s."""
        rows = len(self.columns["x_m"])
        return np.linspace(0.0, (rows - 1) * float(PAPER["sampling"]) / self.stride, rows)

    def value(self, quantity: str) -> float:
        """A quantity in continuous time, SI; NaN if there is none."""
        if quantity == "last separation":
            return self.last_separation
        if quantity == "largest contact force of any joint":
            return max(self.peaks.values())
        column = QUANTITIES[quantity][1]
        return self.peaks[column[:2]] if column.endswith("_normal_N") else float(np.abs(self.columns[column]).max())

    def samples(self, column: str) -> Array:
        """A column at the paper's output step."""
        return self.columns[column][:: self.stride]

    def sampled(self, quantity: str) -> float:
        """A quantity as a solver with the paper's output step would report it; NaN where that step does not matter."""
        column = QUANTITIES[quantity][1]
        return float(np.abs(self.samples(column)).max()) if column else float("nan")


REGIMES = {-1: "none", 0: "unclear", 2: "quasi-periodic", 3: "chaotic", 4: "not settled"}
"""Regimes of a sweep by their codes, besides the periodic one, which has its period."""


@dataclass
class Points:
    """Motions along one parameter."""

    values: Array
    """Values of the parameter: clearance in mm, or friction coefficient."""
    regimes: list[str]
    """Regime of each point; a periodic one with its period: `periodic 1`."""
    exponents: Array
    """Largest Lyapunov exponents, 1/s; NaN if not measured."""
    errors: Array
    """Their standard errors, 1/s."""
    sections: dict[str, Array]
    """Kept sections of the columns of x and beta, in order of time, SI: shape (points, sections)."""

    @classmethod
    def of(cls, result: SweepResult, series: Series) -> Points:
        """The points of a sweep over the parameter of `series`."""
        codes = zip(result["regime"].tolist(), result["period"].tolist(), strict=True)
        return cls(
            values=result.axes[series.key] / series.size,
            regimes=[REGIMES.get(code, f"periodic {period}") for code, period in codes],
            exponents=result["exponent_per_s"],
            errors=result["exponent_standard_error_per_s"],
            sections={column: result[f"section_{column}"] for columns in DERIVATIVES.values() for column in columns[:2]},
        )

    def latest(self, coordinate: str) -> Array:
        """Latest section of each point, m or rad."""
        return self.sections[DERIVATIVES[coordinate][0]][:, -1]

    def spread(self, coordinate: str) -> Array:
        """Range of the second half of the sections of each point, m or rad."""
        sections = self.sections[DERIVATIVES[coordinate][0]]
        return np.asarray(np.ptp(sections[:, sections.shape[1] // 2 :], axis=1), dtype=np.float64)


@dataclass
class Findings:
    """All results."""

    extent: Extent
    """How much was computed."""
    runs: dict[Case, Record]
    """The paper's runs."""
    lagrange: Record
    """The nominal run in the `lagrange` formulation."""
    ideal: Record
    """The run with ideal joints."""
    points: dict[str, Points]
    """Sweeps over one parameter, by name (`sweeps`)."""
    results: dict[str, SweepResult]
    """The same sweeps with all their arrays."""
    resolution: dict[str, float]
    """Smallest distinguishable differences of x (m) and beta (rad) between two sections."""

    def values(self, quantity: str, series: str) -> list[float]:
        """A quantity in continuous time in the three runs of a series."""
        return [self.runs[run].value(quantity) for run in SERIES[series].runs]


def scene_of(run: Case, **more: str) -> Scene:
    """The scene of `run`."""
    return Scene.load("spcmm").set({"contact.clearance": f"{run[0]} mm", "contact.friction": run[1]}).set(more)


def sweeps(extent: Extent) -> Iterator[tuple[str, Sweep]]:
    """The sweeps of a report by their names."""

    def sweep(vary: dict[str, str], periods: tuple[int, int], start: str = "cold") -> Sweep:
        return Sweep(scene_of(RUNS[0]), vary, periods=periods[0], discard=periods[1], start=start, exponent=start == "cold")

    for (name, series), values in zip(SERIES.items(), extent.values, strict=True):
        ends = series.of(series.runs[0]), series.of(series.runs[2])
        yield f"runs_by_{name}", sweep(series.vary(ends, 3), extent.runs)
        for branch, start in {"cold": "cold", "up": "follow-up", "down": "follow-down"}.items():
            yield f"{name}_{branch}", sweep(series.vary(series.range, values), extent.sweep, start)


def record(scene: Scene, extent: Extent, ideal: Record | None = None, settled: bool = False) -> Record:
    """Records a run; `ideal` is that with ideal joints, of which there is none before its own."""
    every = PAPER["sampling"] / extent.rows
    run = scene.run(PERIOD, every, channels=[column.channel.lstrip("-") for column in COLUMNS.values()], warn=False)
    columns = {name: run[column.channel.lstrip("-")] for name, column in COLUMNS.items()}
    for name, plain in {"x_deviation_m": "x_m", "beta_deviation_rad": "beta_rad"}.items():
        columns[name] = columns[plain] - (columns[plain] if ideal is None else ideal.columns[plain])
    peaks = {joint: float(run.statistics["joints"][joint]["peak_normal"]) for joint in JOINTS}
    last = float(run.impacts["end_s"].max()) if len(run.impacts) else float("nan")
    return Record(columns, extent.rows, peaks, last, settled_motion(scene, extent.settle) if settled else None)


def settled_motion(scene: Scene, settle: int, points: int = 800) -> Settled:
    """Motion in the second of the two periods after `settle` periods."""
    names = [column for columns in DERIVATIVES.values() for column in columns[:2]]
    run = scene.run((settle + 2) * PERIOD, PERIOD / points, channels=[COLUMNS[name].channel for name in names], warn=False)
    last_two = {name: run[COLUMNS[name].channel][-2 * points - 1 :] for name in names}
    width = {
        coordinate: float(np.abs(last_two[column][points:-1] - last_two[column][:points]).max())
        for coordinate, (column, _, _) in DERIVATIVES.items()
    }
    return Settled({name: values[points:].copy() for name, values in last_two.items()}, width)


def compute(extent: Extent, threads: int, progress: Callable[[str, float], None], out: Path | None = None) -> Findings:
    """Computes everything on `threads` threads, which do not affect the results; `progress` gets the name of the present
    stage and its fraction done. Finished points are in files beside the folder `out`, from which the next call resumes."""

    def computed(name: str, sweep: Sweep) -> SweepResult:
        record = None if out is None else record_of(out, name)
        return sweep.run(threads, lambda part: progress(f"sweep {name}", part), record=record)

    results = {name: computed(name, sweep) for name, sweep in sweeps(extent)}
    nominal, done = scene_of(RUNS[0]), count(1)
    ideal = record(nominal.set(clearance=0), extent)
    with ThreadPoolExecutor(threads) as pool:

        def submitted(scene: Scene, settled: bool) -> Future[Record]:
            future = pool.submit(record, scene, extent, ideal, settled)
            future.add_done_callback(lambda _: progress("runs", next(done) / (len(RUNS) + 1)))
            return future

        runs = {run: submitted(scene_of(run), settled=True) for run in RUNS}
        lagrange = submitted(nominal.set(formulation="lagrange"), settled=False)
    lengths = {"x": nominal["contact.ball_radius"], "beta": 0.1}
    # As sweeps distinguish sections: ten times the tolerance of a step, in units of the machine's length, or of 0.1 rad.
    tolerance = 10.0 * float(nominal["solver.tolerance"] or 0.0)
    return Findings(
        extent=extent,
        runs={run: future.result() for run, future in runs.items()},
        lagrange=lagrange.result(),
        ideal=ideal,
        points={
            name: Points.of(result, SERIES[series]) for name, result in results.items() for series in SERIES if series in name
        },
        results=results,
        resolution={coordinate: tolerance * float(length or 0.0) for coordinate, length in lengths.items()},
    )


def records(out: Path, extent: Extent) -> list[Path]:
    """Files with the finished points of the sweeps, beside the folder `out`."""
    return [record_of(out, name) for name, _ in sweeps(extent)]
