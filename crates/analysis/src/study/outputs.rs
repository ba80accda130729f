//! The scalar results of a run.

use super::StudyError;
use crate::statistic::ChannelStatistic;
use jointplay_physics::units::{Dimension, parse_quantity};
use jointplay_scene::Scene;

/// How several columns are reduced to an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reduction {
    Largest,
    Sum,
}

/// A predefined output with a name.
#[derive(Clone, Copy, Debug)]
pub struct NamedOutput {
    /// Name on the command line and in files.
    pub name: &'static str,
    /// Name in the interface, in sentence case.
    pub label: &'static str,
    /// Description in a sentence.
    pub help: &'static str,
    /// Statistics of channels, as a list; "" for impacts, which are counted in the columns of the joints.
    statistics: &'static str,
    reduction: Reduction,
    unit: &'static str,
}

/// A scalar result of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    /// Requested name, such as `tip-error` or `S1.normal:max`.
    pub name: String,
    /// SI unit; "" for a dimensionless number.
    pub unit: &'static str,
    reduction: Reduction,
    /// Statistics of channels; none for impacts, which are counted per joint.
    statistics: Vec<ChannelStatistic>,
}

/// Predefined outputs.
pub const NAMED: [NamedOutput; 5] = [
    NamedOutput {
        name: "tip-error",
        label: "Largest tip error",
        help: "Largest distance of the probe tip from the tip of the machine without play",
        statistics: "tip_error:max",
        reduction: Reduction::Largest,
        unit: "m",
    },
    NamedOutput {
        name: "tip-error-rms",
        label: "Tip error, RMS",
        help: "Root-mean-square distance of the probe tip from the tip of the machine without play",
        statistics: "tip_error:rms",
        reduction: Reduction::Largest,
        unit: "m",
    },
    NamedOutput {
        name: "peak-force",
        label: "Peak normal force",
        help: "Largest normal force of any joint with play, in continuous time",
        statistics: "*.normal:max",
        reduction: Reduction::Largest,
        unit: "N",
    },
    NamedOutput {
        name: "energy-lost",
        label: "Energy lost",
        help: "Energy lost to restitution, friction and damping since the start",
        statistics: "energy.*_loss:end",
        reduction: Reduction::Sum,
        unit: "J",
    },
    NamedOutput {
        name: "impacts",
        label: "Impacts",
        help: "Contacts begun in all joints with play",
        statistics: "",
        reduction: Reduction::Sum,
        unit: "",
    },
];
/// Suffix of the names of columns that count impacts after the transient.
const IMPACTS_SUFFIX: &str = "_impacts_kept";

/// Parses names of [`NAMED`] and CHANNEL:STATISTIC, separated by commas.
///
/// # Errors
/// An unknown output, channel or statistic; an output that is given twice.
pub fn outputs(scene: &Scene, text: &str) -> Result<Vec<Output>, StudyError> {
    let mut outputs: Vec<Output> = Vec::new();
    for entry in text.split(',').map(str::trim) {
        let named = NAMED.iter().find(|named| named.name == entry);
        let parse = |list: &str| {
            ChannelStatistic::parse_list(scene, list)
                .map_err(|error| StudyError::Output { entry: entry.to_owned(), error })
        };
        match named {
            Some(NamedOutput { name, statistics, reduction, unit, .. }) => {
                let statistics = if statistics.is_empty() { Vec::new() } else { parse(statistics)? };
                outputs.push(Output { name: (*name).to_owned(), unit, reduction: *reduction, statistics });
            }
            None => {
                for statistic in parse(entry)? {
                    let (name, unit) = (statistic.to_string(), statistic.unit());
                    outputs.push(Output { name, unit, reduction: Reduction::Largest, statistics: vec![statistic] });
                }
            }
        }
    }
    if let Some((i, repeated)) =
        outputs.iter().enumerate().find(|(i, output)| outputs[..*i].iter().any(|other| other.name == output.name))
    {
        return Err(StudyError::DuplicateOutput { name: repeated.name.clone(), position: i + 1 });
    }
    Ok(outputs)
}

impl Output {
    /// Parses a value of this output, SI.
    ///
    /// # Errors
    /// A message: not a finite number, or not in a unit of the output.
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

    /// Statistics of channels that determine the output; none for impacts.
    pub(super) fn statistics(&self) -> &[ChannelStatistic] {
        &self.statistics
    }

    /// Indices of those columns of a record, among `names`, that determine the output.
    pub(super) fn columns(&self, names: &[&str]) -> Vec<usize> {
        let is_used = |name: &str| {
            if self.statistics.is_empty() {
                name.ends_with(IMPACTS_SUFFIX)
            } else {
                self.statistics.iter().any(|statistic| statistic.column() == name)
            }
        };
        (0..names.len()).filter(|&column| is_used(names[column])).collect()
    }

    /// Value of the output from the values of its columns; NaN if one of them is.
    pub(super) fn value(&self, values: impl Iterator<Item = f64>) -> f64 {
        let larger = |a: f64, b: f64| if b > a || b.is_nan() { b } else { a };
        match self.reduction {
            Reduction::Largest => values.reduce(larger).unwrap_or(f64::NAN),
            Reduction::Sum => values.sum(),
        }
    }
}
