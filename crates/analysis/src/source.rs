//! A scene in transferable form for a thread or worker, and the errors of tasks.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::axis::RangeError;
use super::study::StudyError;
use super::sweep::SweepError;
use jointplay_physics::simulate::MAX_RUN_DURATION;
use jointplay_scene::{Scene, SceneError};

/// A scene in transferable form: its text and changes, which the receiver parses again.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SceneSource {
    /// The TOML text.
    pub text: String,
    /// File name, for messages.
    pub file: Option<String>,
    /// Changed parameters, in the syntax of the user.
    pub changes: Vec<(String, String)>,
    /// Contents of the files that the scene refers to, by name.
    pub beside: BTreeMap<String, String>,
}

impl SceneSource {
    /// The source of `scene`.
    pub fn of(scene: &Scene) -> Self {
        let texts = scene.source.beside.iter();
        Self {
            text: scene.source.text.to_string(),
            file: scene.source.file.clone(),
            changes: scene.changes.clone(),
            beside: texts.map(|(name, text)| (name.clone(), text.to_string())).collect(),
        }
    }

    /// Parses the scene.
    ///
    /// # Errors
    /// As [`Scene::parse`].
    pub fn scene(&self) -> Result<Scene, SceneError> {
        let texts = self.beside.iter();
        let beside = texts.map(|(name, text)| (name.clone(), text.as_str().into())).collect();
        Scene::parse_with(&self.text, self.file.as_deref(), &beside, &self.changes)
    }
}

/// Reasons why a task has no result.
#[derive(Debug, thiserror::Error)]
pub(super) enum TaskFault {
    #[error("cancelled")]
    Cancelled,
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Range(#[from] RangeError),
    #[error(transparent)]
    Sweep(#[from] SweepError),
    #[error(transparent)]
    Study(#[from] StudyError),
    #[error(
        "runs of {duration} s, observed from {from} s on: the observation must begin before the end, and a run may take at most \
         {MAX_RUN_DURATION:e} s"
    )]
    Span { duration: f64, from: f64 },
    #[error("drive phase {0}: allowed 0 to below 1 period")]
    Phase(f64),
    #[error(
        "{points} points with {kept} kept sections each are more than the window draws ({most} sections): take fewer values or \
         periods, or run `jointplay sweep`"
    )]
    TooManySections { points: usize, kept: usize, most: usize },
    #[error("{points} points are more than the window shows ({most}): take fewer values, or run `jointplay map`")]
    TooManyPoints { points: usize, most: usize },
}
