//! States to which a run can be taken back: closely spaced in the recent past, thinned out in the older.

use std::sync::Arc;

use crate::scene::SceneSnapshot;
use crate::session::twin::TwinMark;
use crate::simulate::Mark;

/// Steps from one kept state to the next.
const STRIDE: u64 = 256;
/// Steps from one to the next while retracing the past, so that stepping back once more is quick, too.
const FINE_STRIDE: u64 = 16;
/// Most bytes for the kept states, and for those of the retraced stretch.
const BUDGET: usize = 32 << 20;
const FINE_BUDGET: usize = 4 << 20;

/// A state, and what else a player restores with it.
pub(super) struct Keyframe {
    /// A copy of the run shares it.
    pub state: Arc<SceneSnapshot>,
    /// Number of log entries before it.
    pub events: usize,
    /// Position in the record; only the kept states have it.
    pub record: Option<Mark>,
    /// The twin run beside it.
    pub twin: Option<TwinMark>,
}

impl Keyframe {
    fn bytes(&self) -> usize {
        let twin = self.twin.as_ref().map_or(0, TwinMark::bytes);
        self.state.bytes() + twin + self.record.as_ref().map_or(0, Mark::bytes)
    }

    /// The same for a run without a twin.
    fn alone(&self) -> Self {
        Self { state: self.state.clone(), record: self.record.clone(), twin: None, ..*self }
    }
}

/// The states of one run since its start.
#[derive(Default)]
pub(super) struct Keyframes {
    kept: Vec<Keyframe>,
    bytes: usize,
    /// States of the stretch last retraced.
    fine: Vec<Keyframe>,
    fine_bytes: usize,
}

impl Keyframes {
    /// Forgets everything.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Those of a copy of the run, without its twin.
    pub fn copy(&self) -> Self {
        let alone = |list: &[Keyframe]| list.iter().map(Keyframe::alone).collect();
        Self { kept: alone(&self.kept), fine: alone(&self.fine), ..*self }
    }

    /// Whether to keep the state after `steps` steps, the latest so far.
    pub fn is_due(&self, steps: u64) -> bool {
        let last = self.kept.last();
        last.is_none_or(|last| steps >= last.state.steps() + STRIDE)
    }

    /// Keeps the latest state.
    pub fn keep(&mut self, keyframe: Keyframe) {
        self.bytes += keyframe.bytes();
        self.kept.push(keyframe);
        while self.bytes > BUDGET && self.kept.len() > 8 {
            self.thin();
        }
    }

    /// Drops every second state of the older three quarters, never the first.
    fn thin(&mut self) {
        let old = self.kept.len() * 3 / 4;
        let mut index = 0;
        self.kept.retain(|_| {
            index += 1;
            index > old || index % 2 == 1
        });
        self.bytes = self.kept.iter().map(Keyframe::bytes).sum();
    }

    /// Whether the state after `steps` steps, reached while retracing, is worth keeping for going further back.
    pub fn is_fine(&self, steps: u64) -> bool {
        steps.is_multiple_of(FINE_STRIDE) && self.fine_bytes < FINE_BUDGET
    }

    /// Keeps a state reached while retracing.
    pub fn keep_fine(&mut self, keyframe: Keyframe) {
        let after = self.fine.last();
        if after.is_none_or(|last| last.state.steps() < keyframe.state.steps()) {
            self.fine_bytes += keyframe.bytes();
            self.fine.push(keyframe);
        }
    }

    /// Forgets them: another stretch is being retraced.
    pub fn forget_fine(&mut self) {
        self.fine.clear();
        self.fine_bytes = 0;
    }

    /// The latest state for which `is_before` is true; it must be true for every earlier one.
    pub fn latest(&self, is_before: impl Fn(&Keyframe) -> bool) -> Option<&Keyframe> {
        let last = |list: &'_ [Keyframe]| list.partition_point(&is_before).checked_sub(1);
        let kept = last(&self.kept).map(|at| &self.kept[at]);
        let fine = last(&self.fine).map(|at| &self.fine[at]);
        match (kept, fine) {
            (Some(kept), Some(fine)) if fine.state.steps() > kept.state.steps() => Some(fine),
            (kept, fine) => kept.or(fine),
        }
    }

    /// As [`Self::latest`], among those with a position in the record.
    pub fn latest_kept(&self, is_before: impl Fn(&Keyframe) -> bool) -> Option<&Keyframe> {
        let at = self.kept.partition_point(is_before).checked_sub(1)?;
        Some(&self.kept[at])
    }

    /// Drops what follows `steps` steps: another future begins.
    pub fn cut(&mut self, steps: u64) {
        self.kept.retain(|kept| kept.state.steps() <= steps);
        self.bytes = self.kept.iter().map(Keyframe::bytes).sum();
        self.forget_fine();
    }

    /// The record was rearranged, as by [`History::rearranged`](crate::simulate::History::rearranged), from one of `channels`.
    pub fn rearrange(&mut self, channels: usize, from: &[Option<usize>]) {
        for mark in self.kept.iter_mut().filter_map(|kept| kept.record.as_mut()) {
            *mark = mark.rearranged(channels, from);
        }
        self.bytes = self.kept.iter().map(Keyframe::bytes).sum();
    }

    /// Approximate memory of all states, bytes.
    #[cfg(test)]
    pub fn bytes(&self) -> usize {
        self.bytes + self.fine_bytes
    }
}
