//! Renders a sheet of charts to SVG with `plotters`.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::ink::{Canvas, FAINT, FINE, INK, Plot, SheetError, TEXT, failed, fine, rgb, style, write};
use super::labels::{Area, place_labels};
use super::ticks::Ruler;
use super::{Chart, Colour, LINE, Marker, Series, thin};
use crate::scene::visible;

/// Several charts on one page with a common legend.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// Title above all charts; empty for none.
    pub title: String,
    /// The charts, row by row.
    pub charts: Vec<Chart>,
    /// Charts per row.
    pub columns: usize,
    /// Width and height, pixels.
    pub size: (u32, u32),
    /// Note below all charts; empty for none.
    pub note: String,
    /// Gives each chart its own legend, for charts that use the same colours differently.
    pub separate_legends: bool,
}

/// Sizes of text, pixels.
const TITLE: f64 = 16.0;
const HEADING: f64 = 14.0;

/// Height of a row of the legend, length of its sample, gap between entries, pixels.
const ROW: f64 = 20.0;
const SAMPLE: f64 = 26.0;
const GAP: f64 = 18.0;
/// Half the size of a marker, pixels.
const MARKER: f64 = 4.0;
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
        let mut top = 8.0;
        if !self.title.is_empty() {
            let style = style(TITLE, INK, HPos::Center, VPos::Top);
            write(root, &self.title, (0.5 * width, top), &style)?;
            top += TITLE + 10.0;
        }
        let mut bottom = height - 6.0;
        if !self.note.is_empty() {
            let style = style(TEXT - 1.0, FAINT, HPos::Center, VPos::Bottom);
            write(root, &self.note, (0.5 * width, bottom), &style)?;
            bottom -= TEXT + 8.0;
        }
        if !self.separate_legends {
            bottom = draw_legends(root, &self.charts, 0.0, width, bottom)?;
        }
        let columns = self.columns.clamp(1, self.charts.len().max(1));
        let lines = self.charts.len().div_ceil(columns).max(1);
        let (w, h) = (width / columns as f64, (bottom - top) / lines as f64);
        if w < 160.0 || h < 120.0 {
            return Err(SheetError("the page is too small for its charts".to_owned()));
        }
        for (n, chart) in self.charts.iter().enumerate() {
            let (x, y) = ((n % columns) as f64 * w, top + (n / columns) as f64 * h);
            let legend = if self.separate_legends { std::slice::from_ref(chart) } else { &[] };
            let low = draw_legends(root, legend, x, w, y + h)?;
            let area = root.clone().shrink((fine(x), fine(y)), (fine(w), fine(low - y)));
            draw_chart(root, &area, chart)?;
        }
        Ok(())
    }
}

/// Legend entries of `charts` without duplicates, broken into rows.
fn legend_rows(charts: &[Chart], width: f64) -> Vec<Vec<&Series>> {
    let mut rows: Vec<Vec<&Series>> = Vec::new();
    let mut used = f64::INFINITY;
    let mut names: Vec<&str> = Vec::new();
    for series in charts.iter().flat_map(|chart| &chart.series) {
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

/// Draws the legend of `charts` above `bottom`, from `left` and at most `width` wide; returns its upper edge.
fn draw_legends(root: &Canvas, charts: &[Chart], left: f64, width: f64, bottom: f64) -> Result<f64, SheetError> {
    let rows = legend_rows(charts, width);
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
        if let Some(width) = series.line {
            let ends = vec![(fine(x), fine(y)), (fine(x + SAMPLE), fine(y))];
            root.draw(&PathElement::new(ends, stroke(series.colour, width))).map_err(failed)?;
        }
        if let Some(marker) = series.marker {
            draw_marker(root, (fine(x + 0.5 * SAMPLE), fine(y)), marker, series.colour)?;
        }
        write(root, &series.label, (x + SAMPLE + 6.0, y), &style)?;
        x += entry_width(series);
    }
    Ok(())
}

fn stroke(colour: Colour, width: f64) -> ShapeStyle {
    rgb(colour).stroke_width(fine(width).unsigned_abs())
}

fn draw_chart(root: &Canvas, area: &Canvas, chart: &Chart) -> Result<(), SheetError> {
    let points = || chart.series.iter().flat_map(|series| series.points.iter());
    let x = Ruler::new(&chart.x, points().map(|p| p.0));
    let levels = chart.levels.iter().map(|level| level.y);
    let y = Ruler::new(&chart.y, points().map(|p| p.1).chain(levels));
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
    let inside = |&(px, py): &(f64, f64)| {
        let position = (x.position(px), y.position(py));
        let is_inside = (x.from..=x.to).contains(&position.0) && (y.from..=y.to).contains(&position.1);
        is_inside.then_some(position)
    };
    let mut occupied: Vec<Area> = Vec::new();
    draw_levels(root, &plot, chart, &x, &y, &mut occupied)?;
    for series in &chart.series {
        if let Some(width) = series.line {
            for part in series.points.split(|point| inside(point).is_none()) {
                let path: Vec<(i32, i32)> = part
                    .iter()
                    .filter_map(|point| inside(point).map(|position| plot.backend_coord(&position)))
                    .collect();
                // Detail below a quarter of a pixel is invisible.
                let path = thin::line(&path, 1.0);
                if !chart.labels.is_empty() {
                    occupy_path(&path, &mut occupied);
                }
                root.draw(&PathElement::new(path, stroke(series.colour, width))).map_err(failed)?;
            }
        }
    }
    for series in &chart.series {
        for at in series.points.iter().filter_map(inside).map(|position| plot.backend_coord(&position)) {
            if let Some(marker) = series.marker {
                draw_marker(root, at, marker, series.colour)?;
            }
            if chart.labels.is_empty() {
                continue;
            }
            let half = f64::from(fine(MARKER + 1.0));
            occupied.push(Area {
                x: f64::from(at.0) - half,
                y: f64::from(at.1) - half,
                width: 2.0 * half,
                height: 2.0 * half,
            });
        }
    }
    draw_labels(root, &plot, chart, inside, occupied)
}

/// Covers a path with small areas that labels must avoid.
fn occupy_path(path: &[(i32, i32)], occupied: &mut Vec<Area>) {
    let step = f64::from(fine(MARKER));
    for ends in path.windows(2) {
        let (from, to) = (ends[0], ends[1]);
        let (dx, dy) = (f64::from(to.0 - from.0), f64::from(to.1 - from.1));
        let parts = (dx.hypot(dy) / step).ceil().clamp(1.0, 1000.0);
        for n in 0..parts as u32 {
            let theta = f64::from(n) / parts;
            occupied.push(Area {
                x: f64::from(from.0) + theta * dx - 0.5 * step,
                y: f64::from(from.1) + theta * dy - 0.5 * step,
                width: step,
                height: step,
            });
        }
    }
}

fn draw_levels(
    root: &Canvas,
    plot: &Plot,
    chart: &Chart,
    x: &Ruler,
    y: &Ruler,
    occupied: &mut Vec<Area>,
) -> Result<(), SheetError> {
    for level in &chart.levels {
        let position = y.position(level.y);
        if !(y.from..=y.to).contains(&position) {
            continue;
        }
        let (left, at) = plot.backend_coord(&(x.from, position));
        let (right, _) = plot.backend_coord(&(x.to, position));
        let dash = fine(5.0);
        let starts = (left..right).step_by(2 * dash.unsigned_abs() as usize);
        for from in starts {
            let ends = vec![(from, at), ((from + dash).min(right), at)];
            let style = rgb(FAINT).stroke_width(FINE);
            root.draw(&PathElement::new(ends, style)).map_err(failed)?;
        }
        // Above the line, or below it near the top of the chart.
        let (_, top) = plot.backend_coord(&(x.from, y.to));
        let below = at - top < fine(TEXT + 4.0);
        let (vertical, gap) = if below { (VPos::Top, fine(3.0)) } else { (VPos::Bottom, -fine(3.0)) };
        let style = style(TEXT - 1.0, FAINT, HPos::Left, vertical);
        let text = Text::new(level.text.clone(), (left + fine(6.0), at + gap), style);
        root.draw(&text).map_err(failed)?;
        occupied.push(Area {
            x: f64::from(left),
            y: f64::from(if below { at } else { at - fine(TEXT + 3.0) }),
            width: f64::from(fine(6.0 + text_width(&level.text, TEXT))),
            height: f64::from(fine(TEXT + 4.0)),
        });
    }
    Ok(())
}

fn draw_labels(
    root: &Canvas,
    plot: &Plot,
    chart: &Chart,
    inside: impl Fn(&(f64, f64)) -> Option<(f64, f64)>,
    occupied: Vec<Area>,
) -> Result<(), SheetError> {
    let (xs, ys) = plot.plotting_area().get_pixel_range();
    let frame = Area {
        x: f64::from(xs.start),
        y: f64::from(ys.start),
        width: f64::from(xs.end - xs.start),
        height: f64::from(ys.end - ys.start),
    };
    let labels: Vec<_> = chart
        .labels
        .iter()
        .filter_map(|label| inside(&label.at).map(|position| (label, plot.backend_coord(&position))))
        .collect();
    let requested: Vec<_> = labels
        .iter()
        .map(|(label, (x, y))| {
            let size = (fine(text_width(&label.text, TEXT)), fine(TEXT + 2.0));
            ((f64::from(*x), f64::from(*y)), (f64::from(size.0), f64::from(size.1)))
        })
        .collect();
    let unit = f64::from(fine(MARKER + 3.0));
    let centre = style(TEXT, INK, HPos::Center, VPos::Center);
    for ((label, (x, y)), area) in labels.iter().zip(place_labels(&requested, occupied, frame, unit)) {
        let middle = ((area.x + 0.5 * area.width) as i32, (area.y + 0.5 * area.height) as i32);
        // A thin line connects a label to its point.
        let edge = (
            (*x).clamp(area.x as i32, (area.x + area.width) as i32),
            (*y).clamp(area.y as i32, (area.y + area.height) as i32),
        );
        let tie = PathElement::new(vec![(*x, *y), edge], rgb(FAINT).stroke_width(FINE / 2));
        root.draw(&tie).map_err(failed)?;
        let text = Text::new(label.text.clone(), middle, centre.clone());
        root.draw(&text).map_err(failed)?;
    }
    Ok(())
}

fn axis_title(label: &str, unit: &str) -> String {
    if unit.is_empty() { label.to_owned() } else { format!("{label} ({unit})") }
}

fn draw_marker(root: &Canvas, (x, y): (i32, i32), marker: Marker, colour: Colour) -> Result<(), SheetError> {
    let r = fine(MARKER);
    let filled = rgb(colour).filled();
    let around = |corners: &[(f64, f64)]| {
        let corner = |&(dx, dy): &(f64, f64)| (x + fine(dx * MARKER), y + fine(dy * MARKER));
        Polygon::new(corners.iter().map(corner).collect::<Vec<_>>(), filled)
    };
    let strokes = |lines: [[(i32, i32); 2]; 2]| {
        lines.into_iter().try_for_each(|[a, b]| {
            let ends = vec![(x + a.0, y + a.1), (x + b.0, y + b.1)];
            root.draw(&PathElement::new(ends, stroke(colour, LINE)))
        })
    };
    match marker {
        Marker::Disc => root.draw(&Circle::new((x, y), r, filled)),
        Marker::Ring => root.draw(&Circle::new((x, y), fine(MARKER + 3.0), stroke(colour, LINE))),
        Marker::Square => {
            let s = fine(0.88 * MARKER);
            root.draw(&Rectangle::new([(x - s, y - s), (x + s, y + s)], filled))
        }
        Marker::Triangle => root.draw(&around(&[(0.0, -1.2), (1.1, 0.8), (-1.1, 0.8)])),
        Marker::TriangleDown => root.draw(&around(&[(0.0, 1.2), (1.1, -0.8), (-1.1, -0.8)])),
        Marker::Diamond => root.draw(&around(&[(0.0, -1.25), (1.25, 0.0), (0.0, 1.25), (-1.25, 0.0)])),
        Marker::Cross => strokes([[(-r, -r), (r, r)], [(-r, r), (r, -r)]]),
        Marker::Plus => strokes([[(-r, 0), (r, 0)], [(0, -r), (0, r)]]),
    }
    .map_err(failed)
}
