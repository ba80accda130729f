//! Copying, restoring and hashing the whole state.

use super::automatic::prepare_implicit;
use super::{Simulation, State};
use crate::integrate::{Method, System as _};
use crate::mechanism::{ActiveSet, Flight, Mechanism};
use crate::simulate::stepper::AnyStepper;
use crate::simulate::{Snapshot, Wear};

impl State {
    pub(in crate::simulate) fn time(&self) -> f64 {
        self.now.t
    }

    pub(in crate::simulate) fn steps(&self) -> u64 {
        self.record.statistics.steps
    }

    /// Approximate size in bytes, rounded up.
    pub(in crate::simulate) fn bytes(&self) -> usize {
        // Both ends of the step, the ledger's and the stepper's copies.
        const COPIES: usize = 12;
        const OF_JOINT: usize = 1024;
        const FIXED: usize = 4096;
        let (coordinates, joints) = (self.now.y.len(), self.now.gaps.len());
        let impacts = std::mem::size_of_val(self.record.impacts.kept());
        let wear = self.record.wear.as_ref().map_or(0, Wear::bytes);
        let flights = self.flights.len() * size_of::<Option<Flight>>();
        FIXED + wear + flights + coordinates * COPIES * size_of::<f64>() + joints * OF_JOINT + impacts
    }
}

/// Allocates the workspace of `method`, which these equations already used when the snapshot was taken.
fn prepare(mechanism: &mut Mechanism, method: Method) {
    prepare_implicit(mechanism, method).expect("it was not too costly then");
}

impl Simulation {
    /// The whole state.
    pub fn snapshot(&self) -> Snapshot {
        Snapshot {
            machine: self.machine.clone(),
            structure: self.mechanism.structure(),
            state: self.state.clone(),
            polynomial: self.stepper.polynomial().cloned(),
            reference: self.reference.kept(),
        }
    }

    /// A simulation in the state of `snapshot`. Nothing is assembled again: after a live change the state may not be acceptable
    /// as a start. Continuing gives the same bits as in the original run.
    pub fn of(snapshot: &Snapshot) -> Self {
        let machine = &snapshot.machine;
        let mut mechanism = Mechanism::resumed(machine, &snapshot.structure);
        prepare(&mut mechanism, machine.solver.method);
        let reference = snapshot.reference.resume(machine);
        let mut simulation = Self::assembled(machine, mechanism, snapshot.state.clone(), reference);
        simulation.restore(snapshot);
        simulation
    }

    /// Restores a state of this simulation, or of any other, with its peaks and counters. If the equations are still those of the
    /// snapshot, they are reused and the cost is about that of a step; otherwise it is that of [`Self::of`].
    pub fn restore(&mut self, snapshot: &Snapshot) {
        if !self.mechanism.has_structure(&snapshot.structure) {
            *self = Self::of(snapshot);
            return;
        }
        let method = snapshot.machine.solver.method;
        if method != self.machine.solver.method {
            prepare(&mut self.mechanism, method);
            self.stepper = AnyStepper::new(method, self.state.now.y.len());
        }
        self.stepper.invalidate();
        self.state.clone_from(&snapshot.state);
        self.machine = snapshot.machine.clone();
        self.sampled.fill((0.0, 0.0));
        if let Some(polynomial) = &snapshot.polynomial {
            self.stepper.set_polynomial(polynomial);
        }
        self.reference.restore(&snapshot.reference);
        self.sync_parameters();
        self.mechanism.suspend(|_| false);
        let located = self.locates();
        let Self { mechanism, state, scratch_k, .. } = self;
        // The interpolant of the previous step is not part of the state.
        state.before.copy_from(&state.now);
        // Recompute the quantities read from the mechanism between steps: motion, reactions, clearance ramps.
        let now = &state.now;
        let mut evaluator = mechanism.evaluator(ActiveSet::by(located, &now.memory));
        evaluator.derivative(now.t, &now.y, scratch_k);
        mechanism.forget_evaluation();
        self.leave_out_flights();
    }

    /// FNV-1a, 64 bit, over the whole state: little-endian bits of time, coordinates, velocities, then for each ball joint
    /// whether it is in contact, its approach speed, and its current clearance. The current piece of the friction law is
    /// excluded: like the step size, it belongs to the stepper.
    pub fn state_hash(&self) -> u64 {
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        let mut add = |bits: u64| {
            for byte in bits.to_le_bytes() {
                hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
            }
        };
        let state = &self.state;
        add(state.now.t.to_bits());
        for y in &state.now.y {
            add(y.to_bits());
        }
        for (j, m) in state.now.memory.iter().enumerate() {
            add(u64::from(m.active));
            add(m.approach_speed.to_bits());
            let clearance = state.ramps[j].map_or(state.clearances[j], |r| r.at(state.now.t).0);
            add(clearance.to_bits());
        }
        hash
    }
}
