//! Sweeps: the points that `jointplay sweep` computes, block by block or all at once.

use std::fmt::Display;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use jointplay_analysis::axis::Axis;
use jointplay_analysis::design::{Design, Start};
use jointplay_analysis::point::{Protocol, Span};
use jointplay_analysis::span_request::SpanRequest;
use jointplay_analysis::statistic::ChannelStatistic;
use jointplay_analysis::sweep::Sweep;
use jointplay_analysis::sweep_run::{RunFault, SweepRun};
use jointplay_analysis::sweep_settings::settings;
use jointplay_physics::suggest::nearest;
use jointplay_physics::units::{Dimension, parse_quantity};
use jointplay_scene::Scene;
use numpy::ndarray::Array2;
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::{PyMemoryError, PyOSError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use serde_json::Value as Json;

use crate::WRITER;
use crate::errors::{option_error, scene_error};
use crate::interpreter::{STEPS_BETWEEN_CHECKS, detached, report_progress};
use crate::quantity::{duration, repr_of, to_python, to_text};
use crate::report::constant;
use crate::scene::PyScene;

/// A sweep of which any block can be computed.
#[pyclass(frozen, name = "Sweep", module = "jointplay._native")]
pub struct PySweep {
    sweep: Sweep,
}

/// The option `name` of `options`, unless it is missing or `None`.
fn option<'py>(options: &Bound<'py, PyDict>, name: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
    Ok(options.get_item(name)?.filter(|value| !value.is_none()))
}

fn count(options: &Bound<'_, PyDict>, name: &str) -> PyResult<Option<usize>> {
    let whole = |value: Bound<'_, PyAny>| {
        let wrong = |_| option_error(value.py(), &format!("{name} = {}: expected a whole number", repr_of(&value)));
        value.extract().map_err(wrong)
    };
    option(options, name)?.map(whole).transpose()
}

fn time(options: &Bound<'_, PyDict>, name: &str) -> PyResult<Option<f64>> {
    option(options, name)?.map(|value| duration(name, &value)).transpose()
}

fn axis(scene: &Scene, key: &str, values: &Bound<'_, PyAny>) -> PyResult<Axis> {
    let py = values.py();
    let invalid = |message: String| option_error(py, &message);
    if let Ok(text) = values.cast::<PyString>() {
        return Axis::parse(scene, &format!("{key}={}", text.to_cow()?)).map_err(|error| invalid(format!("{error:#}")));
    }
    let parameter = scene.parameter(key).map_err(|error| scene_error(py, Some(scene), &error))?;
    let mut listed = Vec::new();
    let entries = values.try_iter().map_err(|_| {
        let given = repr_of(values);
        invalid(format!("{key} = {given}: expected a list of numbers or texts, or text such as \"0.1mm..1mm:10\""))
    })?;
    for value in entries {
        let value = value?;
        let text = to_text(parameter, key, &value)?;
        let text = text.ok_or_else(|| invalid(format!("{key} = None: a varied parameter needs values")))?;
        listed.push(parameter.read(&text).map_err(|error| invalid(format!("{key} = {text}: {error}")))?);
    }
    Axis::listed(scene, key, listed).map_err(|error| invalid(format!("{error:#}")))
}

fn start(py: Python<'_>, word: &str) -> PyResult<Start> {
    let known = || Start::ALL.into_iter().map(Start::word);
    Start::ALL.into_iter().find(|start| start.word() == word).ok_or_else(|| {
        let (near, all) = (nearest(word, known()), known().collect::<Vec<_>>().join(", "));
        option_error(py, &format!("start = {word:?}: no such start{near}; there are: {all}"))
    })
}

/// A phase of the drive: a fraction of the period, or text with the unit of an angle.
fn phase(value: &Bound<'_, PyAny>) -> PyResult<f64> {
    let wrong = |why: &dyn Display| option_error(value.py(), &format!("phase = {}: {why}", repr_of(value)));
    let Ok(text) = value.cast::<PyString>() else {
        return value.extract().map_err(|_| wrong(&"expected a fraction of the period, or text such as \"90deg\""));
    };
    let text = text.to_cow()?;
    let angle = || parse_quantity(&text, Dimension::Angle).map(|angle| angle / std::f64::consts::TAU);
    text.trim().parse().or_else(|_| angle()).map_err(|error| wrong(&error))
}

fn span(py: Python<'_>, scene: &Scene, options: &Bound<'_, PyDict>) -> PyResult<Span> {
    let request = SpanRequest {
        periods: count(options, "periods")?,
        discard: count(options, "discard")?,
        phase: option(options, "phase")?.map(|value| phase(&value)).transpose()?,
        period: time(options, "period")?,
        no_exponent: option(options, "exponent")?.map_or(Ok(false), |exponent| exponent.extract().map(|e: bool| !e))?,
        duration: time(options, "duration")?,
        from: time(options, "from_")?,
        section: option(options, "section")?.map(|section| section.extract()).transpose()?,
        crossings: count(options, "crossings")?,
    };
    request.span(scene).map_err(|error| option_error(py, &format!("{error:#}")))
}

#[pymethods]
impl PySweep {
    /// A sweep of `scene`. `vary` has a key and its values for each varied parameter: of all combinations, or with `is_table` one
    /// for each point. `options` are those of `jointplay.Sweep`. All points are checked first, unless `tried`: they were checked
    /// elsewhere.
    #[new]
    fn new(
        py: Python<'_>,
        scene: &PyScene,
        vary: Vec<(String, Bound<'_, PyAny>)>,
        is_table: bool,
        options: &Bound<'_, PyDict>,
        tried: bool,
    ) -> PyResult<Self> {
        let scene = &*scene.scene;
        let invalid = |message: String| option_error(py, &message);
        let axes = vary.iter().map(|(key, values)| axis(scene, key, values)).collect::<PyResult<Vec<_>>>()?;
        let starts: Vec<String> = option(options, "start")?.map_or(Ok(Vec::new()), |starts| starts.extract())?;
        let starts = starts.iter().map(|word| start(py, word)).collect::<PyResult<Vec<_>>>()?;
        let combine = if is_table { Design::of_columns } else { Design::crossed };
        let design = combine(scene, axes, &starts).map_err(|error| invalid(format!("{error:#}")))?;
        let keep = match option(options, "keep")? {
            None => Vec::new(),
            Some(keep) => {
                let text: String = keep.extract()?;
                let list = ChannelStatistic::parse_list(scene, &text);
                list.map_err(|error| invalid(format!("keep: {error}; Scene.channels lists the channels")))?
            }
        };
        let protocol = Protocol { span: span(py, scene, options)?, keep, joints: false };
        let sweep = detached(py, || {
            let scene = scene.clone();
            if tried { Sweep::untried(scene, design, protocol) } else { Sweep::new(scene, design, protocol) }
        })?;
        Ok(Self { sweep: sweep.map_err(|error| invalid(format!("{error:#}")))? })
    }

    /// Number of blocks, which can be computed in any order and anywhere.
    #[getter]
    fn blocks(&self) -> usize {
        self.sweep.design().blocks()
    }

    /// Number of points.
    #[getter]
    fn points(&self) -> usize {
        self.sweep.design().points()
    }

    /// Shape of an array with one value per point.
    #[getter]
    fn shape(&self) -> Vec<usize> {
        self.sweep.design().shape()
    }

    /// Key and values of each varied parameter: numbers in SI units, or words.
    fn axes<'py>(&self, py: Python<'py>) -> PyResult<Vec<(&str, Bound<'py, PyAny>)>> {
        let axes = self.sweep.design().axes().iter();
        let values = |axis: &Axis| match axis.words() {
            Some(words) => words.into_pyobject(py).map(Bound::into_any),
            None => Ok(PyArray1::from_vec(py, axis.numbers().collect()).into_any()),
        };
        axes.map(|axis| Ok((axis.key(), values(axis)?))).collect()
    }

    /// Name of each array of the result, whether its values are integers, and its number of values per point.
    fn columns(&self) -> Vec<(&str, bool, usize)> {
        let layout = self.sweep.layout();
        layout.columns().iter().map(|column| (&column.name[..], column.whole, layout.values_in(column))).collect()
    }

    /// Whether an array has one value per section of a point.
    fn is_per_section(&self, name: &str) -> bool {
        self.sweep.layout().columns().iter().any(|column| column.name == name && column.per_section)
    }

    /// Points of a block: the first, and the one after the last.
    fn block(&self, py: Python<'_>, block: usize) -> PyResult<(usize, usize)> {
        self.check_block(py, block)?;
        let points = self.sweep.design().block(block);
        Ok((points.start, points.end))
    }

    /// Key and value of each varied parameter at a point.
    fn settings(&self, py: Python<'_>, point: usize) -> PyResult<Vec<(String, Py<PyAny>)>> {
        self.check_point(py, point)?;
        let settings = self.sweep.design().settings(point).into_iter();
        settings.map(|(key, value)| Ok((key.to_owned(), to_python(py, &value)?))).collect()
    }

    /// Description of a point by its parameters.
    fn describe(&self, py: Python<'_>, point: usize) -> PyResult<String> {
        self.check_point(py, point)?;
        Ok(self.sweep.describe(point))
    }

    /// Computes one block: one row per point.
    fn compute<'py>(&self, py: Python<'py>, block: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.check_block(py, block)?;
        let mut run = self.sweep.begin(block);
        while !run.is_done() {
            detached(py, || run.advance(STEPS_BETWEEN_CHECKS))?;
            py.check_signals()?;
        }
        rows(py, run.records(), self.sweep.layout().record_length())
    }

    /// Computes all blocks on `threads` threads: one row per point. `progress` is called with the completed fraction. Finished
    /// blocks are in the file `record`, from which the same sweep resumes.
    #[pyo3(signature = (threads, progress=None, record=None))]
    fn run<'py>(
        &self,
        py: Python<'py>,
        threads: usize,
        progress: Option<Bound<'py, PyAny>>,
        record: Option<PathBuf>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let records = records(py, &self.sweep, threads, progress, record.as_deref())?;
        rows(py, records, self.sweep.layout().record_length())
    }
}

impl PySweep {
    fn check_block(&self, py: Python<'_>, block: usize) -> PyResult<()> {
        if block < self.blocks() {
            return Ok(());
        }
        Err(option_error(py, &format!("block = {block}: the sweep has blocks 0 to {}", self.blocks() - 1)))
    }

    fn check_point(&self, py: Python<'_>, point: usize) -> PyResult<()> {
        if point < self.points() {
            return Ok(());
        }
        Err(option_error(py, &format!("point = {point}: the sweep has points 0 to {}", self.points() - 1)))
    }
}

/// The records of all points of `sweep`, computed on `threads` threads. `progress` is called with the completed fraction. Finished
/// blocks are in the file `record`, which holds those of an interrupted run.
///
/// # Errors
/// `KeyboardInterrupt`, what `progress` raises, `MemoryError`, `OSError` and `OptionError` about the file, and `InternalError` for a
/// panic.
pub fn records(
    py: Python<'_>,
    sweep: &Sweep,
    threads: usize,
    progress: Option<Bound<'_, PyAny>>,
    record: Option<&Path>,
) -> PyResult<Vec<f64>> {
    let progress: Option<Py<PyAny>> = progress.map(Bound::unbind);
    let report = |fraction: f64| {
        Python::attach(|py| report_progress(py, progress.as_ref().map(|progress| progress.bind(py)), fraction))
    };
    let outcome = detached(py, || {
        let mut run = match record {
            None => SweepRun::new(sweep)?,
            Some(path) => SweepRun::resumed(sweep, path, &Json::Object(settings(WRITER, sweep)))?,
        };
        let mut raised = None;
        run.compute(threads, |points| match report(points as f64 / sweep.design().points() as f64) {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                raised = Some(error);
                ControlFlow::Break(())
            }
        })?;
        Ok((raised, run.into_records()))
    })?;
    match outcome {
        Ok((None, records)) => Ok(records),
        Ok((Some(error), _)) => Err(error),
        Err(fault @ RunFault::NoMemory { .. }) => Err(PyMemoryError::new_err(fault.to_string())),
        Err(fault @ RunFault::OtherSettings { .. }) => Err(option_error(py, &fault.to_string())),
        Err(fault) => Err(PyOSError::new_err(fault.to_string())),
    }
}

/// An array with one row per point.
fn rows(py: Python<'_>, records: Vec<f64>, length: usize) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let points = records.len() / length;
    let values = Array2::from_shape_vec((points, length), records);
    constant(py, values.map_err(|error| PyMemoryError::new_err(error.to_string()))?)
}
