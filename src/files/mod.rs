//! Files and folders that appear whole or not at all: written beside their final name, then renamed. The next run removes
//! what a killed run left beside them.

mod call;
mod disk;
#[cfg(test)]
pub mod faults;
mod folder;
mod journal;
mod names;
mod scratch;
mod target;
#[cfg(test)]
mod tests;

pub use call::Call;
pub use disk::File;
pub use folder::{Folder, MANIFEST};
pub use journal::{create_folders, open_or_create, remove_empty_folder, remove_file};
pub use names::same_file;
pub use target::{OutputFile, PendingFile, Sink, Spool, publish};

use std::io;
use std::path::{Path, PathBuf};

/// Name of this program in every output.
pub const PROGRAM: &str = env!("CARGO_PKG_NAME");

/// Why an output cannot be written.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FileError {
    /// Something already has its name.
    #[error("{} already exists", .0.display())]
    Exists(PathBuf),
    /// A folder that is not empty has its name.
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
