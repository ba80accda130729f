//! Patterns: a group of bodies, joints and elements of a scene file, repeated about an axis or along a line.

use std::collections::BTreeMap;
use std::sync::Arc;
use toml::de::DeValue;

use super::document::{Node, Section, lists};
use super::include::add_names;
use super::instance::{Group, Instance, Names, PREVIOUS, Placement};
use super::key::ValueType;
use super::*;

/// A `[[pattern]]` with its copies.
pub(super) struct Pattern<'d> {
    section: Section<'d>,
    copies: Vec<Instance<'d>>,
}

/// Reads the patterns of all files of a scene.
///
/// # Errors
/// Invalid keys of a pattern, a repeated name, or too many copies.
pub(super) fn read_patterns<'d>(files: &[Section<'d>]) -> Result<Vec<Pattern<'d>>, SceneError> {
    let mut names = BTreeMap::new();
    let mut patterns = Vec::new();
    for node in lists(files, "pattern", Vec::new())? {
        let pattern = read_pattern(&node)?;
        let name = pattern.section.require("name")?;
        if let Some(first) = names.insert(name.name()?, name.clone()) {
            return Err(name.duplicate_error(&first, "pattern", name.text()?));
        }
        patterns.push(pattern);
    }
    Ok(patterns)
}

/// Maximum number of values in all copies of a pattern.
const MAX_VALUES: usize = 1_000_000;

/// Number of scalars in a TOML value.
fn values(value: &DeValue<'_>) -> usize {
    match value {
        DeValue::Array(array) => array.iter().map(|value| values(value.get_ref())).sum(),
        DeValue::Table(table) => table.iter().map(|(_, value)| values(value.get_ref())).sum(),
        _ => 1,
    }
}

/// Whether a value, or one within it, refers to the previous copy.
fn names_previous(value: &DeValue<'_>) -> bool {
    match value {
        DeValue::String(text) => text.starts_with(PREVIOUS),
        DeValue::Array(array) => array.iter().any(|value| names_previous(value.get_ref())),
        DeValue::Table(table) => table.iter().any(|(_, value)| names_previous(value.get_ref())),
        _ => false,
    }
}

fn read_pattern<'d>(node: &Node<'d>) -> Result<Pattern<'d>, SceneError> {
    let section = node.section_as(node.title("pattern"))?;
    let lists = section.rows.keys.iter();
    let lists = lists.filter(|key| matches!(key.value_type, ValueType::List(..)));
    let lists: Vec<&str> = lists.map(|key| key.name).collect();
    section.require("name")?.name()?;
    let count_node = section.require("count")?;
    let count = count_node.whole_number()?;
    let mut names = Names::default();
    add_names(section.table, &mut names.bodies, &mut names.joints);
    let size: usize = lists.iter().filter_map(|name| section.get(name)).map(|list| values(list.value.get_ref())).sum();
    if size == 0 {
        let message = format!("nothing to repeat; allowed here: {}", lists.join(", "));
        return Err(section.error("", message));
    }
    if size.saturating_mul(count as usize) > MAX_VALUES {
        return Err(count_node
            .error(format!("{count} copies of {size} values are too many; allowed at most {MAX_VALUES} in all")));
    }
    let (centre, axis, angle) = match section.get("about") {
        None => (Vec3::zeros(), Vec3::z(), 0.0),
        Some(node) => {
            let about = node.section()?;
            let even = std::f64::consts::TAU / f64::from(count);
            (
                about.vector("point")?,
                about.require("axis")?.direction()?,
                about.get("angle").map_or(Ok(even), |node| node.number())?,
            )
        }
    };
    let step = match section.get("along") {
        None if section.get("about").is_none() => {
            return Err(section.error(
                "",
                "missing `about` or `along`; write for example `about = { axis = [0, 0, 1] }` or `along = \"100 0 0 mm\"`",
            ));
        }
        None => Vec3::zeros(),
        Some(node) => node.vector()?,
    };
    let names = Arc::new(names);
    let copies = (0..count)
        .map(|index| Instance {
            group: Group::Copy { number: index + 1, names: names.clone() },
            placement: Placement {
                centre,
                turn: turned(axis, angle * f64::from(index)),
                shift: step * f64::from(index),
            },
            outer: section.document.instance,
        })
        .collect();
    Ok(Pattern { section, copies })
}

/// Rotation by `angle`, rad, about the unit vector `axis`. `libm` gives start values the same bits on every platform.
fn turned(axis: Vec3, angle: f64) -> Quat {
    let (sin, cos) = libm::sincos(0.5 * angle);
    Quat::new_unchecked(nalgebra::Quaternion::from_parts(cos, axis * sin))
}

impl<'d> Pattern<'d> {
    /// Entries of the list `name`, repeated for each copy.
    ///
    /// # Errors
    /// The value is not a list.
    pub fn nodes(&'d self, name: &str) -> Result<Vec<Node<'d>>, SceneError> {
        let mut nodes = Vec::new();
        if let Some(list) = self.section.get(name) {
            let entries = list.entries()?;
            for copy in &self.copies {
                // The first copy has no previous one.
                let first = copy.number() == Some(1);
                for entry in entries.iter().filter(|entry| !first || !names_previous(entry.value.get_ref())) {
                    let mut node = entry.clone();
                    node.document.instance = Some(copy);
                    nodes.push(node);
                }
            }
        }
        Ok(nodes)
    }
}
