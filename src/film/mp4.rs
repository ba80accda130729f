//! MP4: the container of ISO/IEC 14496-12 around H.264.

use std::num::NonZeroU32;

use shiguredo_mp4::bitstream::h264::{
    H264NalUnitType, H264SampleEntryConfig, LengthSize, build_avc1_box_from_annexb, parse_annexb_nal_units,
};
use shiguredo_mp4::boxes::{SampleEntry, UnknownBox};
use shiguredo_mp4::mux::{Mp4FileMuxer, Sample};
use shiguredo_mp4::{BoxSize, BoxType, TrackKind};

use super::h264::H264;
use super::{Encode, FilmError};

/// Clock ticks per frame, so that a rate such as 29.97 keeps its three decimals.
const TICKS: u32 = 1000;

/// `colr` (ISO/IEC 14496-12, 12.1.5): BT.709 codes for primaries, transfer and matrix, narrow range. Without it, players guess
/// differently.
const COLOURS: [u8; 11] = [b'n', b'c', b'l', b'x', 0, 1, 0, 1, 0, 1, 0];

/// An MP4 being written.
pub struct Mp4 {
    encoder: H264,
    muxer: Mp4FileMuxer,
    file: Vec<u8>,
    samples: u64,
    timescale: NonZeroU32,
}

impl Mp4 {
    pub fn new(size: [u32; 2], rate: f64) -> Result<Self, FilmError> {
        let encoder = H264::new(size, rate)?;
        let muxer = Mp4FileMuxer::new().map_err(encoder_error)?;
        let timescale = (rate * f64::from(TICKS)).round().max(1.0) as u32;
        Ok(Self {
            encoder,
            file: muxer.initial_boxes_bytes().to_vec(),
            muxer,
            samples: 0,
            timescale: NonZeroU32::new(timescale).unwrap_or(NonZeroU32::MIN),
        })
    }
}

impl Encode for Mp4 {
    fn add(&mut self, rgba: &[u8]) -> Result<(), FilmError> {
        let (unit, keyframe) = self.encoder.encode(rgba)?;
        let first = self.file.len();
        let parts = parse_annexb_nal_units(&unit).map_err(encoder_error)?;
        for part in &parts {
            // Parameter sets are stored in the sample entry.
            if !matches!(part.nal_unit_type, H264NalUnitType::Sps | H264NalUnitType::Pps) {
                let length = part.data.len() as u32;
                self.file.extend_from_slice(&length.to_be_bytes());
                self.file.extend_from_slice(part.data);
            }
        }
        let sample_entry = if self.samples == 0 {
            let config = H264SampleEntryConfig { length_size: LengthSize::FourBytes };
            let mut entry = build_avc1_box_from_annexb(&unit, &config).map_err(encoder_error)?;
            entry.unknown_boxes.push(UnknownBox {
                box_type: BoxType::Normal(*b"colr"),
                box_size: BoxSize::U32(8 + COLOURS.len() as u32),
                payload: COLOURS.to_vec(),
            });
            Some(SampleEntry::Avc1(entry))
        } else {
            None
        };
        self.samples += 1;
        let sample = Sample {
            track_kind: TrackKind::Video,
            sample_entry,
            keyframe,
            timescale: self.timescale,
            duration: TICKS,
            composition_time_offset: None,
            data_offset: first as u64,
            data_size: self.file.len() - first,
        };
        self.muxer.append_sample(&sample).map_err(encoder_error)
    }

    fn bytes(&self) -> usize {
        self.file.len()
    }

    fn finish(mut self: Box<Self>) -> Result<Vec<u8>, FilmError> {
        let boxes = self.muxer.finalize().map_err(encoder_error)?;
        for (offset, bytes) in boxes.offset_and_bytes_pairs() {
            let from = offset as usize;
            let end = from + bytes.len();
            if self.file.len() < end {
                self.file.resize(end, 0);
            }
            self.file[from..end].copy_from_slice(bytes);
        }
        Ok(self.file)
    }
}

fn encoder_error(error: impl std::fmt::Display) -> FilmError {
    FilmError::Encoder(error.to_string())
}
