//! Ways that lead down from a position of rest that is not a minimum of the potential energy.

use nalgebra::{DMatrix, DVector};

use super::search::{Linearisation, Pose, Search};

/// Bound of the rounding error of a stiffness by differences, over the machine epsilon.
const ROUNDING: f64 = 32.0;
/// Displacement for the second derivatives along soft directions, over that for the whole matrix: their rounding errors are smaller
/// by this factor. Bodies on a wall then leave it by less than their penetration.
const WIDER: f64 = 100.0;
/// Squared length of the part of a unit direction that the joints allow below which it is rounding.
const IMMOBILE: f64 = 1e-6;
/// Least negative stiffness that counts, over the largest stiffness.
const LEAST: f64 = 1e-13;
/// Ratio of successive displacements that are tried along a direction, and the longest, over the limit of a step.
const LONGER: f64 = 4.0;
const LONGEST: f64 = 0.03;

impl Search<'_> {
    /// Positions near the rest `state` from which the forces lead farther down: none if the rest is stable, two on either side of
    /// an unstable one, and one where the energy still falls to one side alone.
    pub(super) fn ways_down(&mut self, state: &[f64]) -> Vec<Vec<f64>> {
        let rest = self.pose(state.to_vec());
        let linear = self.linearise(&rest);
        let wide = WIDER * linear.finest;
        let resolved = |displacement: f64| ROUNDING * f64::EPSILON * linear.farthest * linear.stiffest / displacement;
        let mut soft = softest_first(&linear.stiffness, &linear.metric);
        soft.retain(|(stiffness, _)| *stiffness < resolved(linear.finest));
        if soft.is_empty() {
            return Vec::new();
        }
        let directions: Vec<DVector<f64>> = soft.into_iter().map(|(_, direction)| direction).collect();
        let Some(stiffness) = self.stiffness_along(&rest, &linear, &directions, wide) else {
            return Vec::new();
        };
        let unit = DMatrix::identity(directions.len(), directions.len());
        for (stiffness, parts) in softest_first(&stiffness, &unit) {
            if stiffness > resolved(wide) {
                break;
            }
            let mut direction = DVector::zeros(self.model.nv);
            for (part, of) in parts.iter().zip(&directions) {
                direction.axpy(*part, of, 1.0);
            }
            self.project(&rest, direction.as_mut_slice());
            // A direction in which the joints allow no motion.
            if !(linear.metric.tr_mul(&direction).dot(&direction) > IMMOBILE) {
                continue;
            }
            let ways = self.ways_along(&rest, &linear, &direction);
            if !ways.is_empty() {
                return ways;
            }
        }
        Vec::new()
    }

    /// Stiffness matrix of the soft `directions` at `rest`, from forces at the distance `wide`; `None` if the joints do not close
    /// there.
    fn stiffness_along(
        &mut self,
        rest: &Pose,
        linear: &Linearisation,
        directions: &[DVector<f64>],
        wide: f64,
    ) -> Option<DMatrix<f64>> {
        let n = directions.len();
        let mut stiffness = DMatrix::zeros(n, n);
        for (j, direction) in directions.iter().enumerate() {
            let mut step = direction * wide;
            self.project(rest, step.as_mut_slice());
            let [ahead, behind] = [step.clone(), -step].map(|step| self.displaced(rest, &step));
            let change = (behind?.accelerations - ahead?.accelerations) / (2.0 * wide);
            let forces = linear.metric.tr_mul(&change);
            for (i, other) in directions.iter().enumerate() {
                stiffness[(i, j)] = forces.dot(other);
            }
        }
        Some((&stiffness + stiffness.transpose()) * 0.5)
    }

    /// The nearest positions along `direction` and its opposite at which the energy is lower than at `rest` and still falls.
    fn ways_along(&mut self, rest: &Pose, linear: &Linearisation, direction: &DVector<f64>) -> Vec<Vec<f64>> {
        let longest = LONGEST / self.excess(direction.as_slice());
        let force = linear.force_along(rest, direction);
        // The choice between the sides of a symmetric machine must not depend on rounding.
        let upward = direction[direction.iamax()].signum();
        let sides = if force == 0.0 { vec![upward, -upward] } else { vec![force.signum()] };
        let mut distance = WIDER * self.difference;
        while distance <= longest {
            let mut ways = Vec::new();
            let noise = self.energy_noise + LEAST * linear.stiffest * distance * distance;
            for &side in &sides {
                let Some(way) = self.displaced(rest, &(direction * (side * distance))) else {
                    continue;
                };
                let falls = side * linear.metric.tr_mul(&way.accelerations).dot(direction) > 0.0;
                if falls && self.rise(rest, &way) < -noise {
                    ways.push(way.state);
                }
            }
            if !ways.is_empty() {
                return ways;
            }
            distance *= LONGER;
        }
        Vec::new()
    }
}

/// Eigenvalues and eigenvectors of `stiffness` over `metric`, in ascending order. The vectors have unit length in that metric.
fn softest_first(stiffness: &DMatrix<f64>, metric: &DMatrix<f64>) -> Vec<(f64, DVector<f64>)> {
    let Some(cholesky) = metric.clone().cholesky() else {
        return Vec::new();
    };
    let lower = cholesky.l();
    let solve = |right: &DMatrix<f64>| lower.solve_lower_triangular(right);
    let Some(scaled) = solve(stiffness).and_then(|half| solve(&half.transpose())) else {
        return Vec::new();
    };
    let eigen = scaled.symmetric_eigen();
    let vectors = eigen.eigenvectors.column_iter().map(|vector| lower.tr_solve_lower_triangular(&vector));
    let pairs = eigen.eigenvalues.iter().copied().zip(vectors);
    let mut pairs: Vec<(f64, DVector<f64>)> = pairs.filter_map(|(value, vector)| Some((value, vector?))).collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    pairs
}
