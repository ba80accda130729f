//! Simulation settings of a machine: formulation, start rule, stepper.

use serde::{Deserialize, Serialize};

use super::Machine;
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Formulation {
    /// Generalized coordinates of a spanning forest.
    #[default]
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

/// Stepper settings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Solver {
    /// Preset from which method, step, tolerance and steps per impact are.
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
    /// Stepper settings of the preset for `machine`, from what is known before it runs (`docs/tradeoff.md`).
    ///
    /// Error-controlled steps follow the events of all joints. Where impacts in one joint set off others, n steps per impact of
    /// the discrete gradient cost about 0.3 + 0.02 n times as much, and less in larger machines. But an impact errs the more the
    /// more impacts its joint had before. The fewer joints share the first impacts of a machine, the more steps keep the limit of
    /// error, until they cost as much.
    pub fn solver(self, machine: &Machine) -> Solver {
        let coupled = machine.coupled_joints();
        let steps_per_impact = match (self, coupled.joints) {
            (Self::Preview, 3..) => Some(16),
            (Self::RealTime, 4..) => Some(24),
            _ => None,
        };
        let own = Solver { preset: Some(self), ..Solver::default() };
        if let Some(steps_per_impact) = steps_per_impact.filter(|_| coupled.is_narrow) {
            return Solver { method: Method::DiscreteGradient, steps_per_impact, ..own };
        }
        let (method, tolerance) = match self {
            // Coarser ones make balls bounce that should rest on their walls.
            Self::Preview => (Method::Automatic, 1e-3),
            Self::RealTime => (Method::Automatic, 5e-4),
            Self::Accurate => (Method::Automatic, 1e-7),
            Self::Reference => (Method::DormandPrince5, 1e-11),
        };
        Solver { method, tolerance, ..own }
    }
}
