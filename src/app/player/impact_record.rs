//! The finished impacts of a run: those that `run --impacts` writes.

use std::collections::VecDeque;

use crate::simulate::{Impact, Simulation};

/// Most impacts kept; beyond that the oldest are dropped.
const KEPT: usize = 20_000;

/// The finished impacts of a run in the order in which they began. Steps taken again after going back add none.
#[derive(Clone, Debug, Default)]
pub struct ImpactRecord {
    /// With the number of steps after which each was known.
    impacts: VecDeque<(u64, Impact)>,
    dropped: u64,
    /// Accepted steps up to which all impacts are recorded.
    steps: u64,
    /// Of the latest step.
    latest: Vec<Impact>,
}

impl ImpactRecord {
    /// Begins a new run.
    pub(super) fn begin(&mut self) {
        self.impacts.clear();
        (self.dropped, self.steps) = (0, 0);
    }

    /// Records the impacts that ended in the latest step; to be called after every step.
    pub(super) fn record(&mut self, simulation: &mut Simulation) {
        self.latest.clear();
        simulation.take_impacts(&mut self.latest);
        let steps = simulation.statistics().steps;
        if steps <= self.steps {
            return;
        }
        self.steps = steps;
        for impact in self.latest.drain(..) {
            if self.impacts.len() == KEPT {
                self.impacts.pop_front();
                self.dropped += 1;
            }
            // Others that began later may have ended before it.
            let at = self.impacts.partition_point(|(_, other)| other.start <= impact.start);
            self.impacts.insert(at, (steps, impact));
        }
    }

    /// Forgets what was known only after step number `steps`.
    pub(super) fn cut(&mut self, steps: u64) {
        self.impacts.retain(|(after, _)| *after <= steps);
        self.steps = self.steps.min(steps);
    }

    /// All that are kept, in order, with their numbers in the run, from 1.
    fn numbered(&self) -> impl DoubleEndedIterator<Item = (u64, &Impact)> {
        let first = self.dropped + 1;
        self.impacts.iter().enumerate().map(move |(at, (_, impact))| (first + at as u64, impact))
    }

    /// The impacts that had ended by `time`, s, with their numbers in the run, from 1.
    pub fn until(&self, time: f64) -> impl DoubleEndedIterator<Item = (u64, &Impact)> {
        self.numbered().filter(move |(_, impact)| impact.end <= time)
    }

    /// The impact under way at `time`, s: of ball joint `joint`, or of any; of several the one that began last.
    pub fn under_way(&self, joint: Option<usize>, time: f64) -> Option<(u64, &Impact)> {
        // The instants of a record and of an impact differ by rounding.
        let begun = time + ROUNDING * time.abs();
        self.numbered().rev().find(|(_, impact)| {
            impact.start <= begun && impact.end >= time && joint.is_none_or(|joint| joint == impact.joint)
        })
    }

    /// Number of impacts that are no longer kept.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }
}

/// Relative.
const ROUNDING: f64 = 1e-12;

#[cfg(test)]
mod tests {
    use super::*;

    fn record(ends: &[(f64, usize)]) -> ImpactRecord {
        let impacts = ends.iter().enumerate().map(|(at, (end, joint))| {
            let impact = Impact { joint: *joint, start: end - 1.5, end: *end, ..Impact::default() };
            (10 * (at as u64 + 1), impact)
        });
        ImpactRecord { impacts: impacts.collect(), dropped: 5, steps: 100, latest: Vec::new() }
    }

    #[test]
    fn impacts_keep_their_numbers_and_are_found_by_instant_and_joint() {
        let mut record = record(&[(2.0, 0), (3.0, 1), (6.0, 0)]);
        let numbers = |record: &ImpactRecord, time| record.until(time).map(|(number, _)| number).collect::<Vec<_>>();
        assert_eq!(numbers(&record, 1.0), [0; 0]);
        assert_eq!(numbers(&record, 3.0), [6, 7]);
        let at = |record: &ImpactRecord, joint, time| record.under_way(joint, time).map(|(number, _)| number);
        assert_eq!(at(&record, None, 1.7), Some(7), "of two the one that began last");
        assert_eq!(at(&record, Some(0), 1.7), Some(6));
        assert_eq!(at(&record, Some(1), 5.0), None);
        assert_eq!(at(&record, None, 4.5), Some(8), "from its very beginning");
        record.cut(20);
        assert_eq!(numbers(&record, 9.0), [6, 7]);
        assert_eq!(record.steps, 20);
    }
}
