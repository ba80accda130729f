//! Shows the picture inside an egui interface.

use std::sync::Arc;

use eframe::egui;
use eframe::egui_wgpu;

use super::{RenderTarget, Renderer, wgpu};
use crate::view::DrawList;

/// Stored in egui's callback resources.
struct Resources {
    renderer: Renderer,
    blit: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
    shown: Option<(RenderTarget, wgpu::BindGroup)>,
}

/// Creates the renderer and stores it in egui's callback resources. Call once, when the application starts.
pub fn install(state: &egui_wgpu::RenderState) {
    let resources = Resources::new(&state.device, state.target_format);
    state.renderer.write().callback_resources.insert(resources);
}

/// The 3D viewport as an egui paint callback.
///
/// ```ignore
/// let list = Arc::make_mut(&mut self.list); // egui has dropped last frame's clone: no copy is made
/// view.build(&shot, list);                  // shot.size: the rectangle in physical pixels
/// ui.painter().add(Viewport::shape(rect, self.list.clone()));
/// ```
pub struct Viewport {
    list: Arc<DrawList>,
}

impl Viewport {
    /// Shape for `egui::Painter::add`: draws `list` at `list.size` and shows it in `rect`.
    pub fn shape(rect: egui::Rect, list: Arc<DrawList>) -> egui::Shape {
        egui_wgpu::Callback::new_paint_callback(rect, Self { list }).into()
    }
}

impl Resources {
    fn new(device: &wgpu::Device, surface: wgpu::TextureFormat) -> Self {
        let shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("blit.wgsl"),
            source: wgpu::ShaderSource::Wgsl(include_str!("../../shaders/blit.wgsl").into()),
        });
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty,
            count: None,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("blit"),
            entries: &[
                entry(
                    0,
                    wgpu::BindingType::Texture {
                        sample_type: wgpu::TextureSampleType::Float { filterable: true },
                        view_dimension: wgpu::TextureViewDimension::D2,
                        multisampled: false,
                    },
                ),
                entry(
                    1,
                    wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
                ),
            ],
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("blit"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let blit = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("blit"),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module: &shader,
                entry_point: Some("vs_blit"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &shader,
                entry_point: Some(if surface.is_srgb() {
                    "fs_linear"
                } else {
                    "fs_copy"
                }),
                compilation_options: Default::default(),
                targets: &[Some(surface.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("blit"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Self {
            renderer: Renderer::new(device),
            blit,
            layout,
            sampler,
            shown: None,
        }
    }

    fn fit_target(&mut self, device: &wgpu::Device, size: [u32; 2]) {
        // A window can briefly be 0 pixels wide, or wider than the largest texture.
        let limit = device.limits().max_texture_dimension_2d;
        let size = size.map(|n| n.clamp(1, limit));
        if self
            .shown
            .as_ref()
            .is_some_and(|(target, _)| target.size() == size)
        {
            return;
        }
        let target = RenderTarget::new(device, size);
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("blit"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: wgpu::BindingResource::TextureView(&target.picture_view),
                },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::Sampler(&self.sampler),
                },
            ],
        });
        self.shown = Some((target, group));
    }
}

impl egui_wgpu::CallbackTrait for Viewport {
    fn prepare(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        _screen: &egui_wgpu::ScreenDescriptor,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut egui_wgpu::CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        // Without `install` there is no renderer: the rectangle stays empty.
        let Some(resources) = resources.get_mut::<Resources>() else {
            return Vec::new();
        };
        resources.fit_target(device, self.list.size);
        if let Some((target, _)) = &resources.shown {
            resources
                .renderer
                .draw(device, queue, encoder, target, &self.list);
        }
        Vec::new()
    }

    fn paint(
        &self,
        _info: egui::PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        resources: &egui_wgpu::CallbackResources,
    ) {
        let Some(resources) = resources.get::<Resources>() else {
            return;
        };
        let Some((_, group)) = &resources.shown else {
            return;
        };
        pass.set_pipeline(&resources.blit);
        pass.set_bind_group(0, group, &[]);
        pass.draw(0..3, 0..1);
    }
}
