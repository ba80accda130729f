//! The program's equations.

use std::cell::RefCell;

use jointplay::contact::ContactState;
use jointplay::integrate::System;
use jointplay::mechanism::{ActiveSet, Mechanism};
use jointplay::scene::Scene;

use crate::integrate::Equations;

/// The program's equations for the independent solver.
pub struct ProgramEquations {
    mechanism: RefCell<Mechanism>,
    contact_states: RefCell<Vec<ContactState>>,
    speed_floor: f64,
}

impl ProgramEquations {
    pub fn new(scene: &Scene) -> Self {
        Self {
            mechanism: RefCell::new(Mechanism::new(&scene.machine).unwrap()),
            contact_states: RefCell::new(vec![ContactState::default(); scene.machine.loose_joints.len()]),
            speed_floor: scene.machine.contact.impact_speed_floor,
        }
    }
}

impl Equations for ProgramEquations {
    fn start(&self) -> Vec<f64> {
        self.mechanism.borrow_mut().start().unwrap()
    }

    fn derivative(&self, t: f64, y: &[f64], dy: &mut [f64]) {
        let contact_states = self.contact_states.borrow();
        let mut mechanism = self.mechanism.borrow_mut();
        let mut evaluator = mechanism.evaluator(ActiveSet::Located(&contact_states));
        evaluator.derivative(t, y, dy);
    }

    fn gaps(&self, t: f64, y: &[f64]) -> Vec<(f64, f64)> {
        let mut mechanism = self.mechanism.borrow_mut();
        mechanism.measure(t, y);
        let gaps = mechanism.contacts.gaps();
        gaps.map(|gap| (gap.separation.penetration, gap.separation.rate)).collect()
    }

    fn forces(&self, t: f64, y: &[f64]) -> Vec<f64> {
        self.derivative(t, y, &mut vec![0.0; y.len()]);
        let mechanism = self.mechanism.borrow();
        let gaps = mechanism.contacts.gaps();
        gaps.map(|gap| gap.normal_force).collect()
    }

    fn speed_floor(&self) -> f64 {
        self.speed_floor
    }

    fn set_contacts(&self, contacts: &[Option<f64>]) {
        for (state, speed) in self.contact_states.borrow_mut().iter_mut().zip(contacts) {
            *state = ContactState {
                active: speed.is_some(),
                approach_speed: speed.unwrap_or(0.0),
                below_speed_floor: false,
                ..ContactState::default()
            };
        }
    }
}
