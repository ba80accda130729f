//! The sweep that the arguments of `sweep` request.

use super::options;
use crate::analysis::axis::Axis;
use crate::analysis::crossing::Crossing;
use crate::analysis::design::Design;
use crate::analysis::point::{Plan, Protocol, Span};
use crate::analysis::read_points;
use crate::analysis::statistic::ChannelStatistic;
use crate::analysis::sweep::{Sweep, SweepError};
use crate::cli::args::SweepArguments;
use crate::cli::{Failure, load, quantity, read_text};
use crate::scene::Scene;

/// Word for sections at a phase of the drive.
const PHASE: &str = "phase";

/// Reads and checks the sweep.
///
/// # Errors
/// Usage: anything that the scene or the sweep does not accept. Input/output: an unreadable file of points.
pub(super) fn read(arguments: &SweepArguments) -> Result<Sweep, Failure> {
    let scene = load(&arguments.scene)?;
    let design = design(arguments, &scene)?;
    let protocol = protocol(arguments, &scene)?;
    Sweep::new(scene, design, protocol).map_err(|error| match error {
        SweepError::NoPeriod(_) => usage(format!(
            "{error}, or give the length of each point with --duration, or the time between two sections with --period"
        )),
        other => usage(other),
    })
}

fn usage(error: impl std::fmt::Display) -> Failure {
    Failure::usage(error.to_string())
}

fn design(arguments: &SweepArguments, scene: &Scene) -> Result<Design, Failure> {
    let starts = &arguments.start;
    if let Some(path) = &arguments.points {
        let file = format!("--points {}", path.display());
        return read_points(scene, &file, &read_text(path)?, starts).map_err(usage);
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
        Some(text) if arguments.section != PHASE => crossings(arguments, scene, text)?,
        Some(_) if arguments.discard.is_some() => {
            return Err(usage(
                "--discard counts periods or crossings; with --duration alone, --from ends the transient",
            ));
        }
        Some(text) => {
            let (duration, from) = quantity::span(text, arguments.from.as_deref())?;
            Span::Duration { duration, from }
        }
        None if arguments.section != PHASE => {
            // An invalid section has its own error.
            let crossing =
                Crossing::parse(scene, &arguments.section).map_err(|error| usage(format!("--section {error}")))?;
            return Err(usage(format!(
                "--section {}: give the number of crossings with --crossings N --discard D, and --duration to end the search for \
                 them, in place of --periods",
                crossing.text()
            )));
        }
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
    Ok(Protocol { span, keep: keep.unwrap_or_default(), joints: false })
}

/// Reads `--section CHANNEL=VALUE`, `--crossings`, `--discard` and `--duration`.
fn crossings(arguments: &SweepArguments, scene: &Scene, text: &str) -> Result<Span, Failure> {
    let crossing = Crossing::parse(scene, &arguments.section).map_err(|error| usage(format!("--section {error}")))?;
    let Some((count, discard)) = arguments.crossings.zip(arguments.discard) else {
        return Err(usage(format!(
            "--section {}: give the number of crossings with --crossings N --discard D",
            crossing.text()
        )));
    };
    if let Some(from) = &arguments.from {
        return Err(usage(format!("--from {from}: with --section, --discard ends the transient")));
    }
    let (duration, _) = quantity::span(text, None)?;
    Ok(Span::Crossings { crossing, count, discard, duration })
}

/// Reads `--period`.
fn period(text: &str) -> Result<f64, Failure> {
    let period = quantity::duration("--period", text)?;
    if period > 0.0 { Ok(period) } else { Err(usage(format!("--period {text}: the time must be above 0"))) }
}
