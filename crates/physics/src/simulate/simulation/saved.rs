//! The state of a run for a file: a later process continues from it with the same bits.

use serde::{Deserialize, Serialize};

use super::ideal::{IdealTip, TipHistory};
use super::{Simulation, State, StepEnd};
use crate::integrate::Polynomial;
use crate::simulate::{LoadPeaks, Snapshot};

/// The part of a running simulation that its scene does not determine. The scene is not included and must be stored with it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SavedState {
    state: State,
    polynomial: Option<Polynomial>,
    /// State of the ideal motion alongside.
    ideal: Option<Box<SavedIdeal>>,
    /// Largest sampled force, N, and its time, s, by joint.
    sampled: Vec<(f64, f64)>,
    /// Load peaks, if tracked.
    loads: Option<LoadPeaks>,
}

/// The state of the ideal motion alongside.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct SavedIdeal {
    state: SavedState,
    marks: TipHistory,
}

/// A state of another scene, or one that no run of this scene can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the numbers are not those of a run of this scene")]
pub struct StateMismatch;

impl SavedState {
    /// Time of the state, s.
    pub fn time(&self) -> f64 {
        self.state.now.t
    }
}

impl State {
    /// Whether it has the dimensions of a state of `simulation`, and all its indices are valid.
    fn fits(&self, simulation: &Simulation) -> bool {
        let own = &simulation.state;
        let joints = own.now.gaps.len();
        let alike = |end: &StepEnd| {
            end.y.len() == own.now.y.len()
                && end.k.len() == own.now.k.len()
                && end.gaps.len() == joints
                && end.memory.len() == joints
        };
        let record = &self.record;
        let worn = record.wear.as_ref();
        alike(&self.now)
            && alike(&self.before)
            && self.ramps.len() == joints
            && self.clearances.len() == joints
            && self.flights.len() == own.flights.len()
            // Only a window has a hand.
            && self.pull.is_none()
            && record.account.fits()
            && record.starts_inside.is_none_or(|(element, ..)| element < simulation.machine.elements.len())
            && record.impacts.fits(joints)
            && record.statistics.fits(joints)
            && worn.is_none_or(|wear| wear.fits(&simulation.machine))
            && record.reactions.len() == joints
            && record.contact_steps.len() == joints
            && record.peaks.len() == joints
    }
}

impl Simulation {
    /// The whole state, for a file.
    pub fn saved(&self) -> SavedState {
        SavedState {
            state: self.state.clone(),
            polynomial: self.stepper.polynomial().cloned(),
            ideal: match &self.reference {
                IdealTip::Simulated(motion) => {
                    Some(Box::new(SavedIdeal { state: motion.simulation.saved(), marks: motion.marks.clone() }))
                }
                IdealTip::ClosedForm | IdealTip::SelfReference | IdealTip::None(_) => None,
            },
            sampled: self.sampled.clone(),
            loads: self.loads.clone(),
        }
    }

    /// Restores the state `saved` in a simulation of the same scene; continuing gives the same bits as in the original run.
    ///
    /// # Errors
    /// If the state cannot belong to this scene; the simulation is then unusable.
    pub fn resume(&mut self, saved: &SavedState) -> Result<(), StateMismatch> {
        let polynomial = self.stepper.polynomial();
        let fits = saved.state.fits(self)
            && saved.sampled.len() == self.sampled.len()
            && saved.loads.as_ref().is_none_or(|loads| loads.fits(&LoadPeaks::new(&self.machine, &self.mechanism)))
            && saved.polynomial.is_some() == polynomial.is_some()
            && saved.polynomial.iter().all(|p| p.fits(self.state.now.y.len()));
        if !fits {
            return Err(StateMismatch);
        }
        match (&mut self.reference, &saved.ideal) {
            (IdealTip::Simulated(motion), Some(ideal)) if ideal.marks.fits() => {
                motion.simulation.resume(&ideal.state)?;
                motion.marks = ideal.marks.clone();
            }
            (IdealTip::ClosedForm | IdealTip::SelfReference | IdealTip::None(_), None) => {}
            _ => return Err(StateMismatch),
        }
        let snapshot = Snapshot {
            machine: self.machine.clone(),
            structure: self.mechanism.structure(),
            state: saved.state.clone(),
            polynomial: saved.polynomial.clone(),
            reference: self.reference.kept(),
        };
        self.restore(&snapshot);
        self.sampled.copy_from_slice(&saved.sampled);
        self.loads.clone_from(&saved.loads);
        Ok(())
    }
}
