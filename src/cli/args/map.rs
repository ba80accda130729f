//! Arguments of `map`.

use std::path::PathBuf;

use clap::Args;

use super::{SceneArguments, SummaryForm};
use crate::analysis::map::DIRECTIONS;

/// `map`.
#[derive(Debug, Args)]
pub struct MapArguments {
    /// Scene.
    #[command(flatten)]
    pub scene: SceneArguments,
    /// What varies, as in `sweep --vary`: a driven coordinate, which is held at each value, such as
    /// `crank.angle=0deg..90deg:10` or `slider.position=-20mm..20mm:11`, or a parameter; may be repeated. All combinations are
    /// computed, the last one varying fastest. Other drives keep their positions at t = 0.
    #[arg(long, value_name = "KEY=VALUES", required = true)]
    pub over: Vec<String>,
    /// Number of directions in which the largest error is computed at each point.
    #[arg(long, value_name = "N", default_value = "64", value_parser = parse_directions)]
    pub directions: usize,
    /// Threads to use [default: one for each core]; the result does not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// File to write: all arrays as a NumPy archive (.npz), or the points with their errors for ParaView (.vtk); may be repeated.
    #[arg(long, value_name = "FILE")]
    pub out: Vec<PathBuf>,
    /// Format of the summary on standard output.
    #[arg(long, value_enum, value_name = "FORMAT", default_value = "text")]
    pub summary: SummaryForm,
    /// Replace existing files.
    #[arg(long)]
    pub force: bool,
    /// No progress.
    #[arg(long)]
    pub quiet: bool,
}

/// Parses a number of directions.
fn parse_directions(text: &str) -> Result<usize, String> {
    let number = text.parse().ok().filter(|number| DIRECTIONS.contains(number));
    number.ok_or_else(|| format!("expected a whole number from {} to {}", DIRECTIONS.start(), DIRECTIONS.end()))
}
