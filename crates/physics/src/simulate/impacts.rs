//! Impacts: when each began, peaked and ended, and its restitution check: the requested restitution, the one that its law predicts,
//! and the one achieved.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::peaks::PenetrationCubic;
use crate::contact::{Coefficients, ElasticLaw, undisturbed_restitution};
use crate::machine::Vec3;
use crate::mechanism::ContactId;

/// Number of latest impacts stored.
const STORED_IMPACTS: usize = 64;
/// Work of other forces during an impact, relative to its energy, beyond which its law alone does not determine its restitution.
const MAX_EXTERNAL_WORK: f64 = 0.01;
/// The same beyond which its law does not determine its rebound.
const MAX_WORK_IN_REBOUND: f64 = 0.5;

/// A finished impact of one joint with play, from the start of an approaching contact to its end. A contact that existed at the
/// start, or that a live change ended, does not count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Impact {
    /// Joint with play, by its index in the scene.
    pub joint: usize,
    /// Where in it, among [`LooseKind::site_names`](crate::machine::LooseKind::site_names).
    pub place: u8,
    /// When it began, s.
    pub start: f64,
    /// When it ended, s.
    pub end: f64,
    /// Penetration rate when it began, m/s.
    pub approach_speed: f64,
    /// Minus the penetration rate when it ended, m/s.
    pub separation_speed: f64,
    /// The restitution asked for at its approach speed.
    pub requested: f64,
    /// Restitution that its normal-force law predicts for an undisturbed impact not slower than the floor.
    pub law: f64,
    /// Whether it began slower than `impact_speed_floor`: it then rebounds higher than requested.
    pub below_speed_floor: bool,
    /// Whether another contact that acts on the same bodies touched meanwhile, or a live change altered the contact: the law alone
    /// then does not determine its restitution.
    pub disturbed: bool,
    /// Accepted steps from its beginning to its end; with fixed steps, including those in which it begins and ends.
    pub steps: u64,
    /// Deepest penetration in continuous time, m.
    pub deepest: f64,
    /// Largest elastic energy in continuous time, J.
    pub energy: f64,
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

/// The largest normal force of an impact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ForcePeak {
    /// Time, s.
    pub time: f64,
    /// Force on the ball, N, world axes.
    pub force: Vec3,
}

/// What happened to an impact. Its number counts the impacts of the run in the order in which they were found to begin, from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ImpactEvent {
    /// It began.
    Began {
        /// Number of the impact.
        id: u64,
        /// Loose joint, by its index in the scene.
        joint: usize,
        /// Where in it, as [`Impact::place`].
        place: u8,
        /// When, s.
        start: f64,
    },
    /// Its normal force exceeded what it was before the step. The last of these events is its peak.
    Peaked {
        /// Number of the impact.
        id: u64,
        /// The largest force of the step.
        peak: ForcePeak,
    },
    /// It ended, after the peak of its last step.
    Ended {
        /// Number of the impact.
        id: u64,
        /// When, s.
        end: f64,
        /// All about it; `None` if a live change removed its wall.
        impact: Option<Impact>,
    },
}

impl ImpactEvent {
    /// The impact, if it ended and no live change removed its wall.
    pub fn finished(self) -> Option<Impact> {
        if let Self::Ended { impact, .. } = self { impact } else { None }
    }
}

/// The latest events, oldest first. Allocates nothing after `new`.
#[derive(Debug)]
pub(super) struct ImpactEvents {
    latest: VecDeque<ImpactEvent>,
}

impl ImpactEvents {
    /// For a machine with this number of contacts: a step adds at most three events of each.
    pub(super) fn new(contacts: usize) -> Self {
        Self { latest: VecDeque::with_capacity(3 * STORED_IMPACTS.max(2 * contacts)) }
    }

    pub(super) fn push(&mut self, event: ImpactEvent) {
        // A higher peak replaces that of the same impact: otherwise impacts of many steps would displace those before them.
        if let ImpactEvent::Peaked { id, .. } = event {
            let since =
                |earlier: &&mut ImpactEvent| !matches!(**earlier, ImpactEvent::Began { id: own, .. } if own == id);
            let lower =
                |earlier: &&mut ImpactEvent| matches!(**earlier, ImpactEvent::Peaked { id: own, .. } if own == id);
            if let Some(earlier) = self.latest.iter_mut().rev().take_while(since).find(lower) {
                *earlier = event;
                return;
            }
        }
        if self.latest.len() == self.latest.capacity() {
            self.latest.pop_front();
        }
        self.latest.push_back(event);
    }

    pub(super) fn take(&mut self) -> impl Iterator<Item = ImpactEvent> + '_ {
        self.latest.drain(..)
    }

    pub(super) fn clear(&mut self) {
        self.latest.clear();
    }
}

/// An impact under way.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct UnderWay {
    pub(super) id: u64,
    pub(super) impact: Impact,
    pub(super) peak: ForcePeak,
    /// Whether its peak lies in the step that is being recorded, and whether it ends there.
    rises: bool,
    ends: bool,
}

/// The impact of one contact under way, if any, and the law of its impacts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Contacting {
    under_way: Option<UnderWay>,
    /// Damping factor, and the restitution that results: kept, because computing it takes an iteration.
    law: (f64, f64),
}

/// The beginning of a contact.
pub(super) struct Onset {
    pub contact: ContactId,
    pub joint: usize,
    pub place: u8,
    /// s.
    pub time: f64,
    /// Penetration rate, m/s, and its rate of change before, m/s^2.
    pub speed: f64,
    pub push: f64,
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
    /// Number of finished ones, and of all begun.
    count: u64,
    begun: u64,
}

impl Impacts {
    /// Finished impacts still in the buffer.
    pub(super) fn stored(&self) -> &[Impact] {
        &self.finished
    }

    /// A record for this number of contacts.
    pub(super) fn new(contacts: usize) -> Self {
        Self {
            contacts: vec![Contacting { under_way: None, law: (0.0, 1.0) }; contacts],
            finished: vec![Impact::default(); STORED_IMPACTS],
            count: 0,
            begun: 0,
        }
    }

    /// Whether they fit a scene with this number of contacts and loose joints.
    pub(super) fn fits(&self, contacts: usize, joints: usize) -> bool {
        let mut known = self.under_way().map(|own| &own.impact).chain(&self.finished);
        self.contacts.len() == contacts
            && self.finished.len() == STORED_IMPACTS
            && self.count <= self.begun
            && known.all(|impact| impact.joint < joints.max(1))
    }

    /// Number of impacts begun.
    pub(super) fn begun(&self) -> u64 {
        self.begun
    }

    /// The impacts under way.
    pub(super) fn under_way(&self) -> impl Iterator<Item = &UnderWay> {
        self.contacts.iter().filter_map(|contact| contact.under_way.as_ref())
    }

    /// Records that a contact begins as `onset` says, under `coefficients`. A ball that reaches its wall at zero speed is no impact.
    pub(super) fn begin(
        &mut self,
        onset: &Onset,
        coefficients: &Coefficients,
        interacts: impl Fn(ContactId) -> bool,
        events: &mut ImpactEvents,
    ) {
        let others = self.contacts.iter_mut().enumerate().filter(|(other, _)| interacts(*other));
        for own in others.filter_map(|(_, other)| other.under_way.as_mut()).filter(|own| !own.ends) {
            own.impact.disturbed = true;
        }
        self.change(onset.contact, false, onset.time, events);
        let contact = &mut self.contacts[onset.contact];
        let damping = coefficients.damping_at(onset.speed);
        if contact.law.0 != damping {
            contact.law = (damping, undisturbed_restitution(damping));
        }
        if !(onset.speed > 0.0) {
            return;
        }
        let impact = Impact {
            joint: onset.joint,
            place: onset.place,
            start: onset.time,
            approach_speed: onset.speed,
            requested: coefficients.restitution_at(onset.speed),
            law: contact.law.1,
            below_speed_floor: onset.speed < coefficients.speed_floor,
            disturbed: onset.among_others,
            push: onset.push,
            ..Impact::default()
        };
        let (id, peak) = (self.begun, ForcePeak { time: onset.time, force: Vec3::zeros() });
        contact.under_way = Some(UnderWay { id, impact, peak, rises: false, ends: false });
        self.begun += 1;
        events.push(ImpactEvent::Began { id, joint: onset.joint, place: onset.place, start: onset.time });
    }

    /// Updates contact `c` over a step in which it was, or became, active, from its elastic law, its penetration and its largest
    /// ratio of damping to elastic force.
    pub(super) fn update(&mut self, c: ContactId, elastic: &ElasticLaw, cubic: &PenetrationCubic, damping: f64) {
        if let Some(UnderWay { impact, .. }) = &mut self.contacts[c].under_way {
            impact.steps += 1;
            impact.damping = impact.damping.max(damping);
            let deepest = cubic.deepest();
            impact.deepest = impact.deepest.max(deepest);
            impact.energy = impact.energy.max(elastic.energy(deepest));
        }
    }

    /// Takes into account that the normal force at contact `c` is `force`, N, along `direction`, at `time`, s.
    pub(super) fn raise_peak(&mut self, c: ContactId, force: f64, direction: Vec3, time: f64) {
        if let Some(own) = &mut self.contacts[c].under_way
            && force > own.impact.peak
        {
            own.impact.peak = force;
            own.peak = ForcePeak { time, force: direction * force };
            own.rises = true;
        }
    }

    /// Reports what the step just recorded brought.
    #[inline]
    pub(super) fn end_step(&mut self, events: &mut ImpactEvents) {
        for contact in &mut self.contacts {
            let Some(UnderWay { id, impact, peak, rises, ends }) = &mut contact.under_way else {
                continue;
            };
            let id = *id;
            if std::mem::take(rises) {
                events.push(ImpactEvent::Peaked { id, peak: *peak });
            }
            if *ends {
                let impact = *impact;
                self.finished[(self.count % STORED_IMPACTS as u64) as usize] = impact;
                self.count += 1;
                contact.under_way = None;
                events.push(ImpactEvent::Ended { id, end: impact.end, impact: Some(impact) });
            }
        }
    }

    /// Approach speed of the impact under way at `c`, and the speed with which its law lets it separate, m/s, if neither other
    /// contacts nor other forces determine its course. Below `floor` (m/s) the damping is less by the ratio of the speeds, and so
    /// is the loss, to first order.
    pub(super) fn speeds_under_way(&self, c: ContactId, floor: f64) -> Option<[f64; 2]> {
        let is_own = |impact: &&Impact| !impact.disturbed && impact.external_work() < MAX_WORK_IN_REBOUND;
        let impact = self.contacts[c].under_way.as_ref().map(|own| &own.impact).filter(is_own)?;
        let (speed, law) = (impact.approach_speed, impact.law);
        Some([speed, speed * (1.0 - (1.0 - law) * (speed / floor).min(1.0))])
    }

    /// Largest normal force so far in the current impact at `c`, N; infinite without one.
    pub(super) fn peak_under_way(&self, c: ContactId) -> f64 {
        let own = &self.contacts[c].under_way;
        own.as_ref().map_or(f64::INFINITY, |own| own.impact.peak)
    }

    /// Ends contact `c` at `time`, s, in the step being recorded, with the penetration rate `rate`. Returns the impact, if it was one.
    pub(super) fn end(&mut self, c: ContactId, time: f64, rate: f64) -> Option<&Impact> {
        let UnderWay { impact, ends, .. } = self.contacts[c].under_way.as_mut()?;
        impact.end = time;
        impact.separation_speed = (-rate).max(0.0);
        *ends = true;
        Some(impact)
    }

    /// Records that a live change altered contact `c`, or ended it at `time`, s, if `in_contact` is false.
    pub(super) fn change(&mut self, c: ContactId, in_contact: bool, time: f64, events: &mut ImpactEvents) {
        let under_way = &mut self.contacts[c].under_way;
        if in_contact {
            if let Some(own) = under_way {
                own.impact.disturbed = true;
            }
        } else if let Some(own) = under_way.take() {
            events.push(ImpactEvent::Ended { id: own.id, end: time, impact: None });
        }
    }

    /// The latest finished ones, at most 64, oldest first.
    pub(super) fn latest(&self) -> impl ExactSizeIterator<Item = &Impact> + DoubleEndedIterator {
        let length = STORED_IMPACTS as u64;
        let first = self.count.saturating_sub(length);
        let count = (self.count - first) as usize;
        (0..count).map(move |n| &self.finished[((first + n as u64) % length) as usize])
    }
}
