//! Path resolution.

use std::ffi::OsString;
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

/// Whether something has this name; a dangling link counts.
pub(super) fn is_taken(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok()
}

/// The name number `number` beside `path` for a result that is not complete: `incomplete-NAME`, `incomplete-2-NAME`, ….
fn incomplete(path: &Path, number: usize) -> PathBuf {
    let mut name = OsString::from("incomplete-");
    if number > 1 {
        name.push(format!("{number}-"));
    }
    name.push(path.file_name().unwrap_or_default());
    path.with_file_name(name)
}

/// Moves `targets`, each a requested path and its location, to names for an incomplete result that nothing has yet, with the same
/// number for all.
pub(super) fn make_incomplete<'a>(targets: impl IntoIterator<Item = (&'a mut PathBuf, &'a mut PathBuf)>) {
    let targets: Vec<_> = targets.into_iter().collect();
    let is_free = |number: &usize| targets.iter().all(|(_, location)| !is_taken(&incomplete(location, *number)));
    let number = (1..).find(is_free).unwrap_or(usize::MAX);
    for (path, location) in targets {
        *location = incomplete(location, number);
        let beside = incomplete(path, number);
        // A symbolic link may lie in another folder than its file.
        *path = if resolve(&beside).is_ok_and(|found| found == *location) { beside } else { location.clone() };
    }
}

/// The folder that `path` lies in.
pub(super) fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}
