//! Rows as a NumPy archive: one float64 array a column, and `meta` as the bytes of a JSON text.

use std::fs::File;
use std::io::{self, BufWriter};

use ndarray::Array1;
use ndarray_npy::{NpzWriter, WriteNpzError};
use serde_json::Value as Json;

use super::Table;

/// Writes the columns and `meta` (in Python: `json.loads(bytes(archive["meta"]))`).
pub(super) fn write(out: &mut BufWriter<&File>, table: &Table, meta: &Json) -> io::Result<()> {
    let mut archive = NpzWriter::new(out);
    for (column, name) in table.names().iter().enumerate() {
        let values: Array1<f64> = table.column(column).collect();
        archive.add_array(name.as_str(), &values).map_err(as_io)?;
    }
    let meta = Array1::from(meta.to_string().into_bytes());
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
