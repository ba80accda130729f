//! The wear map of a running simulation.

use super::Stepping;
use crate::simulate::Wear;

impl Stepping<'_> {
    /// As [`Simulation::track_wear`](crate::simulate::Simulation::track_wear).
    pub(in crate::simulate) fn track_wear(&mut self) {
        let mut wear = Wear::new(self.machine, self.mechanism.contacts.len());
        self.evaluate_at(self.state.now.t);
        for (c, contact_state) in self.state.now.contact_states.iter().enumerate() {
            if contact_state.active {
                wear.begin_contact(self.mechanism.contacts.joint_of(c), &self.mechanism.spot(c));
            }
        }
        wear.commit_step();
        wear.record_forces(0, self.mechanism);
        self.state.record.wear = Some(wear);
    }
}
