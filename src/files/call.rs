//! The calls to the file system that a test can have fail.

/// Kinds of calls.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Call {
    /// Makes or opens a file for writing.
    Open,
    /// Makes a folder.
    Folder,
    /// Takes a lock.
    Lock,
    /// Writes bytes.
    Write,
    /// Changes the length of a file.
    Truncate,
    /// Waits until bytes are on the disk.
    Sync,
    /// Gives another name.
    Rename,
    /// Swaps two names.
    Exchange,
    /// Takes a file or an empty folder away.
    Remove,
}
