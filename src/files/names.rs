//! Path resolution.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Location of `path`, existing or not, with links resolved; its folder must exist.
///
/// # Errors
/// No such folder; circular links.
pub(super) fn resolve(path: &Path) -> io::Result<PathBuf> {
    // Going through components drops a trailing slash.
    let path: PathBuf = path.components().collect();
    match fs::canonicalize(&path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => match (fs::read_link(&path), path.file_name()) {
            // A link to something that does not exist yet.
            (Ok(target), _) => resolve(&parent(&path).join(target)),
            (Err(_), Some(name)) => Ok(fs::canonicalize(parent(&path))?.join(name)),
            (Err(_), None) => Err(error),
        },
        found => found,
    }
}

/// The folder that `path` lies in.
pub(super) fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}
