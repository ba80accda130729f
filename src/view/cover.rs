//! A coarse grid of the picture cells that bodies cover, so that text is placed clear of them.

use glam::{Mat4, Vec2, Vec3, Vec4};

use super::{DrawList, Eye, Instance, Mesh, MeshData};

/// Corners of the polygons that approximate circles.
const CORNERS: u16 = 12;
/// Most vertices of a mesh covered by its convex hull; larger meshes use their bounding box.
const MAX_HULL_VERTICES: usize = 64;
/// Most instances considered in a picture; beyond that some are skipped.
const MAX_INSTANCES: usize = 800;

/// What covers a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum CoverKind {
    /// Nothing but background and floor.
    #[default]
    Empty,
    /// A body.
    Body,
    /// A ball or its socket.
    Ball,
}

/// The covered cells of a picture. A cell counts as covered if a convex body touches it.
#[derive(Clone, Debug, Default)]
pub struct Cover {
    /// Edge of a cell, pixels.
    cell: f32,
    columns: usize,
    cells: Vec<CoverKind>,
    hull: Vec<Vec2>,
}

impl Cover {
    /// An empty cover of a picture of `size` pixels, with cells of `cell` pixels.
    pub(super) fn new(size: [u32; 2], cell: f32) -> Self {
        let cell = cell.max(1.0);
        let [columns, rows] = size.map(|edge| (edge as f32 / cell).ceil() as usize);
        Self { cell, columns, cells: vec![CoverKind::Empty; columns * rows], hull: Vec::new() }
    }

    /// Cover of the machine in `list`, and of the points of a map, with cells of `cell` pixels. Arrows, ghosts, lines and shadows do
    /// not count.
    pub fn of(list: &DrawList, cell: f32) -> Self {
        let mut cover = Self::new(list.size, cell);
        let count = list.solid.len() + list.faded.len() + list.wear.len() + list.sockets.len();
        let step = count.div_ceil(MAX_INSTANCES).max(1);
        let sphere = Mesh::Sphere.index();
        for layer in [&list.faded, &list.solid, &list.wear] {
            for (mesh, instances) in layer.by_mesh.iter().enumerate() {
                // Only balls of joints have a facing sphere.
                let kind = |instance: &Instance| {
                    if mesh == sphere && instance.other != [0.0; 4] { CoverKind::Ball } else { CoverKind::Body }
                };
                for instance in instances.iter().step_by(step) {
                    cover.mark(instance, mesh, list, kind(instance));
                }
            }
        }
        for instance in list.sockets.iter().chain(&list.clear_balls).step_by(step) {
            cover.mark(instance, sphere, list, CoverKind::Ball);
        }
        cover
    }

    fn mark(&mut self, instance: &Instance, mesh: usize, list: &DrawList, kind: CoverKind) {
        let [x, y, z] = instance.world_from_mesh.map(Vec4::from);
        let position = |p: Vec3| {
            let p = p.extend(1.0);
            Vec3::new(x.dot(p), y.dot(p), z.dot(p))
        };
        if Mesh::is_round(mesh) {
            let radius = Vec3::new(x.x, y.x, z.x).length();
            return self.add(&list.eye, list.size, [(position(Vec3::ZERO), radius)], kind);
        }
        let circle = (0..CORNERS).map(|k| {
            let (sin, cos) = (std::f32::consts::TAU * f32::from(k) / f32::from(CORNERS)).sin_cos();
            Vec3::new(cos, sin, 0.0)
        });
        let corner = |i: u8| Vec3::from([0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 0.5 } else { -0.5 }));
        let mut points: Vec<Vec3> = Vec::new();
        if mesh == Mesh::Cylinder.index() {
            points.extend(circle.flat_map(|p| [p, p + Vec3::Z]));
        } else if mesh == Mesh::Cone.index() {
            points.extend(circle.chain([Vec3::Z]));
        } else if mesh == Mesh::Cube.index() {
            points.extend((0..8).map(corner));
        } else if let Some(own) = mesh.checked_sub(Mesh::SHARED).and_then(|plate| list.plates.get(plate)) {
            points.extend(outline(own, corner));
        }
        self.add(&list.eye, list.size, points.into_iter().map(|point| (position(point), 0.0)), kind);
    }

    /// Adds the convex hull of spheres (centre, radius), m, as `eye` sees it in a picture of `size`. Parts behind the eye are
    /// left out.
    pub(super) fn add(
        &mut self,
        eye: &Eye,
        size: [u32; 2],
        spheres: impl IntoIterator<Item = (Vec3, f32)>,
        kind: CoverKind,
    ) {
        let [right, up] = across(&eye.clip_from_world);
        let mut points = std::mem::take(&mut self.hull);
        points.clear();
        for (centre, radius) in spheres {
            let corners = if radius > 0.0 { CORNERS } else { 1 };
            // The polygon circumscribes the circle, so that none of it is left out.
            let out = radius / (std::f32::consts::PI / f32::from(CORNERS)).cos();
            let around = (0..corners).map(|k| {
                let (sin, cos) = (std::f32::consts::TAU * f32::from(k) / f32::from(CORNERS)).sin_cos();
                centre + (right * cos + up * sin) * out
            });
            points.extend(around.filter_map(|point| eye.project(point, size)).filter(|point| point.is_finite()));
        }
        hull(&mut points);
        self.fill(&points, kind);
        self.hull = points;
    }

    /// Fills the cells that a convex polygon touches.
    fn fill(&mut self, polygon: &[Vec2], kind: CoverKind) {
        let ys = || polygon.iter().map(|p| p.y / self.cell);
        let (top, bottom) = (ys().fold(f32::INFINITY, f32::min), ys().fold(f32::NEG_INFINITY, f32::max));
        let rows = self.cells.len() / self.columns.max(1);
        let Some(rows) = span(top, bottom, rows) else {
            return;
        };
        for row in rows {
            let band = [row as f32 * self.cell, (row + 1) as f32 * self.cell];
            let (mut left, mut right) = (f32::INFINITY, f32::NEG_INFINITY);
            for (k, &from) in polygon.iter().enumerate() {
                let to = polygon[(k + 1) % polygon.len()];
                // The part of the edge in the band.
                let at = |y: f32| {
                    let along = if to.y == from.y { 0.0 } else { ((y - from.y) / (to.y - from.y)).clamp(0.0, 1.0) };
                    from.lerp(to, along)
                };
                if from.y.max(to.y) < band[0] || from.y.min(to.y) > band[1] {
                    continue;
                }
                let is_level = from.y == to.y;
                for x in if is_level { [from.x, to.x] } else { band.map(|y| at(y).x) } {
                    (left, right) = (left.min(x), right.max(x));
                }
            }
            let Some(columns) = span(left / self.cell, right / self.cell, self.columns) else {
                continue;
            };
            for cell in &mut self.cells[row * self.columns..][columns] {
                *cell = (*cell).max(kind);
            }
        }
    }

    /// Fractions of the rectangle from `min` to `max`, pixels, covered by bodies and by balls.
    pub fn covered_fractions(&self, min: Vec2, max: Vec2) -> [f32; 2] {
        let rows = self.cells.len() / self.columns.max(1);
        let (Some(rows), Some(columns)) = (
            span(min.y / self.cell, max.y / self.cell, rows),
            span(min.x / self.cell, max.x / self.cell, self.columns),
        ) else {
            return [0.0; 2];
        };
        let all = (rows.len() * columns.len()) as f32;
        let (mut bodies, mut balls) = (0_u32, 0_u32);
        for row in rows {
            for cell in &self.cells[row * self.columns..][columns.clone()] {
                bodies += u32::from(*cell == CoverKind::Body);
                balls += u32::from(*cell == CoverKind::Ball);
            }
        }
        [bodies, balls].map(|count| count as f32 / all)
    }
}

/// Range of cells between two positions, in cells, out of `count`.
fn span(from: f32, to: f32, count: usize) -> Option<std::ops::Range<usize>> {
    // The negation also rejects NaN.
    if !(to >= 0.0 && from < count as f32) {
        return None;
    }
    Some(from.max(0.0) as usize..(to as usize + 1).min(count))
}

/// The world's unit vectors to the right and up in a picture.
fn across(clip_from_world: &Mat4) -> [Vec3; 2] {
    [0, 1].map(|row| clip_from_world.row(row).truncate().normalize_or_zero())
}

/// Points whose convex hull contains a mesh of the scene.
fn outline(mesh: &MeshData, corner: impl Fn(u8) -> Vec3) -> Vec<Vec3> {
    if mesh.vertices.len() <= MAX_HULL_VERTICES {
        return mesh.vertices.iter().map(|(p, _)| Vec3::new(p[0], p[1], p[2])).collect();
    }
    let [middle, half] = mesh.bounds();
    (0..8).map(|i| middle + 2.0 * corner(i) * half).collect()
}

/// Reduces `points` to the corners of their convex hull, in order.
fn hull(points: &mut Vec<Vec2>) {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let turns = |a: Vec2, b: Vec2, c: Vec2| (b - a).perp_dot(c - a);
    let mut chain: Vec<Vec2> = Vec::with_capacity(points.len() + 1);
    for side in 0..2 {
        let start = chain.len();
        for &point in points.iter() {
            while chain.len() >= start + 2 && turns(chain[chain.len() - 2], chain[chain.len() - 1], point) <= 0.0 {
                chain.pop();
            }
            chain.push(point);
        }
        // The last point starts the other side.
        if points.len() > 1 {
            chain.pop();
        }
        if side == 0 {
            points.reverse();
        }
    }
    *points = chain;
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(corners: &[Vec2]) -> Vec<(usize, usize)> {
        let mut cover = Cover::new([100, 80], 10.0);
        let mut points = corners.to_vec();
        hull(&mut points);
        cover.fill(&points, CoverKind::Body);
        let places = (0..8).flat_map(|y| (0..10).map(move |x| (x, y)));
        places.filter(|(x, y)| cover.cells[y * 10 + x] == CoverKind::Body).collect()
    }

    #[test]
    fn cells_are_covered_that_a_polygon_touches() {
        assert_eq!(filled(&[Vec2::new(15.0, 15.0)]), [(1, 1)]);
        // A thin bar, level, upright and slanted.
        assert_eq!(filled(&[Vec2::new(15.0, 15.0), Vec2::new(38.0, 15.0)]), [(1, 1), (2, 1), (3, 1)]);
        assert_eq!(filled(&[Vec2::new(15.0, 15.0), Vec2::new(15.0, 38.0)]), [(1, 1), (1, 2), (1, 3)]);
        let slanted = filled(&[Vec2::new(12.0, 12.0), Vec2::new(38.0, 39.0)]);
        assert!(slanted.contains(&(1, 1)) && slanted.contains(&(2, 2)) && slanted.contains(&(3, 3)));
        assert!(slanted.len() <= 5, "{slanted:?}");
        // A square with a point in its middle; parts outside the picture are cut off.
        let square = [(-50.0, 35.0), (25.0, 35.0), (25.0, 300.0), (-50.0, 300.0), (0.0, 50.0)];
        let square = filled(&square.map(|(x, y)| Vec2::new(x, y)));
        assert_eq!(square.len(), 3 * 5);
        assert!(filled(&[Vec2::splat(-20.0), Vec2::new(-5.0, -1.0)]).is_empty());
        assert!(filled(&[]).is_empty());
    }

    #[test]
    fn shares_are_those_of_the_cells_that_a_rectangle_touches() {
        let mut cover = Cover::new([100, 80], 10.0);
        let corners = [(1.0, 1.0), (18.0, 1.0), (18.0, 38.0), (1.0, 38.0)].map(|(x, y)| Vec2::new(x, y));
        cover.fill(&corners, CoverKind::Body);
        cover.fill(&corners[..2], CoverKind::Ball);
        assert_eq!(cover.covered_fractions(Vec2::new(0.0, 0.0), Vec2::new(39.0, 19.0)), [2.0 / 8.0, 2.0 / 8.0]);
        assert_eq!(cover.covered_fractions(Vec2::new(60.0, 0.0), Vec2::new(99.0, 79.0)), [0.0; 2]);
        assert_eq!(cover.covered_fractions(Vec2::splat(-50.0), Vec2::splat(-20.0)), [0.0; 2]);
        assert_eq!(cover.covered_fractions(Vec2::splat(f32::NAN), Vec2::splat(f32::NAN)), [0.0; 2]);
    }
}
