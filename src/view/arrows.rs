//! Memory of the force arrows: an impact lasts a hundredth of a frame, an eye needs longer.

use glam::Vec3;

use super::{ArrowOptions, to_f32};
use crate::simulate::{Frame, Peak};

/// What one joint's arrows show.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HeldForce {
    /// Normal force on the ball, N (reaction of an ideal joint).
    pub normal: Vec3,
    /// Friction force on the ball, N.
    pub friction: Vec3,
    /// Brightness of the flash, 0..=1.
    pub flash: f32,
}

/// Forces held since their peaks, fading. Deterministic: depends on what it was given and nothing else.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ArrowMemory {
    joints: Vec<HeldForce>,
    /// Largest force held lately, N: what the automatic scale follows.
    largest: f32,
}

/// A flash fades by half in this time, s.
const FLASH_HALF_LIFE: f32 = 0.10;
/// The automatic scale shrinks by half in this time, s: slowly, so that lengths can be compared.
const SCALE_HALF_LIFE: f32 = 2.0;

impl ArrowMemory {
    /// Nothing held.
    pub fn new() -> Self {
        Self::default()
    }

    /// Forgets everything, as after a reset.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// What each ball joint shows, scene order.
    pub fn joints(&self) -> &[HeldForce] {
        &self.joints
    }

    /// Takes what happened since the last picture: `peaks` (one per ball joint, or empty), the forces of `frame`, and
    /// `dt` seconds of viewing time. The strongest of held, peak and present force is kept.
    pub fn update(&mut self, frame: &Frame, peaks: &[Peak], dt: f32, options: &ArrowOptions) {
        let dt = dt.max(0.0);
        let fade = |half_life: f32| (-dt / half_life.max(1e-3)).exp2();
        let (fade_force, fade_flash) = (fade(options.half_life), fade(FLASH_HALF_LIFE));
        self.joints.resize(frame.joints.len(), HeldForce::default());
        let hardest = peaks
            .iter()
            .map(|peak| peak.normal as f32)
            .fold(0.0, f32::max);
        let mut largest = 0.0_f32;
        for (i, (held, now)) in self.joints.iter_mut().zip(&frame.joints).enumerate() {
            held.normal *= fade_force;
            held.friction *= fade_force;
            held.flash *= fade_flash;
            if let Some(peak) = peaks.get(i) {
                hold(
                    held,
                    to_f32(&peak.normal_force),
                    to_f32(&peak.friction_force),
                );
                if peak.impacts > 0 {
                    // A touch a hundred times softer than the hardest lately still shows, but does not dazzle.
                    let relative =
                        peak.normal as f32 / self.largest.max(hardest).max(f32::MIN_POSITIVE);
                    held.flash = held.flash.max(relative.clamp(0.0, 1.0).sqrt().max(0.15));
                }
            }
            hold(held, to_f32(&now.normal_force), to_f32(&now.friction_force));
            largest = largest.max(held.normal.length());
        }
        self.largest = largest.max(self.largest * fade(SCALE_HALF_LIFE));
    }

    /// Force of the reference length: the option's, or the largest held, rounded up to 1, 2 or 5 times a power of ten.
    pub fn reference(&self, options: &ArrowOptions) -> f32 {
        match options.reference {
            Some(force) if force.is_finite() && force > 0.0 => force,
            _ => round_up_125(self.largest),
        }
    }
}

/// Normal and friction belong to one instant: the stronger normal force brings its friction along.
fn hold(held: &mut HeldForce, normal: Vec3, friction: Vec3) {
    if normal.is_finite()
        && friction.is_finite()
        && normal.length_squared() >= held.normal.length_squared()
    {
        (held.normal, held.friction) = (normal, friction);
    }
}

/// Least of …, 1, 2, 5, 10, 20, … that is not below `x`; 1 where `x` is not positive.
fn round_up_125(x: f32) -> f32 {
    if !(x.is_finite() && x > 1e-6) {
        return 1.0;
    }
    let decade = 10_f32.powi(x.log10().floor() as i32);
    [1.0, 2.0, 5.0]
        .into_iter()
        .map(|k| k * decade)
        .find(|&step| step >= x * 0.9999)
        .unwrap_or(10.0 * decade)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene;
    use crate::simulate::JointReport;

    fn frame(normal: f64) -> Frame {
        let report = JointReport {
            normal_force: scene::Vec3::new(0.0, 0.0, normal),
            ..Default::default()
        };
        Frame {
            joints: vec![report],
            ..Default::default()
        }
    }

    fn hit(normal: f64) -> Peak {
        Peak {
            normal,
            normal_force: scene::Vec3::new(normal, 0.0, 0.0),
            friction_force: scene::Vec3::new(0.0, 0.1 * normal, 0.0),
            impacts: 1,
            ..Default::default()
        }
    }

    #[test]
    fn a_peak_between_two_frames_is_held_and_halves_in_its_half_life() {
        let options = ArrowOptions {
            half_life: 0.2,
            ..Default::default()
        };
        let mut memory = ArrowMemory::new();
        memory.update(&frame(0.0), &[hit(800.0)], 0.016, &options);
        assert_eq!(memory.joints()[0].normal, Vec3::new(800.0, 0.0, 0.0));
        assert_eq!(memory.joints()[0].friction, Vec3::new(0.0, 80.0, 0.0));
        assert_eq!(memory.joints()[0].flash, 1.0);
        memory.update(&frame(0.0), &[Peak::default()], 0.2, &options);
        assert!((memory.joints()[0].normal.x - 400.0).abs() < 1e-2);
        assert!(
            (memory.joints()[0].flash - 0.25).abs() < 1e-3,
            "two half-lives of the flash"
        );
    }

    #[test]
    fn a_lasting_force_outlives_a_faded_peak() {
        let options = ArrowOptions::default();
        let mut memory = ArrowMemory::new();
        memory.update(&frame(8.0), &[hit(800.0)], 0.016, &options);
        for _ in 0..200 {
            memory.update(&frame(8.0), &[], 0.016, &options);
        }
        assert_eq!(memory.joints()[0].normal, Vec3::new(0.0, 0.0, 8.0));
    }

    #[test]
    fn the_scale_is_a_round_number_that_covers_the_largest_force() {
        for (x, expect) in [
            (0.0, 1.0),
            (0.9, 1.0),
            (1.0, 1.0),
            (1.1, 2.0),
            (3.0, 5.0),
            (621.0, 1000.0),
            (771.0, 1000.0),
        ] {
            assert!(
                (round_up_125(x) / expect - 1.0).abs() < 1e-5,
                "{x}: {}",
                round_up_125(x)
            );
        }
        let fixed = ArrowOptions {
            reference: Some(30.0),
            ..Default::default()
        };
        assert_eq!(ArrowMemory::new().reference(&fixed), 30.0);
    }
}
