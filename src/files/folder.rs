//! Folders that appear complete or not at all, with a manifest of their files.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value as Json, json};
use tempfile::TempDir;

use super::names::{make_incomplete, parent, resolve};
use super::output::OutputFile;
use super::temporary::{self, OLD};
use super::{FileError, PROGRAM};
use crate::scene::read_regular;

/// The file that lists the content of a results folder.
pub const MANIFEST: &str = "manifest.json";

/// Size limit of a manifest, bytes: one with 100 000 frames has a quarter of it.
const MAX_MANIFEST_SIZE: u64 = 64 << 20;

/// Name of the folder within its temporary folder.
const NEW: &str = "new";

/// Largest number of foreign files that an error names.
const MAX_NAMED: usize = 4;

/// A folder to be filled.
#[derive(Debug)]
pub struct Folder {
    /// The path as requested.
    path: PathBuf,
    /// The path with links resolved.
    location: PathBuf,
    replace: bool,
    temporary: TempDir,
    /// Lock on the temporary folder, held while the folder is in use.
    _lock: Option<File>,
    /// Names of its files, relative to the folder.
    files: RefCell<BTreeSet<String>>,
}

impl Folder {
    /// Creates a temporary folder beside `path` and removes leftovers of killed runs. `replace` permits existing results of
    /// this program.
    ///
    /// # Errors
    /// `path` is a file, contains the working directory, or contains something that may not be replaced; its parent folder is
    /// not writable.
    pub fn claim(path: &Path, replace: bool) -> Result<Self, FileError> {
        let failed = |error: io::Error| FileError::of(path, &error);
        let location = resolve(path).map_err(failed)?;
        temporary::remove_leftovers(&location);
        if location.exists() && !location.is_dir() {
            return Err(FileError::cannot(path, "it is a file, not a folder"));
        }
        let current = std::env::current_dir().and_then(fs::canonicalize);
        if current.is_ok_and(|current| current.starts_with(&location)) {
            return Err(FileError::cannot(path, "the command runs in it; name a folder in it"));
        }
        if has_content(&location) {
            if !replace {
                return Err(FileError::NotEmpty(path.to_owned()));
            }
            check_replaceable(path, &location)?;
        }
        let (temporary, lock) = temporary::folder(&location).map_err(failed)?;
        fs::create_dir(temporary.path().join(NEW)).map_err(failed)?;
        Ok(Self { path: path.to_owned(), location, replace, temporary, _lock: lock, files: RefCell::default() })
    }

    /// The requested name, or that chosen by [`Self::spare_older`].
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// For a result that is not complete: if it would replace an older one, gives it another name beside its own, which has not
    /// been used yet. Returns the new name; none if nothing would be replaced.
    pub fn spare_older(&mut self) -> Vec<PathBuf> {
        if !has_content(&self.location) {
            return Vec::new();
        }
        make_incomplete([(&mut self.path, &mut self.location)]);
        self.replace = false;
        vec![self.path.clone()]
    }

    /// A file to be written in it.
    ///
    /// # Errors
    /// Input/output.
    pub fn file(&self, name: &str) -> Result<OutputFile, FileError> {
        let (path, location) = (self.path.join(name), self.temporary.path().join(NEW).join(name));
        fs::create_dir_all(parent(&location)).map_err(|error| FileError::of(&path, &error))?;
        self.files.borrow_mut().insert(name.to_owned());
        Ok(OutputFile { path, location, replace: false })
    }

    /// Writes a file in it.
    ///
    /// # Errors
    /// Input/output.
    pub fn write(&self, name: &str, content: &[u8]) -> Result<(), FileError> {
        // The folder appears as a whole, so its files need no temporary names.
        let OutputFile { path, location, .. } = self.file(name)?;
        fs::write(location, content).map_err(|error| FileError::of(&path, &error))
    }

    /// Writes the manifest, with the names of the files, and gives the folder its final name.
    ///
    /// # Errors
    /// Input/output; an older folder of that name is then still there.
    pub fn finish(mut self, mut manifest: Map<String, Json>) -> Result<(), FileError> {
        manifest.insert("files".into(), json!(&*self.files.borrow()));
        let text = format!("{:#}\n", Json::Object(manifest));
        self.write(MANIFEST, text.as_bytes())?;
        let failed = |error: io::Error| FileError::of(&self.path, &error);
        let [new, old] = [NEW, OLD].map(|name| self.temporary.path().join(name));
        if !has_content(&self.location) {
            // A rename replaces an empty folder on Unix; elsewhere the folder must be removed first.
            if cfg!(not(unix)) && self.location.is_dir() {
                fs::remove_dir(&self.location).map_err(failed)?;
            }
            return fs::rename(&new, &self.location).map_err(failed);
        }
        if !self.replace {
            return Err(FileError::NotEmpty(self.path.clone()));
        }
        fs::rename(&self.location, &old).map_err(failed)?;
        // Checked under the temporary name, where nobody adds files any more.
        let named = check_replaceable(&self.path, &old).and_then(|()| fs::rename(&new, &self.location).map_err(failed));
        if named.is_err() && fs::rename(&old, &self.location).is_err() {
            // Keeps the old folder; the next run gives it its name back.
            self.temporary.disable_cleanup(true);
        }
        named
    }
}

fn has_content(path: &Path) -> bool {
    fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_some())
}

/// Fails if the folder at `location` contains anything that this program did not write.
fn check_replaceable(path: &Path, location: &Path) -> Result<(), FileError> {
    let manifest = read_regular(&location.join(MANIFEST), MAX_MANIFEST_SIZE).unwrap_or_default();
    let manifest: Json = serde_json::from_slice(&manifest).unwrap_or_default();
    // Other programs also write manifests of that name.
    let own = manifest["program"] == PROGRAM;
    let listed = manifest["files"].as_array().into_iter().flatten().filter_map(Json::as_str);
    let listed: BTreeSet<&str> = listed.chain([MANIFEST]).filter(|_| own).collect();
    let mut foreign = Vec::new();
    collect(location, "", &mut foreign);
    foreign.retain(|name| !listed.contains(name.as_str()));
    if own && foreign.is_empty() {
        return Ok(());
    }
    foreign.sort();
    let more = foreign.len().saturating_sub(MAX_NAMED);
    let mut names = foreign[..foreign.len() - more].join(", ");
    if more > 0 {
        names += &format!(" and {more} more");
    }
    let why = if own { "something other than earlier results" } else { "no results of this program" };
    Err(FileError::cannot(
        path,
        format!(
            "the folder contains {why} ({names}) and is not replaced; choose another \
                                         folder"
        ),
    ))
}

/// Appends the names of all files under `folder`, and of empty folders, to `names`.
fn collect(folder: &Path, before: &str, names: &mut Vec<String>) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = format!("{before}{}", entry.file_name().display());
        // A symbolic link to a folder counts as a file.
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) && has_content(&entry.path()) {
            collect(&entry.path(), &format!("{name}/"), names);
        } else {
            names.push(name);
        }
    }
}
