//! Wear of a running simulation: the map of it, and the clearances that it widens.
//!
//! A play grows at k N |v| over its area ([`LooseKind::wearing_area`](crate::machine::LooseKind::wearing_area)). During a step it grows at
//! the rate found at the step's start, so that a steady contact sees its wall recede evenly. What it has grown by at the end is the
//! quadrature of the rate over the step, with the nodes of the energy ledger: the small difference, of second order in the step, moves the
//! wall at its end, and the elastic energy that this takes is work of the clearance.

use super::energy::energies;
use super::{Attempt, Stepping, store_gaps};
use crate::integrate::System as _;
use crate::machine::Vec3;
use crate::mechanism::{ActiveSet, ContactId, Mechanism, Profile, Worn};
use crate::simulate::{StopAdvice, StopFault, Stopped, Wear, WornWall};

/// Wear of the plays of a joint over a step.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Growth {
    /// Rates at the quadrature nodes, m/s.
    nodes: [[f64; 2]; 3],
    /// Over the step, m.
    depth: [f64; 2],
    /// At its end, m/s.
    rate: [f64; 2],
}

/// What a contact wears off its profile at one node of a step.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rub {
    /// Volume over the area of the whole wall, m/s; over the step m.
    depth: f64,
    /// Where: [`Profile::cut`].
    toward: Vec3,
    /// m.
    penetration: f64,
}

/// Wear of a profile over a step, at its quadrature nodes.
pub(super) type Abrasion = [Rub; 3];

impl Attempt {
    /// Nothing has worn off yet.
    pub(super) fn clear_wear(&mut self) {
        self.wearing.fill(Growth::default());
        self.abrasion.fill(Abrasion::default());
    }

    /// Records the rates of the latest evaluation of `mechanism` at node `instant` of the step.
    #[inline]
    pub(super) fn record_rates(&mut self, instant: usize, mechanism: &Mechanism) {
        if mechanism.contacts.wears() {
            self.record_rates_of_contacts(instant, mechanism);
        }
    }

    #[inline(never)]
    fn record_rates_of_contacts(&mut self, instant: usize, mechanism: &Mechanism) {
        for c in 0..mechanism.contacts.len() {
            let power = mechanism.sliding_power(c);
            if power > 0.0 {
                let (j, play) = (mechanism.contacts.joint_of(c), mechanism.contacts.play_of(c));
                let rate = power * mechanism.contacts.depth_by_work(j, play);
                match mechanism.contacts.profile(c) {
                    Some(profile) => self.abrasion[c][instant] = Rub::at(mechanism, c, profile, rate),
                    None => self.wearing[j].nodes[instant][play] += rate,
                }
            }
        }
    }

    /// Integrates the recorded rates over a step of size `h` with the quadrature weights `weights`.
    pub(super) fn integrate_rates(&mut self, h: f64, weights: &[f64]) {
        for Growth { nodes, depth, rate } in &mut self.wearing {
            *rate = nodes[weights.len() - 1];
            *depth = [0, 1]
                .map(|play| h * weights.iter().zip(&*nodes).map(|(weight, node)| weight * node[play]).sum::<f64>());
        }
        for (rub, weight) in self.abrasion.iter_mut().flat_map(|rubs| rubs.iter_mut().zip(weights)) {
            rub.depth *= h * weight;
        }
    }
}

impl Rub {
    /// Of contact `c` as last measured.
    fn at(mechanism: &Mechanism, c: ContactId, profile: &Profile, depth: f64) -> Self {
        // What a place loses is a share of the wall's volume: the walls of a joint share its area.
        let places = mechanism.contacts.of_joint(mechanism.contacts.joint_of(c));
        let walls = places.filter(|&c| mechanism.contacts.profile(c).is_some()).count();
        // At the end of a step of mean rates it may have left its wall.
        let penetration = mechanism.contacts.gap(c).separation.penetration.max(0.0);
        Self { depth: depth * walls as f64, toward: profile.cut(), penetration }
    }
}

impl Stepping<'_> {
    /// As [`Simulation::track_wear`](crate::simulate::Simulation::track_wear).
    pub(in crate::simulate) fn track_wear(&mut self) {
        let mut wear = Wear::new(self.machine, self.mechanism.contacts.len());
        self.evaluate_at(self.state.now.t);
        for (c, contact_state) in self.state.now.contact_states.iter().enumerate() {
            if contact_state.active {
                wear.begin_contact(self.mechanism.contacts.joint_of(c), &self.mechanism.spot(c));
            }
        }
        wear.commit_step();
        wear.record_forces(0, self.mechanism);
        self.state.record.wear = Some(wear);
    }

    /// Finds the wear of a step of size `h` of the discrete-gradient method from its means over the step.
    pub(super) fn integrate_mean_rates(&mut self, h: f64) {
        for (c, power) in self.mechanism.discrete_sliding() {
            let (j, play) = (self.mechanism.contacts.joint_of(c), self.mechanism.contacts.play_of(c));
            let rate = power * self.mechanism.contacts.depth_by_work(j, play);
            if let Some(profile) = self.mechanism.contacts.profile(c) {
                self.attempt.abrasion[c][0] = Rub::at(self.mechanism, c, profile, h * rate);
                continue;
            }
            let growth = &mut self.attempt.wearing[j];
            growth.depth[play] += h * rate;
            // What has left its wall wears it no more.
            growth.rate[play] += if self.state.now.gaps[c].penetration > 0.0 { rate } else { 0.0 };
        }
    }

    /// Widens the plays by what wore off in the step just accepted.
    ///
    /// # Errors
    /// A wall has worn through.
    pub(super) fn wear_walls(&mut self) -> Result<(), Stopped> {
        self.state.control.sweep = 0.0;
        if !self.mechanism.contacts.wears() {
            return Ok(());
        }
        let located = self.locates();
        let Self { mechanism, state, attempt, .. } = self;
        let t = state.now.t;
        let (mut moved, mut thinnest) = (false, None);
        for (c, rubs) in attempt.abrasion.iter().enumerate() {
            if rubs.iter().all(|rub| rub.depth == 0.0) {
                continue;
            }
            moved = true;
            let clearance = mechanism.contacts.clearance(c);
            if let Some(profile) = mechanism.contacts.profile(c) {
                let depths = &mut state.profiles[c];
                for Rub { depth, toward, penetration } in rubs.iter().filter(|rub| rub.depth > 0.0) {
                    profile.bumps().deposit(depths, *depth, [clearance, *penetration], toward);
                }
                // Bumps are higher than their sum: few walls need to be asked.
                if depths.iter().any(|depth| *depth > mechanism.contacts.coefficients(c).ball_radius) {
                    thinnest = Some(c);
                }
                mechanism.contacts.continue_profile(c, t, depths);
            }
        }
        for (j, growth) in attempt.wearing.iter().enumerate() {
            let worn = &mut state.joints[j].worn;
            let rates = worn.map(|worn| worn.rate);
            if [growth.depth, growth.rate, rates] == [[0.0; 2]; 3] {
                continue;
            }
            moved = true;
            for (play, worn) in worn.iter_mut().enumerate() {
                *worn = Worn { depth: worn.depth + growth.depth[play], rate: growth.rate[play] };
            }
            mechanism.contacts.continue_wear(j, t, *worn);
        }
        if !moved {
            return Ok(());
        }
        mechanism.forget_evaluation();
        let now = &mut state.now;
        if self.stepper.has_mean_rates() {
            mechanism.measure(t, &now.y);
        } else {
            let active_set = ActiveSet::by(located, &now.contact_states);
            let mut evaluator = mechanism.evaluator(active_set);
            evaluator.derivative(t, &now.y, &mut now.k);
            state.record.statistics.count(evaluator.counts);
            mechanism.complete_gaps(active_set, &now.y);
        }
        store_gaps(mechanism, &mut now.gaps);
        for c in 0..now.gaps.len() {
            let gap = state.now.gaps[c];
            state.control.sweep = state.control.sweep.max(mechanism.contacts.sweep(c, mechanism.motion()));
            // The wall has moved away from what does not follow it.
            if state.now.contact_states[c].active && gap.penetration <= 0.0 && gap.rate <= 0.0 {
                state.end((c, mechanism.contacts.joint_of(c)), t, gap.rate);
                state.record.impacts.end_step(&mut attempt.events);
            }
        }
        state.now.release_bristles(mechanism);
        if state.record.account.on {
            let energies = energies(mechanism, state);
            state.record.account.record_moved_clearances(energies);
        }
        state.record.account.powers = None;
        mechanism.forget_evaluation();
        let Some(c) = thinnest else {
            return Ok(());
        };
        let j = self.mechanism.contacts.joint_of(c);
        let walls = self.state.worn_walls(self.machine, j);
        let depth = walls.iter().map(WornWall::deepest).fold(0.0, f64::max);
        if depth <= self.mechanism.contacts.coefficients(c).ball_radius {
            return Ok(());
        }
        let joint = self.machine.loose_joints[j].name.clone();
        Err(self.stopped(StopFault::WornThrough { joint, depth }, StopAdvice::LessWear))
    }
}
