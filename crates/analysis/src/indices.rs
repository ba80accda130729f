//! Variance-based sensitivity indices (Sobol' 1993) with the design of Saltelli et al. 2010, "Variance based sensitivity
//! analysis of model output", Computer Physics Communications 181, 259-270.

use crate::random::{Purpose, RandomStream};
use crate::sampling::{MAX_DIMENSIONS, MAX_POINTS, Sampler, Sampling, SamplingError};
use crate::yields::{Estimate, interpolated_quantile};

/// Least number of complete rows from which indices are estimated.
pub const MIN_ROWS: usize = 8;
/// Least number of bootstrap resamples for an interval.
const MIN_RESAMPLES: usize = 100;

/// Reasons for rejecting a design, its results or the settings of the intervals.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IndicesError {
    /// No inputs or too many.
    #[error("{inputs} inputs: expected 1 to {}", MAX_DIMENSIONS / 2)]
    Inputs {
        /// Number of inputs.
        inputs: usize,
    },
    /// Too many points.
    #[error("{rows} rows of {inputs} inputs: expected at least one row and at most {MAX_POINTS} points in all")]
    Size {
        /// Number of inputs.
        inputs: usize,
        /// Number of rows.
        rows: usize,
    },
    /// An error of the underlying sample.
    #[error(transparent)]
    Sampling(#[from] SamplingError),
    /// A number of results that does not match the design.
    #[error("the design has {points} points, but {results} results are given")]
    Results {
        /// Number of results.
        results: usize,
        /// Number of points.
        points: usize,
    },
    /// Too few rows with all their results.
    #[error("{complete} of {rows} rows have all their results: at least {MIN_ROWS} are needed")]
    TooFewRows {
        /// Complete rows.
        complete: usize,
        /// All rows.
        rows: usize,
    },
    /// The result is the same at all points, apart from rounding.
    #[error("the variance of the result is 0: it is {value}, whatever the inputs")]
    NoVariance {
        /// The result.
        value: f64,
    },
    /// Settings of the intervals out of range.
    #[error(
        "{resamples} resamples, confidence {confidence}: at least {MIN_RESAMPLES} and a confidence between 0 and 1 are needed"
    )]
    Interval {
        /// Number of resamples.
        resamples: usize,
        /// Confidence.
        confidence: f64,
    },
}

/// A design of N (k + 2) points for k inputs. Row j holds, in this order, point j of the sample A, point j of the sample B, and
/// for each input i the point of A with coordinate i taken from B. A and B are the two halves of the coordinates of one sample
/// in 2 k dimensions. Points are numbered row by row; each is computed from its index alone. With a Sobol sequence or a random
/// sample, the first rows form a smaller design.
#[derive(Clone, Debug)]
pub struct SaltelliDesign {
    inputs: usize,
    sampler: Sampler,
}

/// How the confidence intervals are estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bootstrap {
    /// Number of resamples.
    pub resamples: usize,
    /// Probability that an interval covers the index.
    pub confidence: f64,
    /// Seed of the resampling.
    pub seed: u64,
}

impl Default for Bootstrap {
    /// 1000 resamples, 95 % confidence.
    fn default() -> Self {
        Self { resamples: 1000, confidence: 0.95, seed: 0 }
    }
}

/// Sensitivity of a result to each input.
#[derive(Clone, Debug, PartialEq)]
pub struct SensitivityIndices {
    /// Mean of the result over A and B.
    pub mean: f64,
    /// Variance of the result over A and B.
    pub variance: f64,
    /// First-order index of each input: the share of the variance that vanishes on average when the input is fixed.
    pub first: Vec<Estimate>,
    /// Total index of each input: the share that remains on average when all other inputs are fixed.
    pub total: Vec<Estimate>,
    /// Number of evaluated rows.
    pub rows: usize,
    /// Number of rows left out because a result is missing.
    pub incomplete_rows: usize,
}

impl SaltelliDesign {
    /// A design of `rows` rows, N (k + 2) points. With a Sobol sequence, `rows` should be a power of two.
    ///
    /// # Errors
    /// No inputs, more than 64, no rows, or too many points.
    pub fn new(sampling: Sampling, inputs: usize, rows: usize, seed: u64) -> Result<Self, IndicesError> {
        if !(1..=MAX_DIMENSIONS / 2).contains(&inputs) {
            return Err(IndicesError::Inputs { inputs });
        }
        if rows == 0 || rows > MAX_POINTS / (inputs + 2) {
            return Err(IndicesError::Size { inputs, rows });
        }
        Ok(Self { inputs, sampler: Sampler::new(sampling, 2 * inputs, rows, seed)? })
    }

    /// Number of points, N (k + 2).
    pub fn points(&self) -> usize {
        self.sampler.points() * (self.inputs + 2)
    }

    /// Point `index`, each coordinate in (0, 1); `None` beyond the last.
    pub fn point(&self, index: usize) -> Option<Vec<f64>> {
        let (row, column) = (index / (self.inputs + 2), index % (self.inputs + 2));
        let mut point = self.sampler.point(row)?;
        let b = point.split_off(self.inputs);
        match column {
            0 => {}
            1 => return Some(b),
            _ => point[column - 2] = b[column - 2],
        }
        Some(point)
    }

    /// Indices of one result from its values at all points in order. First-order indices follow Saltelli et al. 2010, table 2
    /// (b), with the mean subtracted from all results. Total indices follow Jansen 1999 ("Analysis of variance designs for
    /// model output", Computer Physics Communications 117, 35-43), table 2 (f) of Saltelli et al. A value that is not finite
    /// counts as missing, and its row is left out. Estimates of small indices can be slightly negative. Intervals are
    /// percentiles over resampled rows (Efron 1979, "Bootstrap methods: another look at the jackknife", Annals of Statistics 7,
    /// 1-26); they overestimate the error of a Sobol sequence.
    ///
    /// # Errors
    /// A number of results that differs from the number of points, too few complete rows, no variance, or interval settings out
    /// of range.
    pub fn indices(&self, results: &[f64], bootstrap: Bootstrap) -> Result<SensitivityIndices, IndicesError> {
        if results.len() != self.points() {
            return Err(IndicesError::Results { results: results.len(), points: self.points() });
        }
        let Bootstrap { resamples, confidence, seed } = bootstrap;
        if resamples < MIN_RESAMPLES || !(confidence > 0.0 && confidence < 1.0) {
            return Err(IndicesError::Interval { resamples, confidence });
        }
        let all = results.chunks_exact(self.inputs + 2);
        let rows: Vec<&[f64]> = all.filter(|row| row.iter().all(|value| value.is_finite())).collect();
        let incomplete_rows = self.sampler.points() - rows.len();
        if rows.len() < MIN_ROWS {
            return Err(IndicesError::TooFewRows { complete: rows.len(), rows: self.sampler.points() });
        }
        let value = rows[0][0];
        if rows.iter().all(|row| row.iter().all(|&result| result == value)) {
            return Err(IndicesError::NoVariance { value });
        }
        let full_sample = Moments::of(&rows, 0..rows.len(), self.inputs);
        let Some((first, total)) = full_sample.indices() else {
            // The result differs only at the mixed points, or by less than its rounding error.
            return Err(IndicesError::NoVariance { value: full_sample.mean });
        };
        let resampled: Vec<(Vec<f64>, Vec<f64>)> = (0..resamples)
            .filter_map(|index| {
                let stream = RandomStream::new(seed, Purpose::Bootstrap, index);
                let drawn = (0..rows.len()).map(|i| stream.below(i as u64, rows.len()));
                Moments::of(&rows, drawn, self.inputs).indices()
            })
            .collect();
        let estimate = |value: f64, mut values: Vec<f64>| {
            values.sort_by(f64::total_cmp);
            // If no resample has a variance, nothing bounds the index.
            let end = |p, unbounded| if values.is_empty() { unbounded } else { interpolated_quantile(&values, p) };
            let low = end(0.5 * (1.0 - confidence), f64::NEG_INFINITY);
            Estimate { value, low, high: end(0.5 * (1.0 + confidence), f64::INFINITY) }
        };
        let first = first.iter().enumerate();
        let total = total.iter().enumerate();
        Ok(SensitivityIndices {
            mean: full_sample.mean,
            variance: full_sample.variance,
            first: first
                .map(|(i, &value)| estimate(value, resampled.iter().map(|(first, _)| first[i]).collect()))
                .collect(),
            total: total
                .map(|(i, &value)| estimate(value, resampled.iter().map(|(_, total)| total[i]).collect()))
                .collect(),
            rows: rows.len(),
            incomplete_rows,
        })
    }
}

/// Moments of the results over a set of rows.
struct Moments {
    mean: f64,
    variance: f64,
    /// Mean of f(B) (f(AB_i) - f(A)) for each input i.
    first: Vec<f64>,
    /// Mean of (f(A) - f(AB_i))^2 / 2 for each input i.
    total: Vec<f64>,
}

impl Moments {
    fn of(rows: &[&[f64]], drawn: impl ExactSizeIterator<Item = usize> + Clone, inputs: usize) -> Self {
        let n = drawn.len() as f64;
        let mean = drawn.clone().map(|row| rows[row][0] + rows[row][1]).sum::<f64>() / (2.0 * n);
        let (mut variance, mut first, mut total) = (0.0, vec![0.0; inputs], vec![0.0; inputs]);
        for row in drawn {
            let (a, b) = (rows[row][0] - mean, rows[row][1] - mean);
            variance += a * a + b * b;
            for (i, result) in rows[row][2..].iter().enumerate() {
                let change = result - mean - a;
                first[i] += b * change;
                total[i] += 0.5 * change * change;
            }
        }
        first.iter_mut().chain(&mut total).for_each(|sum| *sum /= n);
        Self { mean, variance: variance / (2.0 * n), first, total }
    }

    /// First-order and total indices; `None` without variance.
    fn indices(&self) -> Option<(Vec<f64>, Vec<f64>)> {
        let least = (f64::EPSILON * self.mean).powi(2);
        let share = |values: &[f64]| values.iter().map(|value| value / self.variance).collect();
        (self.variance > least).then(|| (share(&self.first), share(&self.total)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn run(design: &SaltelliDesign, f: impl Fn(&[f64]) -> f64) -> Vec<f64> {
        (0..design.points()).map(|index| f(&design.point(index).unwrap())).collect()
    }

    /// Ishigami & Homma 1990 with a = 7, b = 0.1.
    fn ishigami(u: &[f64]) -> f64 {
        let x: Vec<f64> = u.iter().map(|u| PI * (2.0 * u - 1.0)).collect();
        let sine = |i: usize| libm::sin(x[i]);
        sine(0) + 7.0 * sine(1).powi(2) + 0.1 * x[2].powi(4) * sine(0)
    }

    /// Exact first-order and total indices of the Ishigami function, from its partial variances.
    fn ishigami_indices() -> [(f64, f64); 3] {
        let (v1, v2, v13) = (0.5 * (1.0 + 0.1 * PI.powi(4) / 5.0).powi(2), 49.0 / 8.0, 0.01 * PI.powi(8) * 8.0 / 225.0);
        let v = v1 + v2 + v13;
        [(v1 / v, (v1 + v13) / v), (v2 / v, v2 / v), (0.0, v13 / v)]
    }

    fn check(indices: &SensitivityIndices, exact: &[(f64, f64)], tolerance: f64) {
        for (i, &(first, total)) in exact.iter().enumerate() {
            for (name, estimate, exact) in [("S", indices.first[i], first), ("ST", indices.total[i], total)] {
                assert!((estimate.value - exact).abs() < tolerance, "{name}{}: {estimate:?}, exact {exact}", i + 1);
                assert!(
                    estimate.low <= exact && exact <= estimate.high,
                    "{name}{}: {estimate:?}, exact {exact}",
                    i + 1
                );
            }
        }
    }

    #[test]
    fn the_indices_of_the_ishigami_function_match_the_exact_values() {
        let exact = ishigami_indices();
        for ((first, total), published) in exact.iter().zip([(0.3139, 0.5576), (0.4424, 0.4424), (0.0, 0.2437)]) {
            assert!((first - published.0).abs() < 1e-4 && (total - published.1).abs() < 1e-4);
        }
        for seed in 0..4 {
            let design = SaltelliDesign::new(Sampling::Sobol, 3, 1 << 12, seed).unwrap();
            let computed = design.indices(&run(&design, ishigami), Bootstrap::default()).unwrap();
            assert!((computed.mean - 3.5).abs() < 0.01 && (computed.rows, computed.incomplete_rows) == (1 << 12, 0));
            check(&computed, &exact, 0.01);
        }
    }

    #[test]
    fn equal_additive_inputs_share_the_variance() {
        let design = SaltelliDesign::new(Sampling::Sobol, 8, 1 << 11, 5).unwrap();
        let computed = design.indices(&run(&design, |u| 1000.0 + u.iter().sum::<f64>()), Bootstrap::default()).unwrap();
        check(&computed, &[(0.125, 0.125); 8], 0.005);
        assert!((computed.variance - 8.0 / 12.0).abs() < 1e-3);
    }

    #[test]
    fn the_indices_of_the_g_function_match_the_exact_values() {
        // Sobol' 1993; partial variances 1 / (3 (1 + a)^2).
        let a = [0.0, 1.0, 4.5, 9.0, 99.0, 99.0];
        let g = |u: &[f64]| u.iter().zip(a).map(|(u, a)| ((4.0 * u - 2.0).abs() + a) / (1.0 + a)).product::<f64>();
        let partial = a.map(|a: f64| 1.0 / (3.0 * (1.0 + a).powi(2)));
        let all: f64 = partial.iter().map(|v| 1.0 + v).product();
        let exact = partial.map(|v| (v / (all - 1.0), v * all / (1.0 + v) / (all - 1.0)));
        let design = SaltelliDesign::new(Sampling::Sobol, 6, 1 << 12, 3).unwrap();
        check(&design.indices(&run(&design, g), Bootstrap::default()).unwrap(), &exact, 0.01);
    }

    #[test]
    fn intervals_of_independent_rows_cover_the_exact_index_at_the_stated_confidence() {
        let exact = ishigami_indices();
        let mut covered = 0;
        for seed in 0..100 {
            let design = SaltelliDesign::new(Sampling::Random, 3, 256, seed).unwrap();
            let bootstrap = Bootstrap { resamples: 200, confidence: 0.9, seed };
            let computed = design.indices(&run(&design, ishigami), bootstrap).unwrap();
            covered +=
                (0..3).filter(|&i| computed.total[i].low <= exact[i].1 && exact[i].1 <= computed.total[i].high).count();
        }
        // 270 of 300 expected, with standard deviation 5.2 if independent; percentile intervals of a ratio are slightly too
        // short.
        assert!((245..295).contains(&covered), "{covered}");
    }

    #[test]
    fn a_row_mixes_the_two_samples() {
        let design = SaltelliDesign::new(Sampling::LatinHypercube, 3, 10, 1).unwrap();
        assert_eq!(design.points(), 50);
        for row in 0..10 {
            let at = |column: usize| design.point(5 * row + column).unwrap();
            let (a, b) = (at(0), at(1));
            for i in 0..3 {
                let expected: Vec<f64> = (0..3).map(|j| if i == j { b[j] } else { a[j] }).collect();
                assert_eq!(at(2 + i), expected);
                assert_ne!(a[i], b[i]);
            }
        }
        assert!(design.point(50).is_none());
    }

    #[test]
    fn a_row_with_a_missing_result_is_left_out_and_counted() {
        let design = SaltelliDesign::new(Sampling::Sobol, 3, 1 << 12, 0).unwrap();
        let mut results = run(&design, ishigami);
        for missing in [3, 4, 1000, 20_000] {
            results[missing] = f64::NAN;
        }
        let computed = design.indices(&results, Bootstrap::default()).unwrap();
        assert_eq!((computed.rows, computed.incomplete_rows), ((1 << 12) - 3, 3));
        check(&computed, &ishigami_indices(), 0.015);
        results[8..].fill(f64::INFINITY);
        let error = design.indices(&results, Bootstrap::default()).unwrap_err();
        assert_eq!(error, IndicesError::TooFewRows { complete: 0, rows: 1 << 12 });
    }

    #[test]
    fn a_constant_result_and_impossible_settings_are_refused() {
        let design = SaltelliDesign::new(Sampling::Sobol, 2, 16, 0).unwrap();
        let error = design.indices(&[4.5; 64], Bootstrap::default()).unwrap_err();
        assert_eq!(error.to_string(), "the variance of the result is 0: it is 4.5, whatever the inputs");
        let with_bootstrap = |bootstrap| design.indices(&run(&design, |u| u[0]), bootstrap);
        assert!(with_bootstrap(Bootstrap { resamples: 10, ..Bootstrap::default() }).is_err());
        assert!(with_bootstrap(Bootstrap { confidence: 1.0, ..Bootstrap::default() }).is_err());
        assert_eq!(with_bootstrap(Bootstrap::default()), with_bootstrap(Bootstrap::default()));
        assert!(design.indices(&[1.0], Bootstrap::default()).is_err());
        assert!(matches!(SaltelliDesign::new(Sampling::Sobol, 65, 16, 0), Err(IndicesError::Inputs { .. })));
        assert!(matches!(SaltelliDesign::new(Sampling::Sobol, 64, MAX_POINTS, 0), Err(IndicesError::Size { .. })));
    }
}
