"""What the commands `sensitivity` and `tolerance` share: arguments, tables that they read, and the folder that they write."""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

from . import _native
from ._distribution import Request
from ._folder import check_replaceable, result_folder
from ._options import library
from ._scene import Quantity, Scene
from ._study import Estimate, Runs, record_of
from ._table import read_cells
from .errors import OptionError

if TYPE_CHECKING:
    from ._sensitivity import Sensitivity
    from ._tolerance import Tolerance

T = TypeVar("T")
BLUE, ORANGE, GREY = "#0072B2", "#D55E00", "#404040"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the common arguments."""
    add = parser.add_argument
    add("scene", help="name of a built-in scene or a benchmark, or a file (contains / or ends in .toml)")
    add("--set", action="append", default=[], metavar="KEY=VALUE", help="change a parameter; may be repeated, the last wins")
    add(
        "--over",
        action="append",
        default=[],
        metavar="PATTERN[=RANGE]",
        help="parameters that vary: a key, in which * stands for any characters, and a range or distribution, e.g. "
        "joint.*.clearance=0.05mm..0.2mm, contact.friction=normal(0.15, 0.02), joint.S1.clearance=H7/g6; may be repeated, the last "
        "that names a parameter applies (default range: half to one and a half of the value, within what is allowed)",
    )
    add("--duration", metavar="TIME", help="length of each run, e.g. 2s (default: three periods of the drives, or 1 s)")
    add("--from", dest="from_", metavar="TIME", help="end of the transient (default: one period of the drives, or 0)")
    add("--seed", type=int, default=1, metavar="N", help="seed of the samples: the same seed gives the same results")
    add("--threads", type=int, metavar="N", help="threads to use (default: one per core); the result does not depend on it")
    add("--out", required=True, type=Path, metavar="FOLDER", help="folder to write: table, results, all runs, picture")
    add("--summary", choices=("text", "json"), default="text", help="format of the result on standard output (default: text)")
    add("--force", action="store_true", help="replace existing results")
    add("--quiet", action="store_true", help="no progress and no warnings")


def load(arguments: argparse.Namespace) -> Scene:
    """The scene with its changes."""
    scene = Scene.load(arguments.scene)
    changes: dict[str, Quantity | None] = {}
    for change in arguments.set:
        key, sign, value = change.partition("=")
        if not sign:
            raise OptionError(f"--set {change}: expected KEY=VALUE, e.g. contact.clearance=0.5mm")
        changes[key.strip()] = value.strip()
    return scene.set(changes) if changes else scene


def requests(arguments: argparse.Namespace) -> list[Request]:
    """Parameters of the file `--tolerances`, if the command has it, then those of `--over`."""
    path = getattr(arguments, "tolerances", None)
    found = [] if path is None else [Request(*row) for row in read_rows("--tolerances", path, ("parameter", "distribution"))]
    for option in arguments.over:
        pattern, sign, text = option.partition("=")
        found.append(Request(f"--over {option}", pattern.strip(), text.strip() if sign else None))
    if not found:
        raise OptionError(
            "--over: give at least one parameter" + (", or --tolerances" if hasattr(arguments, "tolerances") else "")
        )
    return found


def read_rows(option: str, path: Path, heads: tuple[str, ...]) -> list[tuple[str, ...]]:
    """Place and cells of each row below the heading `heads` of a CSV file; lines that begin with # are comments."""
    (place, found), *rows = read_cells(
        f"{option} {path}", path, f"the heading {','.join(heads)} and below it one row per parameter"
    )
    if tuple(found) != heads:
        raise OptionError(f"{place}: expected the heading {','.join(heads)}, not {','.join(found)}")
    return [(place, *cells) for place, cells in rows]


def perform(arguments: argparse.Namespace, compute: Callable[..., T]) -> T:
    """The result of `compute`, which takes `threads`, `progress` and `record`. Its records are beside the folder."""
    check_replaceable(arguments.out, arguments.force)
    out = str(arguments.out)
    if not arguments.quiet and any(arguments.out.resolve().parent.glob(f"{arguments.out.name}.*.partial")):
        print(f"resuming from {out}.*.partial", file=sys.stderr)
    shows = not arguments.quiet and sys.stderr.isatty()

    def progress(fraction: float) -> None:
        print(f"\r\033[Kpresent stage: {100.0 * fraction:.0f} %", end="", file=sys.stderr, flush=True)

    try:
        return compute(threads=arguments.threads, progress=progress if shows else None, record=out)
    except KeyboardInterrupt:
        print(f"interrupted; the same command resumes from {out}.*.partial", file=sys.stderr)
        raise
    finally:
        if shows:
            print("\r\033[K", end="", file=sys.stderr, flush=True)


def write(
    arguments: argparse.Namespace,
    scene: Scene,
    found: Sensitivity | Tolerance,
    name: str,
    settings: Mapping[str, Any],
    results: dict[str, Any],
    figure: Any,
) -> None:
    """Writes the folder, which appears whole, and removes the records of the runs."""
    out: Path = arguments.out
    duration, start = found.span
    meta = json.loads(_native.provenance_of(scene.native))
    meta |= {"duration_s": duration, "from_s": start, "seed": arguments.seed, "assumed_ranges": found.assumed_ranges, **settings}
    with result_folder(out, arguments.force, json.loads(to_json(meta))) as folder:
        write_table(found.to_pandas(), folder / f"{name}.csv")
        (folder / f"{name}.json").write_text(to_json({**results, "meta": meta}), encoding="utf-8")
        # The same bytes whenever it is drawn.
        with library("matplotlib").rc_context({"svg.hashsalt": "jointplay"}):
            figure.savefig(folder / f"{name}.png", dpi=160)
            figure.savefig(folder / f"{name}.svg", metadata={"Date": None})
        write_table(table_of(found), folder / "runs.csv")
    for stage in found.runs:
        record_of(out, stage).unlink(missing_ok=True)


def table_of(found: Sensitivity | Tolerance) -> Any:
    """All runs, SI: stage, parameters, outputs and status."""
    pandas = library("pandas")
    outputs = [name for name in found.units if name not in found.inputs]
    heads = [f"{name} ({unit})" if (unit := found.units[name]) else name for name in [*found.inputs, *outputs]]

    def of_stage(stage: str, runs: Runs) -> Any:
        frame = pandas.DataFrame([[*values, *results] for values, results in zip(runs.values, runs.results)], columns=heads)
        frame.insert(0, "stage", stage)
        return frame.assign(status=runs.status)

    return pandas.concat([of_stage(stage, runs) for stage, runs in found.runs.items()])


def write_table(table: Any, path: Path) -> None:
    """Writes a data frame as CSV."""
    table.to_csv(path, index=False, na_rep="NaN", float_format="%.12g", lineterminator="\n")


def to_json(value: Any) -> str:
    """JSON in which what is unknown or unlimited is null."""

    def plain(value: Any) -> Any:
        if isinstance(value, Estimate):
            value = value._asdict()
        if isinstance(value, Mapping):
            return {str(key): plain(one) for key, one in cast(Mapping[object, object], value).items()}
        if isinstance(value, (list, tuple)):
            return [plain(one) for one in cast(Sequence[object], value)]
        return None if isinstance(value, float) and not math.isfinite(value) else value

    return json.dumps(plain(value), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def show(value: float | None, unit: str, digits: int = 4) -> str:
    """A value with its unit, lengths in mm; `-` if it is unknown or unlimited."""
    if value is None or not math.isfinite(value):
        return "-"
    number, unit = (1e3 * value, "mm") if unit == "m" else (value, unit)
    return f"{number + 0.0:.{digits}g} {unit}".rstrip()


def distinguishing_digits(nominal: float, values: Iterable[float]) -> int:
    """Significant digits, from four to nine, that show the largest distance from `nominal` to three digits."""
    largest = max((abs(value - nominal) for value in values if math.isfinite(value)), default=0.0)
    if not largest > 0.0 or not nominal:
        return 4
    return min(max(math.ceil(max(math.log10(abs(nominal) / largest), 0.0)) + 3, 4), 9)


def axis(name: str, unit: str) -> tuple[str, float]:
    """Label of an axis, and the factor of its values: lengths in mm."""
    shown = "mm" if unit == "m" else unit
    return f"{name}, {shown}" if shown else name, 1e3 if unit == "m" else 1.0


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table for a terminal."""
    lines = [list(heads), *(list(row) for row in rows)]
    widths = [max(len(line[column]) for line in lines) for column in range(len(heads))]
    return "".join("  ".join(cell.ljust(width) for cell, width in zip(line, widths)).rstrip() + "\n" for line in lines)


def describe(scene: Scene, found: Sensitivity | Tolerance) -> str:
    """Lines about the scene, its runs and the ranges that were not given, for people."""
    duration, start = found.span
    text = (
        f"Scene             {scene.name}: runs of {duration:.6g} s"
        + (f", observed from {start:.6g} s on" if start else "")
        + "\n"
    )
    for key, (low, high) in found.assumed_ranges.items():
        ends = f"{show(low, found.units[key])} to {show(high, found.units[key])}"
        text += f"Range not given   {key}: {ends}, half to one and a half of its value, within what is allowed\n"
    failed = [(found.not_started, "did not start"), (found.diverged, "diverged")]
    words = "".join(f", {count} {how}" for count, how in failed if count)
    return text + f"Runs              {sum(len(runs.status) for runs in found.runs.values())}{words}\n"


def finish(arguments: argparse.Namespace, results: dict[str, Any], text: str) -> None:
    """Prints the summary."""
    if arguments.summary == "json":
        print(to_json(results), end="")
    else:
        print(f"{text}\nWritten           {arguments.out}\nVersion           jointplay {version('jointplay')}")
