//! Number fields that keep their unit while they are typed in, and read a decimal comma.

use eframe::egui::DragValue;

use super::value;
use crate::units::{Dimension, parse_quantity, to_display};

/// A field for a time, s, as shown elsewhere in the window. A bare number has the unit that was shown.
pub fn time(seconds: &mut f64) -> DragValue<'_> {
    let shown = *seconds;
    let unit = value::time(shown).rsplit(' ').next().unwrap_or("s").to_owned();
    number(seconds, Dimension::Time, unit, value::time)
}

/// A field for a value in `unit`, which is the unit of its displayed form.
pub fn quantity<'a>(shown_value: &'a mut f64, dimension: Dimension, unit: &str) -> DragValue<'a> {
    let own = unit.to_owned();
    let words = move |value: f64| match &*own {
        "" => value::number(value, 6),
        unit => format!("{} {}", value::number(value, 6), value::typeset(unit)),
    };
    let unit = unit.to_owned();
    let drag = DragValue::new(shown_value).update_while_editing(false);
    let drag = drag.custom_formatter(move |value, _| words(value));
    drag.custom_parser(move |typed| {
        let typed = value::with_decimal_point(typed.trim());
        if let Ok(bare) = typed.parse() {
            return Some(bare);
        }
        parse_quantity(&typed, dimension).ok().map(|si| to_display(si, &unit))
    })
}

/// A field for an SI value that `words` writes; a bare number is in `unit`.
fn number(si: &mut f64, dimension: Dimension, unit: String, words: fn(f64) -> String) -> DragValue<'_> {
    let before = *si;
    let drag = DragValue::new(si).update_while_editing(false).custom_formatter(move |value, _| words(value));
    drag.custom_parser(move |typed| {
        // What was shown is rounded: leaving it as it is changes nothing.
        if typed.trim() == words(before) {
            return Some(before);
        }
        let typed = value::with_decimal_point(typed.trim());
        let typed = if typed.parse::<f64>().is_ok() { format!("{typed} {unit}") } else { typed };
        parse_quantity(&typed, dimension).ok()
    })
}
