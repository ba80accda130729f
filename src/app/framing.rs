//! Camera that just shows what is drawn: tighter than a ball around it.

use glam::Vec3;

use crate::view::{Camera, DrawList, Instance, Mesh};

/// Part of the picture that is filled.
const FILLED: f32 = 0.80;

/// Moves `camera`, its direction kept, so that the solid things and sockets of `list` fill a picture of `size`.
pub fn frame(camera: &mut Camera, list: &DrawList, size: [u32; 2]) {
    let corners = corners(list);
    let aspect = size[0] as f32 / size[1].max(1) as f32;
    let half = (camera.field_of_view / 2.0).tan();
    // Shifting changes the perspective a little: a few rounds settle it.
    for _ in 0..4 {
        let (right, up, back) = camera.axes();
        let eye = camera.eye();
        let (mut least, mut greatest) = (Vec3::splat(f32::MAX), Vec3::splat(f32::MIN));
        for corner in &corners {
            let seen = *corner - eye;
            let depth = (-seen.dot(back)).max(1e-3 * camera.distance);
            let at = Vec3::new(
                seen.dot(right) / (depth * half * aspect),
                seen.dot(up) / (depth * half),
                depth,
            );
            least = least.min(at);
            greatest = greatest.max(at);
        }
        let extent = (greatest - least) / 2.0;
        if !(extent.x.is_finite() && extent.y.is_finite()) || extent.x.max(extent.y) < 1e-6 {
            return;
        }
        let middle = (greatest + least) / 2.0;
        let reach = camera.distance * half;
        camera.target += right * (middle.x * reach * aspect) + up * (middle.y * reach);
        camera.distance *= extent.x.max(extent.y) / FILLED;
    }
}

/// Corners of a box around each instance, m, world axes.
fn corners(list: &DrawList) -> Vec<Vec3> {
    let mut corners = Vec::new();
    for (index, instances) in list.solid.by_mesh.iter().enumerate() {
        let (least, greatest) = extent(list, index);
        for instance in instances {
            push_box(&mut corners, instance, least, greatest);
        }
    }
    for socket in &list.sockets {
        push_box(&mut corners, socket, Vec3::NEG_ONE, Vec3::ONE);
    }
    corners
}

/// Box around a mesh in its own frame.
fn extent(list: &DrawList, index: usize) -> (Vec3, Vec3) {
    let half = Vec3::splat(0.5);
    match index {
        i if i == Mesh::Cylinder.index() || i == Mesh::Cone.index() => {
            (Vec3::new(-1.0, -1.0, 0.0), Vec3::ONE)
        }
        i if i == Mesh::Cube.index() => (-half, half),
        i if i < Mesh::SHARED => (Vec3::NEG_ONE, Vec3::ONE),
        i => match list.plates.get(i - Mesh::SHARED) {
            Some(plate) => plate.vertices.iter().fold(
                (Vec3::splat(f32::MAX), Vec3::splat(f32::MIN)),
                |(least, greatest), (position, _)| {
                    let point = Vec3::new(position[0], position[1], position[2]);
                    (least.min(point), greatest.max(point))
                },
            ),
            None => (-half, half),
        },
    }
}

fn push_box(corners: &mut Vec<Vec3>, instance: &Instance, least: Vec3, greatest: Vec3) {
    for pick in 0..8 {
        let choose = |bit: usize, axis: usize| {
            if pick & bit == 0 {
                least[axis]
            } else {
                greatest[axis]
            }
        };
        let p = Vec3::new(choose(1, 0), choose(2, 1), choose(4, 2)).extend(1.0);
        let [x, y, z] = instance
            .world_from_mesh
            .map(|row| glam::Vec4::from(row).dot(p));
        corners.push(Vec3::new(x, y, z));
    }
}
