//! Placed parts, and their instances of meshes.

use glam::{Mat3, Vec3};
use parry3d::shape::SharedShape;

use super::instances::{self, bar, placed};
use super::theme::Material;
use super::{Layer, Mesh, to_f32};
use crate::machine;
use crate::simulate::{BodyMotion, Frame};

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum BarKind {
    Capsule,
    Cylinder,
    Cone,
}

/// A placed part, world axes.
pub(super) enum Solid<'a> {
    /// `has_cap[i]`: whether end i of a capsule shows its hemisphere.
    Bar {
        from: Vec3,
        to: Vec3,
        radius: f32,
        kind: BarKind,
        has_cap: [bool; 2],
    },
    Box {
        centre: Vec3,
        size: Vec3,
        rotation: Mat3,
    },
    Ball {
        centre: Vec3,
        radius: f32,
    },
    Mesh {
        mesh: Mesh,
        shape: Option<&'a SharedShape>,
        points: &'a [Vec3],
        pose: Pose,
    },
}

/// Pose of a body frame.
#[derive(Clone, Copy)]
pub(super) struct Pose {
    pub position: Vec3,
    pub rotation: Mat3,
}

impl Pose {
    pub const WORLD: Self = Self { position: Vec3::ZERO, rotation: Mat3::IDENTITY };

    pub fn new(position: &machine::Vec3, rotation: &machine::Mat3) -> Self {
        let column = |i: usize| to_f32(&rotation.column(i).into_owned());
        Self { position: to_f32(position), rotation: Mat3::from_cols(column(0), column(1), column(2)) }
    }

    fn of_body(motion: &BodyMotion) -> Self {
        Self::new(&motion.position, &motion.rotation)
    }

    /// World pose of `inner`, which is given in this frame.
    pub fn compose(&self, inner: &Self) -> Self {
        Self { position: self.apply(inner.position), rotation: self.rotation * inner.rotation }
    }

    pub fn in_frame(frame: &Frame, body: Option<usize>) -> Self {
        let world = Self { position: -to_f32(&frame.origin), ..Self::WORLD };
        body.and_then(|b| frame.bodies.get(b)).map_or(world, Self::of_body)
    }

    pub fn apply(&self, point: Vec3) -> Vec3 {
        self.position + self.rotation * point
    }
}

impl Solid<'_> {
    /// Calls `visit` with spheres (centre, radius) whose convex hull contains the solid: for bounds.
    pub fn extent(&self, mut visit: impl FnMut(Vec3, f32)) {
        match self {
            Solid::Bar { from, to, radius, .. } => [from, to].into_iter().for_each(|&p| visit(p, *radius)),
            Solid::Box { centre, size, rotation } => {
                for i in 0..8 {
                    let sign = |bit: u32| if i >> bit & 1 == 1 { 0.5 } else { -0.5 };
                    visit(*centre + *rotation * (*size * Vec3::new(sign(0), sign(1), sign(2))), 0.0);
                }
            }
            Solid::Ball { centre, radius } => visit(*centre, *radius),
            Solid::Mesh { points, pose, .. } => points.iter().for_each(|&p| visit(pose.apply(p), 0.0)),
        }
    }
}

/// Adds `solid`, made of `material`, to `layer`.
pub(super) fn push_solid(layer: &mut Layer, solid: &Solid<'_>, material: Material) {
    match *solid {
        Solid::Bar { from, to, radius, kind, has_cap } => {
            if from == to {
                return;
            }
            let mesh = if kind == BarKind::Cone { Mesh::Cone } else { Mesh::Cylinder };
            layer.push(mesh, bar(from, to - from, radius, material));
            if kind == BarKind::Capsule {
                for (end, _) in [from, to].into_iter().zip(has_cap).filter(|(_, has_cap)| *has_cap) {
                    layer.push(Mesh::Sphere, instances::ball(end, radius, material));
                }
            }
        }
        Solid::Box { centre, size, rotation } => {
            layer.push(Mesh::Cube, placed(rotation * Mat3::from_diagonal(size), centre, material));
        }
        Solid::Ball { centre, radius } => layer.push(Mesh::Sphere, instances::ball(centre, radius, material)),
        Solid::Mesh { mesh, pose, .. } => layer.push(mesh, placed(pose.rotation, pose.position, material)),
    }
}
