//! Errors in scenes and parameters: file, line, column, key, value, range, unit.

/// What is wrong with a scene or a parameter value, in a form a person can act on.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{message}")]
pub struct SceneError {
    /// File as the user named it; `None` for a built-in scene or the command line.
    pub file: Option<String>,
    /// Line and column, from 1.
    pub position: Option<(usize, usize)>,
    /// Key at fault, e.g. `joint.S1.clearance`.
    pub key: Option<String>,
    /// The whole story in one or two lines.
    pub message: String,
}
