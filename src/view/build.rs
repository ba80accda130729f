//! Scene and frame to draw list.

use glam::Vec3;

use super::{ArrowMemory, Bounds, Camera, DrawList, ViewOptions};
use crate::scene::Scene;
use crate::simulate::Frame;

/// What the view keeps of a scene: made once for each scene, or when its shapes change.
pub struct SceneView {
    bounds: Bounds,
}

/// One picture: everything [`SceneView::build`] reads.
#[derive(Clone, Copy)]
pub struct Shot<'a> {
    /// The instant.
    pub frame: &'a Frame,
    /// Held forces.
    pub arrows: &'a ArrowMemory,
    /// Choices.
    pub options: &'a ViewOptions,
    /// Point of view.
    pub camera: &'a Camera,
    /// Trail of the probe tip, oldest point first, m, world axes.
    pub trail: &'a [Vec3],
    /// Size of the picture, pixels.
    pub size: [u32; 2],
}

impl SceneView {
    /// Prepares the meshes and bounds of `scene`; `frame` is any frame of it, best the first.
    pub fn new(_scene: &Scene, _frame: &Frame) -> Self {
        todo!()
    }

    /// Ball around everything drawn at the frame given to [`Self::new`].
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Isometric camera that shows the whole scene.
    pub fn camera(&self) -> Camera {
        todo!()
    }

    /// Turns `camera` to a close-up of ball joint `joint`, looking into its opening.
    pub fn close_up(
        &self,
        _camera: &mut Camera,
        _joint: usize,
        _frame: &Frame,
        _options: &ViewOptions,
    ) {
        todo!()
    }

    /// Rebuilds `out` in its own buffers.
    pub fn build(&self, _shot: &Shot<'_>, _out: &mut DrawList) {
        todo!()
    }
}
