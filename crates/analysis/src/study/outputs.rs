//! The numbers that a run is reduced to.

use super::StudyError;
use crate::statistic::ChannelStatistic;
use jointplay_physics::units::{Dimension, parse_quantity};
use jointplay_scene::Scene;

/// How an output follows from several columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Of {
    Largest,
    Sum,
}

/// An output with a name of its own.
#[derive(Clone, Copy, Debug)]
pub struct NamedOutput {
    /// Name on the command line and in files.
    pub name: &'static str,
    /// Name in the interface, in sentence case.
    pub label: &'static str,
    /// What it is, in a sentence.
    pub help: &'static str,
    /// Statistics of channels; "" for impacts, which are columns of the joints.
    list: &'static str,
    of: Of,
    unit: &'static str,
}

/// A number that a run is reduced to.
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    /// As asked for: `tip-error`, `S1.normal:max`.
    pub name: String,
    /// SI unit; "" for a number.
    pub unit: &'static str,
    of: Of,
    /// Statistics of channels; none for impacts, which are counted per joint.
    keep: Vec<ChannelStatistic>,
}

/// Outputs with a name of their own.
pub const NAMED: [NamedOutput; 5] = [
    NamedOutput {
        name: "tip-error",
        label: "Largest tip error",
        help: "Largest distance of the probe tip from the tip of the machine without play",
        list: "tip_error:max",
        of: Of::Largest,
        unit: "m",
    },
    NamedOutput {
        name: "tip-error-rms",
        label: "Tip error, RMS",
        help: "Root-mean-square distance of the probe tip from the tip of the machine without play",
        list: "tip_error:rms",
        of: Of::Largest,
        unit: "m",
    },
    NamedOutput {
        name: "peak-force",
        label: "Peak normal force",
        help: "Largest normal force of any ball joint, in continuous time",
        list: "*.normal:max",
        of: Of::Largest,
        unit: "N",
    },
    NamedOutput {
        name: "energy-lost",
        label: "Energy lost",
        help: "Energy lost to restitution, friction and damping since the start",
        list: "energy.*_loss:end",
        of: Of::Sum,
        unit: "J",
    },
    NamedOutput {
        name: "impacts",
        label: "Impacts",
        help: "Contacts begun in all ball joints",
        list: "",
        of: Of::Sum,
        unit: "",
    },
];
/// End of the names of the columns that are impacts of the kept time.
const IMPACTS_COLUMN: &str = "_impacts_kept";

/// Parses names of [`NAMED`] and CHANNEL:STATISTIC, separated by commas.
///
/// # Errors
/// An unknown output, channel or statistic; an output that is given twice.
pub fn outputs(scene: &Scene, text: &str) -> Result<Vec<Output>, StudyError> {
    let mut found: Vec<Output> = Vec::new();
    for entry in text.split(',').map(str::trim) {
        let named = NAMED.iter().find(|named| named.name == entry);
        let keep = |list: &str| {
            ChannelStatistic::parse_list(scene, list)
                .map_err(|error| StudyError::Output { entry: entry.to_owned(), error })
        };
        match named {
            Some(NamedOutput { name, list, of, unit, .. }) => {
                let keep = if list.is_empty() { Vec::new() } else { keep(list)? };
                found.push(Output { name: (*name).to_owned(), unit, of: *of, keep });
            }
            None => {
                for one in keep(entry)? {
                    let (name, unit) = (one.to_string(), one.unit());
                    found.push(Output { name, unit, of: Of::Largest, keep: vec![one] });
                }
            }
        }
    }
    if let Some((i, twice)) = found.iter().enumerate().find(|(i, one)| found[..*i].iter().any(|o| o.name == one.name)) {
        return Err(StudyError::Twice { name: twice.name.clone(), position: i + 1 });
    }
    Ok(found)
}

impl Output {
    /// Reads a value of this output, SI.
    ///
    /// # Errors
    /// A sentence: no finite number, or not in a unit of the output.
    pub fn read(&self, text: &str) -> Result<f64, String> {
        let dimension = match self.unit {
            "m" => Some(Dimension::Length),
            "rad" => Some(Dimension::Angle),
            "s" => Some(Dimension::Time),
            _ => None,
        };
        if let Some(dimension) = dimension {
            return parse_quantity(text, dimension).map_err(|error| error.to_string());
        }
        let number = text.trim().strip_suffix(self.unit).unwrap_or(text).trim();
        let value = number.parse::<f64>().ok().filter(|value| value.is_finite());
        value.ok_or_else(|| {
            let unit = if self.unit.is_empty() { String::new() } else { format!(" in {}", self.unit) };
            format!("expected a number for {}{unit}", self.name)
        })
    }

    /// Statistics of channels that it follows from; none for impacts.
    pub(super) fn statistics(&self) -> &[ChannelStatistic] {
        &self.keep
    }

    /// Which of the columns `names` of a record it follows from.
    pub(super) fn columns(&self, names: &[&str]) -> Vec<usize> {
        let is_own = |name: &str| {
            if self.keep.is_empty() {
                name.ends_with(IMPACTS_COLUMN)
            } else {
                self.keep.iter().any(|one| one.column() == name)
            }
        };
        (0..names.len()).filter(|&at| is_own(names[at])).collect()
    }

    /// Its value from those of its columns; unknown if one of them is.
    pub(super) fn value(&self, values: impl Iterator<Item = f64>) -> f64 {
        let larger = |a: f64, b: f64| if b > a || b.is_nan() { b } else { a };
        match self.of {
            Of::Largest => values.reduce(larger).unwrap_or(f64::NAN),
            Of::Sum => values.sum(),
        }
    }
}
