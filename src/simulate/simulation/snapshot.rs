//! The whole state: copied, put back, hashed.

use super::Simulation;
use super::automatic::prepare_implicit;
use crate::integrate::System;
use crate::mechanism::Mechanism;
use crate::simulate::{Snapshot, StartError};

impl Simulation {
    /// The whole state.
    pub fn snapshot(&self) -> Snapshot {
        Snapshot {
            scene: self.scene.clone(),
            running: self.running.clone(),
            state: self.state.clone(),
            polynomial: self.stepper.polynomial().cloned(),
            ideal: self.reference.kept(),
            peaks: self.peaks.clone(),
            right_handed: self.right_handed,
        }
    }

    /// Goes back to a state that this simulation, or another of the same scene, was in, with the peaks and counters that it had.
    /// Nothing is assembled: a live change may have led where no start would be accepted. Resuming gives the same bits.
    ///
    /// # Errors
    /// A snapshot of a scene whose equations cannot be set up.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<(), StartError> {
        let mut mechanism = Mechanism::new(&snapshot.running)?;
        prepare_implicit(&mut mechanism, snapshot.running.solver.method)?;
        let mut fresh = Self::assembled(&snapshot.running, mechanism, snapshot.state.clone());
        fresh.scene = snapshot.scene.clone();
        fresh.peaks.clone_from(&snapshot.peaks);
        fresh.right_handed = snapshot.right_handed;
        for j in 0..fresh.state.ramps.len() {
            fresh.mechanism.contacts.set_ramp(j, fresh.state.ramps[j]);
            let contact = fresh.running.ball_joints[j].contact;
            if contact.clearance > 0.0 {
                fresh
                    .mechanism
                    .contacts
                    .set_parameters(j, &contact, fresh.state.clearances[j]);
            }
        }
        // The interpolant of the step before is not part of a state.
        let state = &mut fresh.state;
        state.t0 = state.t;
        state.y0.copy_from_slice(&state.y);
        state.k0.copy_from_slice(&state.k);
        state.gaps0.copy_from_slice(&state.gaps);
        state.memory0.copy_from_slice(&state.memory);
        if let Some(polynomial) = &snapshot.polynomial {
            fresh.stepper.set_polynomial(polynomial);
        }
        if let Some(ideal) = &snapshot.ideal {
            fresh.reference.restore(ideal)?;
        }
        // What is read off the mechanism between steps: motion, reactions, clearances on their way.
        let Self {
            mechanism,
            state,
            scratch_k,
            ..
        } = &mut fresh;
        mechanism
            .contacts
            .memory_mut()
            .copy_from_slice(&state.memory);
        mechanism.derivative(state.t, &state.y, scratch_k);
        mechanism.forget_evaluation();
        *self = fresh;
        Ok(())
    }

    /// FNV-1a, 64 bit, over the whole state: little-endian bits of time, coordinates, velocities, then for each ball
    /// joint whether it is in contact, its approach speed, and its clearance in force. The piece of
    /// the friction law in force is not in it: like the step size it belongs to the stepper.
    pub fn state_hash(&self) -> u64 {
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        let mut add = |bits: u64| {
            for byte in bits.to_le_bytes() {
                hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
            }
        };
        let state = &self.state;
        add(state.t.to_bits());
        for y in &state.y {
            add(y.to_bits());
        }
        for (j, m) in state.memory.iter().enumerate() {
            add(u64::from(m.active));
            add(m.approach_speed.to_bits());
            let clearance = state.ramps[j].map_or(state.clearances[j], |r| r.at(state.t).0);
            add(clearance.to_bits());
        }
        hash
    }
}
