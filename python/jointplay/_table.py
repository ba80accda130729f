"""Tables that commands and functions read: CSV files with a heading; lines that begin with # are comments."""

from __future__ import annotations

import csv
from pathlib import Path

from .errors import OptionError

MAX_TABLE_SIZE = 64 << 20
"""Size limit of a table that is read, bytes."""


def read_cells(file: str, path: Path, heading: str) -> list[tuple[str, list[str]]]:
    """Place and cells of each row, the heading first. `file` names the table in errors, which also state the expected `heading`."""
    if path.exists() and not path.is_file():
        raise OptionError(f"{file}: this is a folder, a pipe, a socket or a device, not a file")
    with path.open("rb") as handle:
        data = handle.read(MAX_TABLE_SIZE + 1)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise OptionError(f"{file}: this is not a text file: it is not valid UTF-8") from None
    if len(data) > MAX_TABLE_SIZE:
        raise OptionError(f"{file}: larger than {MAX_TABLE_SIZE >> 20} MiB")
    lines = [(number, line.strip()) for number, line in enumerate(text.splitlines(), 1)]
    lines = [(number, line) for number, line in lines if line and not line.startswith("#")]
    if len(lines) < 2:
        raise OptionError(f"{file}: expected {heading}")
    rows: list[tuple[str, list[str]]] = []
    for number, line in lines:
        place = f"{file}, line {number}"
        if line.count('"') % 2:
            raise OptionError(f"{place}: a quoted cell does not end on this line")
        rows.append((place, [cell.strip() for cell in next(csv.reader([line], skipinitialspace=True))]))
        if len(rows[-1][1]) != len(rows[0][1]):
            quotes = "; a cell with a comma needs quotes" if len(rows[-1][1]) > len(rows[0][1]) else ""
            counts = f"{len(rows[-1][1])} cells for the {len(rows[0][1])} of the heading {','.join(rows[0][1])}"
            raise OptionError(f"{place}: {counts}{quotes}")
    return rows
