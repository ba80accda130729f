//! Draws a [`crate::view::DrawList`] to a texture with wgpu: the same path in a window, in the browser (WebGPU, WebGL2) and
//! headless.
//!
//! `passes.rs` lists the passes. They write linear light (`target.rs`); the last, `finish.rs`, tone-maps and encodes it.

mod callback;
mod finish;
mod fit;
mod image;
#[cfg(test)]
mod look;
mod meshes;
#[cfg(not(target_arch = "wasm32"))]
mod offscreen;
mod passes;
mod pipelines;
mod readback;
mod renderer;
mod shaders;
mod target;
#[cfg(test)]
mod tests;

pub use callback::{PictureSlot, Viewport, draw_still, install};
pub use eframe::egui_wgpu::wgpu;
pub use image::{Image, RenderError};
#[cfg(not(target_arch = "wasm32"))]
pub use offscreen::{NoAdapter, Offscreen};
pub use readback::{PendingReadback, Readback, check_size, device_error};
pub use renderer::Renderer;
pub use target::RenderTarget;
