//! Ranges and ticks of an axis, and the tick labels.

use super::Axis;
use crate::session::value;

/// An axis as drawn.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Ruler {
    /// Ends of the axis.
    pub from: f64,
    pub to: f64,
    /// Ticks with and without a label.
    pub ticks: Vec<f64>,
    pub minor: Vec<f64>,
    step: f64,
}

/// Largest number of ticks on an axis.
const MAX_TICKS: f64 = 8.0;

impl Ruler {
    /// The ruler of `axis` for data at `values`.
    pub(super) fn new(axis: &Axis, values: impl Iterator<Item = f64>) -> Self {
        let (mut from, mut to) = axis.range.unwrap_or_else(|| {
            let finite = values.filter(|value| value.is_finite());
            finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), value| (a.min(value), b.max(value)))
        });
        if !(from.is_finite() && to.is_finite()) {
            (from, to) = (0.0, 1.0);
        }
        if to <= from {
            let half = if from == 0.0 { 1.0 } else { 0.5 * from.abs() };
            (from, to) = (from - half, to + half);
        }
        if axis.range.is_none() {
            let margin = 0.04 * (to - from);
            (from, to) = (from - margin, to + margin);
        }
        let (step, minor) = steps(to - from);
        Self { from, to, ticks: multiples(step, from, to), minor: multiples(minor, from, to), step }
    }

    /// Label of a tick.
    pub(super) fn label(&self, tick: f64) -> String {
        let most = self.from.abs().max(self.to.abs());
        let text = value::mark(tick, self.step, (1e-4..1e9).contains(&most));
        // A true minus sign is as wide as a digit.
        text.replace('-', "\u{2212}")
    }
}

/// Multiples of `step` in `from..=to`.
fn multiples(step: f64, from: f64, to: f64) -> Vec<f64> {
    let slack = 1e-9 * step;
    let first = ((from - slack) / step).ceil() as i64;
    let last = ((to + slack) / step).floor() as i64;
    (first..=last).map(|n| n as f64 * step).collect()
}

/// Step between major ticks, and between minor ones: 1, 2 or 5 times a power of ten.
fn steps(span: f64) -> (f64, f64) {
    let least = span / MAX_TICKS;
    let unit = 10f64.powf(least.log10().floor());
    let factor = [1.0, 2.0, 5.0, 10.0].into_iter().find(|f| f * unit >= least).unwrap_or(10.0);
    let parts = if factor == 2.0 { 4.0 } else { 5.0 };
    (factor * unit, factor * unit / parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(axis: &Axis, values: &[f64]) -> Vec<String> {
        let ruler = Ruler::new(axis, values.iter().copied());
        ruler.ticks.iter().map(|&tick| ruler.label(tick)).collect()
    }

    #[test]
    fn ticks_are_round_numbers() {
        let linear = Axis::default();
        assert_eq!(words(&linear, &[0.0, 0.7]), ["0", "0.1", "0.2", "0.3", "0.4", "0.5", "0.6", "0.7"]);
        assert_eq!(words(&linear, &[-300.0, 500.0]), ["\u{2212}200", "0", "200", "400"]);
    }

    #[test]
    fn large_and_small_ticks_are_read_without_counting_zeros() {
        let linear = Axis::default();
        let thousands = ["0", "5000", "10\u{202f}000", "15\u{202f}000"];
        assert_eq!(words(&linear, &[0.0, 17_000.0])[..4], thousands);
        assert_eq!(words(&linear, &[0.0, 3e-7])[..3], ["0", "5×10^\u{2212}8", "1.0×10^\u{2212}7"]);
    }

    #[test]
    fn an_axis_without_data_has_ticks() {
        for values in [&[][..], &[f64::NAN], &[3.0], &[0.0], &[-1.0]] {
            let ruler = Ruler::new(&Axis::default(), values.iter().copied());
            assert!(ruler.to > ruler.from, "{values:?}");
            assert!(!ruler.ticks.is_empty(), "{values:?}");
        }
    }
}
