//! Corners of the friction law as events: each touching joint holds one piece of the law over a whole step, and the step
//! ends where its sliding speed leaves that piece.

use super::Simulation;
use crate::contact::Slip;
use crate::integrate::{Method, System, find_root};

/// Parts of a step at whose ends the sliding speed is looked at.
const PARTS: u32 = 4;
/// A corner earlier than this fraction of the step was passed at its start: the step is taken again on the next piece.
const AT_START: f64 = 1e-9;
/// What a step that ends at a corner adds to the chatter; any other takes one off.
const CORNER: u32 = 3;
/// Chatter from which corners are no longer located, until it has died down.
const MOST_CHATTER: u32 = 60;

/// A corner inside the step just attempted.
pub(super) struct Corner {
    /// Fraction of the step.
    pub theta: f64,
    pub joint: usize,
    /// Piece beyond it.
    pub next: Slip,
}

impl Corner {
    /// Whether it lies so early that its joint is better put on the next piece before the step.
    pub(super) fn is_at_start(&self) -> bool {
        self.theta <= AT_START
    }
}

impl Simulation {
    /// Whether the method locates corners. It needs an interpolant of its own: a cubic through both ends of a step longer
    /// than a contact rings overshoots inside, and a step that ends on it gains energy.
    fn locates_corners(&self) -> bool {
        let method = self.running.solver.method;
        method.is_adaptive() && method != Method::Rosenbrock
    }

    /// Puts every touching joint on the piece of the friction law on which it slides now; those that hold one already keep
    /// it unless `anew`. Where corners are not located, all follow the whole law.
    pub(super) fn hold_slip(&mut self, anew: bool) {
        let holds = self.locates_corners() && !self.state.chatters;
        let keeps = |slip: Slip| slip != Slip::Whole && !anew;
        if !holds {
            for memory in &mut self.state.memory {
                memory.slip = Slip::Whole;
            }
            return;
        }
        if self.state.memory.iter().all(|m| !m.active || keeps(m.slip)) {
            return;
        }
        let Self {
            mechanism, state, ..
        } = self;
        mechanism.measure(state.t, &state.y);
        for (j, memory) in state.memory.iter_mut().enumerate() {
            if !memory.active {
                memory.slip = Slip::Whole;
            } else if !keeps(memory.slip) {
                let speed = mechanism.slip_speed(j);
                memory.slip = mechanism.contacts.coefficients(j).slip_at(speed);
            }
        }
    }

    /// First corner of the friction law inside the step just attempted.
    pub(super) fn first_corner(&mut self, h: f64) -> Option<Corner> {
        if !std::mem::take(&mut self.mechanism.contacts.strayed) {
            return None;
        }
        let mut first: Option<Corner> = None;
        for j in 0..self.state.memory.len() {
            if self.state.memory[j].slip == Slip::Whole {
                continue;
            }
            let Some((theta, next)) = self.corner_of(j, h) else {
                continue;
            };
            if first.as_ref().is_none_or(|earliest| theta < earliest.theta) {
                first = Some(Corner {
                    theta,
                    joint: j,
                    next,
                });
            }
        }
        first
    }

    /// Where the sliding speed of joint `j` leaves its piece, as a fraction of the step just attempted, and for which piece.
    fn corner_of(&mut self, j: usize, h: f64) -> Option<(f64, Slip)> {
        let mut left = (0.0, self.beyond(j, 0.0, h).0);
        for n in 1..=PARTS {
            let theta = f64::from(n) / f64::from(PARTS);
            let right = (theta, self.beyond(j, theta, h).0);
            if right.1 > 0.0 {
                let at = if left.1 < 0.0 {
                    let small = 1e-9 * self.mechanism.contacts.coefficients(j).slip_high;
                    let width = (1e-15 / h).max(1e-12);
                    let beyond = |theta: f64| self.beyond(j, theta, h).0;
                    find_root(left.0, left.1, right.0, right.1, width, small, beyond)
                } else {
                    left.0
                };
                let (_, speed) = self.beyond(j, at.max(AT_START), h);
                let c = self.mechanism.contacts.coefficients(j);
                let next = match self.state.memory[j].slip {
                    Slip::Ramp if speed > 0.5 * (c.slip_low + c.slip_high) => Slip::Full,
                    Slip::Ramp => Slip::Creep,
                    _ => Slip::Ramp,
                };
                return Some((at, next));
            }
            left = right;
        }
        None
    }

    /// Lets the step just attempted end at a corner. Unlike a beginning contact it is not taken again: its end would be
    /// off the corner by the tolerance, which is not small against the ramp, and slide back at once.
    pub(super) fn end_at(&mut self, theta: f64, t_end: f64, h: f64) {
        let Self {
            mechanism,
            stepper,
            state,
            y_end,
            k_end,
            scratch_y,
            ..
        } = self;
        stepper.interpolate(theta, h, &state.y, &state.k, y_end, k_end, scratch_y);
        y_end.copy_from_slice(scratch_y);
        stepper.truncate(theta);
        mechanism.derivative(t_end, y_end, k_end);
        self.finish_gaps(t_end);
    }

    /// How far joint `j` slides beyond its piece on the interpolant of the attempted step, and its sliding speed, m/s.
    fn beyond(&mut self, j: usize, theta: f64, h: f64) -> (f64, f64) {
        let Self {
            mechanism,
            stepper,
            state,
            y_end,
            k_end,
            scratch_y,
            ..
        } = self;
        stepper.interpolate(theta, h, &state.y, &state.k, y_end, k_end, scratch_y);
        mechanism.measure(state.t + theta * h, scratch_y);
        let speed = mechanism.slip_speed(j);
        let slip = state.memory[j].slip;
        let beyond = mechanism.contacts.coefficients(j).beyond(slip, speed);
        (beyond, speed)
    }

    /// After an accepted step: goes on to the piece behind the corner that it ended at, and stops locating for a while
    /// where corners follow one another with hardly a step between.
    pub(super) fn pass_corner(&mut self) {
        let state = &mut self.state;
        if let Some((j, next)) = self.corner.take() {
            if state.memory[j].active {
                state.memory[j].slip = next;
            }
            state.statistics.corners += 1;
            state.chatter += CORNER;
            state.chatters |= state.chatter >= MOST_CHATTER;
        } else {
            state.chatter = state.chatter.saturating_sub(1);
            state.chatters &= state.chatter > 0;
        }
        self.hold_slip(false);
    }
}
