//! The wear map of a running simulation.

use super::Run;
use crate::simulate::Wear;

impl Run<'_> {
    /// As [`Simulation::keep_wear`](crate::simulate::Simulation::keep_wear).
    pub(in crate::simulate) fn keep_wear(&mut self) {
        let mut wear = Wear::new(self.machine);
        self.look(self.state.now.t);
        for (j, contact_state) in self.state.now.contact_states.iter().enumerate() {
            if contact_state.active {
                wear.begin_contact(j, &self.mechanism.wall_direction(j));
            }
        }
        wear.pass();
        wear.read(0, self.mechanism);
        self.state.record.wear = Some(wear);
    }
}
