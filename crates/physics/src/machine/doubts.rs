//! Reasons in a scene's settings to doubt its results, as numbers with their wording.

use crate::contact::NormalLaw;
use crate::interpolate::Overshoot;
use crate::units::{format_quantity, format_quantity_digits};

/// A reason in the settings to distrust any result of a scene. Its `Display` is a sentence for the user.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Doubt {
    /// The normal-force law does not give the requested restitution.
    #[error(
        "{joints}: restitution {requested}{} with {} gives {achieved:.3} in an undisturbed impact; normal_law = gonthier gives \
         the restitution asked for{}.",
        at_speed(*.yielding),
        .law.word(),
        if *.requested > 0.0 { "" } else { ", above 0" }
    )]
    Restitution {
        /// Names of the joints.
        joints: String,
        /// Their law.
        law: NormalLaw,
        /// Requested restitution.
        requested: f64,
        /// Restitution of an undisturbed impact.
        achieved: f64,
        /// Approach speed above the yield speed for which this is, m/s; otherwise it is that of slow impacts.
        yielding: Option<f64>,
    },
    /// A clearance so small that the contact patch is not small compared with the ball.
    #[error(
        "{joints}: clearance {} is so small that the contact patch is no longer small against the ball (radius {}), which \
         Hertz's theory assumes.",
        format_quantity(*.clearance, "mm"),
        format_quantity(*.ball_radius, "mm")
    )]
    Clearance {
        /// Names of the joints.
        joints: String,
        /// Clearance, m.
        clearance: f64,
        /// Ball radius, m.
        ball_radius: f64,
    },
    /// A pin whose play is not small against its length: tilted, its rim reaches less far than its axis says.
    #[error(
        "{joint}: play {} is large for a pin of radius {} and length {}: when it tilts, its rim is farther from the bearing than \
         its axis says, by more than a fortieth of the play; above {} this is noticeable.",
        format_quantity(*.play, "mm"),
        format_quantity(*.radius, "mm"),
        format_quantity(*.length, "mm"),
        format_quantity_digits(*.most, "mm", 3)
    )]
    ShortPin {
        /// Name of the joint.
        joint: String,
        /// Radial play c, m.
        play: f64,
        /// Radius r of the pin, m.
        radius: f64,
        /// Length L, m.
        length: f64,
        /// L^2/(80 r), m.
        most: f64,
    },
    /// A lubricant whose least thickness is not small against the play.
    #[error(
        "lubricant {lubricant}: its thickness {} is above half of the play {} of joint {joint}, so that even in the middle it is thicker than the gap.",
        format_quantity(*.thickness, "um"),
        format_quantity(*.play, "um")
    )]
    Lubricant {
        /// Its name.
        lubricant: String,
        /// Name of its joint.
        joint: String,
        /// Least thickness, m.
        thickness: f64,
        /// Radial play, m.
        play: f64,
    },
    /// A fixed step too long for the shortest expected impact.
    #[error(
        "solver.step {}: {} {}, which a fixed step this long does not resolve; use {} or less, or solver.method = automatic.",
        format_quantity(*.step, "us"),
        match .brief {
            Brief::Impact => format!("an impact at joint {joint} is estimated to last"),
            Brief::Sliding => format!("friction at joint {joint} is estimated to reverse the sliding in"),
            Brief::Bristles => format!("the bristles of joint {joint} follow its sliding within"),
        },
        format_quantity(libm::round(.duration * 1e8) * 1e-8, "us"),
        format_quantity(*.recommended, "us")
    )]
    Step {
        /// Joint with that impact.
        joint: String,
        /// `solver.step`, s.
        step: f64,
        /// How long that takes which is too brief, s.
        duration: f64,
        /// What is.
        brief: Brief,
        /// A step that is short enough, s.
        recommended: f64,
    },
    /// A tolerance too loose for impacts.
    #[error("solver.tolerance {tolerance:e}: impacts may gain or lose much of their energy; use {loosest:e} or less.")]
    Tolerance {
        /// `solver.tolerance`.
        tolerance: f64,
        /// Loosest adequate tolerance.
        loosest: f64,
    },
    /// A table whose spline leaves the range of the points around it.
    #[error(
        "{table}{}: the spline reaches {} at {}, but the points around it lie between {} and {}; interpolation = monotone \
         stays between the points.",
        more(*.others),
        format_quantity_digits(.overshoot.value, .units[1], 4),
        format_quantity_digits(.overshoot.at, .units[0], 4),
        format_quantity_digits(.overshoot.range[0], .units[1], 4),
        format_quantity_digits(.overshoot.range[1], .units[1], 4)
    )]
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
    /// The list of joints with distinct settings is incomplete.
    #[error("Further joints have settings of their own; warnings about them are not listed.")]
    MoreJoints,
}

/// What a fixed step may be too long for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Brief {
    /// An impact.
    Impact,
    /// Sliding within an impact, until friction reverses it.
    Sliding,
    /// The bend of bristles under a motion that slides: the ratio of their damping to their stiffness.
    Bristles,
}

fn at_speed(yielding: Option<f64>) -> String {
    let words = |speed| format!(" (asked for at {}, above the yield speed)", format_quantity_digits(speed, "mm/s", 3));
    yielding.map_or_else(String::new, words)
}

/// A warning before a run: a reason to distrust its result, or a cause of slow stepping. Its `Display` is a sentence.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Warning {
    /// A reason to doubt the result.
    #[error(transparent)]
    Doubt(Doubt),
    /// A friction ramp that needs small steps.
    #[error(
        "{joints}: slip_speed_high {} makes friction very stiff; expect small steps.",
        format_quantity(*.slip_speed_high, "mm/s")
    )]
    StiffFriction {
        /// Names of the joints.
        joints: String,
        /// `slip_speed_high`, m/s.
        slip_speed_high: f64,
    },
    /// A mesh much larger or smaller than the machine around it.
    #[error(
        "{shape}{}: with the unit {} this mesh reaches {}, the rest of the machine {}; unit = \"{suggested_unit}\" would make \
         it {}.",
        more(*.others),
        length(*.unit),
        length(*.reach),
        length(*.rest),
        length(*.suggested_reach)
    )]
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

    /// Key of the parameter concerned: `solver.step`, or a key without section that joints with play may override.
    pub fn key(&self) -> Option<&'static str> {
        match self {
            Self::Doubt(Doubt::Restitution { yielding: Some(_), .. }) => Some("yield_speed"),
            Self::Doubt(Doubt::Restitution { .. }) => Some("restitution"),
            Self::Doubt(Doubt::Clearance { .. } | Doubt::ShortPin { .. } | Doubt::Lubricant { .. }) => {
                Some("clearance")
            }
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

/// A length for a warning about meshes.
fn length(m: f64) -> String {
    format_quantity_digits(m, if m < 1.0 { "mm" } else { "m" }, 3)
}

/// How many others a sentence also concerns.
pub(crate) fn more(others: usize) -> String {
    if others > 0 { format!(" (and {others} more)") } else { String::new() }
}
