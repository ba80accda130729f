//! Meshes of the cells of wear maps.

use super::{Mesh, MeshData};
use crate::simulate::Grid;

/// Largest flat facet of a cell, rad.
const MAX_FACET: f64 = 0.07;

/// A square of edge 1 about the origin across x, seen from -x.
pub(super) const SQUARE: Mesh = Mesh::Plate(0);

/// The cell of a socket's zone `zone` that begins at azimuth 0, on the unit sphere, seen from inside.
pub(super) fn of_zone(zone: usize) -> Mesh {
    Mesh::Plate(1 + zone as u16)
}

/// Both, in the order of their numbers.
pub(super) fn meshes() -> Vec<MeshData> {
    let grid = Grid::of_sockets();
    let zones = (0..).map_while(|zone| grid.zone(zone));
    std::iter::once(square()).chain(zones.map(|cells| patch(grid.edges(cells.start)))).collect()
}

fn square() -> MeshData {
    let corners = [[0.5, -0.5], [-0.5, -0.5], [-0.5, 0.5], [0.5, 0.5]];
    let vertices = corners.map(|[y, z]| ([0.0, y, z, 0.0], [-1.0, 0.0, 0.0]));
    MeshData { vertices: vertices.to_vec(), indices: vec![0, 1, 2, 0, 2, 3] }
}

fn patch([polar, azimuth]: [[f64; 2]; 2]) -> MeshData {
    let parts = |[from, to]: [f64; 2]| ((to - from) / MAX_FACET).ceil() as u32;
    let (rows, columns) = (parts(polar), parts(azimuth));
    let mut mesh = MeshData::default();
    for i in 0..=rows {
        for k in 0..=columns {
            let at =
                |[from, to]: [f64; 2], part: u32, parts: u32| from + (to - from) * f64::from(part) / f64::from(parts);
            let (polar, azimuth) = (at(polar, i, rows), at(azimuth, k, columns));
            let ((s, c), (sa, ca)) = (polar.sin_cos(), azimuth.sin_cos());
            let [x, y, z] = [s * ca, s * sa, c].map(|part| part as f32);
            mesh.vertices.push(([x, y, z, 0.0], [-x, -y, -z]));
        }
    }
    for i in 0..rows {
        for k in 0..columns {
            let a = i * (columns + 1) + k;
            let b = a + columns + 1;
            mesh.indices.extend([a, a + 1, b, b, a + 1, b + 1]);
        }
    }
    mesh
}
