//! Path resolution: links, and different names for one file.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

/// Location of `path`, existing or not, with links resolved; its folder must exist.
///
/// # Errors
/// No such folder; circular links.
pub(super) fn place(path: &Path) -> io::Result<PathBuf> {
    // Going through components drops a trailing slash.
    let path: PathBuf = path.components().collect();
    match fs::canonicalize(&path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => match (fs::read_link(&path), path.file_name()) {
            // A link to something that does not exist yet.
            (Ok(target), _) => place(&parent(&path).join(target)),
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

/// The first of `others` that would be the same file as `path`: by a link, by another route, or by a spelling that its
/// file system treats as equal.
pub fn same_file(path: &Path, others: &[&Path]) -> Option<usize> {
    let own = place(path).ok()?;
    let others: Vec<_> = others.iter().map(|other| place(other).ok()).collect();
    if let Some(same) = others.iter().position(|other| other.as_ref() == Some(&own)) {
        return Some(same);
    }
    let beside = |other: &Option<PathBuf>| other.clone().filter(|other| parent(other) == parent(&own));
    let beside: Vec<_> = others.iter().map(beside).collect();
    if beside.iter().all(Option::is_none) {
        return None;
    }
    // Only the file system knows how it compares names: ask it. A failure to write here is reported elsewhere.
    let trial = tempfile::Builder::new().prefix(".jointplay-").tempdir_in(parent(&own)).ok()?;
    let at = |place: &Path| place.file_name().map(|name| trial.path().join(name));
    File::create_new(at(&own)?).ok()?;
    beside.iter().position(|other| other.as_deref().and_then(at).is_some_and(|trial| trial.exists()))
}
