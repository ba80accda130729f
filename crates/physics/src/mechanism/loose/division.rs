//! Division of the surfaces of a joint with play into the cells of its wear map. Each kind divides its own.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::sphere::Grid;
use crate::machine::{JointFrame, Mat3, Vec3};

/// Parts of the surface of a joint's carrier, and the cells of each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Division {
    axes: Mat3,
    parts: Vec<Part>,
}

/// A part of the surface, at one of the places where the joint can touch. Its cells are equal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// Index among [`LooseKind::site_names`](crate::machine::LooseKind::site_names); 0 for a kind with one place.
    pub place: u8,
    /// Its shape.
    pub shape: Shape,
    /// Area of each of its cells, m^2, with the play when the map was started.
    pub area: f64,
}

/// How a part is divided.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Shape {
    /// A sphere, into cells of equal area.
    Sphere {
        /// Those cells.
        #[serde(skip, default = "Grid::of_sockets")]
        grid: Arc<Grid>,
    },
    /// A cylinder or a ring about z, into sectors. The first is centred on x: what lies on an axis is on no edge.
    Ring {
        /// Their number.
        sectors: u16,
    },
    /// One cell.
    Whole,
}

/// Edges of a cell, rad, where its part is divided by that angle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Edges {
    /// Polar angle from +z, 0..=pi.
    pub polar: Option<[f64; 2]>,
    /// Azimuth about z from +x towards +y.
    pub azimuth: Option<[f64; 2]>,
}

/// A contact's place on the surface of its joint's carrier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// Index among the names of the joint's sites.
    pub place: u8,
    /// Unit vector in the axes of the carrier's body: in a socket and across a bearing from the middle to the point of contact, of a
    /// wall its outward normal.
    pub direction: Vec3,
}

impl Part {
    /// Number of its cells.
    pub fn cells(&self) -> usize {
        match &self.shape {
            Shape::Sphere { grid } => grid.cells(),
            Shape::Ring { sectors } => usize::from(*sectors),
            Shape::Whole => 1,
        }
    }

    /// Edges of its cell `cell`.
    pub fn edges(&self, cell: usize) -> Edges {
        match &self.shape {
            Shape::Sphere { grid } => {
                let [polar, azimuth] = grid.edges(cell);
                Edges { polar: Some(polar), azimuth: Some(azimuth) }
            }
            Shape::Ring { sectors } => {
                let width = TAU / f64::from(*sectors);
                Edges { polar: None, azimuth: Some([-0.5, 0.5].map(|half| (cell as f64 + half) * width)) }
            }
            Shape::Whole => Edges::default(),
        }
    }

    /// Its cell in the direction of a unit vector, in the axes of the division.
    fn cell(&self, direction: &Vec3) -> usize {
        match &self.shape {
            Shape::Sphere { grid } => grid.cell(direction),
            Shape::Ring { sectors } => {
                let turn = libm::atan2(direction.y, direction.x) / TAU;
                let sector = (turn * f64::from(*sectors)).round() as i64;
                sector.rem_euclid(i64::from(*sectors)) as usize
            }
            Shape::Whole => 0,
        }
    }
}

impl Division {
    /// A sphere about the opening `opening`, in the axes of the carrier's body. z is the opening; x lies in the plane of the opening
    /// and the body's x axis, or its y axis where x is within 45 degrees of the opening.
    pub(super) fn about_opening(opening: &Vec3, parts: Vec<Part>) -> Self {
        let z = opening.normalize();
        let near = if z.x.abs() > FRAC_1_SQRT_2 { Vec3::y() } else { Vec3::x() };
        let x = (near - z * z.dot(&near)).normalize();
        let y = z.cross(&x);
        Self { axes: Mat3::from_rows(&[x.transpose(), y.transpose(), z.transpose()]), parts }
    }

    /// About the x axis of `frame`, which is z here.
    pub(super) fn about_axis(frame: &JointFrame, parts: Vec<Part>) -> Self {
        let own = frame.rotation.to_rotation_matrix().into_inner();
        let row = |i: usize| own.column(i).transpose();
        Self { axes: Mat3::from_rows(&[row(1), row(2), row(0)]), parts }
    }

    /// In the axes of `frame`.
    pub(super) fn along_axes(frame: &JointFrame, parts: Vec<Part>) -> Self {
        Self { axes: frame.rotation.to_rotation_matrix().into_inner().transpose(), parts }
    }

    /// Rotation from the axes of the carrier's body to those in which azimuths and polar angles count: of a socket z is its opening,
    /// and x lies in the plane of the opening and the body's x axis, or its y axis where x is within 45 degrees of the opening; of a
    /// bearing z is its axis, x and y are the joint's second and third axis; of a guide they are the joint's three.
    pub fn axes(&self) -> &Mat3 {
        &self.axes
    }

    /// Its parts, whose cells follow one another.
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// Number of cells; 0 without play.
    pub fn cells(&self) -> usize {
        self.parts.iter().map(Part::cells).sum()
    }

    /// Each cell, by its part and its number among the part's cells.
    pub fn each(&self) -> impl Iterator<Item = (&Part, usize)> {
        self.parts.iter().flat_map(|part| (0..part.cells()).map(move |cell| (part, cell)))
    }

    /// Cell of a contact; `None` where the joint has no surface.
    pub fn cell(&self, spot: &Spot) -> Option<usize> {
        let mut first = 0;
        for part in &self.parts {
            if part.place == spot.place {
                return Some(first + part.cell(&(self.axes * spot.direction)));
            }
            first += part.cells();
        }
        None
    }

    /// Direction of the middle of cell `cell` of `part`, in the axes of the carrier's body; of an undivided part z.
    pub fn direction(&self, part: &Part, cell: usize) -> Vec3 {
        let Edges { polar, azimuth } = part.edges(cell);
        let middle = |edges: Option<[f64; 2]>, none: f64| edges.map_or(none, |[from, to]| 0.5 * (from + to));
        let pole = if azimuth.is_some() { 0.25 * TAU } else { 0.0 };
        let (polar, azimuth) = (middle(polar, pole), middle(azimuth, 0.0));
        let ((sin, cos), (s, c)) = (libm::sincos(polar), libm::sincos(azimuth));
        self.axes.tr_mul(&Vec3::new(sin * c, sin * s, cos))
    }

    /// Whether `other` has the same cells, whatever their areas.
    pub(crate) fn has_cells_of(&self, other: &Self) -> bool {
        self.axes == other.axes
            && self.parts.len() == other.parts.len()
            && self.parts.iter().zip(&other.parts).all(|(a, b)| a.place == b.place && a.shape == b.shape)
    }

    /// Approximate size in bytes, without grids.
    pub(crate) fn bytes(&self) -> usize {
        size_of::<Self>() + size_of_val(self.parts.as_slice())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::{Attachment, Quat};

    #[test]
    fn the_opening_is_the_pole_and_the_axes_are_a_rotation() {
        let axes = |opening: &Vec3| *Division::about_opening(opening, Vec::new()).axes();
        for opening in [Vec3::x(), -Vec3::y(), Vec3::new(0.6, 0.0, 0.8)] {
            let rotation = axes(&opening);
            assert!((rotation * opening - Vec3::z()).norm() < 1e-15);
            assert!((rotation * rotation.transpose() - Mat3::identity()).norm() < 1e-15);
            assert!(rotation.determinant() > 0.0);
        }
        let x = axes(&Vec3::z()) * Vec3::x();
        assert!((x - Vec3::x()).norm() < 1e-15);
    }

    #[test]
    fn sectors_are_centred_on_the_axes_and_each_direction_lies_in_one() {
        let turn = Quat::from_axis_angle(&nalgebra::Unit::new_normalize(Vec3::new(1.0, 2.0, -0.5)), 1.1);
        let frame = JointFrame { origin: Attachment { body: None, point: Vec3::zeros() }, rotation: turn };
        for sectors in [4, 72] {
            let part = |place| Part { place, shape: Shape::Ring { sectors }, area: 1.0 };
            let division = Division::about_axis(&frame, vec![part(0), part(2)]);
            assert_eq!(division.cells(), 2 * usize::from(sectors));
            assert!(division.axes().determinant() > 0.0);
            let towards = |angle: f64| turn * Vec3::new(0.0, libm::cos(angle), libm::sin(angle));
            for (number, (part, cell)) in division.each().enumerate() {
                let [from, to] = part.edges(cell).azimuth.expect("divided by it");
                let middle = division.direction(part, cell) - towards(0.5 * (from + to));
                assert!(middle.norm() < 1e-14);
                for share in [0.01, 0.5, 0.99] {
                    let spot = Spot { place: part.place, direction: towards(from + share * (to - from)) };
                    assert_eq!(division.cell(&spot), Some(number));
                }
            }
            // Quarters of a turn, to rounding, are middles of sectors.
            for quarter in 0..4 {
                let spot = Spot { place: 2, direction: towards(TAU / 4.0 * f64::from(quarter)) };
                let expected = usize::from(sectors) + usize::from(sectors) / 4 * quarter as usize;
                assert_eq!(division.cell(&spot), Some(expected));
            }
            assert_eq!(division.cell(&Spot { place: 1, direction: towards(0.0) }), None);
        }
    }
}
