//! What a name leads to: links, and different names for one file.

use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

use super::disk::{self, File};
use super::scratch::ScratchFolder;

/// Longest chain of links, as in Linux.
const MOST_LINKS: usize = 40;

/// Where `path` lies or would lie: without links, in a folder that exists.
///
/// # Errors
/// No such folder; circular links.
pub(super) fn place(path: &Path) -> io::Result<PathBuf> {
    // By components, which drops a trailing slash.
    let mut path: PathBuf = path.components().collect();
    for _ in 0..MOST_LINKS {
        match fs::read_link(&path) {
            Ok(target) => path = parent(&path).join(target).components().collect(),
            Err(_) => {
                let ends_in_name = matches!(path.components().next_back(), Some(Component::Normal(_)));
                return match path.file_name() {
                    Some(name) if ends_in_name => Ok(fs::canonicalize(parent(&path))?.join(name)),
                    _ => fs::canonicalize(&path),
                };
            }
        }
    }
    Err(io::Error::other("too many links"))
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
    let name = own.file_name()?;
    let beside = |other: &&Path| {
        let other = place(other).ok()?;
        let together = one_folder(parent(&own), parent(&other));
        other.file_name().filter(|_| together).map(ToOwned::to_owned)
    };
    let beside: Vec<_> = others.iter().map(beside).collect();
    if let Some(same) = beside.iter().position(|other| other.as_deref() == Some(name)) {
        return Some(same);
    }
    if beside.iter().all(Option::is_none) {
        return None;
    }
    // Only the file system knows how it compares names: ask it. A failure to write here is reported elsewhere.
    let trial = ScratchFolder::new(parent(&own)).ok()?;
    let at = |name: &std::ffi::OsStr| trial.path().join(name);
    File::create_new(&at(name)).ok()?;
    let is_there = |other: &Option<std::ffi::OsString>| other.as_deref().is_some_and(|name| disk::exists(&at(name)));
    beside.iter().position(is_there)
}

#[cfg(unix)]
fn one_folder(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    // By identity: a folder may be mounted in two places.
    let id = |path| fs::metadata(path).map(|it| (it.dev(), it.ino())).ok();
    id(a).is_some() && id(a) == id(b)
}

#[cfg(not(unix))]
fn one_folder(a: &Path, b: &Path) -> bool {
    a == b
}

/// Whether a file system is mounted at `path`, whose name then cannot be given to something else.
#[cfg(unix)]
pub(super) fn is_mount_point(path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    #[cfg(target_os = "linux")]
    {
        use rustix::fs::{AtFlags, CWD, StatxAttributes, StatxFlags, statx};
        // A bind mount from the same file system shows only here.
        let mounted = statx(CWD, path, AtFlags::empty(), StatxFlags::empty());
        if mounted.is_ok_and(|it| it.stx_attributes.contains(StatxAttributes::MOUNT_ROOT)) {
            return true;
        }
    }
    let device = |path| fs::metadata(path).map(|it| it.dev()).ok();
    device(path).is_some() && device(path) != device(parent(path))
}

/// As on Unix.
#[cfg(not(unix))]
pub(super) fn is_mount_point(_path: &Path) -> bool {
    false
}
