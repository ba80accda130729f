//! Keyframes for going back in time: closely spaced in the recent past, sparse before.

use std::sync::Arc;

use crate::scene::SceneSnapshot;
use crate::session::companion::CompanionState;
use crate::session::history::Mark;

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
    /// Position in the record; only `regular` keyframes have one.
    pub record: Option<Arc<Mark>>,
    /// State of the twin run.
    pub twin: Option<Arc<CompanionState>>,
}

impl Keyframe {
    fn bytes(&self) -> usize {
        let twin = self.twin.as_ref().map_or(0, |twin| twin.state.bytes());
        self.state.bytes() + twin + self.record.as_ref().map_or(0, |mark| mark.bytes())
    }
}

/// The keyframes of one run since its start.
#[derive(Clone, Default)]
pub(super) struct Keyframes {
    regular: Vec<Keyframe>,
    bytes: usize,
    /// Keyframes of the stretch last retraced.
    fine: Vec<Keyframe>,
    fine_bytes: usize,
}

impl Keyframes {
    /// Whether a keyframe is due after `steps` steps, the latest so far.
    pub fn is_due(&self, steps: u64) -> bool {
        let last = self.regular.last();
        last.is_none_or(|last| steps >= last.state.steps() + STRIDE)
    }

    /// Stores a keyframe of the latest state.
    pub fn store(&mut self, keyframe: Keyframe) {
        self.bytes += keyframe.bytes();
        self.regular.push(keyframe);
        while self.bytes > BUDGET && self.regular.len() > 8 {
            self.thin();
        }
    }

    /// Drops every second keyframe of the older three quarters, never the first.
    fn thin(&mut self) {
        let old = self.regular.len() * 3 / 4;
        let mut index = 0;
        self.regular.retain(|_| {
            index += 1;
            index > old || index % 2 == 1
        });
        self.bytes = self.regular.iter().map(Keyframe::bytes).sum();
    }

    /// Whether to store the state after `steps` steps while retracing.
    pub fn is_fine(&self, steps: u64) -> bool {
        steps.is_multiple_of(FINE_STRIDE) && self.fine_bytes < FINE_BUDGET
    }

    /// Stores a keyframe reached while retracing.
    pub fn store_fine(&mut self, keyframe: Keyframe) {
        let after = self.fine.last();
        if after.is_none_or(|last| last.state.steps() < keyframe.state.steps()) {
            self.fine_bytes += keyframe.bytes();
            self.fine.push(keyframe);
        }
    }

    /// Drops the keyframes of the retraced stretch.
    pub fn drop_fine(&mut self) {
        self.fine.clear();
        self.fine_bytes = 0;
    }

    /// The latest keyframe for which `is_before` is true; it must be true for every earlier one.
    pub fn latest(&self, is_before: impl Fn(&Keyframe) -> bool) -> Option<&Keyframe> {
        let latest_in = |list: &'_ [Keyframe]| list.partition_point(&is_before).checked_sub(1);
        let regular = latest_in(&self.regular).map(|at| &self.regular[at]);
        let fine = latest_in(&self.fine).map(|at| &self.fine[at]);
        match (regular, fine) {
            (Some(regular), Some(fine)) if fine.state.steps() > regular.state.steps() => Some(fine),
            (regular, fine) => regular.or(fine),
        }
    }

    /// As [`Self::latest`], among those with a position in the record.
    pub fn latest_regular(&self, is_before: impl Fn(&Keyframe) -> bool) -> Option<&Keyframe> {
        let at = self.regular.partition_point(is_before).checked_sub(1)?;
        Some(&self.regular[at])
    }

    /// Drops keyframes after `steps` steps, for a new branch.
    pub fn truncate(&mut self, steps: u64) {
        self.regular.retain(|regular| regular.state.steps() <= steps);
        self.bytes = self.regular.iter().map(Keyframe::bytes).sum();
        self.drop_fine();
    }

    /// Adapts the positions after [`History::rearranged`](crate::session::history::History::rearranged) of a record of `channels`
    /// channels.
    pub fn rearrange(&mut self, channels: usize, from: &[Option<usize>]) {
        for mark in self.regular.iter_mut().filter_map(|regular| regular.record.as_mut()) {
            *mark = mark.rearranged(channels, from).into();
        }
        self.bytes = self.regular.iter().map(Keyframe::bytes).sum();
    }

    /// Approximate memory of all keyframes, bytes.
    #[cfg(test)]
    pub fn bytes(&self) -> usize {
        self.bytes + self.fine_bytes
    }
}
