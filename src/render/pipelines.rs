//! Every pipeline of the picture, and their common layouts.

use std::mem::size_of;

use super::target::{COLOUR, DEPTH, SAMPLES};
use super::wgpu;
use crate::view::{Instance, Line};

/// Format of the shadow map.
pub(super) const SHADOW: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Bytes of a mesh vertex: position with its mark, normal.
pub(super) const VERTEX_BYTES: u64 = 28;

pub(super) struct Pipelines {
    pub globals: wgpu::BindGroupLayout,
    pub shadow: wgpu::BindGroupLayout,
    pub cast_shadow: wgpu::RenderPipeline,
    pub background: wgpu::RenderPipeline,
    pub solid: wgpu::RenderPipeline,
    pub floor: wgpu::RenderPipeline,
    pub line: wgpu::RenderPipeline,
    pub outline: wgpu::RenderPipeline,
    pub faded: wgpu::RenderPipeline,
    pub ghost_depth: wgpu::RenderPipeline,
    pub ghost: wgpu::RenderPipeline,
    pub ghost_edge: wgpu::RenderPipeline,
    pub halo: wgpu::RenderPipeline,
    pub socket_far: wgpu::RenderPipeline,
    pub socket_near: wgpu::RenderPipeline,
    pub wear_behind: wgpu::RenderPipeline,
    pub wear: wgpu::RenderPipeline,
    pub mark_behind: wgpu::RenderPipeline,
    pub mark: wgpu::RenderPipeline,
    pub overlay: wgpu::RenderPipeline,
}

/// What differs between the pipelines.
struct Recipe<'a> {
    label: &'a str,
    vertex: &'a str,
    /// `None` draws depth only, to the shadow map.
    fragment: Option<&'a str>,
    buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    topology: wgpu::PrimitiveTopology,
    cull: Option<wgpu::Face>,
    compare: wgpu::CompareFunction,
    write_depth: bool,
    blend: bool,
    /// Off: depth only.
    colour: bool,
    /// Depth-biased: drawn a little farther away than it is.
    behind: bool,
}

impl Pipelines {
    pub fn new(device: &wgpu::Device) -> Self {
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
                entry(
                    1,
                    wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison),
                ),
            ],
        });

        let shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("scene.wgsl"),
            source: wgpu::ShaderSource::Wgsl(include_str!("../../shaders/scene.wgsl").into()),
        });
        let make = |recipe: Recipe<'_>| pipeline(device, &shader, &globals, &shadow, recipe);

        let vertex = wgpu::vertex_attr_array![0 => Float32x4, 1 => Float32x3];
        let instance = wgpu::vertex_attr_array![
            2 => Float32x4, 3 => Float32x4, 4 => Float32x4, 5 => Float32x4, 6 => Float32x4
        ];
        let meshes = [
            Some(wgpu::VertexBufferLayout {
                array_stride: VERTEX_BYTES,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &vertex,
            }),
            Some(wgpu::VertexBufferLayout {
                array_stride: size_of::<Instance>() as u64,
                step_mode: wgpu::VertexStepMode::Instance,
                attributes: &instance,
            }),
        ];
        let line_ends = wgpu::vertex_attr_array![0 => Float32x4, 1 => Float32x4, 2 => Float32x4, 3 => Float32x4];
        let lines = [Some(wgpu::VertexBufferLayout {
            array_stride: size_of::<Line>() as u64,
            step_mode: wgpu::VertexStepMode::Instance,
            attributes: &line_ends,
        })];

        use wgpu::CompareFunction::{Always, Greater, Less, LessEqual};
        use wgpu::Face::{Back, Front};
        use wgpu::PrimitiveTopology::{TriangleList, TriangleStrip};
        let mesh = |label, vertex, fragment| Recipe {
            label,
            vertex,
            fragment,
            buffers: &meshes,
            topology: TriangleList,
            cull: Some(Back),
            compare: Less,
            write_depth: true,
            blend: false,
            colour: true,
            // Keeps a surface from shadowing itself.
            behind: fragment.is_none(),
        };
        let flat = |label, vertex, fragment, topology| Recipe {
            buffers: &[],
            topology,
            cull: None,
            write_depth: false,
            blend: true,
            ..mesh(label, vertex, Some(fragment))
        };
        let glass = |label, fragment, cull| Recipe {
            cull: Some(cull),
            write_depth: false,
            blend: true,
            ..mesh(label, "vs_mesh", Some(fragment))
        };
        Self {
            cast_shadow: make(mesh("cast shadow", "vs_shadow", None)),
            background: make(Recipe {
                compare: Always,
                blend: false,
                ..flat("background", "vs_background", "fs_background", TriangleList)
            }),
            solid: make(mesh("solid", "vs_mesh", Some("fs_solid"))),
            floor: make(flat("floor", "vs_floor", "fs_floor", TriangleStrip)),
            line: make(Recipe {
                buffers: &lines,
                ..flat("line", "vs_line", "fs_line", TriangleStrip)
            }),
            outline: make(Recipe {
                buffers: &lines,
                compare: Always,
                ..flat("outline", "vs_line", "fs_line", TriangleStrip)
            }),
            faded: make(glass("faded", "fs_solid", Back)),
            // Only its nearest surface is visible: its own back parts would show through in patches.
            ghost_depth: make(Recipe {
                colour: false,
                ..mesh("ghost, depth", "vs_ghost", Some("fs_ghost"))
            }),
            ghost: make(Recipe {
                vertex: "vs_ghost",
                // The same vertices as in the depth pass.
                compare: LessEqual,
                ..glass("ghost", "fs_ghost", Back)
            }),
            ghost_edge: make(Recipe {
                cull: Some(Front),
                blend: true,
                ..mesh("ghost, outline", "vs_ghost_edge", Some("fs_ghost_edge"))
            }),
            halo: make(glass("halo", "fs_halo", Back)),
            socket_far: make(glass("socket, far side", "fs_socket", Front)),
            socket_near: make(glass("socket, near side", "fs_socket", Back)),
            wear_behind: make(Recipe {
                cull: None,
                compare: Always,
                write_depth: false,
                blend: true,
                ..mesh("wear behind others", "vs_mesh", Some("fs_wear_behind"))
            }),
            wear: make(mesh("wear", "vs_mesh", Some("fs_wear"))),
            mark_behind: make(Recipe {
                compare: Greater,
                write_depth: false,
                blend: true,
                ..mesh("mark behind others", "vs_mesh", Some("fs_mark_behind"))
            }),
            mark: make(mesh("mark", "vs_mesh", Some("fs_mark"))),
            overlay: make(mesh("overlay", "vs_overlay", Some("fs_mark"))),
            globals,
            shadow,
        }
    }
}

fn pipeline(
    device: &wgpu::Device,
    shader: &wgpu::ShaderModule,
    globals: &wgpu::BindGroupLayout,
    shadow: &wgpu::BindGroupLayout,
    recipe: Recipe<'_>,
) -> wgpu::RenderPipeline {
    // The shadow map cannot be read while being drawn.
    let both = [Some(globals), Some(shadow)];
    let groups = if recipe.fragment.is_some() {
        &both[..]
    } else {
        &both[..1]
    };
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(recipe.label),
        bind_group_layouts: groups,
        immediate_size: 0,
    });
    let casts_shadow = recipe.fragment.is_none();
    let colour = [Some(wgpu::ColorTargetState {
        format: COLOUR,
        blend: recipe.blend.then_some(wgpu::BlendState::ALPHA_BLENDING),
        write_mask: if recipe.colour {
            wgpu::ColorWrites::ALL
        } else {
            wgpu::ColorWrites::empty()
        },
    })];
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(recipe.label),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: shader,
            entry_point: Some(recipe.vertex),
            compilation_options: Default::default(),
            buffers: recipe.buffers,
        },
        primitive: wgpu::PrimitiveState {
            topology: recipe.topology,
            cull_mode: recipe.cull,
            ..Default::default()
        },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: if casts_shadow { SHADOW } else { DEPTH },
            depth_write_enabled: Some(recipe.write_depth),
            depth_compare: Some(recipe.compare),
            stencil: Default::default(),
            bias: if recipe.behind {
                wgpu::DepthBiasState {
                    constant: 2,
                    slope_scale: 2.0,
                    clamp: 0.0,
                }
            } else {
                Default::default()
            },
        }),
        multisample: wgpu::MultisampleState {
            count: if casts_shadow { 1 } else { SAMPLES },
            ..Default::default()
        },
        fragment: recipe.fragment.map(|entry| wgpu::FragmentState {
            module: shader,
            entry_point: Some(entry),
            compilation_options: Default::default(),
            targets: &colour,
        }),
        multiview_mask: None,
        cache: None,
    })
}
