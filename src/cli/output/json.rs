//! Rows as one JSON object: `{"meta": {…}, "columns": {"t_s": […], …}}`, numbers at full precision.

use std::io::{self, Write};

use serde_json::{Map, Value as Json};

use super::{Table, Values};

/// Writes `meta` and the columns.
pub(super) fn write(out: &mut impl Write, table: &Table, meta: &Map<String, Json>) -> io::Result<()> {
    // Column by column: a tree of all values would take several times the memory of the table.
    write!(out, "{{\"meta\": {},\n\"columns\": {{", serde_json::to_string(meta)?)?;
    for (i, column) in table.columns().iter().enumerate() {
        let separator = if i == 0 { "\n" } else { ",\n" };
        write!(out, "{separator}{}: ", Json::from(column.name.as_str()))?;
        match &column.values {
            Values::Numbers(values) => serde_json::to_writer(&mut *out, values)?,
            Values::Whole(values) => serde_json::to_writer(&mut *out, values)?,
            Values::Words(words) => serde_json::to_writer(&mut *out, words)?,
        }
    }
    out.write_all(b"\n}}\n")
}

/// Writes `meta` alone, for a person to read.
pub fn write_meta(out: &mut impl Write, meta: &Map<String, Json>) -> io::Result<()> {
    serde_json::to_writer_pretty(&mut *out, meta).map_err(io::Error::from)?;
    out.write_all(b"\n")
}
