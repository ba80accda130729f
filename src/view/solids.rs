//! Placed parts as instances of meshes.

use glam::Mat3;

use super::drawn::{BarKind, Solid};
use super::instances::{self, bar, placed};
use super::theme::Material;
use super::{Layer, Mesh};

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
