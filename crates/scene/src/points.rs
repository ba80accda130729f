//! Points of a motion or curve: pairs of numbers with rising abscissas, from the scene or a CSV file beside it.

use std::ops::Range;

use super::SceneError;
use super::document::{Document, Node};
use super::key::MAX_SI;
use jointplay_physics::units::{Dimension, QuantityError, format_quantity, parse_quantity, si_unit, unit_names};

/// Shortest interval of a table, ramp or pulse, s.
pub(super) const SHORTEST_PART: f64 = 1e-6;
/// Maximum number of points in a table.
pub(super) const MAX_POINTS: usize = 10_000;
/// Allowed mismatch of the ends of a period, as a fraction of the range: measured data do not match exactly.
const CLOSED: f64 = 1e-9;

type Points = Vec<[f64; 2]>;

#[derive(Clone, Debug, PartialEq, thiserror::Error)]
enum PointsFault {
    #[error("has {count} points; allowed {least} to {MAX_POINTS}")]
    Count { count: usize, least: usize },
    #[error("{name}s must rise, by at least {least} from one point to the next")]
    NotRising { name: &'static str, least: &'static str },
    #[error("repeats, so the last {0} must be the first")]
    NotClosed(&'static str),
    #[error(
        "the first line must name the columns with their units, as in `{}`; units {}",
        header(*.0),
        unit_names(*.0).join(", ")
    )]
    Header(Dimension),
    #[error("is not a number; the unit belongs in the header")]
    NotANumber,
    #[error("out of range; allowed -{0} to {0}", format_quantity(*.limit, si_unit(*.dimension)))]
    OutOfRange { limit: f64, dimension: Dimension },
    #[error(transparent)]
    Quantity(#[from] QuantityError),
}

/// Example of a column header.
fn header(dimension: Dimension) -> &'static str {
    match dimension {
        Dimension::Time => "time_s",
        Dimension::Angle => "angle_deg",
        Dimension::Force => "force_N",
        Dimension::Torque => "torque [N m]",
        Dimension::None => "factor",
        _ => "position_mm",
    }
}

/// One of the two axes of a graph.
#[derive(Clone, Copy)]
pub(super) struct Axis {
    pub name: &'static str,
    pub dimension: Dimension,
    /// Largest absolute value, SI.
    pub most: f64,
}

impl Axis {
    /// The name with its article: `a time`.
    fn article(self) -> String {
        let article = if self.name.starts_with('a') { "an" } else { "a" };
        format!("{article} {}", self.name)
    }
}

/// Axes of a list of points, and the rules that it must obey.
#[derive(Clone, Copy)]
pub(super) struct Graph {
    pub axes: [Axis; 2],
    /// Minimum rise of the abscissa from one point to the next, SI, and in words.
    pub rise: (f64, &'static str),
    /// Whether the points are one period.
    pub repeats: bool,
}

impl Graph {
    /// A motion whose coordinate has this dimension, or a factor, which has none.
    pub fn motion(dimension: Dimension, repeats: bool) -> Self {
        let axis = |name, dimension| Axis { name, dimension, most: MAX_SI };
        let value = if dimension == Dimension::None { "factor" } else { "position" };
        Self { axes: [axis("time", Dimension::Time), axis(value, dimension)], rise: (SHORTEST_PART, "1 us"), repeats }
    }

    /// Checks that the latest point is far enough after the previous one.
    fn check_rise(&self, points: &[[f64; 2]]) -> Result<(), PointsFault> {
        let (least, words) = self.rise;
        match points {
            [.., [before, _], [now, _]] if !(now - before >= least) => {
                Err(PointsFault::NotRising { name: self.axes[0].name, least: words })
            }
            _ => Ok(()),
        }
    }
}

/// Reads points written in the scene.
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
        let value = |node: &Node<'_>, axis: Axis| node.within(axis.dimension, (-axis.most, axis.most));
        points.push([value(x, first)?, value(y, second)?]);
        let risen = graph.check_rise(&points);
        risen.map_err(|fault| x.error(fault.to_string()))?;
    }
    let closed = check_ends(&mut points, graph);
    closed.map_err(|fault| node.error(fault.to_string()))?;
    Ok(points)
}

/// Reads points from a CSV file: two columns under a header such as `time_s,position_mm` or `t [s]; z [mm]`. Empty lines
/// and lines that begin with `#` are ignored.
pub(super) fn read_file(node: &Node<'_>, graph: &Graph) -> Result<Points, SceneError> {
    let [first, second] = graph.axes;
    let name = node.text()?;
    let text = node.document.assets.text(name);
    let text = text.map_err(|fault| node.error(fault.to_string()))?;
    let file = Document { file: Some(name), text: &text, ..node.document };
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
                let column = FileColumn::new(header, axis);
                column.map_err(|fault| file.error(cell.clone(), "", None, fault.to_string()))
            };
            columns = Some((column(x, first)?, column(y, second)?));
            continue;
        };
        let value = |cell: &Range<usize>, column: FileColumn<'_>| {
            let number = &text[cell.clone()];
            let error = |fault: PointsFault| file.error(cell.clone(), column.header, Some(number), fault.to_string());
            column.read(number).map_err(error)
        };
        points.push([value(x, of_x)?, value(y, of_y)?]);
        if points.len() > MAX_POINTS {
            let message = format!("too many points; allowed at most {MAX_POINTS}");
            return Err(file.error(span, "", None, message));
        }
        let risen = graph.check_rise(&points);
        risen.map_err(|fault| file.error(x.clone(), "", None, fault.to_string()))?;
    }
    let closed = check_ends(&mut points, graph);
    closed.map_err(|fault| node.error(fault.to_string()))?;
    Ok(points)
}

/// Byte ranges of the trimmed cells of a line.
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
struct FileColumn<'t> {
    header: &'t str,
    unit: &'t str,
    axis: Axis,
}

impl<'t> FileColumn<'t> {
    /// Takes the unit from the header: in brackets, or after the last underscore. A pure number has none.
    fn new(header: &'t str, axis: Axis) -> Result<Self, PointsFault> {
        let dimension = axis.dimension;
        if dimension == Dimension::None && header.parse::<f64>().is_err() {
            return Ok(Self { header, unit: "", axis });
        }
        let bracketed = |open: char, close: char| {
            let inner = header.strip_suffix(close)?;
            Some(inner.rsplit_once(open)?.1.trim())
        };
        let unit = bracketed('[', ']').or_else(|| bracketed('(', ')')).or_else(|| Some(header.rsplit_once('_')?.1));
        let known = |unit: &&str| parse_quantity(&format!("1 {unit}"), dimension).is_ok();
        match unit.filter(known) {
            Some(unit) => Ok(Self { header, unit, axis }),
            None => Err(PointsFault::Header(dimension)),
        }
    }

    /// Parses a number of this column, SI.
    fn read(&self, number: &str) -> Result<f64, PointsFault> {
        if number.parse::<f64>().is_err() {
            return Err(PointsFault::NotANumber);
        }
        let Axis { dimension, most: limit, .. } = self.axis;
        let value = parse_quantity(&format!("{number} {}", self.unit), dimension)?;
        if value.abs() <= limit { Ok(value) } else { Err(PointsFault::OutOfRange { limit, dimension }) }
    }
}

/// Checks the number of points. The ends of a period must match, and are then made equal.
fn check_ends(points: &mut Points, graph: &Graph) -> Result<(), PointsFault> {
    let least = if graph.repeats { 3 } else { 2 };
    if points.len() < least {
        let count = points.len();
        return Err(PointsFault::Count { count, least });
    }
    if graph.repeats {
        let places = || points.iter().map(|point| point[1]);
        let range = places().fold(f64::NEG_INFINITY, f64::max) - places().fold(f64::INFINITY, f64::min);
        let (first, last) = (points[0][1], points[points.len() - 1][1]);
        if !((last - first).abs() <= CLOSED * range) {
            return Err(PointsFault::NotClosed(graph.axes[1].name));
        }
        if let Some(end) = points.last_mut() {
            end[1] = first;
        }
    }
    Ok(())
}
