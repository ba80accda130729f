//! Parameter rows for the numbers and the user-defined parameters of a scene file.

use std::collections::BTreeMap;
use std::sync::{LazyLock, Mutex, PoisonError};

use super::field::Access;
use super::file_number::FileNumber;
use super::parameters::{Kind, Parameter, Scope};
use super::value::Value;

/// Larger than any number in a scene file.
pub(super) const MAX_NUMBER: f64 = 1e13;

/// Group of the parameters of a file that names none; a window shows them first.
pub const OWN_GROUP: &str = "Machine";

/// Row of a number of the file. Limits that depend on other numbers are checked when the scene is read again.
pub(super) fn row_of_number(key: &str, number: &FileNumber) -> &'static Parameter {
    let kind = Kind::Number {
        dimension: number.dimension,
        min: number.range.0.max(-MAX_NUMBER),
        max: number.range.1.min(MAX_NUMBER),
        display: number.unit,
        slider: (-1.0, 1.0),
        logarithmic: false,
    };
    row_of_file(
        [key, key, "A number of the scene file.", "Wherever the scene file uses it", OWN_GROUP],
        kind,
        Value::Unset,
    )
}

/// Row with this key, label, help, equation and group. Rows live as long as the program, like those of the table; equal ones are
/// shared, so that a change of value adds none.
pub(super) fn row_of_file(
    [key, label, help, equation, group]: [&str; 5],
    kind: Kind,
    default: Value,
) -> &'static Parameter {
    static ROWS: LazyLock<Mutex<BTreeMap<String, &'static Parameter>>> = LazyLock::new(Mutex::default);
    let identity = format!("{key} {label} {help} {equation} {group} {kind:?} {default:?}");
    let mut rows = ROWS.lock().unwrap_or_else(PoisonError::into_inner);
    rows.entry(identity).or_insert_with(|| {
        let text = |text: &str| -> &'static str { Box::leak(text.into()) };
        Box::leak(Box::new(Parameter {
            key: text(key),
            access: Access::Number,
            label: text(label),
            group: text(group),
            kind,
            default,
            scope: Scope::Own,
            at_reset: true,
            help: text(help),
            equation: text(equation),
        }))
    })
}
