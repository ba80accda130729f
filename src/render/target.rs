//! The target a picture is drawn to.

use super::wgpu;
use crate::view::DrawList;

/// Format of the depth buffer.
pub(super) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth24Plus;
/// Encoding of light between the passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ColorEncoding {
    /// Linear and brighter than white, 16-bit floats: the last pass tone-maps and encodes.
    Linear,
    /// Tone-mapped and encoded by each pass, 8 bits: where the adapter cannot blend or resolve float samples. Encoded colours
    /// are then blended.
    Encoded,
}

impl ColorEncoding {
    /// The encoding that `adapter` supports.
    pub fn supported_by(adapter: &wgpu::Adapter) -> Self {
        Self::with(&adapter.get_texture_format_features(Self::Linear.format()))
    }

    fn with(features: &wgpu::TextureFormatFeatures) -> Self {
        use wgpu::{TextureFormatFeatureFlags as Flags, TextureUsages as Usage};
        let flags = Flags::BLENDABLE | Flags::MULTISAMPLE_X4 | Flags::MULTISAMPLE_RESOLVE;
        let usages = Usage::RENDER_ATTACHMENT | Usage::TEXTURE_BINDING;
        if features.flags.contains(flags) && features.allowed_usages.contains(usages) {
            Self::Linear
        } else {
            Self::Encoded
        }
    }

    /// Format of the samples.
    pub fn format(self) -> wgpu::TextureFormat {
        match self {
            Self::Linear => wgpu::TextureFormat::Rgba16Float,
            Self::Encoded => wgpu::TextureFormat::Rgba8Unorm,
        }
    }
}

/// Colour and depth attachments, and the resolved light.
pub struct RenderTarget {
    size: [u32; 2],
    samples: u32,
    /// Multisampled colour, resolved to `light`; `None`: `light` itself is drawn to.
    pub(super) multisampled: Option<wgpu::TextureView>,
    pub(super) depth: wgpu::TextureView,
    pub(super) light: wgpu::TextureView,
}

impl RenderTarget {
    /// A target of `size` pixels (each at least 1 and at most the device's `max_texture_dimension_2d`) with 1 or 4 samples per
    /// pixel; every backend supports four.
    pub(super) fn new(device: &wgpu::Device, size: [u32; 2], samples: u32, encoding: ColorEncoding) -> Self {
        use wgpu::TextureUsages as Usage;
        let texture = |label, format, sample_count, usage| {
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: extent(size),
                mip_level_count: 1,
                sample_count,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            });
            texture.create_view(&Default::default())
        };
        let (format, drawn) = (encoding.format(), Usage::RENDER_ATTACHMENT);
        Self {
            size,
            samples,
            multisampled: (samples > 1).then(|| texture("samples", format, samples, drawn)),
            depth: texture("depth", DEPTH, samples, drawn),
            light: texture("light", format, 1, drawn | Usage::TEXTURE_BINDING),
        }
    }

    /// Width and height, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Samples per pixel.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Whether it suits `list` at `size` pixels.
    pub(super) fn fits(&self, list: &DrawList, size: [u32; 2]) -> bool {
        (self.size, self.samples) == (size, list.quality.samples)
    }
}

/// A texture's extent for a picture of `size` pixels.
pub(super) fn extent([width, height]: [u32; 2]) -> wgpu::Extent3d {
    wgpu::Extent3d { width, height, depth_or_array_layers: 1 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wgpu::{TextureFormatFeatureFlags as Flags, TextureUsages as Usage};

    #[test]
    fn light_stays_linear_only_where_floats_blend_and_resolve() {
        let all = Flags::BLENDABLE | Flags::MULTISAMPLE_X4 | Flags::MULTISAMPLE_RESOLVE;
        let usages = Usage::RENDER_ATTACHMENT | Usage::TEXTURE_BINDING;
        let of = |flags, allowed_usages| ColorEncoding::with(&wgpu::TextureFormatFeatures { allowed_usages, flags });
        assert_eq!(of(all | Flags::FILTERABLE, usages), ColorEncoding::Linear);
        for missing in all.iter() {
            assert_eq!(of(all - missing, usages), ColorEncoding::Encoded, "{missing:?}");
        }
        for missing in usages.iter() {
            assert_eq!(of(all, usages - missing), ColorEncoding::Encoded, "{missing:?}");
        }
        // WebGL2 without EXT_color_buffer_float.
        assert_eq!(of(Flags::FILTERABLE, Usage::TEXTURE_BINDING), ColorEncoding::Encoded);
    }
}
