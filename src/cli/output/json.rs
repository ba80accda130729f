//! Rows as one JSON object: `{"meta": {…}, "columns": {"t_s": […], …}}`, numbers at full precision.

use std::io::{self, Write};

use serde_json::{Map, Value as Json};

use super::Table;

/// Writes `meta` and the columns.
pub(super) fn write(out: &mut impl Write, table: &Table, meta: &Map<String, Json>) -> io::Result<()> {
    // Written by hand around serde's numbers: a tree of all values would take several times the memory of the table.
    let meta = serde_json::to_string(meta)?;
    write!(out, "{{\"meta\": {meta},\n\"columns\": {{")?;
    for (column, name) in table.names().iter().enumerate() {
        let separator = if column == 0 { "\n" } else { ",\n" };
        write!(out, "{separator}{}: [", Json::from(name.as_str()))?;
        let mut separator: &[u8] = b"";
        table.column(column, |value| {
            out.write_all(separator)?;
            separator = b",";
            serde_json::to_writer(&mut *out, &value).map_err(io::Error::from)
        })?;
        out.write_all(b"]")?;
    }
    out.write_all(b"\n}}\n")
}

/// Writes `meta` alone, for a person to read.
pub fn write_meta(out: &mut impl Write, meta: &Map<String, Json>) -> io::Result<()> {
    serde_json::to_writer_pretty(&mut *out, meta).map_err(io::Error::from)?;
    out.write_all(b"\n")
}
