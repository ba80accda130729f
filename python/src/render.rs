//! Pictures of an instant without a window, in wheels that are built with the feature `render`.

use std::sync::{Mutex, PoisonError};

use jointplay::render::Offscreen;
use jointplay::view::{DrawList, PeakMarks, Quality, SceneView, Shot, ViewOptions};
use numpy::PyArray3;
use numpy::ndarray::Array3;
use pyo3::prelude::*;

use crate::errors::option_error;
use crate::interpreter::detached;
use crate::simulation::PySimulation;

/// Largest width and height, pixels.
const MAX_EDGE: u32 = 8192;

/// The graphics adapter, found once.
static ADAPTER: Mutex<Option<Offscreen>> = Mutex::new(None);

/// The running machine of `simulation` now, from the point of view of `jointplay render`: rows from the top, and red, green, blue
/// and opacity of each pixel.
#[pyfunction]
pub fn render<'py>(
    py: Python<'py>,
    simulation: &mut PySimulation,
    width: u32,
    height: u32,
) -> PyResult<Bound<'py, PyArray3<u8>>> {
    for (name, value) in [("width", width), ("height", height)] {
        if !(1..=MAX_EDGE).contains(&value) {
            return Err(option_error(py, &format!("{name} = {value}: allowed 1 to {MAX_EDGE} pixels")));
        }
    }
    simulation.sample(py)?;
    let picture = detached(py, || {
        let mut list = DrawList::default();
        draw(simulation, [width, height], &mut list);
        let mut adapter = ADAPTER.lock().unwrap_or_else(PoisonError::into_inner);
        let offscreen = match &mut *adapter {
            Some(offscreen) => offscreen,
            none => none.insert(Offscreen::new().map_err(|error| error.to_string())?),
        };
        offscreen.render(&list).map_err(|error| error.to_string())
    })?;
    let picture = picture.map_err(|error| option_error(py, &error))?;
    let shape = (picture.height as usize, picture.width as usize, 4);
    let pixels = Array3::from_shape_vec(shape, picture.rgba);
    Ok(PyArray3::from_owned_array(py, pixels.map_err(|error| option_error(py, &error.to_string()))?))
}

/// Builds the draw list of the instant of `simulation` last sampled.
fn draw(simulation: &PySimulation, size: [u32; 2], list: &mut DrawList) {
    let (scene, [start, frame]) = simulation.running_and_frames();
    let view = SceneView::new(scene, start);
    // A simulation records no path and no peaks.
    let options = ViewOptions { quality: Quality::FULL, trail: false, ..ViewOptions::default() };
    let mut marks = PeakMarks::new();
    marks.update(frame, &[], f64::INFINITY);
    let mut camera = view.camera();
    view.fit(&mut camera, scene, start, &options, size);
    let shot = Shot {
        scene,
        frame,
        marks: &marks,
        options: &options,
        camera: &camera,
        trail: &[],
        size,
        pixels_per_point: 1.0,
    };
    view.build(&shot, list);
}
