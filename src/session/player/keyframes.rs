//! Keyframes for going back in time: closely spaced in the recent past, sparse before.

use std::sync::Arc;

use crate::scene::SceneSnapshot;
use crate::session::companion::CompanionState;
use crate::simulate::Mark;

/// Steps between keyframes.
const STRIDE: u64 = 256;
/// Steps between keyframes while retracing, so that stepping back again is quick, too.
const FINE_STRIDE: u64 = 16;
/// Memory limits of the keyframes and of the fine keyframes of the retraced stretch, bytes.
const BUDGET: usize = 32 << 20;
const FINE_BUDGET: usize = 4 << 20;

/// A simulation state, and the player data restored with it. Copies of the run share the states.
#[derive(Clone)]
pub(super) struct Keyframe {
    /// State of the run.
    pub state: Arc<SceneSnapshot>,
    /// Number of log entries before it.
    pub events: usize,
    /// Position in the record; only `kept` keyframes have one.
    pub record: Option<Mark>,
    /// State of the twin run.
    pub twin: Option<Arc<CompanionState>>,
}

impl Keyframe {
    fn bytes(&self) -> usize {
        let twin = self.twin.as_ref().map_or(0, |twin| twin.1.bytes());
        self.state.bytes() + twin + self.record.as_ref().map_or(0, Mark::bytes)
    }
}

/// The keyframes of one run since its start.
#[derive(Clone, Default)]
pub(super) struct Keyframes {
    kept: Vec<Keyframe>,
    bytes: usize,
    /// Keyframes of the stretch last retraced.
    fine: Vec<Keyframe>,
    fine_bytes: usize,
}

impl Keyframes {
    /// Whether a keyframe is due after `steps` steps, the latest so far.
    pub fn is_due(&self, steps: u64) -> bool {
        let last = self.kept.last();
        last.is_none_or(|last| steps >= last.state.steps() + STRIDE)
    }

    /// Stores a keyframe of the latest state.
    pub fn keep(&mut self, keyframe: Keyframe) {
        self.bytes += keyframe.bytes();
        self.kept.push(keyframe);
        while self.bytes > BUDGET && self.kept.len() > 8 {
            self.thin();
        }
    }

    /// Drops every second keyframe of the older three quarters, never the first.
    fn thin(&mut self) {
        let old = self.kept.len() * 3 / 4;
        let mut index = 0;
        self.kept.retain(|_| {
            index += 1;
            index > old || index % 2 == 1
        });
        self.bytes = self.kept.iter().map(Keyframe::bytes).sum();
    }

    /// Whether to store the state after `steps` steps while retracing.
    pub fn is_fine(&self, steps: u64) -> bool {
        steps.is_multiple_of(FINE_STRIDE) && self.fine_bytes < FINE_BUDGET
    }

    /// Stores a keyframe reached while retracing.
    pub fn keep_fine(&mut self, keyframe: Keyframe) {
        let after = self.fine.last();
        if after.is_none_or(|last| last.state.steps() < keyframe.state.steps()) {
            self.fine_bytes += keyframe.bytes();
            self.fine.push(keyframe);
        }
    }

    /// Drops the keyframes of the retraced stretch.
    pub fn forget_fine(&mut self) {
        self.fine.clear();
        self.fine_bytes = 0;
    }

    /// The latest keyframe for which `is_before` is true; it must be true for every earlier one.
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

    /// Drops keyframes after `steps` steps, for a new branch.
    pub fn cut(&mut self, steps: u64) {
        self.kept.retain(|kept| kept.state.steps() <= steps);
        self.bytes = self.kept.iter().map(Keyframe::bytes).sum();
        self.forget_fine();
    }

    /// Adapts the positions after [`History::rearranged`](crate::simulate::History::rearranged) of a record of `channels`
    /// channels.
    pub fn rearrange(&mut self, channels: usize, from: &[Option<usize>]) {
        for mark in self.kept.iter_mut().filter_map(|kept| kept.record.as_mut()) {
            *mark = mark.rearranged(channels, from);
        }
        self.bytes = self.kept.iter().map(Keyframe::bytes).sum();
    }

    /// Approximate memory of all keyframes, bytes.
    #[cfg(test)]
    pub fn bytes(&self) -> usize {
        self.bytes + self.fine_bytes
    }
}
