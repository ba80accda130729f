//! Function through points. Outside a table that does not repeat, the end values hold, and the rate of a drive is 0 at both
//! ends. A spline's second derivative is continuous between the first and last point, and everywhere for a periodic table; the
//! rate of a monotone function is.

use super::{Law, MIN_STEP};
use crate::interpolate::{Ends, Interpolant, Interpolation};
use crate::jet::Jet;

/// Minimum number of steps per interval, unless they would be shorter than `MIN_PART`, s.
const PARTS: f64 = 8.0;
const MIN_PART: f64 = 1e-3;

#[derive(Debug)]
pub(super) struct Table {
    /// Value against time, s.
    curve: Interpolant,
    end: f64,
    repeats: bool,
}

impl Table {
    /// Function through `points` with these `ends`.
    pub fn new(points: &[[f64; 2]], interpolation: Interpolation, ends: Ends) -> Self {
        Self {
            curve: Interpolant::new(points, interpolation, ends),
            end: points[points.len() - 1][1],
            repeats: ends == Ends::Periodic,
        }
    }

    /// `t` shifted by whole periods into the range of the points if they repeat.
    fn within(&self, t: f64) -> f64 {
        let [first, last] = self.curve.ends();
        if !self.repeats || (first..last).contains(&t) {
            return t;
        }
        let period = last - first;
        let moved = t - period * ((t - first) / period).floor();
        // Rounding may overshoot the period slightly.
        moved.clamp(first, last)
    }
}

impl Law for Table {
    fn at(&self, t: f64) -> Jet {
        let t = self.within(t);
        let [first, last] = self.curve.ends();
        if t < first {
            return Jet::constant(self.curve.cubics[0][0]);
        }
        if t >= last {
            return match self.repeats {
                true => self.at(first),
                false => Jet::constant(self.end),
            };
        }
        self.curve.at(t)
    }

    fn period(&self) -> f64 {
        let [first, last] = self.curve.ends();
        let cubics = &self.curve.cubics;
        let moves = cubics.iter().any(|cubic| cubic[1..] != [0.0; 3]);
        if self.repeats && moves { last - first } else { f64::INFINITY }
    }

    /// The next point, where a derivative jumps, or an intermediate instant before it.
    fn step_end(&self, t: f64) -> f64 {
        let (now, times) = (self.within(t), &self.curve.knots);
        let next = match self.curve.next(now + MIN_STEP) {
            next if next < times.len() => next,
            _ if self.repeats => return t + part(times[1] - times[0]),
            _ => return f64::INFINITY,
        };
        let left = times[next] - now;
        t + match next {
            0 => left,
            _ => left.min(part(times[next] - times[next - 1])),
        }
    }

    fn bounds_steps(&self) -> bool {
        true
    }
}

/// Longest step within an interval of this width, s.
fn part(width: f64) -> f64 {
    (width / PARTS).max(MIN_PART).min(width)
}
