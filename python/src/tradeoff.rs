//! Cost and error of every method on a scene, as `jointplay tradeoff` measures them.

use std::ops::ControlFlow;

use jointplay_analysis::{AnalysisError, Grid, RunContext, Tradeoff};
use pyo3::prelude::*;
use serde_json::{Map, Value as Json};

use crate::errors::{option_error, scene_error, stopped};
use crate::interpreter::{detached, report_progress};
use crate::scene::PyScene;

/// Runs every method on `scene` over its steps or tolerances; `clock` returns the processor time of this thread, s. Returns the
/// rows of `tradeoff.csv` as JSON.
#[pyfunction]
#[pyo3(signature = (scene, quick, clock, progress=None))]
pub fn tradeoff(
    py: Python<'_>,
    scene: &PyScene,
    quick: bool,
    clock: Py<PyAny>,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    let scene = &*scene.scene;
    let grid = if quick { Grid::QUICK } else { Grid::FULL };
    let mut raised = None;
    let measured = detached(py, || {
        let mut now = || Python::attach(|py| clock.call0(py)?.extract::<f64>(py)).unwrap_or(f64::NAN);
        let mut report = |fraction: f64| {
            let outcome =
                Python::attach(|py| report_progress(py, progress.as_ref().map(|progress| progress.bind(py)), fraction));
            match outcome {
                Ok(()) => ControlFlow::Continue(()),
                Err(error) => {
                    raised = Some(error);
                    ControlFlow::Break(())
                }
            }
        };
        Tradeoff::measure(scene, &grid, &mut RunContext::new(&mut now, &mut report))
    })?;
    if let Some(error) = raised {
        return Err(error);
    }
    let measured = measured.map_err(|error| match error {
        AnalysisError::Start(error) => scene_error(py, Some(scene), &scene.locate(&error)),
        AnalysisError::Scene(error) => scene_error(py, Some(scene), &error),
        AnalysisError::Stopped(error) => stopped(py, &error),
        other => option_error(py, &other.to_string()),
    })?;
    let named = |(name, value): (&str, Json)| (name.to_owned(), value);
    let rows = measured.rows.iter().map(|row| row.values().into_iter().map(named).collect::<Map<_, _>>());
    serde_json::to_string(&rows.collect::<Vec<_>>()).map_err(|error| option_error(py, &error.to_string()))
}
