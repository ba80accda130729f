"""`python -m jointplay paper`: section 4 of the paper as data, figures and one page that compares it with the paper."""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

from .errors import OptionError

PARTS = {"index.html", "data", "plots"}
"""What a report consists of."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments."""
    parser.add_argument("--out", required=True, type=Path, metavar="FOLDER", help="folder to write: index.html, data/ and plots/")
    parser.add_argument(
        "--quick", action="store_true", help="few points and few periods: half a minute instead of a quarter of an hour"
    )
    parser.add_argument("--force", action="store_true", help="replace a folder of an earlier report")
    parser.add_argument(
        "--threads", type=int, metavar="N", help="threads to use (default: one per core); the files do not depend on it"
    )


def main(arguments: argparse.Namespace) -> None:
    """Runs the command."""
    out: Path = arguments.out
    threads: int = (os.cpu_count() or 1) if arguments.threads is None else arguments.threads
    if threads < 1:
        raise OptionError(f"--threads {threads}: at least 1")
    check_replaceable(out, arguments.force)
    try:
        from . import _paper_page as page
        from . import _paper_results as results
    except ModuleNotFoundError as error:
        raise OptionError(f"paper needs {error.name}: pip install 'jointplay[paper]'") from error
    started = time.monotonic()
    findings = results.compute(results.QUICK if arguments.quick else results.FULL, threads, report_progress)
    with tempfile.TemporaryDirectory(prefix=f".{out.name}.", dir=out.resolve().parent) as beside:
        folder = Path(beside) / "new"
        folder.mkdir()
        compared, stated = page.write_report(folder, findings)
        check_replaceable(out, arguments.force)
        if out.is_dir():
            out.rename(Path(beside) / "old")
        folder.rename(out)
    counts = [sum(c.agreement == word for c in compared) for word in page.AGREEMENTS]
    print(
        f"Numbers     {counts[0]} of {len(compared)} agree within 10 %, {counts[1]} more within a factor of 2, {counts[2]} differ"
    )
    print(f"Statements  {sum(s.verdict.confirmed for s in stated)} of {len(stated)} confirmed")
    print(f"Wall time   {time.monotonic() - started:.1f} s")
    print(f"Written     {out / 'index.html'}")


def check_replaceable(out: Path, force: bool) -> None:
    """Refuses a place that cannot be written, or whose content may not be replaced: other files never are."""
    if not out.resolve().parent.is_dir():
        raise OptionError(f"--out {out}: there is no folder {out.resolve().parent}")
    if out.exists() and not out.is_dir():
        raise OptionError(f"--out {out}: it is a file, not a folder")
    content = {entry.name for entry in out.iterdir()} if out.is_dir() else set()
    if content and not content <= PARTS:
        raise OptionError(f"--out {out}: it has other files than those of a report: {', '.join(sorted(content - PARTS))}")
    if content and not force:
        raise OptionError(f"--out {out}: it has a report; --force replaces it")


def report_progress(stage: str, part: float) -> None:
    """Shows the present stage on a terminal."""
    if sys.stderr.isatty():
        print(f"\r\033[K{stage}: {100.0 * part:.0f} %", end="\n" if part >= 1.0 else "", file=sys.stderr, flush=True)
