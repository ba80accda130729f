//! Functions through points: cubic splines, cubics that follow the data without overshoot, and straight lines.

use crate::jet::Jet;
use crate::words::words;

/// How a function passes through points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// Cubic spline: two continuous derivatives. It overshoots where the points turn sharply.
    Spline,
    /// Cubics with one continuous derivative that rise, fall and turn only where the points do (Fritsch & Carlson, SIAM J. Numer.
    /// Anal. 17 (1980) 238, with the slopes of Fritsch & Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300).
    Monotone,
    /// Straight lines, with a kink at each point.
    Linear,
}

words!(Interpolation {
    Spline => "spline",
    Monotone => "monotone",
    Linear => "linear",
});

/// End conditions; of no effect on straight lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ends {
    /// Zero slope at both ends.
    Clamped,
    /// A spline has zero second derivatives at both ends, so that a straight line continues it smoothly; a monotone function has
    /// the slopes of the data there.
    Natural,
    /// Equal derivatives at both ends: the points span one period.
    Periodic,
}

impl Ends {
    /// Ends of a motion between rest and rest, or of one period if it `repeats`.
    pub(crate) fn of_motion(repeats: bool) -> Self {
        if repeats { Self::Periodic } else { Self::Clamped }
    }
}

/// A function through points, from its first point to its last.
#[derive(Debug)]
pub(crate) struct Interpolant {
    /// Abscissas of the points.
    pub(crate) knots: Vec<f64>,
    /// Coefficients of the cubic on each interval, in the distance from its left point, lowest power first.
    pub cubics: Vec<[f64; 4]>,
}

/// Number of points on either side of an interval that show the range of the data there. The crest of a smooth function lies
/// halfway between two samples of equal height, so that the nearest two do not show it.
const NEIGHBOURS: usize = 3;
/// Largest part of that range by which an interpolant may leave it.
const MAX_EXCESS: f64 = 0.1;
/// Part of the range of all points below which an excess is never reported: a spline's ripple dies out over a plateau.
const NEGLIGIBLE: f64 = 1e-3;

/// Where an interpolant leaves the range of the points around it furthest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overshoot {
    /// Abscissa.
    pub at: f64,
    /// Value there.
    pub value: f64,
    /// Smallest and largest value of the points around it.
    pub range: [f64; 2],
}

impl Overshoot {
    /// Distance of the value from the range.
    pub fn excess(&self) -> f64 {
        (self.range[0] - self.value).max(self.value - self.range[1])
    }
}

impl Interpolant {
    /// Interpolates two or more `points` (x, y) with increasing x.
    pub fn new(points: &[[f64; 2]], interpolation: Interpolation, ends: Ends) -> Self {
        let widths: Vec<f64> = points.windows(2).map(|p| p[1][0] - p[0][0]).collect();
        let rises: Vec<f64> = points.windows(2).map(|p| p[1][1] - p[0][1]).collect();
        Self {
            knots: points.iter().map(|point| point[0]).collect(),
            cubics: match interpolation {
                Interpolation::Spline => spline(points, &widths, &rises, ends),
                Interpolation::Monotone => monotone(points, &widths, &rises, ends),
                Interpolation::Linear => {
                    let pairs = widths.iter().zip(&rises).zip(points);
                    pairs.map(|((h, rise), point)| [point[1], rise / h, 0.0, 0.0]).collect()
                }
            },
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
        self.on_cubic(self.next(x).clamp(1, self.cubics.len()) - 1, x)
    }

    /// The same on the cubic of interval `i`, continued beyond its ends.
    pub(crate) fn on_cubic(&self, i: usize, x: f64) -> Jet {
        let [a, b, c, d] = self.cubics[i];
        let s = x - self.knots[i];
        Jet::new(a + s * (b + s * (c + s * d)), b + s * (2.0 * c + 3.0 * s * d), 2.0 * c + 6.0 * s * d)
    }

    /// Abscissas inside interval `i` at which the slope is 0, in ascending order.
    pub fn turns(&self, i: usize) -> impl Iterator<Item = f64> + use<> {
        let [_, b, c, d] = self.cubics[i];
        let [left, right] = [self.knots[i], self.knots[i + 1]];
        // Roots of b + 2 c s + 3 d s^2, in the form without cancellation.
        let half = -(c + c.signum() * (c * c - 3.0 * b * d).max(0.0).sqrt());
        let mut turns = [half / (3.0 * d), b / half].map(|s| left + s);
        turns.sort_by(f64::total_cmp);
        turns.into_iter().filter(move |turn| left < *turn && *turn < right)
    }

    /// The largest overshoot, if it exceeds a tenth of the range of the points around it.
    pub fn overshoot(&self) -> Option<Overshoot> {
        let [_, last] = self.ends();
        let values: Vec<f64> = self.cubics.iter().map(|cubic| cubic[0]).chain([self.at(last).value]).collect();
        let range = |values: &[f64]| {
            values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], y| [low.min(*y), high.max(*y)])
        };
        let [low, high] = range(&values);
        let negligible = NEGLIGIBLE * (high - low);
        let overshoots = (0..self.cubics.len()).flat_map(|i| {
            let around = (i + 1).saturating_sub(NEIGHBOURS)..(i + 1 + NEIGHBOURS).min(values.len());
            let range = range(&values[around]);
            self.turns(i).map(move |at| Overshoot { at, value: self.on_cubic(i, at).value, range })
        });
        let noteworthy = |overshoot: &Overshoot| {
            let [low, high] = overshoot.range;
            overshoot.excess() > negligible.max(MAX_EXCESS * (high - low))
        };
        overshoots.filter(noteworthy).max_by(|a, b| a.excess().total_cmp(&b.excess()))
    }
}

/// Cubics of a spline through `points`, with these differences of abscissas and ordinates.
fn spline(points: &[[f64; 2]], widths: &[f64], rises: &[f64], ends: Ends) -> Vec<[f64; 4]> {
    let curvatures = curvatures(widths, rises, ends);
    let cubic = |(i, (h, rise)): (usize, (&f64, &f64))| {
        let (m0, m1) = (curvatures[i], curvatures[i + 1]);
        [points[i][1], rise / h - h * (2.0 * m0 + m1) / 6.0, m0 / 2.0, (m1 - m0) / (6.0 * h)]
    };
    widths.iter().zip(rises).enumerate().map(cubic).collect()
}

/// Cubics of a monotone function.
fn monotone(points: &[[f64; 2]], widths: &[f64], rises: &[f64], ends: Ends) -> Vec<[f64; 4]> {
    let n = widths.len();
    let secant = |i: usize| rises[i] / widths[i];
    let between = |i: usize, j: usize| weighted_harmonic_mean([widths[i], widths[j]], [secant(i), secant(j)]);
    let [first, last] = match ends {
        Ends::Clamped => [0.0; 2],
        Ends::Natural if n == 1 => [secant(0); 2],
        Ends::Natural => {
            [[0, 1], [n - 1, n - 2]].map(|interval| end_slope(interval.map(|i| widths[i]), interval.map(secant)))
        }
        Ends::Periodic => [between(n - 1, 0); 2],
    };
    let inner = (1..n).map(|i| between(i - 1, i));
    let slopes: Vec<f64> = std::iter::once(first).chain(inner).chain([last]).collect();
    let cubic = |i: usize| {
        let (h, [d0, d1]) = (widths[i], [slopes[i], slopes[i + 1]]);
        [points[i][1], d0, (3.0 * secant(i) - 2.0 * d0 - d1) / h, (d0 + d1 - 2.0 * secant(i)) / (h * h)]
    };
    (0..n).map(cubic).collect()
}

/// Whether two slopes rise together or fall together.
fn agree(a: f64, b: f64) -> bool {
    (a > 0.0 && b > 0.0) || (a < 0.0 && b < 0.0)
}

/// Slope at a point between intervals of these widths and secants: 0 where the data turn.
fn weighted_harmonic_mean([h0, h1]: [f64; 2], [before, after]: [f64; 2]) -> f64 {
    if !agree(before, after) {
        return 0.0;
    }
    let [w0, w1] = [h0 + 2.0 * h1, 2.0 * h0 + h1];
    (w0 + w1) / (w0 / before + w1 / after)
}

/// Slope at the outer end of the first of two intervals: that of the parabola through three points, limited to preserve the shape
/// (Moler, Numerical Computing with MATLAB, section 3.6).
fn end_slope([h0, h1]: [f64; 2], [near, far]: [f64; 2]) -> f64 {
    let slope = ((2.0 * h0 + h1) * near - h0 * far) / (h0 + h1);
    if !agree(slope, near) {
        0.0
    } else if !agree(near, far) && slope.abs() > 3.0 * near.abs() {
        3.0 * near
    } else {
        slope
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
    use proptest::prelude::*;

    /// Points with these widths and values.
    fn points(parts: &[(f64, f64)]) -> Vec<[f64; 2]> {
        let mut x = 0.0;
        let point = |(width, y): &(f64, f64)| {
            x += width;
            [x, *y]
        };
        parts.iter().map(point).collect()
    }

    #[test]
    fn two_points_make_a_straight_line() {
        for interpolation in Interpolation::ALL {
            let line = Interpolant::new(&[[-1.0, 3.0], [1.0, -1.0]], interpolation, Ends::Natural);
            for x in [-1.0, -0.3, 0.0, 1.0] {
                assert_eq!(line.at(x), Jet::new(1.0 - 2.0 * x, -2.0, 0.0));
            }
        }
    }

    #[test]
    fn derivatives_of_a_spline_join_at_the_points() {
        let points = [[-2.0, 0.0], [-0.5, 3.0], [0.1, 1.0], [4.0, -7.0]];
        let spline = Interpolant::new(&points, Interpolation::Spline, Ends::Natural);
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

    #[test]
    fn the_monotone_interpolant_is_that_of_other_programs() {
        // SciPy's PchipInterpolator and MATLAB's pchip have these slopes.
        let data = [[0.0, 0.0], [1.0, 1.0], [3.0, 2.0], [4.0, 6.0], [6.0, 5.0]];
        let curve = Interpolant::new(&data, Interpolation::Monotone, Ends::Natural);
        let slopes = data.map(|[x, _]| curve.at(x).rate);
        // (2 * 1 + 2) 1 - 1 * 0.5 over 3; harmonic means; 0 at the turn; the end's three-point slope against -1/2.
        let expected = [3.5 / 3.0, 9.0 / (5.0 + 4.0 / 0.5), 9.0 / (4.0 / 0.5 + 5.0 / 4.0), 0.0, -1.5];
        for (slope, expected) in slopes.into_iter().zip(expected) {
            assert!((slope - expected).abs() < 1e-12, "{slopes:?} {expected}");
        }
    }

    proptest! {
        #[test]
        fn a_monotone_interpolant_turns_only_where_its_points_do(
            parts in prop::collection::vec((1e-3..1e3_f64, -1e3..1e3_f64), 2..12),
            ends in prop::sample::select(vec![Ends::Clamped, Ends::Natural, Ends::Periodic]),
            plateau in 0..12_usize,
        ) {
            let mut points = points(&parts);
            // Two equal neighbours, and equal ends for a period.
            let (last, at) = (points.len() - 1, plateau.min(points.len() - 2));
            points[at + 1][1] = points[at][1];
            if ends == Ends::Periodic {
                points[last][1] = points[0][1];
            }
            let curve = Interpolant::new(&points, Interpolation::Monotone, ends);
            for (i, pair) in points.windows(2).enumerate() {
                let [[x0, y0], [x1, y1]] = [pair[0], pair[1]];
                let small = 1e-9 * (y0.abs() + y1.abs() + 1.0);
                let mut before = y0;
                for n in 0..=100 {
                    let y = curve.on_cubic(i, x0 + (x1 - x0) * f64::from(n) / 100.0).value;
                    prop_assert!((y - before) * (y1 - y0).signum() >= -small, "{y} after {before} between {y0} and {y1}");
                    before = y;
                }
                prop_assert!((before - y1).abs() <= small);
                // The slope is continuous.
                if i > 0 {
                    let (left, right) = (curve.on_cubic(i - 1, x0).rate, curve.on_cubic(i, x0).rate);
                    prop_assert!((left - right).abs() <= 1e-9 * (1.0 + right.abs()) * (1.0 + 1.0 / (x0 - points[i - 1][0])) * 1e3);
                }
            }
            prop_assert_eq!(curve.overshoot(), None);
            let [first, last] = curve.ends();
            match ends {
                Ends::Clamped => prop_assert!(curve.at(first).rate == 0.0),
                Ends::Periodic => {
                    let rates = (curve.at(first).rate, curve.at(last).rate);
                    prop_assert!((rates.0 - rates.1).abs() <= 1e-6 * (1.0 + rates.0.abs()), "{rates:?}");
                }
                Ends::Natural => {}
            }
        }
    }

    #[test]
    fn a_monotone_interpolant_reproduces_lines_and_converges_with_the_second_order_or_better() {
        let line = |x: f64| 2.0 - 3.0 * x;
        let uneven = [0.0, 0.1, 0.5, 0.6, 2.0].map(|x| [x, line(x)]);
        let curve = Interpolant::new(&uneven, Interpolation::Monotone, Ends::Natural);
        for n in 0..=40 {
            let x = f64::from(n) / 20.0;
            assert!((curve.at(x).value - line(x)).abs() < 1e-12, "{x}");
        }
        let error = |n: u32| {
            let data: Vec<[f64; 2]> = (0..=n).map(|i| f64::from(i) / f64::from(n)).map(|x| [x, libm::exp(x)]).collect();
            let curve = Interpolant::new(&data, Interpolation::Monotone, Ends::Natural);
            (0..1000)
                .map(|i| f64::from(i) / 1000.0)
                .map(|x| (curve.at(x).value - libm::exp(x)).abs())
                .fold(0.0, f64::max)
        };
        assert!(error(10) / error(20) > 4.0, "{} {}", error(10), error(20));
    }

    #[test]
    fn only_splines_through_sharp_turns_are_said_to_overshoot() {
        let pulse = [[0.0, 0.0], [0.1, 0.0], [0.101, 100.0], [0.2, 100.0], [0.201, 0.0], [1.0, 0.0]];
        let step = [[0.0, 0.0], [0.1, 0.0], [0.1001, 0.1], [0.3, 0.1]];
        let even_step = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0];
        let even_step: Vec<[f64; 2]> = even_step.iter().enumerate().map(|(i, y)| [i as f64, *y]).collect();
        for data in [&pulse[..], &step, &even_step] {
            for ends in [Ends::Clamped, Ends::Natural] {
                let spline = Interpolant::new(data, Interpolation::Spline, ends);
                let overshoot = spline.overshoot().expect("the spline overshoots");
                assert!(overshoot.excess() > 0.0 && (spline.at(overshoot.at).value - overshoot.value).abs() < 1e-9);
                for interpolation in [Interpolation::Monotone, Interpolation::Linear] {
                    assert_eq!(Interpolant::new(data, interpolation, ends).overshoot(), None);
                }
            }
        }
        let sampled = |f: &dyn Fn(f64) -> f64, n: u32| -> Vec<[f64; 2]> {
            (0..=n).map(|i| f64::from(i) / f64::from(n)).map(|x| [x, f(x)]).collect()
        };
        let tau = std::f64::consts::TAU;
        for n in [8, 9, 20, 100] {
            for phase in [0.0, 0.1, 0.5, 1.0, 2.0] {
                let wave = sampled(&|x| libm::sin(tau * x + phase), n);
                assert_eq!(
                    Interpolant::new(&wave, Interpolation::Spline, Ends::Periodic).overshoot(),
                    None,
                    "{n} {phase}"
                );
            }
        }
        // Rise, dwell and fall of a cam.
        let smooth = |s: f64| libm::pow(libm::sin(0.25 * tau * s.clamp(0.0, 1.0)), 2.0);
        let cam = sampled(&|x| smooth(5.0 * x) - smooth(5.0 * x - 3.0), 40);
        assert_eq!(Interpolant::new(&cam, Interpolation::Spline, Ends::Clamped).overshoot(), None);
    }
}
