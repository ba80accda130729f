//! Parameters that may change while a machine runs.

use serde::{Deserialize, Serialize};

use super::{Element, LiveElements, LooseJoint, Machine, Solver, Vec3};
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

    /// This machine under other conditions, given for as many joints with play, and with its elements as they act.
    pub(crate) fn with_conditions(&self, conditions: &Conditions, elements: &LiveElements) -> Self {
        let mut machine = self.clone();
        machine.gravity = conditions.gravity;
        machine.contact = conditions.contact;
        for (joint, contact) in machine.loose_joints.iter_mut().zip(&conditions.joints) {
            joint.contact = *contact;
        }
        machine.solver = conditions.solver;
        if !elements.is_as_started() {
            machine.elements = (0..self.elements.len()).map(|i| elements.element(self, i).into_owned()).collect();
        }
        machine
    }

    /// Whether `next` differs from this machine only in its conditions and in forces of its elements. The energy ledger does not
    /// count as a condition: it begins with the run.
    pub fn differs_only_in_conditions(&self, next: &Self) -> bool {
        // Compared field by field, without a copy of the machine: a slider asks at every move.
        let Self { gravity: _, contact: _, solver, loose_joints, formulation, closed_form, output, start, .. } = self;
        let Self { bodies, joints, closing_joints, elements, fixed_shapes, .. } = self;
        let differ_in_contact =
            |(own, next): (&LooseJoint, &LooseJoint)| LooseJoint { contact: next.contact, ..own.clone() } == *next;
        (solver.energy_ledger, formulation, closed_form, output, start)
            == (next.solver.energy_ledger, &next.formulation, &next.closed_form, &next.output, &next.start)
            && loose_joints.len() == next.loose_joints.len()
            && loose_joints.iter().zip(&next.loose_joints).all(differ_in_contact)
            && (bodies, joints, closing_joints) == (&next.bodies, &next.joints, &next.closing_joints)
            && elements.len() == next.elements.len()
            && elements.iter().zip(&next.elements).all(|(own, next)| own == next || Element::can_become(own, next))
            && *fixed_shapes == next.fixed_shapes
    }
}
