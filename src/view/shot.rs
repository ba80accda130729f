//! The inputs of a picture.

use glam::Vec3;

use super::{Camera, PeakMarks, ViewOptions};
use crate::scene::Scene;
use crate::simulate::Frame;

/// One picture: everything [`SceneView::build`](super::SceneView::build) reads.
#[derive(Clone, Copy)]
pub struct Shot<'a> {
    /// The running scene.
    pub scene: &'a Scene,
    /// The instant.
    pub frame: &'a Frame,
    /// Past peaks.
    pub marks: &'a PeakMarks,
    /// User settings.
    pub options: &'a ViewOptions,
    /// Viewpoint.
    pub camera: &'a Camera,
    /// Trail of the probe tip, oldest point first, m, world axes.
    pub trail: &'a [Vec3],
    /// Size of the picture, physical pixels.
    pub size: [u32; 2],
    /// Physical pixels per point of the interface; 1 without one. Scales lines and the triad.
    pub pixels_per_point: f32,
}
