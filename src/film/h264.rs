//! Encodes frames as H.264, with colours by ITU-R BT.709 and levels by ITU-T H.264.

use rusty_h264_common::{Profile, YuvFrame};
use rusty_h264_encoder::{Encoder, EncoderConfig, Preset};

use super::FilmError;

/// Quantisation, 0 (finest) to 51; this value keeps edges of drawn lines clean.
const QUANTISATION: u8 = 20;
/// Interval between key frames, s; players can seek to these.
const KEY_INTERVAL: f64 = 2.0;

/// Levels of ITU-T H.264, Table A-1: `level_idc`, largest number of macroblocks of a frame and per second.
pub const LEVELS: [(u8, u32, u32); 15] = [
    (10, 99, 1_485),
    (11, 396, 3_000),
    (12, 396, 6_000),
    (13, 396, 11_880),
    (21, 792, 19_800),
    (30, 1_620, 40_500),
    (31, 3_600, 108_000),
    (32, 5_120, 216_000),
    (40, 8_192, 245_760),
    (42, 8_704, 522_240),
    (50, 22_080, 589_824),
    (51, 36_864, 983_040),
    (52, 36_864, 2_073_600),
    (60, 139_264, 4_177_920),
    (62, 139_264, 16_711_680),
];

/// Lowest level that admits `size` pixels at `rate` frames per second, or `None`.
pub fn level(size: [u32; 2], rate: f64) -> Option<u8> {
    let [across, down] = size.map(|edge| u64::from(edge.div_ceil(16)));
    let blocks = across * down;
    LEVELS
        .iter()
        .find(|&&(_, frame, second)| {
            // No edge longer than sqrt(8 MaxFS) macroblocks (A.3.1).
            let edge = across.max(down);
            blocks <= u64::from(frame)
                && edge * edge <= 8 * u64::from(frame)
                && blocks as f64 * rate <= f64::from(second)
        })
        .map(|&(level, ..)| level)
}

/// Encoder of one film.
pub struct H264 {
    encoder: Encoder,
    frame: YuvFrame,
    key_every: u64,
    frames: u64,
}

/// The level of a film of `size` pixels with `rate` frames per second.
///
/// # Errors
/// An odd size, or no level of H.264 allows the film.
pub fn check([width, height]: [u32; 2], rate: f64) -> Result<u8, FilmError> {
    if width == 0 || height == 0 || width % 2 == 1 || height % 2 == 1 {
        return Err(FilmError::Odd { width, height });
    }
    let lowest = level([width, height], rate).filter(|_| rate > 0.0);
    lowest.ok_or(FilmError::BeyondLimit {
        width,
        height,
        rate,
        limit: "H.264 allows 8192x4320 pixels with 120 frames a second, and fewer frames the larger they are",
    })
}

impl H264 {
    pub fn new([width, height]: [u32; 2], rate: f64) -> Result<Self, FilmError> {
        let level = check([width, height], rate)?;
        let key_every = (KEY_INTERVAL * rate).ceil().max(1.0);
        let mut config = EncoderConfig::new(width as usize, height as usize);
        config.profile = Profile::Main;
        config.level_idc = level;
        config.qp = QUANTISATION;
        config.gop_size = key_every as u32;
        config.framerate = rate as f32;
        config.preset = Preset::Balanced;
        // Otherwise the encoder would hold back two seconds of frames.
        config.mbtree = false;
        let encoder = Encoder::new(config).map_err(|error| FilmError::Encoder(error.to_string()))?;
        Ok(Self {
            encoder,
            frame: YuvFrame::black(width as usize, height as usize),
            key_every: key_every as u64,
            frames: 0,
        })
    }

    /// Encodes a frame; returns its NAL units behind start codes, and whether it is a key frame.
    pub fn encode(&mut self, rgba: &[u8]) -> Result<(Vec<u8>, bool), FilmError> {
        to_yuv(rgba, &mut self.frame);
        let key = self.frames.is_multiple_of(self.key_every);
        self.frames += 1;
        let unit = self.encoder.try_encode(&self.frame).map_err(|error| FilmError::Encoder(error.to_string()))?;
        Ok((unit, key))
    }
}

/// Converts RGB to luma and colour differences, ITU-R BT.709-6 items 3.2 to 3.4, 8 bits in the narrow range. Each square of
/// four pixels shares its mean colour.
fn to_yuv(rgba: &[u8], frame: &mut YuvFrame) {
    let (width, height) = (frame.width, frame.height);
    assert_eq!(rgba.len(), 4 * width * height, "a frame of the film's size");
    let colour = |x: usize, y: usize| {
        let at = 4 * (y * width + x);
        [0, 1, 2].map(|k| f32::from(rgba[at + k]))
    };
    for y in 0..height {
        for x in 0..width {
            let luma = 16.0 + luma(colour(x, y)) * (219.0 / 255.0);
            frame.y[y * width + x] = (luma + 0.5) as u8;
        }
    }
    for y in 0..height / 2 {
        for x in 0..width / 2 {
            let mut mean = [0.0; 3];
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let colour = colour(2 * x + dx, 2 * y + dy);
                for (sum, part) in mean.iter_mut().zip(colour) {
                    *sum += part / 4.0;
                }
            }
            let luma = luma(mean);
            let difference = |part: f32, range: f32| 128.5 + (part - luma) / range * (224.0 / 255.0);
            let at = y * (width / 2) + x;
            frame.u[at] = difference(mean[2], 2.0 * (1.0 - BLUE)) as u8;
            frame.v[at] = difference(mean[0], 2.0 * (1.0 - RED)) as u8;
        }
    }
}

/// Weights of red and blue in luma, ITU-R BT.709-6 item 3.2.
const RED: f32 = 0.2126;
const BLUE: f32 = 0.0722;

fn luma([red, green, blue]: [f32; 3]) -> f32 {
    RED * red + (1.0 - RED - BLUE) * green + BLUE * blue
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn common_sizes_and_rates_have_their_known_levels() {
        // Table A-6 of ITU-T H.264 names the largest rates of common sizes.
        let known = [
            ([176, 144], 15.0, 10),
            ([720, 576], 25.0, 30),
            ([1280, 720], 30.0, 31),
            ([1280, 720], 60.0, 32),
            ([1920, 1080], 30.0, 40),
            ([1920, 1080], 60.0, 42),
            ([3840, 2160], 30.0, 51),
            ([3840, 2160], 60.0, 52),
            ([7680, 4320], 30.0, 60),
        ];
        for (size, rate, least) in known {
            assert_eq!(level(size, rate), Some(least), "{size:?} {rate}");
        }
        assert_eq!(level([7680, 4320], 1000.0), None);
        assert!(LEVELS.is_sorted());
    }
}
