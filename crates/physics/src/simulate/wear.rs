//! Wear maps: where the parts of joints with play struck and rubbed the walls, how hard, and the friction work done there.

use serde::{Deserialize, Serialize};

use std::sync::Arc;

use crate::machine::{LooseJoint, Machine};
use crate::mechanism::{Division, Mechanism, Spot, WallContact};

/// Accumulated loads on a cell of a wall.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// Contacts that began there.
    pub contacts: u64,
    /// Time integral of the normal force, N s.
    pub impulse: f64,
    /// Time integral of the friction power, J. It may be negative where friction uses the centres' velocity.
    pub friction_work: f64,
}

impl Cell {
    fn add(&mut self, other: &Self) {
        self.contacts += other.contacts;
        self.impulse += other.impulse;
        self.friction_work += other.friction_work;
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Walls {
    division: Division,
    /// Empty for an ideal joint. Copies of the map share cells that have not changed since.
    #[serde(with = "shared")]
    cells: Arc<[Cell]>,
}

/// A contact at a quadrature node of a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct ContactSample {
    /// Index among the quadrature nodes.
    instant: usize,
    joint: usize,
    cell: usize,
    /// N.
    normal_force: f64,
    /// W.
    friction_power: f64,
}

/// Wear map of a run: contact loads on the walls of its joints with play, in the cells of their [`Division`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wear {
    joints: Vec<Walls>,
    /// Contacts at the nodes of the step being recorded; afterwards those at its end, reusable for the next step.
    contacts: Vec<ContactSample>,
    /// Contributions of the latest step, by joint and cell, not yet added to the cells.
    latest: Vec<(usize, usize, Cell)>,
}

/// Serialises cells without their sharing.
mod shared {
    use std::sync::Arc;

    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use super::Cell;

    pub(super) fn serialize<S: Serializer>(cells: &Arc<[Cell]>, to: S) -> Result<S::Ok, S::Error> {
        cells[..].serialize(to)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Arc<[Cell]>, D::Error> {
        Vec::deserialize(from).map(Arc::from)
    }
}

/// Largest number of entries per contact in one step: its nodes and one contact start.
const MAX_ENTRIES: usize = 4;

impl Wear {
    /// Approximate size in bytes, without shared grids.
    pub(super) fn bytes(&self) -> usize {
        let size = |walls: &Walls| walls.division.bytes() + size_of_val(&*walls.cells);
        self.joints.iter().map(size).sum::<usize>() + size_of_val(self.contacts.as_slice())
    }

    /// An empty map of a machine with `contacts` contacts.
    pub(super) fn new(machine: &Machine, contacts: usize) -> Self {
        let walls = |joint: &LooseJoint| {
            let division = joint.division();
            Walls { cells: vec![Cell::default(); division.cells()].into(), division }
        };
        let most = MAX_ENTRIES * contacts;
        Self {
            joints: machine.loose_joints.iter().map(walls).collect(),
            contacts: Vec::with_capacity(most),
            latest: Vec::with_capacity(most),
        }
    }

    /// Whether it fits `machine`: all its indices are valid.
    pub(super) fn fits(&self, machine: &Machine) -> bool {
        let has = |joint: usize, cell: usize| self.joints.get(joint).is_some_and(|walls| cell < walls.cells.len());
        self.joints.len() == machine.loose_joints.len()
            && self.joints.iter().zip(&machine.loose_joints).all(|(walls, joint)| {
                walls.division.has_cells_of(&joint.division()) && walls.cells.len() == walls.division.cells()
            })
            && self.contacts.iter().all(|p| p.instant == 0 && has(p.joint, p.cell))
            && self.latest.iter().all(|&(joint, cell, _)| has(joint, cell))
    }

    /// The division of the walls of joint `joint` into cells.
    pub fn division(&self, joint: usize) -> &Division {
        &self.joints[joint].division
    }

    /// Cells of joint `joint`, without the latest step until [`Simulation::commit_wear`](super::Simulation::commit_wear); empty
    /// for an ideal joint.
    pub fn cells(&self, joint: usize) -> &[Cell] {
        &self.joints[joint].cells
    }

    /// Adds the contributions of the latest step to the cells.
    pub(super) fn commit_step(&mut self) {
        for (joint, cell, contribution) in self.latest.drain(..) {
            let cells = Arc::make_mut(&mut self.joints[joint].cells);
            cells[cell].add(&contribution);
        }
    }

    /// Prepares to record a step. If `reuses_start`, the forces at the end of the previous step are reused for its first node.
    pub(super) fn begin_step(&mut self, reuses_start: bool) {
        self.commit_step();
        if !reuses_start {
            self.contacts.clear();
        }
    }

    /// Records the forces of the latest evaluation of `mechanism` at node `instant` of the step.
    pub(super) fn record_forces(&mut self, instant: usize, mechanism: &Mechanism) {
        for c in 0..mechanism.contacts.len() {
            if let Some(contact) = mechanism.wall_contact(c) {
                self.record_contact(instant, mechanism.contacts.joint_of(c), &contact);
            }
        }
    }

    /// Records the forces of a contact of loose joint `joint` at node `instant` of the step.
    pub(super) fn record_contact(&mut self, instant: usize, joint: usize, contact: &WallContact) {
        let WallContact { ref spot, normal_force, friction_power } = *contact;
        if let Some(cell) = self.joints[joint].division.cell(spot) {
            self.contacts.push(ContactSample { instant, joint, cell, normal_force, friction_power });
        }
    }

    /// Records that a contact of `joint` begins at `spot`.
    pub(super) fn begin_contact(&mut self, joint: usize, spot: &Spot) {
        let contribution = Cell { contacts: 1, ..Cell::default() };
        let cell = self.joints[joint].division.cell(spot);
        self.latest.extend(cell.map(|cell| (joint, cell, contribution)));
    }

    /// Integrates the recorded forces over a step of size `h` with the quadrature weights `weights`.
    pub(super) fn integrate_step(&mut self, h: f64, weights: &[f64]) {
        for sample in &self.contacts {
            let weight = h * weights[sample.instant];
            let contribution = Cell {
                contacts: 0,
                impulse: weight * sample.normal_force,
                friction_work: weight * sample.friction_power,
            };
            self.latest.push((sample.joint, sample.cell, contribution));
        }
        let last = weights.len() - 1;
        self.contacts.retain(|sample| sample.instant == last);
        self.contacts.iter_mut().for_each(|sample| sample.instant = 0);
    }
}
