//! The run from before a parameter change: a copy that goes to the same instants with the old value.

use super::{Effect, Event, Player, SetError};

/// Whether and when the run is copied.
#[derive(Clone, Default)]
pub(super) struct BeforeChange {
    enabled: bool,
    /// Key of the current gesture, which counts as one change.
    gesture: Option<String>,
    /// The latest copy, with the key changed after it.
    copy: Option<(Box<Player>, String)>,
}

impl Player {
    /// A paused copy of the run and its record, without the twin, unaffected by later changes to this run.
    fn copy(&self) -> Self {
        let mut copy = self.clone();
        copy.set_paused();
        (copy.twin, copy.abandoned) = (None, None);
        (copy.edits, copy.before_change) = Default::default();
        copy
    }

    /// Takes the copy made before the latest parameter change, with the key; `None` if none was made since the last call. `enabled`:
    /// whether the run is copied before the next change. `is_over`: the gesture has ended, so that the next change counts as a
    /// new one, even of the same parameter.
    pub fn take_copy_before_change(&mut self, enabled: bool, is_over: bool) -> Option<(Box<Self>, String)> {
        self.before_change.enabled = enabled;
        self.before_change.gesture.take_if(|_| is_over);
        self.before_change.copy.take()
    }

    /// Applies and logs the `events` of a change of `key` at the displayed instant; the future is abandoned. The run is copied before it,
    /// if requested, unless the change belongs to the same gesture as the last or the value is the same.
    pub(super) fn change(&mut self, key: &str, events: impl IntoIterator<Item = Event>) -> Result<Effect, SetError> {
        let BeforeChange { enabled, gesture, .. } = &self.before_change;
        let copies_run = *enabled && gesture.as_deref() != Some(key);
        let copy = copies_run.then(|| Box::new(self.copy()));
        self.branch();
        let before = self.pending().changes.clone();
        let mut outcome = Ok(Effect::Now);
        for event in events {
            outcome = self.apply(&event);
            if outcome.is_err() {
                break;
            }
            self.log_event(event);
        }
        self.record_edits(&before);
        let effect = outcome?;
        if let Some(copy) = copy.filter(|_| before != self.pending().changes) {
            self.before_change.copy = Some((copy, key.to_owned()));
            self.before_change.gesture = Some(key.to_owned());
        }
        Ok(effect)
    }

    /// Whether the whole record used the current parameters and no pull acted.
    pub fn is_unchanged_since_start(&self) -> bool {
        self.script.log.entries.iter().all(|entry| entry.event == Event::Stop) && !self.has_pending_changes()
    }

    /// Displays `time`, s, stepping while `may_step`. Returns true once it is reached or the run cannot continue.
    pub fn follow(&mut self, time: f64, may_step: impl FnMut() -> bool) -> bool {
        if time > self.reached {
            if self.has_future() {
                self.go_to(self.reached);
            }
            return self.run_towards(time, may_step);
        }
        if time != self.pacer.shown() {
            self.go_to(time);
        }
        true
    }
}
