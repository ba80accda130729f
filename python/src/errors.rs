//! Errors as the exceptions that `jointplay/errors.py` defines.

use jointplay_physics::simulate::{ChangeError, Stopped};
use jointplay_scene::{Scene, SceneError, SetError, find};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The exception `class` with the text `message` and the attributes `details`.
pub fn exception(py: Python<'_>, class: &str, message: &str, details: Option<&Bound<'_, PyDict>>) -> PyErr {
    let module = py.import("jointplay.errors");
    let created = module.and_then(|module| module.getattr(class)?.call((message,), details));
    created.map_or_else(|error| error, PyErr::from_value)
}

/// An argument that is invalid: `message` names it, its value and what is allowed.
pub fn option_error(py: Python<'_>, message: &str) -> PyErr {
    exception(py, "OptionError", message, None)
}

/// An invalid scene or parameter, with its location and the values allowed for its key; `scene` defines further keys.
pub fn scene_error(py: Python<'_>, scene: Option<&Scene>, error: &SceneError) -> PyErr {
    let details = || {
        let details = PyDict::new(py);
        details.set_item("file", &error.file)?;
        details.set_item("line", error.position.map(|(line, _)| line))?;
        details.set_item("column", error.position.map(|(_, column)| column))?;
        details.set_item("key", &error.key)?;
        details.set_item("value", error.value.as_deref())?;
        details.set_item("allowed", error.key.as_deref().and_then(|key| allowed(scene, key)))?;
        Ok(details)
    };
    details().map_or_else(|failed| failed, |details| exception(py, "SceneError", &error.to_string(), Some(&details)))
}

/// Values and units that the parameter `key` accepts, in words; `None` for a key that is not a parameter.
fn allowed(scene: Option<&Scene>, key: &str) -> Option<String> {
    if let Some(parameter) = scene.and_then(|scene| scene.parameter(key).ok()) {
        return Some(parameter.allowed());
    }
    let contact_key = key.strip_prefix("joint.").and_then(|rest| rest.rsplit_once('.'));
    let contact_key = contact_key.map(|(_, part)| format!("contact.{part}"));
    find(contact_key.as_deref().unwrap_or(key)).map(|parameter| parameter.allowed())
}

/// A live change that was refused.
pub fn set_error(py: Python<'_>, scene: &Scene, error: &SetError) -> PyErr {
    match error {
        SetError::Scene(error) => scene_error(py, Some(scene), error),
        SetError::Change(error) => change_error(py, error),
    }
}

/// A change that a running simulation refuses.
pub fn change_error(py: Python<'_>, error: &ChangeError) -> PyErr {
    option_error(py, &error.to_string())
}

/// A run that the divergence guard stopped.
pub fn stopped(py: Python<'_>, stopped: &Stopped) -> PyErr {
    let details = || {
        let details = PyDict::new(py);
        details.set_item("time", stopped.time)?;
        details.set_item("advice", stopped.advice.to_string())?;
        Ok(details)
    };
    details().map_or_else(|failed| failed, |details| exception(py, "Stopped", &stopped.to_string(), Some(&details)))
}
