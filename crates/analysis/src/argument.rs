//! How errors name the arguments of sweeps and studies.

use std::fmt::{Display, Formatter, Result};

/// An argument. `{}` writes the option of the command line, `--discard`; `{:#}` the argument of a function, `discard`. Errors that
/// carry one pass the choice on, so that a caller of a library prints `{error:#}`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Argument {
    /// A parameter and its values.
    Vary,
    /// A parameter with a range or distribution.
    Over,
    /// Whether values vary in parallel.
    Zip,
    /// Where points start from.
    Start,
    /// Drive periods of a run.
    Periods,
    /// Crossings of a section.
    Crossings,
    /// Periods or crossings of the transient.
    Discard,
    /// Rows of the design for sensitivity indices.
    Rows,
    /// Trajectories of a screening.
    Screen,
    /// Units of a lot.
    Units,
    /// Candidate fits and their costs.
    Cost,
}

impl Argument {
    /// Its option on the command line, and its name in a function.
    fn names(self) -> [&'static str; 2] {
        match self {
            Self::Vary => ["--vary", "vary"],
            Self::Over => ["--over", "over"],
            Self::Zip => ["--zip", "zip"],
            Self::Start => ["--start", "start"],
            Self::Periods => ["--periods", "periods"],
            Self::Crossings => ["--crossings", "crossings"],
            Self::Discard => ["--discard", "discard"],
            Self::Rows => ["--rows", "rows"],
            Self::Screen => ["--screen", "screen"],
            Self::Units => ["--runs", "units"],
            Self::Cost => ["--cost", "cost"],
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
