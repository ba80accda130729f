//! NumPy archives. The rows of a run: one float64 array per column, and `meta` as the bytes of a JSON text.

use std::io::{self, BufWriter, Seek, SeekFrom, Write};

use ndarray::{Array1, ArrayD, IxDyn};
use ndarray_npy::{NpzWriter, WritableElement, WriteNpzError};
use serde_json::{Map, Value as Json};

use super::Table;
use crate::files::Content;

/// Writes the columns and `meta` (in Python: `json.loads(bytes(archive["meta"]))`).
pub(super) fn write(out: &mut Content, table: &Table, meta: &Map<String, Json>) -> io::Result<()> {
    write_archive(*out.get_ref(), |archive| {
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
        archive.add_array("meta", &meta).map_err(as_io)
    })
}

/// Converts an archive error to an I/O error.
pub fn as_io(error: WriteNpzError) -> io::Error {
    match error {
        WriteNpzError::Zip(zip) => zip.into(),
        WriteNpzError::Npy(ndarray_npy::WriteNpyError::Io(io)) => io,
        other => io::Error::other(other.to_string()),
    }
}

/// Writes an archive to `file`; `fill` adds the arrays.
///
/// # Errors
/// The first error of the file, otherwise the error of `fill`.
pub fn write_archive<W: Write + Seek>(
    file: W,
    fill: impl FnOnce(&mut NpzWriter<&mut BufWriter<Sink<W>>>) -> io::Result<()>,
) -> io::Result<()> {
    let mut out = BufWriter::new(Sink { file, failure: None });
    let mut archive = NpzWriter::new(&mut out);
    let filled = fill(&mut archive);
    let finished = archive.finish().map_err(as_io).map(|_| ());
    let outcome = filled.and(finished).and_then(|()| out.flush());
    out.get_mut().failure.take().map_or(outcome, Err)
}

/// Adds an array with these values, in row-major order.
///
/// # Errors
/// Input/output, or a number of values other than that of the shape.
pub fn add_array<W: Write + Seek, T: WritableElement>(
    archive: &mut NpzWriter<W>,
    name: &str,
    shape: Vec<usize>,
    values: Vec<T>,
) -> io::Result<()> {
    let array = ArrayD::from_shape_vec(IxDyn(&shape), values).map_err(io::Error::other)?;
    archive.add_array(name, &array).map_err(as_io)
}

/// Sink for the bytes of an archive. After its first failure it accepts everything and writes nothing: the archive writer
/// always writes its end, and would report a failure there on standard error.
#[derive(Debug)]
pub struct Sink<W> {
    file: W,
    failure: Option<io::Error>,
}

impl<W: Write + Seek> Write for Sink<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.failure.is_none() {
            match self.file.write(bytes) {
                Err(error) if error.kind() != io::ErrorKind::Interrupted => self.failure = Some(error),
                written => return written,
            }
        }
        // Positions continue as if the bytes were written.
        self.file.seek(SeekFrom::Current(bytes.len() as i64))?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl<W: Seek> Seek for Sink<W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    /// A disk that is full after some writes.
    struct Disk {
        content: Cursor<Vec<u8>>,
        writes_left: usize,
    }

    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.writes_left = self.writes_left.checked_sub(1).ok_or(io::ErrorKind::StorageFull)?;
            self.content.write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Seek for Disk {
        fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
            self.content.seek(to)
        }
    }

    #[test]
    fn an_archive_on_a_full_disk_prints_nothing_of_its_own() {
        let values = Array1::from(vec![1.0; 10_000]);
        for writes in 0.. {
            let disk = || Disk { content: Cursor::default(), writes_left: writes };
            let mut out = BufWriter::new(Sink { file: disk(), failure: None });
            let mut archive = NpzWriter::new(&mut out);
            archive.add_array("a", &values).and_then(|()| archive.add_array("b", &values)).unwrap();
            archive.finish().unwrap();
            out.flush().unwrap();
            let written = write_archive(disk(), |archive| {
                archive.add_array("a", &values).and_then(|()| archive.add_array("b", &values)).unwrap();
                // A disk error takes precedence over this one.
                Err(io::Error::other("not this"))
            });
            let kind = written.unwrap_err().kind();
            if out.get_ref().failure.is_none() {
                assert!(writes > 4 && kind == io::ErrorKind::Other, "{writes}: {kind}");
                break;
            }
            assert_eq!(kind, io::ErrorKind::StorageFull, "{writes}");
        }
    }
}
