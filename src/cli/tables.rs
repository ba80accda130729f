//! Tables of words, written as Markdown for pages, CSV for programs, or aligned columns for terminals.

use std::fmt::Write as _;

use crate::units::significant;

/// Rows of plain text under headings.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    heads: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// Heads are separated by bars: `Run | Largest force (N)`.
    pub fn new(heads: &str, rows: impl IntoIterator<Item = Vec<String>>) -> Self {
        let heads = heads.split(" | ").map(str::to_owned).collect();
        Self { heads, rows: rows.into_iter().collect() }
    }

    /// As Markdown.
    pub fn markdown(&self) -> String {
        let mut out = format!("| {} |\n{}|\n", self.heads.join(" | "), "|---".repeat(self.heads.len()));
        for row in &self.rows {
            // Writing to a String cannot fail.
            let _ = writeln!(out, "| {} |", row.join(" | "));
        }
        out
    }

    /// As CSV.
    pub fn csv(&self) -> String {
        let line = |cells: &Vec<String>| cells.iter().map(|cell| quoted(cell)).collect::<Vec<_>>().join(",") + "\n";
        std::iter::once(&self.heads).chain(&self.rows).map(line).collect()
    }

    /// As aligned columns for a terminal: numbers right, words left.
    pub fn text(&self) -> String {
        let is_number = |text: &String| {
            let first = text.chars().next();
            text == "-" || first.is_none_or(|c| c.is_ascii_digit() || c == '<')
        };
        let column_layouts = self.heads.iter().enumerate().map(|(column, head)| {
            let cells = || self.rows.iter().map(|row| &row[column]);
            let width = cells().chain([head]).map(|text| text.chars().count()).max().unwrap_or(0);
            (width, !self.rows.is_empty() && cells().all(is_number))
        });
        let column_layouts: Vec<(usize, bool)> = column_layouts.collect();
        let line = |row: &Vec<String>| {
            let cells = row.iter().zip(&column_layouts).map(|(text, &(width, right))| {
                if right { format!("{text:>width$}  ") } else { format!("{text:<width$}  ") }
            });
            cells.collect::<String>().trim_end().to_owned() + "\n"
        };
        std::iter::once(&self.heads).chain(&self.rows).map(line).collect()
    }
}

/// A cell of a CSV file.
pub fn quoted(text: &str) -> String {
    let plain = !text.contains([',', '"', '\n']);
    if plain { text.to_owned() } else { format!("\"{}\"", text.replace('"', "\"\"")) }
}

/// A number in CSV; empty if there is none.
pub fn number(value: impl Into<Option<f64>>) -> String {
    let value = value.into().filter(|v| !v.is_nan());
    value.map_or_else(String::new, |v| significant(v, 12))
}

/// Labelled values for a terminal, one per line.
pub fn lines<'a>(values: impl IntoIterator<Item = (&'a str, String)>) -> String {
    values.into_iter().map(|(label, value)| format!("{label:<20}{value}\n")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table<const N: usize>(heads: &str, rows: &[[&str; N]]) -> Table {
        Table::new(heads, rows.iter().map(|row| row.map(str::to_owned).to_vec()))
    }

    #[test]
    fn a_table_in_markdown_has_its_rule() {
        assert_eq!(table("x | y", &[["a", ""]]).markdown(), "| x | y |\n|---|---|\n| a |  |\n");
    }

    #[test]
    fn cells_with_special_characters_are_quoted_in_csv() {
        let rows = [["a \"b\"", &number(1.5)], ["c, d", &number(None)]];
        assert_eq!(table("x | y", &rows).csv(), "x,y\n\"a \"\"b\"\"\",1.5\n\"c, d\",\n");
    }

    #[test]
    fn columns_line_up() {
        let rows = [["word", "1"], ["b", "-"]];
        assert_eq!(table("a | number", &rows).text(), "a     number\nword       1\nb          -\n");
    }
}
