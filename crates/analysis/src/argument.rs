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
    /// A table of points.
    Points,
    /// States from which points start.
    Start,
    /// Drive periods of a run.
    Periods,
    /// Phase of the sections.
    Phase,
    /// Time between two sections.
    Period,
    /// Length of a run.
    Duration,
    /// End of the transient of a run.
    From,
    /// Condition of the sections.
    Section,
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
            Self::Points => ["--points", "points"],
            Self::Start => ["--start", "start"],
            Self::Periods => ["--periods", "periods"],
            Self::Phase => ["--phase", "phase"],
            Self::Period => ["--period", "period"],
            Self::Duration => ["--duration", "duration"],
            // `from` is a word of Python.
            Self::From => ["--from", "from_"],
            Self::Section => ["--section", "section"],
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
