//! Pareto front of cost and error.

/// Marks the Pareto front of (cost, error) pairs, both better when smaller: the pairs that no other pair dominates, by being
/// better in one value without being worse in the other. Errors below `floor` count as equal to it. A pair that is not finite
/// is never on the front.
pub fn front(pairs: &[(f64, f64)], floor: f64) -> Vec<bool> {
    let floored: Vec<(f64, f64)> = pairs.iter().map(|&(cost, error)| (cost, error.max(floor))).collect();
    let dominates = |a: (f64, f64), b: (f64, f64)| a.0 <= b.0 && a.1 <= b.1 && a != b;
    let finite =
        |pair: (f64, f64), index: usize| pair.0.is_finite() && pair.1.is_finite() && pairs[index].1.is_finite();
    floored
        .iter()
        .enumerate()
        .map(|(i, &pair)| {
            finite(pair, i) && !floored.iter().enumerate().any(|(j, &other)| finite(other, j) && dominates(other, pair))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_holds_the_pairs_that_no_other_dominates() {
        let pairs = [
            (1.0, 0.5),
            (2.0, 0.1),
            // Costs more and is no better than the one before.
            (3.0, 0.1),
            // Dominated by the first.
            (1.5, 0.6),
            (4.0, 1e-9),
            // Better only below the floor.
            (5.0, 1e-12),
            (0.5, f64::NAN),
            (f64::INFINITY, 0.0),
        ];
        let marked = front(&pairs, 1e-8);
        assert_eq!(marked, [true, true, false, false, true, false, false, false]);
        assert!(front(&pairs, 0.0)[5]);
        // Equal pairs do not dominate each other.
        assert_eq!(front(&[(1.0, 1.0), (1.0, 1.0)], 0.0), [true, true]);
        assert!(front(&[], 0.0).is_empty());
    }
}
