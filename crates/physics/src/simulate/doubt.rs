//! Reasons to doubt a result: numbers, and their wording.

use std::fmt;

use crate::scene;

/// Ball joints that a doubt concerns.
#[derive(Clone, Debug, PartialEq)]
pub struct Joints {
    /// Name of the most affected one.
    pub worst: String,
    /// How many others are affected.
    pub others: usize,
}

impl fmt::Display for Joints {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.worst)?;
        match self.others {
            0 => Ok(()),
            others => write!(f, " (and {others} more)"),
        }
    }
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
    fn words(self) -> &'static str {
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

/// Why a result is not to be trusted. Its `Display` is a sentence for the user.
#[derive(Clone, Debug, PartialEq)]
pub enum Doubt {
    /// Follows from the scene's settings, whatever happened in the run.
    Scene(scene::Doubt),
    /// Contacts that lasted fewer fixed steps than needed to resolve their forces.
    Unresolved {
        /// Where.
        joints: Joints,
        /// How many of the worst joint's contacts.
        short: u64,
        /// Contacts of the worst joint.
        contacts: u64,
        /// Steps that an impact needs.
        steps: u64,
    },
    /// Contacts that began slower than `impact_speed_floor` or existed at the start.
    Floored {
        /// Where.
        joints: Joints,
        /// How many of the worst joint's contacts.
        slow: u64,
        /// Contacts of the worst joint.
        contacts: u64,
    },
    /// A contact patch that is not small compared with its ball.
    Patch {
        /// Where.
        joints: Joints,
        /// Radius of the patch over that of the ball.
        radii: f64,
    },
    /// More damping than the law gives an undisturbed impact.
    Damping {
        /// Where.
        joints: Joints,
        /// When, s.
        time: f64,
        /// Damping over elastic force.
        ratio: f64,
        /// The same in an undisturbed impact: chi.
        usual: f64,
    },
    /// Constraints of the `lagrange` form that drifted.
    Drift {
        /// Largest violation, m.
        distance: f64,
    },
    /// Unaccounted energy, compared with the energy exchanged.
    Energy {
        /// J.
        residual: f64,
        /// As a fraction of the energy exchanged.
        share: f64,
    },
    /// Unaccounted energy, compared with a work term of the ledger.
    Work {
        /// The smallest work term.
        work: LedgerTerm,
        /// Its value, J.
        value: f64,
        /// J.
        residual: f64,
    },
    /// An explicit method whose step size was limited by stability, not by the tolerance.
    Held {
        /// Fraction of the simulated time.
        share: f64,
        /// `solver.tolerance`.
        tolerance: f64,
        /// Loosest tolerance at which such steps conserve energy well enough.
        loosest: f64,
    },
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scene(doubt) => doubt.fmt(f),
            Self::Unresolved { joints, short, contacts, steps } => write!(
                f,
                "{joints}: {short} of {contacts} contacts lasted fewer than {steps} steps: their forces are not resolved."
            ),
            Self::Floored { joints, slow, contacts } => write!(
                f,
                "{joints}: {slow} of {contacts} contacts began slower than impact_speed_floor or existed at the start: \
                 they rebound higher than asked."
            ),
            Self::Patch { joints, radii } => {
                write!(f, "{joints}: the contact patch reached {radii:.2} ball radii: Hertz's theory wants it small.")
            }
            Self::Damping { joints, time, ratio, usual } => write!(
                f,
                "{joints}: hit again while touching, at {time:.6} s, its damping reached {ratio:.2} times the elastic \
                 force, {usual:.2} in an undisturbed impact: that force is an artefact; contact.approach_speed = largest \
                 bounds it."
            ),
            Self::Drift { distance } => write!(
                f,
                "formulation lagrange: its constraints were off by {distance:.1e} m; formulation = tree keeps them."
            ),
            Self::Energy { residual, share } => write!(
                f,
                "energy: {residual:.2e} J, {:.2} % of what was exchanged, {}; use a smaller step or tolerance.",
                100.0 * share,
                unaccounted(*residual)
            ),
            Self::Work { work, value, residual } => write!(
                f,
                "energy: {residual:.2e} J {}, and the {} is {value:.2e} J; use a smaller step or tolerance.",
                unaccounted(*residual),
                work.words()
            ),
            Self::Held { share, tolerance, loosest } => write!(
                f,
                "solver.method dopri5: stability held its steps for {:.0} % of the time, and at solver.tolerance \
                 {tolerance:e} these lose or gain energy in settled contacts; use {loosest:e} or less, or \
                 solver.method = automatic.",
                100.0 * share
            ),
        }
    }
}

fn unaccounted(residual: f64) -> &'static str {
    if residual > 0.0 { "came from nowhere" } else { "went nowhere" }
}
