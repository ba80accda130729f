//! Links too long for an address, with the files that their scenes reference: a page stores them in its tab.

use serde_json::{Value, json};

use super::{Link, LinkError, MAX_LINK_LENGTH, link_error, pack, unpack_within};
use crate::scene::Texts;

/// Prefix of a stored link.
pub(super) const PREFIX: &str = "kept:";
/// Size limit after unpacking, bytes; scene and files are limited one by one when they are read.
const MAX_UNPACKED: usize = 32 << 20;
/// Characters of an address reserved for the choice of renderer.
const RESERVED: usize = 200;

impl Link {
    /// The link with the files that its scene references: as [`Self::format`] if there are none and it fits into an address,
    /// otherwise a text that only [`Self::parse`] reads.
    pub fn to_storage_text(&self) -> String {
        let link = self.format();
        if link.len() + RESERVED <= MAX_LINK_LENGTH && self.beside.is_empty() {
            return link;
        }
        let files = self.beside.iter();
        let files: serde_json::Map<_, _> = files.map(|(name, text)| (name.clone(), json!(**text))).collect();
        let stored = json!({ "link": link, "files": files });
        format!("{PREFIX}{}", pack(&stored.to_string()))
    }
}

/// The reverse of [`Link::to_storage_text`], without the prefix.
pub(super) fn read(packed: &str) -> Result<Link, LinkError> {
    let damaged = || link_error("", "", "its stored scene is damaged");
    let text = unpack_within("", packed, MAX_UNPACKED)?;
    let stored: Value = serde_json::from_str(&text).map_err(|_| damaged())?;
    let link = stored["link"].as_str().ok_or_else(damaged)?;
    let files = stored["files"].as_object().ok_or_else(damaged)?;
    let beside = files.iter().map(|(name, text)| Some((name.clone(), text.as_str()?.into())));
    let beside: Texts = beside.collect::<Option<_>>().ok_or_else(damaged)?;
    // As a fragment: a bare text must not contain a `?`.
    let link = Link::read(&format!("#{link}"))?;
    Ok(Link { beside, ..link })
}
