use super::*;
use crate::random::{Purpose, RandomStream};

/// Reproducible random numbers for a test.
fn stream(index: usize) -> RandomStream {
    RandomStream::new(99, Purpose::Position, index)
}

#[test]
fn binomial_probabilities_sum_to_one_and_match_small_cases() {
    let small = binomial(3, 0.25);
    for (computed, exact) in small.iter().zip([27.0, 27.0, 9.0, 1.0]) {
        assert!((computed - exact / 64.0).abs() < 1e-15);
    }
    for (n, p) in [(10, 0.5), (5000, 0.99), (200_000, 1e-3), (1, 1e-9)] {
        assert!((binomial(n, p).iter().sum::<f64>() - 1.0).abs() < 1e-9, "{n} {p}");
    }
}

#[test]
fn percentile_intervals_take_the_tabulated_order_statistics() {
    // Median at 95 %: values 2 and 9 of ten, 40 and 61 of a hundred (Conover 1999, table A3 and section 3.2).
    let values = |n: u32| (1..=n).map(f64::from).collect::<Vec<_>>();
    let ten = percentile(&values(10), 0.5, 0.95).unwrap();
    assert_eq!((ten.value, ten.low, ten.high), (5.5, 2.0, 9.0));
    let hundred = percentile(&values(100), 0.5, 0.95).unwrap();
    assert_eq!((hundred.low, hundred.high), (40.0, 61.0));
    // Too few values for the upper end: 0.99^367 > 0.025 > 0.99^368.
    assert_eq!(percentile(&values(367), 0.99, 0.95).unwrap().high, f64::INFINITY);
    assert_eq!(percentile(&values(368), 0.99, 0.95).unwrap().high, 368.0);
    assert_eq!(percentile(&values(5), 0.01, 0.95).unwrap().low, f64::NEG_INFINITY);
}

#[test]
fn percentile_intervals_cover_the_percentile_at_the_stated_confidence() {
    let covered = (0..1000).filter(|&lot| {
        let stream = stream(lot);
        // Exponential: strongly skewed. Its 90 % percentile is ln 10.
        let values: Vec<f64> = (0..200).map(|i| -libm::log(stream.unit(i))).collect();
        let computed = percentile(&values, 0.9, 0.95).unwrap();
        let exact = libm::log(10.0);
        computed.low <= exact && exact <= computed.high
    });
    // At least 950 are expected; the lower bound is three standard deviations of 7 below that.
    let covered = covered.count();
    assert!((930..=990).contains(&covered), "{covered}");
}

#[test]
fn yields_have_wilsons_interval() {
    // Newcombe 1998, Statistics in Medicine 17, 857-872, table I, method 3.
    for (accepted, made, low, high) in
        [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)]
    {
        let computed = yield_fraction(accepted, made, 0.95).unwrap();
        assert!((computed.low - low).abs() < 5e-5 && (computed.high - high).abs() < 5e-5, "{computed:?}");
    }
    let all = yield_fraction(20, 20, 0.95).unwrap();
    assert_eq!((all.value, all.high), (1.0, 1.0));
    assert!((all.low - (1.0 - 0.1611)).abs() < 5e-5);
}

#[test]
fn capability_indices_follow_their_definition() {
    let values = [9.0, 10.0, 11.0, 10.0];
    // Mean 10, variance 2/3.
    let deviation = (2.0_f64 / 3.0).sqrt();
    let computed = capability(&values, Some(6.0), Some(13.0), 0.95).unwrap();
    assert!((computed.cp.unwrap() - 7.0 / (6.0 * deviation)).abs() < 1e-14);
    assert!((computed.cpk.value - 1.0 / deviation).abs() < 1e-14);
    let one_sided = capability(&values, Some(6.0), None, 0.95).unwrap();
    assert!(one_sided.cp.is_none() && (one_sided.cpk.value - 4.0 / (3.0 * deviation)).abs() < 1e-14);
    // A mean outside the limits has a negative index.
    assert!(capability(&values, None, Some(9.5), 0.95).unwrap().cpk.value < 0.0);
}

#[test]
fn capability_intervals_cover_the_index_at_the_stated_confidence() {
    // Standard normal values with an upper limit at 0 and at 4 standard deviations.
    for limit in [0.0, 4.0] {
        let covered = (0..1000).filter(|&lot| {
            let stream = stream(lot);
            let values: Vec<f64> = (0..100).map(|i| normal::quantile(stream.unit(i))).collect();
            let computed = capability(&values, None, Some(limit), 0.95).unwrap().cpk;
            computed.low <= limit / 3.0 && limit / 3.0 <= computed.high
        });
        let covered = covered.count();
        assert!((920..=980).contains(&covered), "limit {limit}: {covered}");
    }
}

#[test]
fn the_inputs_that_cause_rejects_stand_out() {
    let n = 2000;
    let input = |i| (0..n).map(|k| normal::quantile(stream(i).unit(k))).collect::<Vec<f64>>();
    let constant = vec![3.0; n as usize];
    let inputs = vec![input(0), input(1), input(2), constant];
    // Rejected where the first is large or the second far from its mean; the third has no influence.
    let accepted: Vec<bool> = (0..n as usize).map(|k| inputs[0][k] < 1.5 && inputs[1][k].abs() < 2.0).collect();
    let computed = reject_drivers(&inputs, &accepted).unwrap().unwrap();
    assert!(computed[0].mean_shift > 0.8 && computed[0].p_value < 1e-10, "{:?}", computed[0]);
    assert!(
        computed[1].mean_shift.abs() < 0.5 && computed[1].distance > 0.15 && computed[1].p_value < 1e-3,
        "{:?}",
        computed[1]
    );
    assert!(computed[2].mean_shift.abs() < 0.3 && computed[2].p_value > 0.01, "{:?}", computed[2]);
    assert_eq!(computed[3], RejectDriver { mean_shift: 0.0, distance: 0.0, p_value: 1.0 });
    assert_eq!(reject_drivers(&inputs, &vec![true; n as usize]).unwrap(), None);
    assert_eq!(reject_drivers(&[], &[]).unwrap(), None);
}

#[test]
fn p_values_follow_kolmogorovs_distribution() {
    // Critical values of the limit distribution (Smirnov 1948): 1.358 at 5 %, 1.628 at 1 %, 0.8276 at 50 %.
    let n: f64 = 1e8;
    for (lambda, p) in [(1.3581, 0.05), (1.6276, 0.01), (0.8276, 0.5), (0.2, 1.0)] {
        let computed = kolmogorov_p_value(lambda / n.sqrt(), n);
        assert!((computed - p).abs() < 1e-4, "{lambda}: {computed}");
    }
    // The two series agree where they meet.
    let jump = kolmogorov_p_value(1.179_999 / n.sqrt(), n) - kolmogorov_p_value(1.180_001 / n.sqrt(), n);
    assert!(jump > 0.0 && jump < 1e-5, "{jump}");
    // Without influence, p is uniform.
    let small = (0..500).filter(|&lot| {
        let values: Vec<f64> = (0..300).map(|i| stream(lot).unit(i)).collect();
        let accepted: Vec<bool> = (0..300).map(|i| stream(lot).unit(1000 + i) < 0.8).collect();
        reject_drivers(&[values], &accepted).unwrap().unwrap()[0].p_value < 0.1
    });
    let small = small.count();
    assert!((25..=75).contains(&small), "{small}");
}

#[test]
fn bad_input_is_refused() {
    let text = |error: YieldsError| error.to_string();
    assert_eq!(text(percentile(&[], 0.5, 0.95).unwrap_err()), "too few values: 0 of at least 1");
    assert_eq!(text(percentile(&[1.0], 1.0, 0.95).unwrap_err()), "percentile 1: expected a number above 0 and below 1");
    let not_finite = percentile(&[1.0, f64::NAN], 0.5, 0.95).unwrap_err();
    assert_eq!(text(not_finite), "value 1 is NaN: only finite values can be evaluated");
    assert_eq!(text(yield_fraction(3, 2, 0.95).unwrap_err()), "3 of 2 accepted");
    assert!(yield_fraction(0, 0, 0.95).is_err() && yield_fraction(1, 2, f64::NAN).is_err());
    assert_eq!(capability(&[2.0; 3], Some(0.0), None, 0.9).unwrap_err(), YieldsError::NoSpread { value: 2.0 });
    for limits in [(None, None), (Some(2.0), Some(1.0)), (Some(f64::NAN), None)] {
        assert_eq!(capability(&[1.0, 2.0], limits.0, limits.1, 0.9).unwrap_err(), YieldsError::Limits);
    }
    assert!(capability(&[1.0], Some(0.0), None, 0.9).is_err());
    assert!(reject_drivers(&[vec![1.0]], &[true, false]).is_err());
}
