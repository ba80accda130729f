//! Platform services used by the application: desktop window or web page.

use std::path::PathBuf;
use std::sync::Arc;

use eframe::egui;

use super::click::Click;
use crate::analysis::task::{Job, Message};
pub use crate::session::clock::{Clock, wall};

/// A background computation.
pub trait BackgroundTask {
    /// Its next message, if any; none follows [`Message::Done`] or [`Message::Failed`].
    fn poll(&mut self) -> Option<Message>;

    /// Sets the rest between spells, as a multiple of the computing time; 0 at first.
    fn rest(&mut self, rest: f64);

    /// Cancels it; messages already sent can still be polled.
    fn cancel(&mut self);
}

/// A file to save, with its description.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SaveFile {
    /// Name suggested by the application or edited by the user; a path on the desktop.
    pub name: String,
    /// Media type.
    pub mime: &'static str,
    /// Content.
    pub bytes: Vec<u8>,
}

/// A file that the user chose or dropped.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OpenedFile {
    /// Its name.
    pub name: String,
    /// Its content, or the read error as a message.
    pub content: Result<Vec<u8>, String>,
}

/// A file that is dropped on the window.
pub type DroppedFile = Arc<dyn egui::DroppedFile + Send + Sync>;

/// Services of the desktop or the page. The application works without any ([`NoHost`]).
///
/// No method blocks: slow requests are answered later through [`Self::opened`], and the host then requests a repaint from egui.
pub trait Host {
    /// Address to which the fragment of a share link is appended; "" gives the fragment alone.
    fn address(&self) -> String {
        String::new()
    }

    /// Publishes a new link, e.g. in the address bar. Returns whether the host also copies it to the clipboard; otherwise egui
    /// does.
    fn publish_link(&mut self, _link: &str) -> bool {
        false
    }

    /// Whether the user is asked for a path before [`Self::save`]; otherwise the host decides where files are saved.
    fn asks_for_path(&self) -> bool {
        false
    }

    /// Saves `files`; returns a message with their location.
    ///
    /// # Errors
    /// The cause, as a message.
    fn save(&mut self, _files: &[SaveFile]) -> Result<String, String> {
        Err("Files cannot be saved here".to_owned())
    }

    /// Opens a dialog for a scene file and the files it refers to; false if the application must ask for a path instead.
    fn pick_file(&mut self) -> bool {
        false
    }

    /// Opens a dialog for the path of a file to save, with the suggested `name`; false if the application must ask for it
    /// instead.
    #[cfg(not(target_arch = "wasm32"))]
    fn pick_path(&mut self, _name: &str) -> bool {
        false
    }

    /// The path chosen since the last call; the inner `None` if the user cancelled. Dialogs are shown over the window `frame`.
    #[cfg(not(target_arch = "wasm32"))]
    fn picked_path(&mut self, _ctx: &egui::Context, _frame: &eframe::Frame) -> Option<Option<String>> {
        None
    }

    /// Reads files that were dropped together, now or later.
    fn read_dropped(&mut self, files: Vec<DroppedFile>);

    /// The next group of files chosen together, or dropped and read.
    fn opened(&mut self) -> Option<Vec<OpenedFile>>;

    /// Folder in which files named by the opened scene file `name` are looked up; `None` if files have no folder.
    fn folder(&self, _name: &str) -> Option<PathBuf> {
        None
    }

    /// Watches the scene file `name`, and the files `beside` it that it refers to, instead of any previous one; `None` stops.
    /// `ctx` is asked for a repaint when one of them is saved.
    fn watch(&mut self, _ctx: &egui::Context, _name: Option<&str>, _beside: &[String]) {}

    /// The next content of the watched scene file, also after a file beside it was saved. The first may be unchanged since the
    /// watch began.
    fn saved_elsewhere(&mut self) -> Option<OpenedFile> {
        None
    }

    /// Number of background computations that may run at once without slowing the picture.
    fn workers(&self) -> usize {
        1
    }

    /// Starts a long background computation; `None` if that is impossible.
    fn start(&mut self, _job: Job) -> Option<Box<dyn BackgroundTask>> {
        None
    }

    /// Remembers that the first visit has been shown; a window has its settings for that.
    fn note_visit(&mut self) {}

    /// Enters or leaves full screen.
    fn fill_screen(&mut self, ctx: &egui::Context, on: bool) {
        ctx.send_viewport_cmd(egui::ViewportCommand::Fullscreen(on));
    }

    /// Switches sound on or off; off at first.
    fn sound(&mut self, _on: bool) {}

    /// Plays the `clicks` of a frame that starts now.
    fn click(&mut self, _clicks: &[Click]) {}

    /// Why sound is on but inaudible, as a message; `None` if no problem is known.
    fn no_sound(&mut self) -> Option<String> {
        Some("it cannot be made here".to_owned())
    }

    /// Announces the current state to users who cannot see the picture; the accessibility tree has the same sentences. `event`:
    /// something has just happened.
    fn announce(&mut self, _text: &str, _event: bool) {}
}

/// No services, for headless frames and tests.
#[derive(Debug, Default)]
pub struct NoHost;

impl Host for NoHost {
    fn read_dropped(&mut self, _files: Vec<DroppedFile>) {}

    fn opened(&mut self) -> Option<Vec<OpenedFile>> {
        None
    }
}
