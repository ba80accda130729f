//! Folders that appear whole, with a manifest that names their files.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde_json::{Map, Value as Json, json};

use super::disk::{self, File};
use super::names::{is_mount_point, parent, place};
use super::scratch::{self, ScratchFolder};
use super::target::OutputFile;
use super::{FileError, PROGRAM};

/// The file that lists the content of a results folder.
pub const MANIFEST: &str = "manifest.json";

/// Name of the folder within its scratch folder.
const NEW: &str = "new";

/// Largest number of foreign files that an error names.
const MOST_NAMED: usize = 4;

/// A folder to be filled.
#[derive(Debug)]
pub struct Folder {
    /// The path as requested.
    path: PathBuf,
    /// The path with links resolved.
    place: PathBuf,
    replace: bool,
    scratch: ScratchFolder,
    /// Names of its files, relative to the folder.
    files: RefCell<BTreeSet<String>>,
}

impl Folder {
    /// Makes the scratch folder beside `path`; removes what killed runs left there. `replace` permits existing results of
    /// this program.
    ///
    /// # Errors
    /// `path` cannot be given to a new folder: it is a file or a mount point, the command runs in it, or it contains
    /// something that may not be replaced. Nothing can be written beside it.
    pub fn claim(path: &Path, replace: bool) -> Result<Self, FileError> {
        let failed = |error: io::Error| FileError::of(path, &error);
        let place = place(path).map_err(failed)?;
        scratch::clear(parent(&place));
        let refused = |why: &str| Err(FileError::cannot(path, why));
        if disk::exists(&place) {
            if !place.is_dir() {
                return refused("it is a file, not a folder");
            }
            if is_mount_point(&place) {
                return refused("a file system is mounted there; name a folder in it");
            }
            let here = std::env::current_dir().and_then(fs::canonicalize);
            if here.is_ok_and(|here| here.starts_with(&place)) {
                return refused("the command runs in it; name a folder in it");
            }
        }
        if has_content(&place) {
            if !replace {
                return Err(FileError::NotEmpty(path.to_owned()));
            }
            check_own(path, &place)?;
        }
        let scratch = ScratchFolder::new(parent(&place)).map_err(failed)?;
        disk::create_folder(&scratch.join(NEW)).map_err(failed)?;
        Ok(Self { path: path.to_owned(), place, replace, scratch, files: RefCell::default() })
    }

    /// A file to be written in it.
    ///
    /// # Errors
    /// Input/output.
    pub fn file(&self, name: &str) -> Result<OutputFile, FileError> {
        let path = self.path.join(name);
        let place = self.scratch.join(NEW).join(name);
        let folder = parent(&place);
        if !folder.is_dir() {
            disk::create_folders(folder).map_err(|error| FileError::of(&path, &error))?;
        }
        self.files.borrow_mut().insert(name.to_owned());
        Ok(OutputFile::within(path, place))
    }

    /// Writes a file in it.
    ///
    /// # Errors
    /// Input/output.
    pub fn write(&self, name: &str, content: &[u8]) -> Result<(), FileError> {
        let path = self.file(name)?;
        // The folder appears whole: its files need no protection of their own.
        let place = self.scratch.join(NEW).join(name);
        let write = || (&File::create_new(&place)?).write_all(content);
        write().map_err(|error| FileError::of(path.path(), &error))
    }

    /// Writes the manifest, with the names of the files, and gives the folder its final name.
    ///
    /// # Errors
    /// Input/output; an older folder of that name is then still there.
    pub fn finish(self, mut manifest: Map<String, Json>) -> Result<(), FileError> {
        manifest.insert("files".into(), json!(&*self.files.borrow()));
        let text = format!("{:#}\n", Json::Object(manifest));
        self.write(MANIFEST, text.as_bytes())?;
        let failed = |error: io::Error| FileError::of(&self.path, &error);
        let new = self.scratch.join(NEW);
        let _lock = disk::lock_folder(parent(&self.place));
        if !has_content(&self.place) {
            // Renaming onto a folder works if that is empty; elsewhere than on Unix it has to be removed first.
            if cfg!(not(unix)) && self.place.is_dir() {
                disk::remove_folder(&self.place).map_err(failed)?;
            }
            return disk::rename(&new, &self.place).map_err(failed);
        }
        if !self.replace {
            return Err(FileError::NotEmpty(self.path.clone()));
        }
        if disk::exchange(&new, &self.place).is_ok() {
            // Checked where nobody adds anything any more.
            return check_own(&self.path, &new).inspect_err(|_| {
                let _ = disk::exchange(&new, &self.place);
            });
        }
        let old = self.scratch.put_aside(&self.place).map_err(failed)?;
        let renamed = check_own(&self.path, &old).and_then(|()| disk::rename(&new, &self.place).map_err(failed));
        renamed.inspect_err(|_| {
            // Best effort: the first error is the one to report.
            let _ = disk::rename(&old, &self.place);
        })
    }
}

fn has_content(path: &Path) -> bool {
    fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_some())
}

/// Refuses to replace anything in the folder at `place` that this program did not write.
fn check_own(path: &Path, place: &Path) -> Result<(), FileError> {
    let manifest = fs::read(place.join(MANIFEST)).unwrap_or_default();
    let manifest: Json = serde_json::from_slice(&manifest).unwrap_or_default();
    // Other programs write files of that name, too.
    let own = manifest["program"] == PROGRAM;
    let mut files = BTreeSet::new();
    if own {
        let listed = |key: &str| manifest[key].as_array().into_iter().flatten();
        files.extend(listed("files").filter_map(Json::as_str));
        // Older manifests list only frames.
        files.extend(listed("frames").filter_map(|frame| frame["file"].as_str()));
        files.insert(MANIFEST);
    }
    let mut foreign = Vec::new();
    collect(place, "", &mut |name| {
        if !files.contains(name) {
            foreign.push(name.to_owned());
        }
    });
    if own && foreign.is_empty() {
        return Ok(());
    }
    foreign.sort();
    let more = foreign.len().saturating_sub(MOST_NAMED);
    let mut names = foreign[..foreign.len() - more].join(", ");
    if more > 0 {
        names += &format!(" and {more} more");
    }
    let why = if own { "something other than earlier results" } else { "no results of this program" };
    Err(FileError::cannot(path, format!("the folder holds {why} ({names}); it is left alone, choose another folder")))
}

/// Calls `tell` with the names of all files under `folder`, and of empty folders.
fn collect(folder: &Path, before: &str, tell: &mut impl FnMut(&str)) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = format!("{before}{}", entry.file_name().display());
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        if is_folder && has_content(&entry.path()) {
            collect(&entry.path(), &format!("{name}/"), tell);
        } else {
            tell(&name);
        }
    }
}
