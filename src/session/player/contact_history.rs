//! Contact state of each joint with play over time: free, slip or creep, and where it touches.

use crate::simulate::{ContactMode, Frame};

/// Most state changes stored for all joints together; beyond that the older half is dropped.
const MAX_CHANGES: usize = 200_000;

/// The contact states of a run over time. Retraced time is recorded once.
#[derive(Clone, Debug, Default)]
pub struct ContactHistory {
    /// By joint: start time, s, and state.
    joints: Vec<Vec<(f64, ContactMode)>>,
    /// By joint: start time, s, and the places that touch, a bit each; empty for a joint that touches at one place only.
    places: Vec<Vec<(f64, u16)>>,
    changes: usize,
    from: f64,
    to: f64,
}

impl ContactHistory {
    /// Begins a new run at `time`, s.
    pub(super) fn begin(&mut self, time: f64) {
        self.joints.clear();
        self.places.clear();
        self.changes = 0;
        (self.from, self.to) = (time, f64::NEG_INFINITY);
    }

    /// Records the next instant of the run.
    pub(super) fn record(&mut self, frame: &Frame) {
        if frame.time <= self.to {
            return;
        }
        self.to = frame.time;
        self.joints.resize_with(frame.joints.len(), Vec::new);
        for (states, now) in self.joints.iter_mut().zip(&frame.joints) {
            if states.last().is_none_or(|(_, state)| *state != now.state) {
                states.push((frame.time, now.state));
                self.changes += 1;
            }
        }
        self.places.resize_with(frame.joints.len(), Vec::new);
        for (joint, places) in self.places.iter_mut().enumerate() {
            let sites = frame.sites_of(joint).iter().enumerate();
            let touching = sites.filter(|(_, site)| site.gap < 0.0).fold(0, |all, (place, _)| all | 1 << place);
            let before = places.last().map_or(0, |(_, before)| *before);
            if touching != before {
                places.push((frame.time, touching));
                self.changes += 1;
            }
        }
        if self.changes > MAX_CHANGES {
            self.drop_older_half();
        }
    }

    fn drop_older_half(&mut self) {
        let middle = 0.5 * (self.from + self.to);
        self.from = middle;
        self.joints.iter_mut().for_each(|states| drop_before(states, middle));
        self.places.iter_mut().for_each(|places| drop_before(places, middle));
        self.count();
    }

    fn count(&mut self) {
        let places = self.places.iter().map(Vec::len).sum::<usize>();
        self.changes = places + self.joints.iter().map(Vec::len).sum::<usize>();
    }

    /// Drops the states after `time`, s.
    pub(super) fn truncate(&mut self, time: f64) {
        for states in &mut self.joints {
            states.truncate(states.partition_point(|(from, _)| *from <= time));
        }
        for places in &mut self.places {
            places.truncate(places.partition_point(|(from, _)| *from <= time));
        }
        self.count();
        self.to = self.to.min(time);
    }

    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.joints.len()
    }

    /// Time from which the states are known, s.
    pub fn known_from(&self) -> f64 {
        self.from
    }

    /// The states of joint `joint` between two times, s: start, end, state.
    pub fn states(&self, joint: usize, from: f64, to: f64) -> impl Iterator<Item = (f64, f64, ContactMode)> {
        let states = self.joints.get(joint).map_or(&[][..], Vec::as_slice);
        let first = states.partition_point(|(time, _)| *time <= from);
        let all = states[first.saturating_sub(1)..].iter().enumerate();
        let at = first.saturating_sub(1);
        all.take_while(move |(_, (time, _))| *time < to).map(move |(index, (time, state))| {
            let next = states.get(at + index + 1);
            (*time, next.map_or(self.to, |next| next.0), *state)
        })
    }

    /// Times between two given ones, s, at which joint `joint` came into contact.
    pub fn touches(&self, joint: usize, from: f64, to: f64) -> impl Iterator<Item = f64> {
        let states = self.joints.get(joint).map_or(&[][..], Vec::as_slice);
        let first = states.partition_point(|(time, _)| *time < from);
        let pairs = states[first.saturating_sub(1)..].windows(2);
        let is_touch = |pair: &&[(f64, ContactMode)]| pair[0].1 == ContactMode::Free && pair[1].1.touches();
        pairs
            .filter(is_touch)
            .map(|pair| pair[1].0)
            .filter(move |time| *time >= from)
            .take_while(move |time| *time <= to)
    }

    /// Times between two given ones, s, at which joint `joint` came into contact at one of several places, each with the place.
    pub fn place_touches(&self, joint: usize, from: f64, to: f64) -> impl Iterator<Item = (f64, u8)> {
        let places = self.places.get(joint).map_or(&[][..], Vec::as_slice);
        let first = places.partition_point(|(time, _)| *time < from);
        let within = (first..places.len()).map(move |at| {
            let before = at.checked_sub(1).map_or(0, |before| places[before].1);
            let (time, touching) = places[at];
            (time, touching & !before)
        });
        within.take_while(move |(time, _)| *time <= to).flat_map(|(time, begun)| {
            (0..16).filter(move |place| begun >> place & 1 == 1).map(move |place| (time, place))
        })
    }

    /// Times between two given ones, s, during which joint `joint` touches at one of `wanted`, a bit for each place: start, end.
    pub fn place_contacts(&self, joint: usize, wanted: u16, from: f64, to: f64) -> impl Iterator<Item = (f64, f64)> {
        let places = self.places.get(joint).map_or(&[][..], Vec::as_slice);
        let first = places.partition_point(|(time, _)| *time <= from).saturating_sub(1);
        let touching = (first..places.len()).take_while(move |at| places[*at].0 < to);
        let touching = touching.filter(move |at| places[*at].1 & wanted != 0);
        touching.map(move |at| (places[at].0, places.get(at + 1).map_or(self.to, |next| next.0)))
    }

    /// The places at which joint `joint` touches at `time`, s.
    pub fn places_at(&self, joint: usize, time: f64) -> impl Iterator<Item = u8> {
        let places = self.places.get(joint).map_or(&[][..], Vec::as_slice);
        let at = places.partition_point(|(from, _)| *from <= time).checked_sub(1);
        let touching = at.map_or(0, |at| places[at].1);
        (0..16).filter(move |place| touching >> place & 1 == 1)
    }
}

/// Drops what ended before `time`, s.
fn drop_before<T>(states: &mut Vec<(f64, T)>, time: f64) {
    let dropped = states.partition_point(|(from, _)| *from <= time);
    states.drain(..dropped.saturating_sub(1));
    if let Some(first) = states.first_mut() {
        first.0 = first.0.max(time);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::Vec3;
    use crate::simulate::{JointReport, SiteReport, Sliding};

    fn frame(time: f64, state: ContactMode) -> Frame {
        Frame { time, joints: vec![JointReport { state, ..JointReport::default() }], ..Frame::default() }
    }

    fn history() -> ContactHistory {
        use ContactMode::{Creep, Free, Slip};
        let mut history = ContactHistory::default();
        history.begin(0.0);
        let states = [Free, Free, Slip, Creep, Free, Slip, Slip];
        for (index, state) in states.into_iter().enumerate() {
            history.record(&frame(index as f64, state));
        }
        history
    }

    #[test]
    fn states_follow_one_another_without_gaps() {
        use ContactMode::{Creep, Free, Slip};
        let history = history();
        let all: Vec<_> = history.states(0, 0.0, 9.0).collect();
        let expected = [(0.0, 2.0, Free), (2.0, 3.0, Slip), (3.0, 4.0, Creep), (4.0, 5.0, Free), (5.0, 6.0, Slip)];
        assert_eq!(all, expected);
        let part: Vec<_> = history.states(0, 2.5, 3.5).collect();
        assert_eq!(part, expected[1..3]);
        assert_eq!(history.states(1, 0.0, 9.0).count(), 0);
    }

    #[test]
    fn touches_are_found_and_retracing_adds_none() {
        let mut history = history();
        for _ in 0..2 {
            let touches: Vec<f64> = history.touches(0, 0.0, 9.0).collect();
            assert_eq!(touches, [2.0, 5.0]);
            history.record(&frame(1.0, ContactMode::Creep));
        }
        history.truncate(2.5);
        assert_eq!(history.touches(0, 2.1, 9.0).next(), None);
        history.record(&frame(3.0, ContactMode::Free));
        history.record(&frame(4.0, ContactMode::Creep));
        assert_eq!(history.touches(0, 2.1, 9.0).next(), Some(4.0));
    }

    #[test]
    fn a_long_run_drops_its_oldest_states_and_reports_the_start_of_the_known_time() {
        let mut history = ContactHistory::default();
        history.begin(0.0);
        for index in 0..=MAX_CHANGES + 10 {
            let state = if index % 2 == 0 { ContactMode::Free } else { ContactMode::Slip };
            history.record(&frame(index as f64, state));
        }
        let from = history.known_from();
        assert!(from > 0.4 * MAX_CHANGES as f64);
        let (start, ..) = history.states(0, 0.0, 1e9).next().expect("kept");
        assert_eq!(start, from);
        assert!(history.changes <= MAX_CHANGES / 2 + 12);
    }

    #[test]
    fn each_place_of_a_joint_begins_and_ends_for_itself() {
        let mut history = ContactHistory::default();
        history.begin(0.0);
        let zero = Vec3::zeros();
        // The ends of joint 1 touch one after the other, then both, then neither.
        let gaps = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, -1.0]];
        for (index, gaps) in gaps.into_iter().enumerate() {
            let site = |gap| SiteReport {
                joint: 1,
                gap,
                normal_force: zero,
                friction_force: zero,
                contact_point: zero,
                sliding: Sliding::default(),
            };
            let joints = vec![JointReport::default(); 2];
            let sites = gaps.map(site).to_vec();
            history.record(&Frame { time: index as f64, joints, sites, ..Frame::default() });
        }
        let touches = |history: &ContactHistory| history.place_touches(1, 0.0, 9.0).collect::<Vec<_>>();
        assert_eq!(touches(&history), [(1.0, 0), (2.0, 1), (5.0, 0), (5.0, 1)]);
        assert_eq!(history.place_touches(0, 0.0, 9.0).count(), 0);
        let at = |time| history.places_at(1, time).collect::<Vec<_>>();
        assert_eq!([at(0.5), at(1.5), at(2.5), at(3.5)], [vec![], vec![0], vec![0, 1], vec![1]]);
        let during = |wanted| history.place_contacts(1, wanted, 0.0, 9.0).collect::<Vec<_>>();
        assert_eq!(during(0b01), [(1.0, 2.0), (2.0, 3.0), (5.0, 5.0)]);
        assert_eq!(during(0b10), [(2.0, 3.0), (3.0, 4.0), (5.0, 5.0)]);
        assert_eq!(history.place_contacts(1, 0b10, 2.5, 2.8).collect::<Vec<_>>(), [(2.0, 3.0)]);
        history.truncate(3.5);
        assert_eq!(touches(&history), [(1.0, 0), (2.0, 1)]);
    }
}
