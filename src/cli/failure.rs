//! Reason why a command ended early: a message, and the exit code for scripts.

use std::path::PathBuf;

use crate::files::FileError;
use crate::scene::SceneError;

/// A message for a person and a code for a script.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct Failure {
    /// Exit code of the process.
    pub code: u8,
    /// One or two lines for standard error.
    pub message: String,
}

impl Failure {
    /// Something could not be read or written.
    pub const INPUT_OUTPUT: u8 = 1;
    /// Bad input or usage.
    pub const USAGE: u8 = 2;
    /// No graphics adapter.
    pub const NO_ADAPTER: u8 = 3;
    /// The divergence guard stopped the run.
    pub const DIVERGED: u8 = 4;
    /// A link does not lead to the state that it names.
    pub const MISSED: u8 = 5;
    /// Ctrl-C.
    pub const INTERRUPTED: u8 = 130;

    /// A failure with the given code.
    pub fn new(code: u8, message: impl Into<String>) -> Self {
        Self { code, message: message.into() }
    }

    /// The failure of a command whose incomplete result is in the files or folders `beside` instead of replacing an older one.
    pub fn with_result_in(mut self, beside: &[PathBuf]) -> Self {
        if !beside.is_empty() {
            let names: Vec<String> = beside.iter().map(|path| path.display().to_string()).collect();
            self.message += &format!("; the older result stays, the incomplete one is in {}", names.join(", "));
        }
        self
    }

    /// Something could not be read or written.
    pub fn io(message: impl Into<String>) -> Self {
        Self::new(Self::INPUT_OUTPUT, message)
    }

    /// Bad input or usage.
    pub fn usage(message: impl Into<String>) -> Self {
        Self::new(Self::USAGE, message)
    }
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        let code = if error.unreadable { Self::INPUT_OUTPUT } else { Self::USAGE };
        Self::new(code, error.to_string())
    }
}

impl From<FileError> for Failure {
    fn from(error: FileError) -> Self {
        let advice = match error {
            FileError::Exists(_) => "; add --force to replace it, or choose another name",
            FileError::NotEmpty(_) => "; add --force to replace it, or choose another folder",
            FileError::Cannot { .. } => "",
        };
        Self::io(format!("{error}{advice}"))
    }
}
