//! What errors quote: the nearest right name, and the beginning of a long input.

/// The first line of an input, truncated to what an error can quote.
pub fn brief(text: &str) -> String {
    let mut short: String = text.lines().next().unwrap_or("").chars().take(60).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    short
}

/// A text longer than this, bytes, is no typing slip; comparing it takes quadratic time.
const LONGEST_SLIP: usize = 100;

/// The one of `names` nearest to `wrong`; `None` if none is near.
pub fn nearest_name<'a>(wrong: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    if wrong.len() > LONGEST_SLIP {
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

/// A near name as errors quote it: in brackets, or empty.
pub fn did_you_mean(near: Option<&str>) -> String {
    near.map_or_else(String::new, |name| format!(" (did you mean `{name}`?)"))
}

/// The one of `names` nearest to `wrong`, as errors quote it: in brackets, or empty.
pub fn nearest<'a>(wrong: &str, names: impl IntoIterator<Item = &'a str>) -> String {
    did_you_mean(nearest_name(wrong, names))
}
