//! Reasons in a scene's settings to doubt its results, as numbers with their wording.

use std::fmt;

use crate::contact::NormalLaw;
use crate::interpolate::Overshoot;
use crate::units::{format_quantity, format_quantity_digits};

/// A reason in the settings to distrust any result of a scene. Its `Display` is a sentence for the user.
#[derive(Clone, Debug, PartialEq)]
pub enum Doubt {
    /// The normal-force law does not give the requested restitution.
    Restitution {
        /// Names of the joints.
        joints: String,
        /// Their law.
        law: NormalLaw,
        /// Requested restitution.
        requested: f64,
        /// Restitution of an undisturbed impact.
        achieved: f64,
    },
    /// A clearance so small that the contact patch is not small compared with the ball.
    Clearance {
        /// Names of the joints.
        joints: String,
        /// Clearance, m.
        clearance: f64,
        /// Ball radius, m.
        ball_radius: f64,
    },
    /// A fixed step too long for the shortest expected impact.
    Step {
        /// Joint with that impact.
        joint: String,
        /// `solver.step`, s.
        step: f64,
        /// Duration of the impact, or of sliding within it until friction reverses it, s.
        duration: f64,
        /// Whether `duration` refers to sliding.
        sliding: bool,
        /// A step that is short enough, s.
        recommended: f64,
    },
    /// A tolerance too loose for impacts.
    Tolerance {
        /// `solver.tolerance`.
        tolerance: f64,
        /// Loosest adequate tolerance.
        loosest: f64,
    },
    /// A table whose spline leaves the range of the points around it.
    Overshoot {
        /// The one that leaves it furthest: `drive of guide`.
        table: String,
        /// Number of other tables with the same fault.
        others: usize,
        /// Where and how far, SI.
        overshoot: Overshoot,
        /// Units of abscissas and values; "" for pure numbers.
        units: [&'static str; 2],
    },
    /// The list of ball joints with distinct settings is incomplete.
    MoreJoints,
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::MoreJoints => {
                f.write_str("Further ball joints have settings of their own; warnings about them are not listed.")
            }
            Self::Restitution { joints, law, requested, achieved } => write!(
                f,
                "{joints}: restitution {requested} with {} gives {achieved:.3} in an undisturbed impact; normal_law = \
                 gonthier gives the restitution asked for{}.",
                law.word(),
                if *requested > 0.0 { "" } else { ", above 0" }
            ),
            Self::Clearance { joints, clearance, ball_radius } => write!(
                f,
                "{joints}: clearance {} is so small that the contact patch is no longer small against the ball \
                 (radius {}), which Hertz's theory assumes.",
                format_quantity(*clearance, "mm"),
                format_quantity(*ball_radius, "mm")
            ),
            Self::Step { joint, step, duration, sliding, recommended } => {
                let why = if *sliding {
                    format!("friction at ball joint {joint} is estimated to reverse the sliding in")
                } else {
                    format!("an impact at ball joint {joint} is estimated to last")
                };
                write!(
                    f,
                    "solver.step {}: {why} {}, which a fixed step this long does not resolve; use {} or less, or \
                     solver.method = automatic.",
                    format_quantity(*step, "us"),
                    format_quantity(libm::round(duration * 1e8) * 1e-8, "us"),
                    format_quantity(*recommended, "us")
                )
            }
            Self::Overshoot { table, others, overshoot, units: [of_x, of_y] } => {
                let more = if *others > 0 { format!(" (and {others} more)") } else { String::new() };
                let value = |y: f64| format_quantity_digits(y, of_y, 4);
                write!(
                    f,
                    "{table}{more}: the spline reaches {} at {}, but the points around it lie between {} and {}; interpolation = \
                     monotone stays between the points.",
                    value(overshoot.value),
                    format_quantity_digits(overshoot.at, of_x, 4),
                    value(overshoot.range[0]),
                    value(overshoot.range[1])
                )
            }
            Self::Tolerance { tolerance, loosest } => write!(
                f,
                "solver.tolerance {tolerance:e}: impacts may gain or lose much of their energy; use {loosest:e} or less."
            ),
        }
    }
}

/// A warning before a run: a reason to distrust its result, or a cause of slow stepping. Its `Display` is a sentence.
#[derive(Clone, Debug, PartialEq)]
pub enum Warning {
    /// A reason to doubt the result.
    Doubt(Doubt),
    /// A friction ramp that needs small steps.
    StiffFriction {
        /// Names of the joints.
        joints: String,
        /// `slip_speed_high`, m/s.
        slip_speed_high: f64,
    },
    /// A mesh much larger or smaller than the machine around it.
    MeshUnit {
        /// Key of the shape.
        shape: String,
        /// Number of other meshes with the same fault.
        others: usize,
        /// Length of its unit, m.
        unit: f64,
        /// Largest distance from its origin, m.
        reach: f64,
        /// The same distance for the rest of its body or of the machine, m.
        rest: f64,
        /// A unit that fits.
        suggested_unit: &'static str,
        /// `reach` in that unit, m.
        suggested_reach: f64,
    },
}

/// Kind of a warning: warnings of one kind differ only in numbers and names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct WarningKind(std::mem::Discriminant<Warning>, Option<std::mem::Discriminant<Doubt>>);

impl Warning {
    /// Kind of this warning.
    pub fn kind(&self) -> WarningKind {
        let doubt = match self {
            Self::Doubt(doubt) => Some(std::mem::discriminant(doubt)),
            Self::StiffFriction { .. } | Self::MeshUnit { .. } => None,
        };
        WarningKind(std::mem::discriminant(self), doubt)
    }

    /// Key of the parameter concerned: `solver.step`, or a key without section that ball joints may override.
    pub fn key(&self) -> Option<&'static str> {
        match self {
            Self::Doubt(Doubt::Restitution { .. }) => Some("restitution"),
            Self::Doubt(Doubt::Clearance { .. }) => Some("clearance"),
            Self::Doubt(Doubt::Step { .. }) => Some("solver.step"),
            Self::Doubt(Doubt::Tolerance { .. }) => Some("solver.tolerance"),
            Self::StiffFriction { .. } => Some("slip_speed_high"),
            Self::Doubt(Doubt::MoreJoints | Doubt::Overshoot { .. }) | Self::MeshUnit { .. } => None,
        }
    }

    /// Whether other `[solver]` settings would remove the warning.
    pub fn is_about_solver(&self) -> bool {
        self.key().is_some_and(|key| key.starts_with("solver."))
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Doubt(doubt) => doubt.fmt(f),
            Self::StiffFriction { joints, slip_speed_high } => write!(
                f,
                "{joints}: slip_speed_high {} makes friction very stiff; expect small steps.",
                format_quantity(*slip_speed_high, "mm/s")
            ),
            Self::MeshUnit { shape, others, unit, reach, rest, suggested_unit, suggested_reach } => {
                let length = |m: f64| format_quantity_digits(m, if m < 1.0 { "mm" } else { "m" }, 3);
                let more = if *others > 0 { format!(" (and {others} more)") } else { String::new() };
                write!(
                    f,
                    "{shape}{more}: with the unit {} this mesh reaches {}, the rest of the machine {}; unit = \"{suggested_unit}\" would \
                     make it {}.",
                    length(*unit),
                    length(*reach),
                    length(*rest),
                    length(*suggested_reach)
                )
            }
        }
    }
}
