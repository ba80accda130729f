//! A state moved by hand: what a twin run and its renormalisation need.

use super::Simulation;
use crate::contact::{ApproachPiece, FrictionPiece, Memory};

impl Simulation {
    /// Adds `offset` to coordinates and velocities (as [`Self::state`] orders them) and goes on from there: quaternions
    /// back to unit length, ideal joints closed again. A joint whose ball the offset puts into its wall is in contact
    /// from now on, one whose ball it lifts is not; every other contact keeps its memory. Counters stay as they are, and no wear map is kept any more.
    ///
    /// Components of `offset` beyond the state's are ignored, missing ones are 0.
    pub fn displace(&mut self, offset: &[f64]) {
        let Self {
            mechanism, state, ..
        } = self;
        for (y, offset) in state.now.y.iter_mut().zip(offset) {
            *y += offset;
        }
        mechanism.project(state.now.t, &mut state.now.y);
        mechanism.measure(state.now.t, &state.now.y);
        for j in 0..state.now.memory.len() {
            if !mechanism.contacts.has_clearance(j) {
                continue;
            }
            // The offset may lie beyond a corner of the laws.
            (
                state.now.memory[j].friction_piece,
                state.now.memory[j].approach_piece,
            ) = (FrictionPiece::Unsplit, ApproachPiece::Unsplit);
            let gap = *mechanism.contacts.gap(j);
            let touching = gap.penetration > 0.0;
            if touching == state.now.memory[j].active {
                continue;
            }
            state.now.memory[j] = if touching {
                state.control.contact_began = true;
                state.control.h_next = state.control.h_next.min(state.control.h_contact);
                Memory::begun(mechanism.contacts.coefficients(j), gap.rate)
            } else {
                Memory::default()
            };
        }
        self.state.record.wear = None;
        self.refresh();
        self.book_change();
    }

    /// What a difference of 1 means for each component of [`Self::state`]: the scales of the tolerance.
    pub fn scales(&self) -> &[f64] {
        self.mechanism.scale()
    }
}
