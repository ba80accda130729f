//! How fast the plays of a run wear: by how much they grew in its last full period.

use std::collections::VecDeque;

use crate::analysis::drive::common_period;
use crate::scene::Scene;
use crate::simulate::{Frame, Simulation};

/// Most ends of periods that are stored; beyond that the oldest are dropped.
const MAX_ENDS: usize = 2000;
/// Substitute for the period of a scene without periodic drives, s.
const FALLBACK_PERIOD: f64 = 1.0;

/// Worn depths at the ends of the periods of one run since its start or its latest change. Periods are counted from t = 0.
#[derive(Clone)]
pub struct WearWatch {
    /// Longest period of the drives, s.
    period: f64,
    /// Whether any joint wears; otherwise nothing is stored.
    wears: bool,
    /// Number of the next end.
    next: u64,
    /// Number of each end, and depths of both plays of the joints, m.
    ends: VecDeque<(u64, Vec<[f64; 2]>)>,
    frame: Frame,
}

impl WearWatch {
    /// Watches a run of `scene` from `now`, s.
    pub fn new(scene: &Scene, now: f64) -> Self {
        let period = common_period(&scene.machine).unwrap_or_else(|[first, second]| Some(first.max(second)));
        let mut watch = Self {
            period: period.unwrap_or(FALLBACK_PERIOD),
            wears: scene.machine.loose_joints.iter().any(|joint| joint.contact.wear_coefficient > 0.0),
            next: 0,
            ends: VecDeque::new(),
            frame: Frame::default(),
        };
        watch.go_to(now);
        watch
    }

    /// Growth of both plays of each joint over the last full period before `shown`, s, in m/s; `None` without such a period.
    pub fn rates(&self, shown: f64) -> Option<Vec<[f64; 2]>> {
        let count = self.ends.partition_point(|(end, _)| *end as f64 * self.period <= shown);
        let [start, end] = [count.checked_sub(2)?, count - 1].map(|index| &self.ends[index]);
        let rate =
            |(before, after): (&[f64; 2], &[f64; 2])| [0, 1].map(|play| (after[play] - before[play]) / self.period);
        (end.0 == start.0 + 1).then(|| start.1.iter().zip(&end.1).map(rate).collect())
    }

    /// Drops data after `now`, s, for a new branch.
    pub fn truncate(&mut self, now: f64) {
        self.ends.truncate(self.ends.partition_point(|(end, _)| *end as f64 * self.period <= now));
        self.go_to(now);
    }

    /// The run, of `scene` then, continues from `now`, s, after going back. Known data of the same period stay.
    pub fn go_back(&mut self, scene: &Scene, now: f64) {
        let next = Self::new(scene, now);
        if next.period == self.period {
            self.wears = next.wears;
            self.go_to(now);
        } else {
            *self = next;
        }
    }

    /// Makes the end after `now`, s, the next.
    fn go_to(&mut self, now: f64) {
        self.next = (now / self.period).ceil().max(0.0) as u64;
    }

    /// Adds the ends in the latest step up to `until`, s, by interpolation. Sampling never changes a run.
    pub fn step(&mut self, simulation: &mut Simulation, until: f64) {
        if !self.wears {
            return;
        }
        // Earlier ones would be dropped again: a step may be much longer than the period.
        let kept = (until / self.period).floor() - MAX_ENDS as f64;
        self.next = self.next.max(kept.max(0.0) as u64);
        while self.next as f64 * self.period <= until {
            let end = self.next;
            self.next += 1;
            if self.ends.back().is_some_and(|(last, _)| end <= *last) {
                continue;
            }
            simulation.sample(end as f64 * self.period, &mut self.frame);
            if self.ends.len() == MAX_ENDS {
                self.ends.pop_front();
            }
            self.ends.push_back((end, self.frame.joints.iter().map(|joint| joint.worn).collect()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(watch: &mut WearWatch, simulation: &mut Simulation, to: f64) {
        while simulation.time() < to {
            simulation.step().expect("runs");
            watch.step(simulation, simulation.time());
        }
    }

    #[test]
    fn rates_are_those_of_the_last_full_period_of_the_run() {
        let changes = [("spcmm.frequency", "20 Hz"), ("contact.wear_coefficient", "1e-12 m^2/N")];
        let changes = changes.map(|(key, value)| (key.to_owned(), value.to_owned()));
        let scene = Scene::load("spcmm", &changes).expect("built in");
        let start = || Simulation::new(&scene.machine).expect("starts");
        let depths = |to: f64| -> Vec<f64> {
            let (mut simulation, mut frame) = (start(), Frame::default());
            simulation.advance_to(to).expect("runs");
            simulation.sample(to, &mut frame);
            frame.joints.iter().map(|joint| joint.worn[0]).collect()
        };
        let (before, after) = (depths(0.05), depths(0.1));
        let (mut watch, mut simulation) = (WearWatch::new(&scene, 0.0), start());
        run(&mut watch, &mut simulation, 0.12);
        assert_eq!(watch.rates(0.04), None);
        let rates = watch.rates(0.11).expect("two ends");
        for ((before, after), [rate, second]) in before.iter().zip(&after).zip(&rates) {
            assert!(after > before && *second == 0.0);
            assert!((rate * 0.05 / (after - before) - 1.0).abs() < 1e-6, "{rate} {before} {after}");
        }
        assert_ne!(watch.rates(0.09), Some(rates));
        // Nothing is known of a period in which something changed, or was not seen.
        let mut later = WearWatch::new(&scene, simulation.time());
        run(&mut later, &mut simulation, 0.19);
        assert_eq!(later.rates(0.19), None);
        run(&mut later, &mut simulation, 0.21);
        assert!(later.rates(0.21).is_some());
        watch.go_to(0.21);
        run(&mut watch, &mut simulation, 0.26);
        assert_eq!(watch.rates(0.26), None);
        watch.truncate(0.11);
        assert!(watch.rates(0.26).is_some(), "the data before the branch");
    }

    #[test]
    fn without_wear_nothing_is_stored() {
        let scene = Scene::load("pendulum", &[]).expect("built in");
        let (mut watch, mut simulation) =
            (WearWatch::new(&scene, 0.0), Simulation::new(&scene.machine).expect("starts"));
        run(&mut watch, &mut simulation, 0.1);
        assert!(watch.ends.is_empty());
    }
}
