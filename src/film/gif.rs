//! GIF: each frame holds the rectangle that changed, in its own 256 colours.

use gif::{Encoder, Frame, Repeat};

use super::{Encode, FilmError};

/// Largest frame rate, 1/s: browsers treat delays below 2 hundredths of a second as errors and play such films slowly.
const MAX_RATE: f64 = 50.0;
/// Trade-off of the palette search, 1 (best) to 30.
const SPEED: i32 = 10;

/// A GIF being written.
pub struct Gif {
    encoder: Encoder<Vec<u8>>,
    size: [usize; 2],
    rate: f64,
    frames: u64,
    /// The last frame added.
    previous: Vec<u8>,
    /// The changed rectangle.
    changed: Vec<u8>,
}

/// Width and height, as stored in the file, of a film of `size` pixels with `rate` frames per second.
///
/// # Errors
/// A size or rate beyond the limits of GIF.
pub fn check([width, height]: [u32; 2], rate: f64) -> Result<[u16; 2], FilmError> {
    let beyond_limit = |limit| FilmError::BeyondLimit { width, height, rate, limit };
    if !(rate > 0.0 && rate <= MAX_RATE) {
        return Err(beyond_limit("a GIF shows at most 50 frames a second"));
    }
    match (u16::try_from(width), u16::try_from(height)) {
        (Ok(across), Ok(down)) => Ok([across, down]),
        _ => Err(beyond_limit("an edge of a GIF has at most 65535 pixels")),
    }
}

impl Gif {
    pub fn new(size: [u32; 2], rate: f64) -> Result<Self, FilmError> {
        let [across, down] = check(size, rate)?;
        let mut encoder = Encoder::new(Vec::new(), across, down, &[]).map_err(encoder_error)?;
        encoder.set_repeat(Repeat::Infinite).map_err(encoder_error)?;
        Ok(Self {
            encoder,
            size: size.map(|edge| edge as usize),
            rate,
            frames: 0,
            previous: Vec::new(),
            changed: Vec::new(),
        })
    }

    /// Left, top, width and height of the area that differs from the previous frame; one pixel if none does.
    fn difference(&self, rgba: &[u8]) -> [usize; 4] {
        let [width, height] = self.size;
        if self.previous.is_empty() {
            return [0, 0, width, height];
        }
        let row = 4 * width;
        let mut bounds: Option<[usize; 4]> = None;
        let rows = rgba.chunks_exact(row).zip(self.previous.chunks_exact(row));
        for (y, (now, previous)) in rows.enumerate() {
            if now == previous {
                continue;
            }
            let differs = |x: &usize| now[4 * x..4 * x + 4] != previous[4 * x..4 * x + 4];
            let (Some(first), Some(last)) = ((0..width).find(differs), (0..width).rev().find(differs)) else {
                continue;
            };
            let [left, top, right, _] = bounds.unwrap_or([first, y, last, y]);
            bounds = Some([left.min(first), top, right.max(last), y]);
        }
        let [left, top, right, bottom] = bounds.unwrap_or_default();
        [left, top, right - left + 1, bottom - top + 1]
    }
}

impl Encode for Gif {
    fn add(&mut self, rgba: &[u8]) -> Result<(), FilmError> {
        let [width, height] = self.size;
        assert_eq!(rgba.len(), 4 * width * height, "a frame of the film's size");
        let [left, top, across, down] = self.difference(rgba);
        self.changed.clear();
        for y in top..top + down {
            let from = 4 * (y * width + left);
            self.changed.extend_from_slice(&rgba[from..from + 4 * across]);
        }
        for pixel in self.changed.chunks_exact_mut(4) {
            pixel[3] = 255;
        }
        let mut frame = Frame::from_rgba_speed(across as u16, down as u16, &mut self.changed, SPEED);
        (frame.left, frame.top) = (left as u16, top as u16);
        // Rounding times rather than intervals preserves the pace of the whole film.
        let hundredths = |frames: u64| (100.0 * frames as f64 / self.rate).round();
        frame.delay = (hundredths(self.frames + 1) - hundredths(self.frames)) as u16;
        self.encoder.write_frame(&frame).map_err(encoder_error)?;
        self.frames += 1;
        self.previous.clear();
        self.previous.extend_from_slice(rgba);
        Ok(())
    }

    fn bytes(&self) -> usize {
        self.encoder.get_ref().len()
    }

    fn finish(self: Box<Self>) -> Result<Vec<u8>, FilmError> {
        self.encoder.into_inner().map_err(|error| FilmError::Encoder(error.to_string()))
    }
}

fn encoder_error(error: gif::EncodingError) -> FilmError {
    FilmError::Encoder(error.to_string())
}
