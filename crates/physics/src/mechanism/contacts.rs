//! Ball joints of a scene: active contacts, clearance ramps and gaps. Allocates nothing. The force of a single joint is in
//! `elements/contact.rs`.

use serde::{Deserialize, Serialize};

use super::elements::{ActiveSet, At, Contact, ForceElement, Gap, Loads};
use super::kinematics::Kinematics;
use super::model::{LooseJoint, Model};
use crate::contact::{Coefficients, Parameters};
use crate::machine::{Machine, Vec3, root};

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

/// Group of each ball joint of `machine`: a tree of bodies, with all trees that joints and force elements connect to it.
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
    let group = |joint: &LooseJoint| {
        let block = block_of(joint.carried.body).or_else(|| block_of(joint.carrier.body));
        block.map_or(usize::MAX, |block| root(&mut above, block))
    };
    model.joints.iter().map(group).collect()
}

impl Ramp {
    /// Clearance and its rate at `t`.
    pub fn at(&self, t: f64) -> (f64, f64) {
        let value = self.from + self.rate * (t - self.start);
        if (self.rate < 0.0) == (value <= self.to) { (self.to, 0.0) } else { (value, self.rate) }
    }
}

/// All ball joints of a scene.
pub struct Contacts {
    joints: Vec<Contact>,
    parameters: Vec<Parameters>,
    ramps: Vec<Option<Ramp>>,
    has_ramps: bool,
    has_contacts: bool,
    /// Joints of the same group act on one another.
    groups: Vec<usize>,
    /// Evaluations skip joints without contact, because some of their bodies are suspended.
    pub(super) skips_inactive_joints: bool,
}

impl Contacts {
    /// Contacts of `machine`.
    pub fn new(machine: &Machine, model: &Model) -> Self {
        let parameters: Vec<Parameters> = machine.loose_joints.iter().map(|j| j.contact).collect();
        let joints: Vec<Contact> = model
            .joints
            .iter()
            .zip(&parameters)
            .enumerate()
            .map(|(i, (&joint, p))| Contact::new(i, joint, Coefficients::new(p, p.clearance)))
            .collect();
        Self {
            has_contacts: joints.iter().any(Contact::has_clearance),
            ramps: vec![None; joints.len()],
            joints,
            parameters,
            groups: groups(machine, model),
            has_ramps: false,
            skips_inactive_joints: false,
        }
    }

    /// Number of ball joints, ideal ones included.
    pub fn len(&self) -> usize {
        self.joints.len()
    }

    /// Whether there are no ball joints.
    pub fn is_empty(&self) -> bool {
        self.joints.is_empty()
    }

    /// Whether joint `i` has a clearance.
    pub(crate) fn has_clearance(&self, i: usize) -> bool {
        self.joints[i].has_clearance()
    }

    /// Whether the forces of joints `i` and `j` act on one another: their bodies are connected, however far, other than through
    /// the world and driven bodies.
    pub fn interact(&self, i: usize, j: usize) -> bool {
        self.groups[i] == self.groups[j]
    }

    /// Joints with clearance.
    pub(super) fn with_clearance(&self) -> impl Iterator<Item = &Contact> {
        self.joints.iter().filter(|contact| contact.has_clearance())
    }

    /// Gaps of all joints at the latest evaluation.
    pub fn gaps(&self) -> impl Iterator<Item = &Gap> {
        self.joints.iter().map(|contact| &contact.gap)
    }

    /// Ball joint `i`.
    pub(super) fn joint(&self, i: usize) -> &Contact {
        &self.joints[i]
    }

    /// Gap of joint `i` at the latest evaluation.
    pub fn gap(&self, i: usize) -> &Gap {
        &self.joints[i].gap
    }

    /// Coefficients of joint `i`.
    pub fn coefficients(&self, i: usize) -> &Coefficients {
        &self.joints[i].law
    }

    /// Clearance of joint `i` at the latest evaluation, m.
    pub fn clearance(&self, i: usize) -> f64 {
        self.joints[i].law.clearance
    }

    /// Starts, ends or restores the ramp of joint `i`.
    pub(crate) fn set_ramp(&mut self, i: usize, ramp: Option<Ramp>) {
        self.ramps[i] = ramp;
        self.has_ramps = self.ramps.iter().any(Option::is_some);
    }

    /// Sets parameters of joint `i`; `clearance`, m, is its current clearance.
    pub(crate) fn set_parameters(&mut self, i: usize, parameters: &Parameters, clearance: f64) {
        self.parameters[i] = *parameters;
        self.joints[i].law = Coefficients::new(parameters, clearance);
    }

    /// Updates ramped clearances to `t`.
    #[inline]
    fn update_ramps(&mut self, t: f64) {
        if !self.has_ramps {
            return;
        }
        for i in 0..self.joints.len() {
            if let Some(ramp) = self.ramps[i] {
                let (clearance, rate) = ramp.at(t);
                let law = &mut self.joints[i].law;
                law.set_clearance(&self.parameters[i], clearance, rate);
            }
        }
    }

    /// Adds contact forces and updates gaps, if any contact may carry a force.
    pub(super) fn load(&mut self, at: &At<'_>, loads: &mut Loads<'_>) {
        if !self.has_contacts || matches!(at.active_set, ActiveSet::Nothing) {
            return;
        }
        self.update_ramps(at.t);
        loads.counts.contacts += 1;
        for contact in self.joints.iter_mut().filter(|contact| contact.has_clearance()) {
            if self.skips_inactive_joints && !contact.may_carry_force(at.active_set) {
                contact.gap = Gap::default();
            } else {
                contact.load(at, loads);
            }
        }
    }

    /// Completes the gaps of the latest evaluation, with `active_set`, and measures those it skipped.
    pub(super) fn complete_separations(&mut self, active_set: ActiveSet<'_>, motion: &[Kinematics]) {
        for contact in &mut self.joints {
            if self.skips_inactive_joints && !contact.may_carry_force(active_set) {
                contact.measure(motion);
            } else {
                contact.complete_separation();
            }
        }
    }

    /// Gap geometry at `t`, without forces.
    pub fn measure(&mut self, t: f64, motion: &[Kinematics]) {
        self.update_ramps(t);
        for contact in &mut self.joints {
            contact.measure(motion);
        }
    }

    /// The same for joint `i` alone.
    pub fn measure_one(&mut self, i: usize, t: f64, motion: &[Kinematics]) {
        self.update_ramps(t);
        self.joints[i].measure(motion);
    }

    /// Relative velocity used by friction at the contact of joint `i` for the normal `n`, m/s.
    pub fn slip_velocity(&self, i: usize, n: &Vec3, motion: &[Kinematics]) -> Vec3 {
        self.joints[i].slip_velocity(n, motion)
    }

    /// Sliding speed of joint `i` in the motion last measured, m/s; the ball must be off centre.
    pub fn slip_speed(&self, i: usize, motion: &[Kinematics]) -> f64 {
        let contact = &self.joints[i];
        let at = &contact.gap.separation;
        let slip_velocity = contact.slip_velocity(&at.normal, motion);
        at.sliding_velocity(&slip_velocity).norm()
    }
}
