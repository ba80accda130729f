//! Restitution check: for each impact, the requested restitution, the one that its law predicts, and the one achieved.

use serde::{Deserialize, Serialize};

use super::peaks::PenetrationCubic;
use crate::contact::{Coefficients, undisturbed_restitution};
use crate::mechanism::ContactId;

/// Number of latest impacts stored.
const STORED_IMPACTS: usize = 64;
/// Work of other forces during an impact, relative to its energy, beyond which its law alone does not determine its restitution.
const MAX_EXTERNAL_WORK: f64 = 0.01;
/// The same beyond which its law does not determine its rebound.
const MAX_WORK_IN_REBOUND: f64 = 0.5;

/// A finished impact of one ball joint, from the start of an approaching contact to its end. A contact that existed at the
/// start, or that a live change ended, does not count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Impact {
    /// Ball joint, by its index in the scene.
    pub joint: usize,
    /// When it began, s.
    pub start: f64,
    /// When it ended, s.
    pub end: f64,
    /// Penetration rate when it began, m/s.
    pub approach_speed: f64,
    /// Minus the penetration rate when it ended, m/s.
    pub separation_speed: f64,
    /// The joint's restitution setting when it began.
    pub requested: f64,
    /// Restitution that its normal-force law predicts for an undisturbed impact not slower than the floor.
    pub law: f64,
    /// Whether it began slower than `impact_speed_floor`: it then rebounds higher than requested.
    pub below_speed_floor: bool,
    /// Whether another ball joint that acts on the same bodies was in contact meanwhile, or a live change altered the contact: the law alone then does not
    /// determine its restitution.
    pub disturbed: bool,
    /// Accepted steps from its beginning to its end; with fixed steps, including those in which it begins and ends.
    pub steps: u64,
    /// Deepest penetration in continuous time, m.
    pub deepest: f64,
    /// Largest normal force in continuous time, N.
    pub peak: f64,
    /// Mean rate of change of the penetration rate over the step before it, m/s^2: the effect of other forces.
    pub push: f64,
    /// Largest ratio of damping to elastic force: the damping factor at its start, unless it is hit again or began slower
    /// than the floor.
    pub damping: f64,
}

impl Impact {
    /// Actual restitution: separation speed over approach speed.
    pub fn achieved(&self) -> f64 {
        self.separation_speed / self.approach_speed
    }

    /// Excess of its restitution over its law's prediction, which friction and the motion it causes can only lower; 0 if the two
    /// cannot be compared, as in [`Self::has_own_restitution`].
    pub(crate) fn restitution_excess(&self) -> f64 {
        if self.has_own_restitution() { (self.achieved() - self.law).max(0.0) } else { 0.0 }
    }

    /// Whether other forces, such as weight and drives, do enough work during it to change its restitution.
    pub fn is_soft(&self) -> bool {
        !(self.external_work() <= MAX_EXTERNAL_WORK)
    }

    /// Work of other forces while it is compressed, relative to its energy.
    fn external_work(&self) -> f64 {
        2.0 * self.push.abs() * self.deepest / (self.approach_speed * self.approach_speed)
    }

    /// Whether its restitution can be compared with its law's prediction: it was neither disturbed nor slow nor soft.
    pub fn has_own_restitution(&self) -> bool {
        !(self.disturbed || self.below_speed_floor || self.is_soft())
    }
}

/// The impact of one contact under way, if any, and the law of its impacts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Contacting {
    impact: Option<Impact>,
    /// Damping factor, and the restitution that results: kept, because computing it takes an iteration.
    law: (f64, f64),
}

/// The beginning of a contact.
pub(super) struct Onset {
    pub contact: ContactId,
    pub joint: usize,
    /// s.
    pub time: f64,
    /// Penetration rate, m/s, and its rate of change before, m/s^2.
    pub speed: f64,
    pub push: f64,
    /// Requested restitution.
    pub requested: f64,
    /// Whether another contact touches that acts on the same bodies.
    pub among_others: bool,
}

/// Impacts under way and the latest finished ones: part of a simulation's state. Allocates nothing after `new`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Impacts {
    /// By contact.
    contacts: Vec<Contacting>,
    /// Finished ones, as a ring buffer: impact n is at index n modulo its length.
    finished: Vec<Impact>,
    /// Number of finished ones, and of those handed out.
    count: u64,
    handed_out: u64,
}

impl Impacts {
    /// Finished impacts still in the buffer.
    pub(super) fn stored(&self) -> &[Impact] {
        &self.finished
    }

    /// A record for this number of contacts. A step finishes at most one impact at each, so that all of them can be collected
    /// between two steps.
    pub(super) fn new(contacts: usize) -> Self {
        Self {
            contacts: vec![Contacting { impact: None, law: (0.0, 1.0) }; contacts],
            finished: vec![Impact::default(); STORED_IMPACTS.max(contacts)],
            count: 0,
            handed_out: 0,
        }
    }

    /// Whether they fit a scene with this number of contacts and loose joints.
    pub(super) fn fits(&self, contacts: usize, joints: usize) -> bool {
        let own = Self::new(contacts);
        let mut known = self.contacts.iter().filter_map(|contact| contact.impact.as_ref()).chain(&self.finished);
        self.contacts.len() == contacts
            && self.finished.len() == own.finished.len()
            && self.handed_out <= self.count
            && known.all(|impact| impact.joint < joints.max(1))
    }

    /// Records that a contact begins as `onset` says, under `coefficients`.
    pub(super) fn begin(&mut self, onset: &Onset, coefficients: &Coefficients, interacts: impl Fn(ContactId) -> bool) {
        let others = self.contacts.iter_mut().enumerate().filter(|(other, _)| interacts(*other));
        for impact in others.filter_map(|(_, other)| other.impact.as_mut()) {
            impact.disturbed = true;
        }
        let contact = &mut self.contacts[onset.contact];
        if contact.law.0 != coefficients.damping {
            contact.law = (coefficients.damping, undisturbed_restitution(coefficients.damping));
        }
        contact.impact = (onset.speed > 0.0).then_some(Impact {
            joint: onset.joint,
            start: onset.time,
            approach_speed: onset.speed,
            requested: onset.requested,
            law: contact.law.1,
            below_speed_floor: onset.speed < coefficients.speed_floor,
            disturbed: onset.among_others,
            push: onset.push,
            ..Impact::default()
        });
    }

    /// Updates contact `c` over a step in which it was, or became, active, from its penetration, its largest normal
    /// force (N) and its largest ratio of damping to elastic force.
    pub(super) fn update(&mut self, c: ContactId, cubic: &PenetrationCubic, force: f64, damping: f64) {
        if let Some(impact) = &mut self.contacts[c].impact {
            impact.steps += 1;
            impact.damping = impact.damping.max(damping);
            impact.deepest = impact.deepest.max(cubic.deepest());
            impact.peak = impact.peak.max(force);
        }
    }

    /// Approach speed of the impact under way at `c`, and the speed with which its law lets it separate, m/s, if neither other
    /// contacts nor other forces determine its course. Below `floor` (m/s) the damping is less by the ratio of the speeds, and so
    /// is the loss, to first order.
    pub(super) fn speeds_under_way(&self, c: ContactId, floor: f64) -> Option<[f64; 2]> {
        let is_own = |impact: &&Impact| !impact.disturbed && impact.external_work() < MAX_WORK_IN_REBOUND;
        let impact = self.contacts[c].impact.as_ref().filter(is_own)?;
        let (speed, law) = (impact.approach_speed, impact.law);
        Some([speed, speed * (1.0 - (1.0 - law) * (speed / floor).min(1.0))])
    }

    /// Largest normal force so far in the current impact at `c`, N; infinite without one.
    pub(super) fn peak_under_way(&self, c: ContactId) -> f64 {
        let impact = &self.contacts[c].impact;
        impact.as_ref().map_or(f64::INFINITY, |impact| impact.peak)
    }

    /// Ends contact `c` at `time` with the penetration rate `rate`. Returns the impact, if it was one.
    pub(super) fn end(&mut self, c: ContactId, time: f64, rate: f64) -> Option<Impact> {
        let mut impact = self.contacts[c].impact.take()?;
        impact.end = time;
        impact.separation_speed = (-rate).max(0.0);
        let slot = (self.count % self.finished.len() as u64) as usize;
        self.finished[slot] = impact;
        self.count += 1;
        Some(impact)
    }

    /// Records that a live change altered contact `c`, or ended it if `in_contact` is false.
    pub(super) fn change(&mut self, c: ContactId, in_contact: bool) {
        let impact = &mut self.contacts[c].impact;
        if in_contact {
            if let Some(impact) = impact {
                impact.disturbed = true;
            }
        } else {
            *impact = None;
        }
    }

    /// The latest finished ones, at most 64, oldest first.
    pub(super) fn latest(&self) -> impl ExactSizeIterator<Item = &Impact> + DoubleEndedIterator {
        let first = self.count.saturating_sub(STORED_IMPACTS as u64);
        self.since(first)
    }

    fn since(&self, first: u64) -> impl ExactSizeIterator<Item = &Impact> + DoubleEndedIterator {
        let length = self.finished.len() as u64;
        let count = (self.count - first) as usize;
        (0..count).map(move |n| &self.finished[((first + n as u64) % length) as usize])
    }

    /// Appends the impacts not yet handed out.
    pub(super) fn take_new(&mut self, out: &mut Vec<Impact>) {
        let oldest = self.count.saturating_sub(self.finished.len() as u64);
        out.extend(self.since(self.handed_out.max(oldest)));
        self.handed_out = self.count;
    }
}
