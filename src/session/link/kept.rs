//! Links too long for an address, with the files that their scenes reference: a page stores them in its tab.

use serde_json::{Value, json};

use super::{LONGEST_LINK, Link, LinkError, fault, pack, unpack_within};
use crate::scene::Texts;

/// Prefix of a stored link.
pub(super) const PREFIX: &str = "kept:";
/// Size limit after unpacking, bytes; scene and files are limited one by one when they are read.
const LARGEST: usize = 32 << 20;
/// Characters of an address reserved beside the link, for the choice of renderer.
const ROOM: usize = 200;

impl Link {
    /// As [`Self::format`] if that fits into an address and loses nothing; otherwise a text that only [`Self::parse`] reads.
    pub fn keep(&self) -> String {
        let link = self.format();
        if link.len() + ROOM <= LONGEST_LINK && self.beside.is_empty() {
            return link;
        }
        let files = self.beside.iter();
        let files: serde_json::Map<_, _> = files.map(|(name, text)| (name.clone(), json!(**text))).collect();
        let kept = json!({ "link": link, "files": files });
        format!("{PREFIX}{}", pack(&kept.to_string()))
    }
}

/// The reverse of [`Link::keep`], without the prefix.
pub(super) fn read(packed: &str) -> Result<Link, LinkError> {
    let damaged = || fault("", "", "its stored scene is damaged");
    let text = unpack_within("", packed, LARGEST)?;
    let kept: Value = serde_json::from_str(&text).map_err(|_| damaged())?;
    let link = kept["link"].as_str().ok_or_else(damaged)?;
    let files = kept["files"].as_object().ok_or_else(damaged)?;
    let beside = files.iter().map(|(name, text)| Some((name.clone(), text.as_str()?.into())));
    let beside: Texts = beside.collect::<Option<_>>().ok_or_else(damaged)?;
    // As a fragment: a bare text must not contain a `?`.
    let link = Link::read(&format!("#{link}"))?;
    Ok(Link { beside, ..link })
}
