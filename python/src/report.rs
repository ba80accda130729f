//! Results of a simulation so far, as plain Python data.

use std::collections::BTreeMap;

use jointplay_analysis::impact_row::{COLUMNS, row};
use jointplay_physics::simulate::{Impact, Simulation};
use numpy::ndarray::Array2;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// An array that is read-only in Python and owns its memory.
pub fn constant(py: Python<'_>, values: Array2<f64>) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let array = PyArray2::from_owned_array(py, values);
    array.try_readwrite()?.make_nonwriteable();
    Ok(array)
}

/// State hash as all outputs of the program write it: 16 hexadecimal digits.
pub fn hash_text(hash: u64) -> String {
    format!("{hash:016x}")
}

/// Impacts: names of the joints with play, to which the first column refers, and of the sites of each, to which the last one does;
/// names of the columns; an array with one row per column.
pub type Impacts<'py> = (Vec<(String, Vec<String>)>, Vec<&'static str>, Bound<'py, PyArray2<f64>>);

/// The impacts of a simulation.
pub fn impacts<'py>(py: Python<'py>, simulation: &Simulation, impacts: &[Impact]) -> PyResult<Impacts<'py>> {
    let joints = simulation.machine().loose_joints.iter().map(|joint| (joint.name.clone(), joint.sites())).collect();
    let mut values = Array2::zeros((COLUMNS.len(), impacts.len()));
    for (i, impact) in impacts.iter().enumerate() {
        for (column, value) in row(impact).into_iter().enumerate() {
            values[(column, i)] = value;
        }
    }
    Ok((joints, COLUMNS.to_vec(), constant(py, values)?))
}

/// Reasons to doubt the results so far.
pub fn doubts(simulation: &Simulation) -> Vec<String> {
    simulation.doubts().iter().map(ToString::to_string).collect()
}

/// Energy exchanged so far, J; `None` where `solver.energy_ledger` is off.
pub fn ledger<'py>(py: Python<'py>, simulation: &Simulation) -> PyResult<Option<Bound<'py, PyDict>>> {
    let Some(ledger) = simulation.ledger() else {
        return Ok(None);
    };
    let all = PyDict::new(py);
    for (name, value) in ledger.terms() {
        all.set_item(name, value)?;
    }
    Ok(Some(all))
}

/// Worn depths by direction: by name of joint, of each of its walls that wear so, m.
pub type Walls = BTreeMap<String, Vec<Vec<f64>>>;

/// Those of the present state.
pub fn walls(simulation: &Simulation) -> Walls {
    let joints = simulation.machine().loose_joints.iter().enumerate();
    let walls =
        joints.map(|(j, joint)| (joint.name.clone(), simulation.state().profiles(j).map(<[f64]>::to_vec).collect()));
    walls.filter(|(_, walls): &(_, Vec<_>)| !walls.is_empty()).collect()
}

/// The same as arrays.
pub fn wall_arrays<'py>(py: Python<'py>, walls: &Walls) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    for (name, walls) in walls {
        let arrays: Vec<_> = walls.iter().map(|wall| PyArray1::from_slice(py, wall)).collect();
        all.set_item(name, arrays)?;
    }
    Ok(all)
}

/// Counters so far, and for each joint with play its largest normal force, N, when it occurred, s, the number of contacts
/// begun, and how far each of its plays has worn wider, m, by which volume, m^3.
pub fn statistics<'py>(py: Python<'py>, simulation: &Simulation) -> PyResult<Bound<'py, PyDict>> {
    let statistics = simulation.statistics();
    let all = PyDict::new(py);
    all.set_item("steps", statistics.steps)?;
    all.set_item("evaluations", statistics.evaluations)?;
    all.set_item("rejected", statistics.rejected)?;
    let joints = PyDict::new(py);
    for (j, joint) in simulation.machine().loose_joints.iter().enumerate() {
        let (force, time) = simulation.peak(j);
        let own = PyDict::new(py);
        own.set_item("peak_normal", force)?;
        own.set_item("peak_time", time)?;
        own.set_item("impacts", statistics.joints[j].impacts)?;
        own.set_item("worn", simulation.state().worn(j))?;
        own.set_item("worn_volume", simulation.state().worn_volumes(simulation.machine(), j))?;
        joints.set_item(&joint.name, own)?;
    }
    all.set_item("joints", joints)?;
    Ok(all)
}
