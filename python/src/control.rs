//! What a controller sets and asks of a simulation: numbers of force elements, states, matrices.

use std::ops::Range;

use jointplay_physics::machine::{ElementNumber, Machine};
use jointplay_physics::simulate::{Coordinate, RestartError};
use jointplay_physics::words::Words;
use jointplay_scene::LiveScene;
use numpy::ndarray::Array2;
use numpy::{Element, PyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping, PyMappingProxy, PyString};

use crate::errors::{option_error, scene_error};
use crate::interpreter::guarded;
use crate::quantity::repr_of;

/// Element, number and value, SI.
pub type Control = (usize, ElementNumber, f64);

/// Force elements by index: name, kind in a scene file, and whether it acts on an angle.
pub fn elements(machine: &Machine) -> Vec<(&str, &'static str, bool)> {
    let on_angle = |element: &jointplay_physics::machine::Element| {
        element.coordinate().is_some_and(|coordinate| coordinate.freedom.turns())
    };
    machine.elements.iter().map(|element| (&element.name[..], element.describe().word, on_angle(element))).collect()
}

/// The number of an element with this name.
pub fn number(name: &str) -> Option<ElementNumber> {
    ElementNumber::of_word(name)
}

/// A number to set, if the run accepts it.
///
/// # Errors
/// `OptionError`.
pub fn checked(py: Python<'_>, live: &LiveScene, (element, name, value): (usize, &str, f64)) -> PyResult<Control> {
    let number = number(name).ok_or_else(|| option_error(py, &format!("no number of an element is called {name}")))?;
    live.check_control(element, number, value).map_err(|fault| option_error(py, &fault.to_string()))?;
    Ok((element, number, value))
}

/// Values by name of coordinate: a float, or an array for the pose of a body. Neither can be changed.
pub fn by_name<'py>(
    py: Python<'py>,
    coordinates: &[Coordinate],
    values: &[f64],
    range: impl Fn(&Coordinate) -> Range<usize>,
) -> PyResult<Bound<'py, PyMappingProxy>> {
    let all = PyDict::new(py);
    for coordinate in coordinates {
        match &values[range(coordinate)] {
            [single] => all.set_item(&coordinate.name, single)?,
            pose => all.set_item(&coordinate.name, read_only(PyArray1::from_slice(py, pose)))?,
        }
    }
    Ok(PyMappingProxy::new(py, all.as_mapping()))
}

/// Writes what is `given` as the argument `name` to `values`: numbers by name of coordinate, or all in the order of the state.
///
/// # Errors
/// `OptionError`.
pub fn take(
    (name, given): (&str, Option<&Bound<'_, PyAny>>),
    coordinates: &[Coordinate],
    values: &mut [f64],
    range: impl Fn(&Coordinate) -> Range<usize>,
) -> PyResult<()> {
    let Some(given) = given else {
        return Ok(());
    };
    let py = given.py();
    let wrong = |what: &str, length: usize| {
        let numbers = if length == 1 { "a number".to_owned() } else { format!("{length} numbers") };
        option_error(py, &format!("{what} = {}: expected {numbers}, SI", repr_of(given)))
    };
    let Ok(named) = given.cast::<PyMapping>() else {
        let numbers: Option<Vec<f64>> = given.extract().ok().filter(|numbers: &Vec<f64>| numbers.len() == values.len());
        values.copy_from_slice(&numbers.ok_or_else(|| wrong(name, values.len()))?);
        return Ok(());
    };
    for item in named.items()?.iter() {
        let (key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>) = item.extract()?;
        let key = key.cast::<PyString>().map_err(|_| option_error(py, &format!("{name}: a coordinate has a name")))?;
        let key = key.to_cow()?;
        let Some(coordinate) = coordinates.iter().find(|own| own.name == key) else {
            let names: Vec<&str> = coordinates.iter().map(|own| &own.name[..]).collect();
            let message = format!("{name}: no coordinate is called {key}; there are {}", names.join(", "));
            return Err(option_error(py, &message));
        };
        let place = &mut values[range(coordinate)];
        let numbers = match value.extract::<f64>() {
            Ok(single) => Some(vec![single]),
            Err(_) => value.extract().ok(),
        };
        let numbers = numbers.filter(|numbers| numbers.len() == place.len());
        place.copy_from_slice(&numbers.ok_or_else(|| wrong(&format!("{name}[{key}]"), place.len()))?);
    }
    Ok(())
}

/// Starts `run` again at `time` and `y`.
///
/// # Errors
/// `OptionError` for a state that the machine cannot have, `SceneError` if it cannot start there.
pub fn restart(py: Python<'_>, run: &mut LiveScene, time: f64, y: &[f64]) -> PyResult<()> {
    let outcome = guarded(py, || run.restart_at(time, y))?;
    match outcome {
        Err(RestartError::Start(error)) => {
            let scene = run.running();
            Err(scene_error(py, Some(scene), &scene.locate(&error)))
        }
        other => answer(py, other),
    }
}

/// An answer of the equations.
///
/// # Errors
/// `OptionError`.
pub fn answer<T>(py: Python<'_>, answer: Result<T, RestartError>) -> PyResult<T> {
    answer.map_err(|error| option_error(py, &format!("state: {error}")))
}

/// A matrix with these entries as an array.
pub fn matrix(
    py: Python<'_>,
    shape: (usize, usize),
    entry: impl Fn((usize, usize)) -> f64,
) -> Bound<'_, PyArray2<f64>> {
    PyArray2::from_owned_array(py, Array2::from_shape_fn(shape, entry))
}

/// An array that cannot be written: it is a copy, and writing to it would not change the simulation.
pub fn read_only<T: Element, D: numpy::ndarray::Dimension>(
    array: Bound<'_, PyArray<T, D>>,
) -> Bound<'_, PyArray<T, D>> {
    array.readwrite().make_nonwriteable();
    array
}
