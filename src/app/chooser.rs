//! The system's file dialogs. They do not block the window.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::sync::{Arc, OnceLock};

use eframe::egui;
use rfd::{AsyncFileDialog, FileHandle};

/// A dialog to show.
enum Question {
    Open,
    /// The suggested file name.
    Save(String),
}

/// The result of a dialog.
pub enum Answer {
    /// A file to open.
    Open(PathBuf),
    /// Path to save to; the dialog has confirmed replacing an existing file.
    Save(PathBuf),
    /// The dialog was cancelled.
    Cancelled,
}

/// The system's dialogs, one at a time.
pub struct Chooser {
    /// Whether the system has dialogs; unset until known.
    available: Arc<OnceLock<bool>>,
    question: Option<Question>,
    answer: Option<Receiver<Answer>>,
}

impl Chooser {
    /// Checks in the background whether the system has dialogs.
    pub fn new() -> Self {
        let available = Arc::new(OnceLock::new());
        let availability = available.clone();
        std::thread::spawn(move || {
            // No other thread sets it.
            let _ = availability.set(has_dialogs());
        });
        Self { available, question: None, answer: None }
    }

    /// Requests a dialog to open a file; false if there is none or availability is not known yet.
    pub fn open(&mut self) -> bool {
        self.ask(Question::Open)
    }

    /// Requests a dialog to save a file with the suggested `name`; false as for [`Self::open`].
    pub fn save(&mut self, name: &str) -> bool {
        self.ask(Question::Save(name.to_owned()))
    }

    fn ask(&mut self, question: Question) -> bool {
        let has = self.available.get() == Some(&true);
        if has && self.answer.is_none() {
            self.question = Some(question);
        }
        has
    }

    /// Shows the requested dialog over the window `frame`; returns the result of the previous one.
    pub fn poll(&mut self, ctx: &egui::Context, frame: &eframe::Frame) -> Option<Answer> {
        if let Some(question) = self.question.take() {
            self.show(question, ctx, frame);
        }
        let answer = match self.answer.as_ref()?.try_recv() {
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => Answer::Cancelled,
            Ok(answer) => answer,
        };
        self.answer = None;
        Some(answer)
    }

    fn show(&mut self, question: Question, ctx: &egui::Context, frame: &eframe::Frame) {
        let mut dialog = AsyncFileDialog::new().set_parent(frame);
        // Names without folders are relative to the working directory.
        if let Ok(folder) = std::env::current_dir() {
            dialog = dialog.set_directory(folder);
        }
        let (send, receive) = channel();
        let ctx = ctx.clone();
        let send_answer = move |chosen: Option<FileHandle>, answer: fn(PathBuf) -> Answer| {
            let chosen = chosen.map(|file| file.path().to_owned());
            // The window may have been closed.
            let _ = send.send(chosen.map_or(Answer::Cancelled, answer));
            ctx.request_repaint();
        };
        // Some systems require the dialog on the window's thread; another thread waits for the answer.
        match question {
            Question::Open => {
                let chosen = dialog.set_title("Open a scene").add_filter("Scenes", &["toml"]).pick_file();
                std::thread::spawn(move || send_answer(pollster::block_on(chosen), Answer::Open));
            }
            Question::Save(name) => {
                let ending = name.rsplit_once('.').map_or("", |(_, ending)| ending).to_owned();
                let chosen =
                    dialog.set_title("Save as").set_file_name(name).add_filter(&*ending, &[&ending]).save_file();
                std::thread::spawn(move || send_answer(pollster::block_on(chosen), Answer::Save));
            }
        }
        self.answer = Some(receive);
    }
}

/// Whether the system has file dialogs: the desktop portal offers them, or `zenity` is installed.
#[cfg(all(unix, not(target_os = "macos")))]
fn has_dialogs() -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    PORTAL_QUERIES.iter().any(answers) || std::env::split_paths(&path).any(|at| at.join("zenity").is_file())
}

/// The system always has file dialogs.
#[cfg(not(all(unix, not(target_os = "macos"))))]
fn has_dialogs() -> bool {
    true
}

/// Queries of the version of the portal's file chooser, which a portal without a desktop backend does not have, with at most five
/// seconds to start the portal: by the tools of systemd and of D-Bus, one of which is on every desktop.
#[cfg(all(unix, not(target_os = "macos")))]
const PORTAL_QUERIES: [(&str, &[&str]); 2] = [
    (
        "busctl",
        &[
            "--user",
            "--timeout=5",
            "get-property",
            "org.freedesktop.portal.Desktop",
            "/org/freedesktop/portal/desktop",
            "org.freedesktop.portal.FileChooser",
            "version",
        ],
    ),
    (
        "dbus-send",
        &[
            "--session",
            "--print-reply",
            "--reply-timeout=5000",
            "--dest=org.freedesktop.portal.Desktop",
            "/org/freedesktop/portal/desktop",
            "org.freedesktop.DBus.Properties.Get",
            "string:org.freedesktop.portal.FileChooser",
            "string:version",
        ],
    ),
];

#[cfg(all(unix, not(target_os = "macos")))]
fn answers((tool, arguments): &(&str, &[&str])) -> bool {
    use std::process::{Command, Stdio};
    let mut query = Command::new(tool);
    query.args(*arguments).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    query.status().is_ok_and(|status| status.success())
}
