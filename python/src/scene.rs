//! Scenes: loaded, parsed, changed, checked.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use jointplay_analysis::assembly::StartReport;
use jointplay_analysis::ideal_fault::ideal_fault;
use jointplay_physics::simulate::{ChannelInfo, Frame, Simulation, channels_of};
use jointplay_physics::units::si_unit;
use jointplay_scene::{
    BENCHMARKS, BUILT_IN, Kind, LiveScene, Scene, SceneError, Texts, check_solver_changes, file_bytes,
};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};

use crate::errors::scene_error;
use crate::geometry::{DrawnShape, shapes};
use crate::interpreter::detached;
use crate::machine::text_of;
use crate::quantity::{to_python, to_text};

/// Time for the examination of the motion without play.
const MAX_EXAMINATION_TIME: Duration = Duration::from_secs(2);

/// Names of the built-in scenes, then of the benchmarks.
#[pyfunction]
pub fn scenes() -> (Vec<&'static str>, Vec<&'static str>) {
    (BUILT_IN.to_vec(), BENCHMARKS.to_vec())
}

/// A scene; it never changes.
#[pyclass(frozen, name = "Scene", module = "jointplay._native")]
pub struct PyScene {
    /// The scene.
    pub scene: Arc<Scene>,
}

/// Source of a scene: its text, its file, the files that it references, its changes.
type Origin = (String, Option<String>, BTreeMap<String, String>, Vec<(String, String)>);

impl PyScene {
    fn load_with(py: Python<'_>, read: impl FnOnce() -> Result<Scene, SceneError> + Send) -> PyResult<Self> {
        let scene = detached(py, read)?.map_err(|error| scene_error(py, None, &error))?;
        Ok(Self { scene: Arc::new(scene) })
    }

    /// The scene started at t = 0.
    ///
    /// # Errors
    /// `SceneError` with the line or the change at fault, if the scene cannot start.
    pub fn start(&self, py: Python<'_>) -> PyResult<LiveScene> {
        let live = detached(py, || LiveScene::new(&self.scene))?;
        live.map_err(|error| scene_error(py, Some(&self.scene), &self.scene.locate(&error)))
    }
}

/// The channels of a simulation that has just started, and its first instant.
pub fn channels_at_start(simulation: &mut Simulation) -> (Vec<ChannelInfo>, Frame) {
    let mut frame = Frame::default();
    simulation.sample(0.0, &mut frame);
    (channels_of(simulation.machine(), &frame), frame)
}

#[pymethods]
impl PyScene {
    /// A built-in scene or benchmark by name, or a file.
    #[staticmethod]
    fn load(py: Python<'_>, name: PathBuf) -> PyResult<Self> {
        Self::load_with(py, || Scene::load(name, &[]))
    }

    /// A scene from its text. Files that it references are read from `folder`.
    #[staticmethod]
    #[pyo3(signature = (text, file=None, folder=None))]
    fn parse(py: Python<'_>, text: &str, file: Option<&str>, folder: Option<PathBuf>) -> PyResult<Self> {
        Self::load_with(py, || Scene::parse_given(text, file, &BTreeMap::new(), folder.as_deref(), &[]))
    }

    /// Scene file text with the sections in `machine`.
    #[staticmethod]
    fn text_of(machine: &Bound<'_, PyDict>) -> PyResult<String> {
        text_of(machine)
    }

    /// The scene that [`Self::origin`] describes.
    #[staticmethod]
    fn read_again(py: Python<'_>, origin: Origin) -> PyResult<Self> {
        let (text, file, references, changes) = origin;
        let references: Texts = references.into_iter().map(|(name, text)| (name, text.into())).collect();
        Self::load_with(py, || Scene::parse_with(&text, file.as_deref(), &references, &changes))
    }

    /// Source of the scene, from which [`Self::read_again`] restores it.
    fn origin(&self) -> Origin {
        let source = &self.scene.source;
        let references = source.beside.iter().map(|(name, text)| (name.clone(), text.to_string())).collect();
        (source.text.to_string(), source.file.clone(), references, self.scene.changes.clone())
    }

    /// Text of a scene file that reads back to the scene with its changes.
    fn text(&self, py: Python<'_>) -> PyResult<String> {
        let text = detached(py, || self.scene.to_toml())?;
        text.map_err(|error| scene_error(py, Some(&self.scene), &error))
    }

    /// The sections and keys of [`Self::text`], in JSON.
    fn sections(&self, py: Python<'_>) -> PyResult<String> {
        let sections: serde_json::Value = toml::from_str(&self.text(py)?).map_err(|error| {
            let error = SceneError { message: error.to_string(), ..SceneError::default() };
            scene_error(py, Some(&self.scene), &error)
        })?;
        Ok(sections.to_string())
    }

    /// Names and content of the files that it references.
    fn files<'py>(&self, py: Python<'py>) -> Vec<(&str, Bound<'py, PyBytes>)> {
        let files = self.scene.source.beside.iter();
        files.map(|(name, text)| (&name[..], PyBytes::new(py, &file_bytes(text)))).collect()
    }

    /// Drawn shapes: body (`None` for the world), kind, and dimensions by name, m, in body axes.
    fn shapes<'py>(&self, py: Python<'py>) -> PyResult<Vec<DrawnShape<'py, '_>>> {
        shapes(py, &self.scene)
    }

    /// Short name.
    #[getter]
    fn name(&self) -> &str {
        &self.scene.name
    }

    /// One-line title.
    #[getter]
    fn title(&self) -> &str {
        &self.scene.title
    }

    /// Description for the user, one paragraph.
    #[getter]
    fn description(&self) -> &str {
        &self.scene.description
    }

    /// Names of the joints with play, in scene order.
    #[getter]
    fn ball_joints(&self) -> Vec<&str> {
        self.scene.machine.loose_joints.iter().map(|joint| &joint.name[..]).collect()
    }

    /// The same, with the names of the sites of each.
    #[getter]
    fn sites(&self) -> Vec<(&str, Vec<String>)> {
        self.scene.machine.loose_joints.iter().map(|joint| (&joint.name[..], joint.sites())).collect()
    }

    /// Names of the bodies, in scene order.
    #[getter]
    fn bodies(&self) -> Vec<&str> {
        self.scene.machine.bodies.iter().map(|body| &body.name[..]).collect()
    }

    /// Keys of the parameters: those of the scene, then those of each joint with play.
    fn keys(&self) -> Vec<String> {
        let own = self.scene.parameters().into_iter().map(|parameter| parameter.key.to_owned());
        let of_joints = (0..self.scene.machine.loose_joints.len()).flat_map(|joint| self.scene.joint_keys(joint));
        own.chain(of_joints).collect()
    }

    /// Properties of the parameter `key`.
    fn parameter<'py>(&self, py: Python<'py>, key: &str) -> PyResult<Bound<'py, PyDict>> {
        let failed = |error: SceneError| scene_error(py, Some(&self.scene), &error);
        let parameter = self.scene.parameter(key).map_err(failed)?;
        let value = self.scene.get(key).map_err(failed)?;
        let all = PyDict::new(py);
        all.set_item("key", key)?;
        all.set_item("label", parameter.label)?;
        all.set_item("group", parameter.group)?;
        all.set_item("value", to_python(py, &value)?)?;
        all.set_item("text", parameter.show(&value))?;
        all.set_item("default", to_python(py, &parameter.default)?)?;
        all.set_item("allowed", parameter.allowed())?;
        let unit = match parameter.kind {
            Kind::Number { dimension, .. } => si_unit(dimension),
            Kind::Count { .. } | Kind::Choice(_) => "",
        };
        all.set_item("unit", unit)?;
        let range = match parameter.kind {
            Kind::Number { min, max, .. } => Some((min, max)),
            Kind::Count { min, max } => Some((min as f64, max as f64)),
            Kind::Choice(_) => None,
        };
        all.set_item("range", range)?;
        let words = match parameter.kind {
            Kind::Choice(words) => words.to_vec(),
            _ => Vec::new(),
        };
        all.set_item("words", words)?;
        all.set_item("at_reset", parameter.at_reset)?;
        all.set_item("help", parameter.help)?;
        all.set_item("equation", parameter.equation)?;
        Ok(all)
    }

    /// A copy with `changes`, each a key and a value; `None` returns to the value of the file.
    fn set(&self, py: Python<'_>, changes: Vec<(String, Bound<'_, PyAny>)>) -> PyResult<Self> {
        let failed = |error: SceneError| scene_error(py, Some(&self.scene), &error);
        let mut texts = Vec::new();
        for (key, value) in changes {
            let parameter = self.scene.parameter(&key).map_err(failed)?;
            let text = to_text(parameter, &key, &value)?;
            texts.push((key, text));
        }
        let scene = detached(py, || with_changes(&self.scene, &texts))?.map_err(failed)?;
        Ok(Self { scene: Arc::new(scene) })
    }

    /// Starts the scene. Returns its counts and its warnings.
    fn check<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let mut live = self.start(py)?;
        let scene = &*self.scene;
        let contents = live.mechanism().summary();
        let all = PyDict::new(py);
        all.set_item("bodies", contents.bodies)?;
        all.set_item("degrees_of_freedom", contents.degrees_of_freedom)?;
        all.set_item("velocity_coordinates", contents.velocity_coordinates)?;
        all.set_item("constraint_rows", contents.constraint_rows)?;
        all.set_item("dependent_rows", contents.dependent_rows)?;
        all.set_item("contacts", contents.contacts)?;
        all.set_item("ideal_joints", contents.ideal_joints)?;
        let warnings = detached(py, || {
            let started = Instant::now();
            let may_continue = || started.elapsed() < MAX_EXAMINATION_TIME;
            let singular = ideal_fault(scene, may_continue).map(|near| near.to_string());
            let start = StartReport::of(&mut live);
            (start.warnings_of(scene).into_iter().chain(singular).collect::<Vec<_>>(), start.indeterminate_forces())
        })?;
        all.set_item("warnings", warnings.0)?;
        all.set_item("not_unique", warnings.1)?;
        all.set_item("doubts", live.doubts().iter().map(ToString::to_string).collect::<Vec<_>>())?;
        Ok(all)
    }

    /// Its channels: name, column, unit, description, and whether a run records the channel by default.
    fn channels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let mut live = self.start(py)?;
        let (rows, _) = detached(py, || channels_at_start(&mut live))?;
        PyList::new(py, rows.into_iter().map(|c| (c.name, c.column, c.unit, c.help, c.by_default)))
    }

    fn __eq__(&self, other: &Self) -> bool {
        *self.scene == *other.scene
    }
}

/// `scene` with changes; `None` returns to the value of the file.
fn with_changes(scene: &Scene, changes: &[(String, Option<String>)]) -> Result<Scene, SceneError> {
    let own: Vec<(String, String)> =
        changes.iter().filter_map(|(key, text)| Some((key.clone(), text.clone()?))).collect();
    check_solver_changes(&own)?;
    let one_by_one = || {
        let mut scene = scene.clone();
        for (key, text) in changes {
            match text {
                Some(text) => scene.set(key, text)?,
                None => scene.undo_change(key)?,
            };
        }
        Ok(scene)
    };
    // Some changes are valid only together, such as a large clearance and a larger ball.
    let together = |error| {
        let is_changed = |key: &String| changes.iter().any(|(changed, _)| changed == key);
        let earlier = scene.changes.iter().filter(|(key, _)| !is_changed(key)).cloned();
        let all: Vec<(String, String)> = earlier.chain(own).collect();
        scene.with_changes(&all).map_err(|_| error)
    };
    one_by_one().or_else(together)
}
