//! Ranges and ticks of an axis, and the tick labels.

use super::{Axis, Scale};

/// An axis as drawn: positions are linear in [`Self::position`].
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Ruler {
    scale: Scale,
    /// Ends of the axis, as positions.
    pub from: f64,
    pub to: f64,
    /// Positions of the ticks with and without a label.
    pub ticks: Vec<f64>,
    pub minor: Vec<f64>,
    step: f64,
    /// Whether the labels are powers of ten.
    powers: bool,
}

/// Largest number of ticks on an axis.
const MAX_TICKS: f64 = 8.0;

impl Ruler {
    /// The ruler of `axis` for data at `values`.
    pub(super) fn new(axis: &Axis, values: impl Iterator<Item = f64>) -> Self {
        let scale = axis.scale;
        let position_of = |value: f64| position(scale, value);
        let (mut from, mut to) = match axis.range {
            Some((a, b)) => (position_of(a), position_of(b)),
            None => values
                .map(position_of)
                .filter(|v| v.is_finite())
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v))),
        };
        if !(from.is_finite() && to.is_finite()) {
            (from, to) = (0.0, 1.0);
        }
        if to <= from {
            let half = if from == 0.0 { 1.0 } else { 0.5 * from.abs() };
            (from, to) = (from - half, to + half);
        }
        if axis.range.is_none() {
            // Room for the markers.
            let margin = 0.04 * (to - from);
            (from, to) = (from - margin, to + margin);
        }
        let (step, minor) = match scale {
            Scale::Logarithmic => logarithmic_step(to - from),
            Scale::Linear => linear_step(to - from),
        };
        let mut ruler = Self {
            scale,
            from,
            to,
            ticks: Vec::new(),
            minor: Vec::new(),
            step,
            powers: scale == Scale::Logarithmic && (from < -3.5 || to > 4.5),
        };
        ruler.ticks = multiples(step, from, to);
        ruler.minor = match scale {
            Scale::Logarithmic if step == 1.0 => {
                let decades = multiples(1.0, from - 1.0, to);
                let inside = |p: &f64| (from..=to).contains(p);
                let all = decades.iter().flat_map(|d| (2..10).map(move |n| d + f64::from(n).log10()));
                all.filter(inside).collect()
            }
            _ => multiples(minor, from, to),
        };
        if ruler.scale == Scale::Logarithmic && ruler.ticks.len() < 2 {
            // Fewer than two powers of ten: plain numbers at 1, 2 and 5 are more informative.
            let inside = |p: &f64| (from..=to).contains(p);
            let first = from.floor() as i32;
            let places =
                (first..=to.ceil() as i32).flat_map(|d| [1.0, 2.0, 5.0].map(|m: f64| f64::from(d) + m.log10()));
            ruler.ticks = places.filter(inside).collect();
        }
        ruler
    }

    /// Position of `value`; not finite where the axis has none.
    pub(super) fn position(&self, value: f64) -> f64 {
        position(self.scale, value)
    }

    /// Label of a tick.
    pub(super) fn label(&self, tick: f64) -> String {
        match self.scale {
            Scale::Logarithmic => {
                let whole = (tick + 1e-9).floor();
                let mantissa = 10f64.powf(tick - whole).round();
                match (self.powers, mantissa == 1.0) {
                    (false, _) => plain(mantissa * 10f64.powf(whole), (-whole).max(0.0) as usize),
                    (true, true) => power_of_ten(whole as i32),
                    (true, false) => {
                        format!("{}·{}", plain(mantissa, 0), power_of_ten(whole as i32))
                    }
                }
            }
            Scale::Linear => {
                let decimals = (-self.step.log10().floor()).clamp(0.0, 12.0) as usize;
                let tick = if tick.abs() < 1e-9 * self.step { 0.0 } else { tick };
                plain(tick, decimals)
            }
        }
    }
}

fn position(scale: Scale, value: f64) -> f64 {
    match scale {
        Scale::Linear => value,
        Scale::Logarithmic if value > 0.0 => value.log10(),
        Scale::Logarithmic => f64::NAN,
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
fn linear_step(span: f64) -> (f64, f64) {
    let least = span / MAX_TICKS;
    let unit = 10f64.powf(least.log10().floor());
    let factor = [1.0, 2.0, 5.0, 10.0].into_iter().find(|f| f * unit >= least).unwrap_or(10.0);
    let parts = if factor == 2.0 { 4.0 } else { 5.0 };
    (factor * unit, factor * unit / parts)
}

/// The same for a logarithmic axis, in decades.
fn logarithmic_step(span: f64) -> (f64, f64) {
    let step = (span / MAX_TICKS).ceil().max(1.0);
    (step, 1.0)
}

fn plain(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text };
    // A true minus sign is as wide as a digit.
    text.replace('-', "\u{2212}")
}

/// `10⁻³`.
fn power_of_ten(exponent: i32) -> String {
    let mut word = String::from("10");
    for digit in exponent.to_string().chars() {
        word.push(match digit {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            digit => char::from_u32('⁰' as u32 + digit as u32 - '0' as u32).unwrap_or(digit),
        });
    }
    word
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
        let log = Axis { scale: Scale::Logarithmic, ..Axis::default() };
        assert_eq!(words(&log, &[1e-3, 20.0]), ["0.001", "0.01", "0.1", "1", "10"]);
        assert_eq!(words(&log, &[1e-12, 1e-2]), ["10⁻¹²", "10⁻¹⁰", "10⁻⁸", "10⁻⁶", "10⁻⁴", "10⁻²"]);
        assert_eq!(words(&log, &[3.0, 6.0]), ["5"]);
        assert_eq!(words(&log, &[3e5, 6e5]), ["5·10⁵"]);
    }

    #[test]
    fn an_axis_without_data_has_ticks() {
        for values in [&[][..], &[f64::NAN], &[3.0], &[0.0], &[-1.0]] {
            for scale in [Scale::Linear, Scale::Logarithmic] {
                let axis = Axis { scale, ..Axis::default() };
                let ruler = Ruler::new(&axis, values.iter().copied());
                assert!(ruler.to > ruler.from, "{values:?}");
                assert!(!ruler.ticks.is_empty(), "{values:?} {scale:?}");
            }
        }
    }
}
