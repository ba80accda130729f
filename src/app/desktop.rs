//! Services of the desktop: files by name, threads.

use std::collections::VecDeque;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use eframe::egui;

use super::background::Thread;
use super::chooser::{Answer, Chooser};
#[cfg(feature = "sound")]
use super::click::Click;
use super::host::{BackgroundTask, DroppedFile, Host, OpenedFile, SaveFile};
use super::saved::Watcher;
#[cfg(feature = "sound")]
use super::speaker::Speaker;
use crate::analysis::task::Job;
use crate::files::{FileError, OutputFile, publish};
use crate::scene::{ReadError, max_file_size, read_regular, too_large};

/// The desktop host.
#[derive(Default)]
pub struct DesktopHost {
    opened: VecDeque<Vec<OpenedFile>>,
    watcher: Option<Watcher>,
    #[cfg(feature = "sound")]
    speaker: Option<Speaker>,
    page: String,
    chooser: Option<Chooser>,
    /// The file whose replacement the dialog has confirmed.
    replaced: Option<PathBuf>,
}

impl DesktopHost {
    /// Links are appended to the address `page`; "" gives the fragment alone.
    pub fn new(page: String) -> Self {
        Self { page, ..Self::default() }
    }

    /// Uses the system's file dialogs, if there are any.
    pub fn with_dialogs(self) -> Self {
        Self { chooser: Some(Chooser::new()), ..self }
    }
}

/// Reads a chosen or dropped file, unless it is too large.
fn read(path: &Path) -> OpenedFile {
    let name = path.display().to_string();
    let content = read_regular(path, max_file_size(&name)).map_err(|error| match error {
        ReadError::TooLarge(_) => too_large(),
        _ => error.to_string(),
    });
    OpenedFile { name, content }
}

impl Host for DesktopHost {
    fn address(&self) -> String {
        self.page.clone()
    }

    fn asks_for_path(&self) -> bool {
        true
    }

    fn save(&mut self, files: &[SaveFile]) -> Result<String, String> {
        let cannot = |error: FileError| match error {
            FileError::Exists(path) | FileError::NotEmpty(path) => {
                format!("cannot write {}: it is already there; choose another name", path.display())
            }
            error @ FileError::Cannot { .. } => error.to_string(),
        };
        let mut filled = Vec::new();
        // The confirmation for a file also covers its provenance files.
        let replaced = self.replaced.take();
        let replace = files.first().is_some_and(|first| replaced.as_deref() == Some(Path::new(&first.name)));
        for file in files {
            let target = OutputFile::claim(Path::new(&file.name), replace).map_err(cannot)?;
            filled.push(target.fill(|out| out.write_all(&file.bytes)).map_err(cannot)?);
        }
        publish(filled).map_err(cannot)?;
        let names: Vec<&str> = files.iter().map(|file| file.name.as_str()).collect();
        Ok(format!("Saved {}", names.join(" and ")))
    }

    fn read_dropped(&mut self, files: Vec<DroppedFile>) {
        let read = |file: DroppedFile| read(file.path());
        self.opened.push_back(files.into_iter().map(read).collect());
    }

    fn pick_file(&mut self) -> bool {
        self.chooser.as_mut().is_some_and(Chooser::open)
    }

    fn pick_path(&mut self, name: &str) -> bool {
        self.chooser.as_mut().is_some_and(|chooser| chooser.save(name))
    }

    fn picked_path(&mut self, ctx: &egui::Context, frame: &eframe::Frame) -> Option<Option<String>> {
        match self.chooser.as_mut()?.poll(ctx, frame)? {
            Answer::Cancelled => Some(None),
            Answer::Open(path) => {
                self.opened.push_back(vec![read(&path)]);
                None
            }
            Answer::Save(path) => {
                let name = path.display().to_string();
                self.replaced = path.exists().then_some(path);
                Some(Some(name))
            }
        }
    }

    fn opened(&mut self) -> Option<Vec<OpenedFile>> {
        self.opened.pop_front()
    }

    fn folder(&self, name: &str) -> Option<PathBuf> {
        Path::new(name).parent().map(Path::to_owned)
    }

    fn watch(&mut self, ctx: &egui::Context, name: Option<&str>, beside: &[String]) {
        self.watcher = name.and_then(|name| {
            let ctx = ctx.clone();
            Watcher::start(name, beside, move || ctx.request_repaint())
        });
    }

    fn saved_elsewhere(&mut self) -> Option<OpenedFile> {
        self.watcher.as_ref()?.poll()
    }

    fn workers(&self) -> usize {
        // One core is left for drawing and stepping.
        let cores = std::thread::available_parallelism();
        cores.map_or(1, |cores| (cores.get() - 1).max(1))
    }

    fn start(&mut self, job: Job) -> Option<Box<dyn BackgroundTask>> {
        Some(Box::new(Thread::start(job)?))
    }

    #[cfg(feature = "sound")]
    fn sound(&mut self, on: bool) {
        self.speaker = on.then(Speaker::open);
    }

    #[cfg(feature = "sound")]
    fn click(&mut self, clicks: &[Click]) {
        if let Some(speaker) = &self.speaker {
            speaker.click(clicks);
        }
    }

    #[cfg(feature = "sound")]
    fn no_sound(&mut self) -> Option<String> {
        self.speaker.as_ref()?.failure()
    }

    #[cfg(not(feature = "sound"))]
    fn no_sound(&mut self) -> Option<String> {
        Some(
            "this program was built without it. ./run builds it with sound where libasound2-dev and pkg-config are installed"
                .to_owned(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_file_confirmed_in_the_dialog_and_its_companions_are_replaced() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("data.csv");
        let read = || std::fs::read_to_string(&path).expect("there");
        let files = |text: &str| {
            [path.clone(), folder.path().join("data.csv.meta.json")].map(|path| SaveFile {
                name: path.display().to_string(),
                mime: "text/csv",
                bytes: text.into(),
            })
        };
        let mut host = DesktopHost::default();
        host.save(&files("first")).expect("new files");
        assert!(host.save(&files("second")).expect_err("already there").contains("choose another name"));
        host.replaced = Some(folder.path().join("other.csv"));
        assert!(host.save(&files("second")).is_err());
        assert_eq!(read(), "first");
        host.replaced = Some(path.clone());
        host.save(&files("second")).expect("replaced");
        assert_eq!(read(), "second");
        assert!(host.save(&files("third")).is_err(), "asked about once");
    }
}
