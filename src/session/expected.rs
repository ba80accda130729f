//! Where a machine is expected during the coming turn of its drives, as it moves without play.

use crate::contact::Parameters;
use crate::machine::Machine;
use crate::simulate::{Frame, Simulation, closed};

/// Instants of a turn.
const INSTANTS: u32 = 48;
/// Most steps, and the tolerance of their method: as many as can be computed at once.
const MAX_STEPS: u32 = 3000;
const TOLERANCE: f64 = 1e-5;
/// Most bodies and joints with play.
const MAX_PARTS: usize = 60;

/// The motion without play of the machine last asked for.
#[derive(Default)]
pub struct ExpectedMotion {
    /// That machine as it was, and without play.
    known: Option<[Machine; 2]>,
}

impl ExpectedMotion {
    /// Instants of the next `turn`, s, of `machine`, unless they are those of the last call. Play and friction change nothing of
    /// them.
    pub fn of(&mut self, machine: &Machine, turn: f64) -> Option<Vec<Frame>> {
        if self.known.as_ref().is_some_and(|[as_it_was, _]| as_it_was == machine) {
            return None;
        }
        let ideal = without_contacts(machine);
        let is_new = self.known.as_ref().is_none_or(|[_, known]| *known != ideal);
        let frames = is_new.then(|| frames(&ideal, turn));
        self.known = Some([machine.clone(), ideal]);
        frames
    }
}

/// The machine without play, whatever its contacts were.
fn without_contacts(machine: &Machine) -> Machine {
    let mut ideal = closed(machine);
    ideal.solver.tolerance = TOLERANCE;
    ideal.contact = Parameters::default();
    for joint in &mut ideal.loose_joints {
        joint.contact = ideal.contact.without_play();
    }
    ideal
}

fn frames(ideal: &Machine, turn: f64) -> Vec<Frame> {
    let mut frames = Vec::new();
    if ideal.bodies.len() + ideal.loose_joints.len() > MAX_PARTS {
        return frames;
    }
    let Ok(mut run) = Simulation::new(ideal) else {
        return frames;
    };
    let mut steps_left = MAX_STEPS;
    for k in 1..=INSTANTS {
        let time = turn * f64::from(k) / f64::from(INSTANTS);
        while run.time() < time {
            steps_left -= 1;
            if steps_left == 0 || run.step().is_err() {
                return frames;
            }
        }
        let mut frame = Frame::default();
        run.sample(time, &mut frame);
        frames.push(frame);
    }
    frames
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    fn machine(changes: &[(&str, &str)]) -> Machine {
        let changes: Vec<(String, String)> =
            changes.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
        Machine::clone(&Scene::load("four-bar", &changes).expect("built in").machine)
    }

    #[test]
    fn only_what_moves_the_machine_without_play_is_computed_again() {
        let mut expected = ExpectedMotion::default();
        let first = expected.of(&machine(&[]), 0.5).expect("new");
        assert_eq!(first.len(), INSTANTS as usize);
        assert!(expected.of(&machine(&[]), 0.5).is_none());
        for change in [("contact.clearance", "0.5 mm"), ("contact.friction", "0.3"), ("solver.tolerance", "1e-4")] {
            assert!(expected.of(&machine(&[change]), 0.5).is_none(), "{change:?}");
        }
        assert!(expected.of(&machine(&[("gravity.z", "-3 m/s^2")]), 0.5).is_some());
    }
}
