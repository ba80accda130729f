//! The wear map of a running simulation.

use super::Stepping;
use crate::simulate::Wear;

impl Stepping<'_> {
    /// As [`Simulation::track_wear`](crate::simulate::Simulation::track_wear).
    pub(in crate::simulate) fn track_wear(&mut self) {
        let mut wear = Wear::new(self.machine);
        self.evaluate_at(self.state.now.t);
        for (j, contact_state) in self.state.now.contact_states.iter().enumerate() {
            if contact_state.active {
                wear.begin_contact(j, &self.mechanism.wall_direction(j));
            }
        }
        wear.commit_step();
        wear.record_forces(0, self.mechanism);
        self.state.record.wear = Some(wear);
    }
}
