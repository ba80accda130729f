//! Reading a picture back from the graphics adapter.

use std::sync::{Arc, OnceLock};

use super::{Image, RenderError, wgpu};

/// Where a picture of one size is read back.
pub struct Readback {
    buffer: wgpu::Buffer,
    size: [u32; 2],
    stride: u32,
}

/// Whether a picture has come back; empty until then.
pub type Arrival = Arc<OnceLock<Result<(), wgpu::BufferAsyncError>>>;

/// Largest side of a picture that the device can draw, pixels.
///
/// # Errors
/// [`RenderError::Size`]: a side of `size` is beyond that, or 0.
pub fn check_size(device: &wgpu::Device, [width, height]: [u32; 2]) -> Result<u32, RenderError> {
    let limit = device.limits().max_texture_dimension_2d;
    if (1..=limit).contains(&width) && (1..=limit).contains(&height) {
        return Ok(limit);
    }
    Err(RenderError::Size { width, height, limit })
}

/// What the device reports, as the error of a picture.
pub fn device_error(error: impl ToString) -> RenderError {
    RenderError::Device(error.to_string())
}

impl Readback {
    /// For pictures of `size`.
    pub fn new(device: &wgpu::Device, size: [u32; 2]) -> Self {
        let [width, height] = size;
        let stride = (width * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size: u64::from(stride) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        Self { buffer, size, stride }
    }

    /// Size of the picture, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Copies `picture`, once it is drawn.
    pub fn copy(&self, encoder: &mut wgpu::CommandEncoder, picture: &wgpu::Texture) {
        encoder.copy_texture_to_buffer(
            picture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &self.buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(self.stride),
                    rows_per_image: None,
                },
            },
            picture.size(),
        );
    }

    /// Asks for the picture, after the copy was submitted. It comes while the device is polled.
    pub fn request(&self) -> Arrival {
        let arrival = Arrival::default();
        let report = arrival.clone();
        self.buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            // It is reported once.
            let _ = report.set(result);
        });
        arrival
    }

    /// The picture, after it has come; the next may then be copied.
    ///
    /// # Errors
    /// The device fails.
    pub fn read(&self) -> Result<Image, RenderError> {
        let [width, height] = self.size;
        let row = 4 * width as usize;
        let mut rgba = Vec::with_capacity(row * height as usize);
        {
            let rows = self.buffer.get_mapped_range(..).map_err(device_error)?;
            for line in rows.chunks_exact(self.stride as usize) {
                rgba.extend_from_slice(&line[..row]);
            }
        }
        self.buffer.unmap();
        Ok(Image { width, height, rgba })
    }
}
