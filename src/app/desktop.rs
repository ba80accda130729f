//! Services of the desktop: files by name, threads.

use std::collections::VecDeque;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use eframe::egui;

use super::background::Thread;
#[cfg(feature = "sound")]
use super::click::Click;
use super::host::{Dropped, Host, OpenedFile, Running, SaveFile};
use super::saved::Watcher;
#[cfg(feature = "sound")]
use super::speaker::Speaker;
use crate::analysis::task::Job;
use crate::files::{FileError, OutputFile, publish};
use crate::scene::{largest_file, too_large};

/// Files of the desktop.
#[derive(Default)]
pub struct DesktopHost {
    opened: VecDeque<Vec<OpenedFile>>,
    watcher: Option<Watcher>,
    #[cfg(feature = "sound")]
    speaker: Option<Speaker>,
    page: String,
}

impl DesktopHost {
    /// Links are appended to the address `page`; with "" they have none.
    pub fn new(page: String) -> Self {
        Self { page, ..Self::default() }
    }
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
        for file in files {
            let target = OutputFile::claim(Path::new(&file.name), false).map_err(cannot)?;
            filled.push(target.fill(|out| out.write_all(&file.bytes)).map_err(cannot)?);
        }
        publish(filled).map_err(cannot)?;
        let names: Vec<&str> = files.iter().map(|file| file.name.as_str()).collect();
        Ok(format!("Saved {}", names.join(" and ")))
    }

    fn read_dropped(&mut self, files: Vec<Dropped>) {
        let read = |file: Dropped| {
            let name = file.path().display().to_string();
            let size = file.path().metadata().map_or(0, |file| file.len());
            let content = match largest_file(&name) {
                most if size > most => Err(too_large()),
                _ => file.bytes(),
            };
            OpenedFile { name, content }
        };
        self.opened.push_back(files.into_iter().map(read).collect());
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
        // One core draws and steps.
        let cores = std::thread::available_parallelism();
        cores.map_or(1, |cores| (cores.get() - 1).max(1))
    }

    fn start(&mut self, job: Job) -> Option<Box<dyn Running>> {
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
        self.speaker.as_ref()?.failed()
    }

    #[cfg(not(feature = "sound"))]
    fn no_sound(&mut self) -> Option<String> {
        Some(
            "this program was built without it. ./run builds it with sound where libasound2-dev and pkg-config are installed"
                .to_owned(),
        )
    }
}
