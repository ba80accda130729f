//! Perturbing the state: for a twin run and its renormalisation.

use super::Simulation;
use crate::contact::Memory;

impl Simulation {
    /// Adds `offset` to coordinates and velocities (ordered as in [`Self::state`]) and continues from there: quaternions
    /// are renormalised, ideal joints closed again. A joint whose ball the offset puts into its wall is now in contact, one
    /// whose ball it lifts is not; every other contact keeps its memory. Counters are unchanged; a wear map is dropped.
    ///
    /// Components of `offset` beyond the state's are ignored, missing ones are 0.
    pub fn displace(&mut self, offset: &[f64]) {
        let Self {
            mechanism, state, ..
        } = self;
        for (y, offset) in state.now.y.iter_mut().zip(offset) {
            *y += offset;
        }
        // Normalising a unit quaternion may round it to another.
        if offset.iter().any(|&offset| offset != 0.0) {
            mechanism.project(state.now.t, &mut state.now.y);
        }
        mechanism.measure(state.now.t, &state.now.y);
        for j in 0..state.now.memory.len() {
            if !mechanism.contacts.has_clearance(j) {
                continue;
            }
            // The offset may lie beyond a corner of the laws.
            state.now.memory[j] = state.now.memory[j].unsplit();
            let gap = *mechanism.contacts.gap(j);
            let touching = gap.separation.penetration > 0.0;
            if touching == state.now.memory[j].active {
                continue;
            }
            state.now.memory[j] = if touching {
                state.control.contact_began = true;
                state.control.h_next = state.control.h_next.min(state.control.h_contact);
                Memory::begun(mechanism.contacts.coefficients(j), gap.separation.rate)
            } else {
                Memory::default()
            };
        }
        self.state.record.wear = None;
        self.refresh();
        self.book_change();
    }

    /// Scale of each component of [`Self::state`]: the error scales of the tolerance.
    pub fn scales(&self) -> &[f64] {
        self.mechanism.scale()
    }
}
