//! Frames of an interface painted to a texture and read back: on the device of a window, or without a window.

use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, Waker};

use eframe::egui::mutex::RwLock;
use eframe::egui::{self, Ui, vec2};
use eframe::egui_wgpu::{self, RenderState, RendererOptions, ScreenDescriptor};

use super::theme;
use crate::render::{self, Image, PendingReadback, Readback, RenderError, check_size, device_error, wgpu};

/// Time between two passes, s.
const FRAME: f64 = 1.0 / 60.0;

/// An egui context with a device, without a window.
pub struct Canvas {
    /// The egui context.
    pub ctx: egui::Context,
    /// Time of its last pass, s.
    pub time: f64,
    state: RenderState,
}

impl Canvas {
    /// A canvas that owns `state`.
    pub fn new(state: RenderState) -> Self {
        render::install(&state);
        let ctx = egui::Context::default();
        ctx.set_fonts(theme::fonts());
        Self { ctx, time: 0.0, state }
    }

    /// A canvas on a window's device; it shares no textures or pipelines with the window.
    pub fn beside(window: &RenderState) -> Self {
        // Pixels are read back as RGBA, whatever the window's format.
        let target_format = wgpu::TextureFormat::Rgba8Unorm;
        let renderer = egui_wgpu::Renderer::new(&window.device, target_format, RendererOptions::PREDICTABLE);
        Self::new(RenderState { renderer: Arc::new(RwLock::new(renderer)), target_format, ..window.clone() })
    }

    /// The render state.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn state(&self) -> &RenderState {
        &self.state
    }

    /// One pass over an interface of `size` pixels at `scale` pixels per point.
    ///
    /// # Errors
    /// The size cannot be drawn.
    pub fn pass(
        &mut self,
        size: [u32; 2],
        scale: f32,
        mut show: impl FnMut(&mut Ui),
    ) -> Result<egui::FullOutput, RenderError> {
        let limit = check_size(&self.state.device, size)?;
        self.time += FRAME;
        let points = vec2(size[0] as f32, size[1] as f32) / scale;
        let mut input = egui::RawInput {
            screen_rect: Some(egui::Rect::from_min_size(egui::Pos2::ZERO, points)),
            time: Some(self.time),
            max_texture_side: Some(limit as usize),
            ..Default::default()
        };
        input.viewports.entry(egui::ViewportId::ROOT).or_default().native_pixels_per_point = Some(scale);
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

    /// The commands that draw a pass, and their target texture.
    pub fn encode(
        &mut self,
        output: egui::FullOutput,
        size: [u32; 2],
        scale: f32,
    ) -> (Vec<wgpu::CommandBuffer>, wgpu::Texture) {
        let (device, queue) = (&self.state.device, &self.state.queue);
        let screen = ScreenDescriptor { pixels_per_point: scale, size_in_pixels: size };
        let primitives = self.ctx.tessellate(output.shapes, scale);
        let fill = self.ctx.global_style().visuals.panel_fill;
        let [r, g, b, a] = fill.to_normalized_gamma_f32().map(f64::from);
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("interface") });
        let mut renderer = self.state.renderer.write();
        let mut commands = renderer.update_buffers(device, queue, &mut encoder, &primitives, &screen);
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("interface"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
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
                            load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a }),
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

    /// Draws a pass and starts reading it back.
    pub fn paint(&mut self, output: egui::FullOutput, size: [u32; 2], scale: f32) -> Pending {
        let device = self.state.device.clone();
        // Without these scopes, a picture that exceeds the adapter's memory would abort the program.
        let memory_scope = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validation_scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let (mut commands, texture) = self.encode(output, size, scale);
        let readback = Readback::new(&device, size);
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        readback.copy(&mut encoder, &texture);
        commands.push(encoder.finish());
        self.state.queue.submit(commands);
        let arrival = readback.request();
        let validation_scope = validation_scope.pop();
        let memory_scope = memory_scope.pop();
        Pending { device, readback, arrival, faults: vec![Box::pin(memory_scope), Box::pin(validation_scope)] }
    }
}

type Fault = Pin<Box<dyn Future<Output = Option<wgpu::Error>>>>;

/// A picture being read back from the graphics adapter.
pub struct Pending {
    device: wgpu::Device,
    readback: Readback,
    arrival: PendingReadback,
    /// Error scopes of the device.
    faults: Vec<Fault>,
}

impl Pending {
    /// The picture once it is available; does not block.
    pub fn take(&mut self) -> Option<Result<Image, RenderError>> {
        if let Err(error) = self.device.poll(wgpu::PollType::Poll) {
            return Some(Err(device_error(error)));
        }
        let mut first_error = None;
        self.faults.retain_mut(|fault| {
            let state = fault.as_mut().poll(&mut Context::from_waker(Waker::noop()));
            match state {
                Poll::Pending => true,
                Poll::Ready(error) => {
                    first_error = first_error.take().or(error);
                    false
                }
            }
        });
        if let Some(error) = first_error {
            let reason = match error {
                wgpu::Error::OutOfMemory { .. } => {
                    let [width, height] = self.readback.size();
                    format!("{width}x{height} pixels are more than its memory holds")
                }
                other => other.to_string(),
            };
            return Some(Err(device_error(reason)));
        }
        match self.arrival.get()? {
            Ok(()) if self.faults.is_empty() => Some(self.read()),
            Ok(()) => None,
            Err(reason) => Some(Err(device_error(reason))),
        }
    }

    /// Blocks until the picture is available.
    ///
    /// # Errors
    /// The device fails.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn wait(mut self) -> Result<Image, RenderError> {
        self.device.poll(wgpu::PollType::wait_indefinitely()).map_err(device_error)?;
        let unavailable = || Err(device_error("the picture could not be read back"));
        self.take().unwrap_or_else(unavailable)
    }

    fn read(&self) -> Result<Image, RenderError> {
        let mut image = self.readback.read()?;
        for pixel in image.rgba.chunks_exact_mut(4) {
            pixel[3] = 255;
        }
        Ok(image)
    }
}
