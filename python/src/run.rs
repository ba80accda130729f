//! A run from t = 0 with rows at equal intervals, as `jointplay run` makes it.

use std::collections::BTreeMap;

use jointplay_analysis::row_times::{RowReader, RowTimes};
use jointplay_physics::simulate::{ChannelInfo, Impact, chosen_channels};
use jointplay_scene::LiveScene;
use numpy::ndarray::Array2;
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::option_error;
use crate::interpreter::{STEPS_BETWEEN_CHECKS, detached, report_progress};
use crate::quantity::duration as read_duration;
use crate::report;
use crate::scene::{PyScene, channels_at_start};

/// Number of intervals if their length is not given.
const INTERVALS: f64 = 1000.0;

/// Why a run ended before its time, and what to try.
type Fault = (String, Option<String>);

/// A run in progress and its rows.
struct Recorder {
    live: LiveScene,
    duration: f64,
    reader: RowReader,
    channels: Vec<ChannelInfo>,
    /// One column after another, each of `capacity` values.
    values: Vec<f64>,
    capacity: usize,
    /// Rows so far.
    rows: usize,
    impacts: Vec<Impact>,
    /// What has worn off by direction until this time, s, at which a step ends.
    walls_from: f64,
    walls: Option<report::Walls>,
}

impl Recorder {
    /// Takes at most `steps` steps, and returns whether the run is over. A row never shortens a step.
    fn advance(&mut self, steps: u32) -> Result<bool, Fault> {
        for _ in 0..steps {
            let Self { live, reader, values, rows, capacity, .. } = self;
            let read = reader.read(live, |row| {
                for (column, value) in row.iter().enumerate() {
                    values[column * *capacity + *rows] = *value;
                }
                *rows += 1;
            });
            read.map_err(|error| (error.to_string(), None))?;
            if self.live.time() >= self.duration {
                return Ok(true);
            }
            let end = if self.walls.is_none() { self.walls_from.min(self.duration) } else { self.duration };
            let stepped = self.live.step_until(end);
            stepped.map_err(|stopped| (stopped.to_string(), Some(stopped.advice.to_string())))?;
            self.impacts.extend(self.live.take_impacts());
            if self.walls.is_none() && self.live.time() >= self.walls_from {
                self.walls = Some(report::walls(&self.live));
            }
        }
        Ok(false)
    }
}

/// Runs `scene` for `duration` with a row every `every`, and returns all results. `channels` are names or
/// patterns; by default, those that `jointplay run` writes.
#[pyfunction]
#[pyo3(signature = (scene, duration, every=None, channels=Vec::new(), progress=None, worn=BTreeMap::new(), walls_from=0.0))]
#[allow(clippy::too_many_arguments, reason = "those of the Python function")]
pub fn run<'py>(
    py: Python<'py>,
    scene: &PyScene,
    duration: &Bound<'py, PyAny>,
    every: Option<&Bound<'py, PyAny>>,
    channels: Vec<String>,
    progress: Option<&Bound<'py, PyAny>>,
    worn: report::Walls,
    walls_from: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let duration = read_duration("duration", duration)?;
    let every = match every {
        Some(every) => {
            let interval = read_duration("every", every)?;
            if interval > duration && duration > 0.0 {
                let message =
                    format!("every = {interval} s is longer than duration = {duration} s: there would be one row only");
                return Err(option_error(py, &message));
            }
            interval
        }
        None if duration > 0.0 => duration / INTERVALS,
        None => 1.0,
    };
    let positive = || option_error(py, "every = 0: the interval between rows must be greater than 0");
    let times = RowTimes::new(duration, every).ok_or_else(positive)?;
    let mut live = scene.start(py)?;
    set_walls(py, &mut live, &worn)?;
    let (all, _) = detached(py, || channels_at_start(&mut live))?;
    let failed = |error| option_error(py, &format!("channels: {error}; Scene.channels lists them"));
    let channels = chosen_channels(all, &channels).map_err(failed)?;
    let capacity = usize::try_from(times.last()).unwrap_or(usize::MAX).saturating_add(1);
    let values = allocate(capacity, channels.len())?;
    if live.load_peaks().is_none() {
        live.track_load_peaks();
    }
    let readings = channels.iter().map(|channel| (channel.name.clone(), channel.reading())).collect();
    let reader = RowReader::new(times, 0, readings);
    let walls = (walls_from <= 0.0).then(|| report::walls(&live));
    let impacts = Vec::new();
    let mut run = Recorder { live, duration, reader, channels, values, capacity, rows: 0, impacts, walls_from, walls };
    let fault = loop {
        match detached(py, || run.advance(STEPS_BETWEEN_CHECKS))? {
            Ok(true) => break None,
            Ok(false) => report_progress(py, progress, run.live.time() / duration)?,
            Err(fault) => break Some(fault),
        }
    };
    report_progress(py, progress, if fault.is_none() { 1.0 } else { run.live.time() / duration })?;
    results_dict(py, run, fault)
}

/// Index of the joint with play with this name.
fn joint_named(py: Python<'_>, live: &LiveScene, name: &str) -> PyResult<usize> {
    let joint = live.machine().loose_joints.iter().position(|joint| joint.name == *name);
    joint.ok_or_else(|| option_error(py, &format!("worn: no joint with play named `{name}`")))
}

/// Starts with walls that have worn by direction.
fn set_walls(py: Python<'_>, live: &mut LiveScene, worn: &report::Walls) -> PyResult<()> {
    for (name, walls) in worn {
        let joint = joint_named(py, live, name)?;
        live.set_profiles(joint, walls).map_err(|why| option_error(py, &format!("worn: {why}")))?;
    }
    Ok(())
}

/// Worn depths of the walls of `joint`, m, after they wear on from `walls` by `factor` times `growth`, m.
#[pyfunction]
pub fn wear_on(
    py: Python<'_>,
    scene: &PyScene,
    joint: &str,
    walls: Vec<Vec<f64>>,
    growth: Vec<Vec<f64>>,
    factor: f64,
) -> PyResult<Vec<Vec<f64>>> {
    let mut live = scene.start(py)?;
    set_walls(py, &mut live, &BTreeMap::from([(joint.to_owned(), walls)]))?;
    let j = joint_named(py, &live, joint)?;
    let machine = live.machine();
    let clearance = machine.loose_joints[j].contact.clearance;
    let mut worn = live.state().worn_walls(machine, j);
    if !worn.iter().map(|wall| wall.depths().len()).eq(growth.iter().map(Vec::len)) {
        return Err(option_error(py, "growth: of other walls than those that have worn"));
    }
    detached(py, || {
        worn.iter_mut().zip(&growth).for_each(|(wall, growth)| wall.extrapolate(growth, factor, clearance));
    })?;
    Ok(worn.iter().map(|wall| wall.depths().to_vec()).collect())
}

fn allocate(rows: usize, columns: usize) -> PyResult<Vec<f64>> {
    let mut values = Vec::new();
    let count = rows.checked_mul(columns);
    if count.is_none_or(|count| values.try_reserve_exact(count).is_err()) {
        return Err(PyMemoryError::new_err(format!(
            "{rows} rows of {columns} channels do not fit into memory; use fewer channels or a longer interval `every`"
        )));
    }
    values.resize(rows * columns, f64::NAN);
    Ok(values)
}

fn results_dict<'py>(py: Python<'py>, run: Recorder, fault: Option<Fault>) -> PyResult<Bound<'py, PyDict>> {
    let live = &run.live;
    let all = PyDict::new(py);
    let channels: Vec<_> = run.channels.iter().map(|c| (&c.name[..], &c.column[..], c.unit, c.help)).collect();
    all.set_item("channels", channels)?;
    all.set_item("rows", run.rows)?;
    all.set_item("end", live.time())?;
    all.set_item("hash", report::hash_text(live.state_hash()))?;
    all.set_item("doubts", report::doubts(live))?;
    all.set_item("ledger", report::ledger(py, live)?)?;
    all.set_item("statistics", report::statistics(py, live)?)?;
    all.set_item("worn_walls", report::wall_arrays(py, &report::walls(live))?)?;
    all.set_item("worn_walls_before", report::wall_arrays(py, &run.walls.unwrap_or_default())?)?;
    all.set_item("impacts", report::impacts(py, live, &run.impacts)?)?;
    let (fault, advice) = fault.unzip();
    all.set_item("fault", fault)?;
    all.set_item("advice", advice.flatten())?;
    let shape = (run.channels.len(), run.capacity);
    let values = Array2::from_shape_vec(shape, run.values);
    // Cannot fail: the shape is that of the allocation.
    let values = values.map_err(|error| PyMemoryError::new_err(error.to_string()))?;
    all.set_item("values", report::constant(py, values)?)?;
    Ok(all)
}
