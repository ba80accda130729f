//! Studies of uncertain parameters: the runs and the numbers of `jointplay sensitivity` and `jointplay tolerance`.

use std::sync::Arc;

use jointplay_analysis::lot::{Limit, PERCENTILES, Quality};
use jointplay_analysis::sampling::Sampling;
use jointplay_analysis::study::{
    CandidateRequest, Change, CheapestFits, FitOptions, Input, Output, RunSpan, SensitivityOptions, StudyError,
    StudyRunner, StudyRuns, TargetAnswer, ToleranceOptions, Uncertainty, candidates, inputs, outputs, sensitivity,
    tolerance,
};
use jointplay_analysis::yields::Estimate;
use jointplay_physics::suggest::nearest;
use jointplay_physics::words::Words;
use jointplay_scene::Scene;
use numpy::PyArray2;
use numpy::ndarray::Array2;
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::option_error;
use crate::interpreter::{guarded, report_progress};
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

/// Reason why runs ended early.
enum EarlyEnd {
    /// Ctrl-C, an error of the progress function, no memory, or a bug.
    Raised(PyErr),
    Study(StudyError),
}

impl From<StudyError> for EarlyEnd {
    fn from(error: StudyError) -> Self {
        Self::Study(error)
    }
}

impl EarlyEnd {
    fn raise(self, py: Python<'_>) -> PyErr {
        match self {
            Self::Raised(error) => error,
            Self::Study(error) => option_error(py, &format!("{error:#}")),
        }
    }
}

/// Finished runs of one stage.
struct Stage {
    name: String,
    /// Values of the inputs of each run, SI.
    values: Vec<Vec<f64>>,
    /// Its outputs, SI.
    results: Vec<Vec<f64>>,
}

/// Performs the runs of a study and stores them by stage.
struct Runner<'a, 'py> {
    study: &'a PyStudy,
    py: Python<'py>,
    threads: usize,
    progress: Option<Bound<'py, PyAny>>,
    stages: Vec<Stage>,
}

impl<'a, 'py> Runner<'a, 'py> {
    fn new(study: &'a PyStudy, py: Python<'py>, threads: usize, progress: Option<Bound<'py, PyAny>>) -> Self {
        Self { study, py, threads, progress, stages: Vec::new() }
    }

    /// Adds values and outputs of the runs of `stage`.
    fn describe(&self, stage: &str, all: &Bound<'py, PyDict>) -> PyResult<()> {
        let stage = self.stages.iter().find(|known| known.name == stage);
        let (values, results) = stage.map_or((&[][..], &[][..]), |stage| (&stage.values[..], &stage.results[..]));
        all.set_item("values", array(self.py, values, self.study.inputs.len())?)?;
        all.set_item("results", array(self.py, results, self.study.outputs.len())?)
    }
}

impl StudyRunner for Runner<'_, '_> {
    type Error = EarlyEnd;

    fn inputs(&self) -> &[Input] {
        &self.study.inputs
    }

    fn outputs(&self) -> &[Output] {
        &self.study.outputs
    }

    fn run(&mut self, stage: &str, rows: Vec<Vec<f64>>) -> Result<Vec<Vec<f64>>, EarlyEnd> {
        report_progress(self.py, self.progress.as_ref(), 0.0).map_err(EarlyEnd::Raised)?;
        let PyStudy { scene, inputs, outputs, span } = self.study;
        let keys: Vec<String> = inputs.iter().map(|input| input.key.clone()).collect();
        let runs = StudyRuns::new(scene, &keys, outputs, *span, &rows)?;
        let records = records(self.py, runs.sweep(), self.threads, self.progress.clone()).map_err(EarlyEnd::Raised)?;
        let length = runs.sweep().layout().record_length();
        let results: Vec<Vec<f64>> = records.chunks_exact(length).map(|record| runs.outputs_of(record)).collect();
        self.stages.push(Stage { name: stage.to_owned(), values: rows, results: results.clone() });
        Ok(results)
    }
}

/// An estimate as value, lower and upper end of its interval.
fn estimate_tuple(estimate: &Estimate) -> (f64, f64, f64) {
    (estimate.value, estimate.low, estimate.high)
}

/// Keys and values of changed parameters, with the resulting output.
type Changed<'a> = (Vec<(&'a str, f64)>, f64);

impl PyStudy {
    fn changes_with_output(&self, changes: &[Change], output: f64) -> Changed<'_> {
        let named = changes.iter().map(|change| (&self.inputs[change.input].key[..], change.value));
        (named.collect(), output)
    }

    fn target<'py>(&self, py: Python<'py>, answer: &TargetAnswer) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        let single = answer
            .single
            .iter()
            .map(|(change, output)| self.changes_with_output(std::slice::from_ref(change), *output));
        all.set_item("target", answer.target)?;
        all.set_item("single", single.collect::<Vec<_>>())?;
        all.set_item(
            "together",
            answer.together.as_ref().map(|(changes, output)| self.changes_with_output(changes, *output)),
        )?;
        Ok(all)
    }

    fn fits<'py>(&self, py: Python<'py>, cheapest: &CheapestFits) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        let all_candidates = || cheapest.options.candidates.iter();
        let best = cheapest.search.best.as_ref().map(|best| {
            let chosen = all_candidates().zip(&best.candidates);
            let chosen = chosen
                .map(|(candidate, &chosen)| (&self.inputs[candidate.input].key[..], &candidate.list[chosen].text[..]));
            (best.cost, chosen.collect::<Vec<_>>(), estimate_tuple(&best.estimate))
        });
        let unchecked = all_candidates()
            .filter(|candidate| !candidate.is_ordered())
            .map(|candidate| &self.inputs[candidate.input].key[..]);
        all.set_item("best", best)?;
        all.set_item("is_proven", cheapest.search.is_proven)?;
        all.set_item("evaluations", cheapest.search.evaluations)?;
        all.set_item("check", cheapest.check.as_ref().map(|(check, verdict)| (estimate_tuple(check), verdict.word())))?;
        all.set_item("order_not_checked", unchecked.collect::<Vec<_>>())?;
        Ok(all)
    }
}

/// An array of rows of `length`.
fn array<'py>(py: Python<'py>, rows: &[Vec<f64>], length: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let shape = (rows.len(), length);
    let values = Array2::from_shape_vec(shape, rows.concat());
    constant(py, values.map_err(|error| PyMemoryError::new_err(error.to_string()))?)
}

/// Reads a limit or target of `output`: a number in SI units, text with a unit, or `None`.
fn quantity(output: &Output, value: &Bound<'_, PyAny>) -> Result<Option<f64>, String> {
    if value.is_none() {
        return Ok(None);
    }
    if let Ok(text) = value.extract::<String>() {
        return output.read(&text).map(Some);
    }
    let number = value.extract::<f64>().ok().filter(|number| number.is_finite());
    number.map(Some).ok_or_else(|| "expected a number in SI units, or text".to_owned())
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
        let wrong = |error: &dyn std::fmt::Display| option_error(py, &format!("{error:#}"));
        let inputs = guarded(py, || inputs(&scene, &requested))?.map_err(|error| wrong(&error))?;
        if inputs.is_empty() {
            return Err(wrong(&"over: give at least one parameter"));
        }
        let outputs = guarded(py, || outputs(&scene, output))?;
        let outputs = outputs.map_err(|error| wrong(&format!("output: {error}")))?;
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

    /// Key, value in the scene, SI, and SI unit of each parameter.
    #[getter]
    fn inputs(&self) -> Vec<(&str, f64, &str)> {
        self.inputs.iter().map(|input| (&input.key[..], input.nominal, input.si_unit)).collect()
    }

    /// Key and ends, SI, of each range that was assumed because none was given.
    #[getter]
    fn assumed_ranges(&self) -> Vec<(&str, (f64, f64))> {
        self.inputs.iter().filter_map(|input| Some((&input.key[..], input.assumed_range()?))).collect()
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
        let mut runner = Runner::new(self, py, threads, progress);
        let results = guarded(py, || runner.run("values", rows))?;
        array(py, &results.map_err(|ended| ended.raise(py))?, self.outputs.len())
    }

    /// One-at-a-time ranges, a screening of many parameters, indices, and changes that reach a target.
    #[pyo3(signature = (rows, screen, target, seed, threads, progress=None))]
    fn sensitivity<'py>(
        &self,
        py: Python<'py>,
        rows: usize,
        screen: Option<usize>,
        target: Option<Bound<'py, PyAny>>,
        seed: u64,
        threads: usize,
        progress: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let target = match &target {
            Some(value) => quantity(&self.outputs[0], value)
                .map_err(|why| option_error(py, &format!("target of {}: {why}", self.outputs[0].name)))?,
            None => None,
        };
        let mut runner = Runner::new(self, py, threads, progress);
        let options = SensitivityOptions { rows, screen, target, seed };
        let result = guarded(py, || sensitivity(&mut runner, &options))?.map_err(|ended| ended.raise(py))?;
        let all = PyDict::new(py);
        runner.describe("indices", &all)?;
        all.set_item("kept", &result.kept)?;
        all.set_item("nominal", &result.alone.nominal)?;
        all.set_item("together", &result.alone.together)?;
        all.set_item("alone", &result.alone.ends)?;
        let effects = result.screening.as_ref().map(|screening| {
            let of_input = screening.effects.iter();
            let numbers = of_input.map(|effects| effects.map(|e| (e.mean, e.mean_magnitude, e.deviation)));
            numbers.collect::<Vec<_>>()
        });
        all.set_item("screening", effects)?;
        let mut indices = Vec::new();
        for own in result.indices.iter().flatten() {
            let entry = PyDict::new(py);
            match own {
                Ok(own) => {
                    entry.set_item("mean", own.mean)?;
                    entry.set_item("variance", own.variance)?;
                    entry.set_item("first", own.first.iter().map(estimate_tuple).collect::<Vec<_>>())?;
                    entry.set_item("total", own.total.iter().map(estimate_tuple).collect::<Vec<_>>())?;
                }
                Err(error) => entry.set_item("fault", error.to_string())?,
            }
            indices.push(entry);
        }
        all.set_item("indices", indices)?;
        all.set_item("target", result.target.as_ref().map(|answer| self.target(py, answer)).transpose()?)?;
        Ok(all)
    }

    /// A lot of `units` units: which meet the `limits`, a lower and an upper one for each output, and what drives the rejects.
    /// `cost` has a pattern, a fit and its cost for each candidate; without any, no fits are searched.
    #[pyo3(signature = (limits, units, sampling, seed, cost, required_yield, evaluations, threads, progress=None))]
    fn tolerance<'py>(
        &self,
        py: Python<'py>,
        limits: Vec<(Bound<'py, PyAny>, Bound<'py, PyAny>)>,
        units: usize,
        sampling: &str,
        seed: u64,
        cost: Option<Vec<(String, String, f64)>>,
        required_yield: f64,
        evaluations: usize,
        threads: usize,
        progress: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let wrong = |message: &str| option_error(py, message);
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
            let read = |name: &str, value| {
                let failed = |why| wrong(&format!("{name} limit of {}: {why}", output.name));
                quantity(output, value).map_err(failed)
            };
            let [lower, upper] = [read("lower", lower)?, read("upper", upper)?];
            if lower.is_none() && upper.is_none() || lower.zip(upper).is_some_and(|(lower, upper)| lower >= upper) {
                return Err(wrong(&format!("limits of {}: give a lower one, or a higher upper one", output.name)));
            }
            ends.push(Limit { lower, upper });
        }
        let requested = cost.map(|cost| {
            let of_one = |(pattern, distribution, cost): (String, String, f64)| CandidateRequest {
                place: "cost".to_owned(),
                pattern,
                distribution,
                cost: cost.to_string(),
            };
            cost.into_iter().map(of_one).collect::<Vec<_>>()
        });
        let fits = requested.map(|requested| -> PyResult<FitOptions> {
            let candidates = guarded(py, || candidates(&self.scene, &self.inputs, &requested))?;
            let candidates = candidates.map_err(|error| wrong(&format!("{error:#}")))?;
            Ok(FitOptions { candidates, required_yield, evaluations })
        });
        let fits = fits.transpose()?;
        let mut runner = Runner::new(self, py, threads, progress);
        let options = ToleranceOptions { units, sampling, seed, fits };
        let result = guarded(py, || tolerance(&mut runner, &ends, options))?.map_err(|ended| ended.raise(py))?;
        let drivers = result.drivers.as_ref().map(|drivers| {
            drivers.iter().map(|driver| (driver.mean_shift, driver.distance, driver.p_value)).collect::<Vec<_>>()
        });
        let all = PyDict::new(py);
        runner.describe("lot", &all)?;
        all.set_item("yield", estimate_tuple(&result.lot.yield_estimate))?;
        all.set_item("accepted", &result.lot.accepted)?;
        let qualities = result.qualities.iter().map(|own| quality(py, own)).collect::<PyResult<Vec<_>>>()?;
        all.set_item("qualities", qualities)?;
        all.set_item("drivers", drivers)?;
        all.set_item("fits", result.cheapest.as_ref().map(|cheapest| self.fits(py, cheapest)).transpose()?)?;
        Ok(all)
    }
}

fn quality<'py>(py: Python<'py>, quality: &Quality) -> PyResult<Bound<'py, PyDict>> {
    let own = PyDict::new(py);
    own.set_item("yield", estimate_tuple(&quality.yield_estimate))?;
    own.set_item("mean", quality.mean)?;
    own.set_item("deviation", quality.deviation)?;
    for (p, value) in PERCENTILES.iter().zip(&quality.percentiles) {
        own.set_item(format!("percentile_{:.0}", 100.0 * p), value.as_ref().map(estimate_tuple))?;
    }
    own.set_item("cp", quality.capability.as_ref().and_then(|capability| capability.cp))?;
    own.set_item("cpk", quality.capability.as_ref().map(|capability| estimate_tuple(&capability.cpk)))?;
    Ok(own)
}
