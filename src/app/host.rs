//! What the application asks of the place it runs in: a desktop window or a web page.

use std::sync::Arc;

use eframe::egui;

use crate::analysis::task::{Job, Message};

/// A computation beside the interface.
pub trait Running {
    /// What it said next, if anything; after [`Message::Done`] or [`Message::Failed`] nothing more comes.
    fn poll(&mut self) -> Option<Message>;

    /// Ends it; what it said so far can still be had.
    fn cancel(&mut self);
}

/// A file to be saved, with what describes it.
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

/// Services of the desktop or the page. The application works without any ([`NoHost`]).
///
/// Nothing here waits: what takes time is answered later through [`Self::opened`], after which the host asks egui for a
/// repaint.
pub trait Host {
    /// Address that a share link's fragment is hung on; "" gives out the fragment alone.
    fn address(&self) -> String {
        String::new()
    }

    /// A link was made: put it where links stand, say the address bar. Whether the host puts it on the clipboard, too; else
    /// egui does.
    fn shared(&mut self, _link: &str) -> bool {
        false
    }

    /// Whether the user is to be asked for a path before [`Self::save`]; else the host gives the files their places.
    fn asks_for_path(&self) -> bool {
        false
    }

    /// Saves `files`; the answer says where they are.
    ///
    /// # Errors
    /// Why not, in words.
    fn save(&mut self, _files: &[SaveFile]) -> Result<String, String> {
        Err("Files cannot be saved here".to_owned())
    }

    /// Lets the user choose a scene file; false where the application is to ask for a path instead.
    fn pick_file(&mut self) -> bool {
        false
    }

    /// Reads a dropped file, now or later.
    fn read_dropped(&mut self, file: Arc<dyn egui::DroppedFile + Send + Sync>);

    /// The next file that was chosen, or dropped and read.
    fn opened(&mut self) -> Option<OpenedFile>;

    /// Starts a long computation beside the interface; `None` where that cannot be.
    fn start(&mut self, _job: Job) -> Option<Box<dyn Running>> {
        None
    }

    /// What goes on, for somebody who does not see the picture; the same sentences are in the accessibility tree. `event`:
    /// something has happened, rather than gone on.
    fn announce(&mut self, _text: &str, _event: bool) {}
}

/// Nothing to ask: headless frames and tests.
#[derive(Debug, Default)]
pub struct NoHost;

impl Host for NoHost {
    fn read_dropped(&mut self, _file: Arc<dyn egui::DroppedFile + Send + Sync>) {}

    fn opened(&mut self) -> Option<OpenedFile> {
        None
    }
}
