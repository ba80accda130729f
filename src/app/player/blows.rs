//! The hardest force of every contact of a run, so that a past instant shows the blows that came shortly before it.

use crate::scene::Vec3;
use crate::simulate::Peak;

/// Most contacts kept for all joints together; beyond that the older half is dropped.
const KEPT: usize = 100_000;
/// Most that are looked through for those before an instant.
const SEARCHED: usize = 4096;

/// The hardest force of a contact.
#[derive(Clone, Copy, Debug)]
pub struct Blow {
    /// Ball joint.
    pub joint: usize,
    /// When, s.
    pub time: f64,
    /// Normal force on the ball, N, world axes.
    pub force: Vec3,
}

/// What is known of a joint in contact whose force may still rise.
#[derive(Clone, Copy, Debug, Default)]
struct Rising {
    /// Largest force so far, N; `None` outside a rise.
    force: Option<f64>,
    /// Its place in the list; `None` before there is a force.
    place: Option<usize>,
    /// End of the latest step recorded, s: a step taken again is recorded once.
    to: f64,
}

/// The blows of a run, in the order in which their contacts began.
#[derive(Clone, Debug, Default)]
pub struct Blows {
    all: Vec<Blow>,
    joints: Vec<Rising>,
}

impl Blows {
    /// A new run begins.
    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }

    /// Records the `peak` of ball joint `joint` in the step that ends at `end`, s.
    pub(super) fn record(&mut self, joint: usize, peak: &Peak, end: f64) {
        if joint >= self.joints.len() {
            self.joints.resize(joint + 1, Rising::default());
        }
        let rising = &mut self.joints[joint];
        if end <= rising.to {
            return;
        }
        rising.to = end;
        let begins = peak.impacts > 0;
        let rises = rising.force.is_some_and(|before| peak.normal > before);
        if peak.normal <= 0.0 || !(begins || rises) {
            // A contact that begins at the end of the step has no force yet.
            (rising.force, rising.place) = (begins.then_some(0.0), None);
            return;
        }
        let blow = Blow { joint, time: peak.time, force: peak.normal_force };
        rising.force = Some(peak.normal);
        match rising.place.filter(|_| !begins) {
            Some(place) => self.all[place] = blow,
            None => {
                rising.place = Some(self.all.len());
                self.all.push(blow);
            }
        }
        if self.all.len() > KEPT {
            self.all.drain(..KEPT / 2);
            self.joints.iter_mut().for_each(|rising| (rising.force, rising.place) = (None, None));
        }
    }

    /// Forgets what came after `time`, s.
    pub(super) fn cut(&mut self, time: f64) {
        self.all.retain(|blow| blow.time <= time);
        for rising in &mut self.joints {
            *rising = Rising { to: rising.to.min(time), ..Rising::default() };
        }
    }

    /// The blows after `from` and up to `to`, s.
    pub fn between(&self, from: f64, to: f64) -> impl Iterator<Item = &Blow> {
        // One whose contact began earlier may be the later one, by less than a contact lasts.
        let end = self.all.partition_point(|blow| blow.time <= to);
        let first = end.saturating_sub(SEARCHED);
        let last = (end + 64).min(self.all.len());
        self.all[first..last].iter().filter(move |blow| blow.time > from && blow.time <= to)
    }
}
