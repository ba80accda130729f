//! The numbers that a run is reduced to.

use crate::analysis::point::{Protocol, Span};
use crate::analysis::statistic::ChannelStatistic;
use crate::cli::Failure;
use crate::scene::Scene;
use crate::units::{Dimension, parse_quantity};

/// How an output follows from several columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Of {
    Largest,
    Sum,
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

/// Outputs with a name of their own: name, what it stands for, and how several columns combine. Impacts are columns of the
/// joints.
const NAMED: [(&str, &str, Of, &str); 5] = [
    ("tip-error", "tip_error:max", Of::Largest, "m"),
    ("tip-error-rms", "tip_error:rms", Of::Largest, "m"),
    ("peak-force", "*.normal:max", Of::Largest, "N"),
    ("energy-lost", "energy.*_loss:end", Of::Sum, "J"),
    (IMPACTS, "", Of::Sum, ""),
];
const IMPACTS: &str = "impacts";
/// End of the names of the columns that are impacts of the kept time.
const IMPACTS_COLUMN: &str = "_impacts_kept";

/// Parses the value of `option`: names of [`NAMED`] and CHANNEL:STATISTIC, separated by commas.
///
/// # Errors
/// Usage: an unknown output, channel or statistic.
pub fn outputs(scene: &Scene, option: &str, text: &str) -> Result<Vec<Output>, Failure> {
    let mut found: Vec<Output> = Vec::new();
    for entry in text.split(',').map(str::trim) {
        let named = NAMED.iter().find(|(name, ..)| *name == entry);
        let keep = |list: &str| {
            ChannelStatistic::parse_list(scene, list).map_err(|error| {
                let names: Vec<&str> = NAMED.iter().map(|(name, ..)| *name).collect();
                Failure::usage(format!("{option} {entry}: {error}; outputs by name: {}", names.join(", ")))
            })
        };
        match named {
            Some((name, list, of, unit)) => {
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
        return Err(Failure::usage(format!("{option} {}: given twice ({} and before)", twice.name, i + 1)));
    }
    Ok(found)
}

/// What the runs must record for `outputs`.
pub(super) fn protocol(outputs: &[Output], span: Span) -> Protocol {
    let mut keep: Vec<ChannelStatistic> = Vec::new();
    for one in outputs.iter().flat_map(|output| &output.keep) {
        if !keep.contains(one) {
            keep.push(one.clone());
        }
    }
    let joints = outputs.iter().any(|output| output.keep.is_empty());
    Protocol { span, keep, joints }
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
