//! The cheapest fits of several joints that hold a required yield.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use crate::yields::Estimate;

/// Largest number of choices that a proof visits. Visiting a choice without evaluating it is nearly free.
const MAX_CHOICES: usize = 1 << 20;

/// The yield that a choice of fits must hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RequiredYield {
    /// Fraction of accepted units, above 0 and up to 1.
    pub fraction: f64,
    /// Whether the lower end of the confidence interval must reach the fraction, not only the estimate.
    pub with_confidence: bool,
}

impl RequiredYield {
    fn is_held(self, estimate: Estimate) -> bool {
        (if self.with_confidence { estimate.low } else { estimate.value }) >= self.fraction
    }
}

/// Reasons for rejecting a search.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitSearchError {
    /// No joints.
    #[error("no joints to choose fits for")]
    NoJoints,
    /// A joint without candidates.
    #[error("joint {joint} has no candidate fits")]
    NoCandidates {
        /// Index of the joint.
        joint: usize,
    },
    /// A cost that is negative or not finite.
    #[error("cost {cost} of candidate {candidate} of joint {joint}: expected a finite number of at least 0")]
    Cost {
        /// Index of the joint.
        joint: usize,
        /// Index of its candidate.
        candidate: usize,
        /// The cost.
        cost: f64,
    },
    /// A required yield out of range.
    #[error("required yield {fraction}: expected a number above 0 and up to 1")]
    Yield {
        /// The given fraction.
        fraction: f64,
    },
    /// No evaluations allowed.
    #[error("0 evaluations: at least one is needed")]
    NoEvaluations,
}

/// One candidate for each joint, with their total cost and their yield.
#[derive(Clone, Debug, PartialEq)]
pub struct FitChoice {
    /// Index of the chosen candidate of each joint.
    pub candidates: Vec<usize>,
    /// Sum of the candidates' costs.
    pub cost: f64,
    /// Estimated yield.
    pub estimate: Estimate,
}

/// Result of a search.
#[derive(Clone, Debug, PartialEq)]
pub struct FitSearch {
    /// The cheapest choice found that holds the yield; `None` if even the tightest fits do not.
    pub best: Option<FitChoice>,
    /// Whether every cheaper choice is known to fail; false if the evaluations ran out first.
    pub is_proven: bool,
    /// Number of evaluated choices.
    pub evaluations: usize,
}

/// Validated input of a search.
#[derive(Clone, Debug, PartialEq)]
pub struct FitProblem {
    /// (candidate, cost) of each joint, loosest first.
    levels: Vec<Vec<(usize, f64)>>,
    required: RequiredYield,
    max_evaluations: usize,
}

impl FitProblem {
    /// `costs` holds the costs of each joint's candidates, **loosest first**. At most `max_evaluations` choices are tried.
    ///
    /// # Errors
    /// No joints, no candidates for a joint, a cost or yield out of range, or no evaluations.
    pub fn new(costs: &[Vec<f64>], required: RequiredYield, max_evaluations: usize) -> Result<Self, FitSearchError> {
        if costs.is_empty() {
            return Err(FitSearchError::NoJoints);
        }
        for (joint, costs) in costs.iter().enumerate() {
            if costs.is_empty() {
                return Err(FitSearchError::NoCandidates { joint });
            }
            let is_cost = |cost: f64| cost.is_finite() && cost >= 0.0;
            if let Some((candidate, &cost)) = costs.iter().enumerate().find(|(_, cost)| !is_cost(**cost)) {
                return Err(FitSearchError::Cost { joint, candidate, cost });
            }
        }
        if !(required.fraction > 0.0 && required.fraction <= 1.0) {
            return Err(FitSearchError::Yield { fraction: required.fraction });
        }
        if max_evaluations == 0 {
            return Err(FitSearchError::NoEvaluations);
        }
        let levels = costs.iter().map(|costs| levels(costs)).collect();
        Ok(Self { levels, required, max_evaluations })
    }

    /// Finds the cheapest choice that holds the required yield. `evaluate` estimates the yield of a choice, given as the index
    /// of each joint's candidate, and is called at most once for each choice.
    ///
    /// The search assumes that a tighter fit in any joint never lowers the yield. This holds for a tip error that grows with
    /// every clearance. If yields are estimated from samples, all choices must share the same random points, or noise violates
    /// the assumption. Where a tighter fit moves the centre of a clearance away from its best value, the result is not the
    /// optimum.
    ///
    /// Candidates that cost at least as much as a tighter one are discarded. First, the joints are loosened one at a time as
    /// far as the yield allows. Then choices cheaper than the best are visited in order of cost (branch and bound). A choice
    /// fails if no joint is tighter than in a choice known to fail. Otherwise the tightest affordable choice above it is
    /// evaluated: either that is a cheaper solution, or it rules out all choices below it.
    ///
    /// # Errors
    /// An error of `evaluate`.
    pub fn solve<E>(&self, evaluate: impl FnMut(&[usize]) -> Result<Estimate, E>) -> Result<FitSearch, E> {
        let mut search = Search { problem: self, evaluations: 0, evaluate, failed: Vec::new(), best: None };
        let is_proven = search.run()?;
        let best = search.best.as_ref().map(|(choice, estimate)| FitChoice {
            candidates: search.candidates(choice),
            cost: search.cost(choice),
            estimate: *estimate,
        });
        Ok(FitSearch { best, is_proven, evaluations: search.evaluations })
    }
}

/// (candidate, cost) of the candidates that cost less than every tighter one, loosest and cheapest first.
fn levels(costs: &[f64]) -> Vec<(usize, f64)> {
    let mut levels: Vec<(usize, f64)> = Vec::new();
    for (candidate, &cost) in costs.iter().enumerate().rev() {
        if levels.last().is_none_or(|&(_, tighter)| cost < tighter) {
            levels.push((candidate, cost));
        }
    }
    levels.reverse();
    levels
}

struct Search<'a, F> {
    problem: &'a FitProblem,
    evaluations: usize,
    evaluate: F,
    /// Choices known to fail; each is tighter in some joint than every other.
    failed: Vec<Vec<usize>>,
    best: Option<(Vec<usize>, Estimate)>,
}

/// A choice to visit, as the level of each joint. Only joints from `first_open` on may still be tightened, so that each choice
/// is visited once.
struct Node {
    cost: f64,
    choice: Vec<usize>,
    first_open: usize,
}

impl<E, F: FnMut(&[usize]) -> Result<Estimate, E>> Search<'_, F> {
    /// Runs the search and returns whether the best choice is proven to be the cheapest.
    fn run(&mut self) -> Result<bool, E> {
        let tightest: Vec<usize> = self.problem.levels.iter().map(|levels| levels.len() - 1).collect();
        match self.holds(&tightest)? {
            Some(true) => self.loosen(tightest)?,
            _ => return Ok(true),
        }
        let loosest = vec![0; self.problem.levels.len()];
        let mut nodes = BinaryHeap::from([Node { cost: self.cost(&loosest), choice: loosest, first_open: 0 }]);
        let mut visited = 0;
        while let Some(node) = nodes.pop() {
            visited += 1;
            if visited > MAX_CHOICES {
                return Ok(false);
            }
            while node.cost < self.best_cost() && !self.is_known_to_fail(&node.choice) {
                let above = self.tightest_affordable(&node.choice);
                match self.holds(&above)? {
                    None => return Ok(false),
                    Some(true) => self.loosen(above)?,
                    Some(false) => {}
                }
            }
            for joint in node.first_open..node.choice.len() {
                if node.choice[joint] + 1 < self.problem.levels[joint].len() {
                    let mut choice = node.choice.clone();
                    choice[joint] += 1;
                    let cost = self.cost(&choice);
                    if cost < self.best_cost() {
                        nodes.push(Node { cost, choice, first_open: joint });
                    }
                }
            }
        }
        Ok(true)
    }

    fn candidates(&self, choice: &[usize]) -> Vec<usize> {
        self.problem.levels.iter().zip(choice).map(|(levels, &level)| levels[level].0).collect()
    }

    fn cost(&self, choice: &[usize]) -> f64 {
        self.problem.levels.iter().zip(choice).map(|(levels, &level)| levels[level].1).sum()
    }

    fn best_cost(&self) -> f64 {
        self.best.as_ref().map_or(f64::INFINITY, |(choice, _)| self.cost(choice))
    }

    fn is_known_to_fail(&self, choice: &[usize]) -> bool {
        self.failed.iter().any(|failed| choice.iter().zip(failed).all(|(level, failed)| level <= failed))
    }

    /// Whether a choice holds the yield; `None` if no evaluation is left. If it does and is cheaper than the best, it becomes
    /// the best.
    fn holds(&mut self, choice: &[usize]) -> Result<Option<bool>, E> {
        if self.is_known_to_fail(choice) {
            return Ok(Some(false));
        }
        if self.evaluations == self.problem.max_evaluations {
            return Ok(None);
        }
        self.evaluations += 1;
        let candidates = self.candidates(choice);
        let estimate = (self.evaluate)(&candidates)?;
        let is_held = self.problem.required.is_held(estimate);
        if !is_held {
            self.failed.retain(|failed| failed.iter().zip(choice).any(|(failed, level)| failed > level));
            self.failed.push(choice.to_vec());
        } else if self.cost(choice) < self.best_cost() {
            self.best = Some((choice.to_vec(), estimate));
        }
        Ok(Some(is_held))
    }

    /// Loosens the joints of a choice that holds the yield one at a time by bisection, starting with the largest saving.
    fn loosen(&mut self, mut choice: Vec<usize>) -> Result<(), E> {
        let saving = |joint: usize| self.problem.levels[joint][choice[joint]].1 - self.problem.levels[joint][0].1;
        let mut joints: Vec<(usize, f64)> = (0..choice.len()).map(|joint| (joint, saving(joint))).collect();
        joints.sort_by(|a, b| b.1.total_cmp(&a.1));
        for (joint, _) in joints {
            let (mut fails_below, mut holds) = (0, choice[joint]);
            while fails_below < holds {
                choice[joint] = (fails_below + holds) / 2;
                match self.holds(&choice)? {
                    Some(true) => holds = choice[joint],
                    Some(false) => fails_below = choice[joint] + 1,
                    None => return Ok(()),
                }
            }
            choice[joint] = holds;
        }
        Ok(())
    }

    /// Tightens `choice` one level at a time, each time in the joint where this costs least, while it remains cheaper than the
    /// best choice.
    fn tightest_affordable(&self, choice: &[usize]) -> Vec<usize> {
        let mut above = choice.to_vec();
        loop {
            let next =
                (0..above.len()).filter(|&joint| above[joint] + 1 < self.problem.levels[joint].len()).map(|joint| {
                    let mut next = above.clone();
                    next[joint] += 1;
                    (self.cost(&next), next)
                });
            match next.min_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((cost, next)) if cost < self.best_cost() => above = next,
                _ => return above,
            }
        }
    }
}

impl Ord for Node {
    /// The heap pops the greatest node first: the cheapest, and among equal costs the first in lexical order.
    fn cmp(&self, other: &Self) -> Ordering {
        other.cost.total_cmp(&self.cost).then_with(|| other.choice.cmp(&self.choice))
    }
}

impl PartialOrd for Node {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Node {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Node {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, RandomStream};
    use crate::yields::yield_fraction;

    const UNITS: usize = 400;

    /// A stack of gaps and the largest acceptable sum. Each gap is uniform from 0 to a width that halves from one candidate to
    /// the next.
    struct Stack {
        widths: Vec<f64>,
        costs: Vec<Vec<f64>>,
        units: Vec<Vec<f64>>,
        limit: f64,
    }

    impl Stack {
        fn new(joints: usize, candidates: usize, seed: u64) -> Self {
            let stream = RandomStream::new(seed, Purpose::Position, 0);
            let widths: Vec<f64> = (0..joints).map(|joint| 1.0 + stream.unit(joint as u64)).collect();
            let cost = |joint: usize, candidate: usize| {
                // Grows with tightness apart from some noise: a few candidates cost more than a tighter one.
                (1.6_f64).powi(candidate as i32) * (1.0 + stream.unit((100 + 10 * joint + candidate) as u64))
            };
            let costs =
                (0..joints).map(|joint| (0..candidates).map(|candidate| cost(joint, candidate)).collect()).collect();
            let unit = |k: usize| (0..joints).map(|joint| stream.unit((1000 + joints * k + joint) as u64)).collect();
            Self { limit: 0.3 * widths.iter().sum::<f64>(), widths, costs, units: (0..UNITS).map(unit).collect() }
        }

        fn yield_of(&self, choice: &[usize]) -> Estimate {
            let width = |joint: usize| self.widths[joint] * 0.5_f64.powi(choice[joint] as i32);
            let sum = |u: &Vec<f64>| u.iter().enumerate().map(|(joint, u)| width(joint) * u).sum::<f64>();
            yield_fraction(self.units.iter().filter(|u| sum(u) <= self.limit).count(), UNITS, 0.95).unwrap()
        }

        /// Lowest cost by enumeration, and the number of choices.
        fn enumerate(&self, required: RequiredYield) -> (Option<f64>, usize) {
            let candidates = self.costs[0].len();
            let count = candidates.pow(self.costs.len() as u32);
            let choice = |index: usize| -> Vec<usize> {
                (0..self.costs.len()).map(|joint| index / candidates.pow(joint as u32) % candidates).collect()
            };
            let holding = (0..count).map(choice).filter(|choice| required.is_held(self.yield_of(choice)));
            let costs = holding.map(|choice| choice.iter().zip(&self.costs).map(|(&c, costs)| costs[c]).sum::<f64>());
            (costs.min_by(f64::total_cmp), count)
        }
    }

    fn search(stack: &Stack, required: RequiredYield, max_evaluations: usize) -> FitSearch {
        let mut seen = Vec::new();
        let result = FitProblem::new(&stack.costs, required, max_evaluations).unwrap().solve(|choice| {
            assert!(!seen.contains(&choice.to_vec()), "{choice:?} is evaluated twice");
            seen.push(choice.to_vec());
            Ok::<_, String>(stack.yield_of(choice))
        });
        let result = result.unwrap();
        assert_eq!(result.evaluations, seen.len());
        result
    }

    #[test]
    fn the_search_finds_the_lowest_cost_of_an_enumeration() {
        let (mut evaluations, mut choices) = (0, 0);
        for seed in 0..20 {
            for with_confidence in [false, true] {
                let stack = Stack::new(4, 5, seed);
                let required = RequiredYield { fraction: 0.95, with_confidence };
                let result = search(&stack, required, usize::MAX);
                let (cost, count) = stack.enumerate(required);
                let best = result.best.unwrap();
                assert!((best.cost - cost.unwrap()).abs() < 1e-12, "seed {seed}: {best:?}");
                assert!(result.is_proven && required.is_held(best.estimate));
                assert_eq!(best.estimate, stack.yield_of(&best.candidates));
                evaluations += result.evaluations;
                choices += count;
            }
        }
        assert!(20 * evaluations < choices, "{evaluations} evaluations of {choices} choices");
    }

    #[test]
    fn a_yield_that_the_tightest_fits_miss_takes_one_evaluation() {
        let mut stack = Stack::new(3, 4, 1);
        stack.limit = 1e-3;
        let result = search(&stack, RequiredYield { fraction: 0.99, with_confidence: false }, 100);
        assert_eq!(result, FitSearch { best: None, is_proven: true, evaluations: 1 });
    }

    #[test]
    fn with_few_evaluations_the_result_holds_the_yield_but_is_not_proven() {
        let stack = Stack::new(5, 5, 2);
        let required = RequiredYield { fraction: 0.9, with_confidence: true };
        let all = search(&stack, required, usize::MAX);
        let mut last = f64::INFINITY;
        for max_evaluations in [1, 3, 8, all.evaluations - 1] {
            let result = search(&stack, required, max_evaluations);
            let best = result.best.unwrap();
            assert!(!result.is_proven && result.evaluations == max_evaluations && required.is_held(best.estimate));
            assert!(best.cost <= last && best.cost >= all.best.as_ref().unwrap().cost);
            last = best.cost;
        }
        assert_eq!(search(&stack, required, all.evaluations), all);
    }

    #[test]
    fn many_joints_take_few_evaluations_when_the_costs_are_alike() {
        // 6^12 choices. Any three joints on the second level hold the yield, so that the proof must exclude all pairs.
        let costs = vec![vec![1.0, 2.0, 4.0, 8.0, 16.0, 32.0]; 12];
        let estimate = |choice: &[usize]| {
            let value = if choice.iter().map(|&c| c.min(1)).sum::<usize>() >= 3 { 1.0 } else { 0.0 };
            Ok::<_, String>(Estimate { value, low: value, high: value })
        };
        let required = RequiredYield { fraction: 0.5, with_confidence: false };
        let result = FitProblem::new(&costs, required, 1000).unwrap().solve(estimate).unwrap();
        assert_eq!(result.best.unwrap().cost, 15.0);
        assert!(result.is_proven && result.evaluations < 66 + 50, "{}", result.evaluations);
    }

    #[test]
    fn bad_input_is_refused_and_errors_are_passed_on() {
        let required = RequiredYield { fraction: 0.9, with_confidence: false };
        let message =
            |costs: &[Vec<f64>], required, max| FitProblem::new(costs, required, max).unwrap_err().to_string();
        let problem = FitProblem::new(&[vec![1.0]], required, 9).unwrap();
        assert_eq!(problem.solve(|_| Err("diverged")), Err("diverged"));
        assert_eq!(message(&[], required, 9), "no joints to choose fits for");
        assert_eq!(message(&[vec![1.0], vec![]], required, 9), "joint 1 has no candidate fits");
        let cost = message(&[vec![1.0, f64::NAN]], required, 9);
        assert_eq!(cost, "cost NaN of candidate 1 of joint 0: expected a finite number of at least 0");
        assert_eq!(message(&[vec![1.0]], required, 0), "0 evaluations: at least one is needed");
        let percent = RequiredYield { fraction: 99.0, with_confidence: false };
        assert_eq!(message(&[vec![1.0]], percent, 9), "required yield 99: expected a number above 0 and up to 1");
    }
}
