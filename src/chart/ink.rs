//! Drawing primitives of charts and maps.

use plotters::coord::Shift;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::Colour;
use super::ticks::Ruler;

/// Why a chart could not be drawn.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("cannot draw the chart: {0}")]
pub struct SheetError(pub(super) String);

/// Drawing units per pixel, because the drawing library uses integers.
pub(super) const FINE: u32 = 4;

pub(super) const TEXT: f64 = 12.0;

pub(super) const INK: Colour = (30, 30, 30);

pub(super) const FAINT: Colour = (110, 110, 110);

pub(super) type Canvas<'a> = DrawingArea<SVGBackend<'a>, Shift>;

pub(super) type Plot<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Ruler, Ruler>>;

impl Ranged for Ruler {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, place: &f64, (first, last): (i32, i32)) -> i32 {
        let theta = (place - self.from) / (self.to - self.from);
        first + (f64::from(last - first) * theta).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() { self.minor.clone() } else { self.ticks.clone() }
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.from..self.to
    }
}

pub(super) fn fine(pixels: f64) -> i32 {
    (pixels * f64::from(FINE)).round() as i32
}

pub(super) fn rgb((r, g, b): Colour) -> RGBColor {
    RGBColor(r, g, b)
}

pub(super) fn failed(error: impl std::fmt::Display) -> SheetError {
    SheetError(error.to_string())
}

pub(super) fn style(size: f64, colour: Colour, horizontal: HPos, vertical: VPos) -> TextStyle<'static> {
    // The library takes the line height, 1.24 times the letter size.
    TextStyle {
        font: ("sans-serif", 1.24 * size * f64::from(FINE)).into_font(),
        color: rgb(colour).to_backend_color(),
        pos: Pos::new(horizontal, vertical),
    }
}

pub(super) fn write(root: &Canvas, text: &str, (x, y): (f64, f64), style: &TextStyle) -> Result<(), SheetError> {
    let at = (fine(x), fine(y));
    root.draw(&Text::new(text.to_owned(), at, style.clone())).map_err(failed)
}
