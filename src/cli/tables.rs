//! Tables for pages and data files, and the gaps in pages.

use std::fmt::Write as _;

use super::output::significant;

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
        let (_, text) = gap.unwrap_or_else(|| panic!("nothing for {name}"));
        out.push_str(text);
        out.push_str(rest);
    }
    out
}

/// An HTML table whose cells are already mark-up. Heads are separated by bars; ` .` after a head gives the class of the cells
/// below: `Run | Largest force (N) .n`. The class of numbers, `n`, also applies to the head.
pub fn html(heads: &str, rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let heads: Vec<(&str, &str)> =
        heads.split(" | ").map(|head| head.rsplit_once(" .").unwrap_or((head, ""))).collect();
    let cell = |tag: &str, class: &str, text: &str| match class {
        "" => format!("<{tag}>{text}</{tag}>"),
        _ => format!("<{tag} class=\"{class}\">{text}</{tag}>"),
    };
    let mut out = String::from("<div class=\"scroll\"><table>\n<thead><tr>");
    for (head, class) in &heads {
        out += &cell("th", if *class == "n" { "n" } else { "" }, head);
    }
    out += "</tr></thead>\n<tbody>\n";
    for row in rows {
        let cells = heads.iter().zip(&row);
        let cells: String = cells.map(|((_, class), text)| cell("td", class, text)).collect();
        // Writing to a String cannot fail.
        let _ = writeln!(out, "<tr>{cells}</tr>");
    }
    out + "</tbody></table></div>\n"
}

/// A Markdown table; heads are separated by bars.
pub fn markdown(heads: &str, rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let rule = "|---".repeat(heads.split(" | ").count());
    let mut out = format!("| {heads} |\n{rule}|\n");
    for row in rows {
        let _ = writeln!(out, "| {} |", row.join(" | "));
    }
    out
}

/// CSV rows under the header line `head`.
pub fn csv(head: &str, rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut out = format!("{head}\n");
    for row in rows {
        let cells: Vec<String> = row.iter().map(|text| quoted(text)).collect();
        out += &cells.join(",");
        out.push('\n');
    }
    out
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

/// A number in CSV; empty if there is none.
pub fn number(value: impl Into<Option<f64>>) -> String {
    let value = value.into().filter(|v| !v.is_nan());
    value.map_or_else(String::new, |v| significant(v, 12))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_filled_once() {
        let gaps = [("one", "{two}".to_owned()), ("two", String::new())];
        assert_eq!(fill("a {one} b{two}{one}.", &gaps), "a {two} b{two}.");
    }

    #[test]
    fn cells_have_the_class_of_their_column() {
        let row = || ["S1", "0.5"].map(str::to_owned).to_vec();
        let table = html("Joint | v. of it (m/s) .n", [row()]);
        let head = "<th>Joint</th><th class=\"n\">v. of it (m/s)</th>";
        assert!(table.contains(head), "{table}");
        assert!(table.contains("<tr><td>S1</td><td class=\"n\">0.5</td></tr>\n"), "{table}");
    }

    #[test]
    fn a_table_in_markdown_has_its_rule() {
        let rows = [["a", ""].map(str::to_owned).to_vec()];
        assert_eq!(markdown("x | y", rows), "| x | y |\n|---|---|\n| a |  |\n");
    }

    #[test]
    fn what_csv_cannot_hold_plainly_is_quoted() {
        let rows = [vec!["a \"b\"".to_owned(), number(1.5)], vec!["c, d".to_owned(), number(None)]];
        assert_eq!(csv("x,y", rows), "x,y\n\"a \"\"b\"\"\",1.5\n\"c, d\",\n");
    }
}
