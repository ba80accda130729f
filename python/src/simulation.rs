//! A simulation that is stepped, changed and read from Python.

use std::collections::HashMap;
use std::sync::Arc;

use jointplay_physics::machine::{Mat3, Vec3};
use jointplay_physics::simulate::{
    ChannelInfo, ContactMode, Coordinate, Effect, Frame, JointReport, SiteReport, Stopped, matching,
};
use jointplay_scene::{LiveScene, SavedState, Scene, SceneError, SceneSnapshot};
use numpy::ndarray::{Array1, Array2, Array3};
use numpy::{PyArray1, PyArray2, PyArray3};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMappingProxy, PyType};

use crate::WRITER;
use crate::control::{self, Control};
use crate::errors::{change_error, exception, option_error, scene_error, set_error, stopped};
use crate::interpreter::{STEPS_BETWEEN_CHECKS, detached, guarded};
use crate::quantity::{duration, to_text};
use crate::report;
use crate::scene::{PyScene, channels_at_start};

/// Changed parameters of a scene, in order: key and value.
type Changes = Vec<(String, String)>;

/// What a pickle holds: the text of a state file, and the changes of the scene as it was given, at the start, and in effect.
type Pickled<'a> = (String, [&'a Changes; 3]);

/// Channels and first instant of a machine since its latest start.
struct Layout {
    /// Changes of the scene at the start.
    changes: Changes,
    channels: Vec<ChannelInfo>,
    /// Index of each channel by name and by column.
    indices: HashMap<String, usize>,
    /// The first instant.
    #[cfg_attr(not(feature = "render"), expect(dead_code, reason = "only rendering uses it"))]
    start: Frame,
}

impl Layout {
    /// The channels of a simulation that has just started.
    fn of(live: &mut LiveScene) -> Self {
        let (channels, start) = channels_at_start(live);
        let names = channels.iter().map(|channel| &channel.name);
        let both = channels.iter().map(|channel| &channel.column).zip(0..).chain(names.zip(0..));
        let indices = both.map(|(name, index)| (name.clone(), index)).collect();
        Self { changes: live.running().changes.clone(), indices, channels, start }
    }
}

/// A state to which a simulation can return.
#[pyclass(frozen, name = "State", module = "jointplay._native")]
pub struct PyState {
    scene: Arc<Scene>,
    snapshot: SceneSnapshot,
    layout: Arc<Layout>,
}

#[pymethods]
impl PyState {
    /// The state that [`Self::reduce`] describes.
    #[new]
    fn new(py: Python<'_>, text: &str, changes: [Changes; 3]) -> PyResult<Self> {
        let refused = |why: String| option_error(py, &format!("state: {why}"));
        let saved = detached(py, || SavedState::read(WRITER, text.as_bytes()))?;
        let saved = saved.map_err(|why| refused(why.to_string()))?;
        let read = || {
            let pending = saved.scene()?;
            let with = |changes: &Changes| pending.with_changes(changes);
            let [scene, initial, running] = [with(&changes[0])?, with(&changes[1])?, with(&changes[2])?];
            let live = LiveScene::new(&initial).map_err(|error| initial.locate(&error))?;
            Ok((scene, live, running, pending))
        };
        let read = detached(py, read)?.map_err(|error: SceneError| scene_error(py, None, &error))?;
        let (scene, mut live, running, pending) = read;
        let layout = detached(py, || Layout::of(&mut live))?;
        let resumed = detached(py, || live.resume_changed(&saved.snapshot, running, pending))?;
        resumed.map_err(|mismatch| refused(mismatch.to_string()))?;
        Ok(Self { scene: Arc::new(scene), snapshot: live.snapshot(), layout: Arc::new(layout) })
    }

    /// Constructor and arguments that restore the state from a pickle.
    #[pyo3(name = "__reduce__")]
    fn reduce<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyType>, Pickled<'_>)> {
        let snapshot = &self.snapshot;
        let text = detached(py, || SavedState::write(WRITER, snapshot.pending(), snapshot, snapshot.time()))?;
        let text = text.map_err(|why| option_error(py, &format!("state: {why}")))?;
        let changes = [&self.scene.changes, &self.layout.changes, &snapshot.running().changes];
        Ok((py.get_type::<Self>(), (text, changes)))
    }

    /// The state itself, since it never changes.
    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    /// As [`Self::__copy__`].
    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    /// Simulated time, s.
    #[getter]
    fn time(&self) -> f64 {
        self.snapshot.time()
    }

    /// Its hash, 16 hexadecimal digits.
    #[getter]
    fn hash(&self) -> String {
        report::hash_text(self.snapshot.hash())
    }
}

/// A running simulation of a scene.
#[pyclass(subclass, name = "Simulation", module = "jointplay._native")]
pub struct PySimulation {
    /// The scene as it was given.
    scene: Arc<Scene>,
    live: LiveScene,
    layout: Arc<Layout>,
    frame: Frame,
    /// Coordinates of the state vector.
    coordinates: Arc<[Coordinate]>,
    /// What was set of force elements since the latest step, which acts together with the next call that needs it.
    controls: Vec<Control>,
}

impl PySimulation {
    /// The run, after what was set of its elements.
    pub(super) fn run(&mut self, py: Python<'_>) -> PyResult<&mut LiveScene> {
        if !self.controls.is_empty() {
            let outcome = guarded(py, || self.live.control(&self.controls))?;
            self.controls.clear();
            outcome.map_err(|error| change_error(py, &error))?;
        }
        Ok(&mut self.live)
    }

    /// Takes steps until `is_over`; checks for Ctrl-C between them.
    fn advance(
        &mut self,
        py: Python<'_>,
        step: impl Fn(&mut LiveScene) -> Result<(), Stopped> + Sync,
        mut is_over: impl FnMut(&LiveScene) -> bool + Send,
    ) -> PyResult<()> {
        loop {
            let live = self.run(py)?;
            let outcome = detached(py, || {
                for _ in 0..STEPS_BETWEEN_CHECKS {
                    if is_over(live) {
                        return Ok(true);
                    }
                    step(live)?;
                }
                Ok(false)
            })?;
            if outcome.map_err(|error| stopped(py, &error))? {
                return Ok(());
            }
            py.check_signals()?;
        }
    }

    /// The scene in effect, its first instant, and the one last sampled.
    #[cfg(feature = "render")]
    pub fn running_and_frames(&self) -> (&Scene, [&Frame; 2]) {
        (self.live.running(), [&self.layout.start, &self.frame])
    }

    /// Samples this instant with all channels.
    pub(super) fn sample(&mut self, py: Python<'_>) -> PyResult<()> {
        self.run(py)?;
        self.layout.channels.iter().for_each(|channel| channel.reading().request(&mut self.frame));
        guarded(py, || self.live.sample_now(&mut self.frame))
    }

    /// Lays out the run anew, which has just started.
    fn lay_out(&mut self, py: Python<'_>) -> PyResult<()> {
        self.layout = Arc::new(detached(py, || Layout::of(&mut self.live))?);
        self.coordinates = self.live.coordinates().into();
        self.controls.clear();
        Ok(())
    }
}

#[pymethods]
impl PySimulation {
    #[new]
    fn new(py: Python<'_>, scene: &PyScene) -> PyResult<Self> {
        let mut live = scene.start(py)?;
        let layout = Arc::new(detached(py, || Layout::of(&mut live))?);
        let coordinates = live.coordinates().into();
        let scene = scene.scene.clone();
        Ok(Self { scene, live, layout, frame: Frame::default(), coordinates, controls: Vec::new() })
    }

    /// Takes `count` steps, each as long as the method chooses.
    #[pyo3(signature = (count=1))]
    fn step(&mut self, py: Python<'_>, count: u64) -> PyResult<()> {
        let mut left = count;
        let is_over = move |_: &LiveScene| {
            let over = left == 0;
            left = left.saturating_sub(1);
            over
        };
        self.advance(py, |live| live.step(), is_over)
    }

    /// Steps to exactly `time`, at which the last step ends.
    fn step_until(&mut self, py: Python<'_>, time: &Bound<'_, PyAny>) -> PyResult<()> {
        let end = duration("time", time)?;
        self.advance(py, |live| live.step_until(end), |live| live.time() >= end)
    }

    /// Simulated time, s.
    #[getter]
    fn time(&self) -> f64 {
        self.live.time()
    }

    /// Hash of the state, 16 hexadecimal digits.
    #[getter]
    fn hash(&self) -> String {
        report::hash_text(self.live.state_hash())
    }

    /// The whole state.
    #[getter]
    fn state(&mut self, py: Python<'_>) -> PyResult<PyState> {
        let snapshot = self.run(py)?.snapshot();
        Ok(PyState { scene: self.scene.clone(), snapshot, layout: self.layout.clone() })
    }

    /// Returns to a state of this scene, or starts at its coordinates and time from one of a scene with the same coordinates.
    fn restore(&mut self, py: Python<'_>, state: &PyState) -> PyResult<()> {
        if Arc::ptr_eq(&state.scene, &self.scene) || state.scene == self.scene {
            self.live.restore(&state.snapshot);
            self.layout = state.layout.clone();
            self.coordinates = self.live.coordinates().into();
            self.controls.clear();
            return Ok(());
        }
        let machine = &state.snapshot.running().machine;
        let other = self.live.mechanism().coordinate_names(machine);
        let same = machine.bodies.len() == self.live.machine().bodies.len() && *other == *self.coordinates;
        if !same || state.snapshot.vector().len() != self.live.state_vector().len() {
            let (own, other) = (&self.scene.name, &state.scene.name);
            let message = format!("state: one of the scene `{other}`, whose coordinates differ from those of `{own}`");
            return Err(option_error(py, &message));
        }
        control::restart(py, self.run(py)?, state.snapshot.time(), state.snapshot.vector())
    }

    /// Force elements by index: name, kind in a scene file, and whether it acts on an angle.
    fn _elements(&self) -> Vec<(&str, &'static str, bool)> {
        control::elements(self.live.machine())
    }

    /// Sets a number of a force element, which acts from this instant on.
    fn _control(&mut self, py: Python<'_>, element: usize, number: &str, value: f64) -> PyResult<()> {
        let control = control::checked(py, &self.live, (element, number, value))?;
        self.controls.push(control);
        Ok(())
    }

    /// A number of a force element, SI; `None` if it does not have it.
    fn _controlled(&mut self, py: Python<'_>, element: usize, number: &str) -> PyResult<Option<f64>> {
        let run = self.run(py)?;
        Ok(control::number(number).and_then(|number| run.controlled(element, number)))
    }

    /// Positions by name of coordinate.
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyMappingProxy>> {
        control::by_name(py, &self.coordinates, self.live.state_vector(), |own| own.positions.clone())
    }

    /// Velocities by name of coordinate.
    #[getter]
    fn v<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyMappingProxy>> {
        let velocities = &self.live.state_vector()[self.live.mechanism().velocity_range()];
        control::by_name(py, &self.coordinates, velocities, |own| own.velocities.clone())
    }

    /// Starts again at given positions and velocities; those not given stay.
    #[pyo3(signature = (q=None, v=None, time=None))]
    fn set_state(
        &mut self,
        py: Python<'_>,
        q: Option<&Bound<'_, PyAny>>,
        v: Option<&Bound<'_, PyAny>>,
        time: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let time = time.map(|time| duration("time", time)).transpose()?.unwrap_or(self.live.time());
        let mut y = self.live.state_vector().to_vec();
        let range = self.live.mechanism().velocity_range();
        // As contacts are found anew, so are their bristles.
        y[range.end..].fill(0.0);
        let (positions, velocities) = y[..range.end].split_at_mut(range.start);
        let coordinates = &self.coordinates;
        control::take(("q", q), coordinates, positions, |own| own.positions.clone())?;
        control::take(("v", v), coordinates, velocities, |own| own.velocities.clone())?;
        control::restart(py, self.run(py)?, time, &y)
    }

    /// Mass matrix of the velocities.
    fn mass_matrix<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let mass = control::answer(py, self.run(py)?.mass_matrix())?;
        Ok(control::matrix(py, mass.shape(), |at| mass[at]))
    }

    /// Forces on the velocity coordinates.
    fn forces<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let forces = control::answer(py, self.run(py)?.generalised_forces())?;
        Ok(PyArray1::from_slice(py, forces.as_slice()))
    }

    /// d/dt of the state vector at any time and state vector.
    fn rhs<'py>(&mut self, py: Python<'py>, time: f64, y: Vec<f64>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(PyArray1::from_vec(py, control::answer(py, self.run(py)?.rhs(time, &y))?))
    }

    /// Matrix and directions of the motion linearised about this state.
    fn _linearise<'py>(&mut self, py: Python<'py>) -> PyResult<[Bound<'py, PyArray2<f64>>; 2]> {
        let found = control::answer(py, self.run(py)?.linearise())?;
        Ok([&found.matrix, &found.directions].map(|of| control::matrix(py, of.shape(), |at| of[at])))
    }

    /// Changes a parameter; returns whether it takes effect `now` or `at reset`.
    #[pyo3(name = "_change")]
    fn change(&mut self, py: Python<'_>, key: &str, value: &Bound<'_, PyAny>) -> PyResult<&'static str> {
        let pending = self.live.pending().clone();
        let parameter = pending.parameter(key).map_err(|error| scene_error(py, Some(&pending), &error))?;
        let Some(text) = to_text(parameter, key, value)? else {
            return Err(option_error(py, &format!("{key} = None: a running simulation needs a value")));
        };
        let live = self.run(py)?;
        let effect = detached(py, || live.set(key, &text))?.map_err(|error| set_error(py, &pending, &error))?;
        Ok(match effect {
            Effect::Now => "now",
            Effect::AtReset => "at reset",
        })
    }

    /// Restarts at t = 0 with all changes.
    fn reset(&mut self, py: Python<'_>) -> PyResult<()> {
        let outcome = detached(py, || self.live.reset())?;
        let pending = self.live.pending();
        outcome.map_err(|error| scene_error(py, Some(pending), &pending.locate(&error)))?;
        self.lay_out(py)
    }

    /// Names of the channels, in the order of [`Self::frame`].
    #[getter]
    fn channels(&self) -> Vec<&str> {
        self.layout.channels.iter().map(|channel| &channel.name[..]).collect()
    }

    /// Value of a channel now, SI; NaN if it has none.
    #[pyo3(name = "_read")]
    fn read(&mut self, py: Python<'_>, channel: &str) -> PyResult<f64> {
        let Some(&index) = self.layout.indices.get(channel) else {
            let known = matching(&self.layout.channels, channel);
            let message = match known {
                Ok(several) => {
                    let names: Vec<&str> = several.iter().map(|channel| &channel.name[..]).collect();
                    format!("`{channel}` stands for several channels: {}", names.join(", "))
                }
                Err(error) => error.to_string(),
            };
            return Err(exception(py, "ChannelError", &message, None));
        };
        self.sample(py)?;
        Ok(self.layout.channels[index].reading().read(&self.frame).unwrap_or(f64::NAN))
    }

    /// All channels and vectors of this instant.
    #[pyo3(name = "_instant")]
    fn instant<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.sample(py)?;
        let frame = &self.frame;
        let all = PyDict::new(py);
        all.set_item("time", frame.time)?;
        let values = self.layout.channels.iter().map(|channel| channel.reading().read(frame).unwrap_or(f64::NAN));
        all.set_item("values", control::read_only(PyArray1::from_owned_array(py, Array1::from_iter(values))))?;
        all.set_item("positions", vectors(py, frame.bodies.iter().map(|body| body.position)))?;
        all.set_item("velocities", vectors(py, frame.bodies.iter().map(|body| body.velocity)))?;
        all.set_item("angular_velocities", vectors(py, frame.bodies.iter().map(|body| body.angular_velocity)))?;
        let rotations: Vec<Mat3> = frame.bodies.iter().map(|body| body.rotation).collect();
        let rotations = Array3::from_shape_fn((rotations.len(), 3, 3), |(b, i, j)| rotations[b][(i, j)]);
        all.set_item("rotations", control::read_only(PyArray3::from_owned_array(py, rotations)))?;
        all.set_item("eccentricities", vectors(py, frame.joints.iter().map(|joint| joint.eccentricity)))?;
        all.set_item("normal_forces", vectors(py, frame.joints.iter().map(|joint| joint.normal_force)))?;
        all.set_item("friction_forces", vectors(py, frame.joints.iter().map(|joint| joint.friction_force)))?;
        all.set_item("lubricant_forces", vectors(py, frame.joints.iter().map(|joint| joint.lubricant_force)))?;
        let axial = PyArray1::from_iter(py, frame.joints.iter().map(|joint| joint.axial));
        all.set_item("axial", control::read_only(axial))?;
        let tilts = PyArray1::from_iter(py, frame.joints.iter().map(|joint| joint.tilt));
        all.set_item("tilts", control::read_only(tilts))?;
        let joints = || self.live.running().machine.loose_joints.iter();
        all.set_item("sites", joints().flat_map(|joint| joint.sites()).collect::<Vec<String>>())?;
        let sites: Vec<SiteReport> = sites(frame).collect();
        all.set_item("gaps", control::read_only(PyArray1::from_iter(py, sites.iter().map(|site| site.gap))))?;
        all.set_item("site_normal_forces", vectors(py, sites.iter().map(|site| site.normal_force)))?;
        all.set_item("site_friction_forces", vectors(py, sites.iter().map(|site| site.friction_force)))?;
        all.set_item("contact_points", vectors(py, sites.iter().map(|site| site.contact_point)))?;
        Ok(all)
    }

    /// State vector: coordinates, then velocities, as the formulation orders them, SI.
    #[getter]
    fn vector<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        control::read_only(PyArray1::from_slice(py, self.live.state_vector()))
    }

    /// Impacts finished since the last call.
    #[pyo3(name = "_take_impacts")]
    fn take_impacts<'py>(&mut self, py: Python<'py>) -> PyResult<report::Impacts<'py>> {
        let mut impacts = Vec::new();
        impacts.extend(self.live.take_impacts());
        report::impacts(py, &self.live, &impacts)
    }

    /// Reasons to doubt the results so far.
    #[getter]
    fn doubts(&mut self, py: Python<'_>) -> PyResult<Vec<String>> {
        Ok(report::doubts(self.run(py)?))
    }

    /// Energy exchanged so far, J.
    #[getter]
    fn ledger<'py>(&mut self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        report::ledger(py, self.run(py)?)
    }

    /// Counters so far.
    #[getter]
    fn statistics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        report::statistics(py, &self.live)
    }
}

/// The places where the joints with play can touch: those that the frame lists, and for each joint with one place that.
fn sites(frame: &Frame) -> impl Iterator<Item = SiteReport> + '_ {
    let only = |joint: usize, report: &JointReport| {
        let &JointReport { penetration, normal_force, friction_force, contact_point, sliding, .. } = report;
        match report.state {
            ContactMode::Ideal => {
                let [normal_force, friction_force] = [Vec3::zeros(); 2];
                SiteReport { joint, gap: f64::INFINITY, normal_force, friction_force, contact_point, sliding }
            }
            _ => SiteReport { joint, gap: -penetration, normal_force, friction_force, contact_point, sliding },
        }
    };
    frame.joints.iter().enumerate().flat_map(move |(joint, report)| {
        let several = frame.sites_of(joint);
        several.is_empty().then(|| only(joint, report)).into_iter().chain(several.iter().copied())
    })
}

/// An array with one row per vector.
fn vectors(py: Python<'_>, vectors: impl Iterator<Item = Vec3>) -> Bound<'_, PyArray2<f64>> {
    let all: Vec<Vec3> = vectors.collect();
    control::read_only(PyArray2::from_owned_array(py, Array2::from_shape_fn((all.len(), 3), |(row, i)| all[row][i])))
}
