//! Temporary files and folders beside a target. They are locked while their run is alive, so that the next run with the same
//! target recognises the leftovers of a killed one and removes them.

use std::fs::{self, File};
use std::io;
use std::path::Path;

use tempfile::{Builder, NamedTempFile, TempDir};

use super::names::parent;

/// Where a temporary folder keeps the folder that is to be replaced, between two renames.
pub(super) const OLD: &str = "old";

/// Prefix of the temporary names for `target`; of one length, so that any file name can be a target.
fn prefix(target: &Path) -> String {
    let name = target.file_name().unwrap_or_default();
    format!(".jointplay-{:08x}-", crc32fast::hash(name.as_encoded_bytes()))
}

/// A file beside `target`.
pub(super) fn file(target: &Path) -> io::Result<NamedTempFile> {
    loop {
        // The default of `tempfile` can be read by its owner alone.
        let file = Builder::new().prefix(&prefix(target)).make_in(parent(target), |path| File::create_new(path))?;
        // On a file system without locks nothing is removed either.
        let _ = file.as_file().lock();
        // Before it was locked, another run may have taken it for a leftover.
        if file.path().exists() {
            return Ok(file);
        }
    }
}

/// A folder beside `target`, and its lock. Elsewhere than on Unix a folder has none, and its leftovers stay.
pub(super) fn folder(target: &Path) -> io::Result<(TempDir, Option<File>)> {
    loop {
        let folder = Builder::new().prefix(&prefix(target)).tempdir_in(parent(target));
        // The message would name the temporary folder.
        let folder = folder.map_err(|error| error.kind())?;
        let lock = File::open(folder.path()).and_then(|lock| lock.lock().map(|()| lock)).ok();
        if folder.path().exists() {
            return Ok((folder, lock));
        }
    }
}

/// Removes what killed runs with this target left; leaves alone what a live run has locked. A folder that was about to be
/// replaced gets its name back.
pub(super) fn clear(target: &Path) {
    let prefix = prefix(target);
    for entry in fs::read_dir(parent(target)).into_iter().flatten().flatten() {
        let path = entry.path();
        if !entry.file_name().as_encoded_bytes().starts_with(prefix.as_bytes()) {
            continue;
        }
        let Some(_lock) = File::open(&path).ok().filter(|file| file.try_lock().is_ok()) else {
            continue;
        };
        let old = path.join(OLD);
        if !target.exists() && old.exists() && fs::rename(old, target).is_err() {
            continue;
        }
        // Best effort: the next run tries again.
        let _ = if path.is_dir() { fs::remove_dir_all(&path) } else { fs::remove_file(&path) };
    }
}
