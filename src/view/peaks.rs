//! Marks the hardest impact of each joint with play for some time: an impact lasts a hundredth of a frame, too short to be seen.
//!
//! A mark is never an arrow: arrows are the current forces. It fades with simulated time alone; the rate follows from the time
//! scale, so that a mark stays visible equally long at any scale.

use glam::Vec3;

use super::{ArrowOptions, to_f32};
use crate::simulate::{Frame, Peak};

/// A past peak.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// Joint with play.
    pub joint: usize,
    /// Where in it, if that is known: [`crate::simulate::Impact::place`].
    pub place: Option<u8>,
    /// Normal force on the ball at the peak, N, world axes.
    pub force: Vec3,
    /// Simulated time since, s.
    pub age: f64,
    /// 1 at the peak, falling to 0 when the mark disappears.
    pub strength: f32,
}

/// The hardest impact of each joint that has not faded. Deterministic: depends only on its inputs.
#[derive(Clone, Debug, PartialEq)]
pub struct PeakMarks {
    joints: Vec<Joint>,
    /// Displayed instant, s.
    now: f64,
    /// Time up to which peaks were processed, s.
    processed_to: f64,
    /// Fade time of a mark, s of simulated time.
    fade: f64,
    /// Largest recent force, N: the input of the automatic scale.
    largest: f32,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Joint {
    impact: Option<Impact>,
    /// Impact of the latest step after the displayed instant.
    upcoming: Option<Impact>,
    /// Largest force of a recently begun contact, N, while it still rises.
    rising: Option<f32>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Impact {
    force: Vec3,
    place: Option<u8>,
    time: f64,
    /// Brightness of its flash.
    flash: f32,
}

/// Viewing time for which a mark stays visible, s; a flash lasts half as long.
pub const MARK_DURATION: f64 = 0.8;
/// Half-life of the automatic scale, in multiples of the fade time: slow, so that lengths can be compared.
const SCALE_HALF_LIFE: f64 = 0.75;
/// A current force above this fraction of the peak counts as the peak, which is then not marked.
const CURRENT_FRACTION: f32 = 0.95;
/// Smallest brightness of a flash: a contact a hundred times softer than the hardest recent one is still visible.
const MIN_FLASH: f32 = 0.15;

impl Default for PeakMarks {
    fn default() -> Self {
        Self {
            joints: Vec::new(),
            now: f64::NEG_INFINITY,
            processed_to: f64::NEG_INFINITY,
            fade: f64::INFINITY,
            largest: 0.0,
        }
    }
}

impl PeakMarks {
    /// No marks.
    pub fn new() -> Self {
        Self::default()
    }

    /// Drops everything up to `time`, s, as after a reset.
    pub fn clear(&mut self, time: f64) {
        *self = Self { now: time, processed_to: time, ..Self::default() };
    }

    /// Restores impacts (joint, force, time) before the displayed instant `frame` as if they had been displayed: after
    /// [`Self::clear`], when a past instant is displayed again.
    pub fn recall(&mut self, frame: &Frame, impacts: impl Iterator<Item = (usize, Vec3, f64)>, fade: f64) {
        self.fade = fade.max(f64::MIN_POSITIVE);
        self.joints.resize(frame.joints.len(), Joint::default());
        for (joint, force, time) in impacts.filter(|(_, force, _)| force.is_finite()) {
            let size = force.length();
            self.largest = self.largest.max(size);
            let flash = (size / self.largest.max(f32::MIN_POSITIVE)).sqrt().clamp(MIN_FLASH, 1.0);
            if let Some(joint) = self.joints.get_mut(joint) {
                joint.add_impact(Impact { force, place: None, time, flash }, self.fade);
            }
        }
    }

    /// Processes the displayed instant and the `peaks` since the previous one (one per joint, or empty). An impact expires
    /// `fade` seconds of simulated time after its peak. If time has gone back, all impacts are dropped.
    pub fn update(&mut self, frame: &Frame, peaks: &[Peak], fade: f64) {
        if frame.time < self.now {
            // The scale stays: it is the same run.
            let largest = self.largest;
            self.clear(frame.time);
            self.largest = largest;
        }
        let passed = if self.now.is_finite() { frame.time - self.now } else { 0.0 };
        (self.now, self.fade) = (frame.time, fade.max(f64::MIN_POSITIVE));
        self.joints.resize(frame.joints.len(), Joint::default());
        let hardest = peaks
            .iter()
            .zip(&frame.joints)
            .flat_map(|(peak, now)| [peak.normal, now.normal_force.norm()])
            .map(|force| force as f32)
            .filter(|force| force.is_finite())
            .fold(self.largest, f32::max);
        let Self { now, processed_to, .. } = *self;
        for ((joint, peak), report) in self.joints.iter_mut().zip(peaks).zip(&frame.joints) {
            // A peak after the previous instant may be due now.
            if let Some(impact) = joint.upcoming.take_if(|impact| impact.time <= now) {
                joint.add_impact(impact, self.fade);
            }
            let force = to_f32(&peak.normal_force);
            let size = force.length();
            let is_rising = joint.rising.is_some_and(|before| size > before);
            if !(peak.time > processed_to && size.is_finite() && (peak.impacts > 0 || is_rising)) {
                if peak.impacts > 0 && size == 0.0 {
                    // The contact begins at the end of the latest step.
                    joint.rising = Some(0.0);
                } else if peak.time > processed_to {
                    joint.rising = None;
                }
                continue;
            }
            joint.rising = Some(size);
            let impact = |force: Vec3, time: f64| Impact {
                force,
                place: None,
                time,
                flash: (force.length() / hardest.max(f32::MIN_POSITIVE)).sqrt().clamp(MIN_FLASH, 1.0),
            };
            if peak.time <= now {
                joint.add_impact(impact(force, peak.time), self.fade);
                continue;
            }
            joint.upcoming = Some(impact(force, peak.time));
            let current = to_f32(&report.normal_force);
            if current.is_finite() && current != Vec3::ZERO {
                // The contact has begun: show it with its current force.
                joint.add_impact(impact(current, now), self.fade);
            }
        }
        self.processed_to = peaks.iter().map(|peak| peak.time).fold(processed_to, f64::max);
        for joint in &mut self.joints {
            joint.impact = joint.impact.filter(|impact| now - impact.time < self.fade);
        }
        let half_lives = passed / (SCALE_HALF_LIFE * self.fade);
        let forces = frame.joints.iter().flat_map(|joint| [joint.normal_force, joint.lubricant_force]);
        let current = forces.map(|force| force.norm() as f32).filter(|force| force.is_finite());
        let marked = self.joints.iter().filter_map(|joint| joint.impact);
        self.largest = current
            .chain(marked.map(|impact| impact.force.length()))
            .fold(self.largest * (-half_lives as f32).exp2(), f32::max);
    }

    /// Tells where the impacts of joints with several places happened: `place` of a joint and of the time of a peak, s.
    pub fn locate(&mut self, place: impl Fn(usize, f64) -> Option<u8>) {
        for (j, joint) in self.joints.iter_mut().enumerate() {
            for impact in joint.impact.iter_mut().chain(&mut joint.upcoming).filter(|impact| impact.place.is_none()) {
                impact.place = place(j, impact.time);
            }
        }
    }

    /// The marks to draw beside the forces of `frame`: none for a joint whose current force is as large.
    pub fn marks<'a>(&'a self, frame: &'a Frame) -> impl Iterator<Item = Mark> + 'a {
        let mark = |(joint, (state, report)): (usize, (&Joint, _))| {
            let impact = state.impact?;
            let report: &crate::simulate::JointReport = report;
            let age = self.now - impact.time;
            let exceeds_current = (report.normal_force.norm() as f32) < CURRENT_FRACTION * impact.force.length();
            exceeds_current.then_some(Mark {
                joint,
                place: impact.place,
                force: impact.force,
                age,
                strength: (1.0 - age / self.fade) as f32,
            })
        };
        self.joints.iter().zip(&frame.joints).enumerate().filter_map(mark)
    }

    /// Brightness of the flash of joint `joint`, 0..=1.
    pub fn flash(&self, joint: usize) -> f32 {
        let impact = self.joints.get(joint).and_then(|joint| joint.impact);
        impact.map_or(0.0, |impact| {
            let left = 1.0 - 2.0 * (self.now - impact.time) / self.fade;
            impact.flash * left.max(0.0) as f32
        })
    }

    /// Force of the reference length for a largest force, N.
    pub fn reference_for(largest: f32) -> f32 {
        round_up_125(largest)
    }

    /// Largest recent force, N.
    pub fn largest(&self) -> f32 {
        self.largest
    }

    /// Force of the reference length: the one set in `options`, or the largest recent force rounded up to 1, 2 or 5 times a power of
    /// ten.
    pub fn reference(&self, options: &ArrowOptions) -> f32 {
        match options.reference {
            Some(force) if force.is_finite() && force > 0.0 => force,
            _ => round_up_125(self.largest),
        }
    }
}

impl Joint {
    /// Shows `impact` unless the displayed one, faded, is still stronger.
    fn add_impact(&mut self, impact: Impact, fade: f64) {
        let faded = self.impact.map_or(0.0, |before| {
            let left = 1.0 - (impact.time - before.time) / fade;
            before.force.length() * left.max(0.0) as f32
        });
        if impact.force.length() >= faded {
            self.impact = Some(impact);
        }
    }
}

/// Smallest of …, 1, 2, 5, 10, 20, … not below `x`; 1 if `x` is not positive.
fn round_up_125(x: f32) -> f32 {
    if !(x.is_finite() && x > 1e-6) {
        return 1.0;
    }
    let decade = 10_f32.powi(x.log10().floor() as i32);
    [1.0, 2.0, 5.0].into_iter().map(|k| k * decade).find(|&step| step >= x * 0.9999).unwrap_or(10.0 * decade)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine;
    use crate::simulate::JointReport;

    fn frame(time: f64, normal: f64) -> Frame {
        let report = JointReport { normal_force: machine::Vec3::new(0.0, 0.0, normal), ..Default::default() };
        Frame { time, joints: vec![report], ..Default::default() }
    }

    fn peak(time: f64, normal: f64, impacts: u32) -> [Peak; 1] {
        [Peak { normal, time, normal_force: machine::Vec3::new(normal, 0.0, 0.0), impacts, ..Default::default() }]
    }

    fn mark(marks: &PeakMarks, frame: &Frame) -> Option<Mark> {
        marks.marks(frame).next()
    }

    #[test]
    fn an_impact_between_two_pictures_is_marked_with_its_age_and_fades_with_simulated_time() {
        let mut marks = PeakMarks::new();
        let shown = frame(1e-3, 0.0);
        marks.update(&shown, &peak(0.6e-3, 800.0, 1), 4e-3);
        let first = mark(&marks, &shown).expect("a mark");
        assert_eq!(first.force, Vec3::new(800.0, 0.0, 0.0));
        assert!((first.age - 0.4e-3).abs() < 1e-12 && (first.strength - 0.9).abs() < 1e-6);
        assert!((marks.flash(0) - 0.8).abs() < 1e-6);
        // The same instant again, as while it is paused.
        for _ in 0..100 {
            marks.update(&shown, &peak(0.6e-3, 800.0, 1), 4e-3);
            marks.update(&shown, &[Peak::default()], 4e-3);
        }
        assert_eq!(mark(&marks, &shown), Some(first));
        let later = frame(2.6e-3, 0.0);
        marks.update(&later, &[], 4e-3);
        assert!((mark(&marks, &later).expect("a mark").strength - 0.5).abs() < 1e-6);
        assert_eq!(marks.flash(0), 0.0);
        marks.update(&frame(4.7e-3, 0.0), &[], 4e-3);
        assert_eq!(mark(&marks, &later), None);
    }

    #[test]
    fn going_back_and_a_reset_drop_all_marks() {
        let mut marks = PeakMarks::new();
        let hit = peak(0.6e-3, 800.0, 1);
        let (before, after) = (frame(0.5e-3, 0.0), frame(1e-3, 0.0));
        marks.update(&after, &hit, 1.0);
        marks.update(&before, &[Peak::default()], 1.0);
        assert_eq!((mark(&marks, &before), marks.flash(0)), (None, 0.0));
        marks.update(&after, &hit, 1.0);
        assert!(mark(&marks, &after).is_some());
        marks.clear(1e-3);
        // Impacts before that time are not new.
        marks.update(&after, &hit, 1.0);
        assert_eq!((mark(&marks, &after), marks.flash(0)), (None, 0.0));
    }

    #[test]
    fn a_lasting_contact_is_neither_marked_nor_flashed() {
        let mut marks = PeakMarks::new();
        for k in 1..100 {
            let time = f64::from(k) * 1e-3;
            let force = 8.0 + 4.0 * (100.0 * time).sin();
            let shown = frame(time, force);
            marks.update(&shown, &peak(time, force, 0), 0.05);
            assert_eq!((mark(&marks, &shown), marks.flash(0)), (None, 0.0));
        }
    }

    #[test]
    fn an_impact_resolved_by_frames_is_marked_once_its_force_falls() {
        // The contact begins at the end of a step, in a frame of its own: still without force.
        let mut marks = PeakMarks::new();
        marks.update(&frame(1e-6, 0.0), &peak(0.0, 0.0, 1), 80e-6);
        for k in 2..=60 {
            let time = f64::from(k) * 1e-6;
            let force = 600.0 * (std::f64::consts::PI * f64::from(k) / 60.0).sin();
            let shown = frame(time, force);
            let strongest = force.max(600.0 * (std::f64::consts::PI * f64::from(k - 1) / 60.0).sin());
            let at = if k <= 30 { time } else { time - 1e-6 };
            marks.update(&shown, &peak(at, strongest, 0), 80e-6);
            let mark = mark(&marks, &shown);
            assert_eq!(mark.is_some(), k > 36, "{k}: {mark:?}");
            if let Some(mark) = mark {
                assert!((mark.force.x - 600.0).abs() < 1e-3 && (mark.age - (time - 30e-6)).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_peak_after_the_displayed_instant_is_marked_when_it_is_reached() {
        let mut marks = PeakMarks::new();
        let shown = frame(1.0e-3, 0.0);
        marks.update(&shown, &peak(1.2e-3, 500.0, 1), 0.1);
        assert_eq!((mark(&marks, &shown), marks.flash(0)), (None, 0.0));
        assert_eq!(marks.reference(&ArrowOptions::default()), 1.0);
        let shown = frame(1.3e-3, 0.0);
        marks.update(&shown, &[Peak::default()], 0.1);
        assert!((mark(&marks, &shown).expect("a mark").age - 0.1e-3).abs() < 1e-12);
        assert_eq!(marks.reference(&ArrowOptions::default()), 500.0);
    }

    #[test]
    fn an_impact_before_its_peak_flashes_and_is_not_marked() {
        let mut marks = PeakMarks::new();
        let shown = frame(1.0e-3, 300.0);
        marks.update(&shown, &peak(1.001e-3, 310.0, 1), 0.1);
        assert_eq!(mark(&marks, &shown), None);
        assert!(marks.flash(0) > 0.9);
    }

    #[test]
    fn the_stronger_of_two_impacts_is_marked_until_it_has_faded_below_the_other() {
        let mut marks = PeakMarks::new();
        let mut impact = |time: f64, force: f64| {
            let shown = frame(time + 1e-4, 0.0);
            marks.update(&shown, &peak(time, force, 1), 0.1);
            mark(&marks, &shown).expect("a mark").force.x
        };
        assert_eq!(impact(0.01, 800.0), 800.0);
        assert_eq!(impact(0.02, 300.0), 800.0);
        assert_eq!(impact(0.08, 300.0), 300.0);
        assert_eq!(impact(0.09, 400.0), 400.0);
    }

    #[test]
    fn the_scale_is_a_round_number_that_covers_the_largest_force() {
        for (x, expect) in
            [(0.0, 1.0), (0.9, 1.0), (1.0, 1.0), (1.1, 2.0), (3.0, 5.0), (621.0, 1000.0), (771.0, 1000.0)]
        {
            assert!((round_up_125(x) / expect - 1.0).abs() < 1e-5, "{x}: {}", round_up_125(x));
        }
        let fixed = ArrowOptions { reference: Some(30.0), ..Default::default() };
        assert_eq!(PeakMarks::new().reference(&fixed), 30.0);
    }
}
