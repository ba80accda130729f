//! Parameter sets from CSV text: a header of keys, then one set per row, with values in the syntax of the user.

use super::axis::{Axis, RangeError};
use super::design::{Design, Start};
use jointplay_physics::suggest::brief;
use jointplay_scene::{Scene, SceneError, Value, ValueError};

/// Reasons why a text is not a table of points.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PointsError {
    /// No rows.
    #[error("{file}: expected a header of parameter keys and below it one row per point")]
    Empty {
        /// Name of the file.
        file: String,
    },
    /// A key of the header that the scene does not have.
    #[error("{file}, line {line}: {error}")]
    Key {
        /// Name of the file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// The reason.
        error: Box<SceneError>,
    },
    /// A row whose length differs from the header's.
    #[error("{file}, line {line}: {values} values for the {keys} keys of the header")]
    Length {
        /// Name of the file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Values in the row.
        values: usize,
        /// Keys in the header.
        keys: usize,
    },
    /// A text that is not a value of the parameter.
    #[error("{file}, line {line}: {key} = {value}: {error}")]
    Value {
        /// Name of the file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Key of the parameter.
        key: String,
        /// The given value.
        value: String,
        /// The reason, and the allowed values.
        error: Box<ValueError>,
    },
    /// Columns that cannot be combined.
    #[error("{file}: {error}")]
    Together {
        /// Name of the file.
        file: String,
        /// The reason.
        error: Box<RangeError>,
    },
}

/// Parses the points in `text`, the content of `file`, for `scene`. Cells may be quoted; empty lines are skipped.
///
/// # Errors
/// No rows; with the line, a row whose length differs from the header's, an unknown key or an invalid value.
pub fn read_points(scene: &Scene, file: &str, text: &str, starts: &[Start]) -> Result<Design, PointsError> {
    let file_name = || file.to_owned();
    // Spreadsheets begin a file with a byte-order mark.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let lines = text.lines().enumerate().map(|(i, line)| (i + 1, line));
    let mut lines = lines.filter(|(_, line)| !line.trim().is_empty());
    let (line, header) = lines.next().ok_or_else(|| PointsError::Empty { file: file_name() })?;
    let keys = cells(header);
    let parameter = |key: &String| {
        scene.parameter(key).map_err(|error| PointsError::Key { file: file_name(), line, error: Box::new(error) })
    };
    let parameters = keys.iter().map(parameter).collect::<Result<Vec<_>, _>>()?;
    let mut columns: Vec<Vec<Value>> = vec![Vec::new(); keys.len()];
    for (line, row) in lines {
        let row = cells(row);
        if row.len() != keys.len() {
            return Err(PointsError::Length { file: file_name(), line, values: row.len(), keys: keys.len() });
        }
        for (j, cell) in row.iter().enumerate() {
            let value = parameters[j].read(cell).map_err(|error| {
                let (key, value) = (keys[j].clone(), brief(cell));
                PointsError::Value { file: file_name(), line, key, value, error: Box::new(error) }
            })?;
            columns[j].push(value);
        }
    }
    if columns[0].is_empty() {
        return Err(PointsError::Empty { file: file_name() });
    }
    let axes = keys.iter().zip(columns).map(|(key, values)| Axis::listed(scene, key, values));
    let axes: Result<Vec<_>, _> = axes.collect();
    let design = axes.and_then(|axes| Design::of_columns(scene, axes, starts));
    design.map_err(|error| PointsError::Together { file: file_name(), error: Box::new(error) })
}

/// The cells of a line of CSV, without quotes and surrounding white space.
fn cells(line: &str) -> Vec<String> {
    let (mut all, mut cell, mut quoted) = (Vec::new(), String::new(), false);
    let mut characters = line.chars().peekable();
    while let Some(character) = characters.next() {
        match character {
            // A doubled quote inside quotes stands for a single one.
            '"' if quoted && characters.peek() == Some(&'"') => {
                characters.next();
                cell.push('"');
            }
            '"' => quoted = !quoted,
            ',' if !quoted => all.push(std::mem::take(&mut cell)),
            other => cell.push(other),
        }
    }
    all.push(cell);
    all.iter().map(|cell| cell.trim().to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Design, PointsError> {
        read_points(&Scene::load("spcmm", &[]).expect("built in"), "points.csv", text, &[Start::Cold])
    }

    #[test]
    fn a_row_is_a_point() {
        let text = "\u{feff}contact.clearance, contact.normal_law\r\n\"0.1 mm\",hertz\r\n\n20um,\"flores\"\n";
        let design = read(text).expect("two points");
        assert_eq!(design.points(), 2);
        let second = [("contact.clearance", Value::Number(20e-6)), ("contact.normal_law", Value::Choice("flores"))];
        assert_eq!(design.settings(1), second);
        assert_eq!(cells("a,\"b \"\"c\"\", d\",,"), ["a", "b \"c\", d", "", ""]);
    }

    #[test]
    fn errors_state_their_line() {
        for (text, fragment) in [
            ("", "points.csv: expected a header"),
            ("contact.friction\n", "points.csv: expected a header"),
            ("contact.fricton\n0.1", "points.csv, line 1: "),
            ("contact.fricton\n0.1", "did you mean `contact.friction`?"),
            ("contact.friction\n0.1\n\n0.1,0.2\n", "line 4: 2 values for the 1 keys"),
            ("contact.friction\n0.1\n-1", "line 3: contact.friction = -1: out of range"),
            ("contact.friction,contact.friction\n0.1,0.1", "points.csv: --vary contact.friction is given twice"),
        ] {
            let error = read(text).expect_err(text).to_string();
            assert!(error.contains(fragment), "{text}: {error}");
        }
    }
}
