//! Files included by a scene file: `include = ["leg.toml"]`.

use std::sync::Arc;
use toml::Spanned;
use toml::de::DeTable;

use super::document::{Document, Section};
use super::format::{FILE, INCLUDED};
use super::*;

/// Names and texts of the files included by `top`, in the order listed.
///
/// # Errors
/// `include` is not a list of names, lists a file twice or names the scene's own file, or a file cannot be read.
pub(super) fn included_texts<'d>(top: &Section<'d>) -> Result<Vec<(&'d str, Arc<str>)>, SceneError> {
    let mut texts: Vec<(&str, Arc<str>)> = Vec::new();
    let nodes = top.get("include").map(|node| node.entries());
    for node in nodes.transpose()?.unwrap_or_default() {
        let name = node.text()?;
        if texts.iter().any(|(other, _)| *other == name) {
            return Err(node.error("this file is included already"));
        }
        let text = node.document.beside.text(name).map_err(|fault| node.error(fault.to_string()))?;
        if *text == *node.document.text {
            return Err(node.error("this is the scene's own file, which cannot include itself; name another or none"));
        }
        texts.push((name, text));
    }
    Ok(texts)
}

/// The document of an included file.
pub(super) fn document<'d>(of: Document<'d>, name: &'d str, text: &'d str) -> Document<'d> {
    Document { file: Some(name), text, included: true, ..of }
}

/// Top-level section of an included file.
///
/// # Errors
/// The file has a key that is allowed only in the scene's own file.
pub(super) fn section<'d>(document: Document<'d>, parsed: &'d Spanned<DeTable<'d>>) -> Result<Section<'d>, SceneError> {
    let keys = parsed.get_ref().iter().map(|(key, _)| key);
    let own = keys.filter(|key| INCLUDED.key(key.get_ref(), None).is_none() && FILE.key(key.get_ref(), None).is_some());
    if let Some(key) = own.min_by_key(|key| key.span().start) {
        let name = key.get_ref();
        let message = if name == "include" {
            "an included file cannot include others; name them in `include` of the scene's own file".to_owned()
        } else {
            format!("an included file cannot have `{name}`; move it to the scene's own file")
        };
        return Err(document.error(key.span(), name, None, message));
    }
    Section::new(document, String::new(), parsed.get_ref(), 0..0, &INCLUDED)
}
