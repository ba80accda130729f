//! Sections, exponents and regimes of systems with known answers, by the same code as for mechanisms.

use jointplay_analysis::exponent::Exponent;
use jointplay_analysis::orbit::Orbit;
use jointplay_analysis::regime::{Evidence, Regime, classify};
use jointplay_analysis::section::{Schedule, SectionRun};
use jointplay_physics::integrate::{Controller, DormandPrince, RungeKutta4, Step, Stepper, System};
use std::ops::Range;

/// A map of the line or the circle, x' = f(x).
#[derive(Clone)]
struct Map<F> {
    f: F,
    n: f64,
    x: [f64; 1],
}

impl<F: Fn(f64) -> f64 + Clone> Orbit for Map<F> {
    type Stop = ();
    fn time(&self) -> f64 {
        self.n
    }
    fn step_until(&mut self, end: f64) -> Result<(), ()> {
        if self.n < end {
            self.x[0] = (self.f)(self.x[0]);
            self.n += 1.0;
        }
        Ok(())
    }
    fn state(&self) -> &[f64] {
        &self.x
    }
    fn scales(&self) -> &[f64] {
        &[1.0]
    }
    fn twin(&self) -> Self {
        self.clone()
    }
    fn displace(&mut self, offset: &[f64]) {
        self.x[0] += offset[0];
    }
    fn observables(&self) -> usize {
        1
    }
    fn observe(&mut self, out: &mut [f64]) {
        out[0] = self.x[0];
    }
}

/// x'' = f(t, x, x'): a driven oscillator, stepped by Dormand-Prince with the error control of a simulation.
#[derive(Clone)]
struct Force<F>(F);

impl<F: Fn(f64, f64, f64) -> f64> System for Force<F> {
    fn active_ranges(&self) -> &[Range<usize>] {
        std::slice::from_ref(&(0..2))
    }
    fn derivative(&mut self, t: f64, y: &[f64], dy: &mut [f64]) {
        dy[0] = y[1];
        dy[1] = (self.0)(t, y[0], y[1]);
    }
    fn scale(&self) -> &[f64] {
        &[1.0, 1.0]
    }
}

/// Error tolerance of a step.
const TOLERANCE: f64 = 1e-9;

struct Oscillator<F> {
    force: Force<F>,
    stepper: DormandPrince,
    controller: Controller,
    t: f64,
    h: f64,
    y: [f64; 2],
    /// Whether the position is an angle, observed as (sin, cos).
    angle: bool,
}

impl<F: Fn(f64, f64, f64) -> f64 + Clone> Oscillator<F> {
    fn new(force: F, y: [f64; 2], angle: bool) -> Self {
        Self {
            force: Force(force),
            stepper: DormandPrince::new(2),
            controller: Controller::new(4),
            t: 0.0,
            h: 1e-3,
            y,
            angle,
        }
    }
}

impl<F: Fn(f64, f64, f64) -> f64 + Clone> Orbit for Oscillator<F> {
    type Stop = ();
    fn time(&self) -> f64 {
        self.t
    }
    fn step_until(&mut self, end: f64) -> Result<(), ()> {
        let (mut k, mut y, mut k_end) = ([0.0; 2], [0.0; 2], [0.0; 2]);
        self.force.derivative(self.t, &self.y, &mut k);
        loop {
            let cut = self.t + self.h >= end;
            let h = if cut { end - self.t } else { self.h };
            let error =
                self.stepper.attempt(&mut self.force, Step { t: self.t, h, y: &self.y, k: &k }, &mut y, &mut k_end)
                    / TOLERANCE;
            if error > 1.0 {
                self.h = h * self.controller.after_reject(error);
                continue;
            }
            let next = h * self.controller.after_accept(error);
            self.h = if cut { self.h.max(next) } else { next };
            self.t = if cut { end } else { self.t + h };
            self.y = y;
            return Ok(());
        }
    }
    fn state(&self) -> &[f64] {
        &self.y
    }
    fn scales(&self) -> &[f64] {
        &[1.0, 1.0]
    }
    fn twin(&self) -> Self {
        Self { force: self.force.clone(), stepper: DormandPrince::new(2), ..*self }
    }
    fn displace(&mut self, offset: &[f64]) {
        self.y[0] += offset[0];
        self.y[1] += offset[1];
    }
    fn observables(&self) -> usize {
        3
    }
    fn observe(&mut self, out: &mut [f64]) {
        let (sine, cosine) = if self.angle { self.y[0].sin_cos() } else { (self.y[0], 0.0) };
        out.copy_from_slice(&[sine, cosine, self.y[1]]);
    }
}

fn analyse<O: Orbit>(
    orbit: O,
    interval: f64,
    sections: usize,
    discard: usize,
    separation: f64,
    resolution: f64,
) -> (Regime, Evidence)
where
    O::Stop: std::fmt::Debug,
{
    let width = orbit.observables();
    let schedule = Schedule { first: interval, interval, sections, discard };
    let mut run = SectionRun::new(orbit, schedule, Some(separation));
    while !run.is_done() {
        run.step().unwrap();
    }
    assert_eq!(run.so_far.kept.len(), (sections - discard) * width);
    let exponent = run.exponent().and_then(|benettin| benettin.result());
    classify(&run.so_far.kept, &vec![resolution; width], interval, exponent)
}

fn exponent(evidence: &Evidence) -> &Exponent {
    evidence.exponent.as_ref().unwrap()
}

/// Evidence without the long list of running estimates.
fn short_evidence(evidence: &Evidence) -> String {
    let mut evidence = evidence.clone();
    if let Some(exponent) = &mut evidence.exponent {
        exponent.running.clear();
    }
    format!("{evidence:?}")
}

fn map(f: impl Fn(f64) -> f64 + Clone, sections: usize) -> (Regime, Evidence) {
    let map = Map { f, n: 0.0, x: [0.3] };
    analyse(map, 1.0, sections, sections / 2, 1e-9, 1e-6)
}

fn logistic(r: f64, sections: usize) -> (Regime, Evidence) {
    map(move |x| r * x * (1.0 - x), sections)
}

/// Feigenbaum's cascade: period 2 from 3, 4 from 1 + sqrt 6, 8 from 3.544090, 16 from 3.564407; the window of period 3
/// from 1 + sqrt 8, doubled at 3.841499.
#[test]
fn the_logistic_map_doubles_its_period_at_the_known_parameters() {
    for (r, period) in [
        (2.9, 1),
        (3.01, 2),
        (3.44, 2),
        (3.46, 4),
        (3.543, 4),
        (3.546, 8),
        (3.564, 8),
        (3.565, 16),
        (3.83, 3),
        (3.845, 6),
    ] {
        let (regime, evidence) = logistic(r, 3000);
        assert_eq!(regime, Regime::Periodic(period), "r = {r}: {}", short_evidence(&evidence));
        assert_eq!(evidence.distinct, period, "r = {r}");
        assert!(exponent(&evidence).value < 0.0, "r = {r}");
    }
}

/// At r = 3.5643 the distance to the cycle of period 8 decays by only one part in seven hundred per iteration.
#[test]
fn a_cycle_near_its_doubling_is_reported_as_not_settled() {
    let (regime, evidence) = logistic(3.5643, 3000);
    assert_eq!(regime, Regime::NotSettled);
    assert!(exponent(&evidence).value.abs() < evidence.exponent_bound);
}

#[test]
fn the_logistic_map_at_four_has_the_exponent_ln_two() {
    let (regime, evidence) = logistic(4.0, 6000);
    assert_eq!(regime, Regime::Chaotic);
    let e = exponent(&evidence);
    // The tolerance matches the standard error of three thousand iterations.
    assert!((e.value - 2f64.ln()).abs() < 0.01, "{}", e.value);
    assert!(e.standard_error < 0.01, "{}", e.standard_error);
    assert!(evidence.zero_one > 0.9, "{}", evidence.zero_one);
    assert_eq!(e.running.len(), 3000);
    assert_eq!(e.running.last(), Some(&e.value));
}

/// At a fixed point x* = 1 - 1/r the exponent is ln |2 - r|.
#[test]
fn a_fixed_point_has_the_exponent_of_its_slope() {
    for r in [2.5, 2.8, 1.5] {
        let (regime, evidence) = logistic(r, 400);
        assert_eq!(regime, Regime::Periodic(1));
        let known = f64::ln(f64::abs(2.0 - r));
        let value = exponent(&evidence).value;
        // Rounding of the separation of 1e-9 limits the accuracy.
        assert!((value - known).abs() < 1e-4, "r = {r}: {value} {known}");
    }
    // The superstable fixed point: the twin collapses onto the orbit.
    let (regime, evidence) = logistic(2.0, 400);
    assert_eq!(regime, Regime::Periodic(1));
    assert!(exponent(&evidence).value < -5.0);
}

/// Arnold's circle map with the golden mean is quasi-periodic; in its tongue at 1/2 it locks.
#[test]
fn the_circle_map_is_quasi_periodic_outside_its_tongues() {
    let golden = 0.618_033_988_749_894_9;
    let run_map = |omega: f64, k: f64| {
        let map = move |x: f64| x + omega - k / std::f64::consts::TAU * (std::f64::consts::TAU * x).sin();
        let orbit = Circle(Map { f: map, n: 0.0, x: [0.2] });
        analyse(orbit, 1.0, 400, 200, 1e-9, 1e-6)
    };
    let (regime, evidence) = run_map(golden, 0.5);
    assert_eq!(regime, Regime::QuasiPeriodic, "{}", short_evidence(&evidence));
    assert!(exponent(&evidence).value.abs() < evidence.exponent_bound);
    assert!(evidence.zero_one < 0.2);
    assert_eq!(evidence.distinct, evidence.sections);
    assert_eq!(run_map(0.5, 0.9).0, Regime::Periodic(2));
    assert_eq!(run_map(0.05, 0.9).0, Regime::Periodic(1));
}

/// A lifted circle map observed on the circle.
#[derive(Clone)]
struct Circle<F>(Map<F>);

impl<F: Fn(f64) -> f64 + Clone> Orbit for Circle<F> {
    type Stop = ();
    fn time(&self) -> f64 {
        self.0.time()
    }
    fn step_until(&mut self, end: f64) -> Result<(), ()> {
        self.0.step_until(end)
    }
    fn state(&self) -> &[f64] {
        self.0.state()
    }
    fn scales(&self) -> &[f64] {
        self.0.scales()
    }
    fn twin(&self) -> Self {
        self.clone()
    }
    fn displace(&mut self, offset: &[f64]) {
        self.0.displace(offset);
    }
    fn observables(&self) -> usize {
        2
    }
    fn observe(&mut self, out: &mut [f64]) {
        let (sine, cosine) = (std::f64::consts::TAU * self.0.x[0]).sin_cos();
        out.copy_from_slice(&[cosine, sine]);
    }
}

/// Pendulum of Baker & Gollub, Chaotic Dynamics, 2nd ed., section 3: x'' = -x'/q - sin x + g cos(2 t / 3), q = 2. It is
/// periodic at g = 0.9, has doubled at 1.07, is chaotic at 1.15, turns over once a period at 1.35, has doubled at 1.45 and
/// doubled again at 1.47, and is chaotic at 1.50.
#[test]
fn the_driven_pendulum_is_periodic_and_chaotic_at_the_known_parameters() {
    let drive = 2.0 / 3.0;
    for (g, expected) in
        [(0.9, Some(1)), (1.07, Some(2)), (1.15, None), (1.35, Some(1)), (1.45, Some(2)), (1.47, Some(4)), (1.5, None)]
    {
        let force = move |t: f64, x: f64, v: f64| -0.5 * v - x.sin() + g * (drive * t).cos();
        let orbit = Oscillator::new(force, [0.2, 0.0], true);
        let period = std::f64::consts::TAU / drive;
        let (regime, evidence) = analyse(orbit, period, 300, 150, 1e-6, 1e-5);
        let e = exponent(&evidence);
        match expected {
            Some(n) => {
                assert_eq!(regime, Regime::Periodic(n), "g = {g}: {}", short_evidence(&evidence));
                assert!(e.value + 2.0 * e.standard_error < 0.0, "g = {g}: {}", e.value);
                // Phase volume shrinks at the rate 1/q = 0.5, which bounds the largest exponent from below.
                assert!(e.value > -0.5, "g = {g}: {}", e.value);
            }
            None => {
                assert_eq!(regime, Regime::Chaotic, "g = {g}: {}", short_evidence(&evidence));
                assert!(evidence.zero_one > 0.8, "g = {g}: {}", evidence.zero_one);
            }
        }
    }
}

/// Published largest exponents: the damped driven pendulum x'' = -0.05 x' - sin x + 0.6 sin(0.7 t) has 0.1400, Ueda's
/// oscillator x'' = -0.05 x' - x^3 + 7.5 sin t has 0.1034 (Sprott, Chaos and Time-Series Analysis, 2003, appendix A.5).
#[test]
fn exponents_of_driven_oscillators_match_published_values() {
    let pendulum = |t: f64, x: f64, v: f64| -0.05 * v - x.sin() + 0.6 * (0.7 * t).sin();
    let ueda = |t: f64, x: f64, v: f64| -0.05 * v - x * x * x + 7.5 * t.sin();
    let known = [
        (Oscillator::new(pendulum as fn(f64, f64, f64) -> f64, [0.0, 0.0], true), 0.7, 0.1400),
        (Oscillator::new(ueda as fn(f64, f64, f64) -> f64, [2.5, 0.0], false), 1.0, 0.1034),
    ];
    for (orbit, drive, published) in known {
        let period = std::f64::consts::TAU / drive;
        let (regime, evidence) = analyse(orbit, period, 2200, 200, 1e-6, 1e-5);
        let e = exponent(&evidence);
        assert_eq!(regime, Regime::Chaotic);
        let miss = (e.value - published).abs();
        // Within three standard errors, which must be small against the exponent.
        assert!(miss < 3.0 * e.standard_error, "{} +- {}: {published}", e.value, e.standard_error);
        assert!(e.standard_error < 0.05 * published, "{}", e.standard_error);
    }
}

/// A damped linear oscillator, x'' = -0.2 x' - w^2 x + cos t, has the exponent -0.1 whatever the drive. The growth of the twin over
/// a period depends on its phase, which drifts slowly where twice the frequency is near a multiple of the drive's.
#[test]
fn two_standard_errors_cover_the_exponent_of_a_damped_oscillator() {
    let mut errors = Vec::new();
    for half_waves in [1.0, 2.0, 3.0, 4.0, 6.0] {
        for detuning in [2e-4, 1e-3, 4e-3, 0.01, 0.03, 0.1, 0.23] {
            for kept in [20, 60, 200] {
                let damped: f64 = 0.5 * half_waves + detuning;
                let square = damped * damped + 0.01;
                let force = move |t: f64, x: f64, v: f64| -0.2 * v - square * x + t.cos();
                let orbit = Oscillator::new(force, [1.0, 0.0], false);
                let (_, evidence) = analyse(orbit, std::f64::consts::TAU, kept + 7, 7, 1e-6, 1e-5);
                let e = exponent(&evidence);
                let label = format!("{damped} {kept}: {} +- {}", e.value, e.standard_error);
                assert!((e.value + 0.1).abs() < 2.0 * e.standard_error + 1e-6, "{label}");
                // The separation's length varies by a factor of three at most.
                assert!(e.standard_error < 0.35 / (kept as f64).sqrt(), "{label}");
                errors.push((kept, e.standard_error));
            }
        }
    }
    // Ten times the sections: the error falls at least as the square root.
    let mean = |kept: usize| {
        let own: Vec<f64> = errors.iter().filter(|error| error.0 == kept).map(|error| error.1).collect();
        own.iter().sum::<f64>() / own.len() as f64
    };
    assert!(mean(200) < mean(20) / 10f64.sqrt(), "{} {}", mean(20), mean(200));
}

/// An orbit that fails at a known time keeps the sections taken before.
#[test]
fn a_motion_that_stops_keeps_its_sections() {
    struct Wall(f64);
    impl Orbit for Wall {
        type Stop = &'static str;
        fn time(&self) -> f64 {
            self.0
        }
        fn step_until(&mut self, end: f64) -> Result<(), &'static str> {
            if self.0 >= 4.0 {
                return Err("wall");
            }
            self.0 = end;
            Ok(())
        }
        fn state(&self) -> &[f64] {
            std::slice::from_ref(&self.0)
        }
        fn scales(&self) -> &[f64] {
            &[1.0]
        }
        fn twin(&self) -> Self {
            Self(self.0)
        }
        fn displace(&mut self, _offset: &[f64]) {}
        fn observables(&self) -> usize {
            1
        }
        fn observe(&mut self, out: &mut [f64]) {
            out[0] = self.0;
        }
    }
    let schedule = Schedule { first: 1.0, interval: 1.0, sections: 10, discard: 2 };
    let mut run = SectionRun::new(Wall(0.0), schedule, None);
    let stop = loop {
        if let Err(stop) = run.step() {
            break stop;
        }
    };
    assert_eq!(stop, "wall");
    assert_eq!(run.so_far.kept, [3.0, 4.0]);
    assert!(run.exponent().is_none());
}

/// The adaptive oscillator agrees with a fixed-step integration of the same equation.
#[test]
fn another_stepper_reaches_the_same_section() {
    let force = |t: f64, x: f64, v: f64| -0.5 * v - x.sin() + 0.9 * (2.0 / 3.0 * t).cos();
    let period = 3.0 * std::f64::consts::PI;
    let mut adaptive = Oscillator::new(force, [0.2, 0.0], true);
    while adaptive.time() < period {
        adaptive.step_until(period).unwrap();
    }
    let (mut y, mut k, mut end, mut k_end) = ([0.2, 0.0], [0.0; 2], [0.0; 2], [0.0; 2]);
    let (mut system, mut stepper) = (Force(force), RungeKutta4::new(2));
    let n = 4000;
    let h = period / f64::from(n);
    for i in 0..n {
        let t = f64::from(i) * h;
        system.derivative(t, &y, &mut k);
        stepper.attempt(&mut system, Step { t, h, y: &y, k: &k }, &mut end, &mut k_end);
        y = end;
    }
    for (a, b) in adaptive.state().iter().zip(&y) {
        assert!((a - b).abs() < 1e-7, "{a} {b}");
    }
}
