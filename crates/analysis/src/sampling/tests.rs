use super::*;

/// All points of a sample.
fn sample(sampling: Sampling, dimensions: usize, points: usize, seed: u64) -> Vec<Vec<f64>> {
    let sampler = Sampler::new(sampling, dimensions, points, seed).unwrap();
    (0..points).map(|index| sampler.point(index).unwrap()).collect()
}

/// A coordinate of the unscrambled sequence.
fn plain(dimension: usize, points: u64) -> Vec<u64> {
    let directions = directions(dimension);
    (0..points).map(|index| sobol(&directions, index)).collect()
}

/// Smallest t for which `columns`, 2^m values of [`BITS`] digits in each coordinate, are a (t, m, s)-net in base 2: every
/// elementary interval of volume 2^(t-m) holds 2^t of them.
fn net_quality(columns: &[Vec<u64>]) -> u32 {
    let m = columns[0].len().ilog2();
    assert_eq!(columns[0].len(), 1 << m);
    (0..=m).find(|&t| shapes(columns.len(), m - t).iter().all(|shape| is_balanced(columns, shape))).unwrap()
}

/// Ways to divide `digits` among `coordinates`.
fn shapes(coordinates: usize, digits: u32) -> Vec<Vec<u32>> {
    if coordinates == 1 {
        return vec![vec![digits]];
    }
    let with = |first: u32| {
        shapes(coordinates - 1, digits - first).into_iter().map(move |mut rest| {
            rest.push(first);
            rest
        })
    };
    (0..=digits).flat_map(with).collect()
}

/// Whether all elementary intervals with sides 2^-`shape` hold the same number of points.
fn is_balanced(columns: &[Vec<u64>], shape: &[u32]) -> bool {
    let digits: u32 = shape.iter().sum();
    let mut counts = vec![0; 1 << digits];
    for index in 0..columns[0].len() {
        let cell = columns.iter().zip(shape).fold(0, |cell, (column, &d)| cell << d | column[index] >> (BITS - d));
        counts[cell as usize] += 1;
    }
    counts.iter().all(|&n| n == columns[0].len() >> digits)
}

#[test]
fn direction_numbers_are_admissible_and_belong_to_the_primitive_polynomials_in_order() {
    let is_primitive = |p: u16| {
        let degree = p.ilog2();
        let mut power = 1_u16;
        let mut order = 0_u32;
        loop {
            power <<= 1;
            if power >> degree & 1 == 1 {
                power ^= p;
            }
            order += 1;
            if power <= 1 || order > 1 << degree {
                return power == 1 && order == (1 << degree) - 1;
            }
        }
    };
    // x + 1 has order 1.
    let expected: Vec<u16> =
        (3..).filter(|p| p & 1 == 1).filter(|&p| p == 3 || is_primitive(p)).take(ROWS.len()).collect();
    assert_eq!(ROWS.iter().map(|row| row.polynomial).collect::<Vec<_>>(), expected);
    for row in &ROWS {
        assert_eq!(row.initial.len() as u32, row.polynomial.ilog2());
        assert!(row.initial.iter().enumerate().all(|(k, m)| m & 1 == 1 && u32::from(*m) < 2 << k), "{:?}", row.initial);
    }
}

#[test]
fn the_sequence_has_property_a_in_all_dimensions() {
    // Sobol' 1976: halving each side divides the cube into 2^d cells, which hold one point each of every run of 2^d points that
    // starts at a multiple of 2^d. The first digits of the direction numbers then form a matrix that is regular over GF(2), and
    // so is each of its leading blocks.
    let first_digits = |dimension: usize| -> u128 {
        let mut bits = Vec::new();
        for k in 0..MAX_DIMENSIONS {
            let bit = match dimension.checked_sub(1).map(|row| &ROWS[row]) {
                None => u128::from(k == 0),
                Some(row) => match row.initial.get(k) {
                    Some(m) => u128::from(m >> k & 1),
                    None => {
                        let degree = row.initial.len();
                        let terms = (1..=degree).filter(|j| row.polynomial >> (degree - j) & 1 == 1);
                        terms.map(|j| bits[k - j]).sum::<u128>() & 1
                    }
                },
            };
            bits.push(bit);
        }
        bits.iter().enumerate().map(|(k, bit)| bit << k).sum()
    };
    let mut rows: Vec<u128> = (0..MAX_DIMENSIONS).map(first_digits).collect();
    for (dimension, row) in rows.iter().enumerate() {
        let directions = directions(dimension);
        assert!((0..BITS as usize).all(|k| u128::from(directions[k] >> (BITS - 1)) == row >> k & 1), "{dimension}");
    }
    // Elimination without pivoting succeeds: every pivot is 1.
    for pivot in 0..MAX_DIMENSIONS {
        assert_eq!(rows[pivot] >> pivot & 1, 1, "dimension {}", pivot + 1);
        for below in pivot + 1..MAX_DIMENSIONS {
            if rows[below] >> pivot & 1 == 1 {
                rows[below] ^= rows[pivot];
            }
        }
    }
}

#[test]
fn the_first_points_match_the_published_example() {
    // Joe & Kuo's example of ten points in three dimensions, in the order of Gray codes.
    let published = [
        [0.0, 0.0, 0.0],
        [0.5, 0.5, 0.5],
        [0.75, 0.25, 0.25],
        [0.25, 0.75, 0.75],
        [0.375, 0.375, 0.625],
        [0.875, 0.875, 0.125],
        [0.625, 0.125, 0.875],
        [0.125, 0.625, 0.375],
        [0.1875, 0.3125, 0.9375],
        [0.6875, 0.8125, 0.4375],
    ];
    for (index, point) in published.iter().enumerate() {
        let gray = (index ^ index >> 1) as u64;
        for (dimension, &value) in point.iter().enumerate() {
            let computed = sobol(&directions(dimension), gray) as f64 / (1_u64 << BITS) as f64;
            assert_eq!(computed, value, "point {index}, dimension {dimension}");
        }
    }
}

#[test]
fn elementary_intervals_hold_their_share_with_and_without_scrambling() {
    // Sobol' 1967: t is at most the sum of (degree - 1).
    let bound = |dimensions: &[usize]| -> u32 {
        let degree = |&d: &usize| d.checked_sub(1).map_or(1, |row| ROWS[row].initial.len() as u32);
        dimensions.iter().map(|d| degree(d) - 1).sum()
    };
    let groups: [&[usize]; 9] = [&[0, 1], &[0, 1, 2], &[0, 1, 2, 3], &[1, 2], &[4], &[12, 2], &[30, 1], &[90], &[127]];
    for dimensions in groups {
        let columns: Vec<Vec<u64>> = dimensions.iter().map(|&d| plain(d, 1 << 10)).collect();
        let t = net_quality(&columns);
        assert!(t <= bound(dimensions), "{dimensions:?}: t = {t}");
        for seed in 0..3 {
            let scrambled: Vec<Vec<u64>> = dimensions
                .iter()
                .zip(&columns)
                .map(|(&d, column)| {
                    let stream = RandomStream::new(seed, Purpose::Scrambling, d);
                    column.iter().map(|&x| scramble(x, &stream)).collect()
                })
                .collect();
            assert_ne!(columns, scrambled);
            assert_eq!(net_quality(&scrambled), t, "{dimensions:?}");
        }
    }
}

#[test]
fn a_latin_hypercube_has_one_point_in_each_stratum() {
    for points in [1, 7, 1000] {
        let sample = sample(Sampling::LatinHypercube, 5, points, 11);
        for dimension in 0..5 {
            let mut strata: Vec<usize> = sample.iter().map(|u| (u[dimension] * points as f64) as usize).collect();
            strata.sort_unstable();
            assert!(strata.iter().enumerate().all(|(expected, &stratum)| expected == stratum));
        }
    }
}

#[test]
fn points_are_uniform_and_depend_on_the_seed() {
    for sampling in Sampling::ALL {
        let (first, second) = (sample(sampling, 40, 256, 1), sample(sampling, 40, 256, 2));
        assert_ne!(first, second);
        assert_eq!(first, sample(sampling, 40, 256, 1));
        for dimension in 0..40 {
            let values = || first.iter().map(move |u| u[dimension]);
            assert!(values().all(|u| u > 0.0 && u < 1.0));
            // Standard deviation of the mean of independent points: 1 / sqrt(12 * 256).
            let mean = values().sum::<f64>() / 256.0;
            assert!((mean - 0.5).abs() < 5.0 * 0.018, "{sampling}, dimension {dimension}: {mean}");
        }
    }
}

/// Root mean square error, over 20 seeds, of the estimated mean of a smooth function; the exact mean is 1.
fn error(sampling: Sampling, dimensions: usize, points: usize) -> f64 {
    let smooth = |u: &[f64]| u.iter().map(|&u| libm::exp(u) / (std::f64::consts::E - 1.0)).product::<f64>();
    let squares = (0..20).map(|seed| {
        let mean = sample(sampling, dimensions, points, seed).iter().map(|u| smooth(u)).sum::<f64>() / points as f64;
        (mean - 1.0).powi(2)
    });
    (squares.sum::<f64>() / 20.0).sqrt()
}

#[test]
fn the_mean_of_a_smooth_function_converges_at_the_theoretical_rate() {
    let rate = |sampling, dimensions| {
        libm::log2(error(sampling, dimensions, 1 << 12) / error(sampling, dimensions, 1 << 6)) / 6.0
    };
    let sobol = rate(Sampling::Sobol, 4);
    assert!(sobol < -0.8, "N^{sobol}");
    // Nested scrambling converges as N^-1.5 (Owen 1997, "Scrambled net variance for integrals of smooth functions"); a digital
    // shift only as N^-1.
    let nested = rate(Sampling::Sobol, 1);
    assert!((nested + 1.5).abs() < 0.1, "N^{nested}");
    let random = rate(Sampling::Random, 4);
    assert!((random + 0.5).abs() < 0.15, "N^{random}");
    assert!(error(Sampling::LatinHypercube, 4, 1 << 10) < 0.5 * error(Sampling::Random, 4, 1 << 10));
}

#[test]
fn impossible_samples_are_refused() {
    let refused = |dimensions, points| Sampler::new(Sampling::Sobol, dimensions, points, 0).unwrap_err().to_string();
    assert_eq!(refused(129, 8), "129 dimensions: expected 1 to 128");
    assert_eq!(refused(0, 8), "0 dimensions: expected 1 to 128");
    let text = refused(3, 0);
    assert_eq!(text, "0 points: expected 1 to 16777216 for a `sobol` sample of 3 dimensions");
    assert!(Sampler::new(Sampling::LatinHypercube, 128, MAX_POINTS, 0).is_err());
    assert!(Sampler::new(Sampling::Random, 2, 5, 0).unwrap().point(5).is_none());
}
