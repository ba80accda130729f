//! The few bodies that determine the gap of one ball joint, so that event location need not evaluate the others.

use super::model::{BallJoint, BodyIndex, Model, Motion};
use std::ops::Range;

/// Maximum path length: longer paths save too little.
const LONGEST: usize = 16;

/// Bodies that determine a gap, parents before children, and their components of the state.
#[derive(Clone, Debug, Default)]
pub struct Path {
    /// Bodies whose motion depends on time alone.
    pub driven: Vec<BodyIndex>,
    /// All other bodies on the path.
    pub dynamic: Vec<BodyIndex>,
    /// Driven coordinates of both.
    pub drives: Vec<usize>,
    /// Their components of the state.
    pub parts: Vec<Range<usize>>,
}

impl Path {
    /// Path of `joint` in tree coordinates; `None` if it is too long.
    pub fn of(model: &Model, joint: &BallJoint) -> Option<Self> {
        let mut bodies = Vec::with_capacity(LONGEST);
        for mut b in [joint.ball.body, joint.socket.body] {
            while b != model.world() {
                if bodies.len() == LONGEST {
                    return None;
                }
                bodies.push(b);
                b = model.bodies[b].parent;
            }
        }
        bodies.sort_unstable_by_key(|&b| model.order_index[b]);
        bodies.dedup();
        let mut path = Self::default();
        for b in bodies {
            let body = &model.bodies[b];
            let of = if body.driven_only { &mut path.driven } else { &mut path.dynamic };
            of.push(b);
            match body.motion {
                Motion::Free { q, v } => path.add_parts(q..q + 7, model.nq + v, 6),
                Motion::Revolute { q, v } | Motion::Prismatic { q, v } => {
                    path.add_parts(q..q + 1, model.nq + v, 1);
                }
                Motion::Driven { drive, .. } => path.drives.push(drive),
                Motion::Fixed => {}
            }
        }
        Some(path)
    }

    /// Path of `joint` if each body has its own seven positions and six velocities.
    pub fn of_bodies(model: &Model, joint: &BallJoint) -> Self {
        let mut path = Self::default();
        for b in [joint.ball.body, joint.socket.body] {
            if b != model.world() && !path.dynamic.contains(&b) {
                path.dynamic.push(b);
                path.add_parts(7 * b..7 * b + 7, 7 * model.massive + 6 * b, 6);
            }
        }
        path
    }

    fn add_parts(&mut self, positions: Range<usize>, first: usize, velocities: usize) {
        self.parts.extend([positions, first..first + velocities]);
    }
}

#[cfg(test)]
mod tests {
    use crate::mechanism::Mechanism;
    use crate::scene::Scene;

    #[test]
    fn a_gap_along_its_path_is_that_of_the_whole_mechanism() {
        let loose: &[(&str, &str)] = &[];
        let partly = &[("joint.S2.clearance", "0")][..];
        let scenes = [
            ("spcmm", loose),
            ("spcmm", partly),
            ("chain", loose),
            ("slider-crank", loose),
            ("slider-crank-driven", loose),
            ("pendulum", loose),
        ];
        for (name, changes) in scenes {
            for formulation in ["tree", "lagrange"] {
                let changes = [changes, &[("formulation", formulation)]].concat();
                let own = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
                let changes: Vec<_> = changes.iter().map(own).collect();
                let scene = Scene::load(name, &changes).unwrap();
                let mut whole = Mechanism::new(&scene.machine).unwrap();
                let mut along = Mechanism::new(&scene.machine).unwrap();
                let start = along.start().unwrap();
                let mut y = whole.start().unwrap();
                along.measure(0.0, &start);
                for (i, y) in y.iter_mut().enumerate() {
                    *y += 1e-3 * libm::sin(i as f64);
                }
                for step in 1..4 {
                    let t = 0.013 * f64::from(step);
                    whole.measure(t, &y);
                    for j in 0..scene.machine.ball_joints.len() {
                        // Components off the path must not be read.
                        let mut known = vec![f64::NAN; y.len()];
                        for part in along.gap_components(j).unwrap() {
                            known[part.clone()].copy_from_slice(&y[part.clone()]);
                        }
                        along.measure_one(j, t, &known);
                        let (one, all) = (along.contacts.gap(j), whole.contacts.gap(j));
                        assert_eq!(format!("{one:?}"), format!("{all:?}"), "{name} {j}");
                        assert_eq!(along.slip_speed(j), whole.slip_speed(j), "{name} {j}");
                    }
                    // Then the whole mechanism at the same instant.
                    along.measure(t, &y);
                    for (one, all) in along.contacts.gaps().zip(whole.contacts.gaps()) {
                        assert_eq!(format!("{one:?}"), format!("{all:?}"), "{name}");
                    }
                }
            }
        }
    }
}
