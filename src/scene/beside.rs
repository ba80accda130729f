//! Files that a scene names: read once, when the scene is loaded, and kept in its source, so that whatever reads the scene
//! again gets the same text.

use std::cell::RefCell;
use std::io::Read;
use std::path::{Component, Path};
use std::sync::Arc;

use super::Texts;

/// Largest file that is read, bytes: a scene is a few kilobytes.
pub const LARGEST_FILE: u64 = 4 << 20;

/// Where a scene finds the files that it names, and those that it has asked for.
#[derive(Default)]
pub(super) struct Beside<'d> {
    /// Folder of a scene file that is being loaded; `None` where only `known` may be used.
    folder: Option<&'d Path>,
    /// Read before.
    known: Option<&'d Texts>,
    asked: RefCell<Texts>,
}

impl<'d> Beside<'d> {
    /// Reads files in `folder`.
    pub fn in_folder(folder: &'d Path) -> Self {
        Self {
            folder: Some(folder),
            ..Self::default()
        }
    }

    /// Uses what was read before.
    pub fn known(texts: &'d Texts) -> Self {
        Self {
            known: Some(texts),
            ..Self::default()
        }
    }

    /// Text of the file `name`.
    ///
    /// # Errors
    /// Why there is none.
    pub fn text(&self, name: &str) -> Result<Arc<str>, String> {
        let found = self.asked.borrow().get(name).cloned();
        let found = found.or_else(|| self.known?.get(name).cloned());
        let text = match found {
            Some(text) => text,
            None => self.read(name)?,
        };
        let mut asked = self.asked.borrow_mut();
        asked.insert(name.to_owned(), text.clone());
        Ok(text)
    }

    /// All texts that the scene asked for.
    pub fn into_texts(self) -> Texts {
        self.asked.into_inner()
    }

    fn read(&self, name: &str) -> Result<Arc<str>, String> {
        let plain = |part: Component<'_>| matches!(part, Component::Normal(_));
        if name.is_empty() || !Path::new(name).components().all(plain) {
            return Err(
                "is no file beside the scene; allowed the name of a file in the scene's folder, or below it, without `..`"
                    .to_owned(),
            );
        }
        let Some(folder) = self.folder else {
            return Err(
                "this scene has no folder in which to find a file: only a scene file that is loaded from a disk has one; \
                 what the file holds can also be written into the scene itself"
                    .to_owned(),
            );
        };
        let path = folder.join(name);
        if path.is_dir() {
            return Err("this is a directory, not a file".to_owned());
        }
        let mut bytes = Vec::new();
        let held: u64 = self.asked.borrow().values().map(|t| t.len() as u64).sum();
        let room = LARGEST_FILE.saturating_sub(held);
        // One byte more than allowed: a pipe or a device does not report its size.
        std::fs::File::open(path)
            .and_then(|file| file.take(room + 1).read_to_end(&mut bytes))
            .map_err(|cause| format!("cannot read this file: {cause}"))?;
        if bytes.len() as u64 > room {
            let most = LARGEST_FILE >> 20;
            return Err(format!(
                "too large; allowed at most {most} MiB in all files that a scene names"
            ));
        }
        let text = String::from_utf8(bytes);
        let text = text.map_err(|_| "not a text file: it is not valid UTF-8".to_owned())?;
        Ok(text.into())
    }
}
