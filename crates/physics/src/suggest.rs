//! Text for error messages: the nearest known name, and a truncated quote of the input.

/// First line of an input, truncated for an error message.
pub fn brief(text: &str) -> String {
    let mut short: String = text.lines().next().unwrap_or("").chars().take(60).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    short
}

/// Longest text, bytes, that is compared with the names: the comparison takes quadratic time.
const MAX_LENGTH: usize = 100;

/// The name nearest to `wrong`; `None` if none is near.
pub fn nearest_name<'a>(wrong: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    if wrong.len() > MAX_LENGTH {
        return None;
    }
    let wrong_lower = wrong.to_lowercase();
    names
        .into_iter()
        .map(|name| (strsim::jaro_winkler(&wrong_lower, &name.to_lowercase()), name))
        .filter(|(score, _)| *score > 0.7)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| name)
}

/// A suggestion for an error message, in brackets; empty if there is none.
pub fn did_you_mean(near: Option<&str>) -> String {
    near.map_or_else(String::new, |name| format!(" (did you mean `{name}`?)"))
}

/// As [`did_you_mean`], for the name nearest to `wrong`.
pub fn nearest<'a>(wrong: &str, names: impl IntoIterator<Item = &'a str>) -> String {
    did_you_mean(nearest_name(wrong, names))
}
