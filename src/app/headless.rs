//! Pictures of the interface without a window: the same egui code, painted to a texture.

use eframe::egui;
use eframe::egui_wgpu::{self, RenderState, RendererOptions, WgpuConfiguration, WgpuSetup};

use std::sync::Arc;

use super::canvas::Canvas;
use super::labels::LabelPositions;
use super::overlay::{self, Overlay, Strips};
use super::{App, AppOptions, theme};
use crate::render::{self, Image, NoAdapter, RenderError, wgpu};
use crate::simulate::StartError;
use crate::view::{DrawList, Theme};

/// An egui context and a device without a window.
pub struct Headless {
    canvas: Canvas,
    /// Label positions of the latest picture; the next picture reuses them.
    places: LabelPositions,
}

impl Headless {
    /// Opens the best adapter: a GPU, else software Vulkan, else GL.
    ///
    /// # Errors
    /// There is no adapter.
    pub fn new() -> Result<Self, NoAdapter> {
        let setup = WgpuSetup::CreateNew(egui_wgpu::WgpuSetupCreateNew::without_display_handle());
        let instance = pollster::block_on(setup.new_instance());
        let configuration = WgpuConfiguration { wgpu_setup: setup, ..Default::default() };
        let state = RenderState::create(&configuration, &instance, None, RendererOptions::PREDICTABLE);
        let state = pollster::block_on(state).map_err(|error| {
            log::info!("no graphics adapter: {error}");
            NoAdapter
        })?;
        Ok(Self { canvas: Canvas::new(state), places: LabelPositions::default() })
    }

    /// Name of the adapter.
    pub fn adapter(&self) -> String {
        let info = self.canvas.state().adapter.get_info();
        format!("{} ({})", info.name, info.backend)
    }

    /// The application in its present state. It must have been created on this device, see [`Self::app`].
    ///
    /// # Errors
    /// The size cannot be drawn.
    pub fn app_frame(&mut self, app: &mut App, size: [u32; 2], scale: f32) -> Result<Image, RenderError> {
        // egui needs a few passes to settle panel sizes; time does not advance meanwhile.
        for _ in 0..3 {
            self.canvas.pass(size, scale, |ui| app.show(ui))?;
            app.run.viewport.advance(&app.run.player, 10.0);
        }
        let output = self.canvas.pass(size, scale, |ui| app.show(ui))?;
        self.canvas.paint(output, size, scale).wait()
    }

    /// The egui context of its applications.
    pub fn context(&self) -> &egui::Context {
        &self.canvas.ctx
    }

    /// An application on this device.
    ///
    /// # Errors
    /// The scene fails to start.
    pub fn app(&self, options: AppOptions) -> Result<App, StartError> {
        App::with_context(&self.canvas.ctx, None, options)
    }

    /// A plain picture of `list`, which fills the scene of `strips`, with the text of `overlay`, one pixel per point.
    ///
    /// # Errors
    /// The size cannot be drawn.
    pub fn picture(
        &mut self,
        list: &Arc<DrawList>,
        overlay: &Overlay,
        strips: &Strips,
        theme: Theme,
    ) -> Result<Image, RenderError> {
        theme::apply(&self.canvas.ctx, false);
        let size = strips.top.union(strips.bottom).size();
        let size = [size.x as u32, size.y as u32];
        let output = self.canvas.pass(size, 1.0, |ui| {
            let painter = ui.painter_at(ui.max_rect());
            painter.add(render::Viewport::shape(strips.scene, list.clone()));
            overlay::paint(&painter, strips, 1.0, list, theme, overlay, &mut self.places);
        })?;
        self.canvas.paint(output, size, 1.0).wait()
    }

    /// CPU work of one frame of a running window without stepping: interface, draw list, tessellation, upload and encoded
    /// commands. For benchmarks.
    ///
    /// # Errors
    /// The size cannot be drawn.
    pub fn encode_frame(&mut self, app: &mut App, size: [u32; 2], scale: f32) -> Result<(), RenderError> {
        app.run.viewport.advance(&app.run.player, 1.0 / 60.0);
        let output = self.canvas.pass(size, scale, |ui| app.show(ui))?;
        let (commands, _) = self.canvas.encode(output, size, scale);
        self.canvas.state().queue.submit(commands);
        Ok(())
    }

    /// Waits until the device has finished the submitted work.
    pub fn wait(&self) {
        if let Err(error) = self.canvas.state().device.poll(wgpu::PollType::wait_indefinitely()) {
            log::warn!("waiting for the device: {error}");
        }
    }
}
