//! Errors in scenes and parameters: file, line, column, key, value, range, unit.

use super::visible::{visible, visible_line};
use jointplay_physics::suggest::{brief, did_you_mean, nearest, nearest_name};
use std::fmt;

/// An error in a scene or a parameter value, in a form the user can act on.
///
/// `Display` gives location, key, value, reason, and the source line with a caret under the error.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SceneError {
    /// File as the user named it; `None` for a built-in scene or the command line.
    pub file: Option<String>,
    /// Line and column, one-based.
    pub position: Option<(u32, u32)>,
    /// Key at fault, e.g. `joint.S1.clearance`.
    pub key: Option<String>,
    /// Value at fault, as written.
    pub value: Option<Box<str>>,
    /// What is wrong and what is allowed.
    pub message: String,
    /// The line of the file at `position`.
    pub line_text: Option<Box<str>>,
    /// The file could not be read at all (as opposed to being invalid).
    pub unreadable: bool,
}

impl std::error::Error for SceneError {}

impl SceneError {
    /// An error at byte `at` of `text`; `file` is `None` for a built-in scene, `key` and `value` are `None` if unknown.
    pub fn in_text(
        file: Option<&str>,
        text: &str,
        at: usize,
        key: Option<&str>,
        value: Option<&str>,
        message: impl Into<String>,
    ) -> Self {
        let (line, column) = place_of(text, at);
        Self {
            file: file.map(str::to_owned),
            position: Some((line, column)),
            key: key.map(str::to_owned),
            value: value.map(Box::from),
            message: message.into(),
            line_text: line_text(text, line),
            unreadable: false,
        }
    }

    /// An error about a key and its value, outside any file.
    pub(super) fn about(key: &str, value: Option<&str>, message: impl Into<String>) -> Self {
        Self { key: Some(key.to_owned()), value: value.map(Box::from), message: message.into(), ..Self::default() }
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.file, self.position) {
            (Some(file), Some((line, column))) => {
                write!(f, "{}:{line}:{column}: ", visible_line(file))?;
            }
            (Some(file), None) => write!(f, "{}: ", visible_line(file))?,
            (None, Some((line, column))) => write!(f, "line {line}, column {column}: ")?,
            (None, None) => {}
        }
        match (&self.key, &self.value) {
            (Some(key), Some(value)) => {
                write!(f, "{} = {}: ", visible_line(key), visible_line(value))?;
            }
            (Some(key), None) => write!(f, "{}: ", visible_line(key))?,
            _ => {}
        }
        f.write_str(&visible(&self.message))?;
        if let (Some(text), Some((line, column))) = (&self.line_text, self.position) {
            let number = line.to_string();
            let mark = column.saturating_sub(1) as usize;
            write!(f, "\n {number} | {text}\n {:width$} | {:mark$}^", "", "", width = number.len())?;
        }
        Ok(())
    }
}

/// One-based line and column of the position after `before`. Scene texts are short, so the counts fit.
pub(super) fn line_and_column(before: &str) -> (u32, u32) {
    let line_start = before.rfind('\n').map_or(0, |at| at + 1);
    let from_one = |count: usize| u32::try_from(count + 1).unwrap_or(u32::MAX);
    (from_one(before.matches('\n').count()), from_one(before[line_start..].chars().count()))
}

/// One-based line and column of byte `at` of `text`.
pub(super) fn place_of(text: &str, at: usize) -> (u32, u32) {
    line_and_column(&text[..text.floor_char_boundary(at)])
}

/// Text of the one-based line `line`; `None` if it is too long for a terminal or contains control characters.
pub(super) fn line_text(text: &str, line: u32) -> Option<Box<str>> {
    let line = text.lines().nth(line.saturating_sub(1) as usize).unwrap_or("");
    let line = line.replace('\t', " ");
    let fit = line.len() <= 160 && visible_line(&line) == line;
    fit.then(|| line.into())
}

/// A hint for error messages: the parameter whose key or last key part is nearest to `wrong`, or the nearest of `words`.
pub(super) fn nearest_parameter<'a>(
    wrong: &str,
    mut keys: impl Iterator<Item = &'a str> + Clone,
    words: &[&'a str],
) -> String {
    fn last(key: &str) -> &str {
        key.rsplit('.').next().unwrap_or(key)
    }
    // The right name in the wrong section, if only one section has it.
    let mut elsewhere = keys.clone().filter(|key| last(key) == last(wrong));
    if let Some(key) = elsewhere.next().filter(|key| elsewhere.all(|other| other == *key)) {
        return did_you_mean(Some(key));
    }
    // Omitting the section is a common mistake: compare both forms.
    let forms = keys.clone().map(last).chain(keys.clone());
    let near = nearest_name(wrong, words.iter().copied().chain(forms));
    let full =
        near.filter(|name| !words.contains(name)).and_then(|name| keys.find(|key| *key == name || last(key) == name));
    did_you_mean(full.or(near))
}

/// "No such body", with the nearest name and all names.
pub(super) fn no_body<'a>(name: &str, names: impl Iterator<Item = &'a str> + Clone) -> String {
    no_such(["body", "bodies"], name, names)
}

/// "No such joint with play", with the nearest name and all names.
pub(super) fn no_ball_joint(name: &str, joints: &[super::LooseJoint]) -> String {
    no_such(["joint with play", "joints with play"], name, joints.iter().map(|joint| joint.name.as_str()))
}

fn no_such<'a>([what, plural]: [&str; 2], name: &str, names: impl Iterator<Item = &'a str> + Clone) -> String {
    let near = nearest(name, names.clone());
    let listed: Vec<&str> = names.clone().take(12).collect();
    let more = if names.count() > listed.len() { ", …" } else { "" };
    format!("no {what} `{}`{near}; {plural}: {}{more}", brief(name), listed.join(", "))
}
