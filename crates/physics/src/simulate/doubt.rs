//! Reasons to doubt a result, as numbers, and their wording.

use crate::machine::{self, more};
use crate::units::format_quantity_digits;

/// Joints with play that a doubt concerns.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{worst}{}", more(*.others))]
pub struct AffectedJoints {
    /// Name of the most affected one.
    pub worst: String,
    /// How many others are affected.
    pub others: usize,
}

/// A work term of the ledger.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum LedgerTerm {
    Drives,
    Gravity,
    Restitution,
    Friction,
    Clearance,
    Changes,
    Damping,
    External,
}

impl LedgerTerm {
    fn phrase(self) -> &'static str {
        match self {
            Self::Drives => "work of the drives",
            Self::Gravity => "work of gravity",
            Self::Restitution => "loss by restitution",
            Self::Friction => "loss by friction",
            Self::Clearance => "work of moving clearances",
            Self::Changes => "work of changed parameters",
            Self::Damping => "loss in dampers",
            Self::External => "work of loads from outside",
        }
    }
}

/// Reason why a result may be unreliable. Its `Display` is a sentence for the user.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Doubt {
    /// Follows from the machine's settings, whatever happened in the run.
    #[error(transparent)]
    Machine(machine::Doubt),
    /// Contacts that lasted fewer fixed steps than needed to resolve their forces.
    #[error("{joints}: {short} of {contacts} contacts lasted fewer than {steps} steps: their forces are not resolved.")]
    Unresolved {
        /// Affected joints.
        joints: AffectedJoints,
        /// Number of such contacts of the worst joint.
        short: u64,
        /// All contacts of the worst joint.
        contacts: u64,
        /// Fewest steps that resolve an impact.
        steps: u64,
    },
    /// A contact found only at the end of a step, by a method that should have located its beginning.
    #[error(
        "{joints}: a contact was detected late, at a depth of {:.2e} mm: its force and rebound are wrong; use a smaller \
         tolerance.",
        1e3 * .depth
    )]
    Late {
        /// Affected joints.
        joints: AffectedJoints,
        /// Penetration there, m.
        depth: f64,
    },
    /// An undisturbed impact that rebounded faster than its law predicts.
    #[error(
        "{joints}: an undisturbed impact, which ended at {time:.6} s, rebounded with {achieved:.3} of its approach speed, but \
         its law gives {law:.3}; use a smaller step or tolerance."
    )]
    Rebound {
        /// Affected joints.
        joints: AffectedJoints,
        /// When it ended, s.
        time: f64,
        /// Separation speed over approach speed.
        achieved: f64,
        /// Restitution that its law predicts.
        law: f64,
    },
    /// Finished contacts that began slower than `impact_speed_floor` or existed at the start.
    #[error(
        "{joints}: {slow} of {contacts} contacts began slower than impact_speed_floor or existed at the start: they rebound \
         higher than asked."
    )]
    BelowSpeedFloor {
        /// Affected joints.
        joints: AffectedJoints,
        /// Number of such contacts of the worst joint.
        slow: u64,
        /// All contacts of the worst joint.
        contacts: u64,
    },
    /// A stop compressed beyond its nominal depth when the run starts.
    #[error(
        "{stop}: the machine starts {} inside this stop, whose depth is {}: it pushes with {}; the start or the limit is wrong.",
        format_quantity_digits(*.depth, if *.turns { "deg" } else { "mm" }, 4),
        format_quantity_digits(*.usual, if *.turns { "deg" } else { "mm" }, 4),
        format_quantity_digits(*.force, if *.turns { "N m" } else { "N" }, 4)
    )]
    StartsInside {
        /// Its name.
        stop: String,
        /// Whether it acts on a hinge: depth and force are then an angle and a torque.
        turns: bool,
        /// Compression, m or rad.
        depth: f64,
        /// Nominal depth, at which it exerts its specified force, m or rad.
        usual: f64,
        /// N or N m.
        force: f64,
    },
    /// A contact patch that is not small compared with its ball, pin or corner.
    #[error(
        "{joints}: the contact patch reached {radii:.2} radii of the ball, pin or corner; Hertz's theory assumes that it is small."
    )]
    Patch {
        /// Affected joints.
        joints: AffectedJoints,
        /// Radius of the patch over that of the ball, pin or corner.
        radii: f64,
    },
    /// A pin displaced so far along its axis that an end of it, or of its bearing, touches nothing.
    #[error(
        "{joints}: it moved {} along its axis, more than its travel of {}: beyond, an end of the shorter part touches nothing.",
        format_quantity_digits(*.distance, "mm", 4),
        format_quantity_digits(*.travel, "mm", 4)
    )]
    Travel {
        /// Affected joints.
        joints: AffectedJoints,
        /// Largest displacement, m.
        distance: f64,
        /// Travel of the worst joint, m.
        travel: f64,
    },
    /// A play worn so wide that areas and walls are no longer those of the start.
    #[error(
        "{joints}: its play has worn {} wider, more than a tenth of {}, of its radius or half its length: the areas over which it \
         wears assume that it stays small.",
        format_quantity_digits(*.depth, "mm", 4),
        format_quantity_digits(*.size, "mm", 4)
    )]
    Worn {
        /// Affected joints.
        joints: AffectedJoints,
        /// Worn depth, m.
        depth: f64,
        /// Radius of the ball or pin, or half the length of the block, m.
        size: f64,
    },
    /// More damping than in an undisturbed impact under the same law.
    #[error(
        "{joints}: at {time:.6} s a ball was hit again while in contact, and its damping reached {ratio:.2} times the elastic \
         force, {usual:.2} in an undisturbed impact: this force is an artefact; contact.approach_speed = largest bounds it."
    )]
    Damping {
        /// Affected joints.
        joints: AffectedJoints,
        /// When, s.
        time: f64,
        /// Damping over elastic force.
        ratio: f64,
        /// This ratio in an undisturbed impact: chi.
        usual: f64,
    },
    /// Constraints of the `lagrange` form that drifted.
    #[error("formulation lagrange: the constraints drifted by {distance:.1e} m; formulation = tree has no drift.")]
    Drift {
        /// Largest violation, m.
        distance: f64,
    },
    /// Unaccounted energy, compared with the energy held and lost.
    #[error(
        "energy: the integration {} {:.2e} J, {:.2} % of the energy stored and dissipated; use a smaller step or tolerance.",
        created(*.residual),
        .residual.abs(),
        100.0 * .share
    )]
    Energy {
        /// J.
        residual: f64,
        /// As a fraction of [`super::Ledger::scale`].
        share: f64,
    },
    /// A negative loss: it created energy.
    #[error(
        "energy: the {} is negative, {value:.2e} J, so that the integration created energy; use a smaller step or tolerance.",
        .work.phrase()
    )]
    Gain {
        /// The loss.
        work: LedgerTerm,
        /// Its value, J.
        value: f64,
    },
    /// Unaccounted energy, compared with a work term of the ledger.
    #[error(
        "energy: the integration {} {:.2e} J, and the {} is {value:.2e} J; use a smaller step or tolerance.",
        created(*.residual),
        .residual.abs(),
        .work.phrase()
    )]
    Work {
        /// The smallest work term.
        work: LedgerTerm,
        /// Its value, J.
        value: f64,
        /// J.
        residual: f64,
    },
    /// An explicit method whose step size was limited by stability, not by the tolerance.
    #[error(
        "solver.method dopri5: stability limited its steps for {:.0} % of the time, and at solver.tolerance {tolerance:e} such \
         steps create or destroy energy in settled contacts; use {loosest:e} or less, or solver.method = automatic.",
        100.0 * .share
    )]
    StabilityLimited {
        /// Fraction of the simulated time.
        share: f64,
        /// `solver.tolerance`.
        tolerance: f64,
        /// Loosest tolerance at which such steps conserve energy well enough.
        loosest: f64,
    },
}

impl Doubt {
    /// Short names of the kinds of doubt for files, indexed by [`Self::kind`].
    pub const KINDS: [&str; 14] = [
        "settings",
        "unresolved impacts",
        "late contact",
        "rebound",
        "slow impacts",
        "contact patch",
        "start inside a stop",
        "damping",
        "constraint drift",
        "energy",
        "works",
        "stability",
        "travel",
        "worn",
    ];

    /// Its kind, an index into [`Self::KINDS`].
    pub fn kind(&self) -> usize {
        match self {
            Self::Machine(_) => 0,
            Self::Unresolved { .. } => 1,
            Self::Late { .. } => 2,
            Self::Rebound { .. } => 3,
            Self::BelowSpeedFloor { .. } => 4,
            Self::Patch { .. } => 5,
            Self::StartsInside { .. } => 6,
            Self::Damping { .. } => 7,
            Self::Drift { .. } => 8,
            Self::Energy { .. } => 9,
            Self::Gain { .. } | Self::Work { .. } => 10,
            Self::StabilityLimited { .. } => 11,
            Self::Travel { .. } => 12,
            Self::Worn { .. } => 13,
        }
    }
}

fn created(residual: f64) -> &'static str {
    if residual > 0.0 { "created" } else { "destroyed" }
}
