//! Picking: a ray from the cursor against the drawn shapes.

use glam::{Vec2, Vec3};
use parry3d::query::Ray;

use super::cast::cast;
use super::joint;
use super::{ScenePart, SceneView, Shot};
use crate::scene::Scene;
use crate::simulate::Frame;

/// Where the cursor's ray first meets the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The part that was hit.
    pub what: ScenePart,
    /// Point of intersection, m, world axes.
    pub point: Vec3,
}

impl SceneView {
    /// Nearest drawn part under `pixel` of the picture described by `shot`, or `None`.
    pub fn pick(&self, shot: &Shot<'_>, pixel: Vec2) -> Option<Hit> {
        let (origin, direction) = shot.camera.ray(pixel, shot.size);
        let ray = Ray::new(origin, direction);
        let m = self.magnification(shot.scene, shot.frame, shot.options);
        let joints = joint::joints(shot.scene, shot.frame, m);
        let parts = self.parts.iter().enumerate().filter_map(|(i, part)| {
            let what = part.body.map_or(ScenePart::Fixed(part.index), ScenePart::Body);
            let distance = cast(&part.place(shot.frame, &joints), &ray)?;
            // Translucent parts do not block picking.
            (self.opacity(i, origin) > 0.6).then_some((distance, what))
        });
        let balls = joints.iter().enumerate().filter_map(|(i, joint)| {
            let distance = joint.cast(&ray, shot.options.sockets)?;
            Some((distance, ScenePart::Joint(i)))
        });
        let (distance, what) = parts.chain(balls).min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(Hit { what, point: ray.point_at(distance) })
    }

    /// Point to follow: a body's origin, a joint's socket or bearing, or where a block is in its guide, m; `None` for fixed shapes.
    pub fn anchor(&self, scene: &Scene, frame: &Frame, part: ScenePart) -> Option<Vec3> {
        match part {
            ScenePart::Body(i) => frame.bodies.get(i).map(|body| super::to_f32(&body.position)),
            ScenePart::Joint(i) => joint::anchor(scene, frame, i),
            ScenePart::Fixed(_) => None,
        }
    }
}
