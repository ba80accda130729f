//! Points in the unit cube: scrambled Sobol sequence, Latin hypercube, independent random points.

mod direction_numbers;

use jointplay_physics::words::words;

use crate::random::{BITS, Purpose, RandomStream, unit};
use direction_numbers::ROWS;

/// Largest number of coordinates of a point.
pub const MAX_DIMENSIONS: usize = ROWS.len() + 1;
/// Largest number of points.
pub const MAX_POINTS: usize = 1 << 24;
/// Largest number of coordinates in a Latin hypercube: its permutations then take 256 MiB of memory.
const MAX_STRATA: usize = 1 << 26;

/// How points are distributed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampling {
    /// Sobol sequence with the direction numbers of Joe & Kuo (2008) and nested uniform scrambling of each coordinate (Owen
    /// 1995; 1998, "Scrambling Sobol' and Niederreiter-Xing points", J. Complexity 14, 466-489). Every point is uniformly
    /// distributed, and the points together are as evenly spaced as those of the plain sequence. Best with a power of two
    /// points.
    Sobol,
    /// Latin hypercube (McKay, Beckman & Conover 1979, Technometrics 21, 239-245): with N points, each of the N equal strata of
    /// every coordinate holds one.
    LatinHypercube,
    /// Independent, uniformly distributed points.
    Random,
}

words! { Sampling {
    Sobol => "sobol",
    LatinHypercube => "latin-hypercube",
    Random => "random",
} }

/// Reasons for rejecting a sample.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SamplingError {
    /// No coordinates or too many.
    #[error("{dimensions} dimensions: expected 1 to {MAX_DIMENSIONS}")]
    Dimensions {
        /// Requested number of coordinates.
        dimensions: usize,
    },
    /// No points or too many.
    #[error("{points} points: expected 1 to {most} for a `{sampling}` sample of {dimensions} dimensions")]
    Points {
        /// Requested number of points.
        points: usize,
        /// Largest allowed number.
        most: usize,
        /// Kind of sample.
        sampling: Sampling,
        /// Coordinates of a point.
        dimensions: usize,
    },
}

/// A finite sample in the open unit cube. Each point depends only on its index, the seed and, for a Latin hypercube, the number
/// of points, so that parts of a sample can be computed anywhere. No coordinate is 0 or 1.
#[derive(Clone, Debug)]
pub struct Sampler {
    points: usize,
    coordinates: Vec<Coordinate>,
}

/// The rule for one coordinate.
#[derive(Clone, Debug)]
enum Coordinate {
    Sobol { directions: Box<[u64; BITS as usize]>, scrambling: RandomStream },
    LatinHypercube { strata: Vec<u32>, position: RandomStream },
    Random { position: RandomStream },
}

impl Sampler {
    /// A sample of `points` points with `dimensions` coordinates each.
    ///
    /// # Errors
    /// A number of dimensions or points out of range.
    pub fn new(sampling: Sampling, dimensions: usize, points: usize, seed: u64) -> Result<Self, SamplingError> {
        if !(1..=MAX_DIMENSIONS).contains(&dimensions) {
            return Err(SamplingError::Dimensions { dimensions });
        }
        let most = match sampling {
            Sampling::LatinHypercube => (MAX_STRATA / dimensions).min(MAX_POINTS),
            Sampling::Sobol | Sampling::Random => MAX_POINTS,
        };
        if !(1..=most).contains(&points) {
            return Err(SamplingError::Points { points, most, sampling, dimensions });
        }
        let stream = |purpose, dimension| RandomStream::new(seed, purpose, dimension);
        let coordinate = |dimension: usize| match sampling {
            Sampling::Sobol => Coordinate::Sobol {
                directions: Box::new(directions(dimension)),
                scrambling: stream(Purpose::Scrambling, dimension),
            },
            Sampling::LatinHypercube => Coordinate::LatinHypercube {
                strata: stream(Purpose::Permutation, dimension).permutation(0, points),
                position: stream(Purpose::Position, dimension),
            },
            Sampling::Random => Coordinate::Random { position: stream(Purpose::Position, dimension) },
        };
        Ok(Self { points, coordinates: (0..dimensions).map(coordinate).collect() })
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.points
    }

    /// Number of coordinates of a point.
    pub fn dimensions(&self) -> usize {
        self.coordinates.len()
    }

    /// Point `index`, each coordinate in (0, 1); `None` beyond the last.
    pub fn point(&self, index: usize) -> Option<Vec<f64>> {
        if index >= self.points {
            return None;
        }
        let at = |coordinate: &Coordinate| match coordinate {
            Coordinate::Sobol { directions, scrambling } => unit(scramble(sobol(directions, index as u64), scrambling)),
            Coordinate::LatinHypercube { strata, position } => {
                let stratum = f64::from(strata[index]) + position.unit(index as u64);
                // The sum can round up to the number of points.
                (stratum / self.points as f64).min(1.0 - f64::EPSILON)
            }
            Coordinate::Random { position } => position.unit(index as u64),
        };
        Some(self.coordinates.iter().map(at).collect())
    }
}

/// Direction numbers of a coordinate, counted from 0, as binary fractions of [`BITS`] digits (Joe & Kuo 2008, section 2).
fn directions(dimension: usize) -> [u64; BITS as usize] {
    let mut v = [0; BITS as usize];
    let Some(row) = dimension.checked_sub(1).and_then(|row| ROWS.get(row)) else {
        // Van der Corput sequence: all m are 1.
        for (k, v) in v.iter_mut().enumerate() {
            *v = 1 << (BITS as usize - 1 - k);
        }
        return v;
    };
    let degree = row.initial.len();
    for k in 0..v.len() {
        v[k] = match row.initial.get(k) {
            Some(&m) => u64::from(m) << (BITS as usize - 1 - k),
            None => {
                let initial = v[k - degree] ^ (v[k - degree] >> degree);
                (1..degree).filter(|j| row.polynomial >> (degree - j) & 1 == 1).fold(initial, |sum, j| sum ^ v[k - j])
            }
        };
    }
    v
}

/// Point `index` of the plain sequence, as a binary fraction of [`BITS`] digits. Points follow the indices, not their Gray
/// codes; the first 2^m points are the same set in both orders.
fn sobol(directions: &[u64; BITS as usize], index: u64) -> u64 {
    let digits = directions.iter().enumerate().filter(|(k, _)| index >> k & 1 == 1);
    digits.fold(0, |sum, (_, v)| sum ^ v)
}

/// Nested uniform scrambling (Owen 1995): each digit is flipped at random, independently for every combination of the digits
/// before it. The first point is scrambled like the others and must not be dropped (Owen 2020, "On dropping the first Sobol'
/// point").
fn scramble(x: u64, scrambling: &RandomStream) -> u64 {
    let mut scrambled = x;
    for digit in 0..BITS {
        // Each node of the binary tree of digits has its own random number.
        let node = 1 << digit | x >> (BITS - digit);
        scrambled ^= scrambling.bits(node) >> 63 << (BITS - 1 - digit);
    }
    scrambled
}

#[cfg(test)]
mod tests;
