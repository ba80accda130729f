//! Pictures without a window.

use super::{Image, Readback, RenderError, RenderTarget, Renderer, check_size, device_error, wgpu};
use crate::view::DrawList;

/// No graphics adapter on this machine.
#[derive(Clone, Debug, thiserror::Error)]
#[error(
    "no graphics adapter found: install a Vulkan driver (software: Debian and Ubuntu package mesa-vulkan-drivers)"
)]
pub struct NoAdapter;

/// A device without a window, and its renderer.
pub struct Offscreen {
    adapter: wgpu::AdapterInfo,
    device: wgpu::Device,
    queue: wgpu::Queue,
    renderer: Renderer,
    frame: Option<(RenderTarget, Readback)>,
}

impl Offscreen {
    /// Opens the best adapter: a GPU, otherwise software Vulkan, otherwise GL. `WGPU_BACKEND` restricts the choice.
    ///
    /// # Errors
    /// No adapter at all.
    pub fn new() -> Result<Self, NoAdapter> {
        pollster::block_on(Self::open()).ok_or(NoAdapter)
    }

    async fn open() -> Option<Self> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
        descriptor.backends =
            wgpu::Backends::from_env().unwrap_or(wgpu::Backends::PRIMARY | wgpu::Backends::GL);
        let instance = wgpu::Instance::new(descriptor);
        let mut adapters = instance.enumerate_adapters(wgpu::Backends::all()).await;
        // Stable: the backend's own order breaks ties.
        adapters.sort_by_key(|adapter| rank(&adapter.get_info()));
        for adapter in adapters {
            let limits = wgpu::Limits {
                max_texture_dimension_2d: adapter.limits().max_texture_dimension_2d,
                max_buffer_size: adapter.limits().max_buffer_size,
                ..wgpu::Limits::downlevel_webgl2_defaults()
            };
            let opened = adapter
                .request_device(&wgpu::DeviceDescriptor {
                    label: Some("offscreen"),
                    required_limits: limits,
                    ..Default::default()
                })
                .await;
            match opened {
                Ok((device, queue)) => {
                    let renderer = Renderer::new(&device);
                    return Some(Self {
                        adapter: adapter.get_info(),
                        device,
                        queue,
                        renderer,
                        frame: None,
                    });
                }
                Err(error) => log::warn!("{}: {error}", adapter.get_info().name),
            }
        }
        None
    }

    /// Name and backend of the adapter, for the manifest and messages.
    pub fn adapter(&self) -> String {
        format!("{} ({})", self.adapter.name, self.adapter.backend)
    }

    /// Checks a picture size before any work is done.
    ///
    /// # Errors
    /// [`RenderError::Size`].
    pub fn check_size(&self, size: [u32; 2]) -> Result<(), RenderError> {
        check_size(&self.device, size).map(|_| ())
    }

    /// Draws `list` at `list.size`.
    ///
    /// # Errors
    /// A size the device cannot draw, or a lost device.
    pub fn render(&mut self, list: &DrawList) -> Result<Image, RenderError> {
        self.check_size(list.size)?;
        let fits = |frame: &(RenderTarget, Readback)| frame.0.size() == list.size;
        let (target, readback) = match self.frame.take().filter(fits) {
            Some(frame) => frame,
            None => (
                RenderTarget::new(&self.device, list.size),
                Readback::new(&self.device, list.size),
            ),
        };
        let (target, readback) = self.frame.insert((target, readback));
        let mut encoder = self.device.create_command_encoder(&Default::default());
        self.renderer
            .draw(&self.device, &self.queue, &mut encoder, target, list);
        readback.copy(&mut encoder, &target.picture);
        self.queue.submit([encoder.finish()]);
        let arrival = readback.request();
        self.device
            .poll(wgpu::PollType::wait_indefinitely())
            .map_err(device_error)?;
        match arrival.get() {
            Some(Ok(())) => readback.read(),
            Some(Err(reason)) => Err(device_error(reason)),
            None => Err(device_error("the picture never came back")),
        }
    }
}

#[cfg(test)]
impl Offscreen {
    /// Records a picture without submitting it; returns the time taken.
    pub(super) fn record_only(&mut self, list: &DrawList) -> std::time::Duration {
        let target = RenderTarget::new(&self.device, list.size);
        let start = web_time::Instant::now();
        let mut encoder = self.device.create_command_encoder(&Default::default());
        self.renderer
            .draw(&self.device, &self.queue, &mut encoder, &target, list);
        let commands = encoder.finish();
        let spent = start.elapsed();
        self.queue.submit([commands]);
        spent
    }
}

/// Order of preference: hardware over software, Vulkan and its peers over GL.
fn rank(info: &wgpu::AdapterInfo) -> u8 {
    let kind = match info.device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    };
    2 * kind + u8::from(info.backend == wgpu::Backend::Gl)
}
