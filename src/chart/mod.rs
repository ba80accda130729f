//! Charts as data, and their pictures: one description gives an SVG, and a PNG that is drawn from it.
//!
//! Knows nothing of mechanisms and needs no screen.

mod draw;
mod heat;
mod ink;
mod labels;
mod png;
mod thin;
mod ticks;

pub use draw::Sheet;
pub use ink::SheetError;

/// A colour, red, green, blue.
pub type Colour = (u8, u8, u8);

/// Colours that people with any kind of colour vision tell apart (Okabe & Ito, "Color universal design"), dark enough for lines
/// on white; the first is for what all others are compared with.
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

/// How an axis counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences.
    #[default]
    Linear,
    /// Equal ratios; what is not positive does not appear.
    Logarithmic,
}

/// An axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// Quantity, sentence case.
    pub label: String,
    /// Unit, "" for a pure number.
    pub unit: String,
    /// How it counts.
    pub scale: Scale,
    /// Ends; `None` follows the data.
    pub range: Option<(f64, f64)>,
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
    /// Filled square on its corner.
    Diamond,
    /// Two crossing strokes.
    Cross,
    /// Two upright strokes.
    Plus,
    /// Ring around other markers, to single them out.
    Ring,
    /// Small disc.
    Point,
    /// Smallest dot, for clouds of many points.
    Dot,
}

/// Points with one look.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend; "" leaves it out.
    pub label: String,
    /// (x, y); a point that is not finite breaks the line.
    pub points: Vec<(f64, f64)>,
    /// Colour of line and markers.
    pub colour: Colour,
    /// Whether a line joins the points.
    pub line: bool,
    /// What stands at the points.
    pub marker: Option<Marker>,
}

/// Text at a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Label {
    /// Where, in the units of the axes.
    pub at: (f64, f64),
    /// What.
    pub text: String,
}

/// A straight line across the chart, with its name.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Value on the y axis.
    pub y: f64,
    /// Name, written over the line.
    pub text: String,
}

/// A field of cells whose colours are values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Map {
    /// Middles of the cells along the horizontal axis, ascending.
    pub xs: Vec<f64>,
    /// Middles of the cells along the vertical axis, ascending.
    pub ys: Vec<f64>,
    /// Values row by row, from the lowest row; one that is not finite is grey.
    pub values: Vec<f64>,
    /// How values count, and their unit.
    pub scale: Axis,
    /// For kinds instead of sizes: the value of each kind and its name. Empty for sizes.
    pub names: Vec<(f64, String)>,
}

/// One pair of axes with what is in it.
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
    /// Lines across.
    pub levels: Vec<Level>,
    /// Cells under everything else.
    pub map: Option<Map>,
}
