//! Scratch memory in which a state is stepped.

use std::sync::atomic::{AtomicU64, Ordering};

use super::automatic::prepare_implicit;
use super::{Attempt, JointState, Model, State, StepEnd, Workspace, WorkspaceId};
use crate::contact::ContactState;
use crate::integrate::Method;
use crate::mechanism::Mechanism;
use crate::simulate::StartError;
use crate::simulate::stepper::AnyStepper;

impl WorkspaceId {
    fn next() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(1);
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }

    fn is_same(&self, other: &Self) -> bool {
        self.0 != 0 && self.0 == other.0
    }
}

impl Clone for WorkspaceId {
    fn clone(&self) -> Self {
        Self::default()
    }
}

/// Equal states may be attached to different workspaces.
impl PartialEq for WorkspaceId {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Workspace {
    /// A workspace for the states of `model` in which `mechanism` evaluates.
    ///
    /// # Errors
    /// The method is too costly for the equations.
    pub(super) fn new(model: &Model, mechanism: Mechanism, method: Method) -> Result<Self, StartError> {
        let (n, contacts) = (mechanism.dimension(), mechanism.contacts.len());
        let mut workspace = Self {
            stepper: AnyStepper::new(method, n),
            before: StepEnd::new(vec![0.0; n], contacts),
            attempt: Attempt::new(model.machine(), n, contacts),
            scratch_y: vec![0.0; n],
            scratch_k: vec![0.0; n],
            scratch_contacts: vec![ContactState::default(); contacts],
            workspace_id: WorkspaceId::default(),
            mechanism,
        };
        prepare_implicit(&mut workspace.mechanism, method)?;
        Ok(workspace)
    }

    /// Equations of motion at the latest evaluation.
    pub fn mechanism(&self) -> &Mechanism {
        &self.mechanism
    }

    /// Prepares to step `state`, if the workspace is attached to another.
    pub(super) fn attach_to(&mut self, model: &Model, state: &mut State) {
        assert!(self.mechanism.belongs_to(model.compiled()), "a workspace of another model");
        if self.workspace_id.is_same(&state.workspace_id) {
            return;
        }
        let number = WorkspaceId::next();
        state.workspace_id = WorkspaceId(number.0);
        self.workspace_id = number;
        let method = state.conditions.solver.method;
        if method != self.stepper.method() {
            prepare_implicit(&mut self.mechanism, method).expect("checked when the state adopted the method");
            self.stepper = AnyStepper::new(method, state.now.y.len());
        }
        self.stepper.invalidate();
        self.stepper.choose(state.control.scheme);
        // The interpolant of the latest step is not part of the state.
        self.before.copy_from(&state.now);
        self.attempt.clear();
        self.mechanism.forget_evaluation();
        sync_parameters(&mut self.mechanism, model, state);
        let flights = &state.flights;
        self.mechanism.suspend(|body| flights[body].is_some());
    }
}

/// Prepares the equations for the conditions, clearances and pull of `state`.
pub(super) fn sync_parameters(mechanism: &mut Mechanism, model: &Model, state: &State) {
    mechanism.forget_evaluation();
    mechanism.set_elements(model.machine(), &state.elements).expect("checked when the state adopted them");
    mechanism.gravity = state.conditions.gravity;
    mechanism.set_quarter_turns(state.now.t, state.quarter_turns.iter().chain(&state.record.quarter_turns));
    if mechanism.pull() != state.pull {
        mechanism.set_pull(model.machine(), state.pull);
    }
    for (j, contact) in state.conditions.joints.iter().enumerate() {
        if !contact.is_ideal() {
            let JointState { plays, ramps, worn, .. } = state.joints[j];
            mechanism.contacts.set_joint(j, contact, (plays, ramps), (state.now.t, worn));
        }
    }
    for (c, depths) in state.profiles.iter().enumerate() {
        mechanism.contacts.continue_profile(c, f64::NEG_INFINITY, depths);
    }
}
