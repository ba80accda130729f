//! Pictures without a window.

use super::finish::{Finish, PICTURE, picture};
#[cfg(test)]
use super::target::extent;
use super::{Image, Readback, RenderError, RenderTarget, Renderer, check_size, device_error, wgpu};
use crate::view::DrawList;
#[cfg(test)]
use wgpu::util::DeviceExt as _;

/// No graphics adapter on this machine.
#[derive(Clone, Debug, thiserror::Error)]
#[error("no graphics adapter found: install a Vulkan driver (software: Debian and Ubuntu package mesa-vulkan-drivers)")]
pub struct NoAdapter;

/// A device without a window, and its renderer.
pub struct Offscreen {
    adapter: wgpu::AdapterInfo,
    device: wgpu::Device,
    queue: wgpu::Queue,
    renderer: Renderer,
    finish: Finish,
    frame: Option<Frame>,
}

/// Target and readback buffer for pictures of one size.
struct Frame {
    target: RenderTarget,
    group: wgpu::BindGroup,
    picture: wgpu::Texture,
    readback: Readback,
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
        descriptor.backends = wgpu::Backends::from_env().unwrap_or(wgpu::Backends::PRIMARY | wgpu::Backends::GL);
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
                    let renderer = Renderer::new(&device, &adapter);
                    return Some(Self {
                        finish: renderer.finish(&device, PICTURE),
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
        let frame = self.take_frame(list);
        let frame = self.frame.insert(frame);
        let mut encoder = self.device.create_command_encoder(&Default::default());
        self.renderer.draw(&self.device, &self.queue, &mut encoder, &frame.target, list);
        encode(&self.finish, &mut encoder, &frame.group, &frame.picture);
        let readback = &frame.readback;
        readback.copy(&mut encoder, &frame.picture);
        self.queue.submit([encoder.finish()]);
        let arrival = readback.request();
        self.device.poll(wgpu::PollType::wait_indefinitely()).map_err(device_error)?;
        match arrival.get() {
            Some(Ok(())) => readback.read(),
            Some(Err(reason)) => Err(device_error(reason)),
            None => Err(device_error("the picture could not be read back")),
        }
    }

    /// The stored frame, or a new one if it does not fit `list`.
    fn take_frame(&mut self, list: &DrawList) -> Frame {
        let fits = |frame: &Frame| frame.target.fits(list, list.size);
        if let Some(frame) = self.frame.take().filter(fits) {
            return frame;
        }
        let size = list.size;
        let target = self.renderer.target(&self.device, size, list.quality.samples);
        let picture = picture(&self.device, size);
        Frame {
            group: self.finish.group(&self.device, &target.light),
            target,
            picture,
            readback: Readback::new(&self.device, size),
        }
    }
}

/// Records the last pass, to `picture`.
fn encode(finish: &Finish, encoder: &mut wgpu::CommandEncoder, group: &wgpu::BindGroup, picture: &wgpu::Texture) {
    finish.encode(encoder, group, &picture.create_view(&Default::default()));
}

#[cfg(test)]
impl Offscreen {
    /// Number of triangles that the adapter draws for a picture of `list`, its shadows included.
    pub(super) fn triangles(&mut self, list: &DrawList) -> u64 {
        self.renderer.triangles(list)
    }

    /// Output of the last pass for a row of texels: light, and the share of the theme's colours.
    pub(super) fn finished(&self, texels: &[[f32; 4]]) -> Image {
        // Handles only zero and normal numbers with 11 significant bits.
        let half = |x: &f32| match x.to_bits() {
            0 => 0,
            bits => ((bits >> 13) - (112 << 10)) as u16,
        };
        let halves: Vec<u16> = texels.iter().flatten().map(half).collect();
        let size = [texels.len() as u32, 1];
        let texture = self.device.create_texture_with_data(
            &self.queue,
            &wgpu::TextureDescriptor {
                label: Some("light"),
                size: extent(size),
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgba16Float,
                usage: wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            },
            wgpu::util::TextureDataOrder::LayerMajor,
            bytemuck::cast_slice(&halves),
        );
        let light = texture.create_view(&Default::default());
        let group = self.finish.group(&self.device, &light);
        let (picture, readback) = (picture(&self.device, size), Readback::new(&self.device, size));
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encode(&self.finish, &mut encoder, &group, &picture);
        readback.copy(&mut encoder, &picture);
        self.queue.submit([encoder.finish()]);
        let arrival = readback.request();
        let done = self.device.poll(wgpu::PollType::wait_indefinitely());
        assert!(done.is_ok() && matches!(arrival.get(), Some(Ok(()))));
        readback.read().expect("a picture")
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
