//! Files of the user, read up to a limit.

use std::io::Read as _;
use std::path::Path;

/// Why a file is not read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// A directory.
    #[error("this is a directory, not a file")]
    Directory,
    /// Something that may have no end or no writer, so that reading it might never end.
    #[error("this is a pipe, a socket or a device, not a file")]
    NotRegular,
    /// It has more bytes than this limit.
    #[error("too large; allowed at most {} MiB", .0 >> 20)]
    TooLarge(u64),
    /// Input/output.
    #[error("cannot read this file: {0}")]
    Unreadable(#[from] std::io::Error),
}

/// Opens the regular file `path`.
///
/// # Errors
/// Input/output, or anything else than a regular file.
pub fn open_regular(path: &Path) -> Result<std::fs::File, ReadError> {
    // Asked before it is opened, because opening a pipe waits for its writer.
    let kind = std::fs::metadata(path)?.file_type();
    if kind.is_dir() {
        return Err(ReadError::Directory);
    }
    if !kind.is_file() {
        return Err(ReadError::NotRegular);
    }
    Ok(std::fs::File::open(path)?)
}

/// Content of the regular file `path`, of at most `limit` bytes.
///
/// # Errors
/// Input/output, a larger file, or anything else than a regular file.
pub fn read_regular(path: &Path, limit: u64) -> Result<Vec<u8>, ReadError> {
    let mut bytes = Vec::new();
    // One byte above the limit: the file may grow, and a file of the system does not report its size.
    open_regular(path)?.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit { Err(ReadError::TooLarge(limit)) } else { Ok(bytes) }
}
