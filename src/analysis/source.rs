//! A scene in transferable form for a thread or worker, and why a task has no result.

use serde::{Deserialize, Serialize};

use super::AnalysisError;
use crate::scene::{Scene, SceneError};

/// A scene in transferable form: text and changes, from which it is parsed again.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SceneSource {
    /// The TOML text.
    pub text: String,
    /// Its file, for messages.
    pub file: Option<String>,
    /// Changed parameters, as a user writes them.
    pub changes: Vec<(String, String)>,
}

impl SceneSource {
    /// The source of `scene`.
    pub fn of(scene: &Scene) -> Self {
        Self {
            text: scene.source.text.clone(),
            file: scene.source.file.clone(),
            changes: scene.changes.clone(),
        }
    }

    /// Parses the scene.
    ///
    /// # Errors
    /// As [`Scene::parse`].
    pub fn scene(&self) -> Result<Scene, SceneError> {
        Scene::parse(&self.text, self.file.as_deref(), &self.changes)
    }
}

/// Why there is no result.
pub(super) enum TaskFault {
    Cancelled,
    Said(String),
}

impl From<AnalysisError> for TaskFault {
    fn from(error: AnalysisError) -> Self {
        match error {
            AnalysisError::Cancelled => Self::Cancelled,
            other => Self::Said(other.to_string()),
        }
    }
}

impl From<SceneError> for TaskFault {
    fn from(error: SceneError) -> Self {
        Self::Said(error.to_string())
    }
}
