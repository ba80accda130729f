//! Detects saves of a scene file or a file beside it by polling twice a second on its own thread, so that an idle window does not
//! repaint.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, SystemTime};

use super::host::OpenedFile;
use crate::scene::{MAX_FILE_SIZE, ReadError, read_regular, too_large};

/// Polling period; short in tests.
const PERIOD: Duration = Duration::from_millis(if cfg!(test) { 20 } else { 500 });
/// A file unchanged for this time is completely written.
const UNCHANGED_TIME: Duration = Duration::from_millis(50);

/// Watch on a scene file and the files beside it; ends when dropped.
#[derive(Debug)]
pub(super) struct Watcher {
    changes: Receiver<OpenedFile>,
    over: Arc<AtomicBool>,
}

impl Watcher {
    /// Watches the file `name` and the files `beside` it, and calls `changed` when [`Self::poll`] has new content, starting with
    /// the present one. `None` if the system cannot create a thread.
    pub(super) fn start(name: &str, beside: &[String], changed: impl Fn() + Send + 'static) -> Option<Self> {
        let (sender, changes) = channel();
        let over = Arc::new(AtomicBool::new(false));
        let is_over = Arc::clone(&over);
        let (name, path) = (name.to_owned(), PathBuf::from(name));
        let others = beside.iter().map(|other| path.with_file_name(other));
        let files: Vec<PathBuf> = std::iter::once(path.clone()).chain(others).collect();
        let watch_files = move || {
            let stamps = || -> Vec<_> { files.iter().map(|file| stamp(file)).collect() };
            let mut known = vec![None; files.len()];
            while !is_over.load(Ordering::Relaxed) {
                let now = stamps();
                if now != known {
                    std::thread::sleep(UNCHANGED_TIME);
                    if stamps() != now {
                        continue;
                    }
                    // Some editors replace a file, which is briefly missing then.
                    let was_written = |(now, known): (&Option<_>, &Option<_>)| now.is_some() && now != known;
                    let saved = now[0].is_some() && now.iter().zip(&known).any(was_written);
                    known = now;
                    if saved {
                        let (name, content) = (name.clone(), read(&path));
                        if sender.send(OpenedFile { name, content }).is_err() {
                            return;
                        }
                        changed();
                    }
                }
                std::thread::sleep(PERIOD);
            }
        };
        let builder = std::thread::Builder::new().name("scene file".to_owned());
        builder.spawn(watch_files).ok()?;
        Some(Self { changes, over })
    }

    /// The next content of the scene file.
    pub(super) fn poll(&self) -> Option<OpenedFile> {
        self.changes.try_recv().ok()
    }
}

impl Drop for Watcher {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
    }
}

/// Modification time and size of a file; `None` if there is no such file.
fn stamp(path: &Path) -> Option<(SystemTime, u64)> {
    let file = path.metadata().ok().filter(std::fs::Metadata::is_file)?;
    Some((file.modified().ok()?, file.len()))
}

fn read(path: &Path) -> Result<Vec<u8>, String> {
    read_regular(path, MAX_FILE_SIZE).map_err(|error| match error {
        ReadError::TooLarge(_) => too_large(),
        _ => error.to_string(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_saved_content_arrives_also_of_a_replaced_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.toml");
        std::fs::write(&path, "first").expect("writes");
        let (sender, told) = channel();
        let watcher = Watcher::start(&path.display().to_string(), &[], move || {
            // The receiver may be gone at the end.
            let _ = sender.send(());
        });
        let watcher = watcher.expect("a thread");
        let next = || {
            told.recv_timeout(Duration::from_secs(30)).expect("a change");
            let file = watcher.poll().expect("its content");
            assert_eq!(file.name, path.display().to_string());
            String::from_utf8(file.content.expect("readable")).expect("text")
        };
        assert_eq!(next(), "first");
        std::fs::write(&path, "second, longer").expect("writes");
        assert_eq!(next(), "second, longer");
        let beside = folder.path().join("b");
        std::fs::write(&beside, "3").expect("writes");
        std::fs::remove_file(&path).expect("removes");
        std::thread::sleep(2 * PERIOD);
        std::fs::rename(&beside, &path).expect("renames");
        assert_eq!(next(), "3");
        assert!(told.try_recv().is_err() && watcher.poll().is_none());
    }

    #[test]
    fn the_content_arrives_again_when_a_file_beside_it_is_saved() {
        let folder = tempfile::tempdir().expect("a folder");
        let (path, leg) = (folder.path().join("a.toml"), folder.path().join("parts/leg"));
        std::fs::create_dir(folder.path().join("parts")).expect("makes");
        std::fs::write(&path, "scene").expect("writes");
        std::fs::write(&leg, "1").expect("writes");
        let (sender, told) = channel();
        let beside = ["parts/leg".to_owned(), "gone".to_owned()];
        let watcher = Watcher::start(&path.display().to_string(), &beside, move || {
            // The receiver may be gone at the end.
            let _ = sender.send(());
        });
        let watcher = watcher.expect("a thread");
        let next = || {
            told.recv_timeout(Duration::from_secs(30)).expect("a change");
            let content = watcher.poll().expect("its content").content;
            assert_eq!(content.as_deref(), Ok(&b"scene"[..]));
        };
        next();
        std::fs::write(&leg, "longer").expect("writes");
        next();
        // Deletion is not reported; reappearance is.
        std::fs::remove_file(&leg).expect("removes");
        std::thread::sleep(2 * PERIOD);
        assert!(told.try_recv().is_err());
        std::fs::write(&leg, "3").expect("writes");
        next();
        assert!(told.try_recv().is_err() && watcher.poll().is_none());
    }
}
