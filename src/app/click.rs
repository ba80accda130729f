//! Impacts as sound: the clicks of a frame, and their samples.
//!
//! An impact determines its click in three ways. Onset: the instant at which contact ended, with the same offset in the frame as
//! in the frame's time window of the run. Pitch: that of a vibration whose half period is the contact duration; since this is
//! simulated time, slow motion spreads the clicks but does not change them. Loudness: a power below one of the impulse, so that
//! soft impacts are audible beside hard ones.

use crate::scene::Scene;
use crate::simulate::Impact;

/// Lowest and highest pitch, Hz: the range of small loudspeakers and most ears.
pub const PITCHES: (f64, f64) = (150.0, 8000.0);
/// Wall impact speed of the scene's total mass that gives full loudness, m/s.
const FULL_LOUDNESS_SPEED: f64 = 0.1;
/// Exponent of the loudness over the impulse: ten times the impulse is two and a half times as loud.
const COMPRESSION: f64 = 0.4;
/// Amplitude of the loudest click relative to the device's full scale; leaves headroom for several at once.
const AMPLITUDE: f64 = 0.4;
/// Most clicks per frame; the loudest are played.
pub const MAX_CLICKS: usize = 8;
/// Vibrations until the amplitude has decayed to 1/e, and the shortest decay time, s.
const VIBRATIONS: f64 = 3.0;
const MIN_DECAY: f64 = 4e-3;
/// Relative amplitude at which a click ends.
const SILENCE: f64 = 3e-3;

/// Sound of one impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Click {
    /// Onset after the start of the frame, s.
    pub after: f64,
    /// Frequency, Hz.
    pub pitch: f64,
    /// From 0 to 1.
    pub loudness: f64,
}

/// A time window of the run, and its duration on screen.
#[derive(Clone, Copy, Debug)]
pub struct TimeWindow {
    /// Exclusive start, s.
    pub from: f64,
    /// Inclusive end, s.
    pub to: f64,
    /// Display duration, s.
    pub lasts: f64,
}

/// Impulse of the blow, N s, from the record of `impact`. The effective mass follows from its largest elastic energy and is at most
/// `mass`, kg, the total. Forces during lasting contact are excluded: a ball that settles softly and leaves after a second makes no
/// bang.
pub fn impulse(impact: &Impact, mass: f64) -> f64 {
    let effective_mass = 2.0 * impact.energy / (impact.approach_speed * impact.approach_speed);
    effective_mass.min(mass) * (impact.approach_speed + impact.separation_speed)
}

/// Total mass of the bodies, kg.
pub fn mass(scene: &Scene) -> f64 {
    scene.machine.bodies.iter().map(|body| body.mass).sum()
}

/// Writes the clicks of the `impacts` that ended within `window` to `out` in order; `mass` is the total mass, kg.
pub fn clicks<'a>(impacts: impl Iterator<Item = &'a Impact>, window: &TimeWindow, mass: f64, out: &mut Vec<Click>) {
    out.clear();
    let within = |impact: &&Impact| window.from < impact.end && impact.end <= window.to;
    out.extend(impacts.filter(within).map(|impact| {
        let part = (impact.end - window.from) / (window.to - window.from);
        let duration = impact.end - impact.start;
        let loudness = impulse(impact, mass) / (mass * FULL_LOUDNESS_SPEED);
        Click {
            after: part * window.lasts,
            pitch: (0.5 / duration).clamp(PITCHES.0, PITCHES.1),
            loudness: libm::pow(loudness, COMPRESSION).min(1.0),
        }
    }));
    if out.len() > MAX_CLICKS {
        out.sort_by(|a, b| b.loudness.total_cmp(&a.loudness));
        out.truncate(MAX_CLICKS);
        out.sort_by(|a, b| a.after.total_cmp(&b.after));
    }
}

/// The samples of a click: a decaying vibration.
#[derive(Clone, Copy, Debug)]
pub struct Voice {
    /// Recurrence: next sample = `turn` × last − `fade` × the one before.
    turn: f64,
    fade: f64,
    last: f64,
    before: f64,
    left: usize,
}

impl Voice {
    /// The samples of `click` at `rate` samples per second.
    pub fn new(click: &Click, rate: f64) -> Self {
        // The pitch is limited by the device's sample rate.
        let pitch = click.pitch.min(0.45 * rate);
        let decay = (VIBRATIONS / pitch).max(MIN_DECAY);
        let angle = std::f64::consts::TAU * pitch / rate;
        let decay_factor = libm::exp(-1.0 / (decay * rate));
        Self {
            turn: 2.0 * decay_factor * libm::cos(angle),
            fade: decay_factor * decay_factor,
            last: 0.0,
            // Makes the next sample that of the sine.
            before: -AMPLITUDE * click.loudness * libm::sin(angle) / decay_factor,
            left: (-libm::log(SILENCE) * decay * rate) as usize,
        }
    }
}

impl Iterator for Voice {
    type Item = f32;

    fn next(&mut self) -> Option<f32> {
        self.left = self.left.checked_sub(1)?;
        let sample = self.last;
        (self.last, self.before) = (self.turn * sample - self.fade * self.before, sample);
        Some(sample as f32)
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (self.left, Some(self.left))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::{Frame, Simulation};

    const RATE: f64 = 48_000.0;

    fn impact(end: f64, duration: f64, speed: f64) -> Impact {
        Impact {
            start: end - duration,
            end,
            approach_speed: speed,
            separation_speed: speed,
            // Elastic impact of half a kilogram.
            energy: 0.25 * speed * speed,
            ..Impact::default()
        }
    }

    fn of(impacts: &[Impact], window: TimeWindow) -> Vec<Click> {
        let mut out = Vec::new();
        clicks(impacts.iter(), &window, 5.0, &mut out);
        out
    }

    const SECOND: TimeWindow = TimeWindow { from: 1.0, to: 2.0, lasts: 0.05 };

    #[test]
    fn a_time_window_has_the_impacts_that_ended_in_it_at_their_times() {
        let ends = [0.5, 1.0, 1.25, 2.0, 2.5];
        let impacts = ends.map(|end| impact(end, 1e-4, 0.01));
        let played = of(&impacts, SECOND);
        let times: Vec<f64> = played.iter().map(|click| click.after).collect();
        assert_eq!(times, [0.0125, 0.05]);
        // Adjacent windows neither repeat nor lose an impact.
        let next = TimeWindow { from: 2.0, to: 3.0, ..SECOND };
        assert_eq!(of(&impacts, next).len(), 1);
        let nothing = TimeWindow { to: 1.0, ..SECOND };
        assert!(of(&impacts, nothing).is_empty());
    }

    #[test]
    fn the_pitch_is_that_of_the_contact_at_any_time_scale() {
        for lasted in [2e-4, 1e-3] {
            for lasts in [1e-3, 50.0] {
                let window = TimeWindow { lasts, ..SECOND };
                let pitch = of(&[impact(1.5, lasted, 0.01)], window)[0].pitch;
                assert!((pitch * 2.0 * lasted - 1.0).abs() < 1e-9, "{pitch} Hz");
            }
        }
        assert_eq!(of(&[impact(1.5, 0.1, 0.01)], SECOND)[0].pitch, PITCHES.0);
        assert_eq!(of(&[impact(1.5, 1e-6, 0.01)], SECOND)[0].pitch, PITCHES.1);
    }

    #[test]
    fn the_loudness_rises_less_than_the_impulse_and_is_bounded() {
        let loudness = |speed: f64| of(&[impact(1.5, 1e-4, speed)], SECOND)[0].loudness;
        // 0.5 kg rebounding at 0.01 m/s, relative to 5 kg at 0.1 m/s.
        assert!((loudness(0.01) - 0.02_f64.powf(0.4)).abs() < 1e-12);
        assert!((loudness(0.1) / loudness(0.01) - 10_f64.powf(0.4)).abs() < 1e-9);
        assert_eq!(loudness(100.0), 1.0);
        assert!(loudness(1e-30) < 1e-9);
    }

    #[test]
    fn of_many_impacts_the_loudest_are_heard_in_their_order() {
        let impacts: Vec<Impact> =
            (1..=40).map(|k| impact(1.0 + f64::from(k) / 50.0, 1e-4, 1e-3 * f64::from(k * 7 % 41))).collect();
        let played = of(&impacts, SECOND);
        assert_eq!(played.len(), MAX_CLICKS);
        assert!(played.is_sorted_by(|a, b| a.after < b.after));
        let separate: Vec<Click> = impacts.iter().flat_map(|i| of(&[*i], SECOND)).collect();
        let softest = played.iter().map(|c| c.loudness).fold(1.0, f64::min);
        let louder = separate.iter().filter(|click| click.loudness >= softest);
        assert_eq!(louder.count(), MAX_CLICKS);
        assert!(played.iter().all(|click| separate.contains(click)));
    }

    #[test]
    fn the_impulse_is_the_integral_of_the_force() {
        let scene = Scene::load("pendulum", &[]).expect("built in");
        let mut simulation = Simulation::new(&scene.machine).expect("starts");
        let mut impacts = Vec::new();
        let mut frame = Frame::default();
        let (mut sum, mut compared) = (0.0, 0);
        while compared < 5 {
            simulation.step().expect("runs");
            let (from, to) = (simulation.step_start(), simulation.time());
            // Integral of the force over the step by Simpson's rule.
            let parts = 8;
            let width = (to - from) / f64::from(parts);
            for part in 0..=parts {
                let weight = match part {
                    0 => 1.0,
                    _ if part == parts => 1.0,
                    _ if part % 2 == 1 => 4.0,
                    _ => 2.0,
                };
                simulation.sample(from + width * f64::from(part), &mut frame);
                sum += weight * width / 3.0 * frame.joints[0].normal_force.norm();
            }
            impacts.extend(simulation.take_impacts());
            for impact in impacts.drain(..) {
                let estimate = impulse(&impact, mass(&scene));
                assert!((estimate / sum - 1.0).abs() < 0.2, "{estimate} N s for {sum} N s, {impact:?}");
                sum = 0.0;
                compared += 1;
            }
        }
    }

    /// Fraction of the energy of `samples` within 20 % of `pitch`, Hz, and the frequency of the spectrum's maximum.
    fn spectrum(samples: &[f32], pitch: f64) -> (f64, f64) {
        let (mut near, mut all, mut best) = (0.0, 0.0, (0.0, 0.0));
        let step = 5.0;
        for k in 1..4000 {
            let frequency = step * f64::from(k);
            let turn = std::f64::consts::TAU * frequency / RATE;
            let (mut re, mut im) = (0.0, 0.0);
            for (n, sample) in samples.iter().enumerate() {
                let (sin, cos) = (turn * n as f64).sin_cos();
                re += f64::from(*sample) * cos;
                im += f64::from(*sample) * sin;
            }
            let power = re * re + im * im;
            all += power;
            if (frequency / pitch - 1.0).abs() < 0.2 {
                near += power;
            }
            if power > best.0 {
                best = (power, frequency);
            }
        }
        (near / all, best.1)
    }

    #[test]
    fn a_click_has_its_pitch_and_loudness_and_ends() {
        for pitch in [100.0, 440.0, 2600.0, 8000.0] {
            let click = Click { after: 0.0, pitch, loudness: 1.0 };
            let samples: Vec<f32> = Voice::new(&click, RATE).collect();
            assert_eq!(samples, Voice::new(&click, RATE).collect::<Vec<f32>>());
            let (near, peak) = spectrum(&samples, pitch);
            assert!(near > 0.7, "{pitch} Hz: {near}");
            assert!((peak / pitch - 1.0).abs() < 0.05, "{pitch} Hz: {peak} Hz");
            // Closed form of a decaying sine at every sample.
            let decay = (VIBRATIONS / pitch).max(MIN_DECAY) * RATE;
            for (n, sample) in samples.iter().enumerate() {
                let (n, angle) = (n as f64, std::f64::consts::TAU * pitch / RATE);
                let exact = AMPLITUDE * (-n / decay).exp() * (angle * n).sin();
                assert!((f64::from(*sample) - exact).abs() < 1e-6);
            }
            assert!(samples.len() as f64 <= 0.3 * RATE);
            let last = samples.last().copied().unwrap_or(1.0);
            assert!(f64::from(last.abs()) <= 1.1 * SILENCE * AMPLITUDE);
            // Half the loudness has a quarter of the energy.
            let energy = |loudness| -> f64 {
                let voice = Voice::new(&Click { loudness, ..click }, RATE);
                voice.map(|sample| f64::from(sample) * f64::from(sample)).sum()
            };
            let whole = 0.25 * AMPLITUDE * AMPLITUDE * decay;
            assert!((energy(1.0) / whole - 1.0).abs() < 0.05, "{pitch} Hz");
            assert!((energy(0.5) / energy(1.0) - 0.25).abs() < 1e-6);
        }
    }

    #[test]
    fn a_device_with_a_low_sample_rate_plays_an_audible_click() {
        let click = Click { after: 0.0, pitch: 8000.0, loudness: 1.0 };
        let samples: Vec<f32> = Voice::new(&click, 8000.0).collect();
        assert!(samples.iter().any(|sample| sample.abs() > 0.1));
        assert!(samples.iter().all(|sample| sample.abs() <= 1.0));
    }
}
