//! Cubic splines through points, with continuous first and second derivatives between the first point and the last.

use crate::jet::Jet;

/// End conditions of a spline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ends {
    /// Zero slope at both ends.
    Clamped,
    /// Zero second derivative at both ends: a straight line continues it smoothly.
    Natural,
    /// Equal first and second derivatives at both ends: the points span one period.
    Periodic,
}

/// A spline, from its first point to its last.
#[derive(Debug)]
pub struct Spline {
    /// Abscissas of the points.
    pub knots: Vec<f64>,
    /// Coefficients of the cubic on each interval, in the distance from its left point, lowest power first.
    pub cubics: Vec<[f64; 4]>,
}

impl Spline {
    /// Interpolates two or more `points` (x, y) with increasing x.
    pub fn new(points: &[[f64; 2]], ends: Ends) -> Self {
        let widths: Vec<f64> = points.windows(2).map(|p| p[1][0] - p[0][0]).collect();
        let rises: Vec<f64> = points.windows(2).map(|p| p[1][1] - p[0][1]).collect();
        let curvatures = curvatures(&widths, &rises, ends);
        let cubic = |(i, (h, rise)): (usize, (&f64, &f64))| {
            let (m0, m1) = (curvatures[i], curvatures[i + 1]);
            [points[i][1], rise / h - h * (2.0 * m0 + m1) / 6.0, m0 / 2.0, (m1 - m0) / (6.0 * h)]
        };
        Self {
            knots: points.iter().map(|point| point[0]).collect(),
            cubics: widths.iter().zip(&rises).enumerate().map(cubic).collect(),
        }
    }

    /// First and last abscissa.
    pub fn ends(&self) -> [f64; 2] {
        [self.knots[0], self.knots[self.knots.len() - 1]]
    }

    /// Index of the first point after `x`.
    pub fn next(&self, x: f64) -> usize {
        self.knots.partition_point(|knot| *knot <= x)
    }

    /// Value, slope and second derivative at `x`; outside the points, those of the first or last cubic.
    pub fn at(&self, x: f64) -> Jet {
        let i = self.next(x).clamp(1, self.cubics.len()) - 1;
        let [a, b, c, d] = self.cubics[i];
        let s = x - self.knots[i];
        Jet::new(a + s * (b + s * (c + s * d)), b + s * (2.0 * c + 3.0 * s * d), 2.0 * c + 6.0 * s * d)
    }
}

/// Second derivatives of the spline at the points.
fn curvatures(widths: &[f64], rises: &[f64], ends: Ends) -> Vec<f64> {
    let n = widths.len();
    let slope = |i: usize| rises[i] / widths[i];
    // Row i: below[i] m[i - 1] + on[i] m[i] + above[i] m[i + 1] = right[i].
    let (mut below, mut on, mut above, mut right) =
        (vec![0.0; n + 1], vec![0.0; n + 1], vec![0.0; n + 1], vec![0.0; n + 1]);
    for i in 1..n {
        (below[i], above[i]) = (widths[i - 1], widths[i]);
        on[i] = 2.0 * (widths[i - 1] + widths[i]);
        right[i] = 6.0 * (slope(i) - slope(i - 1));
    }
    match ends {
        Ends::Clamped => {
            (on[0], above[0], right[0]) = (2.0 * widths[0], widths[0], 6.0 * slope(0));
            (below[n], on[n], right[n]) = (widths[n - 1], 2.0 * widths[n - 1], -6.0 * slope(n - 1));
        }
        Ends::Natural => (on[0], on[n]) = (1.0, 1.0),
        Ends::Periodic => return periodic_curvatures(widths, slope, [below, on, above, right]),
    }
    solve(&below, &on, &above, &mut right);
    right
}

/// The same for a periodic spline, given the rows of its inner points.
fn periodic_curvatures(
    widths: &[f64],
    slope: impl Fn(usize) -> f64,
    [below, mut on, mut above, mut right]: [Vec<f64>; 4],
) -> Vec<f64> {
    let n = widths.len();
    // The unknowns are m[0] to m[n - 1]. Rows 0 and n - 1 wrap around to m[n - 1] and m[0]: Sherman and Morrison.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_points_make_a_straight_line() {
        let line = Spline::new(&[[-1.0, 3.0], [1.0, -1.0]], Ends::Natural);
        for x in [-1.0, -0.3, 0.0, 1.0] {
            assert_eq!(line.at(x), Jet::new(1.0 - 2.0 * x, -2.0, 0.0));
        }
    }

    #[test]
    fn derivatives_join_at_the_points() {
        let points = [[-2.0, 0.0], [-0.5, 3.0], [0.1, 1.0], [4.0, -7.0]];
        let spline = Spline::new(&points, Ends::Natural);
        for [x, value] in points {
            assert!((spline.at(x).value - value).abs() < 1e-12);
        }
        for x in [-0.5, 0.1] {
            let (before, after) = (spline.at(x - 1e-9), spline.at(x));
            assert!((before.rate - after.rate).abs() < 1e-7);
            assert!((before.acceleration - after.acceleration).abs() < 1e-6);
        }
        for x in spline.ends() {
            assert!(spline.at(x).acceleration.abs() < 1e-12);
        }
    }
}
