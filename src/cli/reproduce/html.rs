//! Words and tables of the page.

use std::fmt::Write as _;

use super::text::typeset;
use crate::cli::output::significant;

pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

/// Four digits: what a reader takes in.
pub(super) fn shown(value: f64) -> String {
    typeset(&significant(value, 4))
}

/// Stands where there is no number.
pub(super) const NONE: &str = "\u{2013}";

pub(super) fn open(out: &mut String, heads: &[(&str, bool)]) {
    out.push_str("<div class=\"scroll\"><table>\n<thead><tr>");
    for (head, number) in heads {
        let class = if *number { " class=\"n\"" } else { "" };
        let _ = write!(out, "<th{class}>{head}</th>");
    }
    out.push_str("</tr></thead>\n<tbody>\n");
}

pub(super) const CLOSE: &str = "</tbody></table></div>\n";

pub(super) fn number(text: &str) -> String {
    format!("<td class=\"n\">{text}</td>")
}
