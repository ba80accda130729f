//! Drive laws compared with finite differences and closed-form solutions.

use std::f64::consts::TAU;
use std::sync::Arc;

use proptest::prelude::*;

use crate::common::parse;
use jointplay_physics::jet::Jet;
use jointplay_physics::machine::Machine;
use jointplay_physics::mechanism::{Law, laws_of, periods_of};

/// Shortest step that a law may impose, s.
const MIN_STEP: f64 = 1e-9;

/// A body of 1 kg on a slide along x with this drive.
fn machine(drive: &str) -> Machine {
    let text = format!(
        "[[body]]\nname = \"a\"\nmass = \"1 kg\"\ninertia = \"1 1 1 kg m^2\"\n[[joint]]\nname = \"a\"\nkind = \"prismatic\"\n\
         child = \"a\"\naxis = [1, 0, 0]\ndrive = {{ {drive} }}\n"
    );
    Machine::clone(&parse(&text, &[]).machine)
}

fn law(drive: &str) -> Arc<dyn Law> {
    laws_of(&machine(drive)).next().expect("driven")
}

fn points(values: &[(f64, f64)]) -> String {
    let point = |(t, x): &(f64, f64)| format!("[\"{t:e} s\", \"{x:e} m\"]");
    values.iter().map(point).collect::<Vec<_>>().join(", ")
}

/// Every law for a length (m), a time (s) and a number from 0 to 1.
fn every_law(a: f64, d: f64, s: f64) -> Vec<String> {
    let steps = [0.0, 0.3 * d, d, (1.2 + s) * d, 3.0 * d];
    let table = [(steps[0], a), (steps[1], 0.0), (steps[2], -a), (steps[3], s * a), (steps[4], a)];
    let table = points(&table);
    vec![
        format!("law = \"constant\", position = \"{s} m\", velocity = \"{a} m/s\""),
        format!(
            "law = \"harmonic\", mean = \"{s} m\", amplitude = \"{a} m\", frequency = \"{} Hz\", phase = \"{s} rad\"",
            1.0 / d
        ),
        format!(
            "law = \"harmonics\", mean = \"{s} m\", terms = [{{ amplitude = \"{a} m\", frequency = \"{} Hz\" }}, \
             {{ amplitude = \"{s} m\", frequency = \"{} Hz\", phase = \"{a} rad\" }}]",
            1.0 / d,
            s + 0.1
        ),
        format!("law = \"ramp\", from = \"{s} m\", to = \"{a} m\", start = \"{s} s\", duration = \"{d} s\""),
        format!("law = \"pulse\", base = \"{s} m\", height = \"{a} m\", start = \"{s} s\", duration = \"{d} s\""),
        format!("law = \"table\", points = [{table}]"),
        format!("law = \"table\", repeat = true, points = [{table}]"),
        format!("law = \"formula\", formula = \"{a} * sin(2*pi*t/{d}) * exp(-t/3) + smoothstep((t - {s}) / {d})\""),
        format!("law = \"formula\", unit = \"mm\", formula = \"10 * tanh(t)^3 / (2 + cos(t))\""),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn derivatives_are_those_of_the_value(
        a in 0.01..1.0_f64,
        d in 0.05..2.0_f64,
        s in 0.0..1.0_f64,
        t in -1.0..5.0_f64,
    ) {
        for text in every_law(a, d, s) {
            let law = law(&text);
            let h = 1e-5 * d;
            let (left, now, right) = (law.at(t - h), law.at(t), law.at(t + h));
            let rate = (right.value - left.value) / (2.0 * h);
            let acceleration = (right.rate - left.rate) / (2.0 * h);
            // Size of the fourth and lower derivatives over one oscillation.
            let size = 100.0 * (1.0 + a) * (TAU / d).powi(3) * 1e-3;
            prop_assert!((rate - now.rate).abs() < 1e-2 * h * size, "{text} at {t}: {rate} {now:?}");
            // Where the rate has a corner, as at the ends of a table, the error is half the jump.
            let jump = (right.acceleration - left.acceleration).abs();
            let deviation = (acceleration - now.acceleration).abs();
            prop_assert!(deviation < 100.0 * h * size + jump, "{text} at {t}: {acceleration} {now:?}");
        }
    }

    #[test]
    fn rates_never_jump_and_accelerations_only_at_the_ends_of_a_table(
        a in 0.01..1.0_f64,
        d in 0.05..2.0_f64,
        s in 0.0..1.0_f64,
    ) {
        for text in every_law(a, d, s) {
            let law = law(&text);
            let is_one_shot_table = text.contains("table") && !text.contains("repeat");
            let mut t = -1.0;
            while t < 4.0 {
                // The next end of a step that the law requires, or an arbitrary instant before it.
                let next = law.step_end(t).min(t + 0.1);
                let eps = 1e-9;
                let (left, right) = (law.at(next - eps), law.at(next + eps));
                let fast = 1e-9 * 1e4 * (1.0 + a) * (TAU / d).powi(3);
                prop_assert!((left.value - right.value).abs() < fast, "{text} at {next}");
                prop_assert!((left.rate - right.rate).abs() < fast, "{text} at {next}");
                let jump = (left.acceleration - right.acceleration).abs();
                let end = next.abs() < eps || (next - 3.0 * d).abs() < eps;
                prop_assert!(jump < fast || (is_one_shot_table && end), "{text} at {next}: {jump}");
                prop_assert!(next > t);
                t = next;
            }
        }
    }
}

#[test]
fn a_ramp_and_a_pulse_have_their_stated_values() {
    let ramp = law("law = \"ramp\", from = \"1 m\", to = \"3 m\", start = \"1 s\", duration = \"2 s\"");
    for (t, value) in [(0.0, 1.0), (1.0, 1.0), (2.0, 2.0), (3.0, 3.0), (9.0, 3.0)] {
        assert_eq!(ramp.at(t).value, value, "{t}");
    }
    for t in [1.0, 3.0] {
        assert_eq!((ramp.at(t).rate, ramp.at(t).acceleration), (0.0, 0.0));
    }
    // Half-way, the rate is 30/16 of the mean.
    assert!((ramp.at(2.0).rate - 1.875).abs() < 1e-15);
    let pulse = law("law = \"pulse\", base = \"1 m\", height = \"4 mm\", start = \"1 s\", duration = \"10 ms\"");
    assert!((pulse.at(1.005).value - 1.004).abs() < 1e-15);
    for t in [0.0, 0.999, 1.0, 1.011, 2.0] {
        assert_eq!(pulse.at(t), Jet::constant(1.0), "{t}");
    }
}

#[test]
fn constant_and_harmonic_laws_have_the_bits_of_their_formulas() {
    let line = law("law = \"constant\", position = \"0.1 m\", velocity = \"0.3 m/s\"");
    let harmonic =
        law("law = \"harmonic\", mean = \"0.1 m\", amplitude = \"0.3 m\", frequency = \"1.7 Hz\", phase = \"0.2 rad\"");
    for t in [0.0, 0.123, 77.7] {
        let at = line.at(t);
        assert_eq!((at.value, at.rate, at.acceleration), (0.1 + 0.3 * t, 0.3, 0.0));
        let omega = TAU * 1.7;
        let (s, c) = libm::sincos(omega * t + 0.2);
        let at = harmonic.at(t);
        assert_eq!(at.value, 0.1 + 0.3 * s);
        assert_eq!(at.rate, 0.3 * (c * omega));
        assert_eq!(at.acceleration, 0.3 * (c * 0.0 + -s * omega * omega));
    }
}

#[test]
fn a_sum_of_one_harmonic_equals_that_harmonic() {
    let one = law("law = \"harmonic\", mean = \"1 m\", amplitude = \"2 m\", frequency = \"3 Hz\", phase = \"1 rad\"");
    let sum = law(
        "law = \"harmonics\", mean = \"1 m\", terms = [{ amplitude = \"2 m\", frequency = \"3 Hz\", phase = \"1 rad\" }]",
    );
    for t in [-1.0, 0.0, 0.7] {
        assert_eq!(one.at(t), sum.at(t));
    }
}

#[test]
fn the_period_of_a_law_is_the_time_after_which_it_repeats() {
    let terms = |frequencies: &[f64]| {
        let term = |f: &f64| format!("{{ amplitude = \"1 mm\", frequency = \"{f} Hz\" }}");
        let terms: Vec<String> = frequencies.iter().map(term).collect();
        format!("law = \"harmonics\", terms = [{}]", terms.join(", "))
    };
    for (text, period) in [
        (terms(&[2.0]), 0.5),
        (terms(&[2.0, 3.0]), 1.0),
        (terms(&[0.1, 0.3, 0.7]), 10.0),
        (terms(&[1.0, 2.0_f64.sqrt()]), f64::INFINITY),
        ("law = \"harmonics\", terms = [{ amplitude = 0, frequency = \"1 Hz\" }]".into(), f64::INFINITY),
        ("law = \"pulse\", height = \"1 mm\", duration = \"1 s\"".into(), f64::INFINITY),
        (format!("law = \"table\", points = [{}]", points(&[(0.0, 0.0), (1.0, 1.0), (2.0, 0.0)])), f64::INFINITY),
        (format!("law = \"table\", repeat = true, points = [{}]", points(&[(0.5, 0.0), (1.0, 1.0), (2.0, 0.0)])), 1.5),
        ("law = \"formula\", formula = \"sin(t)\"".into(), f64::INFINITY),
    ] {
        let computed = periods_of(&machine(&text)).next().expect("driven");
        assert!(computed == period || (computed - period).abs() < 1e-9, "{text}: {computed}");
        if period.is_finite() {
            let law = law(&text);
            assert!((law.at(0.3).value - law.at(0.3 + period).value).abs() < 1e-12);
        }
    }
    assert!((law(&terms(&[2.0, 3.0])).shortest_period() - 1.0 / 3.0).abs() < 1e-15);
}

#[test]
fn a_spline_reproduces_a_cubic_and_converges_with_the_fourth_order() {
    // 3 t^2 - 2 t^3 has a rate of 0 at both ends.
    let cubic = |t: f64| t * t * (3.0 - 2.0 * t);
    let uneven = [0.0, 0.1, 0.35, 0.5, 0.9, 1.0].map(|t| (t, cubic(t)));
    let spline = law(&format!("law = \"table\", points = [{}]", points(&uneven)));
    for n in 0..=100 {
        let t = f64::from(n) / 100.0;
        let at = spline.at(t);
        assert!((at.value - cubic(t)).abs() < 1e-14, "{t}");
        assert!((at.rate - 6.0 * t * (1.0 - t)).abs() < 1e-13, "{t}");
        if n < 100 {
            assert!((at.acceleration - (6.0 - 12.0 * t)).abs() < 1e-12, "{t}");
        }
    }
    for (repeats, phase) in [(false, 0.0), (true, 0.0), (true, 0.7)] {
        let wave = |t: f64| libm::cos(TAU * t + phase);
        let error = |n: u32| {
            let mut samples: Vec<(f64, f64)> =
                (0..=n).map(|i| (f64::from(i) / f64::from(n), wave(f64::from(i) / f64::from(n)))).collect();
            samples[n as usize].1 = samples[0].1;
            let spline = law(&format!("law = \"table\", repeat = {repeats}, points = [{}]", points(&samples)));
            let at = |i: u32| f64::from(i) / 1000.0;
            let deviation = (0..1000).map(|i| (spline.at(at(i)).value - wave(at(i))).abs());
            deviation.fold(0.0, f64::max)
        };
        let (coarse, fine) = (error(20), error(40));
        // Fourth order in the spacing.
        let ratio = coarse / fine;
        assert!((14.0..18.0).contains(&ratio), "{repeats} {phase}: {ratio} {fine}");
    }
}

#[test]
fn a_periodic_table_repeats_on_both_sides_and_its_steps_end_at_its_points() {
    let samples = [(0.2, 0.0), (0.3, 1.0), (0.5, -1.0), (0.9, 0.0)];
    let law = law(&format!("law = \"table\", repeat = true, points = [{}]", points(&samples)));
    for n in 0..70 {
        let t = 0.2 + f64::from(n) / 100.0;
        for k in [-3.0, 1.0, 5.0, 1000.0] {
            let (here, there) = (law.at(t), law.at(t + 0.7 * k));
            assert!((here.value - there.value).abs() < 1e-9, "{t} {k}");
            assert!((here.rate - there.rate).abs() < 1e-7, "{t} {k}");
        }
    }
    for (t, value) in samples {
        assert!((law.at(t).value - value).abs() < 1e-14);
    }
    let (mut t, mut steps) = (0.0, 0);
    while t < 7.0 {
        let end = law.step_end(t);
        assert!(end > t + MIN_STEP, "{t} {end}");
        let phase = (end - 0.2).rem_euclid(0.7);
        // At eighths of the intervals.
        let near = |from: f64, to: f64| {
            let part = 8.0 * (phase - from) / (to - from);
            (-1e-6..8.0 + 1e-6).contains(&part) && (part - part.round()).abs() < 1e-6
        };
        assert!(near(0.0, 0.1) || near(0.1, 0.3) || near(0.3, 0.7), "{end}");
        (t, steps) = (end, steps + 1);
    }
    assert!((239..=241).contains(&steps), "{steps}");
}

#[test]
fn steps_never_pass_the_start_of_a_feature_and_always_advance() {
    for text in every_law(0.1, 5e-3, 0.5) {
        let law = law(&text);
        let mut t = -0.5;
        let mut count = 0;
        while t < 1.0 {
            let end = law.step_end(t).min(t + 0.01);
            assert!(end > t, "{text}: {t}");
            if law.bounds_steps() && !text.contains("formula") && !text.contains("table") {
                assert!(!(t < 0.5 - MIN_STEP && end > 0.5), "{text}");
            }
            (t, count) = (end, count + 1);
        }
        assert!(count < 3000, "{text}: {count}");
        assert_eq!(law.bounds_steps(), law.step_end(-0.5).is_finite(), "{text}");
    }
}
