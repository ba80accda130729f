//! Everything about a run that changes.

use super::automatic::{SchemeSelector, controller_of};
use super::{
    ContactMemory, Control, DiscreteControl, FIRST_CONTACT_STEP, JointState, LONGEST_STEP, Model, Record, State,
    StateMismatch, StepEnd, WorkspaceId,
};
use crate::contact::{self, ContactPhase, ContactState};
use crate::integrate::{Polynomial, Step};
use crate::machine::{AppliedForces, Conditions, LiveElements, Machine};
use crate::mechanism::{ContactId, Flight, Mechanism, Pull, Worn, WornWall};
use crate::simulate::impacts::{ForcePeak, Impact, Impacts};
use crate::simulate::ledger::{Account, Ledger};
use crate::simulate::peaks::{Approach, Recent};
use crate::simulate::stepper::{ActiveScheme, AnyStepper};
use crate::simulate::{Peak, Statistics, Wear};

impl JointState {
    /// At the start, where any joint may touch for the first time.
    fn new(mechanism: &Mechanism, j: usize) -> Self {
        Self {
            contacts: mechanism.contacts.of_joint(j).len(),
            ramps: [None; 2],
            plays: [0, 1].map(|play| mechanism.contacts.play(j, play)),
            worn: [Worn::default(); 2],
            reaction: Recent::default(),
            peak: Peak::default(),
        }
    }
}

/// Depths of the profile of contact `c` at the start; none if it has none.
fn unworn(mechanism: &Mechanism, c: ContactId) -> Vec<f64> {
    vec![0.0; mechanism.contacts.profile(c).map_or(0, |profile| profile.bumps().len())]
}

impl ContactMemory {
    /// At the start.
    fn new(mechanism: &Mechanism, c: ContactId) -> Self {
        Self { mobility: mechanism.max_contact_mobility(c), phase: ContactPhase::default(), steps: 0 }
    }
}

impl StepEnd {
    pub(super) fn new(y: Vec<f64>, contacts: usize) -> Self {
        Self {
            t: 0.0,
            k: vec![0.0; y.len()],
            gaps: vec![Approach::default(); contacts],
            contact_states: vec![ContactState::default(); contacts],
            y,
        }
    }

    /// As [`Mechanism::release_bristles`].
    pub(super) fn release_bristles(&mut self, mechanism: &Mechanism) {
        mechanism.release_bristles([&mut self.y, &mut self.k], &self.contact_states);
    }

    /// The step of size `h` that begins here.
    pub(super) fn step(&self, h: f64) -> Step<'_> {
        Step { t: self.t, h, y: &self.y, k: &self.k }
    }

    /// Copies `other`, of the same model, without allocating.
    pub(super) fn copy_from(&mut self, other: &Self) {
        self.t = other.t;
        self.y.copy_from_slice(&other.y);
        self.k.copy_from_slice(&other.k);
        self.gaps.copy_from_slice(&other.gaps);
        self.contact_states.copy_from_slice(&other.contact_states);
    }

    fn fits(&self, dimension: usize, contacts: usize) -> bool {
        self.y.len() == dimension
            && self.k.len() == dimension
            && self.gaps.len() == contacts
            && self.contact_states.len() == contacts
    }
}

impl State {
    /// The state at t = 0 with coordinates and velocities `y`.
    pub(super) fn new(conditions: Conditions, mechanism: &Mechanism, y: Vec<f64>) -> Self {
        let (joints, contacts) = (conditions.joints.len(), mechanism.contacts.len());
        let solver = &conditions.solver;
        let [quarter_turns, other_turns] = mechanism.quarter_turns();
        Self {
            quarter_turns,
            joints: (0..joints).map(|j| JointState::new(mechanism, j)).collect(),
            contacts: (0..contacts).map(|c| ContactMemory::new(mechanism, c)).collect(),
            profiles: (0..contacts).map(|c| unworn(mechanism, c)).collect(),
            elements: LiveElements::default(),
            pull: None,
            flights: vec![None; mechanism.free_flight_bodies().len()],
            control: Control {
                h_next: solver.step.min(LONGEST_STEP),
                h_contact: FIRST_CONTACT_STEP,
                contact_began: false,
                chatter: 0,
                chatters: false,
                scheme: ActiveScheme::Explicit,
                selector: SchemeSelector::default(),
                controller: controller_of(solver.method, ActiveScheme::Explicit),
                grid_origin: 0.0,
                grid_count: 0,
                sweep: 0.0,
                discrete: DiscreteControl::new(mechanism),
            },
            polynomial: Polynomial::new(AnyStepper::polynomial_size(solver.method, y.len())),
            record: Record {
                account: Account::default(),
                wear: None,
                impacts: Impacts::new(contacts),
                statistics: Statistics::new(joints),
                starts_inside: None,
                determinant_positive: true,
                quarter_turns: other_turns,
            },
            workspace_id: WorkspaceId::default(),
            now: StepEnd::new(y, contacts),
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

    /// The force elements with the live changes so far.
    pub fn elements(&self) -> &LiveElements {
        &self.elements
    }

    /// Gravity and force elements with the live changes so far.
    pub fn applied_forces(&self) -> AppliedForces {
        AppliedForces { gravity: self.conditions.gravity, elements: self.elements.clone() }
    }

    /// Clearance of joint with play `j`, m.
    pub fn clearance(&self, j: usize) -> f64 {
        self.plays(j)[0]
    }

    /// Current plays of loose joint `j`, m; 0 where it is ideal. What wears by direction is not part of them.
    pub fn plays(&self, j: usize) -> [f64; 2] {
        let worn = self.worn_evenly(j);
        std::array::from_fn(|play| self.plays_without_wear(j)[play] + worn[play])
    }

    /// The same without what has worn off.
    pub(super) fn plays_without_wear(&self, j: usize) -> [f64; 2] {
        let JointState { ramps, plays, .. } = &self.joints[j];
        [0, 1].map(|play| ramps[play].map_or(plays[play], |ramp| ramp.at(self.now.t).0))
    }

    /// How far each play of loose joint `j` has worn wider since the start, m; where it wears by direction, the mean over its walls.
    pub fn worn(&self, j: usize) -> [f64; 2] {
        let [first, second] = self.worn_evenly(j);
        [first + self.mean_profile(j), second]
    }

    /// The same without what wears by direction.
    pub(super) fn worn_evenly(&self, j: usize) -> [f64; 2] {
        self.joints[j].worn.map(|worn| worn.depth)
    }

    /// Worn depths of the round walls of loose joint `j` that wear by direction, m, by the bumps of their profiles: one wall of a ball, one
    /// or two of a pin.
    pub fn profiles(&self, j: usize) -> impl Iterator<Item = &[f64]> + Clone {
        let first: usize = self.joints[..j].iter().map(|joint| joint.contacts).sum();
        let own = &self.profiles[first..first + self.joints[j].contacts];
        own.iter().map(Vec::as_slice).filter(|depths| !depths.is_empty())
    }

    /// The walls of loose joint `j` of `machine` that wear by direction.
    pub fn worn_walls(&self, machine: &Machine, j: usize) -> Vec<WornWall> {
        let joint = &machine.loose_joints[j];
        self.profiles(j).zip(0..).filter_map(|(depths, place)| WornWall::new(joint, j, place, depths)).collect()
    }

    /// Mean of what they have lost, m; walls of a joint have equally many bumps.
    fn mean_profile(&self, j: usize) -> f64 {
        let count = self.profiles(j).flatten().count();
        if count == 0 { 0.0 } else { self.profiles(j).flatten().sum::<f64>() / count as f64 }
    }

    /// Volume worn off the walls of each play of loose joint `j` since the start, m^3: depth times area.
    pub fn worn_volumes(&self, machine: &Machine, j: usize) -> [f64; 2] {
        let (kind, contact) = (&machine.loose_joints[j].kind, &self.conditions.joints[j]);
        let volume = |play: usize, depth: f64| kind.wearing_area(contact, play).map_or(0.0, |area| depth * area);
        let [first, second] = self.worn(j);
        [volume(0, first), volume(1, second)]
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

    /// Number of impacts begun since the start; the next one has this number.
    pub fn impacts_begun(&self) -> u64 {
        self.record.impacts.begun()
    }

    /// The impacts under way: the number of each, what is known of it, and its largest force so far.
    pub fn impacts_under_way(&self) -> impl Iterator<Item = (u64, &Impact, ForcePeak)> {
        self.record.impacts.under_way().map(|own| (own.id, &own.impact, own.peak))
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

    /// FNV-1a, 64 bit, over the physical state: little-endian bits of time, coordinates, velocities, deflections of bristles, then for each loose joint whether each
    /// of its contacts touches and its approach speed (0 and 0 if it is ideal), and its current clearance, with the second, if it has one,
    /// and the worn part of each that has worn, and the depths of a profile that has; then, of the angles that elements act on and
    /// coordinates do not count, the number and the quarter turns of each that has at least two. The current branch of the friction law is
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
        let mut contacts = &self.now.contact_states[..];
        let free = [ContactState::default()];
        for (j, joint) in self.joints.iter().enumerate() {
            let (own, others) = contacts.split_at(joint.contacts);
            contacts = others;
            for contact in if own.is_empty() { &free } else { own } {
                add(u64::from(contact.active));
                add(contact.approach_speed.to_bits());
            }
            let [first, second] = self.plays(j);
            add(first.to_bits());
            if second > 0.0 {
                add(second.to_bits());
            }
            for worn in self.worn(j).into_iter().filter(|worn| *worn > 0.0) {
                add(worn.to_bits());
            }
            for depths in self.profiles(j).filter(|depths| depths.iter().any(|depth| *depth != 0.0)) {
                depths.iter().for_each(|depth| add(depth.to_bits()));
            }
        }
        // Closer to 0 the poses determine the angle.
        for (i, quarters) in self.quarter_turns.iter().enumerate().filter(|(_, quarters)| quarters.unsigned_abs() > 1) {
            add(i as u64);
            add(quarters.cast_unsigned());
        }
        hash
    }

    /// Approximate size in bytes, rounded up.
    pub fn bytes(&self) -> usize {
        // The instant, the ledger's and the stepper's copies.
        const COPIES: usize = 10;
        const OF_JOINT: usize = 1024;
        const FIXED: usize = 4096;
        let (coordinates, joints) = (self.now.y.len(), self.joints.len());
        let impacts = std::mem::size_of_val(self.record.impacts.stored());
        let wear = self.record.wear.as_ref().map_or(0, Wear::bytes);
        let flights = self.flights.len() * size_of::<Option<Flight>>();
        let turns = (self.quarter_turns.len() + self.record.quarter_turns.len()) * size_of::<i64>();
        FIXED
            + turns
            + wear
            + self.profiles.iter().map(|depths| size_of_val(depths.as_slice())).sum::<usize>()
            + flights
            + self.elements.bytes()
            + coordinates * COPIES * size_of::<f64>()
            + joints * OF_JOINT
            + impacts
    }

    /// Checks a state that was read: it has the dimensions of a state of `model`, which began as `own`, and all its indices are
    /// valid.
    pub(super) fn check(&self, model: &Model, own: &Self) -> Result<(), StateMismatch> {
        let (dimension, joints, contacts) = (own.now.y.len(), own.joints.len(), own.contacts.len());
        let record = &self.record;
        let worn = record.wear.as_ref();
        let conditions = &self.conditions;
        let structure = |contacts: &Conditions| -> Vec<[bool; 4]> {
            contacts.joints.iter().map(contact::Parameters::structure).collect()
        };
        let fits = self.now.fits(dimension, contacts)
            && self.quarter_turns.len() == own.quarter_turns.len()
            && record.quarter_turns.len() == own.record.quarter_turns.len()
            && structure(conditions) == structure(&own.conditions)
            && self.elements.fits(model.machine())
            && model.machine().with_conditions(conditions, &self.elements).check().is_ok()
            && self.joints.iter().map(|joint| joint.contacts).eq(own.joints.iter().map(|joint| joint.contacts))
            && self.joints.iter().flat_map(|joint| joint.worn).all(|worn| worn.depth >= 0.0 && worn.depth.is_finite() && worn.rate.is_finite())
            && self.contacts.len() == contacts
            && self.profiles.iter().map(|depths| depths.len()).eq(own.profiles.iter().map(|depths| depths.len()))
            && self.profiles.iter().flat_map(|depths| depths.iter()).all(|depth| *depth >= 0.0 && depth.is_finite())
            && self.flights.len() == own.flights.len()
            // Only a window has a hand.
            && self.pull.is_none()
            && self.polynomial.fits(AnyStepper::polynomial_size(conditions.solver.method, dimension))
            && record.account.fits()
            && record.starts_inside.is_none_or(|(element, ..)| element < model.machine().elements.len())
            && record.impacts.fits(contacts, joints)
            && record.statistics.joints.len() == joints
            && worn.is_none_or(|wear| wear.fits(model.machine()))
            && self.control.discrete.acceleration.len() == own.control.discrete.acceleration.len();
        if fits { Ok(()) } else { Err(StateMismatch) }
    }
}
