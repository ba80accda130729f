//! Energy ledger of a running simulation, from powers at a few instants of each accepted step.

use super::{Record, State, Stepping};
use crate::integrate::Method;
use crate::mechanism::{ActiveSet, Mechanism, Powers};
use crate::simulate::ledger::{Account, Energies, weights};
use crate::simulate::{Frame, Ledger};

/// Past step ends used to integrate the works of a kinematic scene: its powers are smooth, and its steps short compared with
/// their periods.
const PAST_ENDS: usize = 5;
/// A past step shorter than this fraction of the one being integrated is ignored.
const SHORTEST_PAST: f64 = 0.1;
/// Interior nodes of such a step while there are too few past ends.
const MIDDLE: [f64; 1] = [0.5];

impl Stepping<'_> {
    /// Starts a new ledger at the current state, which has just been fully evaluated.
    pub(super) fn start_ledger(&mut self) {
        let Self { mechanism, state, .. } = self;
        let energies = energies(mechanism, state);
        state.record.account = Account::start(state.conditions.solver.energy_ledger, energies);
    }

    /// Records the effect of a live change on the energies; the state has just been fully evaluated.
    pub(super) fn record_change(&mut self) {
        let Self { mechanism, state, .. } = self;
        if state.record.account.on {
            let energies = energies(mechanism, state);
            state.record.account.record_change(energies);
        }
        // Powers are stored for a wear map even without a ledger.
        state.record.account.powers = None;
    }

    /// Records the step just accepted, of size `h`, in the ledger and the wear map, and what it wore off, with the contact state of the step;
    /// `switched` if that has changed at its end.
    pub(super) fn record_step(&mut self, h: f64, switched: bool) {
        let Record { account, wear, .. } = &self.state.record;
        let has_ledger = account.on;
        let wears = self.mechanism.contacts.wears();
        if !has_ledger && wear.is_none() && !wears {
            return;
        }
        if wears {
            self.attempt.clear_wear();
        }
        let located = self.locates();
        let Self { mechanism, state, before, scratch_k, .. } = self;
        let discrete = state.conditions.solver.method == Method::DiscreteGradient && !mechanism.is_kinematic();
        let known = if discrete { Mechanism::is_measured_at } else { Mechanism::is_evaluated_at };
        if !known(mechanism, state.now.t) {
            mechanism.measure(state.now.t, &state.now.y);
        }
        let energies = energies(mechanism, state);
        if discrete {
            let account = &mut state.record.account;
            account.course.clear();
            account.course.push(0.5, mechanism.discrete_powers());
            account.powers = None;
            if wears {
                self.integrate_mean_rates(h);
            }
            self.begin_wear_of_step(false);
            if let Some(wear) = &mut self.state.record.wear {
                for (c, contact) in self.mechanism.discrete_contacts() {
                    wear.record_contact(0, self.mechanism.contacts.joint_of(c), &contact);
                }
                wear.integrate_step(h, &[1.0]);
            }
        } else if mechanism.has_powers() {
            // Powers may jump at an edge at the step's end: use those on the step's side.
            if self.attempt.edge {
                mechanism.freeze_elements(&self.attempt.element_sides);
                mechanism.forget_evaluation();
            }
            let now = &state.now;
            scratch_k.copy_from_slice(&now.k);
            let mut evaluator = mechanism.evaluator(ActiveSet::by(located, &before.contact_states));
            let end = evaluator.powers(now.t, &now.y, scratch_k);
            let instants = self.stepper.quadrature();
            self.attempt.record_rates(instants.len() - 1, self.mechanism);
            if self.state.record.wear.is_some() {
                let active_set = ActiveSet::by(located, &self.before.contact_states);
                self.mechanism.complete_gaps(active_set, &self.state.now.y);
                let known = self.state.record.account.powers.is_some();
                self.begin_wear_of_step(instants[0] == 0.0 && known);
                if let Some(wear) = &mut self.state.record.wear {
                    wear.record_forces(instants.len() - 1, self.mechanism);
                }
            }
            self.choose_quadrature_nodes(h, end);
            self.mechanism.freeze_elements(&[]);
            let switched = switched || self.attempt.edge;
            let Record { account, wear, .. } = &mut self.state.record;
            account.powers = (!switched).then_some(end);
            if wears || wear.is_some() {
                let weights = &weights(instants, 1.0)[..instants.len()];
                self.attempt.integrate_rates(h, weights);
                if let Some(wear) = wear {
                    wear.integrate_step(h, weights);
                }
            }
        }
        if has_ledger {
            // What the bristles store is not lost.
            let stored = [&self.before.y, &self.state.now.y].map(|y| self.mechanism.bristle_energy(y));
            if stored != [0.0; 2] {
                self.state.record.account.course.store_of_friction((stored[1] - stored[0]) / h);
            }
            self.state.record.account.record_step(h, energies);
        }
    }

    /// Starts recording the step just accepted in the wear map, with the contacts that began at its end. If `reuses_start`, the
    /// forces at the end of the previous step are reused.
    fn begin_wear_of_step(&mut self, reuses_start: bool) {
        let Self { before, state, mechanism, .. } = self;
        let State { now, record, .. } = &mut **state;
        let Some(wear) = &mut record.wear else {
            return;
        };
        wear.begin_step(reuses_start);
        for (c, (before, now)) in before.contact_states.iter().zip(&now.contact_states).enumerate() {
            if now.active && !before.active {
                wear.begin_contact(mechanism.contacts.joint_of(c), &mechanism.spot(c));
            }
        }
    }

    /// Chooses the quadrature nodes for the works of the step just accepted; `end` are the powers at its end.
    fn choose_quadrature_nodes(&mut self, h: f64, end: Powers) {
        let (from, to) = (self.before.t, self.state.now.t);
        let kinematic = self.mechanism.is_kinematic();
        // Past ends are of no use across a jump of a derivative.
        if kinematic && !self.mechanism.has_broken_drives() {
            let past = &mut self.state.record.account.past;
            past.push_apart(to, end, SHORTEST_PAST * h);
            if past.len() > PAST_ENDS {
                self.state.record.account.course = past.in_step_time(from, h);
                return;
            }
        }
        let interior = if kinematic { &MIDDLE } else { self.stepper.interior() };
        self.state.record.account.course.clear();
        // A collocation method has its own quadrature, which excludes the start.
        if interior.len() == 1 {
            let start = self.state.record.account.powers;
            let start = start.unwrap_or_else(|| self.powers_within(0.0, h));
            self.state.record.account.course.push(0.0, start);
        }
        for &theta in interior {
            let powers = self.powers_within(theta, h);
            self.state.record.account.course.push(theta, powers);
        }
        self.state.record.account.course.push(1.0, end);
    }

    /// Powers at fraction `theta` of the step just accepted.
    fn powers_within(&mut self, theta: f64, h: f64) -> Powers {
        // Bodies in flight are left out: only gravity acts on them.
        self.interpolate_stepped(theta, h);
        let located = self.locates();
        let Self { mechanism, stepper, state, before, attempt, scratch_y, scratch_k, .. } = self;
        mechanism.forget_evaluation();
        let mut evaluator = mechanism.evaluator(ActiveSet::by(located, &before.contact_states));
        let powers = evaluator.powers(before.t + theta * h, scratch_y, scratch_k);
        // No quadrature node in a kinematic scene: nothing is in contact there.
        let instant = stepper.quadrature().iter().position(|at| *at == theta).unwrap_or(0);
        attempt.record_rates(instant, mechanism);
        if let Some(wear) = &mut state.record.wear {
            wear.record_forces(instant, mechanism);
        }
        powers
    }

    /// Ledger at the instant of `frame`, within the latest step.
    pub(super) fn ledger_of(&self, frame: &Frame) -> Option<Ledger> {
        let account = &self.state.record.account;
        let (from, to) = (self.before.t, self.state.now.t);
        if frame.time >= to {
            return self.state.ledger().copied();
        }
        let energies = Energies {
            kinetic: frame.kinetic,
            gravitational: frame.potential - frame.elastic,
            elastic: frame.elastic,
            in_contacts: 0.0,
        };
        let h = to - from;
        account.on.then(|| account.within((frame.time - from) / h, h, energies))
    }
}

/// Energies from the latest evaluation, at the current state.
pub(super) fn energies(mechanism: &Mechanism, state: &State) -> Energies {
    let (kinetic, gravitational) = mechanism.energies();
    let contacts = &mechanism.contacts;
    let gaps = state.now.gaps.iter().enumerate();
    let in_gaps: f64 = gaps.map(|(c, gap)| contacts.coefficients(c).elastic.energy(gap.penetration)).sum();
    let in_contacts = in_gaps + mechanism.bristle_energy(&state.now.y);
    let elastic = in_contacts + mechanism.energy_in_elements(state.now.t);
    Energies { kinetic, gravitational, elastic, in_contacts }
}
