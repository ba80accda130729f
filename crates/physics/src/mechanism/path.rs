//! The few bodies that determine the gap of one contact, so that event location need not evaluate the others.

use super::model::{BodyIndex, Model, Motion, Site};
use std::ops::Range;

/// Maximum path length: longer paths save too little.
const LONGEST: usize = 16;

/// Bodies that determine a gap, parents before children, and their components of the state.
#[derive(Clone, Debug, Default)]
pub struct Path {
    /// Bodies whose motion depends on time alone.
    pub driven: Vec<BodyIndex>,
    /// All other bodies on the path.
    pub(crate) dynamic: Vec<BodyIndex>,
    /// Driven coordinates of both.
    pub drives: Vec<usize>,
    /// Their components of the state.
    pub parts: Vec<Range<usize>>,
}

impl Path {
    /// Path of `site` in tree coordinates; `None` if it is too long.
    pub fn of(model: &Model, site: &Site) -> Option<Self> {
        let mut bodies = Vec::with_capacity(LONGEST);
        for mut b in [site.carried.body, site.carrier.body] {
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

    /// Path of `site` if each body has its own seven positions and six velocities.
    pub fn of_bodies(model: &Model, site: &Site) -> Self {
        let mut path = Self::default();
        for b in [site.carried.body, site.carrier.body] {
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
