//! Turns a scene at one instant into a plain list of solids, lines and labels. Also has the camera and picking, but no GPU code.
//!
//! Lengths are metres in world axes, f32. The view recomputes no physics: forces, gaps and contact points are
//! those reported by the step. Usage, once per frame:
//!
//! ```ignore
//! let view = SceneView::new(&scene, &first_frame);            // once per scene
//! marks.update(&frame, &peaks, MARK_DURATION * time_scale);   // holds peaks, fades them
//! view.build(&Shot { frame: &frame, marks: &marks, options: &options, camera: &camera, trail: &[], size }, &mut list);
//! ```

mod arrows;
mod attachments;
mod build;
mod camera;
mod cast;
mod cloud;
mod coil;
mod cover;
mod draw_list;
mod drawn;
#[cfg(test)]
pub(crate) mod fixture;
mod ghost;
mod ground;
mod instances;
mod joint;
mod options;
mod peaks;
mod pick;
mod relative;
mod shot;
mod solids;
mod surface;
mod swept;
mod symbols;
#[cfg(test)]
mod tests;
mod theme;
mod wear;
mod zones;

pub use crate::session::link::settings::{ScenePart, WearMap};
pub use arrows::ARROW_LENGTH;
pub use build::SceneView;
pub use camera::{Camera, Preset};
pub use cloud::Cloud;
pub use cover::Cover;
pub use draw_list::{
    Background, DrawList, ErrorScale, Eye, Floor, Instance, Label, LabelKind, Layer, Legend, Light, Line, Mesh,
    MeshData, Tick, WearScale,
};
pub use options::{ArrowOptions, Quality, Scaling, ViewOptions};
pub use peaks::{MARK_DURATION, Mark, PeakMarks};
pub use pick::Hit;
pub use shot::Shot;
pub use swept::Swept;
pub use theme::{Colour, Ghost, GhostLook, Palette, Theme};

/// Converts a physics vector to the view's type.
pub fn to_f32(v: &crate::machine::Vec3) -> glam::Vec3 {
    glam::Vec3::new(v.x as f32, v.y as f32, v.z as f32)
}

/// Bounding sphere of everything drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Centre, m, world axes.
    pub centre: glam::Vec3,
    /// Radius, m.
    pub radius: f32,
}
