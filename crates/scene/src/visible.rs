//! Makes untrusted text (scene files, links, command lines) safe to display: characters that would control a terminal,
//! forge a line or reorder nearby text are escaped.

use std::borrow::Cow;

/// Whether a terminal or a page would act on `c` instead of showing it: control characters, line and paragraph separators,
/// and bidirectional formatting characters.
fn is_control_or_bidi(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{206f}')
}

fn escaped(text: &str, hide: impl Fn(char) -> bool) -> Cow<'_, str> {
    use std::fmt::Write;
    if !text.contains(&hide) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if hide(c) {
            // This is also the JSON escape. Writing to a String cannot fail.
            let _ = write!(out, "\\u{:04x}", u32::from(c));
        } else {
            out.push(c);
        }
    }
    Cow::Owned(out)
}

/// `text` with line breaks and tabs kept, and every other control or formatting character escaped as `\u001b`.
pub fn visible(text: &str) -> Cow<'_, str> {
    escaped(text, |c| is_control_or_bidi(c) && !matches!(c, '\n' | '\t'))
}

/// Like [`visible`], but on one line.
pub fn visible_line(text: &str) -> Cow<'_, str> {
    escaped(text, is_control_or_bidi)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_escaped_and_all_others_are_kept() {
        let plain = "µ ≤ 3 \"β\" \u{1f600}\n\tα";
        assert!(matches!(visible(plain), Cow::Borrowed(same) if same == plain));
        assert_eq!(visible_line("a\nb\tc"), "a\\u000ab\\u0009c");
        for (c, shown) in [
            ('\u{1b}', "\\u001b"),
            ('\r', "\\u000d"),
            ('\0', "\\u0000"),
            ('\u{7f}', "\\u007f"),
            ('\u{9b}', "\\u009b"),
            ('\u{202e}', "\\u202e"),
            ('\u{2066}', "\\u2066"),
            ('\u{2028}', "\\u2028"),
        ] {
            let text = visible(&format!("a{c}b")).into_owned();
            assert_eq!(text, format!("a{shown}b"));
            // Escaping again changes nothing.
            assert_eq!(visible_line(&text), text);
        }
    }
}
