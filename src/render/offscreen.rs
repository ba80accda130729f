//! Pictures without a window.

use super::{Image, RenderError, RenderTarget, Renderer, wgpu};
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
    frame: Option<(RenderTarget, wgpu::Buffer)>,
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
    pub fn check_size(&self, [width, height]: [u32; 2]) -> Result<(), RenderError> {
        let limit = self.device.limits().max_texture_dimension_2d;
        let good = 1..=limit;
        if good.contains(&width) && good.contains(&height) {
            Ok(())
        } else {
            Err(RenderError::Size {
                width,
                height,
                limit,
            })
        }
    }

    /// Draws `list` at `list.size`.
    ///
    /// # Errors
    /// A size the device cannot draw, or a lost device.
    pub fn render(&mut self, list: &DrawList) -> Result<Image, RenderError> {
        let [width, height] = list.size;
        self.check_size(list.size)?;
        let stride = (width * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        if self
            .frame
            .as_ref()
            .is_none_or(|(target, _)| target.size() != list.size)
        {
            let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("read back"),
                size: u64::from(stride) * u64::from(height),
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                mapped_at_creation: false,
            });
            self.frame = Some((RenderTarget::new(&self.device, list.size), buffer));
        }
        let Some((target, buffer)) = &self.frame else {
            return Err(RenderError::Device("no target".to_owned()));
        };

        let mut encoder = self.device.create_command_encoder(&Default::default());
        self.renderer
            .draw(&self.device, &self.queue, &mut encoder, target, list);
        encoder.copy_texture_to_buffer(
            target.picture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(stride),
                    rows_per_image: None,
                },
            },
            target.picture.size(),
        );
        self.queue.submit([encoder.finish()]);

        let device_error = |error: &dyn std::fmt::Display| RenderError::Device(error.to_string());
        let mapped = std::sync::Arc::new(std::sync::OnceLock::new());
        let report = mapped.clone();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            let _ = report.set(result);
        });
        self.device
            .poll(wgpu::PollType::wait_indefinitely())
            .map_err(|e| device_error(&e))?;
        match mapped.get() {
            Some(Ok(())) => {}
            Some(Err(error)) => return Err(device_error(error)),
            None => {
                return Err(RenderError::Device(
                    "the picture never came back".to_owned(),
                ));
            }
        }
        let mut rgba = Vec::with_capacity(width as usize * height as usize * 4);
        {
            let rows = buffer.get_mapped_range(..).map_err(|e| device_error(&e))?;
            for row in rows.chunks_exact(stride as usize) {
                rgba.extend_from_slice(&row[..width as usize * 4]);
            }
        }
        buffer.unmap();
        Ok(Image {
            width,
            height,
            rgba,
        })
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
