//! The target a picture is drawn to.

use super::wgpu;

/// Colour of the picture. Not an sRGB format: the shader encodes.
pub(super) const COLOUR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Depth of the picture.
pub(super) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth24Plus;
/// Samples per pixel; every backend supports four.
pub(super) const SAMPLES: u32 = 4;

/// Multisampled colour and depth, and the resolved picture.
pub struct RenderTarget {
    size: [u32; 2],
    pub(super) samples: wgpu::TextureView,
    pub(super) depth: wgpu::TextureView,
    #[cfg_attr(
        target_arch = "wasm32",
        expect(dead_code, reason = "only read back offscreen")
    )]
    pub(super) picture: wgpu::Texture,
    pub(super) picture_view: wgpu::TextureView,
}

impl RenderTarget {
    /// A target of `size` pixels (each at least 1 and at most the device's `max_texture_dimension_2d`).
    pub fn new(device: &wgpu::Device, size: [u32; 2]) -> Self {
        use wgpu::TextureUsages as Usage;
        let texture = |label, format, sample_count, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d {
                    width: size[0],
                    height: size[1],
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            })
        };
        let samples = texture("samples", COLOUR, SAMPLES, Usage::RENDER_ATTACHMENT);
        let depth = texture("depth", DEPTH, SAMPLES, Usage::RENDER_ATTACHMENT);
        let usage = Usage::RENDER_ATTACHMENT | Usage::TEXTURE_BINDING | Usage::COPY_SRC;
        let picture = texture("picture", COLOUR, 1, usage);
        Self {
            size,
            samples: samples.create_view(&Default::default()),
            depth: depth.create_view(&Default::default()),
            picture_view: picture.create_view(&Default::default()),
            picture,
        }
    }

    /// Width and height, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }
}
