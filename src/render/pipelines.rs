//! The pipeline of every pass, and their common layouts.

use std::mem::size_of;
use std::sync::OnceLock;

use super::passes::{Blend, PASSES, Pass, PassContent};
use super::shaders;
use super::target::{ColorEncoding, DEPTH};
use super::wgpu;
use crate::view::{Instance, Line};

/// Format of the shadow map.
pub(super) const SHADOW: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Bytes of a mesh vertex: position with its mark, normal.
pub(super) const VERTEX_BYTES: u64 = 28;

pub(super) struct Pipelines {
    pub globals: wgpu::BindGroupLayout,
    pub shadow: wgpu::BindGroupLayout,
    shader: wgpu::ShaderModule,
    encoding: ColorEncoding,
    /// Pipelines by pass, for one sample per pixel and for several.
    passes: [[OnceLock<wgpu::RenderPipeline>; PASSES.len()]; 2],
}

impl Pipelines {
    pub fn new(device: &wgpu::Device, encoding: ColorEncoding) -> Self {
        let globals = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("globals"),
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            }],
        });
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty,
            count: None,
        };
        let shadow = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("shadow"),
            entries: &[
                entry(
                    0,
                    wgpu::BindingType::Texture {
                        sample_type: wgpu::TextureSampleType::Depth,
                        view_dimension: wgpu::TextureViewDimension::D2,
                        multisampled: false,
                    },
                ),
                entry(1, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison)),
            ],
        });
        let module = match encoding {
            ColorEncoding::Linear => shaders::LINEAR,
            ColorEncoding::Encoded => shaders::ENCODED,
        };
        Self {
            globals,
            shadow,
            shader: shaders::module(device, &module),
            encoding,
            passes: [const { [const { OnceLock::new() }; PASSES.len()] }; 2],
        }
    }

    /// The pipeline of `PASSES[index]`, created on first use; `samples` is 4 or 1.
    pub fn pass(&self, device: &wgpu::Device, samples: u32, index: usize) -> &wgpu::RenderPipeline {
        let make = || pipeline(device, self, samples, &PASSES[index]);
        self.passes[usize::from(samples > 1)][index].get_or_init(make)
    }

    /// Creates the next pipeline not used yet, so that a later picture need not wait for it.
    pub fn create_next(&self, device: &wgpu::Device, samples: u32) {
        let slots = &self.passes[usize::from(samples > 1)];
        if let Some(index) = slots.iter().position(|slot| slot.get().is_none()) {
            self.pass(device, samples, index);
        }
    }
}

fn pipeline(device: &wgpu::Device, common: &Pipelines, samples: u32, pass: &Pass) -> wgpu::RenderPipeline {
    let Pipelines { globals, shadow, shader, encoding, .. } = common;
    let vertex = wgpu::vertex_attr_array![0 => Float32x4, 1 => Float32x3];
    let instance = wgpu::vertex_attr_array![
        2 => Float32x4, 3 => Float32x4, 4 => Float32x4, 5 => Float32x4, 6 => Float32x4, 7 => Float32x4, 8 => Float32x4
    ];
    let line_ends = wgpu::vertex_attr_array![0 => Float32x4, 1 => Float32x4, 2 => Float32x4, 3 => Float32x4];
    let buffer =
        |stride, step_mode, attributes| Some(wgpu::VertexBufferLayout { array_stride: stride, step_mode, attributes });
    use wgpu::VertexStepMode as Step;
    let meshes = [
        buffer(VERTEX_BYTES, Step::Vertex, &vertex[..]),
        buffer(size_of::<Instance>() as u64, Step::Instance, &instance[..]),
    ];
    let lines = [buffer(size_of::<Line>() as u64, Step::Instance, &line_ends[..])];
    use wgpu::PrimitiveTopology::{TriangleList, TriangleStrip};
    let (buffers, topology) = match pass.draws {
        PassContent::FullScreen => (&[][..], TriangleList),
        PassContent::Floor => (&[][..], TriangleStrip),
        PassContent::Lines | PassContent::Marks => (&lines[..], TriangleStrip),
        PassContent::Meshes(_) => (&meshes[..], TriangleList),
    };
    // The shadow map cannot be read while being drawn.
    let both = [Some(globals), Some(shadow)];
    let groups = if pass.is_shadow_pass() { &both[..1] } else { &both[..] };
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(pass.label),
        bind_group_layouts: groups,
        immediate_size: 0,
    });
    let colour = [Some(wgpu::ColorTargetState {
        format: encoding.format(),
        blend: pass.blend_state(),
        write_mask: match pass.blend {
            Blend::Nothing => wgpu::ColorWrites::empty(),
            _ => wgpu::ColorWrites::ALL,
        },
    })];
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(pass.label),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: shader,
            entry_point: Some(pass.vertex),
            compilation_options: Default::default(),
            buffers,
        },
        primitive: wgpu::PrimitiveState { topology, cull_mode: pass.cull, ..Default::default() },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: if pass.is_shadow_pass() { SHADOW } else { DEPTH },
            depth_write_enabled: Some(pass.write_depth),
            depth_compare: Some(pass.compare),
            stencil: Default::default(),
            // A little farther away than it is: keeps a surface from shadowing itself.
            bias: if pass.is_shadow_pass() {
                wgpu::DepthBiasState { constant: 2, slope_scale: 2.0, clamp: 0.0 }
            } else {
                Default::default()
            },
        }),
        multisample: wgpu::MultisampleState {
            count: if pass.is_shadow_pass() { 1 } else { samples },
            ..Default::default()
        },
        fragment: pass.fragment.map(|entry| wgpu::FragmentState {
            module: shader,
            entry_point: Some(entry),
            compilation_options: Default::default(),
            targets: &colour,
        }),
        multiview_mask: None,
        cache: None,
    })
}
