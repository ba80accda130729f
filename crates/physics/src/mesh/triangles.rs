//! Triangles with common corners.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::MeshFault;

/// Most triangles of a file.
pub const MOST_TRIANGLES: usize = 200_000;
/// Most corners that a file lists.
const MOST_CORNERS: usize = 1_000_000;
/// Largest coordinate, in the unit of the file.
const LARGEST: f64 = 1e9;

/// A surface of triangles, in the unit of its file. Corners at the same place are one.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    vertices: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    open: Option<[u32; 2]>,
}

impl Mesh {
    /// Places of the corners.
    pub fn vertices(&self) -> &[[f32; 3]] {
        &self.vertices
    }

    /// Corners of each triangle, counter-clockwise seen from outside.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Ends of an edge that is not the border of as many triangles on its one side as on its other, if there is one: the mesh
    /// is not closed then, and has no volume.
    pub fn open_edge(&self) -> Option<[[f32; 3]; 2]> {
        self.open.map(|ends| ends.map(|i| self.vertices[i as usize]))
    }

    /// Lowest and highest coordinates.
    pub fn bounds(&self) -> [[f32; 3]; 2] {
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        // A file may list places that no triangle has.
        for corner in self.triangles.iter().flatten() {
            let vertex = self.vertices[*corner as usize];
            for i in 0..3 {
                low[i] = low[i].min(vertex[i]);
                high[i] = high[i].max(vertex[i]);
            }
        }
        [low, high]
    }

    /// Corners of the tetrahedra from a point, in the point's frame: of a closed mesh their signed volumes add up to its own.
    pub fn tetrahedra(&self, point: [f32; 3]) -> impl Iterator<Item = [Vector3<f64>; 3]> {
        let point = Vector3::from(point.map(f64::from));
        let corner = move |i: u32| Vector3::from(self.vertices[i as usize].map(f64::from)) - point;
        self.triangles.iter().map(move |triangle| triangle.map(corner))
    }

    /// The middle of its bounds.
    pub fn middle(&self) -> [f32; 3] {
        let [low, high] = self.bounds();
        [0, 1, 2].map(|i| 0.5 * (low[i] + high[i]))
    }

    /// Signed volumes of the tetrahedra from a point, added up, in the cube of the file's unit.
    pub(super) fn volume_about(&self, point: [f32; 3]) -> f64 {
        let six = |[a, b, c]: [Vector3<f64>; 3]| a.dot(&b.cross(&c));
        self.tetrahedra(point).map(six).sum::<f64>() / 6.0
    }
}

/// A mesh in the making.
#[derive(Default)]
pub(super) struct Builder {
    places: BTreeMap<[u32; 3], u32>,
    vertices: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    /// Corners and triangles that were asked for: those that are left out take their time, too.
    asked: [usize; 2],
}

impl Builder {
    /// Index of the corner at a place.
    pub fn vertex(&mut self, place: [f64; 3]) -> Result<u32, MeshFault> {
        self.asked[0] += 1;
        if self.asked[0] > MOST_CORNERS {
            let (what, most) = ("vertices", MOST_CORNERS);
            return Err(MeshFault::TooMany { what, most });
        }
        if !place.iter().all(|x| x.abs() <= LARGEST) {
            return Err(MeshFault::OutOfRange { most: LARGEST });
        }
        // 0 and -0 are one place.
        let place = place.map(|x| x as f32 + 0.0);
        let next = self.vertices.len() as u32;
        let index = *self.places.entry(place.map(f32::to_bits)).or_insert(next);
        if index == next {
            self.vertices.push(place);
        }
        Ok(index)
    }

    /// Adds a triangle, unless two of its corners are one.
    pub fn triangle(&mut self, [a, b, c]: [u32; 3]) -> Result<(), MeshFault> {
        self.asked[1] += 1;
        if self.asked[1] > MOST_TRIANGLES {
            let (what, most) = ("triangles", MOST_TRIANGLES);
            return Err(MeshFault::TooMany { what, most });
        }
        if a != b && b != c && c != a {
            self.triangles.push([a, b, c]);
        }
        Ok(())
    }

    /// The mesh, its outside outside.
    pub fn finish(self) -> Result<Mesh, MeshFault> {
        if self.triangles.is_empty() {
            return Err(MeshFault::NoTriangles);
        }
        let open = open_edge(&self.triangles);
        let mut mesh = Mesh { vertices: self.vertices, triangles: self.triangles, open };
        if mesh.volume_about(mesh.middle()) < 0.0 {
            mesh.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
        }
        Ok(mesh)
    }
}

/// The first edge along which the triangles do not cancel.
fn open_edge(triangles: &[[u32; 3]]) -> Option<[u32; 2]> {
    let mut edges = Vec::with_capacity(3 * triangles.len());
    for &[a, b, c] in triangles {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            edges.push(([from.min(to), from.max(to)], if from < to { 1 } else { -1 }));
        }
    }
    edges.sort_unstable();
    let sum = |group: &[([u32; 2], i32)]| group.iter().map(|(_, sign)| sign).sum::<i32>();
    let mut groups = edges.chunk_by(|a, b| a.0 == b.0);
    groups.find(|group| sum(group) != 0).map(|group| group[0].0)
}
