//! NumPy archives: one array per column, and `meta` as the bytes of a JSON text.

use std::io::{self, BufWriter, Seek, SeekFrom, Write};

use ndarray::{ArrayD, IxDyn};
use ndarray_npy::{NpzWriter, WritableElement, WriteDataError, WriteNpzError};
use py_literal::Value;
use serde_json::{Map, Value as Json};

use super::{Column, Values};
use crate::files::Content;

/// Writes `columns`, one in memory at a time, and `meta` (in Python: `json.loads(bytes(archive["meta"]))`).
pub(super) fn write(
    out: &mut Content,
    columns: impl Iterator<Item = Column>,
    meta: &Map<String, Json>,
) -> io::Result<()> {
    write_archive(*out.get_ref(), |archive| {
        for Column { name, shape, values } in columns {
            let shape = shape.unwrap_or_else(|| vec![values.len()]);
            match values {
                Values::Numbers(values) => add(archive, &name, &shape, values)?,
                Values::Whole(values) => add(archive, &name, &shape, values)?,
                Values::Words(words) => add(archive, &name, &shape, words.into_iter().map(Word).collect())?,
            }
        }
        let meta = serde_json::to_vec(meta)?;
        add(archive, "meta", &[meta.len()], meta)
    })
}

/// Adds an array of `shape` with these values.
fn add<W: Write + Seek, T: WritableElement>(
    archive: &mut NpzWriter<W>,
    name: &str,
    shape: &[usize],
    values: Vec<T>,
) -> io::Result<()> {
    let array = ArrayD::from_shape_vec(IxDyn(shape), values).map_err(io::Error::other)?;
    archive.add_array(name, &array).map_err(as_io)
}

/// Converts an archive error to an I/O error.
fn as_io(error: WriteNpzError) -> io::Error {
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
fn write_archive<W: Write + Seek>(
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

/// Width of every array of words, characters.
const WIDTH: usize = 32;
/// NumPy's name of the type: little-endian UTF-32, padded with zeros.
const TYPE: &str = "<U32";

/// A word of at most [`WIDTH`] characters.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Word(String);

impl WritableElement for Word {
    fn type_descriptor() -> Value {
        Value::String(TYPE.to_owned())
    }

    fn write<W: Write>(&self, mut writer: W) -> Result<(), WriteDataError> {
        let letters = self.0.chars().map(u32::from).chain(std::iter::repeat(0));
        let bytes: Vec<u8> = letters.take(WIDTH).flat_map(u32::to_le_bytes).collect();
        Ok(writer.write_all(&bytes)?)
    }

    fn write_slice<W: Write>(slice: &[Self], mut writer: W) -> Result<(), WriteDataError> {
        slice.iter().try_for_each(|word| word.write(&mut writer))
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use ndarray::Array1;

    use super::*;
    use crate::scene::{Kind, table};

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

    #[test]
    fn words_of_every_parameter_fit() {
        let choices = table().iter().filter_map(|parameter| match parameter.kind {
            Kind::Choice(words) => Some(words),
            _ => None,
        });
        let words: Vec<Word> = choices.flatten().map(|word| Word((*word).to_owned())).collect();
        assert!(words.len() > 10 && words.iter().all(|word| word.0.chars().count() <= WIDTH));
        let mut bytes = Vec::new();
        Word::write_slice(&words[..2], &mut bytes).unwrap();
        let codes: Vec<u32> = bytes.as_chunks().0.iter().map(|code| u32::from_le_bytes(*code)).collect();
        for (word, codes) in words.iter().zip(codes.chunks(WIDTH)) {
            let letters: String =
                codes.iter().take_while(|code| **code != 0).filter_map(|c| char::from_u32(*c)).collect();
            assert_eq!(letters, word.0);
        }
    }
}
