//! Screening of many inputs by elementary effects (Morris 1991, "Factorial sampling plans for preliminary computational
//! experiments", Technometrics 33, 161-174).

use crate::random::{Purpose, RandomStream};
use crate::sampling::MAX_POINTS;
use crate::yields::mean_and_deviation;

/// Largest number of levels of an input.
const MAX_LEVELS: usize = 1000;

/// Reasons for rejecting a plan or its results.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MorrisError {
    /// Too few points or too many.
    #[error(
        "{trajectories} trajectories of {inputs} inputs: expected at least one of each and at most {MAX_POINTS} points"
    )]
    Size {
        /// Number of inputs.
        inputs: usize,
        /// Number of trajectories.
        trajectories: usize,
    },
    /// A number of levels for which no step reaches all levels equally often.
    #[error("{levels} levels: expected an even number from 2 to {MAX_LEVELS}")]
    Levels {
        /// Requested number of levels.
        levels: usize,
    },
    /// A margin out of range.
    #[error("margin {margin}: expected at least 0 and below 0.5")]
    Margin {
        /// Requested margin.
        margin: f64,
    },
    /// A number of results that does not match the plan.
    #[error("the plan has {points} points, but {results} results are given")]
    Results {
        /// Number of results.
        results: usize,
        /// Number of points.
        points: usize,
    },
}

/// A plan of trajectories in the unit cube. Each starts at a random point of the grid of levels and changes every input once, in
/// random order, by the step p / (2 (p - 1)) for p levels. Points are numbered trajectory by trajectory, in the order in which
/// they are visited; each is computed from its index and the seed alone.
#[derive(Clone, Debug, PartialEq)]
pub struct MorrisPlan {
    inputs: usize,
    trajectories: usize,
    levels: usize,
    margin: f64,
    seed: u64,
}

/// Start, order and directions of one trajectory.
struct Trajectory {
    /// Starting level of each input, 0 to p - 1.
    start: Vec<usize>,
    /// Inputs in the order in which they change.
    order: Vec<u32>,
    /// Whether an input rises.
    rises: Vec<bool>,
}

/// Statistics of one input's elementary effects: changes of the result, scaled to a change from the lowest level to the
/// highest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElementaryEffects {
    /// Number of effects; fewer than the number of trajectories where results are missing.
    pub count: usize,
    /// Mean μ.
    pub mean: f64,
    /// Mean of the magnitudes μ* (Campolongo, Cariboni & Saltelli 2007, Environmental Modelling & Software 22, 1509-1518),
    /// which measures the influence.
    pub mean_magnitude: f64,
    /// Standard deviation σ, which measures interactions and curvature.
    pub deviation: f64,
    /// Standard error of the mean.
    pub mean_error: f64,
    /// Standard error of the mean magnitude.
    pub mean_magnitude_error: f64,
}

impl MorrisPlan {
    /// A plan of `trajectories` trajectories through `levels` levels of each of `inputs` inputs. Levels are equally spaced from
    /// `margin` to 1 - `margin`: 0 gives Morris's plan; an input with an unbounded distribution needs a margin.
    ///
    /// # Errors
    /// No inputs, no trajectories or too many points; an odd number of levels; a margin out of range.
    pub fn new(inputs: usize, trajectories: usize, levels: usize, margin: f64, seed: u64) -> Result<Self, MorrisError> {
        let points = inputs.checked_add(1).and_then(|n| n.checked_mul(trajectories));
        if inputs == 0 || trajectories == 0 || points.is_none_or(|n| n > MAX_POINTS) {
            return Err(MorrisError::Size { inputs, trajectories });
        }
        if levels < 2 || levels % 2 == 1 || levels > MAX_LEVELS {
            return Err(MorrisError::Levels { levels });
        }
        if !(0.0..0.5).contains(&margin) {
            return Err(MorrisError::Margin { margin });
        }
        Ok(Self { inputs, trajectories, levels, margin, seed })
    }

    /// Number of points, r (k + 1) for r trajectories of k inputs.
    pub fn points(&self) -> usize {
        self.trajectories * (self.inputs + 1)
    }

    fn trajectory(&self, index: usize) -> Trajectory {
        let stream = RandomStream::new(self.seed, Purpose::Trajectory, index);
        let inputs = self.inputs as u64;
        let half = self.levels / 2;
        let rises: Vec<bool> = (0..inputs).map(|i| stream.bits(i) >> 63 == 1).collect();
        // A rising input starts in the lower half, a falling one in the upper half.
        let start = |(i, &rises): (usize, &bool)| stream.below(inputs + i as u64, half) + if rises { 0 } else { half };
        Trajectory {
            start: rises.iter().enumerate().map(start).collect(),
            order: stream.permutation(2 * inputs, self.inputs),
            rises,
        }
    }

    /// Point `index`, each coordinate from the margin to 1 minus the margin; `None` beyond the last.
    pub fn point(&self, index: usize) -> Option<Vec<f64>> {
        if index >= self.points() {
            return None;
        }
        let Trajectory { start: mut level, order, rises } = self.trajectory(index / (self.inputs + 1));
        let half = self.levels / 2;
        for &input in &order[..index % (self.inputs + 1)] {
            let input = input as usize;
            level[input] = if rises[input] { level[input] + half } else { level[input] - half };
        }
        let last = (self.levels - 1) as f64;
        Some(level.iter().map(|&level| self.margin + (1.0 - 2.0 * self.margin) * level as f64 / last).collect())
    }

    /// Elementary effects of each input, from the results at all points in order. A result that is not finite counts as
    /// missing; the effects on either side of it are left out. `None` for an input with fewer than two effects.
    ///
    /// # Errors
    /// A number of results that is not the number of points.
    pub fn effects(&self, results: &[f64]) -> Result<Vec<Option<ElementaryEffects>>, MorrisError> {
        if results.len() != self.points() {
            return Err(MorrisError::Results { results: results.len(), points: self.points() });
        }
        let step = self.levels as f64 / (2 * (self.levels - 1)) as f64;
        let mut effects = vec![Vec::new(); self.inputs];
        for (index, along) in results.chunks_exact(self.inputs + 1).enumerate() {
            let trajectory = self.trajectory(index);
            for (pair, &input) in along.windows(2).zip(&trajectory.order) {
                let input = input as usize;
                let change = if trajectory.rises[input] { pair[1] - pair[0] } else { pair[0] - pair[1] };
                if change.is_finite() {
                    effects[input].push(change / step);
                }
            }
        }
        Ok(effects.iter().map(|effects| summary(effects)).collect())
    }
}

fn summary(effects: &[f64]) -> Option<ElementaryEffects> {
    let count = effects.len();
    if count < 2 {
        return None;
    }
    let magnitudes: Vec<f64> = effects.iter().map(|effect| effect.abs()).collect();
    let (mean, deviation) = mean_and_deviation(effects);
    let (mean_magnitude, magnitude_deviation) = mean_and_deviation(&magnitudes);
    let root = (count as f64).sqrt();
    Some(ElementaryEffects {
        count,
        mean,
        mean_magnitude,
        deviation,
        mean_error: deviation / root,
        mean_magnitude_error: magnitude_deviation / root,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(plan: &MorrisPlan, f: impl Fn(&[f64]) -> f64) -> Vec<f64> {
        (0..plan.points()).map(|index| f(&plan.point(index).unwrap())).collect()
    }

    #[test]
    fn each_step_of_a_trajectory_changes_one_input_by_the_step() {
        let plan = MorrisPlan::new(5, 40, 4, 0.0, 3).unwrap();
        assert_eq!(plan.points(), 240);
        assert!(plan.point(240).is_none());
        let mut visits = [0; 4];
        for trajectory in 0..40 {
            let points: Vec<Vec<f64>> = (0..6).map(|i| plan.point(6 * trajectory + i).unwrap()).collect();
            let mut changed = [0; 5];
            for pair in points.windows(2) {
                let moved: Vec<usize> = (0..5).filter(|&i| pair[0][i] != pair[1][i]).collect();
                assert_eq!(moved.len(), 1);
                assert!(((pair[0][moved[0]] - pair[1][moved[0]]).abs() - 2.0 / 3.0).abs() < 1e-15);
                changed[moved[0]] += 1;
            }
            assert_eq!(changed, [1; 5]);
            for value in points.iter().flatten() {
                visits[(value * 3.0).round() as usize] += 1;
            }
        }
        // 1200 coordinates, 300 on each level.
        assert!(visits.iter().all(|n| (200..400).contains(n)), "{visits:?}");
    }

    #[test]
    fn the_effects_of_a_linear_function_are_its_coefficients_without_spread() {
        let plan = MorrisPlan::new(4, 10, 6, 0.0, 1).unwrap();
        let coefficients = [3.0, -2.0, 0.0, 0.5];
        let results = run(&plan, |u| 7.0 + u.iter().zip(coefficients).map(|(u, c)| c * u).sum::<f64>());
        for (effect, c) in plan.effects(&results).unwrap().into_iter().zip(coefficients) {
            let effect = effect.unwrap();
            assert_eq!(effect.count, 10);
            assert!((effect.mean - c).abs() < 1e-13 && (effect.mean_magnitude - c.abs()).abs() < 1e-13);
            assert!(effect.deviation < 1e-13 && effect.mean_error < 1e-13);
        }
        // With a margin, an effect is scaled to the remaining range.
        let inner = MorrisPlan::new(4, 10, 6, 0.1, 1).unwrap();
        let effects = inner.effects(&run(&inner, |u| 3.0 * u[0])).unwrap();
        assert!((effects[0].unwrap().mean - 0.8 * 3.0).abs() < 1e-13);
    }

    #[test]
    fn interactions_and_curvature_show_as_spread() {
        // u0 u1: the effects of u0 are the levels of u1, with mean 1/2 and, on the four levels 0, 1/3, 2/3, 1, standard deviation
        // sqrt(5)/6; (u2 - 1/2)^2: effects of both signs that cancel in the mean.
        let plan = MorrisPlan::new(3, 2000, 4, 0.0, 9).unwrap();
        let effects = plan.effects(&run(&plan, |u| u[0] * u[1] + (u[2] - 0.5).powi(2))).unwrap();
        let effect_of = |input: usize| effects[input].unwrap();
        let root = 2000_f64.sqrt();
        for input in [0, 1] {
            let effect = effect_of(input);
            assert!((effect.mean - 0.5).abs() < 5.0 * effect.mean_error);
            assert!((effect.deviation - 5_f64.sqrt() / 6.0).abs() < 0.02, "{}", effect.deviation);
            assert!((effect.mean_error - effect.deviation / root).abs() < 1e-15);
        }
        // From 0 to 2/3 and from 1/3 to 1: (1/36 - 1/4) / (2/3) and (1/4 - 1/36) / (2/3).
        assert!(
            (effect_of(2).mean_magnitude - 1.0 / 3.0).abs() < 1e-12
                && effect_of(2).mean.abs() < 5.0 * effect_of(2).mean_error
        );
    }

    #[test]
    fn missing_results_are_left_out_and_counted() {
        let plan = MorrisPlan::new(2, 3, 4, 0.0, 5).unwrap();
        let mut results = run(&plan, |u| u[0] + 10.0 * u[1]);
        // The middle of the first trajectory: both its effects are missing.
        results[1] = f64::NAN;
        let effects = plan.effects(&results).unwrap();
        assert!(effects.iter().all(|effect| effect.unwrap().count == 2));
        assert!((effects[1].unwrap().mean - 10.0).abs() < 1e-13);
        results[4] = f64::INFINITY;
        assert_eq!(plan.effects(&results).unwrap(), [None, None]);
    }

    #[test]
    fn impossible_plans_are_refused() {
        let error = |inputs, trajectories, levels, margin| {
            MorrisPlan::new(inputs, trajectories, levels, margin, 0).unwrap_err()
        };
        assert_eq!(error(2, 4, 5, 0.0).to_string(), "5 levels: expected an even number from 2 to 1000");
        assert_eq!(error(2, 4, 4, 0.5).to_string(), "margin 0.5: expected at least 0 and below 0.5");
        assert!(matches!(error(0, 4, 4, 0.0), MorrisError::Size { .. }));
        assert!(matches!(error(usize::MAX, 4, 4, 0.0), MorrisError::Size { .. }));
        let plan = MorrisPlan::new(2, 4, 4, 0.0, 0).unwrap();
        assert_eq!(plan.effects(&[1.0]).unwrap_err().to_string(), "the plan has 12 points, but 1 results are given");
    }
}
