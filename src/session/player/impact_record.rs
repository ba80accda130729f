//! Impacts of a run: start and peak while an impact lasts, then the data that `run --impacts` writes.

use std::collections::VecDeque;

use crate::machine::Vec3;
use crate::simulate::{Impact, Peak, Simulation};

/// Most impacts stored; beyond that the oldest are dropped.
const MAX_IMPACTS: usize = 20_000;

/// Time after its start for which the end of an impact is awaited, s. A longer contact, such as a ball coming to rest on its
/// wall, has the peak of this time.
pub const MAX_IMPACT_DURATION: f64 = 10e-3;

/// Number of latest impacts that are searched for the one that ended last.
const MAX_SEARCHED: usize = 64;

/// Relative rounding difference between the times of a record and of an impact.
const ROUNDING: f64 = 1e-12;

/// The largest normal force of an impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForcePeak {
    /// Time, s.
    pub time: f64,
    /// Force on the ball, N, world axes.
    pub force: Vec3,
}

/// An impact.
#[derive(Clone, Debug)]
pub struct RecordedImpact {
    /// Ball joint.
    pub joint: usize,
    /// Start, s; accurate to within a step until the impact is over.
    pub start: f64,
    /// Time at which the ball left its wall, s; infinite in contact, and until the next impact if a change removed the wall.
    pub end: f64,
    /// Its largest force.
    pub force_peak: ForcePeak,
    /// Numbers of the steps in which it began and in which its end became known.
    steps: [u64; 2],
    impact: Option<Impact>,
}

impl RecordedImpact {
    /// Complete data once it is over; `None` before that, and if a change of the contact ended it.
    pub fn finished(&self) -> Option<&Impact> {
        self.impact.as_ref()
    }

    /// Whether it had begun by `time`, s.
    fn has_begun(&self, time: f64) -> bool {
        self.start <= time + ROUNDING * time.abs()
    }
}

/// The impacts of a run in the order in which they began. Retraced steps add none.
#[derive(Clone, Debug, Default)]
pub struct ImpactRecord {
    all: VecDeque<RecordedImpact>,
    dropped: u64,
    /// Largest force so far of the impact in progress, by joint.
    in_progress: Vec<Option<ForcePeak>>,
    /// Number of accepted steps recorded, and start and end of the latest, s.
    steps: u64,
    latest_step: [f64; 2],
    /// Impacts that ended in the latest step.
    ended: Vec<Impact>,
}

impl ImpactRecord {
    /// Begins a new run; `peaks` contain the impacts that begin with it.
    pub(super) fn begin(&mut self, peaks: &[Peak]) {
        *self = Self { in_progress: vec![None; peaks.len()], ..Self::default() };
        for (joint, peak) in peaks.iter().enumerate().filter(|(_, peak)| begins_impact(peak)) {
            self.add(joint, peak);
        }
    }

    /// Records the latest step with its `peaks`; to be called after every step.
    pub(super) fn record(&mut self, simulation: &mut Simulation, peaks: &[Peak]) {
        let mut ended = std::mem::take(&mut self.ended);
        ended.clear();
        simulation.take_impacts(&mut ended);
        let steps = simulation.statistics().steps;
        if steps > self.steps {
            self.steps = steps;
            self.latest_step = [simulation.step_start(), simulation.time()];
            for (joint, peak) in peaks.iter().enumerate() {
                self.record_joint(joint, peak, ended.iter().find(|impact| impact.joint == joint));
            }
        }
        self.ended = ended;
    }

    fn record_joint(&mut self, joint: usize, peak: &Peak, ended: Option<&Impact>) {
        let begins = begins_impact(peak);
        // An impact that ends began in an earlier step or in this one.
        let (before, now) = match ended {
            Some(impact) if begins && impact.start >= self.latest_step[0] => (None, ended),
            _ => (ended, None),
        };
        if let Some(impact) = before {
            self.raise_peak(joint, peak);
            self.end_contact(joint, impact.end, Some(impact));
        }
        if begins {
            self.add(joint, peak);
        }
        self.raise_peak(joint, peak);
        if let Some(impact) = now {
            self.end_contact(joint, impact.end, Some(impact));
        }
    }

    fn add(&mut self, joint: usize, peak: &Peak) {
        // Without a force yet, it begins at the end of the step.
        let start = self.latest_step[usize::from(peak.normal <= 0.0)];
        // A change has removed the wall of the previous impact.
        self.end_contact(joint, start, None);
        if self.all.len() == MAX_IMPACTS {
            self.all.pop_front();
            self.dropped += 1;
        }
        let force_peak = ForcePeak { time: start, force: Vec3::zeros() };
        self.in_progress[joint] = Some(force_peak);
        let steps = [self.steps, u64::MAX];
        self.all.push_back(RecordedImpact { joint, start, end: f64::INFINITY, force_peak, steps, impact: None });
    }

    /// Updates the peak of the impact in progress at `joint` with the latest step.
    fn raise_peak(&mut self, joint: usize, peak: &Peak) {
        let Some(force_peak) = &mut self.in_progress[joint] else {
            return;
        };
        if peak.normal <= force_peak.force.norm() || peak.time < force_peak.time {
            return;
        }
        *force_peak = ForcePeak { time: peak.time, force: peak.normal_force };
        let force_peak = *force_peak;
        let own = self.all.iter_mut().rev().find(|impact| impact.joint == joint);
        if let Some(own) = own.filter(|own| force_peak.time <= own.start + MAX_IMPACT_DURATION) {
            own.force_peak = force_peak;
        }
    }

    /// Ends the contact of `joint` at `time`, s; `impact` is `None` if a change ended it.
    fn end_contact(&mut self, joint: usize, time: f64, impact: Option<&Impact>) {
        let Some(force_peak) = self.in_progress[joint].take() else {
            return;
        };
        let Some(at) = self.all.iter().rposition(|own| own.joint == joint && own.end.is_infinite()) else {
            return;
        };
        let Some(mut own) = self.all.remove(at) else {
            return;
        };
        (own.end, own.steps[1], own.impact) = (time, self.steps, impact.copied());
        if let Some(impact) = impact {
            (own.start, own.force_peak) = (impact.start, force_peak);
        }
        // Another may have begun earlier in the same step.
        let at = self.all.partition_point(|other| other.start <= own.start);
        self.all.insert(at, own);
    }

    /// Drops everything after `time`, s, and step number `steps`.
    pub(super) fn truncate(&mut self, time: f64, steps: u64) {
        self.all.retain(|impact| impact.steps[0] <= steps);
        self.in_progress.fill(None);
        for impact in &mut self.all {
            if impact.steps[1] > steps {
                (impact.end, impact.steps[1], impact.impact) = (f64::INFINITY, u64::MAX, None);
                if impact.force_peak.time > time {
                    impact.force_peak = ForcePeak { time: impact.start, force: Vec3::zeros() };
                }
                self.in_progress[impact.joint] = Some(impact.force_peak);
            }
        }
        self.steps = self.steps.min(steps);
        self.latest_step = self.latest_step.map(|end| end.min(time));
    }

    /// All recorded impacts, in order, with their numbers in the run, from 1.
    fn numbered(&self) -> impl DoubleEndedIterator<Item = (u64, &RecordedImpact)> {
        let first = self.dropped + 1;
        self.all.iter().enumerate().map(move |(at, impact)| (first + at as u64, impact))
    }

    /// The impacts that had ended by `time`, s, with their numbers in the run, from 1.
    pub fn until(&self, time: f64) -> impl DoubleEndedIterator<Item = (u64, &RecordedImpact, &Impact)> {
        let ended = self.numbered().filter(move |(_, impact)| impact.end <= time);
        ended.filter_map(|(number, own)| Some((number, own, own.finished()?)))
    }

    /// The impacts of ball joint `joint`, or of any, that had begun by `time`, s, and whose end is known; the latest first.
    pub fn latest(&self, joint: Option<usize>, time: f64) -> impl Iterator<Item = &Impact> {
        let begun = self.all.iter().rev().filter(move |impact| impact.has_begun(time) && is_of(joint, impact));
        begun.filter_map(RecordedImpact::finished)
    }

    /// The impact that ended last, but not after `end`, s, among the latest that had begun by `time`, s.
    pub fn last_ended(&self, time: f64, end: f64) -> Option<&Impact> {
        let ended = self.latest(None, time).filter(|impact| impact.end <= end);
        ended.take(MAX_SEARCHED).max_by(|a, b| a.end.total_cmp(&b.end))
    }

    /// The impact in progress at `time`, s, of ball joint `joint`, or of any, once its peak is known; resting balls are
    /// excluded. Among several, the one that peaks at that instant, otherwise the one that began last.
    pub fn in_progress(&self, joint: Option<usize>, time: f64) -> Option<(u64, &RecordedImpact)> {
        let touching = || {
            let own = self.numbered().rev().filter(move |(_, impact)| is_of(joint, impact));
            let touches = move |impact: &RecordedImpact| match impact.end {
                end if end.is_infinite() => time <= impact.start + MAX_IMPACT_DURATION,
                end => time <= end,
            };
            own.filter(move |(_, impact)| impact.has_begun(time) && touches(impact) && !self.may_still_peak(impact))
        };
        touching().find(|(_, impact)| impact.force_peak.time == time).or_else(|| touching().next())
    }

    /// Whether `impact` may still reach its peak.
    fn may_still_peak(&self, impact: &RecordedImpact) -> bool {
        impact.end.is_infinite() && self.latest_step[1] <= impact.start + MAX_IMPACT_DURATION
    }

    /// The first peak after `time`, s, of an impact of ball joint `joint`, or of any. `None` while an earlier one may still
    /// come; with `at_once` the first known so far.
    pub fn next_peak(&self, joint: Option<usize>, time: f64, at_once: bool) -> Option<f64> {
        let own = || self.all.iter().filter(|impact| is_of(joint, impact));
        let peaks = own().map(|impact| impact.force_peak.time).filter(|peak| *peak > time);
        let next = peaks.min_by(f64::total_cmp)?;
        let open = own().any(|impact| self.may_still_peak(impact) && impact.start <= next);
        (at_once || !open).then_some(next)
    }

    /// The last peak before `time`, s, of an impact of ball joint `joint`, or of any.
    pub fn previous_peak(&self, joint: Option<usize>, time: f64) -> Option<f64> {
        // A force that is largest in the latest step may still rise.
        let may_rise =
            |impact: &RecordedImpact| self.may_still_peak(impact) && impact.force_peak.time >= self.latest_step[0];
        let own = self.all.iter().filter(|impact| is_of(joint, impact) && !may_rise(impact));
        own.map(|impact| impact.force_peak.time).filter(|peak| *peak < time).max_by(f64::total_cmp)
    }

    /// The peaks after `from` and up to `to`, s, with the ball joint of each.
    pub fn peaks(&self, from: f64, to: f64) -> impl Iterator<Item = (usize, ForcePeak)> {
        let within = move |force_peak: &ForcePeak| {
            force_peak.time > from && force_peak.time <= to && force_peak.force != Vec3::zeros()
        };
        self.all
            .iter()
            .map(|impact| (impact.joint, impact.force_peak))
            .filter(move |(_, force_peak)| within(force_peak))
    }

    /// Number of impacts dropped.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }
}

/// Whether an impact begins in the step of `peak`. A ball that reaches its wall at zero speed is no impact.
fn begins_impact(peak: &Peak) -> bool {
    peak.impacts > 0 && peak.approach_speed > 0.0
}

fn is_of(joint: Option<usize>, impact: &RecordedImpact) -> bool {
    joint.is_none_or(|joint| joint == impact.joint)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Step, s.
    const STEP: f64 = 1e-3;

    /// Peak of `force`, N, at the end of step `k`; `speed`: an impact begins with it.
    fn peak(k: u64, force: f64, speed: Option<f64>) -> Peak {
        Peak {
            normal: force,
            time: if force > 0.0 { k as f64 * STEP } else { 0.0 },
            normal_force: Vec3::new(force, 0.0, 0.0),
            impacts: u32::from(speed.is_some()),
            approach_speed: speed.unwrap_or(0.0),
            ..Peak::default()
        }
    }

    /// Records the steps of one joint with its forces, N, from step `k` on. The first begins an impact; the last ends it if
    /// `ends`.
    fn contact(record: &mut ImpactRecord, joint: usize, k: u64, forces: &[f64], ends: bool) {
        let last = k + forces.len() as u64 - 1;
        for (now, force) in (k..).zip(forces) {
            (record.steps, record.latest_step) = (now, [(now - 1) as f64 * STEP, now as f64 * STEP]);
            let [start, end] = [k as f64 * STEP, last as f64 * STEP];
            let impact = Impact { joint, start, end, ..Impact::default() };
            let ended = Some(&impact).filter(|_| ends && now == last);
            record.record_joint(joint, &peak(now, *force, (now == k).then_some(0.1)), ended);
        }
    }

    fn record() -> ImpactRecord {
        let mut record = ImpactRecord::default();
        record.begin(&[Peak::default(); 2]);
        contact(&mut record, 0, 2, &[0.0, 5.0, 9.0, 4.0], true);
        contact(&mut record, 1, 7, &[0.0, 3.0, 1.0, 6.0, 2.0], true);
        record
    }

    #[test]
    fn impacts_are_numbered_and_their_peaks_are_found_forwards_and_backwards() {
        let mut record = record();
        let numbers = |record: &ImpactRecord, time| record.until(time).map(|(number, ..)| number).collect::<Vec<_>>();
        assert_eq!(numbers(&record, 4e-3), [0; 0]);
        assert_eq!(numbers(&record, 5e-3), [1]);
        assert_eq!(numbers(&record, 1.0), [1, 2]);
        // Joint 1 has two maxima; the larger is its peak.
        assert_eq!(
            [record.next_peak(None, 0.0, false), record.next_peak(None, 4e-3, false)],
            [Some(4e-3), Some(10e-3)]
        );
        assert_eq!(record.next_peak(Some(1), 0.0, false), Some(10e-3));
        assert_eq!(record.next_peak(None, 10e-3, true), None);
        assert_eq!([record.previous_peak(None, 1.0), record.previous_peak(None, 10e-3)], [Some(10e-3), Some(4e-3)]);
        assert_eq!(record.previous_peak(Some(1), 10e-3), None);
        let at = |joint, time| record.in_progress(joint, time).map(|(number, _)| number);
        assert_eq!([at(None, 2e-3), at(None, 6e-3), at(Some(0), 9e-3), at(None, 9e-3)], [Some(1), None, None, Some(2)]);
        let peaks: Vec<(usize, f64)> =
            record.peaks(0.0, 9.9e-3).map(|(joint, force_peak)| (joint, force_peak.force.x)).collect();
        assert_eq!(peaks, [(0, 9.0)]);
        assert_eq!(record.latest(None, 8e-3).next().map(|impact| impact.joint), Some(1));
        assert_eq!(record.latest(Some(0), 8e-3).count(), 1);
        // Retraced steps would add nothing; those of a new branch do.
        record.truncate(8e-3, 8);
        assert_eq!(numbers(&record, 1.0), [1]);
        assert_eq!(record.next_peak(None, 4e-3, false), None, "the impact is in progress again");
        contact(&mut record, 0, 9, &[0.0, 1.0, 0.5], true);
        record.record_joint(
            1,
            &peak(12, 8.0, None),
            Some(&Impact { joint: 1, start: 7e-3, end: 12e-3, ..Impact::default() }),
        );
        assert_eq!(numbers(&record, 1.0), [1, 2, 3]);
        assert_eq!(record.previous_peak(None, 1.0), Some(12e-3));
    }

    #[test]
    fn among_simultaneous_impacts_the_one_at_its_peak_is_chosen_otherwise_the_latest() {
        let mut record = ImpactRecord::default();
        record.begin(&[Peak::default(); 2]);
        // Both in the steps 1 to 5.
        for k in 1..=5_u64 {
            (record.steps, record.latest_step) = (k, [(k - 1) as f64 * STEP, k as f64 * STEP]);
            for (joint, force_peak) in [(0, 2), (1, 4)] {
                let impact = Impact { joint, start: STEP, end: 5e-3, ..Impact::default() };
                let force = if k == 1 { 0.0 } else { 9.0 - k.abs_diff(force_peak) as f64 };
                record.record_joint(joint, &peak(k, force, (k == 1).then_some(0.1)), Some(&impact).filter(|_| k == 5));
            }
        }
        let at = |time| record.in_progress(None, time).map(|(_, impact)| impact.joint);
        assert_eq!([at(2e-3), at(3e-3), at(4e-3)], [Some(0), Some(1), Some(1)]);
    }

    #[test]
    fn a_resting_contact_has_the_peak_of_its_first_10_ms_and_a_finished_one_that_of_its_whole_duration() {
        let mut record = ImpactRecord::default();
        record.begin(&[Peak::default()]);
        let mut forces = vec![0.0, 5.0, 8.0];
        forces.resize(8, 3.0);
        contact(&mut record, 0, 1, &forces, false);
        // The impact may still end in time.
        assert_eq!((record.next_peak(None, 0.0, false), record.next_peak(None, 0.0, true)), (None, Some(3e-3)));
        assert_eq!((record.previous_peak(None, 1.0), record.previous_peak(None, 3e-3)), (Some(3e-3), None));
        assert!(record.in_progress(None, 2e-3).is_none());
        for k in 9..40 {
            (record.steps, record.latest_step) = (k, [(k - 1) as f64 * STEP, k as f64 * STEP]);
            record.record_joint(0, &peak(k, if k == 30 { 9.0 } else { 4.0 }, None), None);
        }
        assert_eq!(record.next_peak(None, 0.0, false), Some(3e-3));
        assert!(record.in_progress(None, 35e-3).is_none(), "a resting contact");
        let (_, lasting) = record.in_progress(None, 9e-3).expect("in contact");
        assert!(lasting.finished().is_none() && lasting.force_peak.force.x == 8.0);
        (record.steps, record.latest_step) = (40, [39e-3, 40e-3]);
        let impact = Impact { start: 1e-3, end: 40e-3, peak: 9.0, ..Impact::default() };
        record.record_joint(0, &peak(40, 1.0, None), Some(&impact));
        assert_eq!(record.next_peak(None, 0.0, false), Some(30e-3));
    }

    #[test]
    fn a_rising_force_has_no_peak_yet_and_an_impact_without_an_end_ends_when_the_next_begins() {
        let mut record = ImpactRecord::default();
        // An impact begins with the run.
        record.begin(&[peak(0, 0.0, Some(0.1))]);
        assert_eq!((record.next_peak(None, 0.0, false), record.previous_peak(None, 1.0)), (None, None));
        for k in 1..=3 {
            (record.steps, record.latest_step) = (k, [(k - 1) as f64 * STEP, k as f64 * STEP]);
            record.record_joint(0, &peak(k, k as f64, None), None);
            assert_eq!((record.next_peak(None, 0.0, false), record.previous_peak(None, 1.0)), (None, None));
        }
        contact(&mut record, 0, 6, &[0.0, 2.0, 1.0], true);
        assert_eq!(record.next_peak(None, 0.0, false), Some(3e-3));
        assert_eq!(record.until(1.0).count(), 1);
        assert!(record.in_progress(None, 7e-3).is_some_and(|(number, _)| number == 2));
        // A contact at zero speed is no impact.
        record.record_joint(0, &peak(20, 1.0, Some(0.0)), None);
        assert_eq!(record.next_peak(None, 8e-3, true), None);
    }

    #[test]
    fn the_number_of_stored_impacts_is_bounded_and_the_oldest_are_dropped() {
        let mut record = ImpactRecord::default();
        record.begin(&[Peak::default()]);
        for k in 0..MAX_IMPACTS as u64 + 7 {
            contact(&mut record, 0, 3 * k + 1, &[0.0, 2.0, 1.0], true);
        }
        assert_eq!((record.all.len(), record.dropped()), (MAX_IMPACTS, 7));
        assert_eq!(record.until(f64::INFINITY).map(|(number, ..)| number).next(), Some(8));
        assert!(MAX_IMPACTS * size_of::<RecordedImpact>() < 5_000_000);
    }
}
