//! What the application asks of its platform: a desktop window or a web page.

use std::path::PathBuf;
use std::sync::Arc;

use eframe::egui;

use super::click::Click;
use crate::analysis::task::{Job, Message};
pub use crate::session::clock::{Clock, wall};

/// A background computation.
pub trait Running {
    /// Its next message, if any; none follows [`Message::Done`] or [`Message::Failed`].
    fn poll(&mut self) -> Option<Message>;

    /// How long it is to rest from now on, as a multiple of the time that it computes; 0 at first.
    fn rest(&mut self, rest: f64);

    /// Ends it; messages already sent can still be polled.
    fn cancel(&mut self);
}

/// A file to be saved, with its description.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SaveFile {
    /// Name, as suggested by the application or as the user has changed it; on the desktop a path.
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
    /// Its content, or why it could not be read.
    pub content: Result<Vec<u8>, String>,
}

/// A file that is dropped on the window.
pub type Dropped = Arc<dyn egui::DroppedFile + Send + Sync>;

/// Services of the desktop or the page. The application works without any ([`NoHost`]).
///
/// Nothing here blocks: slow requests are answered later through [`Self::opened`], and the host then asks egui for a repaint.
pub trait Host {
    /// Address to which the fragment of a share link is appended; with "" the link is the fragment alone.
    fn address(&self) -> String {
        String::new()
    }

    /// A link was made: put it where the user sees it, e.g. in the address bar. Returns whether the host also copies it to the
    /// clipboard; otherwise egui does.
    fn shared(&mut self, _link: &str) -> bool {
        false
    }

    /// Whether to ask the user for a path before [`Self::save`]; otherwise the host decides where files go.
    fn asks_for_path(&self) -> bool {
        false
    }

    /// Saves `files`; returns a text that says where they are.
    ///
    /// # Errors
    /// Why not, in words.
    fn save(&mut self, _files: &[SaveFile]) -> Result<String, String> {
        Err("Files cannot be saved here".to_owned())
    }

    /// Lets the user choose a scene file, and with it those that it names; false if the application is to ask for a path instead.
    fn pick_file(&mut self) -> bool {
        false
    }

    /// Lets the user choose the path of a file to be saved, with `name` suggested; false if the application is to ask for it instead.
    #[cfg(not(target_arch = "wasm32"))]
    fn pick_path(&mut self, _name: &str) -> bool {
        false
    }

    /// The path that was chosen since, or nothing if the user has cancelled. Dialogs are shown over the window `frame`.
    #[cfg(not(target_arch = "wasm32"))]
    fn picked_path(&mut self, _ctx: &egui::Context, _frame: &eframe::Frame) -> Option<Option<String>> {
        None
    }

    /// Reads files that were dropped at once, now or later.
    fn read_dropped(&mut self, files: Vec<Dropped>);

    /// The next files that were chosen at once, or dropped and read.
    fn opened(&mut self) -> Option<Vec<OpenedFile>>;

    /// Folder in which the scene file `name`, opened here, finds the files that it names; `None` where files have no folder.
    fn folder(&self, _name: &str) -> Option<PathBuf> {
        None
    }

    /// Watches the scene file `name` from now on, instead of any other, and the files `beside` it that it names; `None` for
    /// none. `ctx` is asked for a repaint when one of them is saved.
    fn watch(&mut self, _ctx: &egui::Context, _name: Option<&str>, _beside: &[String]) {}

    /// The next content of the watched scene file, also when a file beside it was saved. The first may be as it was when the
    /// watch began.
    fn saved_elsewhere(&mut self) -> Option<OpenedFile> {
        None
    }

    /// How many background computations may run at once beside the picture.
    fn workers(&self) -> usize {
        1
    }

    /// Starts a long background computation; `None` if that is not possible.
    fn start(&mut self, _job: Job) -> Option<Box<dyn Running>> {
        None
    }

    /// Fills the screen with the window, or ends that.
    fn fill_screen(&mut self, ctx: &egui::Context, on: bool) {
        ctx.send_viewport_cmd(egui::ViewportCommand::Fullscreen(on));
    }

    /// Switches sound on or off; off at first.
    fn sound(&mut self, _on: bool) {}

    /// Sounds `clicks` of a frame that begins now.
    fn click(&mut self, _clicks: &[Click]) {}

    /// Why nothing is heard although sound is on, in words; `None` as long as nothing is known against it.
    fn no_sound(&mut self) -> Option<String> {
        Some("it cannot be made here".to_owned())
    }

    /// What is going on, for users who do not see the picture; the same sentences are in the accessibility tree. `event`:
    /// something has just happened.
    fn announce(&mut self, _text: &str, _event: bool) {}
}

/// No services: for headless frames and tests.
#[derive(Debug, Default)]
pub struct NoHost;

impl Host for NoHost {
    fn read_dropped(&mut self, _files: Vec<Dropped>) {}

    fn opened(&mut self) -> Option<Vec<OpenedFile>> {
        None
    }
}
