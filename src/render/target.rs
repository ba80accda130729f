//! Where a picture is drawn.

use super::wgpu;

/// Multisampled colour and depth, and the resolved picture.
pub struct Target {
    size: [u32; 2],
}

impl Target {
    /// A target of `size` pixels (each at least 1 and at most the device's `max_texture_dimension_2d`).
    pub fn new(_device: &wgpu::Device, _size: [u32; 2]) -> Self {
        todo!()
    }

    /// Width and height, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }
}
