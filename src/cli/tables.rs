//! Tables as data, written as HTML or Markdown for pages, CSV for programs, or aligned columns for terminals. Pages are
//! templates with gaps for them.

use std::fmt::Write as _;

use super::output::significant;

/// Rows of plain text under headings.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Caption in a page; empty if the surrounding text describes the rows.
    title: String,
    heads: Vec<String>,
    /// Class of each column in HTML: `n` for numbers, `verdict` for words that [`BADGES`] marks, "" for words.
    classes: Vec<String>,
    rows: Vec<Vec<String>>,
}

/// Words of a column of verdicts, and their classes in HTML.
const BADGES: [(&str, &str); 5] = [
    ("agrees within 10 %", "ok"),
    ("within a factor of 2", "near"),
    ("differs", "off"),
    ("confirmed", "ok"),
    ("not confirmed", "off"),
];

impl Table {
    /// Heads are separated by bars; ` .` after a head gives the class of its column: `Run | Largest force (N) .n`.
    pub fn new(heads: &str, rows: impl IntoIterator<Item = Vec<String>>) -> Self {
        let heads = heads.split(" | ").map(|head| head.rsplit_once(" .").unwrap_or((head, "")));
        let (heads, classes) = heads.map(|(head, class)| (head.to_owned(), class.to_owned())).unzip();
        Self { title: String::new(), heads, classes, rows: rows.into_iter().collect() }
    }

    /// The same table with a title.
    pub fn with_title(self, title: &str) -> Self {
        Self { title: title.to_owned(), ..self }
    }

    /// As HTML, typeset.
    pub fn html(&self) -> String {
        let cell = |tag: &str, class: &str, text: &str| {
            let badge = BADGES.iter().find(|(word, _)| class == "verdict" && *word == text);
            let text = escape(&typeset(text));
            let text =
                badge.map_or_else(|| text.clone(), |(_, class)| format!("<span class=\"{class}\">{text}</span>"));
            let class = if class.is_empty() { String::new() } else { format!(" class=\"{class}\"") };
            format!("<{tag}{class}>{text}</{tag}>")
        };
        let row = |tag: &str, cells: &[String]| -> String {
            // Only headings of number columns get the class of their column.
            let class = |class: &'_ String| if tag == "td" || class == "n" { class.clone() } else { String::new() };
            self.classes.iter().zip(cells).map(|(of, text)| cell(tag, &class(of), text)).collect()
        };
        let title = if self.title.is_empty() { String::new() } else { format!("<p>{}</p>\n", escape(&self.title)) };
        let rows = self.rows.iter().map(|cells| format!("<tr>{}</tr>\n", row("td", cells)));
        format!(
            "{title}<div class=\"scroll\"><table>\n<thead><tr>{}</tr></thead>\n<tbody>\n{}</tbody></table></div>\n",
            row("th", &self.heads),
            rows.collect::<String>()
        )
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
        let title = if self.title.is_empty() { String::new() } else { format!("{}\n", self.title) };
        std::iter::once(&self.heads).chain(&self.rows).map(line).fold(title, |all, line| all + &line)
    }
}

/// A cell of a CSV file.
pub fn quoted(text: &str) -> String {
    let plain = !text.contains([',', '"', '\n']);
    if plain { text.to_owned() } else { format!("\"{}\"", text.replace('"', "\"\"")) }
}

/// Fills every gap `{name}` of `page`.
///
/// # Panics
/// If there is no text for a gap.
pub fn fill(page: &str, gaps: &[(&str, String)]) -> String {
    let mut parts = page.split('{');
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (name, rest) = part.split_once('}').expect("every gap ends");
        let gap = gaps.iter().find(|(of, _)| *of == name);
        let (_, text) = gap.unwrap_or_else(|| panic!("no text for the gap {name}"));
        out.push_str(text);
        out.push_str(rest);
    }
    out
}

/// A number in CSV; empty if there is none.
pub fn number(value: impl Into<Option<f64>>) -> String {
    let value = value.into().filter(|v| !v.is_nan());
    value.map_or_else(String::new, |v| significant(v, 12))
}

/// A yes/no cell.
pub fn yes_or_no(holds: bool) -> String {
    if holds { "yes" } else { "no" }.to_owned()
}

/// Labelled values for a terminal, one per line.
pub fn lines<'a>(values: impl IntoIterator<Item = (&'a str, String)>) -> String {
    values.into_iter().map(|(label, value)| format!("{label:<20}{value}\n")).collect()
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Typesets a text: the letter β, powers of ten as superscripts, true minus signs.
pub fn typeset(text: &str) -> String {
    const BETWEEN: [char; 6] = [' ', ',', ';', ':', '(', ')'];
    let set = |part: &str| {
        let word = part.trim_end_matches(BETWEEN);
        let number = word.ends_with(|c: char| c.is_ascii_digit()) && word.parse::<f64>().is_ok();
        let set = match word.split_once('e').filter(|_| number) {
            Some((mantissa, power)) => {
                let raised = |c: char| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(c.to_digit(10)? as usize);
                let sign = if power.starts_with('-') { "⁻" } else { "" };
                let digits = power.trim_start_matches(['-', '+', '0']).chars().filter_map(raised);
                format!("{mantissa}·10{sign}{}", digits.collect::<String>())
            }
            None if word == "beta" => "β".to_owned(),
            None => word.to_owned(),
        };
        let set = if number { set.replacen('-', "\u{2212}", 1) } else { set };
        set + &part[word.len()..]
    };
    text.split_inclusive(BETWEEN).map(set).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table<const N: usize>(heads: &str, rows: &[[&str; N]]) -> Table {
        Table::new(heads, rows.iter().map(|row| row.map(str::to_owned).to_vec()))
    }

    #[test]
    fn gaps_are_filled_once() {
        let gaps = [("one", "{two}".to_owned()), ("two", String::new())];
        assert_eq!(fill("a {one} b{two}{one}.", &gaps), "a {two} b{two}.");
    }

    #[test]
    fn cells_have_the_class_of_their_column() {
        let table = table("Joint | v. of it (m/s) .n", &[["S1", "0.5"]]).html();
        let head = "<th>Joint</th><th class=\"n\">v. of it (m/s)</th>";
        assert!(table.contains(head), "{table}");
        assert!(table.contains("<tr><td>S1</td><td class=\"n\">0.5</td></tr>\n"), "{table}");
    }

    #[test]
    fn html_in_text_is_escaped() {
        let hostile = "<script>alert(1)</script> & <b>";
        let out = table("Place | Verdict .verdict", &[[hostile, "confirmed"], [hostile, hostile]]).html();
        assert!(!out.contains("<script>") && !out.contains(" & "), "{out}");
        assert_eq!(out.matches("&lt;script&gt;").count(), 3, "{out}");
        assert!(out.contains("<td class=\"verdict\"><span class=\"ok\">confirmed</span></td>"), "{out}");
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

    #[test]
    fn numbers_and_names_are_set_as_in_print() {
        for (text, set) in [
            ("9.06117e-4 rad", "9.06117·10⁻⁴ rad"),
            ("-1.305e-05 and -18.26 to -0.89 1/s", "−1.305·10⁻⁵ and −18.26 to −0.89 1/s"),
            ("2e+12, 3e7", "2·10¹², 3·10⁷"),
            ("rate of beta, beta", "rate of β, β"),
            ("betas, alphabeta, 0-1 test, 12 edges, 4e", "betas, alphabeta, 0-1 test, 12 edges, 4e"),
            ("", ""),
        ] {
            assert_eq!(typeset(text), set);
        }
    }
}
