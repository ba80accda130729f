//! Impacts of a run: start and peak while an impact lasts, then the data that `run --impacts` writes.

use std::collections::VecDeque;

use crate::simulate::{ForcePeak, Impact, ImpactEvent, Simulation, State};

/// Most impacts stored; beyond that the oldest are dropped.
const MAX_IMPACTS: usize = 20_000;

/// Time after its start for which the end of an impact is awaited, s. A longer contact, such as a ball coming to rest on its
/// wall, has the peak of this time.
pub const MAX_IMPACT_DURATION: f64 = 10e-3;

/// Number of latest impacts that are searched for the one that ended last.
const MAX_SEARCHED: usize = 64;

/// Relative rounding difference between the times of a record and of an impact.
const ROUNDING: f64 = 1e-12;

/// An impact.
#[derive(Clone, Debug)]
pub struct RecordedImpact {
    /// Its number in [`ImpactEvent`].
    id: u64,
    /// Joint with play.
    pub joint: usize,
    /// Where in it: [`Impact::place`].
    pub place: u8,
    /// Start, s.
    pub start: f64,
    /// Time at which the ball left its wall, or at which a change removed the wall, s; infinite in contact.
    pub end: f64,
    /// Its largest force; while it lasts, that of its first 10 ms.
    pub force_peak: ForcePeak,
    /// Its largest force so far.
    largest: ForcePeak,
    impact: Option<Impact>,
}

impl RecordedImpact {
    /// Complete data once it is over; `None` before that, and if a change of the contact ended it.
    pub fn finished(&self) -> Option<&Impact> {
        self.impact.as_ref()
    }

    fn raise(&mut self, peak: ForcePeak) {
        self.largest = peak;
        if peak.time <= self.start + MAX_IMPACT_DURATION {
            self.force_peak = peak;
        }
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
    /// Number of the next impact to begin.
    next: u64,
    /// Start and end of the latest step, s.
    latest_step: [f64; 2],
}

impl ImpactRecord {
    /// Begins a new run, with the impacts that begin with it.
    pub(super) fn begin(&mut self, state: &State) {
        *self = Self::default();
        for (id, impact, _) in state.impacts_under_way() {
            self.apply(ImpactEvent::Began { id, joint: impact.joint, place: impact.place, start: impact.start });
        }
    }

    /// Records the latest step; to be called after every step.
    pub(super) fn record(&mut self, simulation: &mut Simulation) {
        if simulation.time() > self.latest_step[1] {
            self.latest_step = [simulation.step_start(), simulation.time()];
        }
        simulation.take_events().for_each(|event| self.apply(event));
    }

    /// Records what happened; what is known already changes nothing.
    fn apply(&mut self, event: ImpactEvent) {
        match event {
            ImpactEvent::Began { id, joint, place, start } if id >= self.next => {
                self.next = id + 1;
                if self.all.len() == MAX_IMPACTS {
                    self.all.pop_front();
                    self.dropped += 1;
                }
                let force_peak = ForcePeak { time: start, ..ForcePeak::default() };
                let (end, largest) = (f64::INFINITY, force_peak);
                let own = RecordedImpact { id, joint, place, start, end, force_peak, largest, impact: None };
                // Another may have begun later in the same step.
                let at = self.all.partition_point(|other| other.start <= start);
                self.all.insert(at, own);
            }
            ImpactEvent::Began { .. } => {}
            ImpactEvent::Peaked { id, peak } => {
                let rises = |own: &&mut RecordedImpact| {
                    own.end.is_infinite() && peak.force.norm_squared() > own.largest.force.norm_squared()
                };
                if let Some(own) = self.find(id).filter(rises) {
                    own.raise(peak);
                }
            }
            ImpactEvent::Ended { id, end, impact } => {
                if let Some(own) = self.find(id) {
                    (own.end, own.impact) = (end, impact);
                    if impact.is_some() {
                        own.force_peak = own.largest;
                    }
                }
            }
        }
    }

    fn find(&mut self, id: u64) -> Option<&mut RecordedImpact> {
        self.all.iter_mut().rev().find(|own| own.id == id)
    }

    /// Drops everything after `state`, of the same run.
    pub(super) fn truncate(&mut self, state: &State) {
        self.next = self.next.min(state.impacts_begun());
        let next = self.next;
        self.all.retain(|own| own.id < next);
        for (id, _, peak) in state.impacts_under_way() {
            if let Some(own) = self.find(id) {
                (own.end, own.impact) = (f64::INFINITY, None);
                if own.force_peak.time > state.time() {
                    own.force_peak = ForcePeak { time: own.start, ..ForcePeak::default() };
                }
                own.raise(peak);
            }
        }
        self.latest_step = self.latest_step.map(|end| end.min(state.time()));
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

    /// The impacts of joint `joint`, or of any, that had begun by `time`, s, and whose end is known; the latest first.
    pub fn latest(&self, joint: Option<usize>, time: f64) -> impl Iterator<Item = &Impact> {
        let begun = self.all.iter().rev().filter(move |impact| impact.has_begun(time) && is_of(joint, impact));
        begun.filter_map(RecordedImpact::finished)
    }

    /// The impact that ended last, but not after `end`, s, among the latest that had begun by `time`, s.
    pub fn last_ended(&self, time: f64, end: f64) -> Option<&Impact> {
        let ended = self.latest(None, time).filter(|impact| impact.end <= end);
        ended.take(MAX_SEARCHED).max_by(|a, b| a.end.total_cmp(&b.end))
    }

    /// The impact with the largest force of those that had peaked by `time`, s, with its number in the run, from 1.
    pub fn hardest(&self, time: f64) -> Option<(u64, &RecordedImpact)> {
        let peaked = self.numbered().filter(|(_, own)| own.force_peak.time <= time);
        let force = |own: &RecordedImpact| own.force_peak.force.norm_squared();
        peaked.filter(|(_, own)| force(own) > 0.0).max_by(|(_, a), (_, b)| force(a).total_cmp(&force(b)))
    }

    /// The impact in progress at `time`, s, of joint `joint`, or of any, once its peak is known; resting parts are
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

    /// The first peak after `time`, s, of an impact of joint `joint`, or of any. `None` while an earlier one may still
    /// come; with `at_once` the first known so far.
    pub fn next_peak(&self, joint: Option<usize>, time: f64, at_once: bool) -> Option<f64> {
        let own = || self.all.iter().filter(|impact| is_of(joint, impact));
        let peaks = own().map(|impact| impact.force_peak.time).filter(|peak| *peak > time);
        let next = peaks.min_by(f64::total_cmp)?;
        let open = own().any(|impact| self.may_still_peak(impact) && impact.start <= next);
        (at_once || !open).then_some(next)
    }

    /// The last peak before `time`, s, of an impact of joint `joint`, or of any.
    pub fn previous_peak(&self, joint: Option<usize>, time: f64) -> Option<f64> {
        // A force that is largest in the latest step may still rise.
        let may_rise =
            |impact: &RecordedImpact| self.may_still_peak(impact) && impact.force_peak.time >= self.latest_step[0];
        let own = self.all.iter().filter(|impact| is_of(joint, impact) && !may_rise(impact));
        own.map(|impact| impact.force_peak.time).filter(|peak| *peak < time).max_by(f64::total_cmp)
    }

    /// The peaks after `from` and up to `to`, s, with the joint of each.
    pub fn peaks(&self, from: f64, to: f64) -> impl Iterator<Item = (usize, ForcePeak)> {
        let within = move |force_peak: &ForcePeak| {
            force_peak.time > from && force_peak.time <= to && force_peak.force.norm_squared() > 0.0
        };
        self.all
            .iter()
            .map(|impact| (impact.joint, impact.force_peak))
            .filter(move |(_, force_peak)| within(force_peak))
    }

    /// Where joint `joint` was hit by the impact that peaks at `time`, s; otherwise by the latest in progress then.
    pub fn place_of_peak(&self, joint: usize, time: f64) -> Option<u8> {
        let touching = || {
            let own = self.all.iter().rev().take(MAX_SEARCHED).filter(move |own| own.joint == joint);
            own.filter(move |own| own.has_begun(time) && own.end >= time)
        };
        let peaks = |own: &&RecordedImpact| own.force_peak.time == time || own.largest.time == time;
        touching().find(peaks).or_else(|| touching().next()).map(|own| own.place)
    }

    /// Number of impacts dropped.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }
}

fn is_of(joint: Option<usize>, impact: &RecordedImpact) -> bool {
    joint.is_none_or(|joint| joint == impact.joint)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::Vec3;

    /// Step, s.
    const STEP: f64 = 1e-3;

    /// The end of step `k`, s.
    fn end(k: u64) -> f64 {
        k as f64 * STEP
    }

    impl ImpactRecord {
        /// Passes to step `k`.
        fn step(&mut self, k: u64) {
            self.latest_step = [end(k.max(1) - 1), end(k)];
        }

        /// An impact of `joint` begins at the end of step `k`; returns its number.
        fn begins(&mut self, joint: usize, k: u64) -> u64 {
            self.step(k);
            let id = self.next;
            self.apply(ImpactEvent::Began { id, joint, place: 0, start: end(k) });
            id
        }

        /// Impact `id` is pressed with `force`, N, at the end of step `k`.
        fn pressed(&mut self, id: u64, k: u64, force: f64) {
            self.step(k);
            let peak = ForcePeak { time: end(k), force: Vec3::new(force, 0.0, 0.0) };
            self.apply(ImpactEvent::Peaked { id, peak });
        }

        /// Impact `id` ends with step `k`.
        fn ends(&mut self, id: u64, k: u64) {
            self.step(k);
            let own = self.find(id).expect("recorded");
            let impact = Impact { joint: own.joint, start: own.start, end: end(k), ..Impact::default() };
            self.apply(ImpactEvent::Ended { id, end: end(k), impact: Some(impact) });
        }

        /// An impact of `joint` in the steps from `k` on, with these forces, N, at their ends.
        fn contact(&mut self, joint: usize, k: u64, forces: &[f64]) {
            let id = self.begins(joint, k);
            for (now, force) in (k..).zip(forces) {
                self.pressed(id, now, *force);
            }
            self.ends(id, k + forces.len() as u64 - 1);
        }
    }

    fn record() -> ImpactRecord {
        let mut record = ImpactRecord::default();
        record.contact(0, 2, &[0.0, 5.0, 9.0, 4.0]);
        record.contact(1, 7, &[0.0, 3.0, 1.0, 6.0, 2.0]);
        record
    }

    #[test]
    fn impacts_are_numbered_and_their_peaks_are_found_forwards_and_backwards() {
        let record = record();
        let numbers = |time| record.until(time).map(|(number, ..)| number).collect::<Vec<_>>();
        assert_eq!(numbers(4e-3), [0; 0]);
        assert_eq!(numbers(5e-3), [1]);
        assert_eq!(numbers(1.0), [1, 2]);
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
    }

    #[test]
    fn events_of_retraced_steps_change_nothing() {
        let mut retraced = record();
        let again = record();
        for own in &again.all {
            retraced.apply(ImpactEvent::Began { id: own.id, joint: own.joint, place: own.place, start: own.start });
            let peak = ForcePeak { force: own.largest.force * 0.5, ..own.largest };
            retraced.apply(ImpactEvent::Peaked { id: own.id, peak });
            retraced.apply(ImpactEvent::Ended { id: own.id, end: own.end, impact: own.impact });
        }
        let all = |record: &ImpactRecord| format!("{:?}", record.all);
        assert_eq!(all(&retraced), all(&again));
    }

    #[test]
    fn among_simultaneous_impacts_the_one_at_its_peak_is_chosen_otherwise_the_latest() {
        let mut record = ImpactRecord::default();
        // Both in the steps 1 to 5.
        let both = [(0, 2_u64), (1, 4)].map(|(joint, peak)| (record.begins(joint, 1), peak));
        for k in 2..=5_u64 {
            both.iter().for_each(|(id, peak)| record.pressed(*id, k, 9.0 - k.abs_diff(*peak) as f64));
        }
        both.iter().for_each(|(id, _)| record.ends(*id, 5));
        let at = |time| record.in_progress(None, time).map(|(_, impact)| impact.joint);
        assert_eq!([at(2e-3), at(3e-3), at(4e-3)], [Some(0), Some(1), Some(1)]);
    }

    #[test]
    fn a_resting_contact_has_the_peak_of_its_first_10_ms_and_a_finished_one_that_of_its_whole_duration() {
        let mut record = ImpactRecord::default();
        let id = record.begins(0, 1);
        [5.0, 8.0, 3.0, 3.0, 3.0].iter().zip(2..).for_each(|(force, k)| record.pressed(id, k, *force));
        // The impact may still end in time.
        assert_eq!((record.next_peak(None, 0.0, false), record.next_peak(None, 0.0, true)), (None, Some(3e-3)));
        assert_eq!((record.previous_peak(None, 1.0), record.previous_peak(None, 3e-3)), (Some(3e-3), None));
        assert!(record.in_progress(None, 2e-3).is_none());
        (9..40).for_each(|k| record.pressed(id, k, if k == 30 { 9.0 } else { 4.0 }));
        assert_eq!(record.next_peak(None, 0.0, false), Some(3e-3));
        assert!(record.in_progress(None, 35e-3).is_none(), "a resting contact");
        let (_, lasting) = record.in_progress(None, 9e-3).expect("in contact");
        assert!(lasting.finished().is_none() && lasting.force_peak.force.x == 8.0);
        record.ends(id, 40);
        assert_eq!(record.next_peak(None, 0.0, false), Some(30e-3));
    }

    #[test]
    fn a_rising_force_has_no_peak_yet_and_an_impact_without_its_wall_is_not_finished() {
        let mut record = ImpactRecord::default();
        let id = record.begins(0, 0);
        assert_eq!((record.next_peak(None, 0.0, false), record.previous_peak(None, 1.0)), (None, None));
        for k in 1..=3 {
            record.pressed(id, k, k as f64);
            assert_eq!((record.next_peak(None, 0.0, false), record.previous_peak(None, 1.0)), (None, None));
        }
        record.apply(ImpactEvent::Ended { id, end: 4e-3, impact: None });
        record.contact(0, 6, &[0.0, 2.0, 1.0]);
        assert_eq!(record.next_peak(None, 0.0, false), Some(3e-3));
        assert_eq!(record.until(1.0).count(), 1);
        assert!(record.in_progress(None, 7e-3).is_some_and(|(number, _)| number == 2));
    }

    #[test]
    fn the_number_of_stored_impacts_is_bounded_and_the_oldest_are_dropped() {
        let mut record = ImpactRecord::default();
        for k in 0..MAX_IMPACTS as u64 + 7 {
            record.contact(0, 3 * k + 1, &[0.0, 2.0, 1.0]);
        }
        assert_eq!((record.all.len(), record.dropped()), (MAX_IMPACTS, 7));
        assert_eq!(record.until(f64::INFINITY).map(|(number, ..)| number).next(), Some(8));
        assert!(MAX_IMPACTS * size_of::<RecordedImpact>() < 5_000_000);
    }
}
