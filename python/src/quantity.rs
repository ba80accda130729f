//! Conversion between Python numbers and strings and the values of parameters and times.

use jointplay_physics::simulate::MAX_RUN_DURATION;
use jointplay_physics::units::{Dimension, parse_quantity};
use jointplay_scene::{Kind, Parameter, Value};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyString};

use crate::errors::option_error;

/// A time `name` of a run, s: a number in seconds, or text such as `20ms`; not negative, and not beyond the longest run.
///
/// # Errors
/// `OptionError`.
pub fn duration(name: &str, value: &Bound<'_, PyAny>) -> PyResult<f64> {
    let py = value.py();
    let wrong = |why: &str| Err(option_error(py, &format!("{name} = {}: {why}", repr_of(value))));
    let seconds = if let Ok(text) = value.cast::<PyString>() {
        match parse_quantity(&text.to_cow()?, Dimension::Time) {
            Ok(seconds) => seconds,
            Err(error) => return wrong(&error.to_string()),
        }
    } else if let Some(seconds) = number(value) {
        seconds
    } else {
        return wrong("expected a number of seconds, or text with a unit such as \"20ms\"");
    };
    if !seconds.is_finite() || seconds < 0.0 {
        return wrong("the time must be a number and not negative");
    }
    if seconds > MAX_RUN_DURATION {
        return wrong(&format!("the time must be at most {MAX_RUN_DURATION:e} s"));
    }
    Ok(seconds)
}

/// `value` as messages show it.
pub fn repr_of(value: &Bound<'_, PyAny>) -> String {
    value.repr().map_or_else(|_| "?".to_owned(), |text| text.to_string())
}

/// A real number; booleans do not count as numbers.
fn number(value: &Bound<'_, PyAny>) -> Option<f64> {
    if value.is_instance_of::<PyBool>() { None } else { value.extract().ok() }
}

/// `value` as a user writes it for `parameter`: text unchanged, a number in SI units; `None` stands for the value of the file.
///
/// # Errors
/// `OptionError`: neither text nor a number of this parameter.
pub fn to_text(parameter: &Parameter, key: &str, value: &Bound<'_, PyAny>) -> PyResult<Option<String>> {
    if value.is_none() {
        return Ok(None);
    }
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(Some(text.to_cow()?.into_owned()));
    }
    let own = match parameter.kind {
        Kind::Number { .. } => number(value).filter(|number| number.is_finite()).map(Value::Number),
        Kind::Count { .. } if value.is_instance_of::<PyBool>() => None,
        Kind::Count { .. } => value.extract().ok().map(Value::Count),
        Kind::Choice(_) => None,
    };
    let wrong = || {
        let message =
            format!("{key} = {}: expected text or a number in SI units; {}", repr_of(value), parameter.allowed());
        option_error(value.py(), &message)
    };
    own.map(|own| Some(parameter.write(&own))).ok_or_else(wrong)
}

/// A value for Python: SI units, a whole number, a word, or `None`.
pub fn to_python(py: Python<'_>, value: &Value) -> PyResult<Py<PyAny>> {
    Ok(match value {
        Value::Number(number) => number.into_pyobject(py)?.into_any().unbind(),
        Value::Count(count) => count.into_pyobject(py)?.into_any().unbind(),
        Value::Choice(word) => word.into_pyobject(py)?.into_any().unbind(),
        Value::Unset => py.None(),
    })
}
