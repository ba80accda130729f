//! Charts as data. One description gives an SVG, from which PNG files are made.
//!
//! This module knows nothing of mechanisms and needs no display.

mod draw;
mod ink;
mod png;
mod thin;
mod ticks;

pub use draw::Sheet;
pub use ink::SheetError;

/// A colour, red, green, blue.
pub type Colour = (u8, u8, u8);

/// Colours distinguishable with any kind of colour vision (Okabe & Ito, "Color universal design"), dark enough for lines on
/// white; the first is for the reference.
pub const PALETTE: [Colour; 8] = [
    (0, 0, 0),
    (0, 114, 178),
    (213, 94, 0),
    (0, 158, 115),
    (204, 121, 167),
    (230, 159, 0),
    (86, 180, 233),
    (117, 112, 79),
];

/// An axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// Quantity, sentence case.
    pub label: String,
    /// Unit; empty for a pure number.
    pub unit: String,
    /// Range; `None` follows the data.
    pub range: Option<(f64, f64)>,
}

impl Axis {
    /// An axis that follows the data.
    pub fn new(label: &str, unit: &str) -> Self {
        Self { label: label.to_owned(), unit: unit.to_owned(), ..Self::default() }
    }
}

/// Width of a line, pixels.
const LINE: f64 = 1.6;

/// A line.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend; empty for none.
    pub label: String,
    /// (x, y); a point that is not finite breaks the line.
    pub points: Vec<(f64, f64)>,
    /// Its colour.
    pub colour: Colour,
}

impl Series {
    /// A line through `points`.
    pub fn line(label: &str, points: Vec<(f64, f64)>, colour: Colour) -> Self {
        Self { label: label.to_owned(), points, colour }
    }
}

/// One pair of axes with its contents.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chart {
    /// Title, sentence case.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Drawn in this order.
    pub series: Vec<Series>,
}

impl Chart {
    /// Series over a pair of axes.
    pub fn new(title: &str, x: Axis, y: Axis, series: Vec<Series>) -> Self {
        Self { title: title.to_owned(), x, y, series }
    }
}
