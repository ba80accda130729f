//! Laws of motion for drives: functions of time with exact first and second derivatives, one file per family. `scene/drives.rs`
//! reads their parameters from a scene.

mod bump;
mod formula;
mod harmonic;
mod line;
mod table;

use bump::{Pulse, Ramp};
use formula::Formula;
use harmonic::Harmonics;
use line::Line;
use table::Table;

use std::fmt::Debug;
use std::sync::Arc;

use crate::interpolate::{Ends, Interpolation};
use crate::jet::Jet;
use crate::machine::{Description, Drive, Element, Joint, Machine};

/// A coordinate, m or rad, or a factor as a function of time, s. Allocates nothing.
pub trait Law: Debug + Send + Sync {
    /// Coordinate, rate and acceleration at `t`. The rate of a coordinate is continuous, that of a factor between ends of steps.
    fn at(&self, t: f64) -> Jet;

    /// Period of the motion, s; infinite if it does not repeat or nothing moves.
    fn period(&self) -> f64 {
        f64::INFINITY
    }

    /// Shortest period of oscillation in the motion, s. A mechanism that follows it exactly uses steps of a fiftieth of this.
    fn shortest_period(&self) -> f64 {
        self.period()
    }

    /// Latest end of a step that starts at `t`, s, to resolve features of the law.
    fn step_end(&self, _t: f64) -> f64 {
        f64::INFINITY
    }

    /// Whether [`Self::step_end`] is ever finite.
    fn bounds_steps(&self) -> bool {
        false
    }
}

/// Source of a driven coordinate's motion.
#[derive(Clone, Debug)]
pub enum Trajectory {
    /// This function of the machine's closed form.
    Function(usize),
    /// A law of its own.
    Own(Arc<dyn Law>),
}

/// Shortest step that [`Law::step_end`] may impose, s. It prevents steps of rounding length.
const MIN_STEP: f64 = 1e-9;
/// Minimum number of steps over a single ramp or pulse.
const PARTS: f64 = 50.0;

/// Trajectory of a coordinate with this `drive`; an angle if it `turns`.
pub(super) fn trajectory_of(drive: &Drive, turns: bool) -> Trajectory {
    Trajectory::Own(match drive {
        Drive::Function(function) => return Trajectory::Function(*function),
        Drive::Constant { position, velocity } => Arc::new(Line { position: *position, velocity: *velocity, turns }),
        Drive::Harmonic { mean, terms } => Arc::new(Harmonics::new(*mean, terms)),
        Drive::Ramp { from, to, start, duration } => {
            Arc::new(Ramp { from: *from, rise: to - from, start: *start, duration: *duration })
        }
        Drive::Pulse { base, height, start, duration } => {
            Arc::new(Pulse { base: *base, height: *height, start: *start, duration: *duration })
        }
        Drive::Table { points, interpolation, repeats } => {
            Arc::new(Table::new(points, *interpolation, Ends::of_motion(*repeats)))
        }
        Drive::Formula { program, scale, resolve } => {
            Arc::new(Formula { program: program.clone(), scale: *scale, max_step: *resolve })
        }
    })
}

/// Time law that an element follows, if any. The rate of a load's factor may jump.
pub(crate) fn law_of(element: &Element) -> Option<Arc<dyn Law>> {
    let Description { law, is_external, .. } = element.describe();
    let (_, drive) = law?;
    match drive {
        // It follows the data up to its ends.
        Drive::Table { points, interpolation: Interpolation::Monotone, repeats: false } if is_external => {
            Some(Arc::new(Table::new(points, Interpolation::Monotone, Ends::Natural)))
        }
        _ => trajectory_of(drive, element.is_on_hinge()).law().cloned(),
    }
}

/// Laws of joint drives and of the time laws of force elements, without the functions of the closed form.
pub fn laws_of(machine: &Machine) -> impl Iterator<Item = Arc<dyn Law>> {
    let drives = machine.joints.iter().flat_map(Joint::drives);
    let of_drives = drives.filter_map(|(freedom, drive)| trajectory_of(drive, freedom.turns()).law().cloned());
    of_drives.chain(machine.elements.iter().filter_map(law_of))
}

/// Periods of joint drives and of the time laws of force elements, s; infinite if one does not repeat or nothing moves.
pub fn periods_of(machine: &Machine) -> impl Iterator<Item = f64> {
    let drives = machine.joints.iter().flat_map(Joint::drives);
    let of_drives = drives.map(|(freedom, drive)| {
        let trajectory = trajectory_of(drive, freedom.turns());
        trajectory.law().map_or_else(|| closed_period(machine), |law| law.period())
    });
    of_drives.chain(machine.elements.iter().filter_map(law_of).map(|law| law.period()))
}

impl Trajectory {
    /// Its own law, if it has one.
    pub fn law(&self) -> Option<&Arc<dyn Law>> {
        match self {
            Self::Function(_) => None,
            Self::Own(law) => Some(law),
        }
    }

    /// As [`Law::shortest_period`].
    pub(super) fn shortest_period(&self, machine: &Machine) -> f64 {
        self.law().map_or_else(|| closed_period(machine), |law| law.shortest_period())
    }
}

/// Period of the functions of the closed form of `machine` that drives follow, s; infinite if none moves.
fn closed_period(machine: &Machine) -> f64 {
    let driving_functions = machine.joints.iter().flat_map(Joint::drives).filter_map(|(_, drive)| match drive {
        Drive::Function(function) => Some(*function),
        _ => None,
    });
    let driving_functions: Vec<usize> = driving_functions.collect();
    machine.closed_form.as_ref().map_or(f64::INFINITY, |form| form.period(&driving_functions))
}

/// Latest end of a step from `t` for a motion that lasts from `start` to `end`.
fn step_end_within(start: f64, end: f64, t: f64) -> f64 {
    if t < start - MIN_STEP {
        start
    } else if t < end - MIN_STEP {
        end.min(t + (end - start) / PARTS)
    } else {
        f64::INFINITY
    }
}
