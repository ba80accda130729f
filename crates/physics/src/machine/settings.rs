//! Simulation settings of a machine: formulation, start rule, stepper.

use serde::{Deserialize, Serialize};

use crate::integrate::Method;
use crate::words::words;

/// Interpretation of the joints' start values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StartRule {
    /// Exactly as the file gives them.
    #[default]
    AsGiven,
    /// Initial guesses: the mechanism is assembled with every ball concentric with its socket at t = 0, and velocities that
    /// follow from the drives.
    Ideal,
    /// As [`Self::Ideal`], with every ball then moved onto its socket wall, in the direction and to the penetration given by the
    /// joint force of the mechanism without play.
    Settled,
    /// In static equilibrium near the settled start, with every drive, target, ground and load factor as it is at t = 0, and free
    /// coordinates at rest.
    Equilibrium,
}

words!(StartRule {
    AsGiven => "as-given",
    Ideal => "ideal",
    Settled => "settled",
    Equilibrium => "equilibrium",
});

/// Formulation of the equations of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Formulation {
    /// Generalized coordinates of a spanning forest.
    Tree,
    /// All bodies, Lagrange multipliers, Baumgarte stabilisation; paper eqs. (44)-(58).
    Lagrange,
}

words!(Formulation {
    Tree => "tree",
    Lagrange => "lagrange",
});

/// A named point on the speed-accuracy front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// Fast, rough.
    Preview,
    /// Fast enough to follow the clock.
    RealTime,
    /// For figures.
    Accurate,
    /// The reference for the others.
    Reference,
}

words!(Preset {
    Preview => "preview",
    RealTime => "real-time",
    Accurate => "accurate",
    Reference => "reference",
});

/// Stepper settings. An explicit method, step or tolerance takes precedence over the preset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Solver {
    /// Preset, which supplies the settings not given.
    pub preset: Option<Preset>,
    /// Effective method.
    pub method: Method,
    /// Fixed step, s; the first step of an adaptive method.
    pub step: f64,
    /// Relative tolerance of an adaptive method.
    pub tolerance: f64,
    /// Steps of the discrete-gradient method while a ball strikes its wall.
    pub steps_per_impact: u32,
    /// Whether the energy ledger is kept.
    pub energy_ledger: bool,
}

impl Default for Solver {
    /// Automatic selection of the method, at a tolerance of 1e-6.
    fn default() -> Self {
        Self {
            preset: None,
            method: Method::Automatic,
            step: 10e-6,
            tolerance: 1e-6,
            steps_per_impact: 16,
            energy_ledger: true,
        }
    }
}

impl Preset {
    /// Number of ball joints with clearance from which the fast presets take steps per impact instead of error-controlled ones.
    pub const MANY_JOINTS: usize = 8;

    /// Stepper settings of the preset for a machine with `joints_with_clearance` ball joints with clearance, chosen by
    /// measurement (`docs/tradeoff.md`).
    pub fn solver(self, joints_with_clearance: usize) -> Solver {
        let many = joints_with_clearance >= Self::MANY_JOINTS;
        let (method, tolerance, steps_per_impact) = match self {
            Self::Preview if many => (Method::DiscreteGradient, Solver::default().tolerance, 4),
            Self::RealTime if many => (Method::DiscreteGradient, Solver::default().tolerance, 16),
            Self::Preview => (Method::Automatic, 1e-4, 16),
            Self::RealTime => (Method::Automatic, 1e-6, 16),
            Self::Accurate => (Method::Automatic, 1e-7, 16),
            Self::Reference => (Method::DormandPrince5, 1e-11, 16),
        };
        Solver { preset: Some(self), method, tolerance, steps_per_impact, ..Solver::default() }
    }
}
