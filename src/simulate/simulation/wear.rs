//! The wear map of a running simulation.

use super::Simulation;
use crate::simulate::Wear;

impl Simulation {
    /// From now on keeps a wear map, empty but for the contacts under way, which count as begun. It belongs to the state: a
    /// snapshot holds it, and a reset ends it. It changes no step.
    pub fn keep_wear(&mut self) {
        let mut wear = Wear::new(&self.running);
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

    /// The wear map that is kept.
    pub fn wear(&self) -> Option<&Wear> {
        self.state.record.wear.as_ref()
    }

    /// The latest step is over: what it did enters the wear map. The next step would see to that, too.
    pub fn pass_wear(&mut self) {
        if let Some(wear) = &mut self.state.record.wear {
            wear.pass();
        }
    }
}
