//! The sweep that the arguments of `sweep` request.

use super::options;
use crate::analysis::axis::Axis;
use crate::analysis::design::Design;
use crate::analysis::point::{Plan, Protocol, Span};
use crate::analysis::read_points;
use crate::analysis::statistic::ChannelStatistic;
use crate::analysis::sweep::Sweep;
use crate::cli::args::SweepArguments;
use crate::cli::{Failure, load, quantity};
use crate::scene::Scene;

/// Size limit of the file of points, in bytes.
const LARGEST_POINTS: u64 = 64 << 20;

/// Reads and checks the sweep.
///
/// # Errors
/// Usage: anything that the scene or the sweep does not accept. Input/output: an unreadable file of points.
pub(super) fn read(arguments: &SweepArguments) -> Result<Sweep, Failure> {
    let scene = load(&arguments.scene)?;
    let design = design(arguments, &scene)?;
    let protocol = protocol(arguments, &scene)?;
    Sweep::new(scene, design, protocol).map_err(usage)
}

fn usage(error: impl std::fmt::Display) -> Failure {
    Failure::usage(error.to_string())
}

fn design(arguments: &SweepArguments, scene: &Scene) -> Result<Design, Failure> {
    let starts = &arguments.start;
    if let Some(path) = &arguments.points {
        let file = path.display().to_string();
        let unreadable = |why: String| Failure::io(format!("cannot read {file}: {why}"));
        let size = std::fs::metadata(path).map_err(|error| unreadable(error.to_string()))?.len();
        if size > LARGEST_POINTS {
            return Err(unreadable(format!("it has {size} bytes, more than the limit of {LARGEST_POINTS}")));
        }
        let text = std::fs::read_to_string(path).map_err(|error| unreadable(error.to_string()))?;
        return read_points(scene, &format!("--points {file}"), &text, starts).map_err(usage);
    }
    let axes = arguments.vary.iter().map(|text| Axis::parse(scene, text));
    let axes = axes.collect::<Result<Vec<_>, _>>().map_err(usage)?;
    let combine = if arguments.zip { Design::zipped } else { Design::crossed };
    combine(scene, axes, starts).map_err(usage)
}

fn protocol(arguments: &SweepArguments, scene: &Scene) -> Result<Protocol, Failure> {
    let keep = arguments.keep.as_deref().map(|text| ChannelStatistic::parse_list(scene, text)).transpose();
    let keep = keep.map_err(|error| {
        let name = arguments.scene.name();
        usage(format!("--keep {error}; `jointplay check {} --channels` lists the channels", name.display()))
    })?;
    let span = match &arguments.duration {
        Some(text) => duration(text, arguments.from.as_deref())?,
        None => Span::Sections {
            plan: Plan {
                periods: arguments.periods.unwrap_or_default(),
                discard: arguments.discard.unwrap_or_default(),
                phase: options::phase(&arguments.phase)?,
                exponent: !arguments.no_exponent,
            },
            interval: arguments.period.as_deref().map(period).transpose()?,
        },
    };
    Ok(Protocol { span, keep: keep.unwrap_or_default() })
}

/// Reads `--duration` and `--from`.
fn duration(text: &str, from: Option<&str>) -> Result<Span, Failure> {
    let duration = quantity::duration("--duration", text)?;
    let end = from.map_or(Ok(0.0), |from| quantity::duration("--from", from))?;
    if duration <= end {
        return Err(usage(match from {
            Some(from) => format!("--duration {text} --from {from}: the statistics must begin before the end"),
            None => format!("--duration {text}: the time must be above 0"),
        }));
    }
    Ok(Span::Duration { duration, from: end })
}

/// Reads `--period`.
fn period(text: &str) -> Result<f64, Failure> {
    let period = quantity::duration("--period", text)?;
    if period > 0.0 { Ok(period) } else { Err(usage(format!("--period {text}: the time must be above 0"))) }
}
