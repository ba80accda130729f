//! Arguments of `tolerance`.

use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};

use super::{SceneArguments, StudyArguments};
use crate::analysis::sampling::Sampling;

/// `tolerance`.
#[derive(Debug, Args)]
#[command(group = clap::ArgGroup::new("uncertain").required(true).multiple(true).args(["tolerances", "over"]))]
pub struct ToleranceArguments {
    /// Scene.
    #[command(flatten)]
    pub scene: SceneArguments,
    /// Limit of an output: an upper one (`tip-error=50um`), both (`S1.normal:max=20N..500N`) or a lower one
    /// (`tip-error-rms=1um..`); outputs as in `sensitivity --output`; may be repeated for other outputs. A unit is accepted
    /// if it meets all limits.
    #[arg(long, value_name = "OUTPUT=LIMIT", required = true)]
    pub limit: Vec<String>,
    /// Uncertain parameters: a CSV file with the heading `parameter,distribution`, in each row a key or pattern and its range,
    /// distribution or fit as in --over.
    #[arg(long, value_name = "FILE")]
    pub tolerances: Option<PathBuf>,
    /// Uncertain parameters: a key, in which `*` stands for any characters, and a range or distribution, e.g.
    /// `joint.*.clearance=0.05mm..0.2mm`, `contact.friction=normal(0.15, 0.02)`, `joint.S1.clearance=H7/g6`; may be repeated and
    /// overrides --tolerances [default range: half to one and a half of the value, within what is allowed].
    #[arg(long, value_name = "PATTERN[=RANGE]")]
    pub over: Vec<String>,
    /// Units of the lot, one run each; with `sobol` a power of two is best.
    #[arg(long, value_name = "N", default_value = "1000", value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    pub runs: u32,
    /// How the values of the lot are drawn.
    #[arg(long, value_name = "METHOD", default_value = "sobol", value_parser = sampling_parser())]
    pub sampling: Sampling,
    /// Find the cheapest fits that hold --yield: a CSV file with the heading `parameter,fit,cost`, in each row a key or
    /// pattern, one of its candidates as in --over, and its cost; list the candidates of a parameter from the loosest to the
    /// tightest.
    #[arg(long, value_name = "FILE")]
    pub cost: Option<PathBuf>,
    /// Yield that the fits must hold, e.g. `99%` or `0.99`.
    #[arg(long = "yield", value_name = "FRACTION", default_value = "99%", value_parser = parse_fraction)]
    pub required_yield: f64,
    /// Largest number of choices of fits to try, each with --runs runs.
    #[arg(long, value_name = "N", default_value = "64", value_parser = clap::value_parser!(u32).range(1..=10000))]
    pub evaluations: u32,
    /// Runs.
    #[command(flatten)]
    pub study: StudyArguments,
}

/// Parser for `--sampling`.
fn sampling_parser() -> impl TypedValueParser<Value = Sampling> {
    let sampling_of_word = |word: String| Sampling::ALL.into_iter().find(|sampling| sampling.word() == word);
    PossibleValuesParser::new(Sampling::ALL.map(Sampling::word))
        .map(move |word| sampling_of_word(word).expect("one of these"))
}

/// Parses a part of a whole, above 0 and up to 1: `99%` or `0.99`.
fn parse_fraction(text: &str) -> Result<f64, String> {
    let (number, whole) = text.trim().strip_suffix('%').map_or((text, 1.0), |number| (number, 100.0));
    let fraction = number.trim().parse::<f64>().ok().map(|number| number / whole);
    let fraction = fraction.filter(|fraction| *fraction > 0.0 && *fraction <= 1.0);
    fraction.ok_or_else(|| "expected a part of the lot above 0 and up to 100 %, e.g. 99% or 0.99".to_owned())
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_fraction_is_a_number_or_a_percentage() {
        for (text, value) in [("99%", 0.99), ("99 %", 0.99), ("0.5", 0.5), ("100%", 1.0)] {
            assert_eq!(super::parse_fraction(text), Ok(value));
        }
        for bad in ["99", "0", "-1%", "101%", "%", "nan", "nan%", ""] {
            assert!(super::parse_fraction(bad).is_err(), "{bad}");
        }
    }
}
