//! The drawn surface of a mesh: smooth, with creases at sharp edges.

use glam::Vec3;

use super::MeshData;
use crate::mesh::Mesh;

/// Cosine of the smallest angle between two triangles whose common edge is a crease: 35 deg.
const CREASE: f32 = 0.819;
/// Most triangles around a vertex for it to be smoothed: the cost grows with their square.
const MAX_SMOOTHED: usize = 64;

/// Triangles of `mesh` with normals, m; `unit` is the length of the file's unit. Both sides are drawn where it is not closed.
pub(super) fn surface(mesh: &Mesh, unit: f64) -> MeshData {
    let position = |p: &[f32; 3]| Vec3::from(p.map(|x| (f64::from(x) * unit) as f32));
    let positions: Vec<Vec3> = mesh.vertices().iter().map(position).collect();
    let corners = |triangle: &[u32; 3]| triangle.map(|i| positions[i as usize]);
    // In units of the file: in square metres, areas of small triangles would underflow in f32.
    let area = |triangle: &[u32; 3]| {
        let [a, b, c] = corners(triangle).map(|position| position / unit as f32);
        (b - a).cross(c - a)
    };
    let areas: Vec<Vec3> = mesh.triangles().iter().map(area).collect();
    let normals: Vec<Vec3> = areas.iter().map(|area| area.normalize_or_zero()).collect();

    // Triangles around each vertex: those of vertex i are `about[first[i]..first[i + 1]]`.
    let mut first = vec![0; positions.len() + 1];
    for corner in mesh.triangles().iter().flatten() {
        first[*corner as usize + 1] += 1;
    }
    for i in 0..positions.len() {
        first[i + 1] += first[i];
    }
    let mut next = first.clone();
    let mut about = vec![0; 3 * areas.len()];
    for (t, triangle) in mesh.triangles().iter().enumerate() {
        for corner in triangle {
            let position = &mut next[*corner as usize];
            about[*position] = t;
            *position += 1;
        }
    }

    let mut out = MeshData::default();
    // Output vertices created for each vertex of the mesh, with their normals.
    let mut created: Vec<Vec<(Vec3, u32)>> = vec![Vec::new(); positions.len()];
    for (t, triangle) in mesh.triangles().iter().enumerate() {
        if normals[t] == Vec3::ZERO {
            continue;
        }
        for &corner in triangle {
            let i = corner as usize;
            let around = &about[first[i]..first[i + 1]];
            let normal = if around.len() > MAX_SMOOTHED {
                normals[t]
            } else {
                let smooth = around.iter().filter(|&&other| normals[other].dot(normals[t]) > CREASE);
                smooth.map(|&other| areas[other]).sum::<Vec3>().normalize_or(normals[t])
            };
            let is_same = |(known, _): &&(Vec3, u32)| known.distance_squared(normal) < 1e-8;
            let known = created[i].iter().take(MAX_SMOOTHED).find(is_same);
            let index = match known {
                Some((_, index)) => *index,
                None => {
                    let index = out.vertices.len() as u32;
                    let [x, y, z] = positions[i].to_array();
                    out.vertices.push(([x, y, z, 0.0], normal.to_array()));
                    created[i].push((normal, index));
                    index
                }
            };
            out.indices.push(index);
        }
    }
    if mesh.open_edge().is_some() {
        let (count, indices) = (out.vertices.len() as u32, out.indices.clone());
        let back = |&(position, normal): &([f32; 4], [f32; 3])| (position, normal.map(|x| -x));
        let behind: Vec<_> = out.vertices.iter().map(back).collect();
        out.vertices.extend(behind);
        let turned = indices.chunks_exact(3).flat_map(|t| [t[0], t[2], t[1]]);
        out.indices.extend(turned.map(|i| i + count));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::MeshFormat;

    /// A prism with `sides` sides about z, radius 10, open at its ends unless `closed`.
    fn prism(sides: usize, closed: bool) -> Mesh {
        let mut text = String::new();
        for k in 0..sides {
            let angle = std::f32::consts::TAU * k as f32 / sides as f32;
            let (x, y) = (10.0 * angle.cos(), 10.0 * angle.sin());
            text += &format!("v {x} {y} 0\nv {x} {y} 5\n");
        }
        for k in 0..sides {
            let (a, b) = (2 * k + 1, 2 * ((k + 1) % sides) + 1);
            text += &format!("f {a} {b} {} {}\n", b + 1, a + 1);
        }
        if closed {
            let ring = |upper: usize| (0..sides).map(move |k| format!(" {}", 2 * k + 1 + upper));
            text += &format!("f{}\n", ring(1).collect::<String>());
            text += &format!("f{}\n", ring(0).rev().collect::<String>());
        }
        let no_files = |_: &str| Err(String::new().into());
        MeshFormat::Obj.read(text.as_bytes(), &no_files).unwrap()
    }

    #[test]
    fn round_sides_are_smooth_and_edges_stay() {
        let round = surface(&prism(24, true), 1e-3);
        // Each of 48 corners belongs to the side and to an end.
        assert_eq!(round.vertices.len(), 96);
        for (position, normal) in &round.vertices {
            let across = Vec3::new(position[0], position[1], 0.0) / 0.01;
            let normal = Vec3::from(*normal);
            let expected = if normal.z.abs() > 0.5 { Vec3::Z * normal.z.signum() } else { across };
            assert!(normal.distance(expected) < 0.07, "{position:?} {normal}");
        }
        // Every corner of a hexagonal prism belongs to two sides and an end.
        assert_eq!(surface(&prism(6, true), 1.0).vertices.len(), 36);
    }

    #[test]
    fn an_open_surface_has_two_sides() {
        let open = surface(&prism(24, false), 1e-3);
        assert_eq!((open.vertices.len(), open.indices.len()), (96, 2 * 24 * 6));
        for half in open.vertices.chunks(48) {
            let out = |(position, normal): &([f32; 4], [f32; 3])| position[0] * normal[0] + position[1] * normal[1];
            let side = out(&half[0]).signum();
            assert!(half.iter().all(|vertex| out(vertex) * side > 0.0));
        }
    }
}
