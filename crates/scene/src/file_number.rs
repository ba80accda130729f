//! Numbers parsed from the scene file.

use std::ops::Range;

use jointplay_physics::units::{Dimension, si_unit, unit_of_quantity};

/// A number parsed from the scene file.
#[derive(Clone, Debug, PartialEq)]
pub struct FileNumber {
    /// Value, SI.
    pub value: f64,
    /// Physical dimension.
    pub dimension: Dimension,
    /// Closed range that the reader allows independently of other numbers, SI; infinite without a limit.
    pub(super) range: (f64, f64),
    pub(super) place: Place,
    /// Unit used in the file, or the SI unit if the text names none.
    pub(super) unit: &'static str,
}

/// Location of a number in the scene's text, as a byte range.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Place {
    /// A single number.
    Value(Range<usize>),
    /// A component of a vector written as one string; the range covers the string.
    Part(Range<usize>),
    /// In an included file.
    Included,
    /// Not in the text: a default that was changed.
    ChangedDefault,
}

impl FileNumber {
    /// A number in `range`, written as `text` at `place`.
    pub(super) fn new(value: f64, dimension: Dimension, range: (f64, f64), place: Place, text: &str) -> Self {
        Self { value, dimension, range, place, unit: unit_of_quantity(text, dimension).unwrap_or(si_unit(dimension)) }
    }
}
