//! Points of a motion: instants and coordinates, from the scene or from a CSV file beside it.

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

/// Points that are written in the scene.
pub(super) fn read_points(
    node: &Node<'_>,
    dimension: Dimension,
    repeats: bool,
) -> Result<Points, SceneError> {
    let nodes = node.entries()?;
    let mut points = Points::new();
    for point in &nodes {
        let pair = point.elements()?;
        let [time, place] = &pair[..] else {
            return Err(point.error(format!(
                "needs a time and a position, has {} values",
                pair.len()
            )));
        };
        points.push([time.quantity(Dimension::Time)?, place.quantity(dimension)?]);
        check_time(&points).map_err(|why| time.error(why))?;
    }
    close(&mut points, repeats).map_err(|why| node.error(why))?;
    Ok(points)
}

/// Points of a CSV file: two columns under a header such as `time_s,position_mm` or `t [s]; z [mm]`. Lines that are empty or
/// begin with `#` do not count.
pub(super) fn read_file(
    node: &Node<'_>,
    dimension: Dimension,
    repeats: bool,
) -> Result<Points, SceneError> {
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
        let [time, place] = &cells[..] else {
            let message = format!(
                "needs two columns, time and position, between them a comma, a semicolon or a tab; has {}",
                cells.len()
            );
            return Err(file.error(span, "", None, message));
        };
        let Some((of_time, of_place)) = columns else {
            let column = |cell: &Range<usize>, dimension| {
                let header = text[cell.clone()].trim_start_matches('\u{feff}');
                let column = Column::new(header, dimension);
                column.map_err(|why| file.error(cell.clone(), "", None, why))
            };
            columns = Some((column(time, Dimension::Time)?, column(place, dimension)?));
            continue;
        };
        let value = |cell: &Range<usize>, column: Column<'_>| {
            let number = &text[cell.clone()];
            let fault = |why| file.error(cell.clone(), column.header, Some(number), why);
            column.read(number).map_err(fault)
        };
        points.push([value(time, of_time)?, value(place, of_place)?]);
        if points.len() > MOST_POINTS {
            let message = format!("too many points; allowed at most {MOST_POINTS}");
            return Err(file.error(span, "", None, message));
        }
        check_time(&points).map_err(|why| file.error(time.clone(), "", None, why))?;
    }
    close(&mut points, repeats).map_err(|why| node.error(why))?;
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
    dimension: Dimension,
}

impl<'t> Column<'t> {
    /// With the unit in its header: in brackets, or after the last underscore.
    fn new(header: &'t str, dimension: Dimension) -> Result<Self, String> {
        let bracketed = |open: char, close: char| {
            let inner = header.strip_suffix(close)?;
            Some(inner.rsplit_once(open)?.1.trim())
        };
        let unit = bracketed('[', ']')
            .or_else(|| bracketed('(', ')'))
            .or_else(|| Some(header.rsplit_once('_')?.1));
        let known = |unit: &&str| parse_quantity(&format!("1 {unit}"), dimension).is_ok();
        match unit.filter(known) {
            Some(unit) => Ok(Self {
                header,
                unit,
                dimension,
            }),
            None => {
                let example = match dimension {
                    Dimension::Time => "time_s",
                    Dimension::Angle => "angle_deg",
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
        match parse_quantity(&format!("{number} {}", self.unit), self.dimension) {
            Ok(value) if value.abs() <= MAX_SI => Ok(value),
            Ok(_) => {
                let limit = format_quantity(MAX_SI, si_unit(self.dimension));
                Err(format!("out of range; allowed -{limit} to {limit}"))
            }
            Err(error) => Err(error.to_string()),
        }
    }
}

/// Whether the latest point comes after the one before.
fn check_time(points: &[[f64; 2]]) -> Result<(), String> {
    match points {
        [.., [before, _], [now, _]] if !(now - before >= SHORTEST_PART) => Err(format!(
            "times must rise, by at least {} us from one point to the next",
            1e6 * SHORTEST_PART
        )),
        _ => Ok(()),
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
