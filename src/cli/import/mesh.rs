//! Mass of meshes, as MuJoCo computes it: <https://mujoco.readthedocs.io/en/stable/XMLreference.html#asset-mesh-inertia>.

use std::collections::BTreeSet;
use std::path::{Component, Path};

use crate::machine::{Mesh, Solid, Vec3};
use crate::scene::mesh::Format;
use crate::scene::{MAX_MESH_SIZE, read_regular};
use crate::words::words;

/// Limit on the comparisons of a point with a face for a hull.
const MAX_COMPARISONS: usize = 400_000_000;
/// Points within this distance of a face's plane, in extents of the mesh, count as in it: files are rounded.
const PLANE_TOLERANCE: f64 = 1e-9;

/// The part of a mesh that has mass: the values of its attribute `inertia`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshInertia {
    /// Its convex hull.
    Convex,
    /// The enclosed volume.
    Exact,
    /// The pyramids from an inner point to its triangles, all counted as positive, even those of triangles that face inwards.
    Legacy,
    /// Its surface.
    Shell,
}

words!(MeshInertia {
    Convex => "convex",
    Exact => "exact",
    Legacy => "legacy",
    Shell => "shell",
});

/// Reads the mesh `file` of a description in `folder`.
///
/// # Errors
/// A sentence about a file that is elsewhere, unreadable, too large or invalid.
pub fn read(folder: &Path, file: &str) -> Result<Mesh, String> {
    let below = Path::new(file).components().all(|part| matches!(part, Component::Normal(_)));
    let format = Format::of(file).filter(|_| below);
    let format = format.ok_or_else(|| {
        format!("{file} is not STL, OBJ or glTF, or not in the folder of the description or below it")
    })?;
    let bytes = read_regular(&folder.join(file), MAX_MESH_SIZE).map_err(|error| format!("{file}: {error}"))?;
    let no_other_file = |other: &str| Err(format!("{other} is another file").into());
    format.read(&bytes, &no_other_file).map_err(|fault| format!("{file}: {}", fault.why))
}

/// The solid of `mesh` that has mass. `transform` maps its vertices, m; `mirrored` if that turns the surface inside out. The volume
/// of a shell is its area, m^2.
///
/// # Errors
/// A sentence about a mesh that is open, flat, or too large for a hull.
pub fn solid(
    mesh: &Mesh,
    transform: impl Fn(Vec3) -> Vec3,
    mirrored: bool,
    mesh_inertia: MeshInertia,
) -> Result<Solid, String> {
    let vertices: Vec<Vec3> =
        mesh.vertices().iter().map(|vertex| transform(Vec3::from(vertex.map(f64::from)))).collect();
    let outward = |[a, b, c]: [u32; 3]| {
        let corners = if mirrored { [a, c, b] } else { [a, b, c] };
        corners.map(|corner| vertices[corner as usize])
    };
    let triangles: Vec<[Vec3; 3]> = match mesh_inertia {
        MeshInertia::Convex => hull(&vertices)?.into_iter().map(|face| face.map(|corner| vertices[corner])).collect(),
        _ => mesh.triangles().iter().map(|corners| outward(*corners)).collect(),
    };
    if let (MeshInertia::Exact | MeshInertia::Legacy, Some(ends)) = (mesh_inertia, mesh.open_edge()) {
        let [from, to] = ends.map(|[x, y, z]| format!("({x}, {y}, {z})"));
        return Err(format!(
            "it is not closed: its edge from {from} to {to} does not lie between two triangles that face the same way; close it, or \
             choose inertia = \"convex\" or \"shell\""
        ));
    }
    let surface = Solid::of_surface(triangles.iter().copied());
    let pyramids_about = |point: Vec3, unsigned: bool| {
        let pyramids = triangles.iter().map(|corners| {
            let [a, b, c] = corners.map(|corner| corner - point);
            if unsigned && a.dot(&b.cross(&c)) < 0.0 { [a, c, b] } else { [a, b, c] }
        });
        Solid::of_tetrahedra(pyramids).moved(point)
    };
    let solid = match mesh_inertia {
        MeshInertia::Shell => surface,
        MeshInertia::Convex | MeshInertia::Exact => pyramids_about(surface.centre, false),
        // As in `ComputeVolume` and `ComputeInertia` of MuJoCo's user_mesh.cc: the centroid of the first pyramids is the tip of the
        // pyramids with mass, and counts as the centre of mass, although it is not their centroid.
        MeshInertia::Legacy => {
            let tip = pyramids_about(surface.centre, true).centre;
            pyramids_about(tip, true).about(tip)
        }
    };
    let has_volume = solid.volume > 0.0 && solid.inertia().symmetric_eigenvalues().min() > 0.0;
    if has_volume { Ok(solid) } else { Err("it encloses no volume".to_owned()) }
}

/// Triangles of the convex hull of `points`, counter-clockwise seen from outside, as indices. Each point in turn replaces the faces that
/// it sees by the cone to their outline, so that the surface stays closed despite rounding
/// (O'Rourke, *Computational Geometry in C*, second edition, 1998, section 4.3).
fn hull(points: &[Vec3]) -> Result<Vec<[usize; 3]>, String> {
    let flat = || "its points lie in one plane".to_owned();
    let farthest = |measure: &dyn Fn(&Vec3) -> f64| {
        let all = points.iter().enumerate().map(|(index, point)| (measure(point), index));
        all.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(size, _)| *size > 0.0).map(|(_, index)| index).ok_or_else(flat)
    };
    let a = points.first().ok_or_else(flat)?;
    let first = farthest(&|p| (p - a).norm())?;
    let a = points[first];
    let second = farthest(&|p| (p - a).norm())?;
    let (extent, along) = ((points[second] - a).norm(), (points[second] - a).normalize());
    let third = farthest(&|p| (p - a).cross(&along).norm())?;
    let normal = along.cross(&(points[third] - a)).try_normalize(0.0).ok_or_else(flat)?;
    let fourth = farthest(&|p| (p - a).dot(&normal).abs())?;
    let height = (points[fourth] - a).dot(&normal);
    if height.abs() <= PLANE_TOLERANCE * extent {
        return Err(flat());
    }
    let [i, j, k, top] = if height > 0.0 { [first, third, second, fourth] } else { [first, second, third, fourth] };
    let face = |corners: [usize; 3]| {
        let [a, b, c] = corners.map(|corner| points[corner]);
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_else(Vec3::zeros);
        (corners, normal, normal.dot(&a))
    };
    let mut faces: Vec<_> = [[i, j, k], [i, top, j], [j, top, k], [k, top, i]].map(face).into();
    let mut comparisons = 0;
    for (index, point) in points.iter().enumerate() {
        comparisons += faces.len();
        if comparisons > MAX_COMPARISONS {
            return Err("its hull is too costly; choose inertia = \"exact\"".to_owned());
        }
        let is_visible =
            |(_, normal, height): &([usize; 3], Vec3, f64)| normal.dot(point) - height > PLANE_TOLERANCE * extent;
        if !faces.iter().any(is_visible) {
            continue;
        }
        let (visible, hidden): (Vec<_>, Vec<_>) = faces.into_iter().partition(is_visible);
        faces = hidden;
        let edges: BTreeSet<[usize; 2]> =
            visible.iter().flat_map(|([a, b, c], ..)| [[*a, *b], [*b, *c], [*c, *a]]).collect();
        let outline = edges.iter().filter(|[from, to]| !edges.contains(&[*to, *from]));
        faces.extend(outline.map(|[from, to]| face([*from, *to, index])));
    }
    Ok(faces.into_iter().map(|(corners, ..)| corners).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A prism over the polygon `corners`, in m: its mesh, in mm, is closed.
    fn prism(corners: &[[f32; 2]], triangles: &[[u32; 3]], height: f32) -> Mesh {
        let n = u32::try_from(corners.len()).unwrap();
        let layer = |z: f32| corners.iter().map(move |[x, y]| [1e3 * x, 1e3 * y, 1e3 * z]);
        let mut faces: Vec<[u32; 3]> =
            triangles.iter().flat_map(|&[a, b, c]| [[a, c, b], [a + n, b + n, c + n]]).collect();
        faces.extend((0..n).flat_map(|i| {
            let next = (i + 1) % n;
            [[i, next, next + n], [i, next + n, i + n]]
        }));
        Mesh::new(layer(0.0).chain(layer(height)).collect(), faces)
    }

    fn solid_of(mesh: &Mesh, mesh_inertia: MeshInertia) -> Solid {
        solid(mesh, |point| point * 1e-3, false, mesh_inertia).unwrap()
    }

    fn assert_solid(solid: &Solid, volume: f64, centre: [f64; 3], inertia: [f64; 3]) {
        assert!((solid.volume / volume - 1.0).abs() < 1e-6, "{} {volume}", solid.volume);
        assert!((solid.centre - Vec3::from(centre)).amax() < 1e-6, "{}", solid.centre);
        let off = solid.inertia().diagonal() - Vec3::from(inertia);
        assert!(off.amax() < 1e-5 * Vec3::from(inertia).amax(), "{} {inertia:?}", solid.inertia());
    }

    #[test]
    fn every_filled_box_mesh_has_the_moments_of_a_box_and_a_shell_those_of_six_plates() {
        let corners = [[0.0, 0.0], [0.2, 0.0], [0.2, 0.3], [0.0, 0.3]];
        let mesh = prism(&corners, &[[0, 1, 2], [0, 2, 3]], 0.5);
        let (v, squares) = (0.2 * 0.3 * 0.5, [0.04, 0.09, 0.25]);
        let own = [squares[1] + squares[2], squares[0] + squares[2], squares[0] + squares[1]].map(|sum| v * sum / 12.0);
        for mesh_inertia in [MeshInertia::Convex, MeshInertia::Exact, MeshInertia::Legacy] {
            assert_solid(&solid_of(&mesh, mesh_inertia), v, [0.1, 0.15, 0.25], own);
        }
        let shell = solid_of(&mesh, MeshInertia::Shell);
        // Pairs of plates across each axis, half an edge from the centroid; along their own edges, the mean square is a twelfth.
        let [a, b, c] = [0.2, 0.3, 0.5];
        let (x, y, z) = (2.0 * b * c, 2.0 * a * c, 2.0 * a * b);
        let mean = |x_: f64, y_: f64, z_: f64, edge: f64| edge * edge * (x * x_ + y * y_ + z * z_);
        let xx = mean(0.25, 1.0 / 12.0, 1.0 / 12.0, a);
        let yy = mean(1.0 / 12.0, 0.25, 1.0 / 12.0, b);
        let zz = mean(1.0 / 12.0, 1.0 / 12.0, 0.25, c);
        assert_solid(&shell, x + y + z, [0.1, 0.15, 0.25], [yy + zz, xx + zz, xx + yy]);
    }

    /// An L of three squares: its hull has half a square more.
    #[test]
    fn only_the_hull_fills_an_l_shaped_mesh() {
        let corners = [[0.0, 0.0], [0.2, 0.0], [0.2, 0.1], [0.1, 0.1], [0.1, 0.2], [0.0, 0.2]];
        let mesh = prism(&corners, &[[0, 1, 3], [1, 2, 3], [0, 3, 5], [3, 4, 5]], 0.1);
        let exact = solid_of(&mesh, MeshInertia::Exact);
        let square = |x: f64, y: f64| {
            let size = Vec3::repeat(0.1);
            let geometry = crate::machine::Geometry::Box { centre: Vec3::new(x, y, 0.05), size };
            Solid::of(&geometry)
        };
        let parts = [square(0.05, 0.05), square(0.15, 0.05), square(0.05, 0.15)];
        let centre = parts.iter().map(|part| part.centre).sum::<Vec3>() / 3.0;
        let inertia = parts.iter().fold(crate::machine::Mat3::zeros(), |sum, part| {
            let d = part.centre - centre;
            sum + part.inertia() + 1e-3 * (crate::machine::Mat3::identity() * d.norm_squared() - d * d.transpose())
        });
        assert_solid(&exact, 3e-3, centre.into(), inertia.diagonal().into());
        assert!((exact.inertia() - inertia).amax() < 1e-5 * inertia.amax());
        let hull = solid_of(&mesh, MeshInertia::Convex);
        assert!((hull.volume / 3.5e-3 - 1.0).abs() < 1e-6, "{}", hull.volume);
        // Three squares and a triangle with its centroid a third of its edges from the inner corner.
        let x = (3e-3 * centre.x + 0.5e-3 * (0.1 + 0.1 / 3.0)) / 3.5e-3;
        assert!((hull.centre - Vec3::new(x, x, 0.05)).amax() < 1e-6, "{}", hull.centre);
        // The centroid sees the whole surface from inside.
        assert!((solid_of(&mesh, MeshInertia::Legacy).volume / exact.volume - 1.0).abs() < 1e-9);
        let mirrored =
            solid(&mesh, |point| Vec3::new(-point.x, point.y, point.z) * 1e-3, true, MeshInertia::Exact).unwrap();
        assert!((mirrored.volume / exact.volume - 1.0).abs() < 1e-12 && (mirrored.centre.x + centre.x).abs() < 1e-6);
    }

    /// A U of three plates, whose centroid lies outside.
    #[test]
    fn the_pyramids_of_a_deep_channel_overlap() {
        let channel =
            [[0.0, 0.0], [0.3, 0.0], [0.3, 0.3], [0.25, 0.3], [0.25, 0.05], [0.05, 0.05], [0.05, 0.3], [0.0, 0.3]];
        let channel = prism(&channel, &[[0, 1, 4], [0, 4, 5], [1, 2, 4], [2, 3, 4], [0, 5, 6], [0, 6, 7]], 0.1);
        assert!((solid_of(&channel, MeshInertia::Exact).volume / 4e-3 - 1.0).abs() < 1e-6);
        let pyramids = solid_of(&channel, MeshInertia::Legacy);
        // The surface has its centroid at y = 0.125 m. The bases, weighted by their pyramids from there, have theirs at 0.132 m; the
        // centroid of a pyramid is a quarter of the way from its base to its tip.
        let y = 0.75 * 0.132 + 0.25 * 0.125;
        let strip = |edge: f64| edge * edge / 12.0;
        let floor = [strip(0.3), strip(0.05) + (0.025 - y) * (0.025 - y)];
        let arm = [strip(0.05) + 0.125 * 0.125, strip(0.25) + (0.175 - y) * (0.175 - y)];
        // The floor is 3/8 of a cap.
        let cap = [0, 1].map(|i| 0.375 * floor[i] + 0.625 * arm[i]);
        // Faces, m^2, their distances from there, m, and mean squares of x, y and z over them, m^2.
        let faces = [
            (0.03, y, [strip(0.3), y * y, strip(0.1)]),
            (0.06, 0.15, [0.15 * 0.15, strip(0.3) + (0.15 - y) * (0.15 - y), strip(0.1)]),
            (0.01, 0.3 - y, [strip(0.05) + 0.125 * 0.125, (0.3 - y) * (0.3 - y), strip(0.1)]),
            (0.05, 0.1, [0.1 * 0.1, arm[1], strip(0.1)]),
            (0.02, y - 0.05, [strip(0.2), (y - 0.05) * (y - 0.05), strip(0.1)]),
            (0.08, 0.05, [cap[0], cap[1], 0.05 * 0.05]),
        ];
        let volume: f64 = faces.iter().map(|(area, distance, _)| area * distance / 3.0).sum();
        // Over a pyramid, a mean square about its tip is 3/5 of that over its base.
        let second =
            [0, 1, 2].map(|i| faces.iter().map(|(area, distance, mean)| area * distance / 5.0 * mean[i]).sum::<f64>());
        let moments = [second[1] + second[2], second[0] + second[2], second[0] + second[1]];
        assert_solid(&pyramids, volume, [0.15, y, 0.05], moments);
        assert!(volume > 2.0 * 4e-3, "{volume}");
    }

    /// Points of a ball and inside it, in an order without pattern; the hull of the inscribed polyhedron.
    #[test]
    fn the_hull_of_points_of_a_ball_is_almost_a_ball() {
        let n: u32 = 2000;
        let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let points: Vec<Vec3> = (0..n)
            .map(|i| {
                let k = f64::from(i * 761 % n);
                let z = 1.0 - (2.0 * k + 1.0) / f64::from(n);
                let across = (1.0 - z * z).sqrt();
                let point = Vec3::new(across * (golden * k).cos(), across * (golden * k).sin(), z);
                if i % 3 == 0 { 0.5 * point } else { point }
            })
            .collect();
        let faces = hull(&points).unwrap();
        let solid = Solid::of_tetrahedra(faces.iter().map(|face| face.map(|corner| points[corner])));
        let ball = 4.0 / 3.0 * std::f64::consts::PI;
        assert!(solid.volume < ball && solid.volume > 0.98 * ball, "{}", solid.volume);
        // Euler: F = 2 V - 4, with a third of the points inside.
        assert_eq!(faces.len(), 2 * (2 * n as usize / 3) - 4);
        assert!(hull(&points.iter().map(|p| Vec3::new(p.x, p.y, 0.0)).collect::<Vec<_>>()).is_err());
    }

    #[test]
    fn an_open_mesh_has_only_a_hull_and_a_surface() {
        let vertices = vec![[0.0, 0.0, 0.0], [1e3, 0.0, 0.0], [0.0, 1e3, 0.0], [0.0, 0.0, 1e3]];
        let mesh = Mesh::new(vertices, vec![[0, 2, 1], [0, 1, 3], [0, 3, 2]]);
        let hull = solid_of(&mesh, MeshInertia::Convex);
        // A tetrahedron with three perpendicular edges of 1 m: volume 1/6 m^3, mean square of a coordinate about the centroid
        // 3/80 m^2.
        assert_solid(&hull, 1.0 / 6.0, [0.25; 3], [2.0 / 6.0 * 3.0 / 80.0; 3]);
        assert!((solid_of(&mesh, MeshInertia::Shell).volume - 1.5).abs() < 1e-6);
        let fault = solid(&mesh, |point| point, false, MeshInertia::Exact).unwrap_err();
        assert!(fault.contains("it is not closed: its edge from"), "{fault}");
    }
}
