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
}

words!(StartRule {
    AsGiven => "as-given",
    Ideal => "ideal",
    Settled => "settled",
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
    /// The fastest that resolves impacts.
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
    /// Method, step (s) and tolerance of the preset, chosen by measurement (`docs/tradeoff.md`).
    pub fn point(self) -> (Method, f64, f64) {
        match self {
            Self::Preview => (Method::Automatic, 10e-6, 1e-4),
            Self::RealTime => (Method::Automatic, 10e-6, 1e-6),
            Self::Accurate => (Method::Automatic, 10e-6, 1e-7),
            Self::Reference => (Method::DormandPrince5, 10e-6, 1e-11),
        }
    }
}
