//! Pictures without a window.

use crate::view::DrawList;

/// No graphics adapter on this machine.
#[derive(Clone, Debug, thiserror::Error)]
#[error(
    "no graphics adapter found: install a Vulkan driver (software: package mesa-vulkan-drivers)"
)]
pub struct NoAdapter;

/// Why a picture could not be drawn.
#[derive(Clone, Debug, thiserror::Error)]
pub enum RenderError {
    /// A size of 0 or beyond the device's limit.
    #[error(
        "picture of {width}x{height} pixels: each side must be 1 to {limit} on this graphics adapter"
    )]
    Size {
        /// Asked width.
        width: u32,
        /// Asked height.
        height: u32,
        /// Greatest side.
        limit: u32,
    },
    /// The device failed while drawing or reading back.
    #[error("the graphics adapter failed: {0}")]
    Device(String),
}

/// 8-bit picture, rows from the top, sRGB-encoded, opaque.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Red, green, blue, opacity for each pixel.
    pub rgba: Vec<u8>,
}

impl Image {
    /// As the bytes of a PNG file.
    pub fn png(&self) -> Vec<u8> {
        todo!()
    }
}

/// A device without a window, with its renderer.
pub struct Offscreen {}

impl Offscreen {
    /// Opens the best adapter: a GPU, else software Vulkan, else GL.
    ///
    /// # Errors
    /// No adapter at all.
    pub fn new() -> Result<Self, NoAdapter> {
        todo!()
    }

    /// Name of the adapter, for the manifest and messages.
    pub fn adapter(&self) -> String {
        todo!()
    }

    /// Checks a picture size before any work is done.
    ///
    /// # Errors
    /// [`RenderError::Size`].
    pub fn check_size(&self, _size: [u32; 2]) -> Result<(), RenderError> {
        todo!()
    }

    /// Draws `list` at `list.size`.
    ///
    /// # Errors
    /// A size the device cannot draw, or a lost device.
    pub fn render(&mut self, _list: &DrawList) -> Result<Image, RenderError> {
        todo!()
    }
}
