//! A picture in memory, and as a file.

/// Why a picture could not be drawn.
#[derive(Clone, Debug, thiserror::Error)]
pub enum RenderError {
    /// A size of 0 or beyond the device's limit.
    #[error("picture of {width}x{height} pixels: each side must be 1 to {limit} on this graphics adapter")]
    Size {
        /// Requested width.
        width: u32,
        /// Requested height.
        height: u32,
        /// Largest side.
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
    /// Encodes as PNG; `texts` are its keyword and text pairs (`Software`, `Description`, …). Characters beyond Latin-1, which
    /// PNG cannot hold, become `?`.
    ///
    /// # Errors
    /// A keyword that PNG cannot hold.
    pub fn png(&self, texts: &[(&str, &str)]) -> Result<Vec<u8>, png::EncodingError> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let latin = |c: char| if u32::from(c) < 256 { c } else { '?' };
        for (keyword, text) in texts {
            encoder.add_text_chunk((*keyword).to_owned(), text.chars().map(latin).collect())?;
        }
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.rgba)?;
        writer.finish()?;
        Ok(bytes)
    }

    /// Red, green, blue of the pixel in column `x` of row `y`.
    pub fn pixel(&self, x: u32, y: u32) -> [u8; 3] {
        let i = 4 * (y as usize * self.width as usize + x as usize);
        [self.rgba[i], self.rgba[i + 1], self.rgba[i + 2]]
    }
}
