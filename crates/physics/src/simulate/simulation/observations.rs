//! What looking at a run has found: it belongs to the run, but no step depends on it.

use serde::{Deserialize, Serialize};

use super::{IdealSource, IdealState, IdealWorkspace, Model, State, StateMismatch, Stepping, Workspace};
use crate::machine::{AppliedForces, Machine};
use crate::simulate::{Frame, LoadPeaks};

/// Interval at which non-contact loads are recorded, s, if steps are shorter and no contact is near its peak.
const LOADS_EVERY: f64 = 1e-4;

/// The largest sampled values of a run, and the ideal motion with which its samples are compared.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Observations {
    /// Largest sampled force, N, and its time, s, by loose joint.
    sampled: Vec<(f64, f64)>,
    /// Load peaks, if tracked.
    loads: Option<LoadPeaks>,
    /// The ideal motion, if it is simulated alongside.
    ideal: Option<Box<IdealState>>,
}

/// A state of a run, and what looking at the run has found: a simulation continues from it with the same bits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Snapshot {
    pub(super) state: State,
    pub(super) observations: Observations,
}

impl std::ops::Deref for Snapshot {
    type Target = State;

    fn deref(&self) -> &State {
        &self.state
    }
}

impl Snapshot {
    /// Approximate size in bytes, rounded up.
    pub fn bytes(&self) -> usize {
        self.state.bytes() + self.observations.ideal.as_ref().map_or(0, |ideal| ideal.bytes())
    }

    /// This snapshot, which was written and read, with the elements of the one that was written, which a file leaves to its scene.
    pub fn with_elements_of(mut self, written: &Self) -> Self {
        self.state.elements.share(&written.state.elements);
        if let (Some(own), Some(other)) = (&mut self.observations.ideal, &written.observations.ideal) {
            own.share_elements(other);
        }
        self
    }

    /// Takes over the elements of `next`, the machine of the scene in effect, which act in it already. A snapshot that was read does
    /// not have them.
    pub fn adopt_elements(&mut self, model: &Model, next: &Machine) {
        self.state.elements.adopt(model.machine(), next);
        if let (Some(source), Some(ideal)) = (model.ideal().simulated(), self.observations.ideal.as_deref_mut()) {
            ideal.adopt_elements(source, next);
        }
    }

    /// Checks a snapshot that was read from a file.
    ///
    /// # Errors
    /// It cannot belong to a run of `model`.
    pub(super) fn check(&self, model: &Model) -> Result<(), StateMismatch> {
        model.check(&self.state)?;
        let Observations { sampled, loads, ideal } = &self.observations;
        let fits = sampled.len() == model.machine().loose_joints.len()
            && loads.as_ref().is_none_or(|loads| loads.fits(&LoadPeaks::new(model.machine())));
        match (ideal, model.ideal().simulated()) {
            _ if !fits => Err(StateMismatch),
            (None, None) => Ok(()),
            (Some(ideal), Some(own)) => ideal.check(own),
            _ => Err(StateMismatch),
        }
    }
}

impl Observations {
    /// At the start of a run of `model`.
    pub(super) fn new(model: &Model) -> Self {
        Self {
            sampled: vec![(0.0, 0.0); model.machine().loose_joints.len()],
            loads: None,
            ideal: model.ideal().start(),
        }
    }

    /// A workspace for the ideal motion.
    pub(super) fn workspace(&self, model: &Model) -> Option<Box<IdealWorkspace>> {
        model.ideal().simulated().zip(self.ideal.as_ref()).map(|(ideal, state)| ideal.workspace(state))
    }

    /// The ideal motion.
    pub(super) fn ideal(&self) -> Option<&IdealState> {
        self.ideal.as_deref()
    }

    /// Load peaks, if tracked.
    pub(super) fn loads(&self) -> Option<&LoadPeaks> {
        self.loads.as_ref()
    }

    /// The larger of `found`, of joint `j` (N, s), and its largest sampled force.
    pub(super) fn peak(&self, j: usize, found: (f64, f64)) -> (f64, f64) {
        if self.sampled[j].0 > found.0 { self.sampled[j] } else { found }
    }

    /// Tracks load peaks from the state of `run` on.
    pub(super) fn track_loads(&mut self, mut run: Stepping<'_>) {
        self.loads = Some(LoadPeaks::new(run.machine));
        self.record_loads(&mut run);
    }

    /// Records the loads at the end of the step of `run` just taken, if one is due.
    pub(super) fn observe_step(&mut self, mut run: Stepping<'_>) {
        let Some(loads) = &self.loads else {
            return;
        };
        let smooth = run.mechanism.contacts.is_empty();
        if run.attempt.is_near_peak || smooth || loads.age(run.state.now.t) >= LOADS_EVERY {
            self.record_loads(&mut run);
        }
    }

    /// Records the loads at the latest state.
    fn record_loads(&mut self, run: &mut Stepping<'_>) {
        let time = run.state.now.t;
        run.evaluate_at(time);
        if let Some(loads) = &mut self.loads {
            loads.evaluate(run.mechanism, time);
        }
    }

    /// Records the sample `out`, just evaluated in `workspace`, and completes it with the error of its probe.
    pub(super) fn observe_sample(
        &mut self,
        model: &Model,
        workspace: &mut Workspace,
        ideal: Option<&mut IdealWorkspace>,
        out: &mut Frame,
    ) {
        for (sampled, report) in self.sampled.iter_mut().zip(&out.joints) {
            let force = report.normal_force.norm();
            if force > sampled.0 {
                *sampled = (force, out.time);
            }
        }
        if let Some(loads) = &mut self.loads {
            loads.record(&mut workspace.mechanism, out.time);
        }
        if let IdealSource::Simulated(source) = model.ideal() {
            let both = self.ideal.as_deref_mut().zip(ideal);
            out.probe_error = both.and_then(|(state, work)| source.error(state, work, out));
        }
    }

    /// Lets `forces` act on the ideal motion from `time`, s, on.
    pub(super) fn set_applied_forces(
        &mut self,
        model: &Model,
        ideal: Option<&mut IdealWorkspace>,
        (time, forces): (f64, &AppliedForces),
    ) {
        if let (Some(source), Some((state, work))) = (model.ideal().simulated(), self.ideal.as_deref_mut().zip(ideal)) {
            source.set_applied_forces(state, work, time, forces);
        }
    }
}
