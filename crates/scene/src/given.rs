//! What a scene's text gives: its numbers by key, and the parameters of its own.

use std::ops::Range;

use jointplay_physics::units::{Dimension, si_unit, unit_within};

/// A number that the scene was built from.
#[derive(Clone, Debug, PartialEq)]
pub struct FileNumber {
    /// SI.
    pub value: f64,
    /// Its dimension.
    pub dimension: Dimension,
    pub(super) place: Place,
    /// Unit in which the file writes it, or the SI one.
    pub(super) unit: &'static str,
}

/// Where in the scene's text a number is written: a range of bytes.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Place {
    /// The number alone.
    Value(Range<usize>),
    /// A vector in one text.
    Part(Range<usize>),
    /// In a file that the scene includes.
    Included,
    /// Nowhere: it has a default, and was changed.
    DefaultRule,
}

impl FileNumber {
    /// Written as `text` at `place`.
    pub(super) fn new(value: f64, dimension: Dimension, place: Place, text: &str) -> Self {
        Self { value, dimension, place, unit: unit_within(text, dimension).unwrap_or(si_unit(dimension)) }
    }
}

/// A parameter that a scene file defines.
#[derive(Clone, Debug, PartialEq)]
pub struct UserParameter {
    /// `parameter.<name>`.
    pub key: String,
    /// Name for the interface.
    pub label: String,
    /// What it is.
    pub help: String,
    /// Its dimension.
    pub dimension: Dimension,
    /// Unit in which it is shown.
    pub unit: &'static str,
    /// Closed range, SI; `None` if the file gives none.
    pub range: Option<(f64, f64)>,
    /// Value that the file gives, SI; `None` if that is an expression.
    pub default: Option<f64>,
}
