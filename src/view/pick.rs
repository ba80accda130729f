//! What lies under the cursor.

use glam::{Vec2, Vec3};

use super::{Camera, SceneView, ViewOptions};
use crate::simulate::Frame;

/// A thing that can be hovered or followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Picked {
    /// A body, by index.
    Body(usize),
    /// A ball joint, by index.
    Joint(usize),
    /// A fixed shape, by index.
    Fixed(usize),
}

/// Where the cursor's ray first meets the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// What was met.
    pub what: Picked,
    /// Where, m, world axes.
    pub point: Vec3,
    /// Distance from the eye, m.
    pub distance: f32,
}

impl SceneView {
    /// Nearest drawn thing under `pixel`, or `None`.
    pub fn pick(
        &self,
        _frame: &Frame,
        _options: &ViewOptions,
        _camera: &Camera,
        _pixel: Vec2,
        _size: [u32; 2],
    ) -> Option<Hit> {
        todo!()
    }

    /// Point to follow: a body's origin or a joint's socket centre, m; `None` for fixed shapes.
    pub fn anchor(&self, _frame: &Frame, _picked: Picked) -> Option<Vec3> {
        todo!()
    }
}
