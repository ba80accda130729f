//! Corners of the contact laws as events. During a step each touching contact stays on one branch of the friction law and one of
//! the approach-speed rule; the step ends where its sliding speed or penetration rate leaves that branch.

use super::{State, Stepping};
use crate::contact::{ApproachBranch, ContactState, FrictionBranch};
use crate::integrate::find_root;
use crate::mechanism::ContactId;

/// Parts of a step at whose ends sliding speed and penetration rate are checked.
const PARTS: u32 = 4;
/// A corner earlier than this fraction of the step was passed at its start: the step is repeated on the next branch.
const AT_START: f64 = 1e-9;
/// The same limit where a rate stops rising: it is stationary there, and the forces of both branches agree to second order.
const MAXIMUM_AT_START: f64 = 1e-3;
/// A rate that falls over this last fraction of a step has passed its maximum inside the last part.
const LAST_PART: f64 = 1e-4;
/// A rate that exceeds the largest so far by less than this fraction of it counts as equal.
const EQUAL_RATES: f64 = 1e-6;
/// Excess of bristles over their branch that counts as none, m.
const SMALL_EXCESS: f64 = 1e-16;
/// Golden-section iterations over the two quarters of a step in which a rate is largest: to 2e-4 of the step.
const SECTIONS: u32 = 16;
/// Chatter added by a step that ends at a corner; any other step subtracts one.
const CHATTER_PER_CORNER: u32 = 3;
/// Chatter above which corners are no longer located, until it has died down.
const MAX_CHATTER: u32 = 60;

/// A corner inside the step just attempted.
pub(super) struct Corner {
    /// Fraction of the step.
    pub theta: f64,
    pub contact: ContactId,
    pub next: LawBranch,
}

/// Branch of a law beyond a corner.
#[derive(Clone, Copy)]
pub(super) enum LawBranch {
    /// Branch of the friction law.
    Friction(FrictionBranch),
    /// Branch of the approach-speed rule.
    Approach(ApproachBranch),
}

impl LawBranch {
    /// Switches a contact to this branch.
    pub(super) fn apply_to(self, contact_state: &mut ContactState) {
        match self {
            Self::Friction(branch) => contact_state.friction_branch = branch,
            Self::Approach(branch) => contact_state.approach_branch = branch,
        }
    }
}

impl Corner {
    /// Whether it lies so early that its contact should switch to the next branch before the step.
    pub(super) fn is_at_start(&self) -> bool {
        self.theta <= AT_START
    }
}

impl Stepping<'_> {
    /// Assigns every touching contact its current branches of the laws; contacts that already have branches retain them unless
    /// `reset`. If corners are not located, all contacts use the full laws.
    pub(super) fn freeze_branches(&mut self, reset: bool) {
        let freezes = self.locates() && !self.state.control.chatters;
        let Self { mechanism, state, .. } = self;
        let State { now, .. } = state;
        if reset || !freezes {
            for contact_state in &mut now.contact_states {
                *contact_state = contact_state.unfrozen();
            }
        }
        if !freezes {
            return;
        }
        // With `reset`, the gaps may belong to another state until they are measured.
        if !reset {
            for (c, contact_state) in now.contact_states.iter_mut().enumerate() {
                contact_state.freeze_approach(mechanism.contacts.coefficients(c), now.gaps[c].rate);
            }
        }
        let is_unfrozen = |m: &ContactState| m.active && m.friction_branch == FrictionBranch::Unfrozen;
        if !now.contact_states.iter().any(is_unfrozen) {
            return;
        }
        mechanism.measure(now.t, &now.y);
        for (c, contact_state) in now.contact_states.iter_mut().enumerate() {
            if is_unfrozen(contact_state) {
                let excess = mechanism.bristle_excess(c, &now.y, contact_state, FrictionBranch::Sticking);
                let law = mechanism.contacts.coefficients(c);
                contact_state.friction_branch = match excess {
                    Some(excess) if excess > 0.0 => FrictionBranch::Sliding,
                    Some(_) => FrictionBranch::Sticking,
                    None => law.friction_branch_at(mechanism.slip_speed(c)),
                };
                if reset {
                    contact_state.freeze_approach(law, mechanism.contacts.gap(c).separation.rate);
                }
            }
        }
    }

    /// First corner of the laws inside the step just attempted.
    pub(super) fn first_corner(&mut self, h: f64) -> Option<Corner> {
        let mut first: Option<Corner> = None;
        for c in 0..self.state.now.contact_states.len() {
            if !self.attempt.has_left_branch[c] {
                continue;
            }
            let contact_state = self.state.now.contact_states[c];
            let mut consider = |corner: Option<(f64, LawBranch)>| {
                let earliest = first.as_ref().map_or(f64::INFINITY, |corner| corner.theta);
                if let Some((theta, next)) = corner.filter(|(theta, _)| *theta < earliest) {
                    first = Some(Corner { theta, contact: c, next });
                }
            };
            if contact_state.friction_branch != FrictionBranch::Unfrozen {
                consider(self.friction_corner_of(c, h));
            }
            match contact_state.approach_branch {
                ApproachBranch::Unfrozen => {}
                ApproachBranch::Held => consider(self.rising_corner_of(c, h)),
                ApproachBranch::Rising => consider(self.maximum_corner_of(c, h)),
            }
        }
        first
    }

    /// Step fraction at which the penetration rate at contact `c` exceeds its largest value so far, and the next branch.
    fn rising_corner_of(&mut self, c: usize, h: f64) -> Option<(f64, LawBranch)> {
        let most = self.state.now.contact_states[c].approach_speed * (1.0 + EQUAL_RATES);
        let mut left = (0.0, self.state.now.gaps[c].rate - most);
        for n in 1..=PARTS {
            let theta = f64::from(n) / f64::from(PARTS);
            let right = (theta, self.rate_at(c, theta, h) - most);
            if right.1 > 0.0 {
                let at = if left.1 < 0.0 {
                    let (width, small) = ((1e-15 / h).max(1e-12), 1e-9 * most);
                    let excess = |theta: f64| self.rate_at(c, theta, h) - most;
                    find_root(left.0, left.1, right.0, right.1, width, small, excess)
                } else {
                    left.0
                };
                return Some((at, LawBranch::Approach(ApproachBranch::Rising)));
            }
            left = right;
        }
        None
    }

    /// Step fraction at which the penetration rate at contact `c`, now at its largest, stops rising, and the next branch.
    fn maximum_corner_of(&mut self, c: usize, h: f64) -> Option<(f64, LawBranch)> {
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        let mut before = self.state.now.gaps[c].rate;
        for n in 1..=PARTS {
            let end = f64::from(n) / f64::from(PARTS);
            let rate = self.rate_at(c, end, h);
            // Otherwise the next step would mistake the rate at its start for a maximum that this step has passed.
            let passed = n == PARTS && self.rate_at(c, end - LAST_PART, h) > rate;
            if rate >= before && !passed {
                before = rate;
                continue;
            }
            let (mut a, mut b) = ((end - 2.0 / f64::from(PARTS)).max(0.0), end);
            let (mut x, mut z) = (b - GOLDEN * (b - a), a + GOLDEN * (b - a));
            let (mut at_x, mut at_z) = (self.rate_at(c, x, h), self.rate_at(c, z, h));
            for _ in 0..SECTIONS {
                if at_x > at_z {
                    (b, z, at_z) = (z, x, at_x);
                    x = b - GOLDEN * (b - a);
                    at_x = self.rate_at(c, x, h);
                } else {
                    (a, x, at_x) = (x, z, at_z);
                    z = a + GOLDEN * (b - a);
                    at_z = self.rate_at(c, z, h);
                }
            }
            let at = 0.5 * (a + b);
            let at = if at < MAXIMUM_AT_START { 0.0 } else { at };
            return Some((at, LawBranch::Approach(ApproachBranch::Held)));
        }
        None
    }

    /// Penetration rate at contact `c` on the interpolant of the attempted step, m/s.
    fn rate_at(&mut self, c: usize, theta: f64, h: f64) -> f64 {
        self.measure_at(c, theta, h);
        self.mechanism.contacts.gap(c).separation.rate
    }

    /// Measures the gap of contact `c` on the interpolant of the attempted step.
    pub(super) fn measure_at(&mut self, c: usize, theta: f64, h: f64) {
        let Self { mechanism, stepper, state, attempt, scratch_y, .. } = self;
        let (now, end) = (&state.now, &attempt.end);
        let all = 0..now.y.len();
        let bristles = mechanism.bristles_of(c);
        for part in mechanism.gap_components(c).unwrap_or(std::slice::from_ref(&all)).iter().chain(&bristles) {
            let part = part.clone();
            stepper.interpolate(part, theta, now.step(h), [&end.y, &end.k], &state.polynomial, scratch_y);
        }
        let time = now.t + theta * h;
        for free_body in mechanism.free_flight_bodies_of(c) {
            if let Some(flight) = &state.flights[free_body] {
                flight.write_state(&mechanism.free_flight_bodies()[free_body], time, scratch_y);
            }
        }
        mechanism.measure_one(c, time, scratch_y);
    }

    /// Step fraction at which the sliding speed at contact `c` leaves its branch, and the next branch.
    fn friction_corner_of(&mut self, c: usize, h: f64) -> Option<(f64, LawBranch)> {
        let mut left = (0.0, self.slip_excess(c, 0.0, h).0);
        for n in 1..=PARTS {
            let theta = f64::from(n) / f64::from(PARTS);
            let right = (theta, self.slip_excess(c, theta, h).0);
            if right.1 > 0.0 {
                let at = if left.1 < 0.0 {
                    let law = self.mechanism.contacts.coefficients(c);
                    let small = if law.bristles.is_some() { SMALL_EXCESS } else { 1e-9 * law.slip_high };
                    let width = (1e-15 / h).max(1e-12);
                    let excess = |theta: f64| self.slip_excess(c, theta, h).0;
                    find_root(left.0, left.1, right.0, right.1, width, small, excess)
                } else {
                    left.0
                };
                let (_, speed) = self.slip_excess(c, at.max(AT_START), h);
                let law = self.mechanism.contacts.coefficients(c);
                let next = match self.state.now.contact_states[c].friction_branch {
                    FrictionBranch::Ramp if speed > 0.5 * (law.slip_low + law.slip_high) => FrictionBranch::Full,
                    FrictionBranch::Ramp => FrictionBranch::DeadBand,
                    FrictionBranch::Sticking => FrictionBranch::Sliding,
                    FrictionBranch::Sliding => FrictionBranch::Sticking,
                    _ => FrictionBranch::Ramp,
                };
                return Some((at, LawBranch::Friction(next)));
            }
            left = right;
        }
        None
    }

    /// Ends the step just attempted at a corner. Unlike at the start of a contact, the step is not repeated: the new end would
    /// miss the corner by the tolerance, which is not small compared with the ramp, and slide back at once.
    pub(super) fn truncate_at(&mut self, theta: f64, t_end: f64, h: f64) {
        let (now, end, scratch) = (&self.state.now, &mut self.attempt.end, &mut self.scratch_y);
        for part in self.mechanism.active_ranges() {
            let part = part.clone();
            self.stepper.interpolate(part, theta, now.step(h), [&end.y, &end.k], &self.state.polynomial, scratch);
        }
        for part in self.mechanism.active_ranges() {
            end.y[part.clone()].copy_from_slice(&scratch[part.clone()]);
        }
        self.stepper.truncate(theta, &mut self.state.polynomial);
        self.attempt.stiffness = 0.0;
        self.evaluate_end(t_end);
    }

    /// Excess at contact `c`'s sliding speed over its branch, m/s, or of its bristles, m, and that speed, on the interpolant of the
    /// attempted step.
    fn slip_excess(&mut self, c: usize, theta: f64, h: f64) -> (f64, f64) {
        self.measure_at(c, theta, h);
        let speed = self.mechanism.slip_speed(c);
        let contact_state = &self.state.now.contact_states[c];
        let slip = contact_state.friction_branch;
        let law = self.mechanism.contacts.coefficients(c);
        let of_bristles = self.mechanism.bristle_excess(c, self.scratch_y, contact_state, slip);
        (of_bristles.unwrap_or_else(|| law.excess_over_branch(slip, speed)), speed)
    }

    /// After an accepted step: switches to the branch beyond the corner at its end. Stops locating corners for a while if almost
    /// every step ends at one.
    pub(super) fn switch_at_corner(&mut self) {
        let state = &mut self.state;
        if let Some((c, next)) = self.attempt.corner.take() {
            if state.now.contact_states[c].active {
                next.apply_to(&mut state.now.contact_states[c]);
            }
            state.record.statistics.corners += 1;
            state.control.chatter += CHATTER_PER_CORNER;
            state.control.chatters |= state.control.chatter >= MAX_CHATTER;
        } else {
            state.control.chatter = state.control.chatter.saturating_sub(1);
            state.control.chatters &= state.control.chatter > 0;
        }
        self.freeze_branches(false);
    }
}
