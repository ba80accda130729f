//! The file system calls that make outputs. Each passes one gate, so that a test can make the n-th call of a kind fail,
//! or end the program there.

use std::fs::{self, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;

use super::call::Call;
#[cfg(test)]
pub use super::faults::Gate;

/// Lets everything through; tests have another gate.
#[cfg(not(test))]
#[derive(Clone, Copy, Debug)]
pub struct Gate;

#[cfg(not(test))]
impl Gate {
    /// The gate of this thread.
    pub fn here() -> Self {
        Self
    }

    /// Lets a call pass, or makes it fail.
    ///
    /// # Errors
    /// The error that the call is to return.
    pub fn pass(&self, _call: Call) -> io::Result<()> {
        Ok(())
    }

    /// The part of `bytes` that a failing write still writes.
    fn torn<'a>(&self, _bytes: &'a [u8]) -> &'a [u8] {
        &[]
    }

    /// Whether `path` exists under another spelling of its name.
    fn folded(&self, _path: &Path) -> bool {
        false
    }
}

/// A file that is written and read back.
#[derive(Debug)]
pub struct File {
    file: fs::File,
    /// Gate of the thread that opened it: others may write it.
    gate: Gate,
}

impl File {
    /// Creates a file that does not exist yet.
    ///
    /// # Errors
    /// Whatever the file system reports.
    pub fn create_new(path: &Path) -> io::Result<Self> {
        Self::with(path, OpenOptions::new().create_new(true))
    }

    /// Opens an existing file.
    ///
    /// # Errors
    /// Whatever the file system reports.
    pub fn open(path: &Path) -> io::Result<Self> {
        Self::with(path, &mut OpenOptions::new())
    }

    fn with(path: &Path, options: &mut OpenOptions) -> io::Result<Self> {
        let gate = Gate::here();
        gate.pass(Call::Open)?;
        let file = options.read(true).write(true).open(path)?;
        Ok(Self { file, gate })
    }

    /// Waits until nobody else holds its lock, and locks it until it is closed.
    ///
    /// # Errors
    /// A file system without locks.
    pub fn lock(&self) -> io::Result<()> {
        self.gate.pass(Call::Lock)?;
        self.file.lock()
    }

    /// Locks it until it is closed, if nobody else has.
    ///
    /// # Errors
    /// Locked by another; a file system without locks.
    pub fn try_lock(&self) -> Result<(), TryLockError> {
        self.gate.pass(Call::Lock).map_err(TryLockError::Error)?;
        self.file.try_lock()
    }

    /// Its length, bytes.
    ///
    /// # Errors
    /// Whatever the file system reports.
    pub fn length(&self) -> io::Result<u64> {
        Ok(self.file.metadata()?.len())
    }

    /// Truncates it to `length` bytes.
    ///
    /// # Errors
    /// Whatever the file system reports.
    pub fn set_length(&self, length: u64) -> io::Result<()> {
        self.gate.pass(Call::Truncate)?;
        self.file.set_len(length)
    }

    /// Waits until its content is on the disk.
    ///
    /// # Errors
    /// Whatever the file system reports.
    pub fn sync(&self) -> io::Result<()> {
        self.gate.pass(Call::Sync)?;
        // Waiting would prove nothing in a test.
        if cfg!(test) {
            return Ok(());
        }
        self.file.sync_all()
    }
}

impl Write for &File {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if let Err(error) = self.gate.pass(Call::Write) {
            // A full disk or a kill leaves the beginning.
            (&self.file).write_all(self.gate.torn(bytes))?;
            return Err(error);
        }
        (&self.file).write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Read for &File {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        (&self.file).read(bytes)
    }
}

impl Seek for &File {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        (&self.file).seek(to)
    }
}

/// Waits for the lock on the names in `folder`, held until dropped, so that no other run changes them meanwhile; `None` where
/// there are no such locks.
pub fn lock_folder(folder: &Path) -> Option<fs::File> {
    let lock = || {
        Gate::here().pass(Call::Lock)?;
        // Other than on Unix a folder cannot be opened, and avoiding two runs of one output is up to the user.
        let file = fs::File::open(folder)?;
        file.lock()?;
        io::Result::Ok(file)
    };
    lock().inspect_err(|e| log::debug!("no lock: {e}")).ok()
}

/// Creates a folder that does not exist yet.
///
/// # Errors
/// Whatever the file system reports.
pub fn create_folder(path: &Path) -> io::Result<()> {
    Gate::here().pass(Call::Folder)?;
    fs::create_dir(path)
}

/// Creates a folder and its missing parents.
///
/// # Errors
/// Whatever the file system reports.
pub fn create_folders(path: &Path) -> io::Result<()> {
    Gate::here().pass(Call::Folder)?;
    fs::create_dir_all(path)
}

/// Whether something has this name; a dangling link counts.
pub fn exists(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok() || Gate::here().folded(path)
}

/// Renames a file, replacing whatever has the new name.
///
/// # Errors
/// Whatever the file system reports.
pub fn rename(from: &Path, to: &Path) -> io::Result<()> {
    Gate::here().pass(Call::Rename)?;
    fs::rename(from, to)
}

/// Renames a file to a name that must be free.
///
/// # Errors
/// `AlreadyExists`; whatever else the file system reports.
pub fn rename_new(from: &Path, to: &Path) -> io::Result<()> {
    Gate::here().pass(Call::Rename)?;
    #[cfg(any(target_os = "linux", target_os = "macos"))]
    {
        use rustix::fs::{CWD, RenameFlags, renameat_with};
        use rustix::io::Errno;
        match renameat_with(CWD, from, CWD, to, RenameFlags::NOREPLACE) {
            Err(Errno::INVAL | Errno::NOSYS | Errno::NOTSUP) => {}
            other => return other.map_err(io::Error::from),
        }
    }
    // Only another program can come in between.
    if fs::symlink_metadata(to).is_ok() {
        return Err(io::ErrorKind::AlreadyExists.into());
    }
    fs::rename(from, to)
}

/// Swaps two names atomically.
///
/// # Errors
/// A system or file system without such a call; whatever else the file system reports.
pub fn exchange(a: &Path, b: &Path) -> io::Result<()> {
    Gate::here().pass(Call::Exchange)?;
    #[cfg(any(target_os = "linux", target_os = "macos"))]
    {
        use rustix::fs::{CWD, RenameFlags, renameat_with};
        Ok(renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE)?)
    }
    #[cfg(not(any(target_os = "linux", target_os = "macos")))]
    {
        let _ = (a, b);
        Err(io::ErrorKind::Unsupported.into())
    }
}

/// Removes a file.
///
/// # Errors
/// Whatever the file system reports.
pub fn remove_file(path: &Path) -> io::Result<()> {
    Gate::here().pass(Call::Remove)?;
    fs::remove_file(path)
}

/// Removes an empty folder.
///
/// # Errors
/// Whatever the file system reports.
pub fn remove_folder(path: &Path) -> io::Result<()> {
    Gate::here().pass(Call::Remove)?;
    fs::remove_dir(path)
}

/// Removes everything in a folder except `except`; continues past what cannot be removed.
pub fn remove_content(path: &Path, except: &str) {
    for entry in fs::read_dir(path).into_iter().flatten().flatten() {
        // A link to a folder is a file here.
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            remove_content(&entry.path(), "");
            let _ = remove_folder(&entry.path());
        } else if entry.file_name() != except {
            let _ = remove_file(&entry.path());
        }
    }
}
