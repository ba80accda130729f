//! Everything about a run that changes.

use serde::{Deserialize, Serialize};

use super::ideal::IdealState;
use super::impacts::{Impact, Impacts};
use super::ledger::{Account, Ledger};
use super::load_peaks::LoadPeaks;
use super::peaks::{Approach, Recent};
use super::run::{FIRST_CONTACT_STEP, LONGEST_STEP, SchemeSelector, controller_of};
use super::stepper::{ActiveScheme, AnyStepper};
use super::wear::Wear;
use super::workspace::Follows;
use super::{Model, Peak, Statistics};
use crate::contact::ContactState;
use crate::integrate::{Controller, Polynomial};
use crate::machine::Conditions;
use crate::mechanism::{Flight, Mechanism, Pull, Ramp};

/// The state of a run of a [`Model`]: all that changes, each fact once. A clone is a snapshot, and serialised it is a saved run;
/// stepping on from either gives the same bits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct State {
    /// The physical state.
    pub(super) now: Instant,
    /// Gravity, contacts and stepper with the live changes so far.
    pub(super) conditions: Conditions,
    /// Active clearance ramps, and clearances without them, m.
    pub(super) ramps: Vec<Option<Ramp>>,
    pub(super) clearances: Vec<f64>,
    /// The hand's pull, if any.
    pub(super) pull: Option<Pull>,
    /// Flights of the bodies excluded from the latest step, indexed like the mechanism's free-flight bodies.
    pub(super) flights: Vec<Option<Flight>>,
    pub(super) control: Control,
    /// Empty with a method that has none.
    pub(super) polynomial: Polynomial,
    pub(super) record: Record,
    /// Largest sampled force, N, and its time, s, by joint: kept apart from the record, which sampling does not change.
    pub(super) sampled: Vec<(f64, f64)>,
    /// Load peaks, if tracked; sampling changes them.
    pub(super) loads: Option<LoadPeaks>,
    /// The ideal motion, if it is simulated alongside; sampling takes it along.
    pub(super) ideal: Option<Box<IdealState>>,
    #[serde(skip)]
    pub(super) follows: Follows,
}

/// State vector, derivative, gaps and contact state at one instant.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Instant {
    pub(super) t: f64,
    /// Coordinates, then velocities.
    pub(super) y: Vec<f64>,
    /// Their derivative.
    pub(super) k: Vec<f64>,
    pub(super) gaps: Vec<Approach>,
    /// Contact contact_state for the step that begins here.
    pub(super) contact_states: Vec<ContactState>,
}

impl Instant {
    pub(super) fn new(y: Vec<f64>, joints: usize) -> Self {
        Self {
            t: 0.0,
            k: vec![0.0; y.len()],
            gaps: vec![Approach::default(); joints],
            contact_states: vec![ContactState::default(); joints],
            y,
        }
    }

    /// Copies `other`, of the same model, without allocating.
    pub(super) fn copy_from(&mut self, other: &Self) {
        self.t = other.t;
        self.y.copy_from_slice(&other.y);
        self.k.copy_from_slice(&other.k);
        self.gaps.copy_from_slice(&other.gaps);
        self.contact_states.copy_from_slice(&other.contact_states);
    }

    fn fits(&self, dimension: usize, joints: usize) -> bool {
        self.y.len() == dimension
            && self.k.len() == dimension
            && self.gaps.len() == joints
            && self.contact_states.len() == joints
    }
}

/// Step control: not part of the physical state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Control {
    /// Next step of an adaptive method.
    pub(super) h_next: f64,
    /// Step that worked after the latest contact began.
    pub(super) h_contact: f64,
    /// A contact began at the latest event.
    pub(super) contact_began: bool,
    /// Measure of how often corners of the friction law occur, and whether that is too often to locate them.
    pub(super) chatter: u32,
    pub(super) chatters: bool,
    /// Active scheme of the automatic method.
    pub(super) member: ActiveScheme,
    /// Data for the automatic choice of scheme.
    pub(super) choice: SchemeSelector,
    pub(super) controller: Controller,
    /// Fixed steps are counted from here, so that times do not accumulate rounding errors.
    pub(super) grid_origin: f64,
    pub(super) grid_count: u64,
}

/// Diagnostics of the run so far.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Record {
    pub(super) account: Account,
    pub(super) wear: Option<Wear>,
    pub(super) impacts: Impacts,
    pub(super) statistics: Statistics,
    /// Reactions of the ideal joints at the latest two instants, for their peaks between steps.
    pub(super) reactions: Vec<Recent>,
    /// Steps since the current contact began, by joint.
    pub(super) contact_steps: Vec<u64>,
    /// Peaks of each ball joint since they were last taken.
    pub(super) peaks: Vec<Peak>,
    /// The stop that starts deepest relative to its nominal depth, if any exceeds that: index, [depth, nominal depth] (m or rad),
    /// force (N or N m).
    pub(super) starts_inside: Option<(usize, [f64; 2], f64)>,
    /// Side of singular poses on which a kinematic scene started.
    pub(super) determinant_positive: bool,
}

/// A state of another model, or one that no run of the model can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the numbers are not those of a run of this scene")]
pub struct StateMismatch;

impl State {
    /// The state at t = 0 with coordinates and velocities `y`.
    pub(super) fn new(conditions: Conditions, mechanism: &Mechanism, y: Vec<f64>) -> Self {
        let joints = mechanism.contacts.len();
        let solver = &conditions.solver;
        Self {
            ramps: vec![None; joints],
            clearances: (0..joints).map(|j| mechanism.contacts.clearance(j)).collect(),
            pull: None,
            flights: vec![None; mechanism.free_flight_bodies().len()],
            control: Control {
                h_next: solver.step.min(LONGEST_STEP),
                h_contact: FIRST_CONTACT_STEP,
                contact_began: false,
                chatter: 0,
                chatters: false,
                member: ActiveScheme::Explicit,
                choice: SchemeSelector::default(),
                controller: controller_of(solver.method, ActiveScheme::Explicit),
                grid_origin: 0.0,
                grid_count: 0,
            },
            polynomial: Polynomial::new(AnyStepper::polynomial_size(solver.method, y.len())),
            record: Record {
                account: Account::default(),
                wear: None,
                impacts: Impacts::new(joints),
                statistics: Statistics::new(joints),
                reactions: vec![Recent::default(); joints],
                contact_steps: vec![0; joints],
                peaks: vec![Peak::default(); joints],
                starts_inside: None,
                determinant_positive: true,
            },
            sampled: vec![(0.0, 0.0); joints],
            loads: None,
            ideal: None,
            follows: Follows::default(),
            now: Instant::new(y, joints),
            conditions,
        }
    }

    /// Time, s.
    pub fn time(&self) -> f64 {
        self.now.t
    }

    /// Accepted steps up to it.
    pub fn steps(&self) -> u64 {
        self.record.statistics.steps
    }

    /// Coordinates, then velocities, as the formulation orders them.
    pub fn vector(&self) -> &[f64] {
        &self.now.y
    }

    /// Gravity, contacts and stepper with the live changes so far.
    pub fn conditions(&self) -> &Conditions {
        &self.conditions
    }

    /// Contact contact_state of ball joint `j`: whether it is in contact, and its approach speed.
    pub fn contact_state(&self, j: usize) -> ContactState {
        self.now.contact_states[j]
    }

    /// Clearance of ball joint `j`, m.
    pub fn clearance(&self, j: usize) -> f64 {
        self.ramps[j].map_or(self.clearances[j], |ramp| ramp.at(self.now.t).0)
    }

    /// The pull of the hand, if any.
    pub fn pull(&self) -> Option<Pull> {
        self.pull
    }

    /// Counters since the start.
    pub fn statistics(&self) -> &Statistics {
        &self.record.statistics
    }

    /// The latest finished impacts, at most 64, oldest first.
    pub fn impacts(&self) -> impl ExactSizeIterator<Item = &Impact> + DoubleEndedIterator {
        self.record.impacts.latest()
    }

    /// Energy exchanged since the start; `None` where `solver.energy_ledger` is off.
    pub fn ledger(&self) -> Option<&Ledger> {
        let account = &self.record.account;
        account.on.then(|| account.ledger())
    }

    /// The wear map, if there is one.
    pub fn wear(&self) -> Option<&Wear> {
        self.record.wear.as_ref()
    }

    /// Load peaks at the ends of steps and in samples, if tracked.
    pub fn load_peaks(&self) -> Option<&LoadPeaks> {
        self.loads.as_ref()
    }

    /// Largest normal force of ball joint `j` (reaction, if ideal) since the start, and its time, (N, s): the value in
    /// [`Statistics`], found from the ends of steps, or a larger one from a sample.
    pub fn peak(&self, j: usize) -> (f64, f64) {
        let statistics = self.statistics();
        let found = (statistics.peak_normal[j], statistics.peak_time[j]);
        if self.sampled[j].0 > found.0 { self.sampled[j] } else { found }
    }

    /// FNV-1a, 64 bit, over the physical state: little-endian bits of time, coordinates, velocities, then for each ball joint
    /// whether it is in contact, its approach speed, and its current clearance. The current branch of the friction law is
    /// excluded: like the step size, it belongs to the stepper.
    pub fn hash(&self) -> u64 {
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        let mut add = |bits: u64| {
            for byte in bits.to_le_bytes() {
                hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
            }
        };
        add(self.now.t.to_bits());
        for y in &self.now.y {
            add(y.to_bits());
        }
        for (j, m) in self.now.contact_states.iter().enumerate() {
            add(u64::from(m.active));
            add(m.approach_speed.to_bits());
            add(self.clearance(j).to_bits());
        }
        hash
    }

    /// Approximate size in bytes, rounded up.
    pub fn bytes(&self) -> usize {
        // The instant, the ledger's and the stepper's copies.
        const COPIES: usize = 10;
        const OF_JOINT: usize = 1024;
        const FIXED: usize = 4096;
        let (coordinates, joints) = (self.now.y.len(), self.now.gaps.len());
        let impacts = std::mem::size_of_val(self.record.impacts.kept());
        let wear = self.record.wear.as_ref().map_or(0, Wear::bytes);
        let flights = self.flights.len() * size_of::<Option<Flight>>();
        let ideal = self.ideal.as_ref().map_or(0, |ideal| ideal.bytes());
        FIXED + wear + flights + coordinates * COPIES * size_of::<f64>() + joints * OF_JOINT + impacts + ideal
    }

    /// Checks a state that was read: it has the dimensions of a state of `model`, which began as `own`, and all its indices are
    /// valid.
    pub(super) fn check(&self, model: &Model, own: &Self) -> Result<(), StateMismatch> {
        let (dimension, joints) = (own.now.y.len(), own.now.gaps.len());
        let record = &self.record;
        let worn = record.wear.as_ref();
        let conditions = &self.conditions;
        let loose =
            |contacts: &Conditions| contacts.joints.iter().map(|contact| contact.clearance > 0.0).collect::<Vec<_>>();
        let fits = self.now.fits(dimension, joints)
            && loose(conditions) == loose(&own.conditions)
            && model.machine().under(conditions).check().is_ok()
            && self.ramps.len() == joints
            && self.clearances.len() == joints
            && self.flights.len() == own.flights.len()
            // Only a window has a hand.
            && self.pull.is_none()
            && self.polynomial.fits(AnyStepper::polynomial_size(conditions.solver.method, dimension))
            && record.account.fits()
            && record.starts_inside.is_none_or(|(element, ..)| element < model.machine().elements.len())
            && record.impacts.fits(joints)
            && record.statistics.fits(joints)
            && worn.is_none_or(|wear| wear.fits(model.machine()))
            && record.reactions.len() == joints
            && record.contact_steps.len() == joints
            && record.peaks.len() == joints
            && self.sampled.len() == joints
            && self.loads.as_ref().is_none_or(|loads| loads.fits(&LoadPeaks::new(model.machine())));
        if !fits {
            return Err(StateMismatch);
        }
        match (&self.ideal, &own.ideal, model.ideal_model()) {
            (None, None, _) => Ok(()),
            (Some(ideal), Some(own), Some(model)) => ideal.check(model, own),
            _ => Err(StateMismatch),
        }
    }
}
