//! File system calls that a test can make fail.

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
    /// Renames.
    Rename,
    /// Swaps two names.
    Exchange,
    /// Removes a file or an empty folder.
    Remove,
}
