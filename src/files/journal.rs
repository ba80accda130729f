//! Files that are visible while they grow, so that an interrupted run resumes from them: their beginning appears whole.

use std::io::{self, Write};
use std::path::Path;

use super::disk::File;
use super::names::{parent, place};
use super::scratch::ScratchFile;

pub use super::disk::{create_folders, remove_file, remove_folder as remove_empty_folder};

/// Opens an existing file, or creates it with `beginning` in it.
///
/// # Errors
/// Input/output.
pub fn open_or_create(path: &Path, beginning: &[u8]) -> io::Result<File> {
    let place = place(path)?;
    loop {
        let empty = match File::open(&place) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => false,
            // As good as missing.
            Ok(file) if file.length()? == 0 => true,
            other => return other,
        };
        let scratch = ScratchFile::new(parent(&place))?;
        scratch.file().write_all(beginning)?;
        scratch.file().sync()?;
        match scratch.rename(&place, empty) {
            // Another run was faster.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            other => return other,
        }
    }
}
