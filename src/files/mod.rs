//! Output files and folders. Each is written under a temporary name beside its final one, then renamed, so that it appears
//! complete or not at all. Reading uses `crate::scene::read_regular`.

mod folder;
mod names;
mod output;
mod same;
mod temporary;
#[cfg(test)]
mod tests;

pub use folder::{Folder, MANIFEST};
pub use output::{Content, OutputFile, PendingFile, publish, spare_older};
pub use same::same_file;

use std::io;
use std::path::{Path, PathBuf};

/// Name of this program in every output.
pub const PROGRAM: &str = env!("CARGO_PKG_NAME");

/// Why an output cannot be written.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FileError {
    /// The name is taken.
    #[error("{} already exists", .0.display())]
    Exists(PathBuf),
    /// A folder of that name is not empty.
    #[error("{} already exists and is not empty", .0.display())]
    NotEmpty(PathBuf),
    /// Anything else.
    #[error("cannot write {}: {cause}", .path.display())]
    Cannot {
        /// The requested name.
        path: PathBuf,
        /// Why.
        cause: String,
    },
}

impl FileError {
    /// `path` cannot be written because of `cause`.
    pub fn cannot(path: &Path, cause: impl std::fmt::Display) -> Self {
        Self::Cannot { path: path.to_owned(), cause: cause.to_string() }
    }

    fn of(path: &Path, error: &io::Error) -> Self {
        if error.kind() == io::ErrorKind::AlreadyExists {
            Self::Exists(path.to_owned())
        } else {
            Self::cannot(path, error)
        }
    }
}

/// Removes a file that is no longer needed.
pub fn remove_file(path: &Path) -> io::Result<()> {
    std::fs::remove_file(path)
}

/// Creates a folder and those above it.
pub fn create_dir_all(path: &Path) -> io::Result<()> {
    std::fs::create_dir_all(path)
}
