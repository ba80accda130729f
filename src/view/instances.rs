//! Placement of meshes and labels.

use std::sync::Arc;

use glam::{Mat3, Quat, Vec2, Vec3};

use super::theme::Material;
use super::{Colour, DrawList, Instance, Label, LabelKind};

/// Instance of a mesh under the linear map `linear`, then moved to `at`.
pub(super) fn placed(linear: Mat3, at: Vec3, material: Material) -> Instance {
    let row = |i: usize| [linear.x_axis[i], linear.y_axis[i], linear.z_axis[i], at[i]];
    Instance {
        world_from_mesh: [row(0), row(1), row(2)],
        colour: material.colour.0,
        roughness: material.roughness,
        metal: material.metal,
        inner_radius: 0.0,
        pad: 0.0,
        other: [0.0; 4],
        touch: [0.0; 4],
    }
}

/// A sphere of `radius` at `at`.
pub(super) fn ball(at: Vec3, radius: f32, material: Material) -> Instance {
    placed(Mat3::from_diagonal(Vec3::splat(radius)), at, material)
}

/// A bar mesh (axis z from 0 to 1) from `from` along `along`.
pub(super) fn bar(from: Vec3, along: Vec3, radius: f32, material: Material) -> Instance {
    let turn = Mat3::from_quat(Quat::from_rotation_arc(Vec3::Z, along.normalize_or(Vec3::Z)));
    placed(turn * Mat3::from_diagonal(Vec3::new(radius, radius, along.length())), from, material)
}

/// Adds a label at `anchor` if that is inside the picture.
pub(super) fn push_label(out: &mut DrawList, text: &Arc<str>, kind: LabelKind, anchor: Vec3, colour: Colour) {
    let Some(pixel) = out.eye.project(anchor, out.size) else {
        return;
    };
    let size = Vec2::new(out.size[0] as f32, out.size[1] as f32);
    if pixel.cmpge(Vec2::ZERO).all() && pixel.cmple(size).all() {
        out.labels.push(Label { text: text.clone(), kind, anchor, pixel, colour });
    }
}
