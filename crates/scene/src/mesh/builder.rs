//! Mesh builder: triangles with shared vertices.

use std::collections::BTreeMap;

use super::{Mesh, MeshFault};

/// Maximum number of triangles in a file.
pub const MAX_TRIANGLES: usize = 200_000;
/// Maximum number of vertices in a file.
const MAX_CORNERS: usize = 1_000_000;
/// Largest absolute coordinate, in file units.
const MAX_COORDINATE: f64 = 1e9;

/// Collects vertices and triangles, and merges vertices at the same position.
#[derive(Default)]
pub(super) struct Builder {
    places: BTreeMap<[u32; 3], u32>,
    vertices: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    /// Numbers of vertices and triangles submitted: merged and degenerate ones also cost time.
    submitted: [usize; 2],
}

impl Builder {
    /// Index of the vertex at `place`, which is added if new.
    pub fn vertex(&mut self, place: [f64; 3]) -> Result<u32, MeshFault> {
        self.submitted[0] += 1;
        if self.submitted[0] > MAX_CORNERS {
            let (what, most) = ("vertices", MAX_CORNERS);
            return Err(MeshFault::TooMany { what, most });
        }
        if !place.iter().all(|x| x.abs() <= MAX_COORDINATE) {
            return Err(MeshFault::OutOfRange { most: MAX_COORDINATE });
        }
        // Adding 0 turns -0 into 0, so that both share a vertex.
        let place = place.map(|x| x as f32 + 0.0);
        let next = self.vertices.len() as u32;
        let index = *self.places.entry(place.map(f32::to_bits)).or_insert(next);
        if index == next {
            self.vertices.push(place);
        }
        Ok(index)
    }

    /// Adds a triangle; one with a repeated vertex is dropped.
    pub fn triangle(&mut self, [a, b, c]: [u32; 3]) -> Result<(), MeshFault> {
        self.submitted[1] += 1;
        if self.submitted[1] > MAX_TRIANGLES {
            let (what, most) = ("triangles", MAX_TRIANGLES);
            return Err(MeshFault::TooMany { what, most });
        }
        if a != b && b != c && c != a {
            self.triangles.push([a, b, c]);
        }
        Ok(())
    }

    /// The finished mesh, oriented outwards.
    pub fn finish(self) -> Result<Mesh, MeshFault> {
        if self.triangles.is_empty() {
            return Err(MeshFault::NoTriangles);
        }
        Ok(Mesh::new(self.vertices, self.triangles))
    }
}
