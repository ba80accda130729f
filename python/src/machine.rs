//! A machine described by Python's dictionaries and lists, as the text of a scene file. Plain numbers are in SI units.

use jointplay_physics::units::{Dimension, exact_quantity, si_unit};
use jointplay_scene::{FILE, FileKey, FileTable, Kind, Value, ValueType, Variants, find};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyString};
use toml::{Table, Value as Toml};

use crate::errors::option_error;

/// Context of a value: the whole machine, and whether the coordinate that the value belongs to is an angle, if known.
#[derive(Clone, Copy)]
struct Context<'a, 'py> {
    machine: &'a Bound<'py, PyDict>,
    is_angle: Option<bool>,
}

/// Scene file text with the sections in `machine`.
///
/// # Errors
/// `OptionError` that locates a value without a TOML form, or a number whose unit depends on a joint missing from `machine`.
pub fn text_of(machine: &Bound<'_, PyDict>) -> PyResult<String> {
    let table = table(machine, Some(&FILE), "", Context { machine, is_angle: None })?;
    toml::to_string(&table).map_err(|error| option_error(machine.py(), &error.to_string()))
}

/// `rows` describe the keys of the table; `place` names it in errors.
fn table(own: &Bound<'_, PyDict>, rows: Option<&FileTable>, place: &str, context: Context<'_, '_>) -> PyResult<Table> {
    let variant = rows.and_then(|rows| variant(own, rows));
    let is_angle = has_angle_coordinate(own, context.machine).or(context.is_angle);
    let mut all = Table::new();
    for (key, value) in own.iter() {
        let key: String = key.extract()?;
        let place = if place.is_empty() { key.clone() } else { format!("{place}.{key}") };
        if value.is_none() {
            continue;
        }
        // Unknown keys are refused later, when the text is read; that error suggests the nearest key.
        let row = rows.and_then(|rows| row(rows, &key, variant));
        // Drives and initial values of a joint with two coordinates have an entry for each, named after the coordinate.
        let is_angle = is_angle.or_else(|| is_angle_name(&key));
        let row = row.map(|row| (row, *row.value_type(is_angle == Some(true))));
        all.insert(key, to_toml(&value, row, &place, Context { is_angle, ..context })?);
    }
    Ok(all)
}

fn row(rows: &FileTable, key: &str, variant: Option<&'static str>) -> Option<&'static FileKey> {
    rows.key(key, variant).or_else(|| rows.also.and_then(|also| also.key(key, variant)))
}

/// The word that selects the variant of a table.
fn variant(own: &Bound<'_, PyDict>, rows: &FileTable) -> Option<&'static str> {
    match rows.variants? {
        Variants::Word(by, _) => {
            let word: String = own.get_item(by).ok()??.extract().ok()?;
            rows.words().iter().copied().find(|known| *known == word)
        }
        Variants::Presence(words) => words.iter().copied().find(|word| own.contains(word).unwrap_or(false)),
    }
}

/// Whether the coordinate of a joint, or of the joint on which a force element acts, is an angle; `None` if `own` does not say.
fn has_angle_coordinate(own: &Bound<'_, PyDict>, machine: &Bound<'_, PyDict>) -> Option<bool> {
    let word = |of: &Bound<'_, PyDict>, key: &str| -> Option<String> { of.get_item(key).ok()??.extract().ok() };
    let of_kind = |joint: &Bound<'_, PyDict>| match word(joint, "kind")?.as_str() {
        "prismatic" => Some(false),
        "revolute" => Some(true),
        _ => None,
    };
    if let Some(coordinate) = word(own, "coordinate") {
        return is_angle_name(&coordinate);
    }
    let Some(name) = word(own, "joint") else {
        return of_kind(own);
    };
    let joints = machine.get_item("joint").ok()??;
    let mut joints = joints.try_iter().ok()?.filter_map(|joint| joint.ok()?.cast_into::<PyDict>().ok());
    of_kind(&joints.find(|joint| word(joint, "name").as_deref() == Some(&*name))?)
}

/// Whether the coordinate of this name is an angle; `None` for another word.
fn is_angle_name(word: &str) -> Option<bool> {
    match word {
        "position" => Some(false),
        "angle" | "child_angle" => Some(true),
        _ => None,
    }
}

/// `value` as TOML; for a known key, in the form that its row and type require.
fn to_toml(
    value: &Bound<'_, PyAny>,
    row: Option<(&FileKey, ValueType)>,
    place: &str,
    context: Context<'_, '_>,
) -> PyResult<Toml> {
    let wrong = |why: &str| Err(option_error(value.py(), &format!("{place}: {why}")));
    if let Ok(own) = value.cast::<PyDict>() {
        return Ok(Toml::Table(table(own, row.and_then(|(row, _)| row.table()), place, context)?));
    }
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(Toml::String(text.to_cow()?.into_owned()));
    }
    if let Ok(flag) = value.cast::<PyBool>() {
        return Ok(Toml::Boolean(flag.is_true()));
    }
    if let Ok(entries) = value.try_iter() {
        let mut all = Vec::new();
        for (i, entry) in entries.enumerate() {
            let entry = entry?;
            let is_list = !entry.is_instance_of::<PyString>() && entry.try_iter().is_ok();
            let of_entry = row.map(|(row, value_type)| (row, entry_of(value_type, i, is_list)));
            all.push(to_toml(&entry, of_entry, &format!("{place}[{i}]"), context)?);
        }
        return Ok(Toml::Array(all));
    }
    let is_integer =
        value.is_instance_of::<PyInt>() || !value.is_instance_of::<PyFloat>() && value.extract::<i64>().is_ok();
    let Ok(number) = value.extract::<f64>() else {
        return wrong("expected a number, text, a list or a dictionary");
    };
    if !number.is_finite() {
        return wrong("expected a finite number");
    }
    if let Some((row, value_type)) = row {
        if let Some(dimension) = dimension(value_type) {
            if row.on_hinge.is_some() && context.is_angle.is_none() {
                return wrong("the unit depends on the joint: give it, as in \"0.1 rad\"");
            }
            return Ok(Toml::String(exact_quantity(number, si_unit(dimension), dimension)));
        }
        if let ValueType::Parameter(key) = value_type
            && let Some(parameter) = find(key).filter(|parameter| matches!(parameter.kind, Kind::Number { .. }))
        {
            return Ok(Toml::String(parameter.write(&Value::Number(number))));
        }
    }
    if is_integer { Ok(Toml::Integer(value.extract()?)) } else { Ok(Toml::Float(number)) }
}

/// Type of entry `i` of a list of the type `value_type`; the entry may be a list itself.
fn entry_of(value_type: ValueType, i: usize, is_list: bool) -> ValueType {
    match value_type {
        ValueType::Vector(dimension, range) => ValueType::Number(dimension, range),
        ValueType::Numbers(_, dimension) => ValueType::Number(dimension, (f64::NEG_INFINITY, f64::INFINITY)),
        ValueType::Vectors(dimension, _) => ValueType::Numbers(3, dimension),
        ValueType::Pairs(dimensions, _) if !is_list => ValueType::Numbers(1, dimensions[i.min(1)]),
        other => other,
    }
}

/// Dimension of a number of the type `value_type`; `None` for values written without a unit.
fn dimension(value_type: ValueType) -> Option<Dimension> {
    match value_type {
        ValueType::Number(dimension, _) | ValueType::Numbers(1, dimension) if !si_unit(dimension).is_empty() => {
            Some(dimension)
        }
        _ => None,
    }
}
