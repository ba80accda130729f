//! What a picture is made of.

use glam::Vec3;

use super::{Camera, PeakMarks, ViewOptions};
use crate::scene::Scene;
use crate::simulate::Frame;

/// One picture: everything [`SceneView::build`](super::SceneView::build) reads.
#[derive(Clone, Copy)]
pub struct Shot<'a> {
    /// The scene as it runs.
    pub scene: &'a Scene,
    /// The instant.
    pub frame: &'a Frame,
    /// Peaks that are over.
    pub marks: &'a PeakMarks,
    /// Choices.
    pub options: &'a ViewOptions,
    /// Point of view.
    pub camera: &'a Camera,
    /// Trail of the probe tip, oldest point first, m, world axes.
    pub trail: &'a [Vec3],
    /// Size of the picture, physical pixels.
    pub size: [u32; 2],
    /// Physical pixels per point of the interface; 1 without one. Scales lines and the triad.
    pub pixels_per_point: f32,
}
