//! Positions relative to the camera's target. Far from the world's origin f32 is too coarse for absolute positions.

use glam::Vec3;

use super::{Camera, Shot, to_f32};
use crate::simulate::Frame;

/// Distance of the target from the origin, in distances from the eye, beyond which positions are measured from it.
const MAX_DISTANCE_RATIO: f32 = 20.0;

/// Frame, camera and trail of a shot, relative to the camera's target.
pub(super) struct RelativeShot {
    frame: Frame,
    camera: Camera,
    trail: Vec<Vec3>,
}

impl RelativeShot {
    /// Converts `shot`; `None` if the target is near enough to the world's origin.
    pub fn of(shot: &Shot<'_>) -> Option<Self> {
        let target = shot.camera.target;
        if !(target.length() > MAX_DISTANCE_RATIO * shot.camera.distance) {
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
    let mut relative = frame.clone();
    relative.origin += origin;
    for body in &mut relative.bodies {
        body.position -= origin;
    }
    for joint in &mut relative.joints {
        joint.socket_centre -= origin;
        joint.ball_centre -= origin;
        joint.contact_point -= origin;
    }
    for site in &mut relative.sites {
        site.contact_point -= origin;
    }
    for report in relative.elements.iter_mut().chain(&mut relative.pull) {
        report.points.iter_mut().for_each(|point| *point -= origin);
    }
    relative
}
