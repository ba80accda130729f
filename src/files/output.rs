//! Output files.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::FileError;
use super::names::{is_taken, make_incomplete, parent, resolve};
use super::temporary;

/// Writer for the content of a file.
pub type Content<'a> = BufWriter<&'a File>;

/// A file to be written.
#[derive(Debug)]
pub struct OutputFile {
    /// The path as requested.
    pub(super) path: PathBuf,
    /// Where it is written: the path with links resolved.
    pub(super) location: PathBuf,
    pub(super) replace: bool,
}

impl OutputFile {
    /// Checks that `path` can be written, by writing and removing an empty file beside it; removes leftovers of killed runs.
    /// `replace` permits an existing file.
    ///
    /// # Errors
    /// It exists and `replace` is not given, it is not a file, or its folder is missing or read-only.
    pub fn claim(path: &Path, replace: bool) -> Result<Self, FileError> {
        if path.file_name().is_none() || path.is_dir() {
            return Err(FileError::cannot(path, "it names a folder"));
        }
        let failed = |error: io::Error| FileError::of(path, &error);
        let location = resolve(path).map_err(failed)?;
        temporary::remove_leftovers(&location);
        if !replace && is_taken(path) {
            return Err(FileError::Exists(path.to_owned()));
        }
        if path.metadata().is_ok_and(|metadata| !metadata.is_file()) {
            return Err(FileError::cannot(path, "it exists and is not a regular file"));
        }
        // Without a name, which a signal at this instant would leave behind.
        tempfile::tempfile_in(parent(&location)).map_err(failed)?;
        Ok(Self { path: path.to_owned(), location, replace })
    }

    /// The requested name.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Lets `fill` write the content under a temporary name.
    ///
    /// # Errors
    /// Input/output.
    pub fn fill(self, fill: impl FnOnce(&mut Content) -> io::Result<()>) -> Result<PendingFile, FileError> {
        let content = || {
            let file = temporary::file(&self.location)?;
            {
                let mut content = BufWriter::new(file.as_file());
                fill(&mut content)?;
                content.flush()?;
            }
            file.as_file().sync_all()?;
            Ok(file)
        };
        match content() {
            Ok(file) => Ok(PendingFile { target: self, file }),
            Err(error) => Err(FileError::of(&self.path, &error)),
        }
    }

    /// Lets `fill` write the content, then gives it its final name.
    ///
    /// # Errors
    /// Input/output; an existing file is then unchanged.
    pub fn write(self, fill: impl FnOnce(&mut Content) -> io::Result<()>) -> Result<(), FileError> {
        publish(vec![self.fill(fill)?])
    }
}

/// A complete file that still has its temporary name.
#[derive(Debug)]
pub struct PendingFile {
    target: OutputFile,
    file: NamedTempFile,
}

/// For a result that is not complete: if one of its files would replace an older one, gives all of `targets` other names beside
/// their own, which have not been used yet. Returns the new names; none if nothing would be replaced.
pub fn spare_older(mut targets: Vec<&mut OutputFile>) -> Vec<PathBuf> {
    if !targets.iter().any(|target| is_taken(&target.location)) {
        return Vec::new();
    }
    make_incomplete(targets.iter_mut().map(|target| (&mut target.path, &mut target.location)));
    targets.iter_mut().for_each(|target| target.replace = false);
    targets.into_iter().map(|target| target.path.clone()).collect()
}

/// Gives files their final names, one after the other.
///
/// # Errors
/// Input/output; files before the failed one then have their final names.
pub fn publish(files: Vec<PendingFile>) -> Result<(), FileError> {
    for PendingFile { target: OutputFile { path, location, replace }, file } in files {
        let named = if replace { file.persist(&location) } else { file.persist_noclobber(&location) };
        // Some file systems support neither a rename without replacement nor hard links. Only another program could create the
        // file in between.
        let named =
            named.or_else(|failed| if is_taken(&location) { Err(failed) } else { failed.file.persist(&location) });
        named.map_err(|failed| FileError::of(&path, &failed.error))?;
    }
    Ok(())
}
