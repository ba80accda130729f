//! Triangles of the shared meshes.

use std::f32::consts::{PI, TAU};

use crate::view::{Mesh, MeshData};

/// A level of detail of the shared meshes.
pub(super) struct Level {
    /// Sectors around a bar or a sphere.
    pub sectors: u32,
    /// Largest radius on the screen at which no corner shows, pixels.
    pub pixels: f32,
}

/// Levels of detail, the finest first.
pub(super) const LEVELS: [Level; 4] = [level(64, f32::INFINITY), level(32, 18.0), level(16, 4.5), level(8, 1.1)];

const fn level(sectors: u32, pixels: f32) -> Level {
    Level { sectors, pixels }
}

/// The shared meshes, by [`Mesh::index`], with `sectors` sectors around.
pub(super) fn shared(sectors: u32) -> [MeshData; Mesh::SHARED] {
    let stacks = sectors / 2;
    [sphere(sectors, stacks), cylinder(sectors), cone(sectors), cube(), socket(sectors, stacks / 2)]
}

/// Adds a patch: `point(u, v)` for u, v in 0..=1 gives position and normal; u runs around, v from bottom to top, so that
/// (u, v, outward) is right-handed.
fn patch(mesh: &mut MeshData, nu: u32, nv: u32, point: impl Fn(f32, f32) -> ([f32; 4], [f32; 3])) {
    let first = mesh.vertices.len() as u32;
    for j in 0..=nv {
        for i in 0..=nu {
            mesh.vertices.push(point(i as f32 / nu as f32, j as f32 / nv as f32));
        }
    }
    for j in 0..nv {
        for i in 0..nu {
            let a = first + j * (nu + 1) + i;
            let b = a + nu + 1;
            mesh.indices.extend([a, a + 1, b, b, a + 1, b + 1]);
        }
    }
}

/// Point of the unit circle at `u` turns; exactly closed.
fn circle(u: f32) -> (f32, f32) {
    let angle = if u >= 1.0 { 0.0 } else { u * TAU };
    (angle.cos(), angle.sin())
}

/// Point of the unit sphere: `u` turns of azimuth, polar angle `theta` from the south pole.
fn on_sphere(u: f32, theta: f32) -> [f32; 3] {
    let (x, y) = circle(u);
    [theta.sin() * x, theta.sin() * y, -theta.cos()]
}

fn sphere(nu: u32, nv: u32) -> MeshData {
    let mut mesh = MeshData::default();
    patch(&mut mesh, nu, nv, |u, v| {
        let n = on_sphere(u, v * PI);
        ([n[0], n[1], n[2], 0.0], n)
    });
    mesh
}

/// Disc of radius 1 at height `z`, facing up or down.
fn disc(mesh: &mut MeshData, nu: u32, z: f32, up: bool) {
    patch(mesh, nu, 1, |u, v| {
        let (x, y) = circle(u);
        let r = if up { 1.0 - v } else { v };
        ([r * x, r * y, z, 0.0], [0.0, 0.0, if up { 1.0 } else { -1.0 }])
    });
}

fn cylinder(nu: u32) -> MeshData {
    let mut mesh = MeshData::default();
    patch(&mut mesh, nu, 1, |u, v| {
        let (x, y) = circle(u);
        ([x, y, v, 0.0], [x, y, 0.0])
    });
    disc(&mut mesh, nu, 0.0, false);
    disc(&mut mesh, nu, 1.0, true);
    mesh
}

fn cone(nu: u32) -> MeshData {
    let mut mesh = MeshData::default();
    let slope = std::f32::consts::FRAC_1_SQRT_2;
    patch(&mut mesh, nu, 1, |u, v| {
        let (x, y) = circle(u);
        ([x * (1.0 - v), y * (1.0 - v), v, 0.0], [x * slope, y * slope, slope])
    });
    disc(&mut mesh, nu, 0.0, false);
    mesh
}

fn cube() -> MeshData {
    let mut mesh = MeshData::default();
    for axis in 0..3 {
        for sign in [-1.0_f32, 1.0] {
            patch(&mut mesh, 1, 1, |u, v| {
                let mut p = [0.0, 0.0, 0.0, 0.0];
                let mut n = [0.0; 3];
                p[axis] = 0.5 * sign;
                n[axis] = sign;
                p[(axis + 1) % 3] = (u - 0.5) * sign;
                p[(axis + 2) % 3] = v - 0.5;
                (p, n)
            });
        }
    }
    mesh
}

/// Depth of a socket's cut face between its outer and inner edge, in inner radii, so that a ball in front of it stays clear of it.
const CUT: f32 = 0.2;
/// Approximate normal of the cut face, outwards and up.
const CUT_NORMAL: [f32; 2] = [-0.6, 0.8];

/// Half shell, open towards +z: outer face, inner face (fourth coordinate 1), cut face (2 outside, 3 inside). Each is present twice,
/// front and back, in an order that is from far to near for any line of sight.
fn socket(nu: u32, half: u32) -> MeshData {
    let face = |nv: u32, point: &dyn Fn(f32, f32) -> ([f32; 4], [f32; 3])| {
        let mut mesh = MeshData::default();
        patch(&mut mesh, nu, nv, point);
        mesh
    };
    let brim = (-CUT).acos();
    let rim = (1.0 - CUT * CUT).sqrt();
    let outer = face(half, &|u, v| {
        let n = on_sphere(u, v * PI / 2.0);
        ([n[0], n[1], n[2], 0.0], n)
    });
    let inner = face(half, &|u, v| {
        let n = on_sphere(u, (1.0 - v) * (PI - brim));
        ([n[0], n[1], n[2], 1.0], n.map(|x| -x))
    });
    let cut = face(1, &|u, v| {
        let (x, y) = circle(u);
        let (r, z) = if v > 0.0 { (rim, -CUT) } else { (1.0, 0.0) };
        let [out, up] = CUT_NORMAL;
        ([r * x, r * y, z, 2.0 + v], [out * x, out * y, up])
    });
    let mut mesh = MeshData::default();
    for (face, from_behind) in
        [(&outer, true), (&inner, false), (&cut, false), (&cut, true), (&inner, true), (&outer, false)]
    {
        append(&mut mesh, face, from_behind);
    }
    mesh
}

/// Adds a face, or its back.
fn append(mesh: &mut MeshData, face: &MeshData, from_behind: bool) {
    let first = mesh.vertices.len() as u32;
    let side = if from_behind { -1.0 } else { 1.0 };
    let vertices = face.vertices.iter();
    mesh.vertices.extend(vertices.map(|(place, normal)| (*place, normal.map(|x| side * x))));
    for triangle in face.indices.chunks_exact(3) {
        let [a, b, c] = [0, 1, 2].map(|k| first + triangle[k]);
        mesh.indices.extend(if from_behind { [a, c, b] } else { [a, b, c] });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn circles_deviate_by_less_than_a_tenth_of_a_pixel() {
        for level in &LEVELS[1..] {
            let half_side = PI / level.sectors as f32;
            assert!(level.pixels * (1.0 - half_side.cos()) < 0.09);
        }
    }

    #[test]
    fn triangles_wind_counter_clockwise_seen_from_outside() {
        let all = LEVELS.map(|level| shared(level.sectors));
        for (i, mesh) in all.iter().flatten().enumerate() {
            for triangle in mesh.indices.chunks(3) {
                let corner = |k: usize| {
                    let (p, n) = mesh.vertices[triangle[k] as usize];
                    // A socket's inner face and edge, at half the outer radius.
                    let inside = [1.0, 3.0].contains(&p[3]);
                    let scale = if inside { 0.5 } else { 1.0 };
                    (Vec3::new(p[0], p[1], p[2]) * scale, Vec3::from(n))
                };
                let (a, b, c) = (corner(0), corner(1), corner(2));
                let face = (b.0 - a.0).cross(c.0 - a.0);
                let outward = a.1 + b.1 + c.1;
                assert!(face.dot(outward) >= -1e-6, "mesh {i}: a triangle faces inwards");
            }
        }
    }
}
