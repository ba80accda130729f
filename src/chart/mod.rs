//! Charts as data. One description gives an SVG, from which PNG files are made.
//!
//! This module knows nothing of mechanisms and needs no display.

mod draw;
mod ink;
mod labels;
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

/// Scale of an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// Linear.
    #[default]
    Linear,
    /// Logarithmic; values that are not positive are not shown.
    Logarithmic,
}

/// An axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// Quantity, sentence case.
    pub label: String,
    /// Unit; empty for a pure number.
    pub unit: String,
    /// Linear or logarithmic.
    pub scale: Scale,
    /// Range; `None` follows the data.
    pub range: Option<(f64, f64)>,
}

impl Axis {
    /// A linear axis that follows the data.
    pub fn new(label: &str, unit: &str) -> Self {
        Self { label: label.to_owned(), unit: unit.to_owned(), ..Self::default() }
    }

    /// A logarithmic axis that follows the data.
    pub fn logarithmic(label: &str, unit: &str) -> Self {
        Self { scale: Scale::Logarithmic, ..Self::new(label, unit) }
    }
}

/// Shape of a marker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    /// Filled disc.
    Disc,
    /// Filled square.
    Square,
    /// Filled triangle, tip up.
    Triangle,
    /// Filled triangle, tip down.
    TriangleDown,
    /// Filled square standing on a corner.
    Diamond,
    /// Diagonal cross.
    Cross,
    /// Upright cross.
    Plus,
    /// Ring around other markers, to single them out.
    Ring,
}

/// Width of a line, pixels.
const LINE: f64 = 1.6;

/// Points drawn in one style.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend; empty for none.
    pub label: String,
    /// (x, y); a point that is not finite breaks the line.
    pub points: Vec<(f64, f64)>,
    /// Colour of line and markers.
    pub colour: Colour,
    /// Width of the line that joins the points, pixels.
    pub line: Option<f64>,
    /// Marker at each point.
    pub marker: Option<Marker>,
}

impl Series {
    /// A line without markers.
    pub fn line(label: &str, points: Vec<(f64, f64)>, colour: Colour) -> Self {
        Self { label: label.to_owned(), points, colour, line: Some(LINE), marker: None }
    }

    /// Markers without a line.
    pub fn dots(label: &str, points: Vec<(f64, f64)>, colour: Colour, marker: Marker) -> Self {
        Self { line: None, ..Self::line(label, points, colour).marked(marker) }
    }

    /// The same with a marker at each point.
    pub fn marked(self, marker: Marker) -> Self {
        Self { marker: Some(marker), ..self }
    }
}

/// Text at a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Label {
    /// Position, in axis units.
    pub at: (f64, f64),
    /// The text.
    pub text: String,
}

/// A horizontal line across the chart, with its name.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Value on the y axis.
    pub y: f64,
    /// Name, written along the line.
    pub text: String,
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
    /// Texts at points, placed so that they cover neither points nor each other.
    pub labels: Vec<Label>,
    /// Horizontal lines.
    pub levels: Vec<Level>,
}

impl Chart {
    /// Series over a pair of axes.
    pub fn new(title: &str, x: Axis, y: Axis, series: Vec<Series>) -> Self {
        Self { title: title.to_owned(), x, y, series, ..Self::default() }
    }
}
