"""Folders of results, which appear whole or not at all."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from .errors import OptionError

MANIFEST = "manifest.json"
"""The file that lists the others, by which a folder of results is known."""


def check_replaceable(out: Path, force: bool) -> None:
    """Refuses a folder that cannot be written, or whose content may not be replaced: files of others never are."""
    if not out.resolve().parent.is_dir():
        raise OptionError(f"--out {out}: there is no folder {out.resolve().parent}")
    if out.exists() and not out.is_dir():
        raise OptionError(f"--out {out}: it is a file, not a folder")
    content = files_in(out)
    if not content:
        return
    if not force:
        raise OptionError(f"--out {out}: the folder is not empty; --force replaces earlier results")
    try:
        manifest = json.loads((out / MANIFEST).read_text(encoding="utf-8"))
        listed: set[str] = {MANIFEST, *manifest["files"]} if manifest["program"] == "jointplay" else set()
    except (OSError, ValueError, KeyError, TypeError):
        listed = set()
    if foreign := sorted(content - listed):
        raise OptionError(f"--out {out}: other files than results of jointplay are not replaced: {', '.join(foreign[:4])}")


def files_in(folder: Path) -> set[str]:
    """Paths of all files within a folder, which need not exist."""
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if not path.is_dir()}


@contextmanager
def result_folder(out: Path, force: bool, meta: Mapping[str, Any]) -> Generator[Path]:
    """An empty folder, which is renamed to `out` in the end, with a manifest of `meta` and the names of its files."""
    with tempfile.TemporaryDirectory(prefix=f".{out.name}.", dir=out.resolve().parent) as beside:
        folder = Path(beside) / "new"
        folder.mkdir()
        yield folder
        manifest = {**meta, "files": sorted(files_in(folder))}
        (folder / MANIFEST).write_text(json.dumps(manifest, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
        check_replaceable(out, force)
        if out.is_dir():
            out.rename(Path(beside) / "old")
        folder.rename(out)
