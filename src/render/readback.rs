//! Reading a picture back from the graphics adapter.

use std::sync::{Arc, OnceLock};

use super::{Image, RenderError, wgpu};

/// Buffer for reading back pictures of one size.
pub struct Readback {
    buffer: wgpu::Buffer,
    size: [u32; 2],
    stride: u32,
}

/// Result of a readback; empty until the picture arrives.
pub type PendingReadback = Arc<OnceLock<Result<(), wgpu::BufferAsyncError>>>;

/// Largest side of a picture that the device can draw, pixels.
///
/// # Errors
/// [`RenderError::Size`]: a side is beyond that, or 0.
pub fn check_size(device: &wgpu::Device, [width, height]: [u32; 2]) -> Result<u32, RenderError> {
    let limit = device.limits().max_texture_dimension_2d;
    if (1..=limit).contains(&width) && (1..=limit).contains(&height) {
        return Ok(limit);
    }
    Err(RenderError::Size { width, height, limit })
}

/// Wraps an error of the device as the error of a picture.
pub fn device_error(error: impl ToString) -> RenderError {
    RenderError::Device(error.to_string())
}

impl Readback {
    /// A buffer for pictures of `size`, pixels.
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

    /// Records the copy of `picture`, after drawing.
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

    /// Requests the picture, after the copy was submitted. It arrives while the device is polled.
    pub fn request(&self) -> PendingReadback {
        let arrival = PendingReadback::default();
        let report = arrival.clone();
        self.buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            // The callback runs once.
            let _ = report.set(result);
        });
        arrival
    }

    /// The picture, after it has arrived; the next may then be copied.
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
