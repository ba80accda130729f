//! The wear map of a running simulation.

use super::Simulation;
use crate::simulate::Wear;

impl Simulation {
    /// Starts a wear map, empty except for the current contacts, which count as begun. It belongs to the state: a snapshot
    /// contains it, and a reset ends it. It does not affect the steps.
    pub fn keep_wear(&mut self) {
        let mut wear = Wear::new(&self.machine);
        self.look(self.state.now.t);
        for (j, memory) in self.state.now.memory.iter().enumerate() {
            if memory.active {
                wear.begin_contact(j, &self.mechanism.wall_direction(j));
            }
        }
        wear.pass();
        wear.read(0, &self.mechanism);
        self.state.record.wear = Some(wear);
    }

    /// The wear map, if there is one.
    pub fn wear(&self) -> Option<&Wear> {
        self.state.record.wear.as_ref()
    }

    /// Adds the contributions of the latest step to the wear map, instead of leaving that to the next step.
    pub fn commit_wear(&mut self) {
        if let Some(wear) = &mut self.state.record.wear {
            wear.pass();
        }
    }
}
