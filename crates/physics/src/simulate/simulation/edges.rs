//! Edges of force elements as events. During a step a stop or a tyre either presses or does not, a spring with a characteristic of
//! straight lines stays on one of them, and the step ends where that changes. The force has a kink or a jump there, and a step
//! across it has an error that its estimate does not see.

use super::Stepping;
use super::flights::write_flights;
use crate::integrate::find_root;
use crate::mechanism::EdgeIndicator;

/// Parts of a step at whose ends elements are checked.
const PARTS: u32 = 4;
/// An edge earlier than this fraction of the step was passed at its start.
pub(super) const AT_START: f64 = 1e-9;

impl Stepping<'_> {
    /// Fixes the side of each element that has edges for the next step, if the method ends steps there, which takes an
    /// interpolant as accurate as its steps.
    pub(super) fn freeze_element_sides(&mut self) {
        if self.stepper.ends_on_interpolant() && self.mechanism.has_edges() {
            let Self { mechanism, state, attempt, .. } = self;
            mechanism.measure(state.now.t, &state.now.y);
            attempt.element_sides.extend(mechanism.edge_indicators(state.now.t));
        }
    }

    /// Fraction of the step just attempted at which the first element passes an edge, if any does; 0 if one did so at the start
    /// and has been switched to the other side.
    pub(super) fn first_edge(&mut self, h: f64) -> Option<f64> {
        if self.attempt.element_sides.is_empty() {
            return None;
        }
        let [mut left, mut right] = std::mem::take(&mut self.attempt.edge_indicators);
        let mut from = AT_START;
        self.measure_edge_indicators(from, h, &mut left);
        let turns = self.attempt.element_sides.iter().zip(&left).any(|(before, now)| before.side() != now.side());
        // Only once: if that leads back here, either side will do.
        if turns && !self.attempt.has_switched_branch {
            self.attempt.has_switched_branch = true;
            self.attempt.element_sides.copy_from_slice(&left);
            self.attempt.edge_indicators = [left, right];
            return Some(0.0);
        }
        let mut first: Option<f64> = None;
        for n in 1..=PARTS {
            let to = f64::from(n) / f64::from(PARTS);
            self.measure_edge_indicators(to, h, &mut right);
            for (number, (&left, &right)) in left.iter().zip(&right).enumerate() {
                if let Some(edge) = left.edge_towards(right) {
                    let width = (1e-15 / h).max(1e-12);
                    // The root returned is just past the edge: before it the next step would start with the wrong force.
                    let [before, after] = [left, right].map(|indicator| indicator.value() - edge);
                    let at = find_root(from, before, to, after, width, 0.0, |theta| {
                        self.edge_indicator_at(number, theta, h) - edge
                    });
                    first = Some(first.map_or(at, |first| first.min(at)));
                }
            }
            if first.is_some() {
                break;
            }
            std::mem::swap(&mut left, &mut right);
            from = to;
        }
        self.attempt.edge_indicators = [left, right];
        // A step cut so short that time stands still would be repeated for ever.
        let start = self.state.now.t;
        first.filter(|theta| start + theta * h > start)
    }

    /// Writes the indicators of every element that has edges, on the interpolant of the attempted step, to `out`.
    fn measure_edge_indicators(&mut self, theta: f64, h: f64, out: &mut Vec<EdgeIndicator>) {
        let time = self.measure_all_at(theta, h);
        out.clear();
        // A nested iterator runs faster from inside than through `extend`.
        self.mechanism.edge_indicators(time).for_each(|indicator| out.push(indicator));
    }

    /// The value of one of these indicators.
    fn edge_indicator_at(&mut self, number: usize, theta: f64, h: f64) -> f64 {
        let time = self.measure_all_at(theta, h);
        self.mechanism.edge_indicators(time).nth(number).map_or(0.0, EdgeIndicator::value)
    }

    /// Measures all bodies on the interpolant of the attempted step; returns the time there, s.
    fn measure_all_at(&mut self, theta: f64, h: f64) -> f64 {
        let Self { mechanism, stepper, state, attempt, scratch_y, .. } = self;
        let (now, end) = (&state.now, &attempt.end);
        let all = 0..now.y.len();
        stepper.interpolate(all, theta, now.step(h), [&end.y, &end.k], &state.polynomial, scratch_y);
        let time = now.t + theta * h;
        write_flights(mechanism, &state.flights, time, scratch_y);
        mechanism.measure(time, scratch_y);
        time
    }
}
