//! Pipelines, buffers, passes.

use super::{Target, wgpu};
use crate::view::DrawList;

/// Draws draw lists; keeps pipelines, meshes and instance buffers between pictures.
pub struct Renderer {}

impl Renderer {
    /// Pipelines and shared meshes on `device`.
    pub fn new(_device: &wgpu::Device) -> Self {
        todo!()
    }

    /// Records the passes that draw `list` to `target`.
    pub fn draw(
        &mut self,
        _device: &wgpu::Device,
        _queue: &wgpu::Queue,
        _encoder: &mut wgpu::CommandEncoder,
        _target: &Target,
        _list: &DrawList,
    ) {
        todo!()
    }
}
