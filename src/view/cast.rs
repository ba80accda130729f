//! Ray casts and distances against placed solids.

use glam::{Quat, Vec3};
use parry3d::math::Pose as ParryPose;
use parry3d::query::{Ray, RayCast};
use parry3d::shape::{Ball, Capsule, Cone, Cuboid, Cylinder, Shape};

use super::solids::{BarKind, Pose, Solid};

/// Distance along `ray` to the solid.
pub(super) fn cast(solid: &Solid<'_>, ray: &Ray) -> Option<f32> {
    with_shape(solid, |shape, pose| shape.cast_ray(pose, ray, f32::MAX, true))?
}

/// Distance from `point` to the solid, 0 inside it.
pub(super) fn distance(solid: &Solid<'_>, point: Vec3) -> Option<f32> {
    with_shape(solid, |shape, pose| shape.distance_to_point(pose, point, true))
}

/// Queries the solid's placed shape; `None` if it has none.
fn with_shape<T>(solid: &Solid<'_>, query: impl FnOnce(&dyn Shape, &ParryPose) -> T) -> Option<T> {
    // parry's iterations need finite numbers.
    let mut finite = true;
    solid.extent(|centre, radius| finite &= centre.is_finite() && radius.is_finite());
    if !finite {
        return None;
    }
    Some(match *solid {
        Solid::Bar { from, to, radius, kind, .. } => {
            let half = from.distance(to) / 2.0;
            if half == 0.0 {
                return None;
            }
            // parry's bars lie along Y.
            let turn = Quat::from_rotation_arc(Vec3::Y, (to - from).normalize_or(Vec3::Y));
            let pose = ParryPose::from_parts((from + to) / 2.0, turn);
            match kind {
                BarKind::Capsule => query(&Capsule::new_y(half, radius), &pose),
                BarKind::Cylinder => query(&Cylinder::new(half, radius), &pose),
                BarKind::Cone => query(&Cone::new(half, radius), &pose),
            }
        }
        Solid::Box { centre, size, rotation } => {
            let pose = ParryPose::from_parts(centre, Quat::from_mat3(&rotation));
            query(&Cuboid::new(size / 2.0), &pose)
        }
        Solid::Ball { centre, radius } => query(&Ball::new(radius), &ParryPose::from_translation(centre)),
        Solid::Mesh { shape, pose: Pose { position, rotation }, .. } => {
            let pose = ParryPose::from_parts(position, Quat::from_mat3(&rotation));
            query(&**shape?, &pose)
        }
    })
}

pub(super) fn cast_ball(centre: Vec3, radius: f32, ray: &Ray) -> Option<f32> {
    Ball::new(radius).cast_ray(&ParryPose::from_translation(centre), ray, f32::MAX, true)
}
