//! A block between the walls of its guide.
//!
//! Seen from the guide, each corner of the block is drawn at m times its displacement across the walls, and the walls at m times
//! the play: the drawn block is a linear image of the real one, in which each corner has its own gap magnified.

use glam::{Mat3, Quat, Vec3};
use parry3d::query::Ray;

use super::{CELL_RADIUS, DrawnJoint, DrawnKind, IDEAL_GAP, MAX_SINE, column, ratio};
use crate::machine::{Geometry, LooseJoint, Mat3 as Matrix, Slide, Vec3 as Vector};
use crate::simulate::{Frame, JointReport, Part};
use crate::view::cast::cast as cast_solid;
use crate::view::instances::placed;
use crate::view::solids::Solid;
use crate::view::theme::Material;
use crate::view::{Layer, Mesh, Palette, to_f32, zones};

/// Most play drawn, in half lengths and in half widths of the block.
const MAX_PLAY: [f32; 2] = [0.25, 0.6];
/// Thickness of a wall, in half widths of the block.
const WALL: f32 = 0.2;
/// Least overhang of a guide beyond the block, in half lengths of it.
const OVERHANG: f32 = 0.4;
/// Opacity of the walls across y, of the rear wall across z, and of the one through which one looks.
const OPACITY: [f32; 3] = [0.5, 0.28, 0.06];

#[derive(Clone, Copy, Debug)]
pub struct DrawnSlide {
    /// Axes of the guide as columns.
    guide: Mat3,
    /// Image of the block's half edges, as columns, and its centre.
    block: Mat3,
    centre: Vec3,
    /// Half dimensions of the block, and drawn plays across y and z, m.
    half: Vec3,
    play: [f32; 2],
    /// Place along the guide, m.
    at: f32,
    is_planar: bool,
    /// +1 or -1: the side of z from which one looks into it.
    side: f32,
}

fn half(kind: &Slide) -> Vector {
    Vector::new(kind.half_length, kind.half_width, kind.seat_half_height())
}

pub fn drawn(
    joint: &LooseJoint,
    kind: &Slide,
    (now, frame): (&JointReport, &Frame),
    opening: Vec3,
    m: f32,
) -> DrawnJoint {
    let [guide, block] = joint.frames.map(|own| frame.axes_of(&own));
    let turn = guide.tr_mul(&block);
    let magnified = Matrix::identity() + (turn - Matrix::identity()) * f64::from(m);
    let half = half(kind);
    let image = guide * magnified * Matrix::from_diagonal(&half);
    let columns = |matrix: &Matrix| Mat3::from_cols(column(matrix, 0), column(matrix, 1), column(matrix, 2));
    let (guide, image) = (columns(&guide), columns(&image));
    let at = now.axial as f32;
    let socket_centre = to_f32(&now.socket_centre) + guide.x_axis * at;
    let eccentricity = to_f32(&now.eccentricity);
    let ball_centre = socket_centre + m * eccentricity;
    let half = to_f32(&half);
    let play = [now.clearance, now.second_clearance].map(|play| match play as f32 {
        play if play > 0.0 => m * play,
        _ => IDEAL_GAP * half.y,
    });
    let side = if opening.dot(guide.z_axis) < 0.0 { -1.0 } else { 1.0 };
    let is_planar = kind.half_height.is_none();
    let shape = DrawnSlide { guide, block: image, centre: ball_centre, half, play, at, is_planar, side };
    DrawnJoint {
        socket_centre,
        ball_centre,
        shift: (m - 1.0) * eccentricity,
        ball_radius: half.y,
        inner: 0.0,
        outer: 0.0,
        reach: half.length() + play[0],
        opening: guide.z_axis * side,
        shape: DrawnKind::Slide(shape),
    }
}

/// Largest magnification that leaves the joint recognisable.
pub fn limit(kind: &Slide, now: &JointReport) -> f32 {
    let half = to_f32(&half(kind));
    let across = to_f32(&now.eccentricity).length();
    let along = MAX_PLAY[0] * half.x;
    let first = ratio((MAX_PLAY[1] * half.y).min(along), (now.clearance as f32).max(across));
    first.min(ratio((MAX_PLAY[1] * half.z).min(along), now.second_clearance as f32))
}

/// Ends of the guide along its axis, m, for a block at `at`: a block slides towards the middle of its machine.
pub fn guide(kind: &Slide, at: f32, middle: f32) -> [f32; 2] {
    let reach = (1.0 + OVERHANG) * kind.half_length as f32;
    [middle.min(at - reach), middle.max(at + reach)]
}

/// A box of the block's dimensions about its centre.
pub fn replaces(joint: &LooseJoint, kind: &Slide, body: Option<usize>, shape: &Geometry) -> bool {
    let Geometry::Box { centre, size } = shape else {
        return false;
    };
    let own = joint.frames[1];
    let turn = own.rotation.to_rotation_matrix().into_inner();
    let is_square = turn.iter().all(|entry| entry.abs() < MAX_SINE || entry.abs() > 1.0 - MAX_SINE);
    let (half, size) = (half(kind), turn.map(f64::abs).tr_mul(size) / 2.0);
    // The height of a block in its plane is not known.
    let known = if kind.half_height.is_some() { 3 } else { 2 };
    own.origin.body == body
        && is_square
        && (own.origin.point - centre).norm() < 0.1 * half.min()
        && (0..known).all(|i| (size[i] / half[i] - 1.0).abs() < 0.15)
}

/// Whether the block contains a point, `from_centre` in the axes of its body, m.
pub fn contains(joint: &LooseJoint, kind: &Slide, from_centre: Vec3) -> bool {
    let own = joint.frames[1].rotation.to_rotation_matrix().into_inner();
    let columns = Mat3::from_cols(column(&own, 0), column(&own, 1), column(&own, 2));
    let at = columns.transpose() * from_centre;
    at.abs().cmple(to_f32(&half(kind)) * 1.001).all()
}

impl DrawnSlide {
    /// A point of the block in half edges: a corner is at -1 or 1 each.
    fn point(&self, edges: Vec3) -> Vec3 {
        self.centre + self.block * edges
    }

    pub fn corners(&self) -> impl Iterator<Item = Vec3> {
        let sign = |bit: bool| if bit { 1.0 } else { -1.0 };
        (0..8).map(move |i| self.point(Vec3::new(sign(i & 4 != 0), sign(i & 2 != 0), sign(i & 1 != 0))))
    }

    pub fn diagonal(&self) -> [Vec3; 2] {
        [self.point(-Vec3::ONE), self.point(Vec3::ONE)]
    }

    pub fn mark_radius(&self) -> f32 {
        0.06 * self.half.x.min(self.half.y)
    }

    /// The corner of place `place` among the names of the sites.
    pub fn corner_of(&self, place: usize) -> Vec3 {
        self.point(self.edges_of(place))
    }

    /// That corner in half edges. In a plane it is the middle of an edge.
    fn edges_of(&self, place: usize) -> Vec3 {
        let sign = |bit: usize| if bit != 0 { 1.0 } else { -1.0 };
        if self.is_planar {
            Vec3::new(sign(place & 2), sign(place & 1), 0.0)
        } else {
            let corner = place / 2;
            Vec3::new(sign(corner & 4), sign(corner & 2), sign(corner & 1))
        }
    }

    pub fn push_block(&self, layer: &mut Layer, material: Material) {
        layer.push(Mesh::Cube, placed(self.block * 2.0, self.centre, material));
    }

    /// The walls between the ends `span` of the guide, or as far as the block has come.
    pub fn push_walls(&self, joint: &DrawnJoint, [low, high]: [f32; 2], palette: &Palette, layer: &mut Layer) {
        let beyond = (1.0 + OVERHANG) * self.half.x;
        let [low, high] = [low.min(self.at - beyond), high.max(self.at + beyond)];
        let middle = joint.socket_centre + self.guide.x_axis * (0.5 * (low + high) - self.at);
        let thickness = WALL * self.half.y.min(self.half.x);
        let [y, z] = [self.half.y + self.play[0], self.half.z + self.play[1]];
        let mut wall = |offset: Vec3, size: Vec3, opacity| {
            let linear = self.guide * Mat3::from_diagonal(size);
            layer.push(Mesh::Cube, placed(linear, middle + self.guide * offset, palette.socket.with_opacity(opacity)));
        };
        let long = high - low;
        for side in [-1.0, 1.0] {
            let at = Vec3::Y * (side * (y + 0.5 * thickness));
            let width = if self.is_planar { 2.0 * self.half.z } else { 2.0 * (z + thickness) };
            wall(at, Vec3::new(long, thickness, width), OPACITY[0]);
            if !self.is_planar {
                let at = Vec3::Z * (side * (z + 0.5 * thickness));
                let opacity = if side == self.side { OPACITY[2] } else { OPACITY[1] };
                wall(at, Vec3::new(long, 2.0 * y, thickness), opacity);
            }
        }
    }

    /// Point of a wall in the direction `out`, beside the corner of place `place`, or beside the middle of the block.
    pub fn wall_point(&self, joint: &DrawnJoint, out: Vec3, place: Option<usize>) -> Vec3 {
        let beside = place.map_or(Vec3::ZERO, |place| self.edges_of(place) * self.half);
        let local = self.guide.transpose() * out;
        let at = if local.y.abs() >= local.z.abs() {
            Vec3::new(beside.x, (self.half.y + self.play[0]) * local.y.signum(), beside.z)
        } else {
            Vec3::new(beside.x, beside.y, (self.half.z + self.play[1]) * local.z.signum())
        };
        joint.socket_centre + self.guide * at
    }

    /// The part of a wall beside a corner of the block.
    pub fn cell(&self, joint: &DrawnJoint, part: &Part, mut visit: impl FnMut(Mesh, Mat3, Vec3)) {
        let place = usize::from(part.place);
        let edges = self.edges_of(place);
        let across = if self.is_planar || place % 2 == 0 { 1 } else { 2 };
        let beside = 3 - across;
        let mut at = edges * self.half * 0.5;
        at[across] = edges[across] * CELL_RADIUS * (self.half[across] + self.play[across - 1]);
        let normal = self.guide.col(across) * edges[across];
        let size = self.half[beside] * if edges[beside] == 0.0 { 2.0 } else { 1.0 };
        let second = self.guide.col(beside) * size;
        let linear = Mat3::from_cols(normal, second, normal.cross(second).normalize() * self.half.x);
        visit(zones::SQUARE, linear, joint.socket_centre + self.guide * at);
    }

    pub fn cast(&self, ray: &Ray) -> Option<f32> {
        let rotation = Mat3::from_quat(Quat::from_mat3(&self.guide));
        cast_solid(&Solid::Box { centre: self.centre, size: 2.0 * self.half, rotation }, ray)
    }
}
