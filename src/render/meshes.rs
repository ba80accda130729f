//! Triangles of the shared meshes.

use std::f32::consts::{PI, TAU};

use crate::view::{Mesh, MeshData};

/// How finely the shared meshes are divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Detail {
    /// No corner shows at any size.
    Fine,
    /// For radii of at most [`COARSE_PIXELS`].
    Coarse,
}

/// Radius up to which [`Detail::Coarse`] serves, pixels: its sides lie within 0.08 pixels of the circle.
pub(super) const COARSE_PIXELS: f32 = 4.0;

impl Detail {
    /// Around a bar or a sphere.
    fn sectors(self) -> u32 {
        match self {
            Self::Fine => 64,
            Self::Coarse => 16,
        }
    }

    /// From pole to pole of a sphere.
    fn stacks(self) -> u32 {
        self.sectors() / 2
    }
}

/// The shared meshes, by [`Mesh::index`].
pub(super) fn shared(detail: Detail) -> [MeshData; Mesh::SHARED] {
    let (nu, nv) = (detail.sectors(), detail.stacks());
    [
        sphere(nu, nv),
        cylinder(nu),
        cone(nu),
        cube(),
        socket(nu, nv / 2),
    ]
}

/// Adds a patch: `point(u, v)` for u, v in 0..=1 gives position and normal; u runs around, v from bottom to top, so that
/// (u, v, outward) is right-handed.
fn patch(mesh: &mut MeshData, nu: u32, nv: u32, point: impl Fn(f32, f32) -> ([f32; 4], [f32; 3])) {
    let first = mesh.vertices.len() as u32;
    for j in 0..=nv {
        for i in 0..=nu {
            mesh.vertices
                .push(point(i as f32 / nu as f32, j as f32 / nv as f32));
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
fn on_ball(u: f32, theta: f32) -> [f32; 3] {
    let (x, y) = circle(u);
    [theta.sin() * x, theta.sin() * y, -theta.cos()]
}

fn sphere(nu: u32, nv: u32) -> MeshData {
    let mut mesh = MeshData::default();
    patch(&mut mesh, nu, nv, |u, v| {
        let n = on_ball(u, v * PI);
        ([n[0], n[1], n[2], 0.0], n)
    });
    mesh
}

/// Disc of radius 1 at height `z`, facing up or down.
fn disc(mesh: &mut MeshData, nu: u32, z: f32, up: bool) {
    patch(mesh, nu, 1, |u, v| {
        let (x, y) = circle(u);
        let r = if up { 1.0 - v } else { v };
        (
            [r * x, r * y, z, 0.0],
            [0.0, 0.0, if up { 1.0 } else { -1.0 }],
        )
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
        (
            [x * (1.0 - v), y * (1.0 - v), v, 0.0],
            [x * slope, y * slope, slope],
        )
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

/// Half shell, open towards +z: outer face, inner face (fourth coordinate 1), cut face (2 outside, 3 inside).
fn socket(nu: u32, half: u32) -> MeshData {
    let mut mesh = MeshData::default();
    patch(&mut mesh, nu, half, |u, v| {
        let n = on_ball(u, v * PI / 2.0);
        ([n[0], n[1], n[2], 0.0], n)
    });
    patch(&mut mesh, nu, half, |u, v| {
        let n = on_ball(u, (1.0 - v) * PI / 2.0);
        ([n[0], n[1], n[2], 1.0], n.map(|x| -x))
    });
    patch(&mut mesh, nu, 1, |u, v| {
        let (x, y) = circle(u);
        ([x, y, 0.0, 2.0 + v], [0.0, 0.0, 1.0])
    });
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn a_coarse_circle_keeps_within_a_tenth_of_a_pixel() {
        let half_side = PI / Detail::Coarse.sectors() as f32;
        assert!(COARSE_PIXELS * (1.0 - half_side.cos()) < 0.08);
    }

    #[test]
    fn triangles_wind_counter_clockwise_seen_from_outside() {
        let all = [Detail::Fine, Detail::Coarse].map(shared);
        for (i, mesh) in all.iter().flatten().enumerate() {
            for triangle in mesh.indices.chunks(3) {
                let corner = |k: usize| {
                    let (p, n) = mesh.vertices[triangle[k] as usize];
                    // A socket's inner face and edge, at half the outer radius.
                    let scale = if p[3] == 1.0 || p[3] == 3.0 { 0.5 } else { 1.0 };
                    (Vec3::new(p[0], p[1], p[2]) * scale, Vec3::from(n))
                };
                let (a, b, c) = (corner(0), corner(1), corner(2));
                let face = (b.0 - a.0).cross(c.0 - a.0);
                let outward = a.1 + b.1 + c.1;
                assert!(
                    face.dot(outward) >= -1e-6,
                    "mesh {i}: a triangle faces inwards"
                );
            }
        }
    }
}
