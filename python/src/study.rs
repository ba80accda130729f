//! Studies of uncertain parameters: the runs and the numbers of `jointplay sensitivity` and `jointplay tolerance`.

use std::sync::Arc;

use jointplay_analysis::indices::{Bootstrap, SaltelliDesign};
use jointplay_analysis::lot::{Limit, Lot, PERCENTILES};
use jointplay_analysis::sampling::{Sampler, Sampling};
use jointplay_analysis::study::{Input, Output, RunSpan, StudyRuns, Uncertainty, inputs, outputs};
use jointplay_analysis::yields::{Estimate, reject_drivers};
use jointplay_physics::suggest::nearest;
use jointplay_physics::words::Words;
use jointplay_scene::Scene;
use numpy::PyArray2;
use numpy::ndarray::Array2;
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};

use crate::errors::option_error;
use crate::quantity::duration;
use crate::report::constant;
use crate::scene::PyScene;
use crate::sweep::records;

/// Uncertain parameters of a scene, and the numbers to which its runs are reduced.
#[pyclass(frozen, name = "Study", module = "jointplay._native")]
pub struct PyStudy {
    scene: Arc<Scene>,
    inputs: Vec<Input>,
    outputs: Vec<Output>,
    span: RunSpan,
}

/// An estimate as value, lower and upper end of its interval.
fn triple(estimate: &Estimate) -> (f64, f64, f64) {
    (estimate.value, estimate.low, estimate.high)
}

impl PyStudy {
    /// The outputs of a run for each of `rows`, which give every input a value, SI.
    fn results(
        &self,
        py: Python<'_>,
        rows: &[Vec<f64>],
        threads: usize,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Vec<Vec<f64>>> {
        let keys: Vec<String> = self.inputs.iter().map(|input| input.key.clone()).collect();
        let runs = StudyRuns::new(&self.scene, &keys, &self.outputs, self.span, rows);
        let runs = runs.map_err(|error| option_error(py, &error.to_string()))?;
        let records = records(py, runs.sweep(), threads, progress)?;
        let length = runs.sweep().layout().record_length();
        Ok(records.chunks_exact(length).map(|record| runs.outputs_of(record)).collect())
    }

    /// Values of the inputs at points of the unit cube, SI.
    fn values(&self, points: impl Iterator<Item = Vec<f64>>) -> Vec<Vec<f64>> {
        points.map(|point| self.inputs.iter().zip(point).map(|(input, u)| input.at(u)).collect()).collect()
    }
}

/// An array of rows of equal length.
fn array<'py>(py: Python<'py>, rows: &[Vec<f64>]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let shape = (rows.len(), rows.first().map_or(0, Vec::len));
    let values = Array2::from_shape_vec(shape, rows.concat());
    constant(py, values.map_err(|error| PyMemoryError::new_err(error.to_string()))?)
}

/// A limit `name` of `output`: a number, SI, or text.
fn limit(output: &Output, name: &str, value: &Bound<'_, PyAny>) -> PyResult<Option<f64>> {
    if value.is_none() {
        return Ok(None);
    }
    let read = match value.cast::<PyString>() {
        Ok(text) => output.read(&text.to_cow()?),
        Err(_) => value.extract::<f64>().map_err(|_| "expected a number in SI units, or text".to_owned()),
    };
    let wrong = |why: String| option_error(value.py(), &format!("{} limit of {}: {why}", name, output.name));
    read.map(Some).map_err(wrong)
}

#[pymethods]
impl PyStudy {
    /// Runs of `scene` over the parameters `over`, each a pattern with a distribution or with none, reduced to `output`.
    #[new]
    fn new(
        py: Python<'_>,
        scene: &PyScene,
        over: Vec<(String, Option<String>)>,
        output: &str,
        length: Option<Bound<'_, PyAny>>,
        start_after: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        scene.start(py)?;
        let scene = scene.scene.clone();
        let requested = over.into_iter().map(|(pattern, distribution)| Uncertainty {
            place: "over".to_owned(),
            pattern,
            distribution,
        });
        let requested: Vec<Uncertainty> = requested.collect();
        let wrong = |error: &dyn std::fmt::Display| option_error(py, &error.to_string());
        let inputs = inputs(&scene, &requested).map_err(|error| wrong(&error))?;
        if inputs.is_empty() {
            return Err(wrong(&"over: give at least one parameter"));
        }
        let outputs = outputs(&scene, output).map_err(|error| wrong(&format!("output: {error}")))?;
        let from = start_after.map(|value| duration("start_after", &value)).transpose()?;
        let span = match (length.map(|value| duration("duration", &value)).transpose()?, from) {
            (None, None) => RunSpan::of(&scene),
            (None, Some(_)) => return Err(wrong(&"start_after: give the duration, too")),
            (Some(duration), from) => RunSpan { duration, from: from.unwrap_or_default() },
        };
        if span.from >= span.duration {
            let (end, from) = (span.duration, span.from);
            return Err(wrong(&format!(
                "duration = {end}, start_after = {from}: the outputs must begin before the end"
            )));
        }
        Ok(Self { scene, inputs, outputs, span })
    }

    /// Key and value in the scene, SI, of each parameter.
    #[getter]
    fn inputs(&self) -> Vec<(&str, f64)> {
        self.inputs.iter().map(|input| (&input.key[..], input.nominal)).collect()
    }

    /// Name and unit of each output.
    #[getter]
    fn outputs(&self) -> Vec<(&str, &str)> {
        self.outputs.iter().map(|output| (&output.name[..], output.unit)).collect()
    }

    /// Length of each run and end of its transient, s.
    #[getter]
    fn span(&self) -> (f64, f64) {
        (self.span.duration, self.span.from)
    }

    /// Outputs at given values of the parameters.
    #[pyo3(signature = (rows, threads, progress=None))]
    fn run<'py>(
        &self,
        py: Python<'py>,
        rows: Vec<Vec<f64>>,
        threads: usize,
        progress: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let inputs = self.inputs.len();
        if let Some((i, row)) = rows.iter().enumerate().find(|(_, row)| row.len() != inputs) {
            let message = format!("values[{i}]: {} numbers are given for {inputs} parameters", row.len());
            return Err(option_error(py, &message));
        }
        array(py, &self.results(py, &rows, threads, progress)?)
    }

    /// First-order and total indices of every parameter, from `rows` rows of a Sobol sequence.
    #[pyo3(signature = (rows, seed, threads, progress=None))]
    fn indices<'py>(
        &self,
        py: Python<'py>,
        rows: usize,
        seed: u64,
        threads: usize,
        progress: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let design = SaltelliDesign::new(Sampling::Sobol, self.inputs.len(), rows, seed);
        let design = design.map_err(|error| option_error(py, &format!("rows = {rows}: {error}")))?;
        let values = self.values((0..design.points()).filter_map(|index| design.point(index)));
        let results = self.results(py, &values, threads, progress)?;
        let mut all = Vec::new();
        for o in 0..self.outputs.len() {
            let own: Vec<f64> = results.iter().map(|outputs| outputs[o]).collect();
            let entry = PyDict::new(py);
            match design.indices(&own, Bootstrap { seed, ..Bootstrap::default() }) {
                Ok(found) => {
                    entry.set_item("mean", found.mean)?;
                    entry.set_item("variance", found.variance)?;
                    entry.set_item("first", found.first.iter().map(triple).collect::<Vec<_>>())?;
                    entry.set_item("total", found.total.iter().map(triple).collect::<Vec<_>>())?;
                }
                Err(error) => entry.set_item("fault", error.to_string())?,
            }
            all.push(entry);
        }
        let found = PyDict::new(py);
        found.set_item("values", array(py, &values)?)?;
        found.set_item("results", array(py, &results)?)?;
        found.set_item("indices", all)?;
        Ok(found)
    }

    /// A lot of `units` units: which hold the `limits`, a lower and an upper one for each output, and what drives the rejects.
    #[pyo3(signature = (limits, units, sampling, seed, threads, progress=None))]
    fn lot<'py>(
        &self,
        py: Python<'py>,
        limits: Vec<(Bound<'py, PyAny>, Bound<'py, PyAny>)>,
        units: usize,
        sampling: &str,
        seed: u64,
        threads: usize,
        progress: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let wrong = |error: &dyn std::fmt::Display| option_error(py, &error.to_string());
        let Some(sampling) = Sampling::of_word(sampling) else {
            let (near, all) = (nearest(sampling, Sampling::WORDS.iter().copied()), Sampling::WORDS.join(", "));
            return Err(wrong(&format!("sampling = {sampling:?}: no such sampling{near}; there are: {all}")));
        };
        if limits.len() != self.outputs.len() {
            let names: Vec<&str> = self.outputs.iter().map(|output| &output.name[..]).collect();
            return Err(wrong(&format!("limits: give one for each of {}, not for a pattern", names.join(", "))));
        }
        let mut ends = Vec::new();
        for (output, (lower, upper)) in self.outputs.iter().zip(&limits) {
            let [lower, upper] = [limit(output, "lower", lower)?, limit(output, "upper", upper)?];
            if lower.is_none() && upper.is_none() || lower.zip(upper).is_some_and(|(lower, upper)| lower >= upper) {
                return Err(wrong(&format!("limits of {}: give a lower one, or a higher upper one", output.name)));
            }
            ends.push(Limit { lower, upper });
        }
        let sampler = Sampler::new(sampling, self.inputs.len(), units, seed);
        let sampler = sampler.map_err(|error| wrong(&format!("units = {units}: {error}")))?;
        let values = self.values((0..sampler.points()).filter_map(|index| sampler.point(index)));
        let lot = Lot::new(self.results(py, &values, threads, progress)?, &ends).map_err(|error| wrong(&error))?;
        let mut qualities = Vec::new();
        for (o, limit) in ends.iter().enumerate() {
            let found = lot.quality(o, limit).map_err(|error| wrong(&error))?;
            let own = PyDict::new(py);
            own.set_item("yield", triple(&found.yielded))?;
            own.set_item("mean", found.mean)?;
            own.set_item("deviation", found.deviation)?;
            for (p, value) in PERCENTILES.iter().zip(&found.percentiles) {
                own.set_item(format!("percentile_{:.0}", 100.0 * p), value.as_ref().map(triple))?;
            }
            own.set_item("cp", found.capability.as_ref().and_then(|capability| capability.cp))?;
            own.set_item("cpk", found.capability.as_ref().map(|capability| triple(&capability.cpk)))?;
            qualities.push(own);
        }
        let columns: Vec<Vec<f64>> =
            (0..self.inputs.len()).map(|i| values.iter().map(|row| row[i]).collect()).collect();
        let drivers = reject_drivers(&columns, &lot.accepted).map_err(|error| wrong(&error))?;
        let drivers = drivers.map(|drivers| {
            drivers.iter().map(|driver| (driver.mean_shift, driver.distance, driver.p_value)).collect::<Vec<_>>()
        });
        let found = PyDict::new(py);
        found.set_item("yield", triple(&lot.yielded))?;
        found.set_item("accepted", &lot.accepted)?;
        found.set_item("qualities", qualities)?;
        found.set_item("drivers", drivers)?;
        found.set_item("values", array(py, &values)?)?;
        found.set_item("results", array(py, &lot.outputs)?)?;
        Ok(found)
    }
}
