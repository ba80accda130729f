//! Renders a sheet of charts to SVG with `plotters`.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::ink::{Canvas, FAINT, FINE, INK, Plot, SheetError, TEXT, failed, fine, rgb, style, write};
use super::ticks::Ruler;
use super::{Chart, Colour, LINE, Series, thin};
use crate::scene::visible;

/// Several charts on one page, each with its legend.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// The charts, row by row.
    pub charts: Vec<Chart>,
    /// Charts per row.
    pub columns: usize,
    /// Width and height, pixels.
    pub size: (u32, u32),
    /// Note below all charts; empty for none.
    pub note: String,
}

/// Size of the text above a chart, pixels.
const HEADING: f64 = 14.0;

/// Height of a row of the legend, length of its sample, gap between entries, pixels.
const ROW: f64 = 20.0;
const SAMPLE: f64 = 26.0;
const GAP: f64 = 18.0;
/// Average letter width as a fraction of text size, a generous estimate.
const LETTER: f64 = 0.51;

const GRID: Colour = (214, 214, 214);
const FINE_GRID: Colour = (238, 238, 238);

impl Sheet {
    /// The sheet as SVG; equal descriptions give equal bytes.
    ///
    /// # Errors
    /// A page too small for its charts.
    pub fn svg(&self) -> Result<String, SheetError> {
        let (width, height) = (self.size.0 * FINE, self.size.1 * FINE);
        let mut text = String::new();
        {
            let root = SVGBackend::with_string(&mut text, (width, height)).into_drawing_area();
            root.fill(&WHITE).map_err(failed)?;
            self.draw(&root)?;
            root.present().map_err(failed)?;
        }
        // The page has the requested size; its content has the finer units. Round line joins, because mitred ones overshoot
        // peaks.
        let (fine_size, page_size) = (
            format!("width=\"{width}\" height=\"{height}\""),
            format!("width=\"{}\" height=\"{}\" stroke-linejoin=\"round\"", self.size.0, self.size.1),
        );
        // XML allows no control characters, not even escaped ones.
        Ok(visible(&text).replacen(&fine_size, &page_size, 1))
    }

    fn draw(&self, root: &Canvas) -> Result<(), SheetError> {
        let (width, height) = (f64::from(self.size.0), f64::from(self.size.1));
        let top = 8.0;
        let mut bottom = height - 6.0;
        if !self.note.is_empty() {
            let style = style(TEXT - 1.0, FAINT, HPos::Center, VPos::Bottom);
            write(root, &self.note, (0.5 * width, bottom), &style)?;
            bottom -= TEXT + 8.0;
        }
        let columns = self.columns.clamp(1, self.charts.len().max(1));
        let lines = self.charts.len().div_ceil(columns).max(1);
        let (w, h) = (width / columns as f64, (bottom - top) / lines as f64);
        if w < 160.0 || h < 120.0 {
            return Err(SheetError("the page is too small for its charts".to_owned()));
        }
        for (n, chart) in self.charts.iter().enumerate() {
            let (x, y) = ((n % columns) as f64 * w, top + (n / columns) as f64 * h);
            let low = draw_legends(root, chart, x, w, y + h)?;
            let area = root.clone().shrink((fine(x), fine(y)), (fine(w), fine(low - y)));
            draw_chart(root, &area, chart)?;
        }
        Ok(())
    }
}

/// Legend entries of `chart` without duplicates, broken into rows.
fn legend_rows(chart: &Chart, width: f64) -> Vec<Vec<&Series>> {
    let mut rows: Vec<Vec<&Series>> = Vec::new();
    let mut used = f64::INFINITY;
    let mut names: Vec<&str> = Vec::new();
    for series in &chart.series {
        if series.label.is_empty() || names.contains(&series.label.as_str()) {
            continue;
        }
        names.push(&series.label);
        let entry = entry_width(series);
        if used + entry > width - 24.0 {
            rows.push(Vec::new());
            used = 0.0;
        }
        used += entry;
        if let Some(row) = rows.last_mut() {
            row.push(series);
        }
    }
    rows
}

/// Draws the legend of `chart` above `bottom`, from `left` and at most `width` wide; returns its upper edge.
fn draw_legends(root: &Canvas, chart: &Chart, left: f64, width: f64, bottom: f64) -> Result<f64, SheetError> {
    let rows = legend_rows(chart, width);
    let top = bottom - ROW * rows.len() as f64;
    for (n, row) in rows.iter().enumerate() {
        draw_legend(root, row, left, width, top + ROW * (n as f64 + 0.5))?;
    }
    Ok(top)
}

fn text_width(text: &str, size: f64) -> f64 {
    text.chars().count() as f64 * size * LETTER
}

fn entry_width(series: &Series) -> f64 {
    SAMPLE + 6.0 + text_width(&series.label, TEXT) + GAP
}

fn draw_legend(root: &Canvas, row: &[&Series], left: f64, width: f64, y: f64) -> Result<(), SheetError> {
    let total: f64 = row.iter().map(|series| entry_width(series)).sum();
    let mut x = left + 0.5 * (width - total + GAP);
    let style = style(TEXT, INK, HPos::Left, VPos::Center);
    for series in row {
        let ends = vec![(fine(x), fine(y)), (fine(x + SAMPLE), fine(y))];
        root.draw(&PathElement::new(ends, stroke(series.colour))).map_err(failed)?;
        write(root, &series.label, (x + SAMPLE + 6.0, y), &style)?;
        x += entry_width(series);
    }
    Ok(())
}

fn stroke(colour: Colour) -> ShapeStyle {
    rgb(colour).stroke_width(fine(LINE).unsigned_abs())
}

fn draw_chart(root: &Canvas, area: &Canvas, chart: &Chart) -> Result<(), SheetError> {
    let points = || chart.series.iter().flat_map(|series| series.points.iter());
    let x = Ruler::new(&chart.x, points().map(|p| p.0));
    let y = Ruler::new(&chart.y, points().map(|p| p.1));
    // Room for the longest tick label on the left.
    let longest = y.ticks.iter().map(|&tick| text_width(&y.label(tick), TEXT)).fold(0.0, f64::max);
    let heading = style(HEADING, INK, HPos::Left, VPos::Top);
    let mut plot: Plot = ChartBuilder::on(area)
        .margin_top(fine(6.0))
        .margin_right(fine(18.0))
        .margin_left(fine(8.0))
        .margin_bottom(fine(6.0))
        .set_label_area_size(LabelAreaPosition::Left, fine(longest + 34.0))
        .set_label_area_size(LabelAreaPosition::Bottom, fine(46.0))
        .caption(&chart.title, heading)
        .build_cartesian_2d(x.clone(), y.clone())
        .map_err(failed)?;
    plot.configure_mesh()
        .bold_line_style(rgb(GRID).stroke_width(FINE))
        .light_line_style(rgb(FINE_GRID).stroke_width(FINE))
        .axis_style(rgb(FAINT).stroke_width(FINE))
        .label_style(style(TEXT, INK, HPos::Center, VPos::Center))
        .axis_desc_style(style(TEXT + 1.0, INK, HPos::Center, VPos::Center))
        .x_desc(axis_title(&chart.x.label, &chart.x.unit))
        .y_desc(axis_title(&chart.y.label, &chart.y.unit))
        .x_label_formatter(&|tick| x.label(*tick))
        .y_label_formatter(&|tick| y.label(*tick))
        .set_all_tick_mark_size(fine(4.0))
        .draw()
        .map_err(failed)?;
    let is_inside = |(px, py): &(f64, f64)| (x.from..=x.to).contains(px) && (y.from..=y.to).contains(py);
    for series in &chart.series {
        for part in series.points.split(|point| !is_inside(point)) {
            let path: Vec<(i32, i32)> = part.iter().map(|point| plot.backend_coord(point)).collect();
            // Detail below a quarter of a pixel is invisible.
            let path = thin::line(&path, 1.0);
            root.draw(&PathElement::new(path, stroke(series.colour))).map_err(failed)?;
        }
    }
    Ok(())
}

fn axis_title(label: &str, unit: &str) -> String {
    if unit.is_empty() { label.to_owned() } else { format!("{label} ({unit})") }
}
