//! User-defined parameters of a scene file.

use super::document::{Node, Section, lists};
use super::error::place_of;
use super::include::check_values;
use super::instance::Instance;
use super::numbers::{MAX_NUMBER, OWN_GROUP, row_of_file};
use super::*;
use jointplay_physics::units::{all_units, same_unit, split_unit};

/// Reads every `[[parameter]]` in file order; a value may use the parameters defined before it.
///
/// # Errors
/// An invalid or repeated parameter.
pub(super) fn read_user_parameters(files: &[Section<'_>]) -> Result<Vec<&'static Parameter>, SceneError> {
    let mut all: Vec<(&Parameter, bool)> = Vec::new();
    files.iter().try_for_each(check_values)?;
    let nodes = lists(files, "parameter", Vec::new())?;
    for (i, node) in nodes.iter().enumerate() {
        let own = read_parameter(node, files[0].rows, &nodes[i + 1..])?;
        if let Some(first) = all.iter().position(|(other, _)| other.key == own.0.key) {
            let [name, first] =
                [node, &nodes[first]].map(|node| node.section_as(node.title("parameter"))?.require("name"));
            let name = name?;
            return Err(name.duplicate_error(&first?, "parameter", &name.name()?));
        }
        all.push(own);
    }
    Ok(all.into_iter().filter_map(|(row, adjustable)| adjustable.then_some(row)).collect())
}

/// The error for an invalid `value` that uses one of the parameters `later`; `None` if it uses none. A file that is included twice
/// has two parameters of a name, of which the value sees only the one with its own prefix.
fn defined_later(value: &Node<'_>, later: &[Node<'_>]) -> Option<SceneError> {
    let prefix = |node: &Node<'_>| node.document.instance.map_or("", Instance::prefix).to_owned();
    let own = prefix(value);
    let named = |node: &Node<'_>| {
        let name = node.section().ok()?.require("name").ok()?.text().ok()?.to_owned();
        let local = prefix(node) == own || prefix(node).is_empty();
        local.then_some(name)
    };
    let letters = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let words: Vec<&str> = value.scalar().ok()?.split(|c| !letters(c)).collect();
    let name = later.iter().filter_map(named).find(|name| words.contains(&&**name))?;
    Some(value.error(format!("uses the parameter {name}, which is defined after it: define that one first")))
}

/// Reads a `[[parameter]]` of a file with the keys `file`, before the parameters `later`: its row, and whether it is adjustable.
fn read_parameter(
    node: &Node<'_>,
    file: &FileTable,
    later: &[Node<'_>],
) -> Result<(&'static Parameter, bool), SceneError> {
    let title = node.title("parameter");
    let document = node.document;
    let section = node.section_as(title.clone())?;
    let name_node = section.require("name")?;
    let full = name_node.name()?;
    let name = name_node.identifier("a parameter")?;
    let own_node = section.require("value")?;
    let passed = document.include.and_then(|include| include.values.get(name));
    let value_node = passed.unwrap_or(&own_node);
    let text = value_node.scalar()?;
    let unit = section.get("unit").map(|node| node.text()).transpose()?;
    // The dimension is that of `unit`, or else of the unit written in the value of this file.
    let own_text = own_node.scalar()?;
    let unit_text = unit.unwrap_or_else(|| split_unit(own_text));
    let found = all_units().find(|(of, ..)| same_unit(of, unit_text));
    let (unit, dimension) = match found {
        Some((unit, dimension, _)) => (unit, dimension),
        None if unit_text.is_empty() => ("", Dimension::None),
        None => {
            let (at, key) = match section.get("unit") {
                Some(node) => (node, "unknown unit"),
                None => (
                    own_node,
                    "its unit cannot be told from an expression: give it with `unit`, for example `unit = \"mm\"`",
                ),
            };
            return Err(at.error(key));
        }
    };
    let prefix = document.instance.map_or("", Instance::prefix);
    let key = section.get("key").map(|node| Ok(format!("{prefix}{}", read_key(&node, file)?)));
    let key = key.unwrap_or(Ok(title))?;
    let is_integer = section.get("whole").map_or(Ok(false), |node| node.flag())?;
    if let (true, Some(node), false) = (is_integer, section.get("whole"), dimension == Dimension::None) {
        return Err(node.error("a whole number has no unit"));
    }
    let value_node = value_node.with_key(key.clone());
    let pair = |key: &str| section.get(key).map(|node| read_range(&node, dimension)).transpose();
    let words = |key: &str| section.get(key).map(|node| node.text()).transpose();
    let label = words("label")?.unwrap_or(&full);
    let help = words("help")?.unwrap_or("A parameter of this scene.");
    let equation = words("equation")?.unwrap_or("Wherever the scene file uses it");
    let group = words("group")?.unwrap_or(OWN_GROUP);
    let range = pair("range")?;
    let default = parse_quantity(text, dimension).ok();
    let around = match default.unwrap_or_default() {
        0.0 => (-1.0, 1.0),
        default => ((2.0 * default).min(0.0), (2.0 * default).max(0.0)),
    };
    let (min, max) = range.unwrap_or((-MAX_NUMBER, MAX_NUMBER));
    let slider = pair("slider")?.or(range).unwrap_or(around);
    let kind = match is_integer {
        true => Kind::Count { min: min as u64, max: max as u64 },
        false => Kind::Number { dimension, min, max, display: unit, slider, logarithmic: false },
    };
    let given = default.map_or(Value::Unset, |default| kind.value_of(default));
    let shown = visible_line;
    let row = row_of_file([&key, &shown(label), &shown(help), &shown(equation), &shown(group)], kind, given);
    let refuse = |error: ValueError| {
        let place = passed.map(|_| {
            let (line, _) = place_of(document.text, section.offset());
            let file = document.file.map_or_else(String::new, |file| format!(" of {}", visible_line(file)));
            format!("; the parameter is defined in line {line}{file}")
        });
        value_node.error(format!("{error}{}", place.unwrap_or_default()))
    };
    let scalar = value_node.scalar()?;
    let reads = || row.read(scalar).map(|_| ());
    if is_integer && parse_quantity(scalar, dimension).is_ok() {
        // Before the general limit of numbers, which is wider.
        reads().map_err(refuse)?;
    }
    let value = value_node.quantity(dimension).map_err(|error| defined_later(&value_node, later).unwrap_or(error))?;
    let checked = if is_integer { reads() } else { row.check(&Value::Number(value)) };
    checked.map_err(refuse)?;
    document.reading.define_parameter(&full, value, dimension);
    // An expression without a range is an ordinary number, not an adjustable parameter.
    Ok((row, default.is_some() || range.is_some()))
}

/// Reads a range: two quantities of this dimension, the smaller first.
fn read_range(node: &Node<'_>, dimension: Dimension) -> Result<(f64, f64), SceneError> {
    let [least, most] = node.quantities::<2>(dimension)?;
    if least >= most {
        return Err(node.error("the first value must be below the second"));
    }
    Ok((least, most))
}

/// Reads the key by which a parameter is changed: dot-separated names, the first of which is not a key of the `file`.
fn read_key(node: &Node<'_>, file: &FileTable) -> Result<String, SceneError> {
    let key = node.text()?;
    let letters = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
    let name = |part: &str| !part.is_empty() && part.chars().all(letters);
    let is_file_key = key.split('.').next().is_some_and(|first| file.key(first, None).is_some());
    if key.len() > 40 || is_file_key || !key.split('.').all(name) {
        return Err(node.error(
            "is not a key; allowed 1 to 40 letters (a to z), digits, `_`, `-`, and dots between them, and not first a key of the file",
        ));
    }
    Ok(key.to_owned())
}
