//! A machine compiled for simulation.

use std::sync::Arc;

use super::{IdealSource, Model, State, StateMismatch, Stepping, Workspace, doubts};
use crate::machine::Machine;
use crate::mechanism::{self, Mechanism};
use crate::simulate::{Doubt, Frame, StartError, Stopped};

impl Model {
    /// Compiles `machine` and computes its start.
    ///
    /// # Errors
    /// If joints with play do not close, or the rods cannot follow the prescribed trajectory.
    pub fn new(machine: &Machine) -> Result<Self, StartError> {
        Self::with_workspace(machine).map(|(model, _)| model)
    }

    /// The same, with a workspace for its states.
    pub(super) fn with_workspace(machine: &Machine) -> Result<(Self, Workspace), StartError> {
        let mut mechanism = Mechanism::new(machine)?;
        let y = mechanism.start()?;
        let start = State::new(machine.conditions(), &mechanism, y);
        let ideal = IdealSource::of(machine, mechanism.has_closed_form());
        let compiled = mechanism.model().clone();
        let mut model = Self { machine: machine.clone(), compiled, ideal, start };
        let mut workspace = model.workspace_in(mechanism, &model.start)?;
        let mut start = model.start.clone();
        Stepping::new(&model, &mut start, &mut workspace).begin()?;
        model.start = start;
        Ok((model, workspace))
    }

    fn workspace_in(&self, mechanism: Mechanism, state: &State) -> Result<Workspace, StartError> {
        Workspace::new(self, mechanism, state.conditions.solver.method)
    }

    /// A workspace attached to `state`, a state of this model.
    pub fn workspace(&self, state: &State) -> Workspace {
        let mechanism = Mechanism::from_model(&self.machine, self.compiled.clone());
        self.workspace_in(mechanism, state).expect("checked when the state adopted its method")
    }

    /// The state at t = 0.
    pub fn start(&self) -> State {
        self.start.clone()
    }

    /// The machine, as it starts.
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    /// The compiled equations.
    pub(super) fn compiled(&self) -> &Arc<mechanism::Model> {
        &self.compiled
    }

    /// Source of the ideal motion with which a probe is compared.
    pub(super) fn ideal(&self) -> &IdealSource {
        &self.ideal
    }

    /// Takes one accepted step.
    ///
    /// # Errors
    /// If the divergence guard stops the run; the state is then the last good one.
    ///
    /// # Panics
    /// A state or a workspace of another model.
    pub fn step(&self, state: &mut State, workspace: &mut Workspace) -> Result<(), Stopped> {
        Stepping::new(self, state, workspace).advance(f64::INFINITY)
    }

    /// Takes one step that ends no later than `end`, s, and exactly there if it would overshoot.
    ///
    /// # Errors
    /// As [`Self::step`].
    ///
    /// # Panics
    /// As [`Self::step`].
    pub fn step_until(&self, state: &mut State, workspace: &mut Workspace, end: f64) -> Result<(), Stopped> {
        if state.now.t >= end {
            return Ok(());
        }
        Stepping::new(self, state, workspace).advance(end)
    }

    /// Samples the state at `time`, s, interpolated within the latest step; forces come from the interpolated state. Allocates
    /// only while `out` is too small. The state does not change; `&mut` lets the workspace be attached to it. The error of a probe
    /// is missing if the ideal motion is simulated alongside, as a [`Simulation`](super::Simulation) does.
    ///
    /// # Panics
    /// As [`Self::step`].
    pub fn sample(&self, state: &mut State, workspace: &mut Workspace, time: f64, out: &mut Frame) {
        Stepping::new(self, state, workspace).sample(time, out);
    }

    /// Reasons not to trust the results since the start; empty if there are none. Begins with [`Machine::doubts`] of the machine
    /// under the state's conditions.
    pub fn doubts(&self, state: &State) -> Vec<Doubt> {
        doubts::doubts(self, state)
    }

    /// Checks a state that was read from a file.
    ///
    /// # Errors
    /// It cannot belong to a run of this model.
    pub fn check(&self, state: &State) -> Result<(), StateMismatch> {
        state.check(self, &self.start)
    }
}

impl std::fmt::Debug for Model {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Model").field("bodies", &self.machine.bodies.len()).finish_non_exhaustive()
    }
}
