//! Where outputs are until they are whole: files and folders beside their final name, locked while their run is alive, so
//! that the next run beside them recognises the scratch of a killed one and removes it.

use std::fs;
use std::hash::{BuildHasher, Hasher};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use super::disk::{self, File};

/// Prefix of all scratch names.
const PREFIX: &str = ".jointplay-";
/// Locked as long as a scratch folder is in use.
const LOCK: &str = "lock";
/// Where a scratch folder keeps what it replaces, under its own name, between two renames.
const OLD: &str = "old";

/// A file without its final name.
#[derive(Debug)]
pub(super) struct ScratchFile {
    name: Name,
    file: File,
}

/// A name that is removed on drop, unless it was changed.
#[derive(Debug)]
struct Name(Option<PathBuf>);

impl Drop for Name {
    fn drop(&mut self) {
        if let Some(path) = &self.0 {
            // Best effort: the next run beside it tries again.
            let _ = disk::remove_file(path);
        }
    }
}

impl ScratchFile {
    /// An empty file in `folder`.
    pub fn new(folder: &Path) -> io::Result<Self> {
        loop {
            let path = fresh(folder);
            let file = match File::create_new(&path) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
                other => other?,
            };
            // No locks on this file system: then nothing is removed there either.
            let _ = file.lock();
            // Before it was locked, it looked like the remains of a killed run.
            if disk::exists(&path) {
                let name = Name(Some(path));
                return Ok(Self { name, file });
            }
        }
    }

    /// The file to write to.
    pub fn file(&self) -> &File {
        &self.file
    }

    /// Gives it its final name, which must be free unless `replace`; it stays locked until it is closed.
    pub fn rename(mut self, path: &Path, replace: bool) -> io::Result<File> {
        if let Some(scratch) = &self.name.0 {
            if replace {
                disk::rename(scratch, path)?;
            } else {
                disk::rename_new(scratch, path)?;
            }
        }
        self.name.0 = None;
        Ok(self.file)
    }

    /// Removes its name: the content lasts until it is closed, on systems that have nameless files.
    pub fn forget_name(&mut self) {
        if cfg!(unix) {
            self.name = Name(None);
        }
    }
}

/// A folder for the future folder, and for what that replaces.
#[derive(Debug)]
pub(super) struct ScratchFolder {
    path: PathBuf,
    /// Open as long as the folder is in use.
    _lock: File,
}

impl ScratchFolder {
    /// An empty folder in `folder`.
    pub fn new(folder: &Path) -> io::Result<Self> {
        loop {
            let path = fresh(folder);
            match disk::create_folder(&path) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
                other => other?,
            }
            let lock = match File::create_new(&path.join(LOCK)) {
                // Another run took it for the remains of a killed run, before the lock was in it.
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                Err(error) => {
                    let _ = disk::remove_folder(&path);
                    return Err(error);
                }
                Ok(lock) => lock,
            };
            let _ = lock.lock();
            if disk::exists(&path.join(LOCK)) {
                return Ok(Self { path, _lock: lock });
            }
        }
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Path of something in it.
    pub fn join(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Moves `path` in here, to be moved back if the run ends before something else has its name.
    pub fn put_aside(&self, path: &Path) -> io::Result<PathBuf> {
        let old = self.path.join(OLD);
        if !disk::exists(&old) {
            disk::create_folder(&old)?;
        }
        let old = old.join(path.file_name().unwrap_or_default());
        disk::rename(path, &old)?;
        Ok(old)
    }
}

impl Drop for ScratchFolder {
    fn drop(&mut self) {
        remove(&self.path);
    }
}

/// Removes a scratch folder, its lock last: a kill in between leaves what the next run recognises.
fn remove(path: &Path) {
    disk::remove_content(path, LOCK);
    let _ = disk::remove_file(&path.join(LOCK));
    let _ = disk::remove_folder(path);
}

/// Removes what killed runs of this machine left in `folder`; leaves alone what a live run has locked.
pub(super) fn clear(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        if name.to_str().is_some_and(is_of_this_machine) {
            let kind = entry.file_type();
            if kind.as_ref().is_ok_and(fs::FileType::is_dir) {
                clear_folder(folder, &entry.path());
            } else if kind.is_ok_and(|kind| kind.is_file())
                && let Some(_lock) = abandoned(&entry.path())
            {
                let _ = disk::remove_file(&entry.path());
            }
        }
    }
}

fn clear_folder(folder: &Path, scratch: &Path) {
    let Some(_lock) = abandoned(&scratch.join(LOCK)) else {
        // If it is empty, its run was killed before the lock was in it; otherwise this does nothing.
        let _ = disk::remove_folder(scratch);
        return;
    };
    // Killed between two renames: what was moved aside gets its name back.
    for old in fs::read_dir(scratch.join(OLD)).into_iter().flatten().flatten() {
        let name = folder.join(old.file_name());
        if !disk::exists(&name) && disk::rename(&old.path(), &name).is_err() {
            return;
        }
    }
    remove(scratch);
}

/// The file, locked, if no live run holds it.
fn abandoned(path: &Path) -> Option<File> {
    let file = File::open(path).ok()?;
    file.try_lock().ok()?;
    Some(file)
}

/// An unused name.
fn fresh(folder: &Path) -> PathBuf {
    // Seeded anew by the system each time.
    let random = std::hash::RandomState::new().build_hasher().finish();
    let [host, start] = machine();
    folder.join(format!("{PREFIX}{host}-{start}-{random:016x}"))
}

/// This machine, by name and by its last boot. A lock holds among the programs of one running system, whatever name a
/// container has there; between machines that share a folder it may not.
fn machine() -> &'static [String; 2] {
    static MACHINE: OnceLock<[String; 2]> = OnceLock::new();
    MACHINE.get_or_init(|| {
        let tag = |bytes: &[u8]| format!("{:08x}", crc32fast::hash(bytes));
        let start = fs::read("/proc/sys/kernel/random/boot_id");
        [tag(&host_name()), tag(&start.unwrap_or_else(|_| host_name()))]
    })
}

#[cfg(unix)]
fn host_name() -> Vec<u8> {
    rustix::system::uname().nodename().to_bytes().to_vec()
}

#[cfg(not(unix))]
fn host_name() -> Vec<u8> {
    std::env::var("COMPUTERNAME").unwrap_or_default().into_bytes()
}

fn is_of_this_machine(name: &str) -> bool {
    let mut parts = name.strip_prefix(PREFIX).unwrap_or_default().split('-');
    let [host, start] = machine();
    let known = [parts.next(), parts.next()];
    known[0] == Some(host) || known[1] == Some(start)
}
