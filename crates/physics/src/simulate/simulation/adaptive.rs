//! Steps whose size follows the error estimate, truncated at the first contact start or end inside them.

use super::automatic::STABILITY_LIMIT;
use super::corners::LawBranch;
use super::{LONGEST_STEP, NEARLY, Stepping, edges, shortest_step};
use crate::integrate::{Method, find_root};
use crate::mechanism::{ContactId, Counts, EdgeIndicator};
use crate::simulate::peaks::Approach;
use crate::simulate::stepper::ActiveScheme;
use crate::simulate::{StopAdvice, StopFault, Stopped};

/// Shortest first step after a contact begins, s.
const MIN_FIRST_STEP: f64 = 1e-9;
/// At this tolerance or a looser one, a step truncated at an event ends on the interpolant, whose error is about the estimate. At
/// tighter ones it is repeated, which adds little to their many steps.
const END_ON_INTERPOLANT: f64 = 1e-5;
/// Loosest tolerance of the automatic method's explicit scheme. It takes the steps through impacts, which determine all later
/// motion and are few compared with those in lasting contact.
const IMPACT_TOLERANCE: f64 = 1e-5;
/// Factor on the allowed error of an explicit step in which a stop vertical_onset: its force grows with d^1.5, whose slope begins with a
/// vertical tangent. The sensitivity of the motion after an impact to the motion before it, which determines exponents, has a
/// much larger error than the motion itself.
const STOP_ERROR_FACTOR: f64 = 0.001;
/// Smallest and largest step-size factor after an attempt whose iteration failed.
const AFTER_FAILURE: (f64, f64) = (0.1, 0.5);

/// A step as it was before an event truncated it.
#[derive(Clone, Copy)]
pub(super) struct FullStep {
    /// s.
    size: f64,
    /// Whether it was repeated to end at the event; otherwise it ended on its interpolant.
    repeated: bool,
}

/// A gap at one instant of a step, positive where it contradicts the recorded contact state.
#[derive(Clone, Copy)]
struct SignedGap {
    /// Fraction of the step.
    theta: f64,
    /// m.
    gap: f64,
    /// m/s.
    rate: f64,
}

/// What can end a step before its full size.
#[derive(Clone, Copy)]
enum End {
    /// The end of the step to reproduce, and whether that was repeated to end there.
    Limit(bool),
    /// A contact starts or ends.
    Contact(ContactId),
    /// A contact leaves its branch of a law, for this one.
    Corner(ContactId, LawBranch),
    /// An edge of an element's force.
    Edge,
}

/// An end, at a fraction of the step just attempted.
#[derive(Clone, Copy)]
struct Ending {
    theta: f64,
    at: End,
}

impl Stepping<'_> {
    /// Takes a step whose size follows the error estimate, truncated at the first contact start or end inside it.
    pub(super) fn adaptive_step(&mut self, limit: f64) -> Result<(), Stopped> {
        self.choose_flights(limit);
        self.stepper.choose(self.state.control.scheme);
        self.attempt.has_switched_branch = false;
        self.attempt.counts = Counts::default();
        self.attempt.factorisations = 0;
        self.freeze_element_sides();
        let (t_end, h) = loop {
            if let Some(step) = self.attempt_adaptive(limit) {
                break step;
            }
            self.state.record.statistics.rejected += 1;
            let shortest = shortest_step(self.state.now.t);
            if !(self.state.control.h_next >= shortest) {
                self.state.record.statistics.count(self.attempt.counts);
                self.state.control.h_next = self.state.conditions.solver.step;
                if self.mechanism.is_nearly_singular() {
                    return Err(self.stopped(StopFault::SingularLoops, StopAdvice::Dependent));
                }
                let tolerance = self.state.conditions.solver.tolerance;
                let advice = StopAdvice::LooserTolerance { tolerance };
                return Err(self.stopped(StopFault::ShortStep { shortest }, advice));
            }
        };
        let stiffness = self.attempt.stiffness;
        let evaluations = self.attempt.counts.equations;
        self.accept(t_end, h)?;
        if stiffness > STABILITY_LIMIT {
            self.state.record.statistics.stability_limited_time += h;
        }
        if self.state.conditions.solver.method == Method::Automatic {
            self.choose_scheme(h, stiffness, evaluations as f64);
        }
        Ok(())
    }

    /// Largest scaled error of an acceptable step.
    fn allowed_error(&self) -> f64 {
        let solver = &self.state.conditions.solver;
        let allowed = match (solver.method, self.state.control.scheme) {
            (Method::Automatic, ActiveScheme::Explicit) => solver.tolerance.min(IMPACT_TOLERANCE),
            _ => solver.tolerance,
        };
        let vertical_onset = self.attempt.element_sides.iter().any(EdgeIndicator::has_vertical_onset);
        if vertical_onset { STOP_ERROR_FACTOR * allowed } else { allowed }
    }

    /// Attempts a step and locates its first event. Returns its end and size, s, or `None` if it must be repeated with the new
    /// `h_next`.
    fn attempt_adaptive(&mut self, limit: f64) -> Option<(f64, f64)> {
        let t = self.state.now.t;
        let tolerance = self.state.conditions.solver.tolerance;
        let requested_step = self.state.control.h_next;
        let to_reproduce = self.attempt.step_to_reproduce.take();
        self.attempt.full_step = None;
        self.attempt.edge = false;
        let mut h = requested_step.min(LONGEST_STEP);
        let mut t_end = t + h;
        let is_truncated = t_end >= limit - NEARLY * h;
        if let Some(full_step) = to_reproduce {
            h = full_step.size;
            t_end = t + h;
        } else if is_truncated {
            t_end = limit;
            h = limit - t;
        }
        let error = self.try_step(h) / self.allowed_error();
        let growth = self.stepper.growth();
        let state = &mut self.state;
        if !(error <= 1.0) {
            let controller = &state.control.controller;
            let factor = if error.is_finite() || growth.is_infinite() {
                controller.after_reject(error)
            } else {
                growth.clamp(AFTER_FAILURE.0, AFTER_FAILURE.1)
            };
            state.control.h_next = h * factor;
            return None;
        }
        let factor = state.control.controller.after_accept(error);
        let next = h * factor.min(growth.max(1.0));
        // A step cut short is no evidence against the longer one.
        state.control.h_next = if is_truncated { state.control.h_next.max(next) } else { next };
        let contact_began = std::mem::take(&mut state.control.contact_began);
        self.finish_gaps(t_end);
        let event = self.first_event(h);
        let corner = self.first_corner(h);
        // A step that follows another run ends where and how that run's step did, unless an event of its own comes first.
        let last = to_reproduce.map(|full_step| Ending { theta: (limit - t) / h, at: End::Limit(full_step.repeated) });
        let contact = event.map(|(theta, contact)| Ending { theta, at: End::Contact(contact) });
        let comes_first = |theta: f64| last.iter().chain(&contact).all(|ending| theta < ending.theta);
        self.attempt.corner = None;
        self.attempt.located_contact = None;
        let mut corner = corner.filter(|corner| comes_first(corner.theta));
        if let Some(corner) = corner.take_if(|corner| corner.is_at_start())
            && !self.attempt.has_switched_branch
        {
            // Retry once on the other branch; if that leads back here, either branch will do.
            self.attempt.has_switched_branch = true;
            corner.next.apply_to(&mut self.state.now.contact_states[corner.contact]);
            self.invalidate();
            return self.retry(requested_step, contact_began);
        }
        let edge = self.first_edge(h);
        if edge.is_some_and(|theta| theta < edges::AT_START) {
            // The edge was passed at the start: repeat the step on the other side.
            return self.retry(requested_step, contact_began);
        }
        let corner = corner.map(|corner| Ending { theta: corner.theta, at: End::Corner(corner.contact, corner.next) });
        let edge = edge.map(|theta| Ending { theta, at: End::Edge });
        // Of several at one instant, the first in this order.
        let endings = [last, contact, corner, edge].into_iter().flatten();
        let first = endings.reduce(|first, next| if next.theta < first.theta { next } else { first });
        // The full step worked; a rate that stops rising soon after contact onset is no evidence against its size.
        let worked = match first {
            None => true,
            Some(Ending { at, .. }) => matches!(at, End::Corner(_, LawBranch::Approach(_))),
        };
        if contact_began && worked {
            self.state.control.h_contact = next.max(MIN_FIRST_STEP);
        }
        let Some(Ending { theta, at }) = first else {
            return Some((t_end, h));
        };
        let (t_end, part) = match at {
            End::Limit(_) => (limit, limit - t),
            _ => (t + theta * h, h * theta),
        };
        match at {
            End::Limit(false) => {
                self.truncate_at(theta, limit, h);
                return Some((t_end, part));
            }
            End::Corner(contact, branch) => self.attempt.corner = Some((contact, branch)),
            End::Edge => self.attempt.edge = true,
            End::Contact(contact) => self.attempt.located_contact = Some(contact),
            End::Limit(true) => {}
        }
        let repeats = matches!(at, End::Contact(_) | End::Limit(_))
            && !(tolerance >= END_ON_INTERPOLANT && self.stepper.ends_on_interpolant());
        self.attempt.full_step = Some(FullStep { size: h, repeated: repeats });
        if !repeats {
            let t_end = t + theta * h;
            self.truncate_at(theta, t_end, h);
            return Some((t_end, h * theta));
        }
        // Repeat the step, shortened, so that its end has the error of the method and not that of the interpolant.
        if !self.try_step(part).is_finite() {
            return self.retry(0.5 * part, contact_began);
        }
        self.finish_gaps(t_end);
        Some((t_end, part))
    }

    /// Lets the step be repeated with the size `h_next`, s.
    fn retry(&mut self, h_next: f64, contact_began: bool) -> Option<(f64, f64)> {
        self.state.control.h_next = h_next;
        self.state.control.contact_began = contact_began;
        None
    }

    /// Fraction of the step just attempted at which the first contact starts or ends, if any, and that contact.
    fn first_event(&mut self, h: f64) -> Option<(f64, ContactId)> {
        let mut first: Option<(f64, ContactId)> = None;
        for c in 0..self.attempt.end.gaps.len() {
            if let Some(theta) = self.event_of(c, h)
                && first.is_none_or(|(earliest, _)| theta < earliest)
            {
                first = Some((theta, c));
            }
        }
        first
    }

    /// Fraction of the step just attempted at which contact `c` leaves its recorded contact state.
    fn event_of(&mut self, c: usize, h: f64) -> Option<f64> {
        let (start, end) = (self.state.now.gaps[c], self.attempt.end.gaps[c]);
        // Positive where the gap contradicts the recorded contact state.
        let sign = if self.state.now.contact_states[c].active { -1.0 } else { 1.0 };
        // A ball may cross its play several times in one long step: search intervals in which it moves little compared with
        // the play.
        let travel = h * start.speed.max(end.speed);
        let clearance = self.mechanism.contacts.clearance(c);
        let intervals = (4.0 * travel / clearance).ceil().clamp(1.0, 64.0);
        let signed = |theta: f64, at: Approach| SignedGap { theta, gap: sign * at.penetration, rate: sign * at.rate };
        let mut left = signed(0.0, start);
        for n in 1..=intervals as u32 {
            let right = if f64::from(n) == intervals {
                signed(1.0, end)
            } else {
                self.signed_gap(c, f64::from(n) / intervals, h, sign)
            };
            if let Some((a, b)) = self.crossing_within(c, h, sign, left, right) {
                let width = (1e-15 / h).max(1e-12);
                let gap = |theta: f64| self.signed_gap(c, theta, h, sign).gap;
                return Some(find_root(a.theta, a.gap, b.theta, b.gap, width, 1e-16, gap));
            }
            left = right;
        }
        // The state is wrong throughout: it switches at the end of the step.
        None
    }

    /// Two points within an interval of the step between which the signed gap turns positive.
    fn crossing_within(
        &mut self,
        c: usize,
        h: f64,
        sign: f64,
        left: SignedGap,
        right: SignedGap,
    ) -> Option<(SignedGap, SignedGap)> {
        // A gap of exactly 0 may end one interval and begin the next; the crossing belongs to the latter.
        if left.gap <= 0.0 && right.gap > 0.0 {
            return Some((left, right));
        }
        // An extremum inside: a brief contact that both ends miss, or a brief separation.
        let (mut a, mut b) = (left, right);
        let turns = if right.gap > 0.0 { a.rate < 0.0 && b.rate > 0.0 } else { a.rate > 0.0 && b.rate < 0.0 };
        if !turns {
            return None;
        }
        for _ in 0..40 {
            // Neither tangent reaches zero: no root here.
            let reach = (a.gap + a.rate * (b.theta - a.theta) * h).min(b.gap - b.rate * (b.theta - a.theta) * h);
            if right.gap <= 0.0 && reach < 0.0 {
                return None;
            }
            let middle = self.signed_gap(c, 0.5 * (a.theta + b.theta), h, sign);
            if right.gap > 0.0 && middle.gap <= 0.0 {
                return Some((middle, right));
            }
            if right.gap <= 0.0 && middle.gap > 0.0 && left.gap <= 0.0 {
                return Some((left, middle));
            }
            if (middle.rate > 0.0) == (a.rate > 0.0) {
                a = middle;
            } else {
                b = middle;
            }
        }
        None
    }

    /// Gap of contact `c` on the interpolant of the attempted step, times `sign`.
    fn signed_gap(&mut self, c: usize, theta: f64, h: f64, sign: f64) -> SignedGap {
        self.measure_at(c, theta, h);
        let gap = self.mechanism.contacts.gap(c);
        SignedGap { theta, gap: sign * gap.separation.penetration, rate: sign * gap.separation.rate }
    }
}
