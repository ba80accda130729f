//! Statistics of a sample, such as a manufactured lot: percentiles, yield, process capability, and what drives the rejects.

use crate::normal;

/// Reasons for rejecting a sample or the settings of a statistic.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum YieldsError {
    /// Too few values.
    #[error("too few values: {count} of at least {least}")]
    TooFew {
        /// Number of values.
        count: usize,
        /// Least number.
        least: usize,
    },
    /// A value that is not finite.
    #[error("value {index} is {value}: only finite values can be evaluated")]
    NotFinite {
        /// Index of the value.
        index: usize,
        /// The value.
        value: f64,
    },
    /// A probability out of range.
    #[error("{name} {value}: expected a number above 0 and below 1")]
    Probability {
        /// Name of the setting: `percentile` or `confidence`.
        name: &'static str,
        /// The given value.
        value: f64,
    },
    /// All values are the same.
    #[error("all values are {value}: there is no spread")]
    NoSpread {
        /// The value.
        value: f64,
    },
    /// More units accepted than made.
    #[error("{accepted} of {made} accepted")]
    Counts {
        /// Accepted units.
        accepted: usize,
        /// All units.
        made: usize,
    },
    /// No limit, or limits in the wrong order.
    #[error("capability needs a lower or an upper limit, and the lower one below the upper one")]
    Limits,
    /// An input without a value for each unit.
    #[error("input {input} has {values} values for {units} units")]
    Lengths {
        /// Index of the input.
        input: usize,
        /// Number of its values.
        values: usize,
        /// Number of units.
        units: usize,
    },
}

/// An estimate with a confidence interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Best value.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
}

/// Quantile of a sorted, non-empty sample by linear interpolation, with value k of n at the probability (k - 1) / (n - 1)
/// (Hyndman & Fan 1996, definition 7).
pub(crate) fn interpolated_quantile(sorted: &[f64], p: f64) -> f64 {
    let last = sorted.len() - 1;
    let position = p.clamp(0.0, 1.0) * last as f64;
    let below = (position as usize).min(last);
    let above = (below + 1).min(last);
    sorted[below] + (position - below as f64) * (sorted[above] - sorted[below])
}

/// Mean and sample standard deviation of the values; the deviation of a single value is NaN.
pub fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
    (mean, (squares / (n - 1.0)).sqrt())
}

fn check_probability(name: &'static str, value: f64) -> Result<(), YieldsError> {
    if value > 0.0 && value < 1.0 { Ok(()) } else { Err(YieldsError::Probability { name, value }) }
}

fn check_values(values: &[f64], least: usize) -> Result<(), YieldsError> {
    if values.len() < least {
        return Err(YieldsError::TooFew { count: values.len(), least });
    }
    match values.iter().enumerate().find(|(_, value)| !value.is_finite()) {
        Some((index, &value)) => Err(YieldsError::NotFinite { index, value }),
        None => Ok(()),
    }
}

/// The value that the fraction `p` of the lot does not exceed. Its confidence interval lies between two order statistics and is
/// valid for any distribution (David & Nagaraja 2003, "Order statistics", section 7.1). An end is infinite where the sample is
/// too small to bound it: an upper end for the 99 % percentile at 95 % confidence takes 368 values.
///
/// # Errors
/// No values, or a value that is not finite; a probability that is not between 0 and 1.
pub fn percentile(values: &[f64], p: f64, confidence: f64) -> Result<Estimate, YieldsError> {
    check_probability("percentile", p)?;
    check_probability("confidence", confidence)?;
    check_values(values, 1)?;
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    let tail = 0.5 * (1.0 - confidence);
    // The number of values below the percentile is binomial. The r-th smallest value is above the percentile if fewer than r
    // values are below it.
    let mass = binomial(n, p);
    let mut below = 0.0;
    let mut lower = 0;
    while lower < n && below + mass[lower] <= tail {
        below += mass[lower];
        lower += 1;
    }
    let mut above = 0.0;
    let mut upper = n + 1;
    while upper > 1 && above + mass[upper - 1] <= tail {
        above += mass[upper - 1];
        upper -= 1;
    }
    Ok(Estimate {
        value: interpolated_quantile(&sorted, p),
        low: if lower > 0 { sorted[lower - 1] } else { f64::NEG_INFINITY },
        high: if upper <= n { sorted[upper - 1] } else { f64::INFINITY },
    })
}

/// Binomial distribution: probabilities of 0 to `n` successes in `n` trials that succeed with probability `p`. The recurrence
/// runs outwards from the most likely number, so that its start does not underflow.
fn binomial(n: usize, p: f64) -> Vec<f64> {
    let mode = (((n + 1) as f64 * p) as usize).min(n);
    let log_factorial = |k: usize| libm::lgamma(k as f64 + 1.0);
    let log_choices = log_factorial(n) - log_factorial(mode) - log_factorial(n - mode);
    let mut mass = vec![0.0; n + 1];
    mass[mode] = libm::exp(log_choices + mode as f64 * libm::log(p) + (n - mode) as f64 * libm::log1p(-p));
    let odds = p / (1.0 - p);
    for k in mode..n {
        mass[k + 1] = mass[k] * odds * (n - k) as f64 / (k + 1) as f64;
    }
    for k in (0..mode).rev() {
        mass[k] = mass[k + 1] / odds * (k + 1) as f64 / (n - k) as f64;
    }
    mass
}

/// Fraction of accepted units, with the interval of Wilson 1927 ("Probable inference, the law of succession, and statistical
/// inference", J. Am. Stat. Assoc. 22, 209-212), which is valid near 0 and 1, too.
///
/// # Errors
/// No units, more accepted than made, or a confidence that is not between 0 and 1.
pub fn yield_fraction(accepted: usize, made: usize, confidence: f64) -> Result<Estimate, YieldsError> {
    check_probability("confidence", confidence)?;
    if made == 0 {
        return Err(YieldsError::TooFew { count: 0, least: 1 });
    }
    if accepted > made {
        return Err(YieldsError::Counts { accepted, made });
    }
    let z = normal::quantile(0.5 * (1.0 + confidence));
    let n = made as f64;
    let value = accepted as f64 / n;
    let ratio = z * z / n;
    let centre = (value + 0.5 * ratio) / (1.0 + ratio);
    let half = z * (value * (1.0 - value) / n + 0.25 * ratio / n).sqrt() / (1.0 + ratio);
    // At 0 and 1 the formula gives the exact end apart from rounding.
    let low = if accepted == 0 { 0.0 } else { centre - half };
    let high = if accepted == made { 1.0 } else { centre + half };
    Ok(Estimate { value, low, high })
}

/// Process capability indices of normally distributed values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capability {
    /// Mean of the values.
    pub mean: f64,
    /// Sample standard deviation.
    pub deviation: f64,
    /// Cp: distance between the limits over six standard deviations; `None` with only one limit.
    pub cp: Option<f64>,
    /// Cpk: distance of the mean from the nearer limit over three standard deviations, with the interval of Bissell 1990 ("How
    /// reliable is your capability index?", Applied Statistics 39, 331-340).
    pub cpk: Estimate,
}

/// Process capability for a lower limit, an upper limit or both (ISO 22514-2). The indices say nothing about the yield if the
/// values are not normally distributed.
///
/// # Errors
/// Fewer than two values, a value that is not finite, or no spread; no limits, or limits in the wrong order; a confidence that
/// is not between 0 and 1.
pub fn capability(
    values: &[f64],
    lower: Option<f64>,
    upper: Option<f64>,
    confidence: f64,
) -> Result<Capability, YieldsError> {
    check_probability("confidence", confidence)?;
    check_values(values, 2)?;
    let ordered = lower.zip(upper).is_none_or(|(lower, upper)| lower < upper);
    if (lower.is_none() && upper.is_none())
        || !ordered
        || lower.is_some_and(f64::is_nan)
        || upper.is_some_and(f64::is_nan)
    {
        return Err(YieldsError::Limits);
    }
    let (mean, deviation) = mean_and_deviation(values);
    if values.iter().all(|&value| value == values[0]) {
        return Err(YieldsError::NoSpread { value: values[0] });
    }
    let margins = [lower.map(|lower| mean - lower), upper.map(|upper| upper - mean)];
    let nearer = margins.into_iter().flatten().fold(f64::INFINITY, f64::min);
    let cpk = nearer / (3.0 * deviation);
    let n = values.len() as f64;
    let z = normal::quantile(0.5 * (1.0 + confidence));
    let half = z * (1.0 / (9.0 * n) + cpk * cpk / (2.0 * (n - 1.0))).sqrt();
    Ok(Capability {
        mean,
        deviation,
        cp: lower.zip(upper).map(|(lower, upper)| (upper - lower) / (6.0 * deviation)),
        cpk: Estimate { value: cpk, low: cpk - half, high: cpk + half },
    })
}

/// How one input differs between rejected and accepted units (regional sensitivity analysis: Spear & Hornberger 1980,
/// "Eutrophication in Peel Inlet II", Water Research 14, 43-49).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RejectDriver {
    /// Mean over the rejected units minus mean over the accepted, in standard deviations of all units; 0 for an input without
    /// spread.
    pub mean_shift: f64,
    /// Kolmogorov-Smirnov distance between the two distributions, 0 to 1. It also detects an input whose rejects lie at both
    /// ends.
    pub distance: f64,
    /// Probability of a distance at least as large if the input has no influence. With k inputs, compare it with the
    /// significance level divided by k.
    pub p_value: f64,
}

/// How the rejected units differ from the accepted ones in each input. `inputs` holds one list of values per input, `accepted`
/// one flag per unit. `None` if all units or none are accepted.
///
/// # Errors
/// An input without a value for each unit, or with a value that is not finite.
pub fn reject_drivers(inputs: &[Vec<f64>], accepted: &[bool]) -> Result<Option<Vec<RejectDriver>>, YieldsError> {
    for (input, values) in inputs.iter().enumerate() {
        if values.len() != accepted.len() {
            return Err(YieldsError::Lengths { input, values: values.len(), units: accepted.len() });
        }
        check_values(values, 0)?;
    }
    if accepted.windows(2).all(|pair| pair[0] == pair[1]) {
        return Ok(None);
    }
    Ok(Some(inputs.iter().map(|values| reject_driver(values, accepted)).collect()))
}

fn reject_driver(values: &[f64], accepted: &[bool]) -> RejectDriver {
    let mut units: Vec<(f64, bool)> = values.iter().copied().zip(accepted.iter().copied()).collect();
    units.sort_by(|a, b| a.0.total_cmp(&b.0));
    let good = accepted.iter().filter(|&&accepted| accepted).count() as f64;
    let bad = accepted.len() as f64 - good;
    let mean_of = |group: bool, count: f64| {
        let members = values.iter().zip(accepted).filter(|(_, accepted)| **accepted == group);
        members.map(|(value, _)| value).sum::<f64>() / count
    };
    let (_, deviation) = mean_and_deviation(values);
    let shift = mean_of(false, bad) - mean_of(true, good);
    let has_spread = units[0].0 < units[units.len() - 1].0;
    // Difference of the two empirical distribution functions after each distinct value.
    let (mut good_below, mut bad_below, mut distance) = (0.0, 0.0, 0.0_f64);
    for same in units.chunk_by(|a, b| a.0 == b.0) {
        let good_here = same.iter().filter(|(_, accepted)| *accepted).count() as f64;
        good_below += good_here;
        bad_below += same.len() as f64 - good_here;
        distance = distance.max((good_below / good - bad_below / bad).abs());
    }
    RejectDriver {
        mean_shift: if has_spread { shift / deviation } else { 0.0 },
        distance,
        p_value: if has_spread { kolmogorov_p_value(distance, good * bad / (good + bad)) } else { 1.0 },
    }
}

/// Probability of a Kolmogorov-Smirnov distance of at least `distance` between two samples of the same distribution, with the
/// effective size `n` = n1 n2 / (n1 + n2): Kolmogorov's limit with the correction of Stephens 1970 ("Use of the
/// Kolmogorov-Smirnov, Cramér-von Mises and related statistics without extensive tables", J. R. Stat. Soc. B 32, 115-122), good
/// for n from about 4.
fn kolmogorov_p_value(distance: f64, n: f64) -> f64 {
    let lambda = (n.sqrt() + 0.12 + 0.11 / n.sqrt()) * distance;
    if lambda < 0.2 {
        // Differs from 1 by less than 1e-12.
        return 1.0;
    }
    if lambda < 1.18 {
        // The theta function's other series, which converges fast where the first does not.
        let terms = (1..=4).map(|j| {
            let odd = f64::from(2 * j - 1) * std::f64::consts::PI;
            libm::exp(-odd * odd / (8.0 * lambda * lambda))
        });
        return 1.0 - (2.0 * std::f64::consts::PI).sqrt() / lambda * terms.sum::<f64>();
    }
    let terms = (1..=4).map(|j| {
        let term = libm::exp(-2.0 * f64::from(j * j) * lambda * lambda);
        if j % 2 == 1 { term } else { -term }
    });
    2.0 * terms.sum::<f64>()
}

#[cfg(test)]
mod tests;
