//! Going back in time and continuing from there: any instant is displayed by restoring the nearest earlier keyframe and
//! repeating the same steps and logged events. The result is bit-identical.

use super::contact_history::ContactHistory;
use super::impact_record::ImpactRecord;
use super::keyframes::Keyframe;
use super::{FINEST_BIN, Known, Player};
use crate::session::log::Event;
use crate::session::paths::Paths;
use crate::session::settled::Settling;
use crate::simulate::{Bin, History};

/// Most steps retraced before a past instant, so that the plots show its history in detail.
const LEAD: u64 = 512;

/// Search horizon for the next impact, s.
const FARTHEST: f64 = 5.0;

/// A search for the next impact.
#[derive(Clone, Copy)]
pub(super) struct ImpactSearch {
    /// Ball joint; `None` for any.
    joint: Option<usize>,
    /// The peak must come after this instant, s.
    from: f64,
    /// Time at which the search ends, s.
    until: f64,
}

/// An event on the timeline.
#[derive(Clone, Debug, PartialEq)]
pub struct Flag {
    /// Time, s.
    pub time: f64,
    /// Description.
    pub words: String,
}

/// A future abandoned when the run branched before it.
#[derive(Clone, Debug)]
pub struct AbandonedFuture {
    /// Its record, including the time before the branch.
    pub history: History,
    /// Its contact states.
    pub contact_history: ContactHistory,
    /// Its events.
    pub flags: Vec<Flag>,
    /// Time of the branch, and latest displayed instant of this future, s.
    pub from: f64,
    #[allow(missing_docs)]
    pub to: f64,
}

/// Drops the bins from index `first` on that begin before `start`, s.
fn drop_before(bins: &mut Vec<Bin>, first: usize, start: f64) {
    let early = bins[first..].iter().take_while(|bin| bin.from < start);
    let count = early.count();
    bins.drain(first..first + count);
}

impl Player {
    /// Latest instant of the run ever displayed, s.
    pub fn reached(&self) -> f64 {
        self.reached
    }

    /// Whether anything after the displayed instant was displayed before, or any logged event is yet to be reapplied.
    pub fn has_future(&self) -> bool {
        self.pacer.shown() < self.reached || self.applied < self.log.entries.len()
    }

    /// The abandoned future, while it extends beyond the run.
    pub fn abandoned_future(&self) -> Option<&AbandonedFuture> {
        self.left.as_deref().filter(|left| left.to > self.reached)
    }

    /// Time up to which the run, or its abandoned future, is known, s.
    pub fn known_to(&self) -> f64 {
        self.abandoned_future().map_or(self.reached, |left| left.to)
    }

    /// Contact states of the ball joints over time.
    pub fn contact_history(&self) -> &ContactHistory {
        &self.contact_history
    }

    /// The impacts of the run.
    pub fn impact_record(&self) -> &ImpactRecord {
        &self.impact_record
    }

    /// Events of the run, its future included; a pull has only its start and end.
    pub fn flags(&self) -> impl Iterator<Item = Flag> {
        let entries = &self.log.entries;
        let pulls = |at: usize| matches!(entries[at].event, Event::Pull(Some(_)));
        let goes_on = move |at: usize| at > 0 && pulls(at) && pulls(at - 1);
        let times = self.event_times.iter().enumerate();
        times
            .filter(move |(at, _)| !goes_on(*at))
            .map(|(at, time)| Flag { time: *time, words: entries[at].event.words() })
    }

    /// Appends the bins of `channel` from `from` to `to`, s, to `out`, as [`History::bins`] does. Uses the window last
    /// retraced, in full detail, where possible, and the abandoned future beyond the latest displayed instant.
    pub fn bins(&self, channel: usize, from: f64, to: f64, most_bins: usize, out: &mut Vec<Bin>) {
        self.own_bins(channel, from, to, most_bins, out);
        let reached = self.reached;
        if let Some(left) = self.abandoned_future().filter(|_| to > reached) {
            let first = out.len();
            let from = from.max(reached);
            left.history.bins(channel, from, to, most_bins, out);
            drop_before(out, first, reached);
        }
    }

    fn own_bins(&self, channel: usize, from: f64, to: f64, most_bins: usize, out: &mut Vec<Bin>) {
        let near = self.near.as_ref().and_then(|near| near.span());
        let Some((start, end)) = near.filter(|(start, end)| *start < to && *end > from) else {
            return self.history.bins(channel, from, to, most_bins, out);
        };
        if from < start {
            let first = out.len();
            self.history.bins(channel, from, start, most_bins, out);
            // A wide bin may extend past `start`.
            let whole = out[first..].iter().filter(|bin| bin.to <= start).count();
            out.truncate(first + whole);
        }
        if let Some(near) = &self.near {
            near.bins(channel, from.max(start), to.min(end), most_bins, out);
        }
        if to > end {
            let first = out.len();
            self.history.bins(channel, end, to, most_bins, out);
            drop_before(out, first, end);
        }
    }

    /// Pauses and displays `time`, s: any instant displayed before.
    pub fn go_to(&mut self, time: f64) {
        self.set_paused();
        self.travel(time);
    }

    /// Goes to the peak of the next or previous impact of ball joint `joint` (`None`: any), or back to the start. If the next
    /// peak is not known yet, the run continues to it, frame by frame.
    pub fn go_to_impact(&mut self, joint: Option<usize>, forward: bool) {
        let shown = self.pacer.shown();
        if !forward {
            let found = self.impact_record.previous_peak(joint, shown);
            return self.go_to(found.unwrap_or(0.0));
        }
        let found = self.impact_record.next_peak(joint, shown, false);
        match found.filter(|time| *time <= self.reached) {
            Some(time) => self.go_to(time),
            None => {
                self.go_to(self.reached);
                let until = self.reached + FARTHEST;
                self.sought = Some(ImpactSearch { joint, from: shown, until });
            }
        }
    }

    /// Whether the run is seeking the next impact.
    pub fn is_seeking(&self) -> bool {
        self.sought.is_some()
    }

    /// Continues towards the sought impact within the budget of a frame.
    pub(super) fn seek(&mut self, sought: ImpactSearch) {
        self.go_on();
        let start = (self.clock)();
        let found = loop {
            let over = self.simulation.time() > sought.until || self.stopped.is_some();
            // Its results are displayed with it, so it has to be over.
            let found = self.impact_record.next_peak(sought.joint, sought.from, over);
            if found.is_some() || over || !self.pacer.may_step((self.clock)() - start) {
                break found.or(over.then_some(f64::INFINITY));
            }
            self.step();
            self.record_until(self.simulation.time());
        };
        self.reached = self.reached.max(self.recorded_to);
        if let Some(time) = found {
            self.sought = None;
            self.travel(time.min(self.reached));
        }
    }

    /// Steps back to the start of the latest step, or of the one before if that start is already displayed.
    pub fn step_back(&mut self) {
        self.set_paused();
        let Some(steps) = self.steps().checked_sub(1) else {
            return;
        };
        let before = |keyframe: &Keyframe| keyframe.state.steps() <= steps;
        let time = self.keyframes.latest(before).map(|k| k.state.time());
        if let Some(time) = time {
            self.restore_at(time);
            self.retrace(|player| player.steps() >= steps, f64::INFINITY);
            self.arrive(self.simulation.time());
        }
    }

    pub(super) fn set_paused(&mut self) {
        (self.playing, self.backwards) = (false, false);
        self.sought = None;
    }

    /// Displays `time`, s.
    pub(super) fn travel(&mut self, time: f64) {
        if !time.is_finite() {
            return;
        }
        let time = time.clamp(0.0, self.reached);
        let here = self.simulation.time();
        let run = self.unchanged.as_deref().unwrap_or(&self.simulation);
        // Any instant of the latest step can be sampled; if a change was made within it, from the run as it was before.
        let twin_reaches = self.twin.as_ref().is_none_or(|twin| twin.reaches(time));
        if !(run.step_start() < time && time <= here && twin_reaches) {
            let best = self.keyframes.latest(|k| k.state.time() <= time);
            let best = best.map_or(0.0, |k| k.state.time());
            if here > time || here < best {
                self.restore_at(time);
            }
            self.retrace(|player| player.simulation.time() >= time, time);
        }
        self.arrive(time);
    }

    /// Displays `time`, s, within the latest step, and reapplies the events logged there.
    fn arrive(&mut self, time: f64) {
        self.pacer.jump(time.min(self.simulation.time()));
        if time >= self.simulation.time().min(self.reached) {
            self.apply_due();
        }
        self.present();
    }

    /// Restores a keyframe before `time`, s: an earlier one if the history of that instant must be recorded in detail.
    fn restore_at(&mut self, time: f64) {
        let best = self.keyframes.latest(|k| k.state.time() <= time);
        let Some((start, steps)) = best.map(|k| (k.state.time(), k.state.steps())) else {
            return;
        };
        let span = self.near.as_ref().and_then(|near| near.span());
        if span.is_some_and(|(from, to)| from <= start && start <= to) {
            return self.restore(start, false);
        }
        let lead = time - self.automatic_window();
        let early = |k: &Keyframe| k.state.time() <= lead || k.state.steps() + LEAD <= steps;
        let first = self.keyframes.latest_kept(early);
        let start = first.map_or(0.0, |k| k.state.time());
        self.restore(start, true);
    }

    /// Restores the latest keyframe up to `time`, s; `anew` starts another detailed record there.
    fn restore(&mut self, time: f64, anew: bool) {
        let Some(keyframe) = self.keyframes.latest(|k| k.state.time() <= time) else {
            return;
        };
        self.simulation.restore(&keyframe.state);
        self.applied = keyframe.events;
        if let Some(twin) = &mut self.twin {
            twin.go_back(keyframe.twin.as_ref(), &self.simulation);
        }
        let now = self.simulation.time();
        self.stopped = None;
        self.unchanged = None;
        if now > self.recorded_to {
            // The time skipped was not recorded.
            self.paths = Paths::new(self.simulation.running());
        }
        self.recorded_to = now;
        let entries = self.log.entries[..self.applied].iter().rev();
        let mut schedules = entries.filter_map(|entry| entry.event.schedule());
        self.sections = schedules.next();
        self.watch.go_to(now);
        self.settling = Settling::new(self.simulation.running());
        self.forget_peaks();
        self.warnings = Known::of(self.pending());
        if anew {
            self.keyframes.forget_fine();
            let channels = self.history.channels();
            match &mut self.near {
                Some(near) => near.clear(),
                None => self.near = Some(Box::new(History::new(channels, FINEST_BIN))),
            }
            self.record(now);
        }
    }

    /// Repeats steps and logged events until `is_there`; displays nothing beyond `time`, s.
    fn retrace(&mut self, is_there: impl Fn(&Self) -> bool, time: f64) {
        while !is_there(self) {
            self.pacer.jump(self.simulation.time().min(time));
            self.apply_due();
            if self.stopped.is_some() || !self.step() {
                break;
            }
        }
    }

    /// Reapplies the events logged after this number of steps.
    fn apply_due(&mut self) {
        while let Some(entry) = self.log.entries.get(self.applied) {
            if entry.steps > self.steps() {
                break;
            }
            if entry.event == Event::Stop {
                // The step is refused again and sets `stopped`.
                self.step();
                break;
            }
            let entry = entry.clone();
            self.applied += 1;
            if let Some(schedule) = entry.event.schedule() {
                self.sections = Some(schedule);
            } else {
                // It was accepted before, for the same scene in the same state.
                let _ = self.apply(&entry.event);
            }
        }
    }

    /// Continues from the displayed instant by repeating the known steps; a future with later events is abandoned.
    pub(super) fn go_on(&mut self) {
        if self.applied < self.log.entries.len() {
            self.branch();
        }
    }

    /// Makes the displayed instant the end of the run and abandons its future.
    pub(super) fn branch(&mut self) {
        if !self.has_future() {
            return;
        }
        let (steps, shown, applied) = (self.steps(), self.pacer.shown(), self.applied);
        if shown < self.reached {
            let after = |flag: &Flag| flag.time > shown;
            self.left = Some(Box::new(AbandonedFuture {
                history: self.history.clone(),
                contact_history: self.contact_history.clone(),
                flags: self.flags().filter(after).collect(),
                from: shown,
                to: self.reached,
            }));
        }
        self.log.entries.truncate(applied);
        self.event_times.truncate(applied);
        let before = |k: &Keyframe| k.state.steps() <= steps && k.events <= applied;
        let Some(keyframe) = self.keyframes.latest_kept(before) else {
            return;
        };
        let (start, start_steps) = (keyframe.state.time(), keyframe.state.steps());
        if let Some(mark) = &keyframe.record {
            self.history.rewind(mark);
        }
        self.contact_history.cut(start);
        self.impact_record.cut(start, start_steps);
        self.watch.cut(start);
        self.keyframes.cut(start_steps);
        self.near = None;
        if let Some(twin) = &mut self.twin {
            twin.cut(start);
        }
        (self.reached, self.most_steps) = (start, start_steps);
        self.restore(start, false);
        self.retrace(|player| player.steps() >= steps, shown);
        if self.twin.as_ref().is_some_and(|twin| twin.begins() > self.simulation.time()) {
            self.restart_twin();
        }
        self.arrive(shown);
    }

    /// Stores a keyframe of the latest state if one is due, while the run advances or retraces.
    pub(super) fn keep(&mut self) {
        let steps = self.steps();
        let new = steps >= self.most_steps;
        self.most_steps = self.most_steps.max(steps);
        if new && self.keyframes.is_due(steps) {
            let record = Some(self.history.mark());
            self.keyframes.keep(self.keyframe(record));
        } else if !new && self.keyframes.is_fine(steps) {
            let keyframe = self.keyframe(None);
            self.keyframes.keep_fine(keyframe);
        }
    }

    fn keyframe(&self, record: Option<crate::simulate::Mark>) -> Keyframe {
        Keyframe {
            state: self.simulation.snapshot().into(),
            events: self.applied,
            record,
            twin: self.twin.as_ref().map(|twin| twin.mark()),
        }
    }

    /// Clears the rewind data for a new run.
    pub(super) fn clear_rewind(&mut self) {
        self.keyframes.clear();
        self.near = None;
        self.left = None;
        self.sought = None;
        self.contact_history.begin(0.0);
        self.event_times.clear();
        (self.applied, self.most_steps) = (0, 0);
        (self.reached, self.recorded_to) = (0.0, 0.0);
    }

    /// Approximate memory of the keyframes, bytes.
    #[cfg(test)]
    pub(super) fn rewind_bytes(&self) -> usize {
        self.keyframes.bytes()
    }
}
