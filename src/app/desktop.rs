//! Services of the desktop: files by name, threads.

use std::collections::VecDeque;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use eframe::egui;

use super::background::Thread;
use super::host::{Host, OpenedFile, Running, SaveFile};
use super::saved::Watcher;
use crate::analysis::task::Job;
use crate::files::{FileError, OutputFile, publish};
use crate::scene::{LARGEST_FILE, too_large};

/// Files of the desktop.
#[derive(Debug, Default)]
pub struct DesktopHost {
    opened: VecDeque<OpenedFile>,
    watcher: Option<Watcher>,
    page: String,
}

impl DesktopHost {
    /// Links are appended to the address `page`; with "" they have none.
    pub fn new(page: String) -> Self {
        Self {
            page,
            ..Self::default()
        }
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
            FileError::Exists(path) | FileError::NotEmpty(path) => format!(
                "cannot write {}: it is already there; choose another name",
                path.display()
            ),
            error @ FileError::Cannot { .. } => error.to_string(),
        };
        let mut filled = Vec::new();
        for file in files {
            let target = OutputFile::claim(Path::new(&file.name), false).map_err(cannot)?;
            filled.push(
                target
                    .fill(|out| out.write_all(&file.bytes))
                    .map_err(cannot)?,
            );
        }
        publish(filled).map_err(cannot)?;
        let names: Vec<&str> = files.iter().map(|file| file.name.as_str()).collect();
        Ok(format!("Saved {}", names.join(" and ")))
    }

    fn read_dropped(&mut self, file: Arc<dyn egui::DroppedFile + Send + Sync>) {
        let large = file
            .path()
            .metadata()
            .is_ok_and(|file| file.len() > LARGEST_FILE);
        self.opened.push_back(OpenedFile {
            name: file.path().display().to_string(),
            content: if large {
                Err(too_large())
            } else {
                file.bytes()
            },
        });
    }

    fn opened(&mut self) -> Option<OpenedFile> {
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

    fn start(&mut self, job: Job) -> Option<Box<dyn Running>> {
        Some(Box::new(Thread::start(job)?))
    }
}
