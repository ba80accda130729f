//! Files and folders that appear whole or not at all: written beside their final name, then renamed.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::{NamedTempFile, TempDir};

use crate::cli::failure::Failure;

/// A file to be written.
#[derive(Debug)]
pub struct Target {
    path: PathBuf,
    force: bool,
}

impl Target {
    /// Checks, by writing an empty file beside it and removing that, that `path` can be written.
    ///
    /// # Errors
    /// Input/output: it exists and `force` is not given, is a folder, or its folder is missing or read-only.
    pub fn claim(path: &Path, force: bool) -> Result<Self, Failure> {
        if path.file_name().is_none() || path.is_dir() {
            return Err(Failure::io(format!(
                "cannot write {}: it names a folder",
                path.display()
            )));
        }
        if !force && exists(path) {
            return Err(already_there(path));
        }
        scratch_file(path).map_err(|error| cannot_write(path, &error))?;
        Ok(Self {
            path: path.to_owned(),
            force,
        })
    }

    /// The final name.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Lets `fill` write the content, then gives it its final name.
    ///
    /// # Errors
    /// Input/output; the final name is then as it was.
    pub fn write(
        self,
        fill: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
    ) -> Result<(), Failure> {
        let failed = |error: io::Error| cannot_write(&self.path, &error);
        let scratch = scratch_file(&self.path).map_err(failed)?;
        let mut writer = BufWriter::new(scratch.as_file());
        fill(&mut writer).map_err(failed)?;
        writer.flush().map_err(failed)?;
        drop(writer);
        scratch.as_file().sync_all().map_err(failed)?;
        if self.force {
            scratch.persist(&self.path).map_err(|e| failed(e.error))?;
        } else {
            scratch.persist_noclobber(&self.path).map_err(|e| {
                if e.error.kind() == io::ErrorKind::AlreadyExists {
                    already_there(&self.path)
                } else {
                    failed(e.error)
                }
            })?;
        }
        Ok(())
    }
}

/// A folder to be filled.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    force: bool,
    scratch: TempDir,
}

impl Folder {
    /// Makes the scratch folder beside `path`.
    ///
    /// # Errors
    /// Input/output: `path` is a file, or a folder with something in it and `force` is not given, or nothing can be
    /// written beside it.
    pub fn claim(path: &Path, force: bool) -> Result<Self, Failure> {
        if exists(path) && !path.is_dir() {
            return Err(Failure::io(format!(
                "cannot write a folder {}: it is a file",
                path.display()
            )));
        }
        if !force && has_content(path) {
            return Err(Failure::io(format!(
                "{} already exists and is not empty; add --force to replace it, or choose another folder",
                path.display()
            )));
        }
        if force && has_content(path) && !is_own(path) {
            // --force replaces what an earlier run wrote, never a folder of something else.
            return Err(Failure::io(format!(
                "{} holds something other than earlier results (no {MANIFEST} of this program in it); it is left alone, choose \
                 another folder",
                path.display()
            )));
        }
        let scratch = scratch_builder()
            .tempdir_in(parent(path))
            .map_err(|error| cannot_write(path, &error))?;
        Ok(Self {
            path: path.to_owned(),
            force,
            scratch,
        })
    }

    /// Folder to write into until [`Self::finish`].
    pub fn scratch(&self) -> &Path {
        self.scratch.path()
    }

    /// Gives the filled folder its final name.
    ///
    /// # Errors
    /// Input/output; an older folder of that name is then still there.
    pub fn finish(self) -> Result<(), Failure> {
        let failed = |error: io::Error| cannot_write(&self.path, &error);
        // A rename over a folder works only if that is empty: move the old one aside first.
        let old = if has_content(&self.path) {
            if !self.force {
                return Err(already_there(&self.path));
            }
            let aside = scratch_builder()
                .tempdir_in(parent(&self.path))
                .map_err(failed)?;
            fs::rename(&self.path, aside.path().join("old")).map_err(failed)?;
            Some(aside)
        } else {
            if self.path.is_dir() {
                fs::remove_dir(&self.path).map_err(failed)?;
            }
            None
        };
        if let Err(error) = fs::rename(self.scratch.path(), &self.path) {
            if let Some(aside) = old {
                // Best effort: the first error is the one to report.
                let _ = fs::rename(aside.path().join("old"), &self.path);
            }
            return Err(failed(error));
        }
        // The scratch name is gone; nothing is left to remove.
        let _ = self.scratch.keep();
        Ok(())
    }
}

/// The file that says what a folder of results holds.
pub const MANIFEST: &str = "manifest.json";

/// Whether this program filled the folder: other programs write files of that name, too.
fn is_own(folder: &Path) -> bool {
    let manifest = fs::read(folder.join(MANIFEST)).unwrap_or_default();
    let manifest: Option<serde_json::Value> = serde_json::from_slice(&manifest).ok();
    manifest.is_some_and(|manifest| manifest["program"] == super::super::provenance::PROGRAM)
}

fn exists(path: &Path) -> bool {
    // Not `exists()`: a dangling link is something, too.
    fs::symlink_metadata(path).is_ok()
}

fn has_content(path: &Path) -> bool {
    fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_some())
}

fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

fn scratch_builder() -> tempfile::Builder<'static, 'static> {
    // The name tells whose leftovers they are if the machine goes down in the middle.
    let mut builder = tempfile::Builder::new();
    builder.prefix(".jointplay-");
    builder
}

fn scratch_file(path: &Path) -> io::Result<NamedTempFile> {
    let mut builder = scratch_builder();
    // Temporary files are private by default; an output file follows the user's umask as any other.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(parent(path))
}

fn already_there(path: &Path) -> Failure {
    Failure::io(format!(
        "{} already exists; add --force to replace it, or choose another name",
        path.display()
    ))
}

fn cannot_write(path: &Path, error: &io::Error) -> Failure {
    // tempfile adds the name of its own scratch file, which helps nobody.
    let text = error.to_string();
    let cause = text.split(" at path ").next().unwrap_or(&text);
    Failure::io(format!("cannot write {}: {cause}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_appears_only_when_it_is_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows.csv");
        let target = Target::claim(&path, false).unwrap();
        assert!(!path.exists(), "claiming leaves nothing behind");
        let failure = target
            .write(|file| {
                file.write_all(b"half")?;
                Err(io::Error::other("disk full"))
            })
            .unwrap_err();
        assert_eq!(failure.code, Failure::INPUT_OUTPUT);
        assert!(failure.message.contains("disk full"), "{}", failure.message);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);

        Target::claim(&path, false)
            .unwrap()
            .write(|file| file.write_all(b"whole"))
            .unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"whole");
    }

    #[test]
    fn an_existing_file_is_replaced_only_by_force() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows.csv");
        let early = Target::claim(&path, false).unwrap();
        fs::write(&path, "mine").unwrap();
        assert_eq!(
            Target::claim(&path, false).unwrap_err().code,
            Failure::INPUT_OUTPUT
        );
        // One that appears during the run is not lost either.
        assert!(early.write(|file| file.write_all(b"new")).is_err());
        assert_eq!(fs::read(&path).unwrap(), b"mine");
        Target::claim(&path, true)
            .unwrap()
            .write(|file| file.write_all(b"new"))
            .unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
    }

    #[test]
    fn an_unwritable_place_is_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        for bad in ["no/such/folder/rows.csv", ""] {
            let failure = Target::claim(&folder.path().join(bad), false).unwrap_err();
            assert_eq!(failure.code, Failure::INPUT_OUTPUT, "{bad}");
        }
    }

    #[test]
    fn a_folder_replaces_only_frames_and_only_by_force() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("frames");
        let first = Folder::claim(&path, false).unwrap();
        let manifest = |n: u8| format!("{{\"program\": \"jointplay\", \"n\": {n}}}");
        fs::write(first.scratch().join(MANIFEST), manifest(1)).unwrap();
        assert!(!path.exists());
        first.finish().unwrap();
        assert_eq!(
            fs::read_to_string(path.join(MANIFEST)).unwrap(),
            manifest(1)
        );

        assert!(Folder::claim(&path, false).is_err());
        let second = Folder::claim(&path, true).unwrap();
        fs::write(second.scratch().join(MANIFEST), manifest(2)).unwrap();
        second.finish().unwrap();
        assert_eq!(
            fs::read_to_string(path.join(MANIFEST)).unwrap(),
            manifest(2)
        );
        assert_eq!(
            fs::read_dir(folder.path()).unwrap().count(),
            1,
            "nothing is left beside"
        );

        let other = folder.path().join("photos");
        fs::create_dir(&other).unwrap();
        fs::write(other.join("holiday.png"), "x").unwrap();
        for foreign in ["{}", "{\"name\": \"a web application\"}", "no JSON"] {
            assert!(Folder::claim(&other, true).is_err());
            assert!(other.join("holiday.png").exists());
            fs::write(other.join(MANIFEST), foreign).unwrap();
        }
        assert!(Folder::claim(&other, true).is_err());
    }
}
