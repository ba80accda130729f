//! Names of the arguments of sweeps in error messages.

use std::fmt::{Display, Formatter, Result};

/// An argument of a sweep. `{}` writes the command-line option, `--discard`; `{:#}` writes the function argument,
/// `discard`. Errors that contain an argument forward this choice, so that users of the library print `{error:#}`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Argument {
    /// A parameter and its values.
    Vary,
    /// A parameter with a range.
    Over,
    /// Whether values vary in parallel.
    Zip,
    /// States from which points start.
    Start,
    /// Drive periods of a run.
    Periods,
    /// Section crossings of a run.
    Crossings,
    /// Transient periods or crossings to discard.
    Discard,
}

impl Argument {
    /// Command-line option and function argument.
    fn names(self) -> [&'static str; 2] {
        match self {
            Self::Vary => ["--vary", "vary"],
            Self::Over => ["--over", "over"],
            Self::Zip => ["--zip", "zip"],
            Self::Start => ["--start", "start"],
            Self::Periods => ["--periods", "periods"],
            Self::Crossings => ["--crossings", "crossings"],
            Self::Discard => ["--discard", "discard"],
        }
    }

    /// Writes the argument with `value`: `--discard 3` or `discard = 3`.
    pub(crate) fn write(self, value: impl Display, f: &mut Formatter<'_>) -> Result {
        let [option, name] = self.names();
        if f.alternate() { write!(f, "{name} = {value}") } else { write!(f, "{option} {value}") }
    }
}

impl Display for Argument {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let [option, name] = self.names();
        f.write_str(if f.alternate() { name } else { option })
    }
}
