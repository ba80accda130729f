//! CSV files with one row per parameter.

use std::path::Path;

use crate::analysis::cells;
use crate::cli::{Failure, read_text};

/// A row of a file.
pub struct Row<const N: usize> {
    /// Option, file and line, for messages.
    pub place: String,
    /// Its cells.
    pub cells: [String; N],
}

/// The rows below the heading `heads` of the file given with `option`. Cells may be quoted; empty lines and lines that begin
/// with `#` are skipped.
///
/// # Errors
/// Usage: another heading, a row of another length, or no rows. Input/output: an unreadable file.
pub fn rows<const N: usize>(option: &str, path: &Path, heads: [&str; N]) -> Result<Vec<Row<N>>, Failure> {
    let text = read_text(path)?;
    let file = format!("{option} {}", path.display());
    // Spreadsheets begin a text with a byte-order mark.
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let mut heading = None;
    let mut rows = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let content = line.trim();
        if content.is_empty() || content.starts_with('#') {
            continue;
        }
        let place = format!("{file}, line {}", i + 1);
        let wrong = |what: String| Failure::usage(format!("{place}: {what}"));
        if content.matches('"').count() % 2 == 1 {
            return Err(wrong("a quoted cell does not end on this line".to_owned()));
        }
        let line_cells = cells(line);
        if heading.is_none() {
            if line_cells != heads {
                return Err(wrong(format!("expected the heading {}, not {content}", heads.join(","))));
            }
            heading = Some(line_cells);
            continue;
        }
        let cells = line_cells.try_into().map_err(|line_cells: Vec<String>| {
            let quotes = if line_cells.len() > N { "; a cell with a comma needs quotes" } else { "" };
            wrong(format!("{} cells for the {N} of the heading {}{quotes}", line_cells.len(), heads.join(",")))
        })?;
        rows.push(Row { place, cells });
    }
    if rows.is_empty() {
        let expected = format!("{file}: expected the heading {} and below it one row per parameter", heads.join(","));
        return Err(Failure::usage(expected));
    }
    Ok(rows)
}
