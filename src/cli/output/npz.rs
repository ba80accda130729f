//! Rows as a NumPy archive: one float64 array per column, and `meta` as the bytes of a JSON text.

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

/// An archive's error, as that of the file.
pub fn as_io(error: WriteNpzError) -> io::Error {
    match error {
        WriteNpzError::Zip(zip) => zip.into(),
        WriteNpzError::Npy(ndarray_npy::WriteNpyError::Io(io)) => io,
        other => io::Error::other(other.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::Call;
    use crate::files::OutputFile;
    use crate::files::faults::{Fault, Kind, with};

    #[test]
    fn an_archive_on_a_full_disk_ends_without_a_word_of_its_own() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npz");
        let values = Array1::from(vec![1.0; 10_000]);
        for n in 1.. {
            let mut failed = false;
            let work = || {
                OutputFile::claim(&path, true)?.write(|file| {
                    let mut archive = NpzWriter::new(file);
                    let added = archive.add_array("a", &values).and_then(|()| archive.add_array("b", &values));
                    failed = added.is_err();
                    // As the archive does when dropped, complaining about any error.
                    let ended = archive.finish().map(|_| ());
                    assert!(ended.is_ok() || !failed, "{ended:?}");
                    // Whatever is returned here, the disk error takes precedence.
                    Ok(())
                })
            };
            let written = with(Fault::Fails(Call::Write, n), Kind::default(), work).0;
            if written.is_ok() {
                assert!(n > 4 && !failed, "{n}");
                break;
            }
            assert!(!path.exists());
        }
    }
}
