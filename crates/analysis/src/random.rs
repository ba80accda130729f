//! Counter-based random numbers: number `i` of a stream is computed without its predecessors, with the same bits on every
//! platform.

/// Weyl increment of SplitMix64: 2^64 divided by the golden ratio, odd.
const GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;
/// Random bits of a number in (0, 1).
pub(crate) const BITS: u32 = 52;

/// Purpose of a stream. Streams of the same seed with different purposes are independent.
#[derive(Clone, Copy)]
pub(crate) enum Purpose {
    Scrambling,
    Permutation,
    Position,
    Trajectory,
    Bootstrap,
}

/// SplitMix64 (Steele, Lea & Flood 2014, "Fast splittable pseudorandom number generators", OOPSLA). Its state after `i` numbers
/// is the key plus a multiple of `i`, so that each number is a function of the counter.
#[derive(Clone, Debug)]
pub(crate) struct RandomStream {
    key: u64,
}

impl RandomStream {
    /// Stream `index` of a seed for one purpose.
    pub fn new(seed: u64, purpose: Purpose, index: usize) -> Self {
        let of_purpose = Self { key: seed }.bits(purpose as u64);
        Self { key: Self { key: of_purpose }.bits(index as u64) }
    }

    /// 64 random bits.
    pub fn bits(&self, counter: u64) -> u64 {
        let mut z = self.key.wrapping_add(GAMMA.wrapping_mul(counter.wrapping_add(1)));
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform number in the open interval (0, 1).
    pub fn unit(&self, counter: u64) -> f64 {
        unit(self.bits(counter) >> (64 - BITS))
    }

    /// Uniform whole number in 0..n; the bias is below n / 2^64.
    pub fn below(&self, counter: u64, n: usize) -> usize {
        ((u128::from(self.bits(counter)) * n as u128) >> 64) as usize
    }

    /// A random permutation of 0..n (Fisher & Yates), from the counters `first` to `first + n`.
    pub fn permutation(&self, first: u64, n: usize) -> Vec<u32> {
        let mut order: Vec<u32> = (0..n as u32).collect();
        for last in (1..n).rev() {
            order.swap(last, self.below(first + last as u64, last + 1));
        }
        order
    }
}

/// The exact centre of cell `cell` of the 2^[`BITS`] equal cells of (0, 1).
pub(crate) fn unit(cell: u64) -> f64 {
    (cell as f64 + 0.5) / (1_u64 << BITS) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_match_splitmix64() {
        // The first outputs of the published generator from the seed 0.
        let stream = RandomStream { key: 0 };
        assert_eq!(stream.bits(0), 0xe220_a839_7b1d_cdaf);
        assert_eq!(stream.bits(1), 0x6e78_9e6a_a1b9_65f4);
        assert_eq!(stream.bits(2), 0x06c4_5d18_8009_454f);
    }

    #[test]
    fn numbers_never_reach_the_ends_and_fill_the_interval_evenly() {
        assert!(unit(0) > 0.0 && unit((1 << BITS) - 1) < 1.0);
        let stream = RandomStream::new(7, Purpose::Position, 3);
        let mut counts = [0_u32; 64];
        for i in 0..64_000 {
            counts[(stream.unit(i) * 64.0) as usize] += 1;
        }
        // Chi-square with 63 degrees of freedom has mean 63 and standard deviation 11.2; the tolerance is five deviations.
        let chi_square: f64 = counts.iter().map(|&n| (f64::from(n) - 1000.0).powi(2) / 1000.0).sum();
        assert!((chi_square - 63.0).abs() < 56.0, "{chi_square}");
    }

    #[test]
    fn a_permutation_holds_every_number_once_and_all_are_equally_likely() {
        let mut seen = [0_u32; 6];
        for index in 0..6000 {
            let order = RandomStream::new(1, Purpose::Permutation, index).permutation(0, 3);
            let mut sorted = order.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, [0, 1, 2]);
            seen[(order[0] * 2 + u32::from(order[1] > order[2])) as usize] += 1;
        }
        // 1000 expected, standard deviation 29.
        assert!(seen.iter().all(|&n| (850..1150).contains(&n)), "{seen:?}");
    }
}
