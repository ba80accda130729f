//! The sweep that the arguments of `sweep` request.

use crate::analysis::axis::Axis;
use crate::analysis::design::Design;
use crate::analysis::point::Protocol;
use crate::analysis::read_points;
use crate::analysis::span_request::SpanRequest;
use crate::analysis::statistic::ChannelStatistic;
use crate::analysis::sweep::{Sweep, SweepError};
use crate::cli::args::SweepArguments;
use crate::cli::{Failure, load, quantity, read_text};
use crate::scene::Scene;
use crate::units::{Dimension, parse_quantity};

/// Reads and checks the sweep.
///
/// # Errors
/// Usage: anything that the scene or the sweep does not accept. Input/output: an unreadable file of points.
pub(super) fn read(arguments: &SweepArguments) -> Result<Sweep, Failure> {
    let scene = load(&arguments.scene)?;
    let design = design(arguments, &scene)?;
    let keep = arguments.keep.as_deref().map(|text| ChannelStatistic::parse_list(&scene, text)).transpose();
    let keep = keep.map_err(|error| {
        let name = arguments.scene.name();
        usage(format!("--keep {error}; `jointplay check {} --channels` lists the channels", name.display()))
    })?;
    let span = span(arguments)?.span(&scene).map_err(usage)?;
    let protocol = Protocol { span, keep: keep.unwrap_or_default(), joints: false };
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
    Design::crossed(scene, axes.collect::<Result<_, _>>().map_err(usage)?, starts).map_err(usage)
}

fn span(arguments: &SweepArguments) -> Result<SpanRequest, Failure> {
    let time = |option, text: &Option<String>| text.as_deref().map(|text| quantity::duration(option, text)).transpose();
    Ok(SpanRequest {
        periods: arguments.periods,
        discard: arguments.discard,
        phase: Some(phase(&arguments.phase)?),
        period: time("--period", &arguments.period)?,
        no_exponent: arguments.no_exponent,
        duration: time("--duration", &arguments.duration)?,
        from: time("--from", &arguments.from)?,
        section: Some(arguments.section.clone()),
        crossings: arguments.crossings,
    })
}

/// Reads a drive phase: a fraction of the period, or an angle with its unit.
fn phase(text: &str) -> Result<f64, Failure> {
    let angle = || parse_quantity(text, Dimension::Angle).map(|angle| angle / std::f64::consts::TAU);
    text.trim().parse().or_else(|_| angle()).map_err(|error| usage(format!("--phase {text}: {error}")))
}
