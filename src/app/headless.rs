//! Pictures of the interface without a window: the same egui code, painted to a texture.

use eframe::egui::{self, Ui, vec2};
use eframe::egui_wgpu::{
    self, RenderState, RendererOptions, ScreenDescriptor, WgpuConfiguration, WgpuSetup,
};

use std::sync::Arc;

use super::{App, AppOptions, overlay, theme};
use crate::render::{self, Image, NoAdapter, RenderError, wgpu};
use crate::scene::SceneError;
use crate::simulate::StartError;
use crate::view::{DrawList, Theme};

/// Why a picture of the interface could not be made.
#[derive(Debug, thiserror::Error)]
pub enum HeadlessError {
    /// No graphics adapter.
    #[error(transparent)]
    NoAdapter(#[from] NoAdapter),
    /// The scene cannot start.
    #[error(transparent)]
    Start(#[from] SceneError),
    /// The picture cannot be drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
}

/// A frame of the whole application.
#[derive(Clone, Debug)]
pub struct UiFrame {
    /// How the application starts; its theme must not be the system's, of which there is none here.
    pub options: AppOptions,
    /// Simulated time to show, s.
    pub at: f64,
    /// Size of the picture, pixels.
    pub size: [u32; 2],
    /// Pixels per point: 1 on an ordinary screen.
    pub scale: f32,
}

/// What is written over a plain picture.
#[derive(Clone, Debug, Default)]
pub struct Overlay {
    /// Simulated time, s.
    pub time: Option<f64>,
    /// Lines below the time, e.g. [`super::force_notes`].
    pub notes: Vec<String>,
    /// How to read the arrows.
    pub legend: bool,
    /// Names of joints and axes.
    pub labels: bool,
}

/// An egui context and a device without a window.
pub struct Headless {
    state: RenderState,
    ctx: egui::Context,
    time: f64,
}

impl Headless {
    /// Opens the best adapter: a GPU, else software Vulkan, else GL.
    ///
    /// # Errors
    /// No adapter at all.
    pub fn new() -> Result<Self, NoAdapter> {
        let setup = WgpuSetup::CreateNew(egui_wgpu::WgpuSetupCreateNew::without_display_handle());
        let instance = pollster::block_on(setup.new_instance());
        let configuration = WgpuConfiguration {
            wgpu_setup: setup,
            ..Default::default()
        };
        let state = RenderState::create(
            &configuration,
            &instance,
            None,
            RendererOptions::PREDICTABLE,
        );
        let state = pollster::block_on(state).map_err(|error| {
            log::info!("no graphics adapter: {error}");
            NoAdapter
        })?;
        render::install(&state);
        Ok(Self {
            state,
            ctx: egui::Context::default(),
            time: 0.0,
        })
    }

    /// Name of the adapter.
    pub fn adapter(&self) -> String {
        let info = self.state.adapter.get_info();
        format!("{} ({})", info.name, info.backend)
    }

    /// One frame of the whole application with its panels, as `jointplay render --ui` writes it.
    ///
    /// # Errors
    /// A scene that cannot start, a size that cannot be drawn.
    pub fn ui_frame(&mut self, frame: &UiFrame) -> Result<Image, HeadlessError> {
        self.ctx = egui::Context::default();
        let mut app = self
            .app(frame.options.clone())
            .map_err(|error| error.located(&frame.options.scene))?;
        app.run_to(frame.at);
        self.app_frame(&mut app, frame.size, frame.scale)
            .map_err(Into::into)
    }

    /// The application as it stands. It must have been made with this device, see [`Self::app`].
    ///
    /// # Errors
    /// A size that cannot be drawn.
    pub fn app_frame(
        &mut self,
        app: &mut App,
        size: [u32; 2],
        scale: f32,
    ) -> Result<Image, RenderError> {
        // egui settles the size of its panels over a few passes; time stands still meanwhile.
        for _ in 0..3 {
            self.pass(size, scale, |ui| app.show(ui))?;
            app.viewport.advance(&app.player, 10.0);
        }
        let output = self.pass(size, scale, |ui| app.show(ui))?;
        self.paint(output, size, scale)
    }

    /// An application on this device.
    ///
    /// # Errors
    /// A scene that cannot start.
    pub fn app(&self, options: AppOptions) -> Result<App, StartError> {
        App::with_context(&self.ctx, None, options)
    }

    /// A plain picture of `list` at `list.size` with `overlay` written over it; `scale` is pixels per point.
    ///
    /// # Errors
    /// A size that cannot be drawn.
    pub fn picture(
        &mut self,
        list: &Arc<DrawList>,
        overlay: &Overlay,
        theme: Theme,
        scale: f32,
    ) -> Result<Image, RenderError> {
        theme::apply(&self.ctx);
        let mut notes = vec![list.magnification_text.clone()];
        notes.extend_from_slice(&overlay.notes);
        let output = self.pass(list.size, scale, |ui| {
            let rect = ui.max_rect();
            let painter = ui.painter_at(rect);
            painter.add(render::Viewport::shape(rect, list.clone()));
            if overlay.labels {
                overlay::labels(&painter, rect, scale, list);
            }
            if overlay.legend
                && overlay::has_room(rect)
                && let Some(legend) = &list.legend
            {
                overlay::legend(&painter, rect, scale, legend, theme);
            }
            if let Some(time) = overlay.time {
                overlay::time(&painter, rect, time, &notes, theme);
            }
        })?;
        self.paint(output, list.size, scale)
    }

    fn pass(
        &mut self,
        size: [u32; 2],
        scale: f32,
        mut show: impl FnMut(&mut Ui),
    ) -> Result<egui::FullOutput, RenderError> {
        let limit = self.state.device.limits().max_texture_dimension_2d;
        let [width, height] = size;
        if width == 0 || height == 0 || width > limit || height > limit {
            return Err(RenderError::Size {
                width,
                height,
                limit,
            });
        }
        self.time += 1.0 / 60.0;
        let points = vec2(width as f32, height as f32) / scale;
        let mut input = egui::RawInput {
            screen_rect: Some(egui::Rect::from_min_size(egui::Pos2::ZERO, points)),
            time: Some(self.time),
            max_texture_side: Some(limit as usize),
            ..Default::default()
        };
        input
            .viewports
            .entry(egui::ViewportId::ROOT)
            .or_default()
            .native_pixels_per_point = Some(scale);
        let mut output = self.ctx.run_ui(input, |ui| show(ui));
        self.upload(&mut output);
        Ok(output)
    }

    fn upload(&self, output: &mut egui::FullOutput) {
        let mut renderer = self.state.renderer.write();
        for (id, images) in output.textures_delta.set.drain() {
            for image in images {
                renderer.update_texture(&self.state.device, &self.state.queue, id, &image);
            }
        }
        for id in output.textures_delta.free.drain() {
            renderer.free_texture(&id);
        }
    }

    fn paint(
        &mut self,
        output: egui::FullOutput,
        size: [u32; 2],
        scale: f32,
    ) -> Result<Image, RenderError> {
        let (commands, texture) = self.encode(output, size, scale);
        self.state.queue.submit(commands);
        self.read_back(&texture, size)
    }

    /// Everything that one frame of a running window costs the processor but the stepping: interface, draw list,
    /// tessellation, upload and encoded commands. For benchmarks.
    ///
    /// # Errors
    /// A size that cannot be drawn.
    pub fn encode_frame(
        &mut self,
        app: &mut App,
        size: [u32; 2],
        scale: f32,
    ) -> Result<(), RenderError> {
        app.viewport.advance(&app.player, 1.0 / 60.0);
        let output = self.pass(size, scale, |ui| app.show(ui))?;
        let (commands, _) = self.encode(output, size, scale);
        self.state.queue.submit(commands);
        Ok(())
    }

    /// Waits until the device has drawn what was submitted.
    pub fn wait(&self) {
        if let Err(error) = self.state.device.poll(wgpu::PollType::wait_indefinitely()) {
            log::warn!("waiting for the device: {error}");
        }
    }

    fn encode(
        &mut self,
        output: egui::FullOutput,
        size: [u32; 2],
        scale: f32,
    ) -> (Vec<wgpu::CommandBuffer>, wgpu::Texture) {
        let (device, queue) = (&self.state.device, &self.state.queue);
        let screen = ScreenDescriptor {
            pixels_per_point: scale,
            size_in_pixels: size,
        };
        let primitives = self.ctx.tessellate(output.shapes, scale);
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
            label: Some("interface"),
        });
        let mut renderer = self.state.renderer.write();
        let mut commands =
            renderer.update_buffers(device, queue, &mut encoder, &primitives, &screen);
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("interface"),
            size: wgpu::Extent3d {
                width: size[0],
                height: size[1],
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: self.state.target_format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        {
            let mut pass = encoder
                .begin_render_pass(&wgpu::RenderPassDescriptor {
                    label: Some("interface"),
                    color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                        view: &view,
                        resolve_target: None,
                        ops: wgpu::Operations {
                            load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                            store: wgpu::StoreOp::Store,
                        },
                        depth_slice: None,
                    })],
                    ..Default::default()
                })
                .forget_lifetime();
            renderer.render(&mut pass, &primitives, &screen);
        }
        commands.push(encoder.finish());
        (commands, texture)
    }

    fn read_back(
        &self,
        texture: &wgpu::Texture,
        [width, height]: [u32; 2],
    ) -> Result<Image, RenderError> {
        let failed = |error: &dyn std::fmt::Display| RenderError::Device(error.to_string());
        let (device, queue) = (&self.state.device, &self.state.queue);
        let row = width * 4;
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size: u64::from(padded) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(padded),
                    rows_per_image: None,
                },
            },
            texture.size(),
        );
        queue.submit([encoder.finish()]);
        let (sender, receiver) = std::sync::mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            // The receiver is gone only where an earlier failure has been reported already.
            let _ = sender.send(result);
        });
        device
            .poll(wgpu::PollType::wait_indefinitely())
            .map_err(|error| failed(&error))?;
        receiver
            .recv()
            .map_err(|error| failed(&error))?
            .map_err(|error| failed(&error))?;
        let mapped = buffer
            .get_mapped_range(..)
            .map_err(|error| failed(&error))?;
        let mut rgba = Vec::with_capacity((row * height) as usize);
        for line in mapped.chunks(padded as usize) {
            rgba.extend_from_slice(&line[..row as usize]);
        }
        for pixel in rgba.chunks_exact_mut(4) {
            pixel[3] = 255;
        }
        Ok(Image {
            width,
            height,
            rgba,
        })
    }
}
