//! Going to an instant. [`Player::display`] shows a known instant: from the latest step, or by restoring the nearest earlier
//! keyframe and repeating the same steps and logged events, with the same bits. [`Player::continue_to`] steps to a later one.

use std::sync::Arc;

use super::contact_history::ContactHistory;
use super::impact_record::ImpactRecord;
use super::keyframes::Keyframe;
use super::record::{FINEST_BIN, drop_before};
use super::{Player, advice};
use crate::session::goal::{Goal, Obstacle};
use crate::session::history::{Bin, History, Mark};
use crate::session::log::Event;

/// Most steps retraced before a past instant, so that the plots show its history in detail.
const MAX_RETRACED_STEPS: u64 = 512;

/// Widest bins of a past window, as a fraction of its length: less than a pixel in most plots.
const MAX_BIN: f64 = 1.0 / 400.0;

/// Search horizon for the next impact, s.
const SEARCH_HORIZON: f64 = 5.0;

/// A search for the next impact.
#[derive(Clone, Copy)]
pub(super) struct ImpactSearch {
    /// Joint with play; `None` for any.
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
    pub text: String,
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

impl Player {
    /// Latest instant of the run ever displayed, s.
    pub fn reached(&self) -> f64 {
        self.reached
    }

    /// Whether anything after the displayed instant was displayed before, or any logged event is yet to be reapplied.
    pub fn has_future(&self) -> bool {
        self.pacer.shown() < self.reached || self.script.has_more()
    }

    /// The abandoned future, while it extends beyond the run.
    pub fn abandoned_future(&self) -> Option<&AbandonedFuture> {
        self.abandoned.as_deref().filter(|future| future.to > self.reached)
    }

    /// Time up to which the run, or its abandoned future, is known, s.
    pub fn known_to(&self) -> f64 {
        self.abandoned_future().map_or(self.reached, |future| future.to)
    }

    /// Contact states of the joints with play over time.
    pub fn contact_history(&self) -> &ContactHistory {
        &self.record.contact_history
    }

    /// The impacts of the run.
    pub fn impact_record(&self) -> &ImpactRecord {
        &self.record.impact_record
    }

    /// Events of the run, its future included; of a pull, only the start and the end.
    pub fn flags(&self) -> impl Iterator<Item = Flag> {
        self.script.flags().map(|(time, text)| Flag { time, text })
    }

    /// Appends the bins of `channel` from `from` to `to`, s, to `out`, as [`History::bins`] does. Uses the window last
    /// retraced, in full detail, where possible, and the abandoned future beyond the latest displayed instant.
    pub fn bins(&self, channel: usize, from: f64, to: f64, most_bins: usize, out: &mut Vec<Bin>) {
        self.record.bins(channel, from, to, most_bins, out);
        let reached = self.reached;
        if let Some(future) = self.abandoned_future().filter(|_| to > reached) {
            let first = out.len();
            let from = from.max(reached);
            future.history.bins(channel, from, to, most_bins, out);
            drop_before(out, first, reached);
        }
    }

    /// Pauses and displays `time`, s: any instant displayed before.
    pub fn go_to(&mut self, time: f64) {
        self.set_paused();
        self.travel(time);
    }

    /// Goes to the peak of the next or previous impact of joint with play `joint` (`None`: any), or back to the start. If the next
    /// peak is not known yet, the run continues to it, frame by frame.
    pub fn go_to_impact(&mut self, joint: Option<usize>, forward: bool) {
        let shown = self.pacer.shown();
        if !forward {
            let peak = self.record.impact_record.previous_peak(joint, shown);
            return self.go_to(peak.unwrap_or(0.0));
        }
        let peak = self.record.impact_record.next_peak(joint, shown, false);
        match peak.filter(|time| *time <= self.reached) {
            Some(time) => self.go_to(time),
            None => {
                self.go_to(self.reached);
                let until = self.reached + SEARCH_HORIZON;
                self.impact_search = Some(ImpactSearch { joint, from: shown, until });
            }
        }
    }

    /// Whether the run is seeking the next impact.
    pub fn is_seeking(&self) -> bool {
        self.impact_search.is_some()
    }

    /// Continues towards the next impact within the budget of a frame.
    pub(super) fn seek(&mut self, impact_search: ImpactSearch) {
        self.resume();
        let (start, before) = ((self.clock)(), self.steps());
        let is_over = |player: &Self| player.simulation.time() > impact_search.until || player.stopped.is_some();
        // The window shows the results of the impact with it, so the search continues until the impact is over.
        let next_peak = |player: &Self| {
            player.record.impact_record.next_peak(impact_search.joint, impact_search.from, is_over(player))
        };
        let in_time = |player: &Self| player.pacer.may_step((player.clock)() - start);
        let _ = self.step_towards(f64::INFINITY, |player| is_over(player) || next_peak(player).is_some(), in_time);
        if self.steps() > before {
            self.record_until(self.simulation.time());
        }
        self.reached = self.reached.max(self.record.recorded_to);
        if let Some(time) = next_peak(self).or_else(|| is_over(self).then_some(f64::INFINITY)) {
            self.impact_search = None;
            self.travel(time.min(self.reached));
        }
    }

    /// Steps back to the start of the latest step, or of the one before if that start is already displayed.
    pub fn step_back(&mut self) {
        self.set_paused();
        if let Some(steps) = self.steps().checked_sub(1) {
            self.display(Goal::after(steps));
        }
    }

    pub(super) fn set_paused(&mut self) {
        (self.playing, self.backwards) = (false, false);
        self.impact_search = None;
    }

    /// Displays `time`, s: any instant displayed before.
    pub(super) fn travel(&mut self, time: f64) {
        if time.is_finite() {
            self.display(Goal::at(time.clamp(0.0, self.reached)));
        }
    }

    /// Displays `goal`, an instant of the past or of the known future. If the goal lies in the latest step, that step is
    /// sampled; otherwise known steps are repeated from here or from a keyframe.
    fn display(&mut self, goal: Goal) {
        let (here, now) = (self.steps(), self.simulation.time());
        // If a change was made within the latest step, that step is displayed as it was before.
        let latest = self.unchanged.as_deref().unwrap_or(&self.simulation).step_start();
        let twin_reaches = self.twin.as_ref().is_none_or(|twin| twin.reaches(goal.time));
        let in_step = goal.steps.map_or(latest < goal.time && goal.time <= now && twin_reaches, |steps| steps == here);
        if !in_step {
            let is_before = |k: &Keyframe| goal.is_ahead_of(k.state.steps(), k.state.time());
            let best = self.keyframes.latest(is_before);
            let (start, steps) = best.map_or((0.0, 0), |k| (k.state.time(), k.state.steps()));
            // Repeated steps are recorded only at the end of a record.
            let is_coarse = self.record.resolution(now) > self.widest_bin();
            if now < start || !goal.is_ahead_of(here, now) || is_coarse {
                let seen = if goal.time.is_finite() { goal.time } else { start };
                self.restore_before(start, steps, seen);
            }
            // The same steps end in the same way. The window displays a stop.
            let _ = self.step_towards(goal.time, |player| goal.is_reached(&player.simulation), |_| true);
        }
        let _ = self.arrive(goal.time);
    }

    /// Steps forward to `goal` while `may_step`, and displays it, or the end of the latest step on the way there. Events that are
    /// due are applied. Never goes back. Returns whether the goal is reached.
    ///
    /// # Errors
    /// The run stopped or does not accept an event; later events are dropped.
    pub(crate) fn continue_to(&mut self, goal: Goal, mut may_step: impl FnMut() -> bool) -> Result<bool, Obstacle> {
        let stepped = self.step_towards(goal.time, |player| goal.is_reached(&player.simulation), |_| may_step());
        if stepped.is_err() {
            self.script.drop_ahead();
        }
        let arrived = self.arrive(goal.time.max(self.record.recorded_to));
        if arrived.is_err() {
            self.script.drop_ahead();
        }
        arrived.and(stepped)
    }

    /// Takes steps, and applies the events logged between them, until `is_reached` or while `may_step`; displays nothing beyond
    /// `time`, s. Returns whether the goal is reached. Every step of a run is taken here.
    pub(super) fn step_towards(
        &mut self,
        time: f64,
        is_reached: impl Fn(&Self) -> bool,
        mut may_step: impl FnMut(&Self) -> bool,
    ) -> Result<bool, Obstacle> {
        while !is_reached(self) {
            self.apply_due(time)?;
            if let Some(stopped) = self.stopped.clone() {
                return Err(stopped.into());
            }
            if !may_step(self) {
                return Ok(false);
            }
            self.step();
        }
        Ok(true)
    }

    /// Displays `time`, s, within the latest step, and applies the events logged at its end.
    fn arrive(&mut self, time: f64) -> Result<(), Obstacle> {
        self.pacer.jump(time.min(self.simulation.time()));
        let applied = if time >= self.simulation.time().min(self.reached) { self.apply_due(time) } else { Ok(()) };
        self.update_display();
        applied
    }

    /// Widest bins that show the plots' window as curves, s.
    fn widest_bin(&self) -> f64 {
        (MAX_BIN * self.automatic_window().min(self.plotted)).max(FINEST_BIN)
    }

    /// Repeats the steps from `from` to `to`, s, if the record keeps them too coarsely for a plot of this range, and displays the same
    /// instant again: a run that stands still in its past may be shown in another range than the one retraced when it went there.
    pub fn retrace_range(&mut self, from: f64, to: f64) {
        let (shown, from, to) = (self.pacer.shown(), from.max(0.0), to.min(self.reached));
        let widest = (MAX_BIN * (to - from)).max(FINEST_BIN);
        // A steady end of the run is always recorded in detail.
        let is_coarse = |time: f64| self.record.resolution(time) > widest;
        if self.playing
            || self.is_seeking()
            || shown >= self.reached
            || to <= from
            || !(is_coarse(from) || is_coarse(to))
        {
            return;
        }
        let most = self.steps();
        let is_early_enough = |k: &Keyframe| k.state.time() <= from || k.state.steps() + MAX_RETRACED_STEPS <= most;
        let start = self.keyframes.latest_regular(is_early_enough).map_or(0.0, |k| k.state.time());
        self.restore(start.min(shown), true);
        let end = Goal::at(to.max(shown));
        // The same steps end in the same way.
        let _ = self.step_towards(end.time, |player| end.is_reached(&player.simulation), |_| true);
        let _ = self.arrive(end.time);
        self.travel(shown);
    }

    /// Restores the keyframe at `start`, s, after `steps` steps, or an earlier one if the history up to the instant `seen`, s,
    /// must be recorded in detail.
    fn restore_before(&mut self, start: f64, steps: u64, seen: f64) {
        // A long record has lost the details of its older part.
        let is_fine = |detailed: &History| detailed.resolution(start) <= self.widest_bin();
        if self.record.detailed_at(start).is_some_and(is_fine) {
            return self.restore(start, false);
        }
        let lead = seen - self.automatic_window();
        let is_early_enough = |k: &Keyframe| k.state.time() <= lead || k.state.steps() + MAX_RETRACED_STEPS <= steps;
        let first = self.keyframes.latest_regular(is_early_enough);
        let start = first.map_or(0.0, |k| k.state.time());
        self.restore(start, true);
    }

    /// Restores the latest keyframe up to `time`, s; `starts_detail` starts another detailed record there.
    fn restore(&mut self, time: f64, starts_detail: bool) {
        let Some(keyframe) = self.keyframes.latest(|k| k.state.time() <= time) else {
            return;
        };
        self.simulation.restore(&keyframe.state);
        self.script.go_back(keyframe.events);
        if let Some(twin) = &mut self.twin {
            twin.go_back(keyframe.twin.as_deref(), &self.simulation);
        }
        let now = self.simulation.time();
        self.stopped = None;
        self.unchanged = None;
        self.record.go_back(now, self.simulation.running());
        self.warnings = advice::of(self.pending());
        if starts_detail {
            self.keyframes.drop_fine();
            self.record.begin_detailed();
            self.record_at(now);
        }
    }

    /// Applies the events logged after this number of steps, with nothing displayed beyond `time`, s.
    fn apply_due(&mut self, time: f64) -> Result<(), Obstacle> {
        while let Some(event) = self.script.due(self.steps()).cloned() {
            if event == Event::Stop {
                // The step is refused again, which passes the event.
                if self.step() {
                    return Err(Obstacle::MissedStop);
                }
                continue;
            }
            // The latest step is recorded as it was before the event.
            let shown = self.simulation.time().min(time);
            self.pacer.jump(shown);
            self.record_until(shown);
            self.apply(&event)?;
            self.script.pass(self.simulation.time());
        }
        Ok(())
    }

    /// Continues from the displayed instant by repeating the known steps; a future with later events is abandoned.
    pub(super) fn resume(&mut self) {
        if self.script.has_more() {
            self.branch();
        }
    }

    /// Makes the displayed instant the end of the run and abandons its future.
    pub(super) fn branch(&mut self) {
        if !self.has_future() {
            return;
        }
        let (steps, shown, passed) = (self.steps(), self.pacer.shown(), self.script.passed);
        if shown < self.reached {
            let after = |flag: &Flag| flag.time > shown;
            self.abandoned = Some(Box::new(AbandonedFuture {
                history: self.record.history.clone(),
                contact_history: self.record.contact_history.clone(),
                flags: self.flags().filter(after).collect(),
                from: shown,
                to: self.reached,
            }));
        }
        self.script.drop_ahead();
        let before = |k: &Keyframe| k.state.steps() <= steps && k.events <= passed;
        let Some(keyframe) = self.keyframes.latest_regular(before) else {
            return;
        };
        let (start, start_steps) = (keyframe.state.time(), keyframe.state.steps());
        self.record.truncate(&keyframe.state, keyframe.record.as_deref());
        self.keyframes.truncate(start_steps);
        if let Some(twin) = &mut self.twin {
            twin.truncate(start);
        }
        (self.reached, self.most_steps) = (start, start_steps);
        // What led to the branch is recorded in detail again.
        self.restore_before(start, start_steps, shown);
        let _ = self.step_towards(shown, |player| player.steps() >= steps, |_| true);
        let now = self.simulation.time();
        self.restart_twin(|start| start > now);
        let _ = self.arrive(shown);
    }

    /// Stores a keyframe of the latest state if one is due, while the run advances or retraces.
    pub(super) fn store_keyframe(&mut self) {
        let steps = self.steps();
        let new = steps >= self.most_steps;
        self.most_steps = self.most_steps.max(steps);
        if new && self.keyframes.is_due(steps) {
            let record = Some(self.record.history.mark().into());
            self.keyframes.store(self.keyframe(record));
        } else if !new && self.keyframes.is_fine(steps) {
            let keyframe = self.keyframe(None);
            self.keyframes.store_fine(keyframe);
        }
    }

    fn keyframe(&self, record: Option<Arc<Mark>>) -> Keyframe {
        Keyframe {
            state: self.simulation.snapshot().into(),
            events: self.script.passed,
            record,
            twin: self.twin.as_ref().map(|twin| twin.motion.state().into()),
        }
    }

    /// Approximate memory of the keyframes, bytes.
    #[cfg(test)]
    pub(super) fn rewind_bytes(&self) -> usize {
        self.keyframes.bytes()
    }
}
