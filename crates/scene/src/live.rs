//! A running simulation with its scene, whose parameters can be changed.

use std::ops::{Deref, DerefMut};
use std::sync::Arc;

use super::{Scene, SceneError};
use jointplay_physics::simulate::{ChangeError, Effect, Model, Simulation, Snapshot, StartError, StateMismatch};

/// Why a parameter of a running scene was not changed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SetError {
    /// The scene rejects the key or value.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The running simulation rejects the change.
    #[error(transparent)]
    Change(#[from] ChangeError),
}

/// Changes of `scene` except those of `key`.
fn other_changes<'s>(scene: &'s Scene, key: &'s str) -> impl Iterator<Item = &'s (String, String)> {
    scene.changes.iter().filter(move |(other, _)| other != key)
}

/// A running simulation with its scene in effect, and a pending scene with the changes that wait for a reset.
#[derive(Clone)]
pub struct LiveScene {
    pending: Arc<Scene>,
    running: Arc<Scene>,
    /// Simulates the machine of `running`.
    simulation: Simulation,
}

/// A state of a [`LiveScene`]: resuming from it reproduces the same bits.
#[derive(Clone, Debug)]
pub struct SceneSnapshot {
    pending: Arc<Scene>,
    running: Arc<Scene>,
    model: Arc<Model>,
    snapshot: Snapshot,
}

impl SceneSnapshot {
    /// The scene with every change, including those that wait for a reset.
    pub fn pending(&self) -> &Scene {
        &self.pending
    }

    /// The scene in effect, without the changes that wait for a reset.
    pub fn running(&self) -> &Scene {
        &self.running
    }
}

impl Deref for SceneSnapshot {
    type Target = Snapshot;

    fn deref(&self) -> &Snapshot {
        &self.snapshot
    }
}

impl Deref for LiveScene {
    type Target = Simulation;

    fn deref(&self) -> &Simulation {
        &self.simulation
    }
}

impl DerefMut for LiveScene {
    fn deref_mut(&mut self) -> &mut Simulation {
        &mut self.simulation
    }
}

impl LiveScene {
    /// Starts `scene` at t = 0.
    ///
    /// # Errors
    /// Same as [`Simulation::new`].
    pub fn new(scene: &Scene) -> Result<Self, StartError> {
        let simulation = Simulation::new(&scene.machine)?;
        let scene = Arc::new(scene.clone());
        Ok(Self { pending: scene.clone(), running: scene, simulation })
    }

    /// The scene with every change, including those that wait for a reset.
    pub fn pending(&self) -> &Scene {
        &self.pending
    }

    /// The scene in effect, without the changes that wait for a reset.
    pub fn running(&self) -> &Scene {
        &self.running
    }

    /// Changes a parameter (`contact.clearance`, `joint.S1.friction`, …) to a value as a user writes it.
    ///
    /// # Errors
    /// Unknown key, wrong unit or value out of range; the running simulation is then unchanged.
    pub fn set(&mut self, key: &str, value: &str) -> Result<Effect, SetError> {
        self.change(key, |scene| scene.with(key, value))
    }

    /// Reverts the change of a parameter, like [`Scene::undo_change`].
    ///
    /// # Errors
    /// Same as [`Self::set`].
    pub fn undo_change(&mut self, key: &str) -> Result<Effect, SetError> {
        self.change(key, |scene| scene.without(key))
    }

    fn change(&mut self, key: &str, change: impl Fn(&Scene) -> Result<Scene, SceneError>) -> Result<Effect, SetError> {
        let pending = Arc::new(change(&self.pending)?);
        // The scene follows from its changes: nothing else waits, or only an earlier value of this key.
        let running = if other_changes(&self.running, key).eq(other_changes(&self.pending, key)) {
            Ok(pending.clone())
        } else {
            change(&self.running).map(Arc::new)
        };
        // A change may be valid only for the pending scene, e.g. for a joint of a longer chain.
        let effect = match &running {
            Ok(running) => self.simulation.adopt(&running.machine)?,
            Err(_) => Effect::AtReset,
        };
        if let (Effect::Now, Ok(running)) = (effect, running) {
            self.running = running;
        }
        self.pending = pending;
        Ok(effect)
    }

    /// Restarts at t = 0 with all changes, including those that wait for a reset.
    ///
    /// # Errors
    /// Same as [`Simulation::new`]; `self` is then unchanged.
    pub fn reset(&mut self) -> Result<(), StartError> {
        self.simulation = Simulation::new(&self.pending.machine)?;
        self.running = self.pending.clone();
        Ok(())
    }

    /// Continues from a stored state of a run that started like this one. `running` and `pending` are the scenes in effect
    /// and with all changes at that time.
    ///
    /// # Errors
    /// A state that cannot belong to this scene, or that has other conditions than `running`; `self` is then unchanged.
    pub fn resume_changed(&mut self, snapshot: &Snapshot, running: Scene, pending: Scene) -> Result<(), StateMismatch> {
        let machine = self.simulation.machine();
        if !machine.differs_only_in_conditions(&running.machine)
            || *snapshot.conditions() != running.machine.conditions()
        {
            return Err(StateMismatch);
        }
        let mut snapshot = snapshot.clone();
        snapshot.adopt_elements(self.simulation.model(), &running.machine);
        self.simulation.resume(&snapshot)?;
        self.running = Arc::new(running);
        self.pending = Arc::new(pending);
        Ok(())
    }

    /// Captures the complete state.
    pub fn snapshot(&self) -> SceneSnapshot {
        SceneSnapshot {
            pending: self.pending.clone(),
            running: self.running.clone(),
            model: self.simulation.model().clone(),
            snapshot: self.simulation.snapshot(),
        }
    }

    /// Restores a state of this scene, at the cost of a copy, or of any other scene.
    pub fn restore(&mut self, snapshot: &SceneSnapshot) {
        if Arc::ptr_eq(self.simulation.model(), &snapshot.model) {
            self.simulation.restore(&snapshot.snapshot);
        } else {
            self.simulation = Simulation::from_snapshot(snapshot.model.clone(), snapshot.snapshot.clone());
        }
        self.pending = snapshot.pending.clone();
        self.running = snapshot.running.clone();
    }
}
