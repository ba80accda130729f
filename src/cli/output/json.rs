//! Rows as one JSON object: `{"meta": {…}, "columns": {"t_s": […], …}}`, numbers at full precision.

use std::io::{self, Write};

use serde_json::Value as Json;

use super::Table;

/// Writes `meta` and the columns.
pub(super) fn write(out: &mut impl Write, table: &Table, meta: &Json) -> io::Result<()> {
    // By hand around serde's numbers: a tree of all values would take several times the memory of the table.
    write!(out, "{{\"meta\": {meta},\n\"columns\": {{")?;
    for (column, name) in table.names().iter().enumerate() {
        let separator = if column == 0 { "\n" } else { ",\n" };
        write!(out, "{separator}{}: [", Json::from(name.as_str()))?;
        for (row, value) in table.column(column).enumerate() {
            if row > 0 {
                out.write_all(b",")?;
            }
            serde_json::to_writer(&mut *out, &value).map_err(io::Error::from)?;
        }
        out.write_all(b"]")?;
    }
    out.write_all(b"\n}}\n")
}

/// Writes `meta` alone, for a person to read.
pub(super) fn write_meta(out: &mut impl Write, meta: &Json) -> io::Result<()> {
    serde_json::to_writer_pretty(&mut *out, meta).map_err(io::Error::from)?;
    out.write_all(b"\n")
}
