//! Rows as a NumPy archive: one float64 array a column, and `meta` as the bytes of a JSON text.

use std::io;

use ndarray::Array1;
use ndarray_npy::{NpzWriter, WriteNpzError};
use serde_json::{Map, Value as Json};

use super::Table;
use crate::files::Sink;

/// Writes the columns and `meta` (in Python: `json.loads(bytes(archive["meta"]))`).
pub(super) fn write(out: &mut Sink, table: &Table, meta: &Map<String, Json>) -> io::Result<()> {
    let mut archive = NpzWriter::new(out);
    for (column, name) in table.names().iter().enumerate() {
        let mut values = Vec::with_capacity(table.len());
        table.column(column, |value| {
            values.push(value);
            Ok(())
        })?;
        let values = Array1::from(values);
        archive.add_array(name.as_str(), &values).map_err(as_io)?;
    }
    let meta = Array1::from(serde_json::to_vec(meta)?);
    archive.add_array("meta", &meta).map_err(as_io)?;
    archive.finish().map_err(as_io)?;
    Ok(())
}

fn as_io(error: WriteNpzError) -> io::Error {
    match error {
        WriteNpzError::Zip(zip) => zip.into(),
        WriteNpzError::Npy(ndarray_npy::WriteNpyError::Io(io)) => io,
        other => io::Error::other(other.to_string()),
    }
}
