//! Wear maps: where balls struck and rubbed the inner faces of their sockets, how hard, and the friction work done there.

use serde::{Deserialize, Serialize};

use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};
use std::ops::Range;
use std::sync::Arc;

use crate::machine::{LooseJoint, LooseKind, Machine, Mat3, Vec3};
use crate::mechanism::{Mechanism, WallContact};

/// Cells on each socket: about 14 degrees across.
const CELLS: usize = 200;

/// Cells of equal area on the unit sphere: P. Leopardi, "A partition of the unit sphere into regions of equal area and small
/// diameter", Electronic Transactions on Numerical Analysis 25 (2006) 309-327. A cap about each pole is a cell; the
/// zones between are divided evenly in azimuth. Cells are counted from the pole +z, and eastwards from azimuth 0.
#[derive(Debug, PartialEq)]
pub struct Grid {
    /// Number of the first cell of each zone, caps included, followed by the total number.
    first: Vec<usize>,
}

/// Edges of a cell, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edges {
    /// Polar angle from +z, 0..=pi.
    pub polar: [f64; 2],
    /// Azimuth about z from +x towards +y, 0..=2 pi.
    pub azimuth: [f64; 2],
}

impl Grid {
    /// The grid of every wear map.
    pub fn of_sockets() -> Self {
        Self::new(CELLS)
    }

    /// Divides the sphere into `cells` cells, at least two.
    fn new(cells: usize) -> Self {
        let n = cells as f64;
        // Polar angle that encloses a given share of the sphere.
        let within = |share: f64| 2.0 * libm::asin(share.sqrt());
        let cap = within(1.0 / n);
        let collars = ((PI - 2.0 * cap) / (4.0 * PI / n).sqrt()).round().max(1.0);
        let height = (PI - 2.0 * cap) / collars;
        let mut first = vec![0, 1];
        for collar in 1..collars as usize {
            // Nearest whole number of cells down to the collar's lower edge: the rounding error carries over to the next
            // collar.
            let s = libm::sin(0.5 * (cap + height * collar as f64));
            first.push((n * s * s).round() as usize);
        }
        if cells > 2 {
            first.push(cells - 1);
        }
        first.push(cells);
        Self { first }
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.first[self.zones()]
    }

    fn zones(&self) -> usize {
        self.first.len() - 1
    }

    /// Cells of zone `zone`, counted from +z; those of one zone are identical up to a rotation about z.
    pub fn zone(&self, zone: usize) -> Option<Range<usize>> {
        (zone < self.zones()).then(|| self.first[zone]..self.first[zone + 1])
    }

    /// Zone of `cell`.
    pub fn zone_of(&self, cell: usize) -> usize {
        self.first.partition_point(|first| *first <= cell) - 1
    }

    /// Edges of `cell`.
    pub fn edges(&self, cell: usize) -> Edges {
        let zone = self.zone_of(cell);
        let (from, to) = (self.first[zone], self.first[zone + 1]);
        let polar = |cells: usize| {
            let share = cells as f64 / self.cells() as f64;
            2.0 * libm::asin(share.sqrt())
        };
        let azimuth = |sector: usize| TAU * sector as f64 / (to - from) as f64;
        Edges { polar: [polar(from), polar(to)], azimuth: [azimuth(cell - from), azimuth(cell - from + 1)] }
    }

    /// Cell that a unit vector points into.
    pub fn cell(&self, direction: &Vec3) -> usize {
        // Zones of equal height have equal area (Archimedes): this many cells lie above.
        let above = 0.5 * (1.0 - direction.z) * self.cells() as f64;
        let zone = self.zone_of((above as usize).min(self.cells() - 1));
        let sectors = self.first[zone + 1] - self.first[zone];
        let turn = libm::atan2(direction.y, direction.x) / TAU;
        let turn = if turn < 0.0 { turn + 1.0 } else { turn };
        let sector = ((turn * sectors as f64) as usize).min(sectors - 1);
        self.first[zone] + sector
    }
}

/// Accumulated loads on a cell of a socket's inner face.
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
struct Socket {
    /// From the socket body's axes to the grid's.
    grid_from_body: Mat3,
    /// Radius r + c of the inner face, m.
    radius: f64,
    /// Empty for an ideal joint and for other joints than balls. Copies of the map share cells that have not changed since.
    #[serde(with = "shared")]
    cells: Arc<[Cell]>,
}

/// A ball in contact at a quadrature node of a step.
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

/// Wear map of a run: contact loads on the inner faces of its sockets, in cells of equal area.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wear {
    #[serde(skip, default = "grid_of_sockets")]
    grid: Arc<Grid>,
    sockets: Vec<Socket>,
    /// Contacts at the nodes of the step being recorded; afterwards those at its end, reusable for the next step.
    contacts: Vec<ContactSample>,
    /// Contributions of the latest step, by joint and cell, not yet added to the cells.
    latest: Vec<(usize, usize, Cell)>,
}

fn grid_of_sockets() -> Arc<Grid> {
    Arc::new(Grid::of_sockets())
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

/// Largest number of entries per joint in one step: its nodes and one contact start.
const MAX_ENTRIES: usize = 4;

impl Wear {
    /// Approximate size in bytes, without the shared grid.
    pub(super) fn bytes(&self) -> usize {
        let cells: usize = self.sockets.iter().map(|socket| socket.cells.len()).sum();
        cells * size_of::<Cell>() + size_of_val(self.contacts.as_slice())
    }

    /// An empty map.
    pub(super) fn new(machine: &Machine) -> Self {
        let grid = grid_of_sockets();
        let socket = |joint: &LooseJoint| {
            let contact = &joint.contact;
            let has_map = joint.kind == LooseKind::Ball && !contact.is_ideal();
            let cells = vec![Cell::default(); if has_map { grid.cells() } else { 0 }];
            Socket {
                grid_from_body: axes(&joint.opening),
                radius: contact.ball_radius + contact.clearance,
                cells: cells.into(),
            }
        };
        let sockets: Vec<Socket> = machine.loose_joints.iter().map(socket).collect();
        let most = MAX_ENTRIES * sockets.len();
        Self { contacts: Vec::with_capacity(most), latest: Vec::with_capacity(most), sockets, grid }
    }

    /// Whether it fits `machine`: all its indices are valid.
    pub(super) fn fits(&self, machine: &Machine) -> bool {
        let own = Self::new(machine);
        let cells = |wear: &Self| wear.sockets.iter().map(|s| s.cells.len()).collect::<Vec<_>>();
        let has = |joint: usize, cell: usize| {
            let socket = self.sockets.get(joint);
            socket.is_some_and(|socket| cell < socket.cells.len())
        };
        cells(self) == cells(&own)
            && self.contacts.iter().all(|p| p.instant == 0 && has(p.joint, p.cell))
            && self.latest.iter().all(|&(joint, cell, _)| has(joint, cell))
    }

    /// The cell division of every socket.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Cells of joint `joint`, without the latest step until [`Simulation::commit_wear`](super::Simulation::commit_wear); empty
    /// for an ideal joint and for other joints than balls.
    pub fn cells(&self, joint: usize) -> &[Cell] {
        &self.sockets[joint].cells
    }

    /// Area of a cell of ball joint `joint`, m^2, with its clearance when the map was started.
    pub fn area(&self, joint: usize) -> f64 {
        let radius = self.sockets[joint].radius;
        4.0 * PI * radius * radius / self.grid.cells() as f64
    }

    /// Rotation from the axes of the socket's body to those of the grid: z is the socket's opening; x lies in the plane of
    /// the opening and the body's x axis, or its y axis where x is within 45 degrees of the opening.
    pub fn grid_from_body(&self, joint: usize) -> &Mat3 {
        &self.sockets[joint].grid_from_body
    }

    /// Adds the contributions of the latest step to the cells.
    pub(super) fn commit_step(&mut self) {
        for (joint, cell, contribution) in self.latest.drain(..) {
            let cells = Arc::make_mut(&mut self.sockets[joint].cells);
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
        let cell = self.cell(joint, &contact.direction);
        let WallContact { normal_force, friction_power, .. } = *contact;
        self.contacts.push(ContactSample { instant, joint, cell, normal_force, friction_power });
    }

    /// Records that a contact of `joint` begins in `direction`, in the axes of the socket's body.
    pub(super) fn begin_contact(&mut self, joint: usize, direction: &Vec3) {
        let contribution = Cell { contacts: 1, ..Cell::default() };
        self.latest.push((joint, self.cell(joint, direction), contribution));
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

    fn cell(&self, joint: usize, direction: &Vec3) -> usize {
        let direction = self.sockets[joint].grid_from_body * direction;
        self.grid.cell(&direction)
    }
}

fn axes(opening: &Vec3) -> Mat3 {
    let z = opening.normalize();
    let near = if z.x.abs() > FRAC_1_SQRT_2 { Vec3::y() } else { Vec3::x() };
    let x = (near - z * z.dot(&near)).normalize();
    let y = z.cross(&x);
    Mat3::from_rows(&[x.transpose(), y.transpose(), z.transpose()])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Unit vector from polar angle and azimuth.
    fn towards(polar: f64, azimuth: f64) -> Vec3 {
        let ((s, c), (sa, ca)) = (libm::sincos(polar), libm::sincos(azimuth));
        Vec3::new(s * ca, s * sa, c)
    }

    #[test]
    fn cells_have_equal_area_and_cover_the_sphere() {
        for n in [2, 3, 4, 20, CELLS, 1001] {
            let grid = Grid::new(n);
            assert_eq!(grid.cells(), n);
            let mut whole = 0.0;
            for cell in 0..n {
                let Edges { polar, azimuth } = grid.edges(cell);
                let area = (azimuth[1] - azimuth[0]) * (libm::cos(polar[0]) - libm::cos(polar[1]));
                assert!((area * n as f64 / (4.0 * PI) - 1.0).abs() < 1e-11, "{n}: {cell}");
                whole += area;
                // The centre of a cell maps back to that cell.
                let middle = |[a, b]: [f64; 2]| 0.5 * (a + b);
                let centre = towards(middle(polar), middle(azimuth));
                assert_eq!(grid.cell(&centre), cell, "{n}");
            }
            assert!((whole - 4.0 * PI).abs() < 1e-9, "{n}: {whole}");
        }
    }

    #[test]
    fn cells_are_about_as_wide_as_high() {
        let grid = Grid::new(CELLS);
        let zones: Vec<_> = (0..).map_while(|zone| grid.zone(zone)).collect();
        let counts: Vec<usize> = zones.iter().map(ExactSizeIterator::len).collect();
        assert_eq!(counts.iter().sum::<usize>(), CELLS);
        assert_eq!((counts[0], counts[counts.len() - 1]), (1, 1));
        for zone in &zones[1..zones.len() - 1] {
            let Edges { polar, azimuth } = grid.edges(zone.start);
            let height = polar[1] - polar[0];
            let width = (azimuth[1] - azimuth[0]) * libm::sin(0.5 * (polar[0] + polar[1]));
            assert!((0.7..1.4).contains(&(width / height)), "{zone:?}: {width} by {height}");
        }
    }

    #[test]
    fn every_direction_lies_in_one_cell() {
        let grid = Grid::new(CELLS);
        assert_eq!(grid.cell(&Vec3::z()), 0);
        assert_eq!(grid.cell(&-Vec3::z()), CELLS - 1);
        // Rounding beyond the ends.
        assert_eq!(grid.cell(&Vec3::new(0.0, 0.0, -1.0 - 1e-15)), CELLS - 1);
        let mut hit = vec![0; CELLS];
        for i in 0..400 {
            for k in 0..400 {
                let z = (f64::from(i) + 0.5) / 200.0 - 1.0;
                let azimuth = TAU * (f64::from(k) + 0.5) / 400.0 - PI;
                let cell = grid.cell(&towards(libm::acos(z), azimuth));
                hit[cell] += 1;
                let edges = grid.edges(cell);
                let azimuth = if azimuth < 0.0 { azimuth + TAU } else { azimuth };
                assert!(edges.azimuth[0] <= azimuth && azimuth <= edges.azimuth[1]);
            }
        }
        // Points of uniform density: equally many in every cell.
        for (cell, hits) in hit.into_iter().enumerate() {
            assert!((700..900).contains(&hits), "{cell}: {hits}");
        }
    }

    #[test]
    fn the_opening_is_the_pole_and_the_axes_are_a_rotation() {
        for opening in [Vec3::x(), -Vec3::y(), Vec3::new(0.6, 0.0, 0.8)] {
            let rotation = axes(&opening);
            assert!((rotation * opening - Vec3::z()).norm() < 1e-15);
            assert!((rotation * rotation.transpose() - Mat3::identity()).norm() < 1e-15);
            assert!(rotation.determinant() > 0.0);
        }
        let x = axes(&Vec3::z()) * Vec3::x();
        assert!((x - Vec3::x()).norm() < 1e-15);
    }
}
