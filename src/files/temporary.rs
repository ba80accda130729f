//! Temporary files and folders beside a target. They are locked while their run is alive, so that the next run with the same
//! target recognises the leftovers of a killed one and removes them.

use std::fs::{self, File};
use std::io;
use std::path::Path;

use tempfile::{Builder, NamedTempFile, TempDir};

use super::names::parent;

/// Name of the folder being replaced, inside the temporary folder, between two renames.
pub(super) const OLD: &str = "old";

/// Prefix of the temporary names for `target`, of fixed length, so that any file name can be a target.
fn prefix(target: &Path) -> String {
    let name = target.file_name().unwrap_or_default();
    format!(".jointplay-{:08x}-", crc32fast::hash(name.as_encoded_bytes()))
}

/// A file beside `target`.
pub(super) fn file(target: &Path) -> io::Result<NamedTempFile> {
    loop {
        // By default, `tempfile` files can be read only by their owner.
        let file = Builder::new().prefix(&prefix(target)).make_in(parent(target), |path| File::create_new(path))?;
        // A failure is harmless: on a file system without locks no leftovers are removed either.
        let _ = file.as_file().lock();
        // Another run may have removed it as a leftover before it was locked.
        if file.path().exists() {
            return Ok(file);
        }
    }
}

/// A folder beside `target`, and its lock. Outside Unix there is no lock, and leftovers stay.
pub(super) fn folder(target: &Path) -> io::Result<(TempDir, Option<File>)> {
    loop {
        let folder = Builder::new().prefix(&prefix(target)).tempdir_in(parent(target));
        // The full message would name the temporary folder.
        let folder = folder.map_err(|error| error.kind())?;
        let lock = File::open(folder.path()).and_then(|lock| lock.lock().map(|()| lock)).ok();
        if folder.path().exists() {
            return Ok((folder, lock));
        }
    }
}

/// Removes leftovers of killed runs with this target, except those locked by a live run. A folder that was about to be replaced
/// gets its name back.
pub(super) fn remove_leftovers(target: &Path) {
    let prefix = prefix(target);
    for entry in fs::read_dir(parent(target)).into_iter().flatten().flatten() {
        let path = entry.path();
        if !entry.file_name().as_encoded_bytes().starts_with(prefix.as_bytes()) {
            continue;
        }
        // Opening a pipe would wait for its writer.
        if !entry.file_type().is_ok_and(|kind| kind.is_file() || kind.is_dir()) {
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
