//! Files included by a scene file: `include = ["leg.toml"]`, or with a name, values and a place, as `[[include]]`.

use std::collections::BTreeSet;
use std::sync::Arc;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::document::{Document, Inclusion, Node, Section, lists};
use super::format::{FILE, INCLUDED};
use super::instance::{Group, Instance, Names, PREVIOUS, Placement};
use super::placement::read_placement;
use super::*;
use jointplay_physics::suggest::nearest;

/// An included file.
pub(super) struct Include<'d> {
    /// File name, and prefix of the names of its parts in the scene; empty if the names are unchanged.
    pub file: &'d str,
    prefix: String,
    pub text: Arc<str>,
    /// Its entry, if that is a table.
    entry: Option<Section<'d>>,
    inclusion: Inclusion<'d>,
}

/// Reads the list of files that `top` includes.
///
/// # Errors
/// An invalid entry, a file that is listed twice without names, the scene's own file, or a file that cannot be read.
pub(super) fn read_includes<'d>(top: &Section<'d>) -> Result<Vec<Include<'d>>, SceneError> {
    let mut includes: Vec<Include<'d>> = Vec::new();
    let nodes = top.get("include").map(|node| node.entries());
    for node in nodes.transpose()?.unwrap_or_default() {
        let entry = match node.value.get_ref() {
            DeValue::String(_) => None,
            _ => Some(node.section_as(node.title("include"))?),
        };
        let file = entry.as_ref().map_or(Ok(node.clone()), |entry| entry.require("file"))?;
        let name = entry.as_ref().and_then(|entry| entry.get("name"));
        let prefix = name.as_ref().map_or(Ok(String::new()), read_prefix)?;
        if let Some(other) = includes.iter().find(|other| other.file == file.text().unwrap_or_default())
            && (other.prefix.is_empty() || prefix.is_empty())
        {
            return Err(
                file.error("this file is included already; a file that is included twice needs a `name` each time")
            );
        }
        let first = includes.iter().filter(|_| !prefix.is_empty()).find(|other| other.prefix == prefix);
        if let (Some(node), Some(first)) = (&name, first.and_then(|first| first.entry.as_ref()?.get("name"))) {
            return Err(node.duplicate_error(&first, "file", node.text()?));
        }
        let text = file.document.assets.text(file.text()?).map_err(|fault| file.error(fault.to_string()))?;
        if *text == *node.document.text {
            return Err(file.error("this is the scene's own file, which cannot include itself; name another or none"));
        }
        let values = entry.as_ref().and_then(|entry| entry.get("values"));
        let values = values.map_or(Ok(Default::default()), |node| node.named_values())?;
        includes.push(Include { file: file.text()?, prefix, text, entry, inclusion: Inclusion { values } });
    }
    Ok(includes)
}

/// Prefix of the names in a file that is included under this `name`.
fn read_prefix(name: &Node<'_>) -> Result<String, SceneError> {
    let own = name.name()?;
    let reserved = *own == *"world" || PREVIOUS.strip_suffix('.') == Some(&*own) || FILE.key(&own, None).is_some();
    match reserved {
        true => Err(name.error("is a word of scene files; choose another name")),
        false => Ok(format!("{own}.")),
    }
}

impl<'d> Include<'d> {
    /// The document of the file.
    pub fn document(&'d self, of: Document<'d>) -> Document<'d> {
        Document { file: Some(self.file), text: &self.text, include: Some(&self.inclusion), ..of }
    }

    /// The group of its parts, not yet placed; `None` if the scene gives only the file name.
    pub fn named(&self, parsed: &Spanned<DeTable<'_>>) -> Option<Instance<'d>> {
        self.entry.as_ref()?;
        let names = Arc::new(names_of(parsed.get_ref()));
        let group = Group::File { prefix: self.prefix.clone(), names };
        Some(Instance { group, placement: Placement::identity(), outer: None })
    }

    /// The group `named` at its place in the `outer` one.
    ///
    /// # Errors
    /// An invalid place.
    pub fn placed(
        &self,
        named: Option<&Instance<'d>>,
        outer: Option<&'d Instance<'d>>,
    ) -> Result<Option<Instance<'d>>, SceneError> {
        let (Some(named), Some(entry)) = (named, &self.entry) else {
            return Ok(outer.cloned());
        };
        let placement = read_placement(entry)?.unwrap_or(Placement::identity());
        Ok(Some(Instance { group: named.group.clone(), placement, outer }))
    }
}

/// Checks that every value passed to `file`, the section of an included file, belongs to one of its parameters.
///
/// # Errors
/// A value without such a parameter.
pub(super) fn check_values(file: &Section<'_>) -> Result<(), SceneError> {
    let Some(include) = file.document.include else {
        return Ok(());
    };
    let nodes = lists(std::slice::from_ref(file), "parameter", Vec::new())?;
    let names = nodes.iter().filter_map(|node| node.value.get_ref().get("name")?.get_ref().as_str());
    let names: Vec<&str> = names.collect();
    let unknown = include.values.iter().filter(|(name, _)| !names.contains(name));
    let Some((name, node)) = unknown.min_by_key(|(_, node)| node.offset()) else {
        return Ok(());
    };
    let near = nearest(name, names.iter().copied());
    let file = visible_line(file.document.file.unwrap_or_default());
    let allowed = match names.is_empty() {
        true => "it has none".to_owned(),
        false => format!("allowed {}", names.join(", ")),
    };
    Err(node.error(format!("is no parameter of {file}{near}; {allowed}")))
}

/// Names of bodies and joints in a file.
fn names_of(table: &DeTable<'_>) -> Names {
    let mut names = Names::default();
    add_names(table, &mut names.bodies, &mut names.joints);
    for pattern in tables(table, "pattern") {
        let (mut bodies, mut joints) = Default::default();
        add_names(pattern, &mut bodies, &mut joints);
        names.repeated.extend(bodies.into_iter().chain(joints));
    }
    names
}

/// Adds the names of the bodies and joints in the lists of `table`.
pub(super) fn add_names(table: &DeTable<'_>, bodies: &mut BTreeSet<String>, joints: &mut BTreeSet<String>) {
    let named = |list| tables(table, list).filter_map(|entry| entry.get("name")?.get_ref().as_str()).map(str::to_owned);
    bodies.extend(named("body"));
    joints.extend(named("joint").chain(named("ball_joint")));
}

/// Tables in the list `name` of `table`.
fn tables<'a>(table: &'a DeTable<'_>, name: &str) -> impl Iterator<Item = &'a DeTable<'a>> {
    let list = table.get(name).and_then(|list| list.get_ref().as_array());
    list.into_iter().flat_map(|list| list.iter()).filter_map(|entry| entry.get_ref().as_table())
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
