//! Heat maps: a field of cells coloured by value, with the colour scale beside it.

use plotters::prelude::*;

use super::ink::{Canvas, FAINT, FINE, INK, Plot, SheetError, TEXT, failed, fine, rgb, style, write};
use super::ticks::Ruler;
use super::{Axis, Colour, Map, PALETTE};
use plotters::style::text_anchor::{HPos, VPos};

/// Width of the scale with its labels, pixels.
pub(super) const SCALE_WIDTH: f64 = 92.0;
const BAR_WIDTH: f64 = 16.0;
const NO_VALUE: Colour = (225, 225, 225);

/// Mapping from a map's values to colours.
pub(super) struct ColourScale {
    ruler: Ruler,
}

impl ColourScale {
    pub(super) fn new(map: &Map) -> Self {
        let axis = Axis { label: String::new(), range: None, ..map.scale.clone() };
        let mut ruler = Ruler::new(&axis, map.values.iter().copied());
        // The scale ends at the extreme values.
        let (from, to) = map
            .values
            .iter()
            .map(|v| ruler.position(*v))
            .filter(|v| v.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        if from < to {
            (ruler.from, ruler.to) = (from, to);
            ruler.ticks.retain(|t| (from..=to).contains(t));
        }
        Self { ruler }
    }

    fn colour(&self, map: &Map, value: f64) -> Colour {
        if !map.names.is_empty() {
            let index = map.names.iter().position(|(code, _)| *code == value);
            return index.map_or(NO_VALUE, |n| PALETTE[(n + 1) % PALETTE.len()]);
        }
        let position = self.ruler.position(value);
        if !position.is_finite() {
            return NO_VALUE;
        }
        let RGBColor(r, g, b) = ViridisRGB.get_color_normalized(position, self.ruler.from, self.ruler.to);
        (r, g, b)
    }
}

/// The edges of cells around `centres`: midway between them; the outermost cells end at their centres.
fn edges(centres: &[f64]) -> Vec<f64> {
    let Some((&first, &last)) = centres.first().zip(centres.last()) else {
        return Vec::new();
    };
    if centres.len() < 2 {
        let half = if first == 0.0 { 0.5 } else { 0.5 * first.abs() };
        return vec![first - half, first + half];
    }
    let middles: Vec<f64> = centres.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
    [&[first], &middles[..], &[last]].concat()
}

/// Ends of the cells along both axes, for the axes to include.
pub(super) fn ends(map: &Map) -> Vec<(f64, f64)> {
    let (xs, ys) = (edges(&map.xs), edges(&map.ys));
    let corner = |(x, y): (Option<&f64>, Option<&f64>)| Some((*x?, *y?));
    [(xs.first(), ys.first()), (xs.last(), ys.last())].into_iter().filter_map(corner).collect()
}

/// Draws the cells.
pub(super) fn cells(root: &Canvas, plot: &Plot, map: &Map, x: &Ruler, y: &Ruler) -> Result<(), SheetError> {
    let colour_scale = ColourScale::new(map);
    let (xs, ys) = (edges(&map.xs), edges(&map.ys));
    for (j, rows) in ys.windows(2).enumerate() {
        for (i, columns) in xs.windows(2).enumerate() {
            let value = map.values.get(j * map.xs.len() + i).copied().unwrap_or(f64::NAN);
            let a = plot.backend_coord(&(x.position(columns[0]), y.position(rows[0])));
            let b = plot.backend_coord(&(x.position(columns[1]), y.position(rows[1])));
            let filled = rgb(colour_scale.colour(map, value)).filled();
            // Overlaps the next cells, which are drawn on top, to avoid seams.
            let overlap = |edge: usize, cells: usize| if edge + 1 < cells { 2 } else { 0 };
            let b = (b.0 + overlap(i, map.xs.len()), b.1 - overlap(j, map.ys.len()));
            root.draw(&Rectangle::new([a, b], filled)).map_err(failed)?;
        }
    }
    Ok(())
}

/// Draws the scale in the column of width [`SCALE_WIDTH`] from `left`, between `top` and `bottom`, pixels.
pub(super) fn scale(root: &Canvas, map: &Map, left: f64, top: f64, bottom: f64) -> Result<(), SheetError> {
    let colour_scale = ColourScale::new(map);
    let words = style(TEXT, INK, HPos::Left, VPos::Center);
    let patch = |from: f64, to: f64, colour: Colour| {
        let corners = [(fine(left), fine(from)), (fine(left + BAR_WIDTH), fine(to))];
        root.draw(&Rectangle::new(corners, rgb(colour).filled())).map_err(failed)
    };
    if !map.names.is_empty() {
        for (n, (code, name)) in map.names.iter().enumerate() {
            let y = top + 20.0 * n as f64;
            patch(y, y + 14.0, colour_scale.colour(map, *code))?;
            write(root, name, (left + BAR_WIDTH + 6.0, y + 7.0), &words)?;
        }
        return Ok(());
    }
    const PARTS: u32 = 64;
    let at = |share: f64| bottom + (top - bottom) * share;
    let ruler = &colour_scale.ruler;
    for n in 0..PARTS {
        let (a, b) = (f64::from(n) / f64::from(PARTS), f64::from(n + 1) / f64::from(PARTS));
        let position = ruler.from + (ruler.to - ruler.from) * 0.5 * (a + b);
        let RGBColor(r, g, bl) = ViridisRGB.get_color_normalized(position, ruler.from, ruler.to);
        patch((at(b) - 0.5).max(top), at(a), (r, g, bl))?;
    }
    for tick in &ruler.ticks {
        let y = at((tick - ruler.from) / (ruler.to - ruler.from));
        let ends = vec![(fine(left + BAR_WIDTH), fine(y)), (fine(left + BAR_WIDTH + 4.0), fine(y))];
        root.draw(&PathElement::new(ends, rgb(FAINT).stroke_width(FINE))).map_err(failed)?;
        write(root, &ruler.label(*tick), (left + BAR_WIDTH + 7.0, y), &words)?;
    }
    let unit = style(TEXT, INK, HPos::Left, VPos::Bottom);
    write(root, &map.scale.unit, (left, top - 6.0), &unit)
}

#[cfg(test)]
mod tests {
    use super::edges;

    #[test]
    fn cells_lie_around_their_values() {
        assert_eq!(edges(&[1.0, 2.0, 4.0]), [1.0, 1.5, 3.0, 4.0]);
        assert_eq!(edges(&[2.0]), [1.0, 3.0]);
        assert!(edges(&[]).is_empty());
    }
}
