//! A cubic spline through points. Its second derivative has no jump between the first point and the last; where the points
//! repeat, nowhere. Otherwise the end values hold outside, and the rate is 0 at both ends.

use std::sync::Arc;

use super::{Law, NEAR};
use crate::jet::Jet;
use crate::scene::{Drive, DriveData};

/// Parts into which an interval is stepped, at least, as long as they are not shorter than `FINE`, s.
const PARTS: f64 = 8.0;
const FINE: f64 = 1e-3;

#[derive(Debug)]
struct Table {
    /// Instants of the points, s.
    times: Vec<f64>,
    /// Coefficients of the cubic from each point to the next, in the time since that point, lowest first.
    cubics: Vec<[f64; 4]>,
    end: f64,
    repeats: bool,
}

pub(super) fn make(drive: &Drive, _turns: bool) -> Arc<dyn Law> {
    let DriveData::Points { points, repeats } = &drive.data else {
        unreachable!("a table is read with its points")
    };
    Arc::new(Table::new(points, *repeats))
}

impl Table {
    fn new(points: &[[f64; 2]], repeats: bool) -> Self {
        let widths: Vec<f64> = points.windows(2).map(|p| p[1][0] - p[0][0]).collect();
        let rises: Vec<f64> = points.windows(2).map(|p| p[1][1] - p[0][1]).collect();
        let curvatures = curvatures(&widths, &rises, repeats);
        let cubic = |(i, (h, rise)): (usize, (&f64, &f64))| {
            let (m0, m1) = (curvatures[i], curvatures[i + 1]);
            [
                points[i][1],
                rise / h - h * (2.0 * m0 + m1) / 6.0,
                m0 / 2.0,
                (m1 - m0) / (6.0 * h),
            ]
        };
        Self {
            times: points.iter().map(|point| point[0]).collect(),
            cubics: widths.iter().zip(&rises).enumerate().map(cubic).collect(),
            end: points[points.len() - 1][1],
            repeats,
        }
    }

    fn ends(&self) -> [f64; 2] {
        [self.times[0], self.times[self.times.len() - 1]]
    }

    /// `t`, moved by whole periods to within the points where they repeat.
    fn within(&self, t: f64) -> f64 {
        let [first, last] = self.ends();
        if !self.repeats || (first..last).contains(&t) {
            return t;
        }
        let period = last - first;
        let moved = t - period * ((t - first) / period).floor();
        // Rounding may miss the period by a hair.
        moved.clamp(first, last)
    }

    /// Index of the first point after `t`.
    fn next(&self, t: f64) -> usize {
        self.times.partition_point(|time| *time <= t)
    }
}

impl Law for Table {
    fn at(&self, t: f64) -> Jet {
        let t = self.within(t);
        let [first, last] = self.ends();
        if t < first {
            return Jet::constant(self.cubics[0][0]);
        }
        if t >= last {
            return match self.repeats {
                true => self.at(first),
                false => Jet::constant(self.end),
            };
        }
        let i = self.next(t) - 1;
        let [a, b, c, d] = self.cubics[i];
        let s = t - self.times[i];
        Jet::new(
            a + s * (b + s * (c + s * d)),
            b + s * (2.0 * c + 3.0 * s * d),
            2.0 * c + 6.0 * s * d,
        )
    }

    fn period(&self) -> f64 {
        let [first, last] = self.ends();
        let moves = self.cubics.iter().any(|cubic| cubic[1..] != [0.0; 3]);
        if self.repeats && moves {
            last - first
        } else {
            f64::INFINITY
        }
    }

    /// At the next point, where the third derivative jumps, and at some instants on the way there.
    fn step_end(&self, t: f64) -> f64 {
        let now = self.within(t);
        let next = match self.next(now + NEAR) {
            next if next < self.times.len() => next,
            _ if self.repeats => return t + part(self.times[1] - self.times[0]),
            _ => return f64::INFINITY,
        };
        let left = self.times[next] - now;
        t + match next {
            0 => left,
            _ => left.min(part(self.times[next] - self.times[next - 1])),
        }
    }

    fn bounds_steps(&self) -> bool {
        true
    }
}

/// Longest step within an interval of this width, s.
fn part(width: f64) -> f64 {
    (width / PARTS).max(FINE).min(width)
}

/// Second derivatives of the spline at the points: continuous first and second derivatives at all inner ones, and at the ends
/// either a rate of 0, or the same first and second derivatives at both.
fn curvatures(widths: &[f64], rises: &[f64], repeats: bool) -> Vec<f64> {
    let n = widths.len();
    let slope = |i: usize| rises[i] / widths[i];
    // Row i: below[i] m[i - 1] + on[i] m[i] + above[i] m[i + 1] = right[i].
    let (mut below, mut on, mut above, mut right) = (
        vec![0.0; n + 1],
        vec![0.0; n + 1],
        vec![0.0; n + 1],
        vec![0.0; n + 1],
    );
    for i in 1..n {
        (below[i], above[i]) = (widths[i - 1], widths[i]);
        on[i] = 2.0 * (widths[i - 1] + widths[i]);
        right[i] = 6.0 * (slope(i) - slope(i - 1));
    }
    if !repeats {
        (on[0], above[0], right[0]) = (2.0 * widths[0], widths[0], 6.0 * slope(0));
        (below[n], on[n], right[n]) = (widths[n - 1], 2.0 * widths[n - 1], -6.0 * slope(n - 1));
        solve(&below, &on, &above, &mut right);
        return right;
    }
    // The unknowns are m[0] to m[n - 1]; row 0 reaches around to m[n - 1], and row n - 1 to m[0]: Sherman and Morrison.
    let corner = widths[n - 1];
    on[0] = 2.0 * (widths[n - 1] + widths[0]);
    above[0] = widths[0];
    right[0] = 6.0 * (slope(0) - slope(n - 1));
    let gamma = -on[0];
    let mut around = vec![0.0; n];
    (around[0], around[n - 1]) = (gamma, corner);
    on[0] -= gamma;
    on[n - 1] -= corner * corner / gamma;
    right.truncate(n);
    solve(&below[..n], &on[..n], &above[..n], &mut right);
    solve(&below[..n], &on[..n], &above[..n], &mut around);
    let ratio = corner / gamma;
    let share = (right[0] + ratio * right[n - 1]) / (1.0 + around[0] + ratio * around[n - 1]);
    for (m, turn) in right.iter_mut().zip(&around) {
        *m -= share * turn;
    }
    right.push(right[0]);
    right
}

/// Solves a diagonally dominant tridiagonal system in place of its right-hand side.
fn solve(below: &[f64], on: &[f64], above: &[f64], right: &mut [f64]) {
    let mut pivots = on.to_vec();
    for i in 1..right.len() {
        let factor = below[i] / pivots[i - 1];
        pivots[i] -= factor * above[i - 1];
        right[i] -= factor * right[i - 1];
    }
    for i in (0..right.len()).rev() {
        if i + 1 < right.len() {
            right[i] -= above[i] * right[i + 1];
        }
        right[i] /= pivots[i];
    }
}
