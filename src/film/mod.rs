//! Encodes frames as a film, MP4 with H.264 or GIF. Everything stays in memory, so that a cancelled film leaves nothing behind
//! and the page makes films as the program does. This module knows no mechanism and needs no display.

mod gif;
mod h264;
mod mp4;

use crate::words::words;

/// Size limit of a film, bytes, which fits in the memory of a page.
const MAX_BYTES: usize = 1 << 30;

/// Kind of file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FilmFormat {
    /// H.264 in MP4: plays everywhere, with exact times.
    #[default]
    Mp4,
    /// GIF: plays by itself in slides and pages; 256 colours a frame, times in whole hundredths of a second.
    Gif,
}

words!(FilmFormat {
    Mp4 => "mp4",
    Gif => "gif",
});

impl FilmFormat {
    /// The format by the extension of a file name.
    pub fn of_name(name: &str) -> Option<Self> {
        let (_, ending) = name.rsplit_once('.')?;
        let ending = ending.to_ascii_lowercase();
        Self::ALL.into_iter().find(|format| format.word() == ending)
    }

    /// Checks that the format can hold a film of `size` pixels with `rate` frames per second.
    ///
    /// # Errors
    /// The reason if it cannot.
    pub fn check(self, size: [u32; 2], rate: f64) -> Result<(), FilmError> {
        match self {
            Self::Mp4 => h264::check(size, rate).map(drop),
            Self::Gif => gif::check(size, rate).map(drop),
        }
    }

    /// Media type.
    pub fn mime(self) -> &'static str {
        match self {
            Self::Mp4 => "video/mp4",
            Self::Gif => "image/gif",
        }
    }
}

/// Why a film cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FilmError {
    /// H.264 halves the resolution of colours.
    #[error("a film of {width}x{height} pixels: width and height of an MP4 must be even")]
    Odd {
        /// Requested width.
        width: u32,
        /// Requested height.
        height: u32,
    },
    /// More than any level of H.264 allows, or than GIF can represent.
    #[error("a film of {width}x{height} pixels with {rate} frames a second: {limit}")]
    BeyondLimit {
        /// Requested width.
        width: u32,
        /// Requested height.
        height: u32,
        /// Frames per second.
        rate: f64,
        /// What is allowed, in words.
        limit: &'static str,
    },
    /// The file grows beyond 1 GiB.
    #[error("the film is larger than {} MB; make it shorter, smaller or with fewer frames a second", MAX_BYTES >> 20)]
    TooLong,
    /// No frame was added.
    #[error("a film needs at least one frame")]
    Empty,
    /// The encoder or muxer failed, a bug in it or in this program.
    #[error("the film cannot be encoded: {0}")]
    Encoder(String),
}

/// Encoder of one file format.
trait Encode {
    /// Appends a frame: rows from the top, red, green, blue, opacity (ignored), sRGB-encoded.
    fn add(&mut self, rgba: &[u8]) -> Result<(), FilmError>;

    /// Approximate size so far, bytes.
    fn bytes(&self) -> usize;

    /// The complete file.
    fn finish(self: Box<Self>) -> Result<Vec<u8>, FilmError>;
}

/// A film being made.
pub struct Film {
    encoder: Box<dyn Encode>,
    frames: u64,
}

impl Film {
    /// A film of `size` pixels with `rate` frames per second.
    ///
    /// # Errors
    /// A size or rate that the format cannot hold.
    pub fn new(format: FilmFormat, size: [u32; 2], rate: f64) -> Result<Self, FilmError> {
        let encoder: Box<dyn Encode> = match format {
            FilmFormat::Mp4 => Box::new(mp4::Mp4::new(size, rate)?),
            FilmFormat::Gif => Box::new(gif::Gif::new(size, rate)?),
        };
        Ok(Self { encoder, frames: 0 })
    }

    /// Appends a frame of the film's size: rows from the top, red, green, blue, opacity (ignored), sRGB-encoded.
    ///
    /// # Errors
    /// The film becomes too long.
    ///
    /// # Panics
    /// `rgba` has another size.
    pub fn add(&mut self, rgba: &[u8]) -> Result<(), FilmError> {
        self.encoder.add(rgba)?;
        self.frames += 1;
        if self.encoder.bytes() > MAX_BYTES {
            return Err(FilmError::TooLong);
        }
        Ok(())
    }

    /// Number of frames so far.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// The complete file.
    ///
    /// # Errors
    /// No frames.
    pub fn finish(self) -> Result<Vec<u8>, FilmError> {
        if self.frames == 0 {
            return Err(FilmError::Empty);
        }
        self.encoder.finish()
    }
}
