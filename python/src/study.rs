//! Runs of a scene at given values of its parameters, reduced to a few numbers, and the rows in which each parameter varies
//! alone: those of the window's panel "What play costs".

use std::fmt::Display;
use std::path::PathBuf;
use std::sync::Arc;

use jointplay_analysis::study::{
    OneAtATimePlan, Output, RunSpan, StudyRuns, matching, outputs, read_unchecked, real_parameter,
};
use jointplay_physics::units::si_unit;
use jointplay_scene::{Kind, Scene, provenance};
use numpy::PyArray2;
use numpy::ndarray::Array2;
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;

use crate::WRITER;
use crate::errors::option_error;
use crate::interpreter::{guarded, report_progress};
use crate::quantity::duration;
use crate::report::constant;
use crate::scene::PyScene;
use crate::sweep::records;

/// Parameters of a scene, and the numbers to which its runs are reduced.
#[pyclass(frozen, name = "Study", module = "jointplay._native")]
pub struct PyStudy {
    scene: Arc<Scene>,
    keys: Vec<String>,
    /// Value in the scene, SI, and SI unit of each parameter.
    inputs: Vec<(f64, &'static str)>,
    outputs: Vec<Output>,
    /// Index of the requested entry from which each output comes; a pattern gives several.
    entries: Vec<usize>,
    span: RunSpan,
}

fn invalid(py: Python<'_>, error: &dyn Display) -> PyErr {
    option_error(py, &format!("{error:#}"))
}

/// Keys of the numeric parameters of `scene` that match `pattern`, or else of the numbers of its file that do.
#[pyfunction]
pub fn matching_keys(py: Python<'_>, scene: &PyScene, pattern: &str) -> PyResult<Vec<String>> {
    guarded(py, || matching(&scene.scene, pattern))?.map_err(|error| invalid(py, &error))
}

/// A number in a unit of the parameter `key` of `scene`, SI; it need not be in the range of the parameter.
#[pyfunction]
pub fn read_number(py: Python<'_>, scene: &PyScene, key: &str, text: &str) -> PyResult<f64> {
    guarded(py, || read_unchecked(&scene.scene, key, text))?.map_err(|error| invalid(py, &error))
}

/// A time of the option `name`, s: a number or text with a unit.
#[pyfunction]
pub fn read_duration(name: &str, value: &Bound<'_, PyAny>) -> PyResult<f64> {
    duration(name, value)
}

/// Provenance of results about `scene`, as every output of the program carries it, in JSON.
#[pyfunction]
pub fn provenance_of(scene: &PyScene) -> String {
    serde_json::Value::Object(provenance(WRITER, &scene.scene)).to_string()
}

#[pymethods]
impl PyStudy {
    /// Runs of `scene` at values of its parameters `keys`, reduced to the outputs that `entries` name.
    #[new]
    fn new(
        py: Python<'_>,
        scene: &PyScene,
        keys: Vec<String>,
        entries: Vec<String>,
        length: Option<Bound<'_, PyAny>>,
        from: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        scene.start(py)?;
        let scene = scene.scene.clone();
        let named = |text: &str| {
            guarded(py, || outputs(&scene, text))?.map_err(|error| invalid(py, &format!("output: {error}")))
        };
        let mut sources = Vec::new();
        for (i, entry) in entries.iter().enumerate() {
            sources.extend(named(entry)?.iter().map(|_| i));
        }
        let outputs = named(&entries.join(","))?;
        let input = |key: &String| {
            let (parameter, nominal) = real_parameter(&scene, key).map_err(|error| invalid(py, &error))?;
            Ok(match parameter.kind {
                Kind::Number { dimension, .. } => (nominal, si_unit(dimension)),
                Kind::Count { .. } | Kind::Choice(_) => (nominal, ""),
            })
        };
        let inputs = keys.iter().map(input).collect::<PyResult<_>>()?;
        let from = from.map(|value| duration("from_", &value)).transpose()?;
        let span = match (length.map(|value| duration("duration", &value)).transpose()?, from) {
            (None, None) => RunSpan::of(&scene),
            (None, Some(_)) => return Err(invalid(py, &"from_: give the duration, too")),
            (Some(duration), from) => RunSpan { duration, from: from.unwrap_or_default() },
        };
        if span.from >= span.duration {
            let (end, from) = (span.duration, span.from);
            return Err(invalid(
                py,
                &format!("duration = {end}, from_ = {from}: the outputs must begin before the end"),
            ));
        }
        Ok(Self { scene, keys, inputs, outputs, entries: sources, span })
    }

    /// Value in the scene, SI, and SI unit of each parameter.
    #[getter]
    fn inputs(&self) -> Vec<(f64, &str)> {
        self.inputs.clone()
    }

    /// Name and unit of each output, and the index of the entry that named it.
    #[getter]
    fn outputs(&self) -> Vec<(&str, &str, usize)> {
        let outputs = self.outputs.iter().zip(&self.entries);
        outputs.map(|(output, &entry)| (&output.name[..], output.unit, entry)).collect()
    }

    /// Length of each run and end of its transient, s.
    #[getter]
    fn span(&self) -> (f64, f64) {
        (self.span.duration, self.span.from)
    }

    /// A value of output `o` with its unit, SI.
    fn read_output(&self, py: Python<'_>, o: usize, text: &str) -> PyResult<f64> {
        self.outputs[o].read(text).map_err(|error| invalid(py, &error))
    }

    /// Values of all parameters in the one-at-a-time runs: those of the scene, then each parameter at its lower and at its upper
    /// end.
    fn alone(&self, py: Python<'_>, ends: Vec<[f64; 2]>) -> PyResult<Vec<Vec<f64>>> {
        let ranges: Vec<(String, [f64; 2])> = self.keys.iter().cloned().zip(ends).collect();
        let plan = guarded(py, || OneAtATimePlan::new(&self.scene, &ranges))?;
        Ok(plan.map_err(|error| invalid(py, &error))?.rows())
    }

    /// Runs at `rows`, values of the parameters, SI: one row of outputs per run, SI, and after them how it ended: 0 at its end,
    /// 1 stopped by the divergence guard, 2 not started. Finished runs are in the file `record`, from which the same call resumes.
    #[pyo3(signature = (rows, threads, progress=None, record=None))]
    fn run<'py>(
        &self,
        py: Python<'py>,
        rows: Vec<Vec<f64>>,
        threads: usize,
        progress: Option<Bound<'py, PyAny>>,
        record: Option<PathBuf>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        if let Some((i, row)) = rows.iter().enumerate().find(|(_, row)| row.len() != self.keys.len()) {
            let (given, parameters) = (row.len(), self.keys.len());
            return Err(invalid(py, &format!("values[{i}]: {given} numbers are given for {parameters} parameters")));
        }
        guarded(py, || report_progress(py, progress.as_ref(), 0.0))??;
        let runs = guarded(py, || StudyRuns::new(&self.scene, &self.keys, &self.outputs, self.span, &rows))?;
        let runs = runs.map_err(|error| invalid(py, &error))?;
        let records = records(py, runs.sweep(), threads, progress, record.as_deref())?;
        let of_run = |record: &[f64]| {
            let mut all = runs.outputs_of(record);
            all.push(runs.status_of(record));
            all
        };
        let results: Vec<f64> = records.chunks_exact(runs.sweep().layout().record_length()).flat_map(of_run).collect();
        let results = Array2::from_shape_vec((rows.len(), self.outputs.len() + 1), results);
        constant(py, results.map_err(|error| PyMemoryError::new_err(error.to_string()))?)
    }
}
