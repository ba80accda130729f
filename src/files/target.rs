//! Output files, alone or in groups: all of a group appear, or none.

use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::FileError;
use super::disk::{self, File};
use super::names::{parent, place};
use super::scratch::{self, ScratchFile};

/// A file to be written.
#[derive(Debug)]
pub struct OutputFile {
    /// The path as requested.
    path: PathBuf,
    /// The path with links resolved.
    place: PathBuf,
    replace: bool,
}

impl OutputFile {
    /// Checks that `path` can be written, by writing and removing an empty file beside it; removes what killed runs left
    /// there. `replace` permits an existing file.
    ///
    /// # Errors
    /// It exists and `replace` is not given, it is not a file, or its folder is missing or read-only.
    pub fn claim(path: &Path, replace: bool) -> Result<Self, FileError> {
        if path.file_name().is_none() || path.is_dir() {
            return Err(FileError::cannot(path, "it names a folder"));
        }
        let place = place(path).map_err(|error| FileError::of(path, &error))?;
        let folder = parent(&place);
        scratch::clear(folder);
        if !replace && disk::exists(path) {
            return Err(FileError::Exists(path.to_owned()));
        }
        if path.metadata().is_ok_and(|it| !it.is_file()) {
            return Err(FileError::cannot(path, "it exists and is not a regular file"));
        }
        ScratchFile::new(folder).map_err(|error| FileError::of(path, &error))?;
        Ok(Self { path: path.to_owned(), place, replace })
    }

    /// A file in a folder that has not appeared yet.
    pub(super) fn within(path: PathBuf, place: PathBuf) -> Self {
        Self { path, place, replace: false }
    }

    /// The requested name.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Lets `fill` write the content; nothing has the final name yet.
    ///
    /// # Errors
    /// Input/output.
    pub fn fill(self, fill: impl FnOnce(&mut Sink) -> io::Result<()>) -> Result<PendingFile, FileError> {
        let content = || {
            let scratch = ScratchFile::new(parent(&self.place))?;
            Sink::fill(scratch.file(), fill)?;
            scratch.file().sync()?;
            Ok(scratch)
        };
        match content() {
            Ok(scratch) => Ok(PendingFile { target: self, scratch }),
            Err(error) => Err(FileError::of(&self.path, &error)),
        }
    }

    /// Lets `fill` write the content, then gives it its final name.
    ///
    /// # Errors
    /// Input/output; the final name is then as it was.
    pub fn write(self, fill: impl FnOnce(&mut Sink) -> io::Result<()>) -> Result<(), FileError> {
        publish(vec![self.fill(fill)?])
    }

    /// A nameless file beside it for what does not fit in memory.
    ///
    /// # Errors
    /// Input/output.
    pub fn spool(&self) -> Result<Spool, FileError> {
        let mut scratch = ScratchFile::new(parent(&self.place)).map_err(|error| FileError::of(&self.path, &error))?;
        scratch.forget_name();
        Ok(Spool(scratch))
    }
}

/// Bytes on the disk that nobody else sees, deleted when this is dropped.
#[derive(Debug)]
pub struct Spool(ScratchFile);

impl Spool {
    /// Appends `bytes`.
    ///
    /// # Errors
    /// Input/output.
    pub fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut file = self.0.file();
        file.seek(SeekFrom::End(0))?;
        file.write_all(bytes)
    }

    /// Fills `bytes` from position `at` on.
    ///
    /// # Errors
    /// Input/output.
    pub fn read(&self, at: u64, bytes: &mut [u8]) -> io::Result<()> {
        let mut file = self.0.file();
        file.seek(SeekFrom::Start(at))?;
        file.read_exact(bytes)
    }
}

/// A file with its content, but not yet its name.
#[derive(Debug)]
pub struct PendingFile {
    target: OutputFile,
    scratch: ScratchFile,
}

/// Gives a group of files their final names, in order, while no other run does so in the same folders.
///
/// # Errors
/// Input/output; all names are then as they were.
pub fn publish(files: Vec<PendingFile>) -> Result<(), FileError> {
    let mut folders: Vec<&Path> = files.iter().map(|f| parent(&f.target.place)).collect();
    // The same order everywhere, so that no two runs wait for each other.
    folders.sort_unstable();
    folders.dedup();
    let locks: Vec<_> = folders.into_iter().map(disk::lock_folder).collect();
    for PendingFile { target, .. } in &files {
        if !target.replace && disk::exists(&target.place) {
            return Err(FileError::Exists(target.path.clone()));
        }
    }
    let mut undo = Vec::new();
    let mut left = files.len();
    for PendingFile { target, scratch } in files {
        left -= 1;
        // After the last rename nothing can go wrong any more, so it needs no backup.
        let named = backup(&target.place, left > 0).and_then(|old| {
            scratch.rename(&target.place, target.replace)?;
            Ok(old)
        });
        match named {
            Ok(old) => undo.push((target.place, old)),
            Err(error) => {
                // Best effort: the first error is the one to report.
                for (place, old) in undo.into_iter().rev() {
                    let _ = match old {
                        Some(old) => old.rename(&place, true).map(|_| ()),
                        None => disk::remove_file(&place),
                    };
                }
                return Err(FileError::of(&target.path, &error));
            }
        }
    }
    drop(locks);
    Ok(())
}

/// A copy of what is at `place`, if there is anything and it is `wanted`.
fn backup(place: &Path, wanted: bool) -> io::Result<Option<ScratchFile>> {
    if !wanted || !disk::exists(place) {
        return Ok(None);
    }
    let copy = ScratchFile::new(parent(place))?;
    io::copy(&mut std::fs::File::open(place)?, &mut copy.file())?;
    Ok(Some(copy))
}

/// Writer for the content. After its first failure it accepts everything and keeps nothing: a writer that even then
/// finishes its file in good order, as archive writers do, has no failure of its own to report.
pub struct Sink<'a> {
    inner: BufWriter<&'a File>,
    failure: Option<io::Error>,
    /// Position of the next byte and end of the last one, once nothing is kept.
    position: u64,
    end: u64,
}

impl<'a> Sink<'a> {
    /// Lets `fill` write to `file`.
    ///
    /// # Errors
    /// The first failure of the file; otherwise that of `fill`.
    fn fill(file: &'a File, fill: impl FnOnce(&mut Self) -> io::Result<()>) -> io::Result<()> {
        let mut sink = Self { inner: BufWriter::new(file), failure: None, position: 0, end: 0 };
        let outcome = fill(&mut sink).and_then(|()| sink.flush());
        sink.failure.map_or(outcome, Err)
    }

    /// The result of a call, recorded if it is the first failure.
    fn noted<T>(&mut self, result: io::Result<T>) -> io::Result<T> {
        result.map_err(|error| {
            let copy = match error.raw_os_error() {
                Some(code) => io::Error::from_raw_os_error(code),
                None => error.kind().into(),
            };
            self.failure = Some(error);
            // A header being corrected lies before the data that it describes.
            self.position = self.end;
            copy
        })
    }

    fn skip(&mut self, to: u64) -> u64 {
        self.position = to;
        self.end = self.end.max(to);
        to
    }
}

impl Write for Sink<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.failure.is_some() {
            self.skip(self.position + bytes.len() as u64);
            return Ok(bytes.len());
        }
        let written = self.inner.write(bytes);
        let written = self.noted(written)?;
        self.skip(self.position + written as u64);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.failure.is_some() {
            return Ok(());
        }
        let flushed = self.inner.flush();
        self.noted(flushed)
    }
}

impl Seek for Sink<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        if self.failure.is_some() {
            let (from, by) = match to {
                SeekFrom::Start(at) => (at, 0),
                SeekFrom::Current(by) => (self.position, by),
                SeekFrom::End(by) => (self.end, by),
            };
            return Ok(self.skip(from.saturating_add_signed(by)));
        }
        let sought = self.inner.seek(to);
        let sought = self.noted(sought)?;
        Ok(self.skip(sought))
    }
}
