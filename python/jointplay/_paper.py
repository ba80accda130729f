"""`python -m jointplay paper`: section 4 of the paper as data, figures and one page that compares it with the paper."""

from __future__ import annotations

import argparse
import os
import sys
import time
from importlib.metadata import version
from pathlib import Path

from ._folder import check_replaceable, result_folder
from .errors import OptionError


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
    extent = results.QUICK if arguments.quick else results.FULL
    findings = results.compute(extent, threads, report_progress, out)
    meta = {"program": "jointplay", "version": version("jointplay")}
    with result_folder(out, arguments.force, meta) as folder:
        compared, stated = page.write_report(folder, findings)
    for path in results.records(out, extent):
        path.unlink(missing_ok=True)
    counts = [sum(c.agreement == word for c in compared) for word in page.AGREEMENTS]
    print(
        f"Numbers     {counts[0]} of {len(compared)} agree within 10 %, {counts[1]} more within a factor of 2, {counts[2]} differ"
    )
    print(f"Statements  {sum(s.verdict.confirmed for s in stated)} of {len(stated)} confirmed")
    print(f"Wall time   {time.monotonic() - started:.1f} s")
    print(f"Written     {out / 'index.html'}")


def report_progress(stage: str, part: float) -> None:
    """Shows the present stage on a terminal."""
    if sys.stderr.isatty():
        print(f"\r\033[K{stage}: {100.0 * part:.0f} %", end="\n" if part >= 1.0 else "", file=sys.stderr, flush=True)
