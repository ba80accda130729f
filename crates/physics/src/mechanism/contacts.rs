//! Contacts of the loose joints of a scene: forces, moving clearances and gaps. Allocates nothing. The force of a single contact is
//! in `elements/contact.rs`.

use serde::{Deserialize, Serialize};

use super::elements::{ActiveSet, At, Contact, ForceElement, Gap, Loads};
use super::kinematics::Kinematics;
use super::loose::{Bumps, Profile, WornWall};
use super::model::{ContactId, Model, Site};
use crate::contact::{Coefficients, Parameters};
use crate::machine::{LooseKind, Machine, Vec3, root};
use std::ops::Range;

/// A clearance that ramps to a new value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ramp {
    /// Time at which it started, s.
    pub start: f64,
    /// Clearance at the start, m.
    pub from: f64,
    /// Signed rate, m/s.
    pub rate: f64,
    /// Clearance at the end, m.
    pub to: f64,
}

/// Group of each contact of `machine`: a tree of bodies, with all trees that joints and force elements connect to it.
fn groups(machine: &Machine, model: &Model) -> Vec<usize> {
    let block_of = |body: usize| {
        let moves = model.bodies.get(body).is_some_and(|body| !body.driven_only);
        moves.then(|| model.block_of[body])
    };
    let mut above: Vec<usize> = (0..model.blocks.len()).collect();
    let mut connect = |bodies: &mut dyn Iterator<Item = usize>| {
        let mut blocks = bodies.filter_map(block_of);
        let Some(first) = blocks.next() else { return };
        for block in blocks {
            let (a, b) = (root(&mut above, first), root(&mut above, block));
            above[b] = a;
        }
    };
    for joint in &model.joints {
        connect(&mut [joint.carried.body, joint.carrier.body].into_iter());
    }
    for pair in &model.closures {
        connect(&mut [pair.child.body, pair.parent.body].into_iter());
    }
    for element in &machine.elements {
        connect(&mut element.points(machine).iter().filter_map(|point| point.body));
    }
    let group = |site: &Site| {
        let block = block_of(site.carried.body).or_else(|| block_of(site.carrier.body));
        block.map_or(usize::MAX, |block| root(&mut above, block))
    };
    model.sites.iter().map(group).collect()
}

impl Ramp {
    /// Clearance and its rate at `t`.
    pub fn at(&self, t: f64) -> (f64, f64) {
        let value = self.from + self.rate * (t - self.start);
        if (self.rate < 0.0) == (value <= self.to) { (self.to, 0.0) } else { (value, self.rate) }
    }
}

/// Worn depth of a play: during a step it grows at the rate found at its start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Worn {
    /// At the start of the step, m.
    pub depth: f64,
    /// m/s.
    pub rate: f64,
}

/// Worn depths of a joint's plays over the latest step and the next.
#[derive(Clone, Copy, Default)]
struct Wearing {
    /// Start of the latest step and its end, from which the next begins, s.
    starts: [f64; 2],
    /// In each of the two, of each play.
    worn: [[Worn; 2]; 2],
}

impl Wearing {
    /// Worn depth of a play and its rate at `t`.
    fn at(&self, play: usize, t: f64) -> (f64, f64) {
        let step = usize::from(t >= self.starts[1]);
        let Worn { depth, rate } = self.worn[step][play];
        (depth + rate * (t - self.starts[step]), rate)
    }
}

/// The contacts of a scene's loose joints.
pub struct Contacts {
    contacts: Vec<Contact>,
    joints: Vec<JointContacts>,
    /// Components of the bristles of all contacts.
    bristles: usize,
    /// Some clearance moves, or has worn.
    moves: bool,
    /// Some joint has a wear coefficient.
    wears: bool,
    /// Some wall wears by direction.
    has_profiles: bool,
    /// Contacts of the same group act on one another.
    groups: Vec<usize>,
    /// Evaluations skip contacts that do not touch, because some of their bodies are suspended.
    pub(super) skips_inactive: bool,
}

/// A loose joint's play, and its contacts.
struct JointContacts {
    kind: LooseKind,
    parameters: Parameters,
    /// Each play without its wear, m, and its ramp, if it has one.
    plays: [f64; 2],
    ramps: [Option<Ramp>; 2],
    wearing: Wearing,
    contacts: Range<ContactId>,
}

impl JointContacts {
    /// Size of a play, m, and its rate, m/s, at `t`.
    fn play_at(&self, play: usize, t: f64) -> (f64, f64) {
        let (set, ramp_rate) = self.ramps[play].map_or((self.plays[play], 0.0), |ramp| ramp.at(t));
        let (worn, wear_rate) = self.wearing.at(play, t);
        (set + worn, ramp_rate + wear_rate)
    }

    /// Whether a play changes by more than a change of parameters.
    fn moves(&self) -> bool {
        self.ramps != [None; 2] || self.wearing.worn != [[Worn::default(); 2]; 2]
    }
}

impl Contacts {
    /// Contacts of `machine`.
    pub fn new(machine: &Machine, model: &Model) -> Self {
        let joints = machine.loose_joints.iter().zip(&model.joints).map(|(joint, compiled)| JointContacts {
            kind: joint.kind,
            parameters: joint.contact,
            plays: joint.contact.clearances(),
            ramps: [None; 2],
            wearing: Wearing::default(),
            contacts: compiled.contacts.clone(),
        });
        let mut bristles = 0;
        let contacts = model.sites.iter().enumerate().map(|(id, &site)| {
            let parameters = &machine.loose_joints[site.joint].contact;
            let first_bristle = parameters.has_bristles().then_some(bristles);
            bristles += 3 * usize::from(first_bristle.is_some());
            let law = site.stiffness.coefficients(parameters, parameters.clearances()[site.play]);
            let mut contact = Contact::new(id, site, law, first_bristle);
            let bumps = Bumps::of(&machine.loose_joints[site.joint], site.place);
            contact.profile = bumps.map(|bumps| Box::new(Profile::new(site, bumps)));
            contact
        });
        let contacts: Vec<Contact> = contacts.collect();
        Self {
            has_profiles: contacts.iter().any(|contact| contact.profile.is_some()),
            contacts,
            bristles,
            joints: joints.collect(),
            groups: groups(machine, model),
            moves: false,
            wears: machine.loose_joints.iter().any(|joint| joint.contact.wear_coefficient > 0.0),
            skips_inactive: false,
        }
    }

    /// Number of contacts.
    pub fn len(&self) -> usize {
        self.contacts.len()
    }

    /// Whether there are no contacts.
    pub fn is_empty(&self) -> bool {
        self.contacts.is_empty()
    }

    /// Contacts of loose joint `j`; none if it is ideal.
    pub fn of_joint(&self, j: usize) -> Range<ContactId> {
        self.joints[j].contacts.clone()
    }

    /// Number of components of the state that are deflections of bristles: three per contact that has them.
    pub fn bristles(&self) -> usize {
        self.bristles
    }

    /// Components of contact `c` among those; `None` without bristles.
    pub(super) fn bristles_of(&self, c: ContactId) -> Option<Range<usize>> {
        self.contacts[c].bristles.map(|state| state.first..state.first + 3)
    }

    /// Writes the rates of the bristles at the latest evaluation.
    pub(super) fn bristle_rates(&self, rates: &mut [f64]) {
        for state in self.contacts.iter().filter_map(|contact| contact.bristles.as_ref()) {
            rates[state.first..state.first + 3].copy_from_slice(state.rate.as_slice());
        }
    }

    /// Turns deflections into the plane across the normal of the gap last measured: exactly they stay there, but the errors of steps that
    /// do not resolve them add up along the normal, where nothing takes them back.
    pub(super) fn flatten_bristles(&self, bristles: &mut [f64], motion: &[Kinematics]) {
        for contact in &self.contacts {
            if let Some(state) = contact.bristles {
                let bent = contact.bent(bristles, &contact.gap.separation.normal, motion);
                let own = motion[contact.site.carrier.body].rotation.tr_mul(&bent);
                bristles[state.first..state.first + 3].copy_from_slice(own.as_slice());
            }
        }
    }

    /// Energy stored in the bristles, J.
    pub(super) fn bristle_energy(&self, bristles: &[f64]) -> f64 {
        let of = |contact: &Contact| {
            let (state, law) = (contact.bristles?, contact.law.bristles?);
            Some(law.energy(&Vec3::from_column_slice(&bristles[state.first..state.first + 3])))
        };
        self.contacts.iter().filter_map(of).sum()
    }

    /// Loose joint to which contact `c` belongs.
    pub fn joint_of(&self, c: ContactId) -> usize {
        self.contacts[c].site.joint
    }

    /// Play to which contact `c` belongs.
    pub(crate) fn play_of(&self, c: ContactId) -> usize {
        self.contacts[c].site.play
    }

    /// Place of contact `c` among the sites of its joint.
    pub(crate) fn place(&self, c: ContactId) -> u8 {
        self.contacts[c].site.place
    }

    /// Whether the forces of contacts `c` and `d` act on one another: their bodies are connected, however far, other than through
    /// the world and driven bodies.
    pub fn interact(&self, c: ContactId, d: ContactId) -> bool {
        self.groups[c] == self.groups[d]
    }

    /// All contacts.
    pub(super) fn iter(&self) -> impl Iterator<Item = &Contact> {
        self.contacts.iter()
    }

    /// Contact `c`.
    pub(super) fn contact(&self, c: ContactId) -> &Contact {
        &self.contacts[c]
    }

    /// Gaps of all contacts at the latest evaluation.
    pub fn gaps(&self) -> impl Iterator<Item = &Gap> {
        self.contacts.iter().map(|contact| &contact.gap)
    }

    /// Gap of contact `c` at the latest evaluation.
    pub fn gap(&self, c: ContactId) -> &Gap {
        &self.contacts[c].gap
    }

    /// A force at contact `c` as it acts on the carried part of its joint, N.
    pub(crate) fn on_carried(&self, c: ContactId, force: &Vec3) -> Vec3 {
        if self.contacts[c].site.is_reversed { -force } else { *force }
    }

    /// Direction in which contact `c` pushes the carried part of its joint at the latest evaluation.
    pub(crate) fn push(&self, c: ContactId) -> Vec3 {
        self.on_carried(c, &-self.contacts[c].gap.separation.normal)
    }

    /// Coefficients of contact `c`.
    pub fn coefficients(&self, c: ContactId) -> &Coefficients {
        &self.contacts[c].law
    }

    /// Clearance of contact `c` at the latest evaluation, m.
    pub fn clearance(&self, c: ContactId) -> f64 {
        self.contacts[c].law.clearance
    }

    /// Parameters of loose joint `j`.
    pub fn parameters(&self, j: usize) -> &Parameters {
        &self.joints[j].parameters
    }

    /// Contacts of loose joint `j` that share its play `play`.
    pub(crate) fn of_play(&self, j: usize, play: usize) -> impl Iterator<Item = ContactId> + '_ {
        self.of_joint(j).filter(move |&c| self.contacts[c].site.play == play)
    }

    /// Clearance of loose joint `j` at the latest evaluation, m; 0 if it is ideal.
    pub fn joint_clearance(&self, j: usize) -> f64 {
        self.play(j, 0)
    }

    /// Current size of a play of loose joint `j`, m; 0 if it has none.
    pub(crate) fn play(&self, j: usize, play: usize) -> f64 {
        self.of_play(j, play).next().map_or(0.0, |c| self.clearance(c))
    }

    /// Size of the first play of loose joint `j` at `t`, m.
    pub(super) fn clearance_at(&self, j: usize, t: f64) -> f64 {
        self.joints[j].play_at(0, t).0
    }

    /// Sets the parameters of joint `j`, its plays without wear, m, and their ramps, and the worn depths from the time `t` on.
    pub(crate) fn set_joint(
        &mut self,
        j: usize,
        parameters: &Parameters,
        (plays, ramps): ([f64; 2], [Option<Ramp>; 2]),
        (t, worn): (f64, [Worn; 2]),
    ) {
        let joint = &mut self.joints[j];
        (joint.parameters, joint.plays, joint.ramps) = (*parameters, plays, ramps);
        joint.wearing = Wearing { starts: [t; 2], worn: [worn; 2] };
        for contact in &mut self.contacts[joint.contacts.clone()] {
            let play = contact.site.play;
            contact.law = contact.site.stiffness.coefficients(parameters, plays[play] + worn[play].depth);
        }
        self.moves = self.joints.iter().any(JointContacts::moves);
        self.wears = self.joints.iter().any(|joint| joint.parameters.wear_coefficient > 0.0);
    }

    /// Whether some joint wears.
    pub(crate) fn wears(&self) -> bool {
        self.wears
    }

    /// By how much play `play` of joint `j` has worn wider at `t`, within the latest step or at its end, m; the mean over its walls.
    pub(crate) fn worn(&self, j: usize, play: usize, t: f64) -> f64 {
        self.joints[j].wearing.at(play, t).0 + self.mean_profile(j, play)
    }

    /// Mean depth of the profiles of play `play` of joint `j` at the time of the latest evaluation, m.
    fn mean_profile(&self, j: usize, play: usize) -> f64 {
        if !self.has_profiles {
            return 0.0;
        }
        let profiles = || self.of_play(j, play).filter_map(|c| self.contacts[c].profile.as_ref());
        profiles().map(|profile| profile.mean_depth()).sum::<f64>() / profiles().count().max(1) as f64
    }

    /// Copies all walls that wear by direction, as at the latest evaluation, into `out`.
    pub(crate) fn report_worn_walls(&self, out: &mut Vec<WornWall>) {
        let mut count = 0;
        for profile in self.contacts.iter().filter_map(|contact| contact.profile.as_ref()) {
            profile.report(count, out);
            count += 1;
        }
        out.truncate(count);
    }

    /// The worn wall of contact `c`, if it wears by direction.
    pub(crate) fn profile(&self, c: ContactId) -> Option<&Profile> {
        self.contacts[c].profile.as_deref()
    }

    /// As [`Contact::sweep`] of contact `c`.
    pub(crate) fn sweep(&self, c: ContactId, motion: &[Kinematics]) -> f64 {
        self.contacts[c].sweep(motion)
    }

    /// As [`Profile::continue_from`] of contact `c`; of one without a profile nothing.
    pub(crate) fn continue_profile(&mut self, c: ContactId, t: f64, depths: &[f64]) {
        if let Some(profile) = &mut self.contacts[c].profile {
            profile.continue_from(t, depths);
        }
    }

    /// Continues the wear of joint `j` with `worn` from `t` on, the end of a step; within the step the clearance stays as it was.
    pub(crate) fn continue_wear(&mut self, j: usize, t: f64, worn: [Worn; 2]) {
        let wearing = &mut self.joints[j].wearing;
        *wearing = Wearing { starts: [wearing.starts[1], t], worn: [wearing.worn[1], worn] };
        self.moves |= self.joints[j].moves();
    }

    /// Growth of play `play` of loose joint `j` by the power of sliding, as from [`Contact::sliding_power`], m/(N m); 0 if it does not
    /// wear.
    pub(crate) fn depth_by_work(&self, j: usize, play: usize) -> f64 {
        let JointContacts { kind, parameters, .. } = &self.joints[j];
        if parameters.wear_coefficient == 0.0 {
            return 0.0;
        }
        kind.wearing_area(parameters, play).map_or(0.0, |area| parameters.wear_coefficient / area)
    }

    /// Updates moving clearances to `t`.
    #[inline]
    fn move_clearances(&mut self, t: f64) {
        if self.moves {
            self.follow_moves(t);
        }
        if self.has_profiles {
            self.choose_profiles(t);
        }
    }

    /// Lets the sites of all worn walls follow them.
    #[inline]
    fn follow_wear(&mut self, motion: &[Kinematics]) {
        if self.has_profiles {
            self.contacts.iter_mut().for_each(|contact| contact.follow_wear(motion));
        }
    }

    #[cold]
    #[inline(never)]
    fn choose_profiles(&mut self, t: f64) {
        self.contacts.iter_mut().filter_map(|contact| contact.profile.as_mut()).for_each(|profile| profile.choose(t));
    }

    #[cold]
    #[inline(never)]
    fn follow_moves(&mut self, t: f64) {
        for joint in self.joints.iter().filter(|joint| joint.moves()) {
            for contact in &mut self.contacts[joint.contacts.clone()] {
                let Contact { site, law, .. } = contact;
                let (clearance, rate) = joint.play_at(site.play, t);
                if (clearance, rate) != (law.clearance, law.clearance_rate) {
                    site.stiffness.set_clearance(law, &joint.parameters, clearance, rate);
                }
            }
        }
    }

    /// Adds contact forces and updates gaps, if any contact may carry a force.
    pub(super) fn load(&mut self, at: &At<'_>, loads: &mut Loads<'_>) {
        if self.bristles > 0 {
            self.straighten_bristles();
        }
        if self.contacts.is_empty() || matches!(at.active_set, ActiveSet::Nothing | ActiveSet::Solved) {
            return;
        }
        self.move_clearances(at.t);
        self.follow_wear(at.motion);
        loads.counts.contacts += 1;
        for contact in &mut self.contacts {
            if self.skips_inactive && !contact.may_carry_force(at.active_set) {
                contact.gap = Gap::default();
            } else {
                contact.load(at, loads);
            }
        }
    }

    /// Sets the rates of all bristles to those without contact.
    #[inline(never)]
    fn straighten_bristles(&mut self) {
        for state in self.contacts.iter_mut().filter_map(|contact| contact.bristles.as_mut()) {
            state.rate = Vec3::zeros();
        }
    }

    /// Completes the gaps of the latest evaluation, with `active_set`, and measures those it skipped.
    pub(super) fn complete_separations(&mut self, active_set: ActiveSet<'_>, motion: &[Kinematics]) {
        if self.skips_inactive {
            self.follow_wear(motion);
        }
        for contact in &mut self.contacts {
            if self.skips_inactive && !contact.may_carry_force(active_set) {
                contact.measure(motion);
            } else {
                contact.complete_separation(motion);
            }
        }
    }

    /// Gap geometry at `t`, without forces.
    pub fn measure(&mut self, t: f64, motion: &[Kinematics]) {
        self.move_clearances(t);
        self.follow_wear(motion);
        for contact in &mut self.contacts {
            contact.measure(motion);
        }
    }

    /// The same for contact `c` alone.
    pub fn measure_one(&mut self, c: ContactId, t: f64, motion: &[Kinematics]) {
        self.move_clearances(t);
        if self.has_profiles {
            self.contacts[c].follow_wear(motion);
        }
        self.contacts[c].measure(motion);
    }

    /// The eccentricity of contact `c`, or across a plane its part beyond it, m.
    pub fn reach(&self, c: ContactId) -> Vec3 {
        self.contacts[c].reach()
    }

    /// Relative velocity used by friction at contact `c` for the normal `n`, m/s.
    pub fn slip_velocity(&self, c: ContactId, n: &Vec3, motion: &[Kinematics]) -> Vec3 {
        self.contacts[c].slip_velocity(n, motion)
    }

    /// Sliding speed of contact `c` in the motion last measured, m/s; the ball must be off centre.
    pub fn slip_speed(&self, c: ContactId, motion: &[Kinematics]) -> f64 {
        let contact = &self.contacts[c];
        let at = &contact.gap.separation;
        let slip_velocity = contact.slip_velocity(&at.normal, motion);
        at.sliding_velocity(&slip_velocity).norm()
    }
}
