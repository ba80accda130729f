//! A scene in motion: a running simulation, and the scene whose parameters change it.

use std::ops::{Deref, DerefMut};
use std::sync::Arc;

use super::{Scene, SceneError, Value};
use jointplay_physics::simulate::{ChangeError, Effect, Simulation, Snapshot, StartError};

/// Why a parameter of a running scene was not changed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SetError {
    /// A key or value that the scene does not accept.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A change that the running simulation does not accept.
    #[error(transparent)]
    Change(#[from] ChangeError),
}

/// A running simulation with its scene: as it is running, and as it is wanted, with the changes that wait for a reset.
pub struct LiveScene {
    pending: Arc<Scene>,
    running: Arc<Scene>,
    /// Of the machine of `running`.
    simulation: Simulation,
}

/// A state of a [`LiveScene`]: resuming from it reproduces the same bits.
#[derive(Clone, Debug)]
pub struct SceneSnapshot {
    pending: Arc<Scene>,
    running: Arc<Scene>,
    simulation: Snapshot,
}

impl Deref for SceneSnapshot {
    type Target = Snapshot;

    fn deref(&self) -> &Snapshot {
        &self.simulation
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
    /// As [`Simulation::new`].
    pub fn new(scene: &Scene) -> Result<Self, StartError> {
        let simulation = Simulation::new(&scene.machine)?;
        let scene = Arc::new(scene.clone());
        Ok(Self { pending: scene.clone(), running: scene, simulation })
    }

    /// The scene with every change, including those that wait for a reset.
    pub fn pending(&self) -> &Scene {
        &self.pending
    }

    /// The scene as it is running: without the changes that wait for a reset.
    pub fn running(&self) -> &Scene {
        &self.running
    }

    /// Changes a parameter (`contact.clearance`, `joint.S1.friction`, …) to a value as a user writes it.
    ///
    /// # Errors
    /// Unknown key, bad unit, out of range: the running simulation is unchanged.
    pub fn set(&mut self, key: &str, value: &str) -> Result<Effect, SetError> {
        self.change(|scene| scene.set(key, value).map(|_| ()))
    }

    /// As [`Self::set`], with a value in SI units.
    ///
    /// # Errors
    /// As [`Self::set`].
    pub fn set_value(&mut self, key: &str, value: &Value) -> Result<Effect, SetError> {
        self.change(|scene| scene.set_value(key, value).map(|_| ()))
    }

    fn change(&mut self, change: impl Fn(&mut Scene) -> Result<(), SceneError>) -> Result<Effect, SetError> {
        let mut pending = Scene::clone(&self.pending);
        change(&mut pending)?;
        let mut running = Scene::clone(&self.running);
        // What the running scene cannot accept may suit the pending one, say a joint of a longer chain.
        let effect = match change(&mut running) {
            Ok(()) => self.simulation.adopt(&running.machine)?,
            Err(_) => Effect::AtReset,
        };
        if effect == Effect::Now {
            self.running = Arc::new(running);
        }
        self.pending = Arc::new(pending);
        Ok(effect)
    }

    /// Back to t = 0 with the current parameters, including those that wait for a reset.
    ///
    /// # Errors
    /// As [`Simulation::new`]; nothing has changed then.
    pub fn reset(&mut self) -> Result<(), StartError> {
        self.simulation = Simulation::new(&self.pending.machine)?;
        self.running = self.pending.clone();
        Ok(())
    }

    /// The whole state.
    pub fn snapshot(&self) -> SceneSnapshot {
        SceneSnapshot {
            pending: self.pending.clone(),
            running: self.running.clone(),
            simulation: self.simulation.snapshot(),
        }
    }

    /// A scene in the state of `snapshot`, as [`Simulation::of`].
    pub fn of(snapshot: &SceneSnapshot) -> Self {
        Self {
            pending: snapshot.pending.clone(),
            running: snapshot.running.clone(),
            simulation: Simulation::of(&snapshot.simulation),
        }
    }

    /// Restores a state of this scene, or of any other, as [`Simulation::restore`].
    pub fn restore(&mut self, snapshot: &SceneSnapshot) {
        self.simulation.restore(&snapshot.simulation);
        self.pending = snapshot.pending.clone();
        self.running = snapshot.running.clone();
    }
}
