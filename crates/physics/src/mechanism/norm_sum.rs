//! Weighted sum of norms, minimised over the solutions of a linear system: the smallest virtual work with which joints with play
//! can balance a load that they share.

use super::lu::Lu;

/// Smoothing of the norms, over the largest of them: first, last, and the factor from one to the next. With a smaller last one
/// rounding of x would show in the gradients of terms that vanish.
const SMOOTHING: (f64, f64, f64) = (0.1, 1e-9, 0.1);
/// Maximum number of Newton steps at one smoothing, and of halvings of one step.
const MAX_STEPS: usize = 40;
const MAX_HALVINGS: usize = 40;
/// Decrease of the sum that a step predicts, over the sum of the weights times the largest norm. Below the first it may be
/// rounding, and the iteration ends once it no longer halves; below the second the iteration has converged.
const STAGNANT: f64 = 1e-13;
const CONVERGED: f64 = 1e-26;
/// Fraction of the predicted decrease that a step must achieve, and rounding of the sum, in the same measure.
const SUFFICIENT: f64 = 1e-4;
const NOISE: f64 = 1e-15;
/// Diagonal added to the second derivatives, over the sum of the weights divided by the largest norm: where the sum has no
/// curvature, all solutions are equivalent.
const REGULARISATION: f64 = 1e-12;
/// Part of a null vector on rows with weight, over the whole, below which it is rounding.
const NEGLIGIBLE: f64 = 1e-9;

/// A term c |x| of the sum with the gradient c x / |x|, smoothed by `width`: sqrt(|x|^2 + width^2) in place of |x|.
#[derive(Clone, Copy)]
struct Norm<'a> {
    weight: f64,
    x: &'a [f64],
    width: f64,
}

impl Norm<'_> {
    fn size(&self) -> f64 {
        (dot(self.x, self.x) + self.width * self.width).sqrt()
    }
}

/// Minimises sum(c_k |x_k|) - `slope` . x over x + any combination of the vectors `null`; x_k are the components 3 k to 3 k + 2 of
/// x, and the weights c_k belong to the leading ones. Returns the gradients c_k x_k / |x_k| of the terms: where x_k is 0, one between
/// them, such that no combination of null vectors changes the sum.
///
/// Newton's method on smoothed norms whose smoothing shrinks (Qi & Zhou, SIAM J. Optim. 11, 2000, pp. 389-410). With smoothing w
/// the sum is at most 0.31 w c_k for each term that vanishes above the least, with w = 1e-9 of the largest norm at the end.
pub(super) fn minimise(weights: &[f64], null: &[Vec<f64>], slope: &[f64], x: &mut [f64]) -> Vec<f64> {
    let basis = independent(weights, null);
    let parts = x.chunks_exact(3).zip(weights).filter(|(_, weight)| **weight > 0.0);
    let largest = parts.map(|(part, _)| dot(part, part).sqrt()).fold(0.0, f64::max);
    let mut width = SMOOTHING.0 * largest;
    while !basis.is_empty() && largest > 0.0 && width >= 0.5 * SMOOTHING.1 * largest {
        descend(weights, &basis, slope, width, largest, x);
        width *= SMOOTHING.2;
    }
    let width = SMOOTHING.1 * largest;
    let mut gradients = vec![0.0; 3 * weights.len()];
    for ((out, x), &weight) in gradients.chunks_exact_mut(3).zip(x.chunks_exact(3)).zip(weights) {
        let norm = Norm { weight, x, width };
        if norm.size() > 0.0 {
            out.iter_mut().zip(x).for_each(|(out, x)| *out = weight * x / norm.size());
        }
    }
    gradients
}

/// The sum of the smoothed terms less `slope` . x.
fn sum(weights: &[f64], slope: &[f64], width: f64, x: &[f64]) -> f64 {
    let terms = x.chunks_exact(3).zip(weights);
    let terms = terms.map(|(x, &weight)| weight * Norm { weight, x, width }.size());
    terms.sum::<f64>() - dot(slope, x)
}

/// Newton steps at one smoothing.
fn descend(weights: &[f64], basis: &[Vec<f64>], slope: &[f64], width: f64, largest: f64, x: &mut [f64]) {
    let n = basis.len();
    let all: f64 = weights.iter().sum();
    let scale = all * largest;
    let mut lu = Lu::new(n);
    let mut before = f64::INFINITY;
    for _ in 0..MAX_STEPS {
        let value = sum(weights, slope, width, x);
        let mut gradient: Vec<f64> = basis.iter().map(|null| -dot(slope, null)).collect();
        let mut curvature = vec![0.0; n * n];
        for ((k, x), &weight) in x.chunks_exact(3).enumerate().zip(weights).filter(|(_, weight)| **weight > 0.0) {
            let norm = Norm { weight, x, width };
            let size = norm.size();
            let along: Vec<f64> = basis.iter().map(|null| dot(&null[3 * k..][..3], x) / size).collect();
            for i in 0..n {
                gradient[i] += norm.weight * along[i];
                for j in 0..n {
                    let both = dot(&basis[i][3 * k..][..3], &basis[j][3 * k..][..3]);
                    curvature[i * n + j] += norm.weight * (both - along[i] * along[j]) / size;
                }
            }
        }
        let entries = (0..n * n).map(|e| (e / n, e % n, curvature[e]));
        lu.factor(n, entries, REGULARISATION * all / largest);
        let mut step: Vec<f64> = gradient.iter().map(|slope| -slope).collect();
        lu.solve(&mut step);
        let predicted = -dot(&gradient, &step);
        if !(predicted > CONVERGED * scale) || (predicted <= STAGNANT * scale && predicted >= 0.5 * before) {
            return;
        }
        before = predicted;
        let mut part = 1.0;
        for _ in 0..MAX_HALVINGS {
            let mut trial = x.to_vec();
            for (null, step) in basis.iter().zip(&step) {
                trial.iter_mut().zip(null).for_each(|(x, null)| *x += part * step * null);
            }
            if sum(weights, slope, width, &trial) <= value - SUFFICIENT * part * predicted + NOISE * scale {
                x.copy_from_slice(&trial);
                break;
            }
            part *= 0.5;
        }
    }
}

/// Combinations of the null vectors that are orthonormal on the rows with weight; those without a part there are left out.
fn independent(weights: &[f64], null: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let weighted = |a: &[f64], b: &[f64]| -> f64 {
        let parts = a.chunks_exact(3).zip(b.chunks_exact(3)).zip(weights);
        parts.filter(|(_, weight)| **weight > 0.0).map(|((a, b), _)| dot(a, b)).sum()
    };
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for null in null {
        let whole = dot(null, null).sqrt();
        let mut own = null.clone();
        // Twice: once leaves rounding where vectors are nearly parallel.
        for _ in 0..2 {
            for known in &basis {
                let part = weighted(known, &own);
                own.iter_mut().zip(known).for_each(|(own, known)| *own -= part * known);
            }
        }
        let size = weighted(&own, &own).sqrt();
        if size > NEGLIGIBLE * whole {
            own.iter_mut().for_each(|x| *x /= size);
            basis.push(own);
        }
    }
    basis
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(weights: &[f64], x: &[f64]) -> f64 {
        sum(weights, &[], 0.0, x)
    }

    /// Three cities on a circle about the origin, 120 degrees apart, and one weight: the point nearest to all is the middle.
    #[test]
    fn the_point_with_the_least_total_distance_to_three_is_that_of_fermat() {
        let corner = |i: usize| {
            let angle = std::f64::consts::TAU * i as f64 / 3.0;
            [libm::cos(angle), libm::sin(angle), 0.0]
        };
        // x_i = corner - z, with z away from the middle at the beginning.
        let mut x: Vec<f64> = (0..3).flat_map(corner).collect();
        x.chunks_exact_mut(3).for_each(|x| x[0] -= 0.4);
        let null: Vec<Vec<f64>> = (0..3).map(|axis| (0..9).map(|i| f64::from(i % 3 == axis)).collect()).collect();
        let gradients = minimise(&[2.0; 3], &null, &[], &mut x);
        assert!((value(&[2.0; 3], &x) - 6.0).abs() < 1e-12);
        for axis in 0..3 {
            let total: f64 = gradients.iter().skip(axis).step_by(3).sum();
            assert!(total.abs() < 1e-12, "{total}");
        }
    }

    /// |1 - z| + 3 |z| is least at z = 0, where the second term's gradient is 1 and not 3.
    #[test]
    fn a_vanishing_term_has_the_gradient_that_balances_the_others() {
        let mut x = vec![1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        x[3] = 0.7;
        x[0] = 0.3;
        let null = vec![vec![-1.0, 0.0, 0.0, 1.0, 0.0, 0.0]];
        let gradients = minimise(&[1.0, 3.0], &null, &[], &mut x);
        // 0.31 of the last smoothing for each unit of weight.
        assert!((value(&[1.0, 3.0], &x) - 1.0).abs() < 3.0 * 0.31e-9, "{x:?}");
        assert!((gradients[0] - 1.0).abs() < 1e-9 && (gradients[3] - 1.0).abs() < 1e-9, "{gradients:?}");
    }

    /// |1 - z| + |z| is 1 for all z from 0 to 1.
    #[test]
    fn one_of_several_equivalent_solutions_is_found() {
        for first in [0.5, 0.9, -0.3, 4.0] {
            let mut x = vec![1.0 - first, 0.0, 0.0, first, 0.0, 0.0];
            let null = vec![vec![-1.0, 0.0, 0.0, 1.0, 0.0, 0.0]];
            minimise(&[2e-4, 2e-4], &null, &[], &mut x);
            assert!((value(&[2e-4, 2e-4], &x) / 2e-4 - 1.0).abs() < 1e-9, "{x:?}");
        }
    }

    #[test]
    fn terms_without_weight_reduce_the_others_to_zero() {
        let mut x = vec![1.0, 0.0, 0.0, 0.5, 0.0, 0.0, 7.0];
        let null = vec![vec![1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 2.0], vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]];
        let gradients = minimise(&[1.0, 0.0], &null, &[], &mut x);
        assert!(value(&[1.0, 0.0], &x) < 1e-10, "{x:?}");
        assert!(gradients.iter().all(|g| g.abs() < 1.0));
    }
}
