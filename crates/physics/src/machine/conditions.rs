//! Parameters that may change while a machine runs.

use serde::{Deserialize, Serialize};

use super::{Machine, Solver, Vec3};
use crate::contact;

/// Gravity, contacts and stepper of a machine: a running simulation may adopt others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Conditions {
    /// As [`Machine::gravity`], m/s^2.
    pub gravity: Vec3,
    /// As [`Machine::contact`].
    pub contact: contact::Parameters,
    /// Contact parameters of each ball joint.
    pub joints: Vec<contact::Parameters>,
    /// As [`Machine::solver`].
    pub solver: Solver,
}

impl Machine {
    /// Its gravity, contacts and stepper.
    pub fn conditions(&self) -> Conditions {
        Conditions {
            gravity: self.gravity,
            contact: self.contact,
            joints: self.loose_joints.iter().map(|joint| joint.contact).collect(),
            solver: self.solver,
        }
    }

    /// This machine under other conditions, given for as many ball joints.
    pub(crate) fn with_conditions(&self, conditions: &Conditions) -> Self {
        let mut machine = self.clone();
        machine.gravity = conditions.gravity;
        machine.contact = conditions.contact;
        for (joint, contact) in machine.loose_joints.iter_mut().zip(&conditions.joints) {
            joint.contact = *contact;
        }
        machine.solver = conditions.solver;
        machine
    }

    /// Whether `next` differs from this machine only in its conditions. The energy ledger does not count as one: it begins with
    /// the run.
    pub fn differs_only_in_conditions(&self, next: &Self) -> bool {
        let mut like_next = self.with_conditions(&next.conditions());
        like_next.solver.energy_ledger = self.solver.energy_ledger;
        like_next == *next
    }
}
