//! The desktop's sound device. Its own thread opens it, since that may take a while; the system's audio thread feeds it.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use cpal::traits::{DeviceTrait as _, HostTrait as _, StreamTrait as _};
use cpal::{ErrorKind, FromSample, SampleFormat, SizedSample, StreamConfig};

use super::click::{Click, Voice};

/// Delay from a frame to its sound: longer than a device's buffer, so that the clicks of a frame keep their spacing.
const LATENCY: Duration = Duration::from_millis(40);
/// Most simultaneous clicks; more than the ear can distinguish.
const MAX_VOICES: usize = 64;

/// A device that is open or being opened; dropping it closes the device.
pub struct Speaker {
    clicks: Sender<(Instant, Click)>,
    failed: Receiver<String>,
    /// Dropping it ends the thread.
    _open: Sender<()>,
}

impl Speaker {
    /// Opens the system's default device.
    pub fn open() -> Self {
        let (clicks, to_play) = channel();
        let (fail, failed) = channel();
        let (open, closed) = channel::<()>();
        let report = fail.clone();
        let spawned =
            std::thread::Builder::new().name("sound".to_owned()).spawn(move || match stream(to_play, report.clone()) {
                // Blocks until the other end is dropped.
                Ok(_stream) => drop(closed.recv()),
                Err(why) => drop(report.send(why)),
            });
        if let Err(error) = spawned {
            let _ = fail.send(error.to_string());
        }
        Self { clicks, failed, _open: open }
    }

    /// Plays the `clicks` of a frame that starts now.
    pub fn click(&self, clicks: &[Click]) {
        let now = Instant::now() + LATENCY;
        for click in clicks {
            let due = now + Duration::from_secs_f64(click.after.max(0.0));
            // `failure` reports a lost device.
            let _ = self.clicks.send((due, *click));
        }
    }

    /// The error that silences the device, once known.
    pub fn failure(&self) -> Option<String> {
        self.failed.try_recv().ok()
    }
}

/// Starts the audio stream. Fatal errors are sent to `failed`.
fn stream(clicks: Receiver<(Instant, Click)>, failed: Sender<String>) -> Result<cpal::Stream, String> {
    let device = cpal::default_host().default_output_device();
    let device = device.ok_or("this machine has no sound device")?;
    let supported =
        device.default_output_config().map_err(|error| format!("the sound device does not answer: {error}"))?;
    let config: StreamConfig = supported.into();
    let mixer = Mixer::new(clicks, f64::from(config.sample_rate));
    match supported.sample_format() {
        SampleFormat::F32 => play::<f32>(&device, config, mixer, failed),
        SampleFormat::I16 => play::<i16>(&device, config, mixer, failed),
        SampleFormat::I32 => play::<i32>(&device, config, mixer, failed),
        SampleFormat::U8 => play::<u8>(&device, config, mixer, failed),
        SampleFormat::U16 => play::<u16>(&device, config, mixer, failed),
        other => return Err(format!("the sound device takes only {other}")),
    }
    .map_err(|error| format!("the sound device cannot be opened: {error}"))
}

fn play<T: SizedSample + FromSample<f32>>(
    device: &cpal::Device,
    config: StreamConfig,
    mut mixer: Mixer,
    failed: Sender<String>,
) -> Result<cpal::Stream, cpal::Error> {
    let channels = usize::from(config.channels);
    let stream = device.build_output_stream(
        config,
        move |samples: &mut [T], _| mixer.fill(samples, channels, Instant::now()),
        move |error| match error.kind() {
            // The stream continues.
            ErrorKind::DeviceChanged | ErrorKind::Xrun | ErrorKind::RealtimeDenied => {
                log::debug!("sound: {error}");
            }
            _ => drop(failed.send(format!("the sound device has failed: {error}"))),
        },
        None,
    )?;
    stream.play()?;
    Ok(stream)
}

/// Mixes the clicks that sound at the same time.
struct Mixer {
    clicks: Receiver<(Instant, Click)>,
    rate: f64,
    /// Voices, each with the number of samples until its start.
    voices: Vec<(usize, Voice)>,
}

impl Mixer {
    fn new(clicks: Receiver<(Instant, Click)>, rate: f64) -> Self {
        Self {
            clicks,
            rate,
            // Preallocated: the audio thread must not wait for memory.
            voices: Vec::with_capacity(MAX_VOICES),
        }
    }

    /// Writes the next samples, starting at `now`, identical on all channels.
    fn fill<T: SizedSample + FromSample<f32>>(&mut self, out: &mut [T], channels: usize, now: Instant) {
        for (due, click) in self.clicks.try_iter() {
            if self.voices.len() < MAX_VOICES {
                let wait = due.saturating_duration_since(now).as_secs_f64() * self.rate;
                let voice = Voice::new(&click, self.rate);
                self.voices.push((wait as usize, voice));
            }
        }
        for frame in out.chunks_mut(channels.max(1)) {
            let mut sum = 0.0;
            self.voices.retain_mut(|(wait, voice)| {
                if *wait > 0 {
                    *wait -= 1;
                    return true;
                }
                voice.next().is_some_and(|sample| {
                    sum += sample;
                    true
                })
            });
            frame.fill(T::from_sample(sum.clamp(-1.0, 1.0)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clicks_sound_when_they_are_due_on_every_channel_and_add_up() {
        let click = |loudness| Click { after: 0.0, pitch: 440.0, loudness };
        let rate = 48_000.0;
        let (send, clicks) = channel();
        let mut mixer = Mixer::new(clicks, rate);
        let now = Instant::now();
        let due = |samples: u32| now + Duration::from_secs_f64(f64::from(samples) / rate + 1e-9);
        send.send((due(700), click(0.5))).expect("is heard");
        send.send((due(900), click(1.0))).expect("is heard");
        let mut samples = Vec::new();
        let mut block = [0.0_f32; 2 * 512];
        for number in 0..20 {
            let then = now + Duration::from_secs_f64(f64::from(number) * 512.0 / rate);
            mixer.fill(&mut block, 2, then);
            samples.extend(block.chunks(2).map(|frame| {
                assert_eq!(frame[0], frame[1]);
                frame[0]
            }));
        }
        let voice = |begins: usize, loudness| {
            let silence = std::iter::repeat_n(0.0, begins);
            let voice = Voice::new(&click(loudness), rate);
            silence.chain(voice).chain(std::iter::repeat(0.0_f32))
        };
        let expected = voice(700, 0.5).zip(voice(900, 1.0));
        for (sample, (a, b)) in samples.iter().zip(expected) {
            assert_eq!(*sample, a + b);
        }
        assert!(mixer.voices.is_empty());
    }

    #[test]
    fn loud_sums_are_clipped_and_surplus_clicks_are_dropped() {
        let (send, clicks) = channel();
        let mut mixer = Mixer::new(clicks, 48_000.0);
        let now = Instant::now();
        for _ in 0..10 * MAX_VOICES {
            let click = Click { after: 0.0, pitch: 440.0, loudness: 1.0 };
            send.send((now, click)).expect("is heard");
        }
        let mut block = [0_i16; 256];
        mixer.fill(&mut block, 1, now);
        assert_eq!(mixer.voices.len(), MAX_VOICES);
        assert_eq!(mixer.voices.capacity(), MAX_VOICES);
        assert!(block.contains(&i16::MAX));
    }
}
