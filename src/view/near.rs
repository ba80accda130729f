//! Far from the world's origin f32 is too coarse for a machine: positions are then measured from the camera's target.

use glam::Vec3;

use super::{Camera, Shot, to_f32};
use crate::simulate::Frame;

/// Distance of the target from the origin, in distances from the eye, beyond which positions are measured from it.
const FAR: f32 = 20.0;

/// A shot's frame, camera and trail measured from the camera's target.
pub(super) struct Near {
    frame: Frame,
    camera: Camera,
    trail: Vec<Vec3>,
}

impl Near {
    /// `None` if the world's origin is near enough.
    pub fn of(shot: &Shot<'_>) -> Option<Self> {
        let target = shot.camera.target;
        if !(target.length() > FAR * shot.camera.distance) {
            return None;
        }
        let mut camera = *shot.camera;
        camera.target = Vec3::ZERO;
        Some(Self {
            frame: frame_from(shot.frame, target),
            camera,
            trail: shot.trail.iter().map(|point| point - target).collect(),
        })
    }

    /// `shot` measured from the camera's target.
    pub fn shot<'a>(&'a self, shot: &Shot<'a>) -> Shot<'a> {
        Shot { frame: &self.frame, camera: &self.camera, trail: &self.trail, ..*shot }
    }

    /// Another frame of the same scene, measured from the camera's target.
    pub fn frame(&self, frame: &Frame) -> Frame {
        frame_from(frame, to_f32(&self.frame.origin))
    }
}

/// `frame` measured from `origin`, world axes, m.
fn frame_from(frame: &Frame, origin: Vec3) -> Frame {
    let [x, y, z] = origin.to_array().map(f64::from);
    let origin = crate::machine::Vec3::new(x, y, z);
    let mut near = frame.clone();
    near.origin += origin;
    for body in &mut near.bodies {
        body.position -= origin;
    }
    for joint in &mut near.joints {
        joint.socket_centre -= origin;
        joint.ball_centre -= origin;
        joint.contact_point -= origin;
    }
    for report in near.elements.iter_mut().chain(&mut near.pull) {
        report.points.iter_mut().for_each(|point| *point -= origin);
    }
    near
}
