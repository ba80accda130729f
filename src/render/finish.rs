//! The last pass: light becomes the bytes of a picture.

use super::target::Keeping;
use super::{shaders, wgpu};

/// Tone-maps, encodes and dithers what was drawn.
pub(super) struct Finish {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
}

impl Finish {
    /// To an attachment of format `to`, of what was kept like `keeping`.
    pub fn new(device: &wgpu::Device, keeping: Keeping, to: wgpu::TextureFormat) -> Self {
        let shader = shaders::module(device, &shaders::FINISH);
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("finish"),
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::FRAGMENT,
                ty: wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Float { filterable: false },
                    view_dimension: wgpu::TextureViewDimension::D2,
                    multisampled: false,
                },
                count: None,
            }],
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("finish"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        // A surface of an sRGB format encodes by itself.
        let entry = match (keeping, to.is_srgb()) {
            (Keeping::Linear, false) => "fs_encode",
            (Keeping::Linear, true) => "fs_display",
            (Keeping::Encoded, false) => "fs_copy",
            (Keeping::Encoded, true) => "fs_decode",
        };
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("finish"),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module: &shader,
                entry_point: Some("vs_finish"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &shader,
                entry_point: Some(entry),
                compilation_options: Default::default(),
                targets: &[Some(to.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        Self { pipeline, layout }
    }

    /// What [`Self::draw`] reads.
    pub fn group(&self, device: &wgpu::Device, light: &wgpu::TextureView) -> wgpu::BindGroup {
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("finish"),
            layout: &self.layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(light) }],
        })
    }

    /// Fills the viewport of `pass`.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, group: &wgpu::BindGroup) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, group, &[]);
        pass.draw(0..3, 0..1);
    }
}
