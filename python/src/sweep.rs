//! Sweeps: the points that `jointplay sweep` computes, block by block or all at once.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use jointplay_analysis::axis::Axis;
use jointplay_analysis::crossing::Crossing;
use jointplay_analysis::design::{Design, Start};
use jointplay_analysis::point::{Plan, Protocol, Span};
use jointplay_analysis::statistic::ChannelStatistic;
use jointplay_analysis::sweep::Sweep;
use jointplay_physics::suggest::nearest;
use jointplay_scene::Scene;
use numpy::ndarray::Array2;
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};

use crate::errors::{exception, option_error, scene_error};
use crate::interpreter::{STEPS_BETWEEN_CHECKS, detached, report_progress};
use crate::quantity::{duration, to_python, to_text};
use crate::report::constant;
use crate::scene::PyScene;

/// Time between two checks for Ctrl-C while threads compute.
const CHECK_INTERVAL: Duration = Duration::from_millis(50);

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
    option(options, name)?.map(|value| value.extract()).transpose()
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
    for value in values.try_iter()? {
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

fn span(py: Python<'_>, scene: &Scene, options: &Bound<'_, PyDict>) -> PyResult<Span> {
    let invalid = |message: &str| Err(option_error(py, message));
    let (periods, discard) = (count(options, "periods")?, count(options, "discard")?);
    let (length, from) = (time(options, "duration")?, time(options, "from_")?);
    if let Some(section) = option(options, "section")? {
        let text: String = section.extract()?;
        let crossing = Crossing::parse(scene, &text);
        let crossing = crossing.map_err(|error| option_error(py, &format!("section = {text:?}: {error}")))?;
        let (Some(count), Some(discard), Some(duration), None) = (count(options, "crossings")?, discard, length, from)
        else {
            return invalid(
                "section: give the number of crossings with crossings and discard, and duration to end the search",
            );
        };
        return Ok(Span::Crossings { crossing, count, discard, duration });
    }
    match (periods, length) {
        (Some(periods), None) => {
            let Some(discard) = discard else {
                return invalid("periods: give the number of initial periods to discard, with discard");
            };
            let phase: f64 = option(options, "phase")?.map_or(Ok(0.0), |phase| phase.extract())?;
            if !(0.0..1.0).contains(&phase) {
                return invalid(&format!(
                    "phase = {phase}: a drive phase is a fraction of the period, from 0 to below 1"
                ));
            }
            let exponent = option(options, "exponent")?.map_or(Ok(true), |exponent| exponent.extract())?;
            let interval = time(options, "period")?;
            if interval == Some(0.0) {
                return invalid("period = 0: the time must be above 0");
            }
            Ok(Span::Sections { plan: Plan { periods, discard, phase, exponent }, interval })
        }
        (None, Some(duration)) => {
            let from = from.unwrap_or_default();
            if discard.is_some() {
                return invalid("discard counts periods or crossings; with duration alone, from_ ends the transient");
            }
            if from >= duration {
                return invalid(&format!(
                    "duration = {duration}, from_ = {from}: the statistics must begin before the end"
                ));
            }
            Ok(Span::Duration { duration, from })
        }
        _ => invalid("a sweep needs either periods and discard, or duration"),
    }
}

#[pymethods]
impl PySweep {
    /// A sweep of `scene`. `vary` has a key and its values for each varied parameter; `options` are those of `jointplay.Sweep`.
    /// All points are checked first, unless `tried`: they were checked elsewhere.
    #[new]
    fn new(
        py: Python<'_>,
        scene: &PyScene,
        vary: Vec<(String, Bound<'_, PyAny>)>,
        options: &Bound<'_, PyDict>,
        tried: bool,
    ) -> PyResult<Self> {
        let scene = &*scene.scene;
        let invalid = |message: String| option_error(py, &message);
        let axes = vary.iter().map(|(key, values)| axis(scene, key, values)).collect::<PyResult<Vec<_>>>()?;
        let starts: Vec<String> = option(options, "start")?.map_or(Ok(Vec::new()), |starts| starts.extract())?;
        let starts = starts.iter().map(|word| start(py, word)).collect::<PyResult<Vec<_>>>()?;
        let zip = option(options, "zip")?.map_or(Ok(false), |zip| zip.extract())?;
        let combine = if zip { Design::zipped } else { Design::crossed };
        let design = combine(scene, axes, &starts).map_err(|error| invalid(format!("{error:#}")))?;
        let keep = match option(options, "keep")? {
            None => Vec::new(),
            Some(keep) => {
                let text: String = keep.extract()?;
                let list = ChannelStatistic::parse_list(scene, &text);
                list.map_err(|error| invalid(format!("keep: {error}; Scene.channels() lists the channels")))?
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

    /// Computes all blocks on `threads` threads: one row per point. `progress` is called with the completed fraction.
    #[pyo3(signature = (threads, progress=None))]
    fn run<'py>(
        &self,
        py: Python<'py>,
        threads: usize,
        progress: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        rows(py, records(py, &self.sweep, threads, progress)?, self.sweep.layout().record_length())
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

/// The records of all points of `sweep`, computed on `threads` threads. `progress` is called with the completed fraction.
///
/// # Errors
/// `KeyboardInterrupt`, what `progress` raises, `MemoryError`, and `InternalError` for a panic.
pub fn records(
    py: Python<'_>,
    sweep: &Sweep,
    threads: usize,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Vec<f64>> {
    let (points, length) = (sweep.design().points(), sweep.layout().record_length());
    let mut records = Vec::new();
    if points.checked_mul(length).is_none_or(|count| records.try_reserve_exact(count).is_err()) {
        return Err(PyMemoryError::new_err(format!("{points} points of {length} values do not fit into memory")));
    }
    records.resize(points * length, f64::NAN);
    let progress: Option<Py<PyAny>> = progress.map(Bound::unbind);
    let report = |fraction: f64| {
        Python::attach(|py| report_progress(py, progress.as_ref().map(|progress| progress.bind(py)), fraction))
    };
    let outcome = detached(py, || {
        compute(sweep, threads, report, |block, own| {
            let points = sweep.design().block(block);
            records[points.start * length..points.end * length].copy_from_slice(own);
        })
    })?;
    match outcome {
        Ok(()) => Ok(records),
        Err(EarlyEnd::Raised(error)) => Err(error),
        Err(EarlyEnd::Panicked) => {
            let message =
                "internal error: a thread of the sweep panicked. This is a bug in the program; please report it.";
            Err(exception(py, "InternalError", message, None))
        }
    }
}

/// Reason why a sweep ended early.
enum EarlyEnd {
    /// Ctrl-C, or an error of the progress function.
    Raised(PyErr),
    Panicked,
}

/// Computes every block of `sweep` and passes its records to `receive`. `report` is called regularly with the completed
/// fraction; an error that it returns ends the sweep.
fn compute(
    sweep: &Sweep,
    threads: usize,
    report: impl Fn(f64) -> PyResult<()>,
    mut receive: impl FnMut(usize, &[f64]),
) -> Result<(), EarlyEnd> {
    let blocks = sweep.design().blocks();
    let next = AtomicUsize::new(0);
    let stop = AtomicBool::new(false);
    let work = |block: usize| {
        let mut run = sweep.begin(block);
        while !run.is_done() {
            if stop.load(Ordering::Relaxed) {
                return None;
            }
            run.advance(STEPS_BETWEEN_CHECKS);
        }
        Some(run.records())
    };
    let worker = |send: mpsc::Sender<Option<(usize, Vec<f64>)>>| {
        while !stop.load(Ordering::Relaxed) {
            let block = next.fetch_add(1, Ordering::Relaxed);
            if block >= blocks {
                return;
            }
            let result = match catch_unwind(AssertUnwindSafe(|| work(block))) {
                Ok(None) => return,
                Ok(Some(records)) => Some((block, records)),
                Err(_) => None,
            };
            // The receiver outlives the threads.
            let _ = send.send(result);
        }
    };
    thread::scope(|scope| {
        let (send, results) = mpsc::channel();
        for _ in 0..threads.clamp(1, blocks) {
            let send = send.clone();
            scope.spawn(|| worker(send));
        }
        drop(send);
        let mut done = 0;
        let outcome = loop {
            match results.recv_timeout(CHECK_INTERVAL) {
                Ok(Some((block, records))) => {
                    receive(block, &records);
                    done += 1;
                }
                Ok(None) => break Err(EarlyEnd::Panicked),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break Ok(()),
            }
            if let Err(error) = report(done as f64 / blocks as f64) {
                break Err(EarlyEnd::Raised(error));
            }
        };
        stop.store(true, Ordering::Relaxed);
        outcome
    })
}

/// An array with one row per point.
fn rows(py: Python<'_>, records: Vec<f64>, length: usize) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let points = records.len() / length;
    let values = Array2::from_shape_vec((points, length), records);
    constant(py, values.map_err(|error| PyMemoryError::new_err(error.to_string()))?)
}
