//! States of a run that it can be taken back to: close together where it is young, thinned where it is old.

use crate::simulate::{Mark, Snapshot};

/// Steps from one state that is kept to the next.
const STRIDE: u64 = 256;
/// Steps from one to the next on the way to an instant of the past: the one before it is near then, too.
const FINE_STRIDE: u64 = 16;
/// Most bytes that the states kept take, and those on the way.
const BUDGET: usize = 32 << 20;
const FINE_BUDGET: usize = 4 << 20;

/// A state and what else a player is taken back to with it.
pub(super) struct Keyframe {
    pub state: Snapshot,
    /// Events of the log that came before.
    pub events: usize,
    /// Where the record stood; only the states that are kept know.
    pub record: Option<Mark>,
}

impl Keyframe {
    fn bytes(&self) -> usize {
        self.state.bytes() + self.record.as_ref().map_or(0, Mark::bytes)
    }
}

/// The states of one run, from its start on.
#[derive(Default)]
pub(super) struct Keyframes {
    kept: Vec<Keyframe>,
    bytes: usize,
    /// Of the stretch that was last gone through again.
    fine: Vec<Keyframe>,
    fine_bytes: usize,
}

impl Keyframes {
    /// Forgets everything.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Whether the state after `steps` steps, the latest so far, is one to keep.
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

    /// Whether the state after `steps` steps, on the way to an instant of the past, is worth keeping for the way back.
    pub fn is_fine(&self, steps: u64) -> bool {
        steps.is_multiple_of(FINE_STRIDE) && self.fine_bytes < FINE_BUDGET
    }

    /// Keeps a state on the way.
    pub fn keep_fine(&mut self, keyframe: Keyframe) {
        let after = self.fine.last();
        if after.is_none_or(|last| last.state.steps() < keyframe.state.steps()) {
            self.fine_bytes += keyframe.bytes();
            self.fine.push(keyframe);
        }
    }

    /// Another stretch is gone through.
    pub fn forget_fine(&mut self) {
        self.fine.clear();
        self.fine_bytes = 0;
    }

    /// The latest state of which `is_before` is true, as it is for every earlier one.
    pub fn latest(&self, is_before: impl Fn(&Keyframe) -> bool) -> Option<&Keyframe> {
        let last = |list: &'_ [Keyframe]| list.partition_point(&is_before).checked_sub(1);
        let kept = last(&self.kept).map(|at| &self.kept[at]);
        let fine = last(&self.fine).map(|at| &self.fine[at]);
        match (kept, fine) {
            (Some(kept), Some(fine)) if fine.state.steps() > kept.state.steps() => Some(fine),
            (kept, fine) => kept.or(fine),
        }
    }

    /// As [`Self::latest`], among those that know where the record stood.
    pub fn latest_kept(&self, is_before: impl Fn(&Keyframe) -> bool) -> Option<&Keyframe> {
        let at = self.kept.partition_point(is_before).checked_sub(1)?;
        Some(&self.kept[at])
    }

    /// Another future begins after `steps` steps.
    pub fn cut(&mut self, steps: u64) {
        self.kept.retain(|kept| kept.state.steps() <= steps);
        self.bytes = self.kept.iter().map(Keyframe::bytes).sum();
        self.forget_fine();
    }

    /// Bytes that all of it takes, about.
    #[cfg(test)]
    pub fn bytes(&self) -> usize {
        self.bytes + self.fine_bytes
    }
}
