//! Points of a motion or of a curve: pairs of numbers of which the first rises, from the scene or from a CSV file beside it.

use std::ops::Range;

use super::document::{Document, Node};
use super::key::MAX_SI;
use super::{Dimension, SceneError, format_quantity, parse_quantity, si_unit, unit_names};

/// Shortest interval of a table, ramp or pulse, s.
pub(super) const SHORTEST_PART: f64 = 1e-6;
/// Most points of a table.
pub(super) const MOST_POINTS: usize = 10_000;
/// First and last point of a period may differ by this fraction of the range of all, as measured ones do.
const CLOSED: f64 = 1e-9;

type Points = Vec<[f64; 2]>;

/// One of the two numbers of a point.
#[derive(Clone, Copy)]
pub(super) struct Axis {
    pub name: &'static str,
    pub dimension: Dimension,
    /// Largest, SI.
    pub most: f64,
}

impl Axis {
    /// `a time`.
    fn article(self) -> String {
        let article = if self.name.starts_with('a') {
            "an"
        } else {
            "a"
        };
        format!("{article} {}", self.name)
    }
}

/// What points are read.
#[derive(Clone, Copy)]
pub(super) struct Graph {
    pub axes: [Axis; 2],
    /// Least rise of the first number from one point to the next, SI, and in words.
    pub rise: (f64, &'static str),
    /// Whether they are a period.
    pub repeats: bool,
}

impl Graph {
    /// A motion, whose coordinate has this dimension.
    pub fn motion(dimension: Dimension, repeats: bool) -> Self {
        let axis = |name, dimension| Axis {
            name,
            dimension,
            most: MAX_SI,
        };
        Self {
            axes: [axis("time", Dimension::Time), axis("position", dimension)],
            rise: (SHORTEST_PART, "1 us"),
            repeats,
        }
    }

    /// Whether the latest point comes after the one before.
    fn check_rise(&self, points: &[[f64; 2]]) -> Result<(), String> {
        let (least, words) = self.rise;
        match points {
            [.., [before, _], [now, _]] if !(now - before >= least) => Err(format!(
                "{}s must rise, by at least {words} from one point to the next",
                self.axes[0].name
            )),
            _ => Ok(()),
        }
    }
}

/// Points that are written in the scene.
pub(super) fn read_points(node: &Node<'_>, graph: &Graph) -> Result<Points, SceneError> {
    let [first, second] = graph.axes;
    let nodes = node.entries()?;
    let mut points = Points::new();
    for point in &nodes {
        let pair = point.elements()?;
        let [x, y] = &pair[..] else {
            return Err(point.error(format!(
                "needs {} and {}, has {} values",
                first.article(),
                second.article(),
                pair.len()
            )));
        };
        let value =
            |node: &Node<'_>, axis: Axis| node.within(axis.dimension, (-axis.most, axis.most));
        points.push([value(x, first)?, value(y, second)?]);
        graph.check_rise(&points).map_err(|why| x.error(why))?;
    }
    close(&mut points, graph.repeats).map_err(|why| node.error(why))?;
    Ok(points)
}

/// Points of a CSV file: two columns under a header such as `time_s,position_mm` or `t [s]; z [mm]`. Lines that are empty or
/// begin with `#` do not count.
pub(super) fn read_file(node: &Node<'_>, graph: &Graph) -> Result<Points, SceneError> {
    let [first, second] = graph.axes;
    let name = node.text()?;
    let beside = node.document.beside;
    let text = beside.text(name).map_err(|why| node.error(why))?;
    let file = Document {
        file: Some(name),
        text: &text,
        ..node.document
    };
    let mut columns = None;
    let mut points = Points::new();
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        let span = start..start + line.trim_end().len();
        start += line.len();
        let line = line.trim();
        if line.trim_start_matches('\u{feff}').is_empty() || line.starts_with('#') {
            continue;
        }
        let cells = cells(&text, span.clone());
        let [x, y] = &cells[..] else {
            let message = format!(
                "needs two columns, {} and {}, between them a comma, a semicolon or a tab; has {}",
                first.name,
                second.name,
                cells.len()
            );
            return Err(file.error(span, "", None, message));
        };
        let Some((of_x, of_y)) = columns else {
            let column = |cell: &Range<usize>, axis| {
                let header = text[cell.clone()].trim_start_matches('\u{feff}');
                let column = Column::new(header, axis);
                column.map_err(|why| file.error(cell.clone(), "", None, why))
            };
            columns = Some((column(x, first)?, column(y, second)?));
            continue;
        };
        let value = |cell: &Range<usize>, column: Column<'_>| {
            let number = &text[cell.clone()];
            let fault = |why| file.error(cell.clone(), column.header, Some(number), why);
            column.read(number).map_err(fault)
        };
        points.push([value(x, of_x)?, value(y, of_y)?]);
        if points.len() > MOST_POINTS {
            let message = format!("too many points; allowed at most {MOST_POINTS}");
            return Err(file.error(span, "", None, message));
        }
        let fault = |why| file.error(x.clone(), "", None, why);
        graph.check_rise(&points).map_err(fault)?;
    }
    close(&mut points, graph.repeats).map_err(|why| node.error(why))?;
    Ok(points)
}

/// Ranges of the cells of a line.
fn cells(text: &str, line: Range<usize>) -> Vec<Range<usize>> {
    let mut start = line.start;
    let cell = |cell: &str| {
        let end = start + cell.len();
        let (left, right) = (cell.trim_start().len(), cell.trim_end().len());
        let range = end - left..(start + right).max(end - left);
        start = end + 1;
        range
    };
    text[line].split([',', ';', '\t']).map(cell).collect()
}

/// A column of a file.
#[derive(Clone, Copy)]
struct Column<'t> {
    header: &'t str,
    unit: &'t str,
    axis: Axis,
}

impl<'t> Column<'t> {
    /// With the unit in its header: in brackets, or after the last underscore.
    fn new(header: &'t str, axis: Axis) -> Result<Self, String> {
        let dimension = axis.dimension;
        let bracketed = |open: char, close: char| {
            let inner = header.strip_suffix(close)?;
            Some(inner.rsplit_once(open)?.1.trim())
        };
        let unit = bracketed('[', ']')
            .or_else(|| bracketed('(', ')'))
            .or_else(|| Some(header.rsplit_once('_')?.1));
        let known = |unit: &&str| parse_quantity(&format!("1 {unit}"), dimension).is_ok();
        match unit.filter(known) {
            Some(unit) => Ok(Self { header, unit, axis }),
            None => {
                let example = match dimension {
                    Dimension::Time => "time_s",
                    Dimension::Angle => "angle_deg",
                    Dimension::Force => "force_N",
                    Dimension::Torque => "torque [N m]",
                    _ => "position_mm",
                };
                Err(format!(
                    "the first line names the columns with their units, as `{example}`; units {}",
                    unit_names(dimension).join(", ")
                ))
            }
        }
    }

    /// A number of this column, SI.
    fn read(&self, number: &str) -> Result<f64, String> {
        if number.parse::<f64>().is_err() {
            return Err("is not a number; its unit stands in the header".to_owned());
        }
        let Axis {
            dimension, most, ..
        } = self.axis;
        match parse_quantity(&format!("{number} {}", self.unit), dimension) {
            Ok(value) if value.abs() <= most => Ok(value),
            Ok(_) => {
                let limit = format_quantity(most, si_unit(dimension));
                Err(format!("out of range; allowed -{limit} to {limit}"))
            }
            Err(error) => Err(error.to_string()),
        }
    }
}

/// Whether there are enough points, and whether they make a period; its ends are then made equal.
fn close(points: &mut Points, repeats: bool) -> Result<(), String> {
    let least = if repeats { 3 } else { 2 };
    if points.len() < least {
        return Err(format!(
            "has {} points; allowed {least} to {MOST_POINTS}",
            points.len()
        ));
    }
    if repeats {
        let places = || points.iter().map(|point| point[1]);
        let range =
            places().fold(f64::NEG_INFINITY, f64::max) - places().fold(f64::INFINITY, f64::min);
        let (first, last) = (points[0][1], points[points.len() - 1][1]);
        if !((last - first).abs() <= CLOSED * range) {
            return Err("repeats, so the last position must be the first".to_owned());
        }
        if let Some(end) = points.last_mut() {
            end[1] = first;
        }
    }
    Ok(())
}
