//! Different names for one file.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use super::names::{parent, resolve};
use super::temporary;

/// The first of `others` that would be the same file as `path`: by a link, by another route, or by a spelling that its
/// file system treats as equal.
pub fn same_file(path: &Path, others: &[&Path]) -> Option<usize> {
    let own = resolve(path).ok()?;
    let others: Vec<_> = others.iter().map(|other| resolve(other).ok()).collect();
    if let Some(same) = others.iter().position(|other| other.as_ref() == Some(&own)) {
        return Some(same);
    }
    let siblings = |other: &Option<PathBuf>| other.clone().filter(|other| parent(other) == parent(&own));
    let siblings: Vec<_> = others.iter().map(siblings).collect();
    if siblings.iter().all(Option::is_none) {
        return None;
    }
    // Only the file system knows how it compares names, so try. A failure to write here is reported elsewhere.
    let (trial, _lock) = temporary::folder(&own).ok()?;
    // In a subfolder, where no run mistakes a name for a leftover and removes it.
    let names = trial.path().join("names");
    fs::create_dir(&names).ok()?;
    let at = |location: &Path| location.file_name().map(|name| names.join(name));
    File::create_new(at(&own)?).ok()?;
    siblings.iter().position(|other| other.as_deref().and_then(at).is_some_and(|trial| trial.exists()))
}
