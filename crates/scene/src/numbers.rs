//! Parameter rows for the numbers and user-defined parameters of a scene file.

use std::collections::BTreeMap;
use std::sync::{LazyLock, Mutex, PoisonError};

use super::field::Access;
use super::given::{FileNumber, UserParameter};
use super::parameters::{Kind, Parameter, Scope};
use super::value::Value;
use jointplay_physics::units::Dimension;

/// Row of a number of the file. The reader checks the allowed range when the scene is read again.
pub(super) fn row_of_number(key: &str, number: &FileNumber) -> &'static Parameter {
    interned(Row {
        key,
        label: key,
        help: "A number of the scene file.",
        dimension: number.dimension,
        unit: number.unit,
        range: (-LARGEST, LARGEST),
        slider: (-1.0, 1.0),
        default: None,
    })
}

/// Row of a user-defined parameter.
pub(super) fn row_of_own(own: &UserParameter) -> &'static Parameter {
    let default = own.default.unwrap_or_default();
    let around = match default {
        0.0 => (-1.0, 1.0),
        _ => ((2.0 * default).min(0.0), (2.0 * default).max(0.0)),
    };
    interned(Row {
        key: &own.key,
        label: &own.label,
        help: &own.help,
        dimension: own.dimension,
        unit: own.unit,
        range: own.range.unwrap_or((-LARGEST, LARGEST)),
        slider: own.range.unwrap_or(around),
        default: own.default,
    })
}

/// Larger than any number in a scene file: the reader enforces the actual limits.
const LARGEST: f64 = 1e13;

/// Contents of a row; equal rows are shared.
struct Row<'a> {
    key: &'a str,
    label: &'a str,
    help: &'a str,
    dimension: Dimension,
    unit: &'static str,
    range: (f64, f64),
    slider: (f64, f64),
    default: Option<f64>,
}

/// Interned rows live as long as the program, like those of the table. A change of value adds none.
fn interned(row: Row<'_>) -> &'static Parameter {
    static ROWS: LazyLock<Mutex<BTreeMap<String, &'static Parameter>>> = LazyLock::new(Mutex::default);
    let bits = |(a, b): (f64, f64)| (a.to_bits(), b.to_bits());
    let identity = format!(
        "{} {} {} {:?} {} {:?} {:?} {}",
        row.key,
        row.label,
        row.help,
        row.dimension,
        row.unit,
        bits(row.range),
        bits(row.slider),
        row.default.unwrap_or(f64::NAN).to_bits(),
    );
    let mut rows = ROWS.lock().unwrap_or_else(PoisonError::into_inner);
    rows.entry(identity).or_insert_with(|| {
        let text = |text: &str| -> &'static str { Box::leak(text.into()) };
        Box::leak(Box::new(Parameter {
            key: text(row.key),
            access: Access::Number,
            label: text(row.label),
            group: "Machine",
            kind: Kind::Number {
                dimension: row.dimension,
                min: row.range.0,
                max: row.range.1,
                display: row.unit,
                slider: row.slider,
                logarithmic: false,
            },
            default: row.default.map_or(Value::Unset, Value::Number),
            scope: Scope::Own,
            at_reset: true,
            help: text(row.help),
            equation: "Wherever the scene file uses it",
        }))
    })
}
