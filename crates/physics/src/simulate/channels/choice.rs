//! Selection of channels by name.

use std::collections::BTreeSet;

use super::table::TIME;
use super::{Reading, lay_out};
use crate::machine::Machine;
use crate::simulate::Frame;
use crate::suggest::nearest;

/// Place of the signals that `run` writes only on request: after all others.
const ON_REQUEST: u8 = u8::MAX;

/// A channel available in the rows of a scene.
#[derive(Clone, Debug)]
pub struct ChannelInfo {
    /// Its name: parts separated by dots, such as `S1.force.x`.
    pub name: String,
    /// Name of its column in a file, with the SI unit.
    pub column: String,
    /// SI unit; empty for a code.
    pub unit: &'static str,
    /// Description.
    pub help: &'static str,
    /// Whether `run` writes it by default.
    pub by_default: bool,
    pub(super) reading: Reading,
}

impl ChannelInfo {
    /// Its name without the component.
    pub fn group(&self) -> &str {
        match self.name.rsplit_once('.') {
            Some((group, "x" | "y" | "z" | "alpha" | "beta" | "gamma")) => group,
            _ => &self.name,
        }
    }

    /// Where a frame has its value.
    pub fn reading(&self) -> Reading {
        self.reading
    }

    /// Column name of its `statistic`, with the unit last: `S1_normal_max_N`.
    pub fn column_of(&self, statistic: &str) -> String {
        let unit = UNITS.iter().find(|(end, _)| self.column.ends_with(end)).map_or("", |(end, _)| end);
        format!("{}_{statistic}{unit}", &self.column[..self.column.len() - unit.len()])
    }

    /// Whether `pattern` matches its name, a prefix of the name that ends before a dot, or its column.
    pub fn is_matched_by(&self, pattern: &str) -> bool {
        self.names().any(|name| matches_pattern(pattern, name)) || matches_pattern(pattern, &self.column)
    }

    /// Its name, then the name without its last part, and so on.
    fn names(&self) -> impl Iterator<Item = &str> {
        let cuts = self.name.rmatch_indices('.').map(|(dot, _)| dot);
        [self.name.len()].into_iter().chain(cuts).map(|end| &self.name[..end])
    }
}

/// A pattern that no channel matches.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{pattern}` is none of the scene's channels{near}")]
pub struct UnknownChannel {
    /// The pattern.
    pub pattern: String,
    /// The nearest name, in brackets; or empty.
    near: String,
}

/// The channels of `list` that match `pattern`.
///
/// # Errors
/// A pattern without a match.
pub fn matching<'a>(list: &'a [ChannelInfo], pattern: &str) -> Result<Vec<&'a ChannelInfo>, UnknownChannel> {
    let chosen: Vec<&ChannelInfo> = list.iter().filter(|channel| channel.is_matched_by(pattern)).collect();
    if chosen.is_empty() {
        let near = nearest(pattern, list.iter().flat_map(ChannelInfo::names));
        return Err(UnknownChannel { pattern: pattern.to_owned(), near });
    }
    Ok(chosen)
}

/// Every channel of `machine` in order: the columns that `run` writes by default, then the others. The frame `first` shows whether
/// the machine has a tip error and a ledger, and what its elements report.
pub fn channels_of(machine: &Machine, first: &Frame) -> Vec<ChannelInfo> {
    let (mut list, mut names, mut columns) = (Vec::new(), BTreeSet::new(), BTreeSet::new());
    let place = |signal: &super::Signal| {
        let known = !signal.name.is_empty();
        known.then(|| signal.run.unwrap_or(ON_REQUEST))
    };
    lay_out(machine, Some(first), usize::MAX, place, |found| {
        // A term shown in every plot but only in the rows of some scenes has two signals.
        if names.insert(found.name.clone()) {
            let mut column = found.column;
            // A part's name may make its column clash with one of the output body, as with a joint `alpha`.
            while !columns.insert(column.clone()) {
                column.insert_str(0, "part_");
            }
            list.push(ChannelInfo {
                name: found.name,
                unit: unit_of(found.signal.column),
                column,
                help: found.signal.help,
                by_default: found.signal.run.is_some(),
                reading: found.reading,
            });
        }
    });
    list
}

/// The time and the channels of `list` that match one of `patterns`, in the order of the list; without patterns, those that `run`
/// writes by default. In patterns, `*` matches any characters and `?` exactly one.
///
/// # Errors
/// A pattern without a match.
pub fn chosen_channels(mut list: Vec<ChannelInfo>, patterns: &[String]) -> Result<Vec<ChannelInfo>, UnknownChannel> {
    for pattern in patterns {
        matching(&list, pattern)?;
    }
    list.retain(|channel| {
        let is_requested = patterns.iter().any(|pattern| channel.is_matched_by(pattern));
        channel.name == TIME || is_requested || (patterns.is_empty() && channel.by_default)
    });
    Ok(list)
}

/// Units by column-name suffix, longer suffixes first.
const UNITS: [(&str, &str); 10] = [
    ("_rad_s2", "rad/s2"),
    ("_rad_s", "rad/s"),
    ("_m_s2", "m/s2"),
    ("_m_s", "m/s"),
    ("_rad", "rad"),
    ("_Nm", "N m"),
    ("_N", "N"),
    ("_J", "J"),
    ("_m", "m"),
    ("_s", "s"),
];

/// Unit of a column in the table.
fn unit_of(column: &str) -> &'static str {
    let found = UNITS.iter().find(|(end, _)| column.ends_with(end));
    found.map_or("", |(_, unit)| unit)
}

/// Whether `pattern`, in which `*` stands for any characters and `?` for one, matches all of `name`.
pub fn matches_pattern(pattern: &str, name: &str) -> bool {
    let (pattern, name) = (pattern.as_bytes(), name.as_bytes());
    let (mut p, mut n) = (0, 0);
    // After the latest `*`: the next pattern position, and the end of the text that the `*` matches.
    let mut star = None;
    while n < name.len() {
        match pattern.get(p) {
            Some(b'*') => {
                p += 1;
                star = Some((p, n));
            }
            Some(c) if *c == b'?' || *c == name[n] => (p, n) = (p + 1, n + 1),
            _ => {
                let Some((behind, end)) = star else {
                    return false;
                };
                star = Some((behind, end + 1));
                (p, n) = (behind, end + 1);
            }
        }
    }
    pattern[p..].iter().all(|c| *c == b'*')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_match_with_two_wildcards() {
        for (pattern, name, matching) in [
            ("S1.force", "S1.force", true),
            ("S1.force", "S1.force.x", false),
            ("S?.force", "S1.force", true),
            ("S?.force", "S12.force", false),
            ("*.force", "S12.force", true),
            ("*", "", true),
            ("?", "", false),
            ("", "", true),
            ("", "a", false),
            ("a*b*c", "a-b-b-cc", true),
            ("a*b*c", "a-b-b-cd", false),
            ("**x", "x", true),
            ("*ab", "aab", true),
            ("*.?", "rod.pose.x", true),
        ] {
            assert_eq!(matches_pattern(pattern, name), matching, "{pattern} {name}");
        }
    }
}
