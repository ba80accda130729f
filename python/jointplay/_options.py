"""What the arguments of several functions share: optional libraries, whole numbers, threads, files."""

from __future__ import annotations

import os
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np

from .errors import OptionError


def library(name: str, extra: str = "studies") -> ModuleType:
    """A library of one of the package's extras."""
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        missing = str(error.name).partition(".")[0]
        raise OptionError(f"needs {missing}: pip install 'jointplay[{extra}]'") from error


def is_a(value: object, *kinds: type) -> bool:
    """Whether an argument has a type that it should have: its caller may use no type checker."""
    return isinstance(value, kinds)


def whole(name: str, value: int, least: int, most: int, more: str = "") -> int:
    """A whole number within its range."""
    if isinstance(value, bool) or not is_a(value, int, np.integer) or not least <= value <= most:
        raise OptionError(f"{name} = {value!r}: allowed whole numbers from {least} to {most}{more}")
    return int(value)


def workers(threads: int | None) -> int:
    """Number of threads; None and -1 stand for one per core."""
    if threads is None or threads == -1:
        return os.cpu_count() or 1
    return whole("threads", threads, 1, 1024, ", or -1 for one per core")


def write(path: Path, content: bytes) -> None:
    """Writes a file, which appears whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        beside.write_bytes(content)
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)
