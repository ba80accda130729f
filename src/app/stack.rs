//! Stacks terms whose sum is zero: positive terms above zero, negative ones below, so that both sides are equally high.

/// Lower and upper edge of one term at each instant.
pub type Band = (Vec<f64>, Vec<f64>);

/// Stacks `terms` (one value per instant each) away from zero in the given order, positive values up and negative values down.
pub fn stack(terms: &[Vec<f64>]) -> Vec<Band> {
    let instants = terms.iter().map(Vec::len).min().unwrap_or(0);
    let (mut up, mut down) = (vec![0.0; instants], vec![0.0; instants]);
    terms
        .iter()
        .map(|term| {
            let (mut low, mut high) = (Vec::with_capacity(instants), Vec::with_capacity(instants));
            for (i, value) in term[..instants].iter().enumerate() {
                let edge = if *value >= 0.0 { &mut up[i] } else { &mut down[i] };
                let from = *edge;
                *edge += value;
                low.push(from.min(*edge));
                high.push(from.max(*edge));
            }
            (low, high)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_touch_and_both_sides_reach_equally_far() {
        let terms = [vec![3.0, 1.0], vec![2.0, -2.0], vec![-4.0, 3.0], vec![-1.0, -2.0]];
        let bands = stack(&terms);
        assert_eq!(bands[0], (vec![0.0, 0.0], vec![3.0, 1.0]));
        assert_eq!(bands[1], (vec![3.0, -2.0], vec![5.0, 0.0]));
        assert_eq!(bands[2], (vec![-4.0, 1.0], vec![0.0, 4.0]));
        assert_eq!(bands[3], (vec![-5.0, -4.0], vec![-4.0, -2.0]));
    }
}
