//! Force of a spring by its stretch, or of a damper by its rate: a straight line, or a curve through points, straight beyond them. On
//! a curve of straight lines, the slope jumps at the inner points, its kinks. A one-sided spring exerts only the part of one sign.

use super::EdgeIndicator;
use crate::interpolate::{Ends, Interpolant, Interpolation};
use crate::jet::Jet;
use crate::machine::{self, SpringSide};

/// Upper bound on the magnitude of a stretch, m or rad.
const MAX_STRETCH: f64 = 1e7;

/// Elastic and damping force of a spring.
pub(super) struct SpringDamper {
    elastic: Characteristic,
    damping: Characteristic,
    /// Number of kinks that each has passed, frozen over a step, if it is.
    segments: [Option<usize>; 2],
}

impl SpringDamper {
    /// For a spring that acts on `side`.
    pub fn new(elastic: &machine::Characteristic, damping: &machine::Characteristic, side: SpringSide) -> Self {
        let [elastic, damping] =
            [(elastic, side), (damping, SpringSide::Both)].map(|(given, side)| Characteristic::new(given, side));
        Self { elastic, damping, segments: [None; 2] }
    }

    /// Elastic and damping force at a stretch, m or rad, and its rate, each with its slope; ignoring one-sidedness.
    #[inline]
    pub fn at(&self, [stretch, rate]: [f64; 2]) -> [Jet; 2] {
        let [elastic, damping] = self.segments;
        [self.elastic.at(stretch, elastic), self.damping.at(rate, damping)]
    }

    /// Energy stored at a stretch, J.
    pub fn stored(&self, stretch: f64) -> f64 {
        self.elastic.stored(stretch)
    }

    /// Whether the slope of either jumps anywhere.
    pub fn has_kinks(&self) -> bool {
        [&self.elastic, &self.damping].iter().any(|part| !part.kinks().is_empty())
    }

    /// Position of each part among its kinks, if it has any.
    pub fn edges(&self, [stretch, rate]: [f64; 2]) -> [Option<EdgeIndicator>; 2] {
        [(&self.elastic, stretch), (&self.damping, rate)].map(|(part, at)| part.segment(at).map(EdgeIndicator::Segment))
    }

    /// Freezes each part on its smooth continuation from its side of its kinks.
    pub fn freeze(&mut self, sides: [Option<EdgeIndicator>; 2]) {
        self.segments = sides.map(|side| side.map(|side| side.side() as usize));
    }
}

enum Characteristic {
    Line {
        /// At 0, N or N m.
        offset: f64,
        /// N/m or N m/rad, N s/m or N m s/rad.
        slope: f64,
        side: SpringSide,
    },
    Curve(Curve),
}

impl Characteristic {
    /// For a spring that acts on `side`.
    fn new(given: &machine::Characteristic, side: SpringSide) -> Self {
        match *given {
            machine::Characteristic::Line { offset, slope } => Self::Line { offset, slope, side },
            machine::Characteristic::Curve { ref points, interpolation } => {
                Self::Curve(Curve::new(points, interpolation, side))
            }
        }
    }

    /// Force at `x`, N or N m, and its slope, ignoring one-sidedness; on the line that follows the `segment`th kink, even beyond
    /// its ends, if that is given.
    #[inline]
    fn at(&self, x: f64, segment: Option<usize>) -> Jet {
        match self {
            Self::Line { offset, slope, .. } => Jet::new(offset + slope * x, *slope, 0.0),
            Self::Curve(curve) => segment.map_or_else(|| curve.at(x), |segment| curve.on_segment(segment, x)),
        }
    }

    /// Values of x at which the slope jumps.
    fn kinks(&self) -> &[f64] {
        match self {
            Self::Line { .. } => &[],
            Self::Curve(curve) => curve.kinks(),
        }
    }

    /// Number of kinks below `x`, plus a fraction that grows from 0 to 1 up to the next kink; `None` without kinks.
    fn segment(&self, x: f64) -> Option<f64> {
        let kinks = self.kinks();
        let below = kinks.partition_point(|kink| *kink <= x);
        let fraction = match (kinks[..below].last(), kinks.get(below)) {
            (Some(left), Some(right)) => (x - left) / (right - left),
            // Towards 1 at the kink, and towards 1 at infinity.
            (None, Some(right)) => 1.0 / (1.0 + (right - x)),
            (Some(left), None) => 1.0 - 1.0 / (1.0 + (x - left)),
            (None, None) => return None,
        };
        Some(below as f64 + fraction)
    }

    /// Stored energy, J: the work done from zero stretch.
    fn stored(&self, stretch: f64) -> f64 {
        match self {
            Self::Line { offset, slope, side } => {
                let elastic = offset + slope * stretch;
                // A slack spring stores the energy that it had where it went slack.
                let stretch = match side.of(elastic) == elastic || *slope == 0.0 {
                    true => stretch,
                    false => -offset / slope,
                };
                stretch * (offset + 0.5 * slope * stretch)
            }
            Self::Curve(curve) => curve.stored(stretch),
        }
    }
}

/// Force given as a curve.
struct Curve {
    interpolant: Interpolant,
    /// Whether the slope jumps at the inner points.
    has_kinks: bool,
    /// Stretches at which the cubic changes or a one-sided spring starts or ceases to act, in ascending order, each with the
    /// energy stored there, J.
    breakpoints: Vec<[f64; 2]>,
    /// Whether the spring acts before the first breakpoint, between each two, and after the last.
    is_active: Vec<bool>,
}

impl Curve {
    fn new(points: &[[f64; 2]], interpolation: Interpolation, side: SpringSide) -> Self {
        let mut curve = Self {
            interpolant: Interpolant::new(points, interpolation, Ends::Natural),
            has_kinks: interpolation == Interpolation::Linear,
            breakpoints: Vec::new(),
            is_active: Vec::new(),
        };
        let mut breakpoints = curve.interpolant.knots.clone();
        if side != SpringSide::Both {
            breakpoints.extend(curve.roots());
            breakpoints.sort_by(f64::total_cmp);
            breakpoints.dedup();
        }
        let is_active = |stretch: f64| {
            let tension = curve.at(stretch).value;
            side.of(tension) == tension
        };
        let between = breakpoints.windows(2).map(|ends| 0.5 * (ends[0] + ends[1]));
        let [first, last] = [breakpoints[0], breakpoints[breakpoints.len() - 1]];
        let width = last - first;
        curve.is_active = std::iter::once(first - width).chain(between).chain([last + width]).map(is_active).collect();
        let mut stored = 0.0;
        for (i, &breakpoint) in breakpoints.iter().enumerate() {
            if i > 0 && curve.is_active[i] {
                stored += curve.work(breakpoints[i - 1], breakpoint);
            }
            curve.breakpoints.push([breakpoint, stored]);
        }
        let unstretched = curve.stored(0.0);
        curve.breakpoints.iter_mut().for_each(|breakpoint| breakpoint[1] -= unstretched);
        curve
    }

    /// Tension and its derivatives with respect to the stretch.
    fn at(&self, stretch: f64) -> Jet {
        let [first, last] = self.interpolant.ends();
        let within = stretch.clamp(first, last);
        let at = self.interpolant.at(within);
        if stretch == within {
            return at;
        }
        Jet::new(at.value + at.rate * (stretch - within), at.rate, 0.0)
    }

    /// The same on the line that follows this number of kinks, even beyond its ends.
    fn on_segment(&self, segment: usize, stretch: f64) -> Jet {
        self.interpolant.on_cubic(segment.min(self.kinks().len()), stretch)
    }

    /// Stretches at which the slope jumps. The lines beyond the first and the last point continue those between points.
    fn kinks(&self) -> &[f64] {
        let knots = &self.interpolant.knots;
        if self.has_kinks { &knots[1..knots.len() - 1] } else { &[] }
    }

    fn stored(&self, stretch: f64) -> f64 {
        let next = self.breakpoints.partition_point(|breakpoint| breakpoint[0] <= stretch);
        let [breakpoint, stored] = self.breakpoints[next.saturating_sub(1)];
        match self.is_active[next] {
            true => stored + self.work(breakpoint, stretch),
            false => stored,
        }
    }

    /// Work of stretching from `a` to `b` within one interval of the breakpoints, J. Simpson's rule is exact for a cubic.
    fn work(&self, a: f64, b: f64) -> f64 {
        let [at_a, middle, at_b] = [a, 0.5 * (a + b), b].map(|stretch| self.at(stretch).value);
        (b - a) * (at_a + 4.0 * middle + at_b) / 6.0
    }

    /// Stretches at which the tension changes sign.
    fn roots(&self) -> Vec<f64> {
        let mut roots = Vec::new();
        // The tension is monotonic between these.
        let mut ends = Vec::new();
        for i in 0..self.interpolant.cubics.len() {
            ends.push(self.interpolant.knots[i]);
            ends.extend(self.interpolant.turns(i));
        }
        let [first, last] = self.interpolant.ends();
        ends.push(last);
        for pair in ends.windows(2) {
            roots.extend(self.root(pair[0], pair[1]));
        }
        // The straight extensions.
        let crossing = |knot: f64| knot - self.at(knot).value / self.at(knot).rate;
        roots.extend(Some(crossing(first)).filter(|at| (-MAX_STRETCH..first).contains(at)));
        roots.extend(Some(crossing(last)).filter(|at| last < *at && *at < MAX_STRETCH));
        roots
    }

    /// Zero of the tension between `a` and `b`, where it is monotonic.
    fn root(&self, mut a: f64, mut b: f64) -> Option<f64> {
        let above = |stretch: f64| self.at(stretch).value > 0.0;
        let at_a = above(a);
        if at_a == above(b) {
            return None;
        }
        // Bisects until the two are adjacent floating-point numbers.
        loop {
            let middle = 0.5 * (a + b);
            if middle <= a || middle >= b {
                return Some(b);
            }
            match above(middle) == at_a {
                true => a = middle,
                false => b = middle,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const POINTS: [[f64; 2]; 5] = [[-0.04, -90.0], [-0.02, 5.0], [-0.01, -8.0], [0.01, 6.0], [0.03, 70.0]];

    #[test]
    fn the_energy_is_the_integral_of_the_acting_tension() {
        let sides = [SpringSide::Both, SpringSide::Push, SpringSide::Pull];
        for (interpolation, side) in Interpolation::ALL.into_iter().flat_map(|way| sides.map(|side| (way, side))) {
            let curve = Curve::new(&POINTS, interpolation, side);
            assert!(curve.stored(0.0).abs() < 1e-15);
            for to in [-0.07, -0.033, -0.0201, -0.015, 0.002, 0.02, 0.05] {
                let n = 400_000;
                let h = to / f64::from(n);
                let tension = |i: u32| side.of(curve.at((f64::from(i) + 0.5) * h).value);
                let integral: f64 = (0..n).map(|i| h * tension(i)).sum();
                let off = curve.stored(to) - integral;
                assert!(off.abs() < 1e-9, "{interpolation} {side:?} {to}: {off:e}");
            }
        }
    }

    #[test]
    fn a_curve_continues_straight_beyond_its_points() {
        for interpolation in Interpolation::ALL {
            let curve = Curve::new(&POINTS, interpolation, SpringSide::Both);
            for (end, beyond) in [(-0.04, -0.1), (0.03, 0.2)] {
                let (at, there) = (curve.at(end), curve.at(beyond));
                let expected = at.value + at.rate * (beyond - end);
                assert_eq!((there.value, there.rate), (expected, at.rate));
            }
        }
    }

    #[test]
    fn all_zeros_of_the_tension_are_found() {
        for interpolation in Interpolation::ALL {
            let curve = Curve::new(&POINTS, interpolation, SpringSide::Push);
            let mut roots = curve.roots();
            roots.sort_by(f64::total_cmp);
            // One zero in each of the first three intervals.
            assert_eq!(roots.len(), 3, "{roots:?}");
            for root in roots {
                assert!(curve.at(root).value.abs() < 1e-9, "{root}");
            }
            // A zero beyond the points.
            let line = Curve::new(&[[0.0, 1.0], [1.0, 3.0]], interpolation, SpringSide::Push);
            assert_eq!(line.roots(), [-0.5]);
            assert_eq!(line.is_active, [true, false, false, false]);
        }
    }

    #[test]
    fn segments_of_straight_lines_are_numbered_and_frozen_lines_go_on() {
        let elastic = Characteristic::Curve(Curve::new(&POINTS, Interpolation::Linear, SpringSide::Both));
        for (stretch, segment) in
            [(-1e6, 0), (-0.03, 0), (-0.02, 1), (-0.011, 1), (-0.01, 2), (0.0, 2), (0.02, 3), (1e6, 3)]
        {
            assert_eq!(elastic.segment(stretch).unwrap().floor(), f64::from(segment), "{stretch}");
        }
        // The line from (-0.01, -8) to (0.01, 6).
        let frozen = elastic.at(0.03, Some(2));
        assert!((frozen.value - 20.0).abs() < 1e-12 && (frozen.rate - 700.0).abs() < 1e-9);
        for (points, interpolation) in [(&POINTS[..], Interpolation::Monotone), (&POINTS[..2], Interpolation::Linear)] {
            let smooth = Characteristic::Curve(Curve::new(points, interpolation, SpringSide::Both));
            assert!(smooth.kinks().is_empty() && smooth.segment(0.0).is_none());
        }
    }
}
