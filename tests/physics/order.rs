//! Each stepper converges with its order on smooth motions of the mechanisms.

use crate::common::{run_until, scene, simulation, slope};
use jointplay_physics::contact::ContactState;
use jointplay_physics::integrate::{DormandPrince, RungeKutta4, Step, Stepper, System};
use jointplay_physics::mechanism::{ActiveSet, Mechanism, StepStart};

/// Largest difference of two states relative to the scales of their components.
fn distance(a: &[f64], b: &[f64], scale: &[f64]) -> f64 {
    let parts = a.iter().zip(b).zip(scale);
    parts.map(|((a, b), s)| (a - b).abs() / s).fold(0.0, f64::max)
}

/// State of `mechanism` after `steps` equal steps over `duration`.
fn equal_steps<S: Stepper>(
    mechanism: &mut Mechanism,
    mut stepper: S,
    start: &[f64],
    duration: f64,
    steps: u32,
) -> Vec<f64> {
    let n = start.len();
    let (mut y, mut end) = (start.to_vec(), vec![0.0; n]);
    let (mut k, mut k_end) = (vec![0.0; n], vec![0.0; n]);
    let mechanism = &mut mechanism.evaluator(ActiveSet::Nothing);
    let h = duration / f64::from(steps);
    for i in 0..steps {
        let t = f64::from(i) * h;
        mechanism.derivative(t, &y, &mut k);
        stepper.attempt(mechanism, Step { t, h, y: &y, k: &k }, &mut end, &mut k_end);
        std::mem::swap(&mut y, &mut end);
    }
    y
}

/// The same with the discrete-gradient step.
fn equal_discrete_steps(m: &mut Mechanism, start: &[f64], duration: f64, steps: u32) -> Vec<f64> {
    let contact_states = vec![ContactState::default(); m.contacts.len()];
    let (mut y, mut end, mut k) = (start.to_vec(), start.to_vec(), vec![0.0; start.len()]);
    m.prepare_discrete_gradient().unwrap();
    m.evaluator(ActiveSet::Nothing).derivative(0.0, &y, &mut k);
    let h = duration / f64::from(steps);
    for i in 0..steps {
        let (t, rebounds) = (f64::from(i) * h, &vec![None; contact_states.len()]);
        let from = StepStart { t, h, y: &y, k: &k, contact_states: &contact_states, rebounds };
        let mut m = m.evaluator(ActiveSet::Nothing);
        assert!(m.discrete_step(&from, false, &mut end));
        for (k, (end, start)) in k.iter_mut().zip(end.iter().zip(&y)) {
            *k = (end - start) / h;
        }
        std::mem::swap(&mut y, &mut end);
    }
    y
}

/// The platform tumbles with its rods, all contacts open: nine coupled coordinates, no event.
#[test]
fn slopes_of_the_error_equal_the_orders() {
    const DURATION: f64 = 0.32;
    let scene = scene("spcmm", &[]);
    let mut mechanism = Mechanism::new(&scene.machine).unwrap();
    let mut start = mechanism.start().unwrap();
    let n = start.len();
    for (rate, i) in start[mechanism.positions()..].iter_mut().zip([0, 0, 0, 6, -9, 5, 20, -15, 10]) {
        *rate += 0.25 * f64::from(i);
    }
    let scale = mechanism.scale().to_vec();
    let exact = equal_steps(&mut mechanism, DormandPrince::new(n), &start, DURATION, 4000);
    let mut order = |name: &str, steps: [u32; 4], expected: f64, tolerance: f64| {
        let points: Vec<(f64, f64)> = steps
            .iter()
            .map(|&steps| {
                let m = &mut mechanism;
                let y = match name {
                    "discrete-gradient" => equal_discrete_steps(m, &start, DURATION, steps),
                    "rk4" => equal_steps(m, RungeKutta4::new(n), &start, DURATION, steps),
                    _ => equal_steps(m, DormandPrince::new(n), &start, DURATION, steps),
                };
                (DURATION / f64::from(steps), distance(&y, &exact, &scale))
            })
            .collect();
        let observed = slope(&points);
        println!("{name}: order {observed:.3}, {points:?}");
        assert!((observed - expected).abs() < tolerance, "{name}: {observed}");
    };
    // At these steps the next term of the error changes the slope by a few hundredths.
    // At 160 steps the ends are so far from the guesses that the steps are repeated, which makes them more accurate.
    order("discrete-gradient", [320, 640, 1280, 2560], 2.0, 0.1);
    order("rk4", [40, 80, 160, 320], 4.0, 0.2);
    order("dopri5", [40, 80, 160, 320], 5.0, 0.3);
}

/// Error at `end` of the free slider-crank with ideal joints (loops projected back at every step), and steps.
fn projected(changes: &[(&str, &str)], exact: Option<&[f64]>) -> (f64, Vec<f64>, u64) {
    const END: f64 = 0.24;
    let ideal = [("joint.B.clearance", "0"), ("joint.C.clearance", "0")];
    let mut simulation = simulation("slider-crank", &[&ideal, changes].concat());
    run_until(&mut simulation, END);
    let y = simulation.state_vector().to_vec();
    let scale = simulation.mechanism().scale().to_vec();
    let error = exact.map_or(0.0, |exact| distance(&y, exact, &scale));
    (error, y, simulation.statistics().steps)
}

#[test]
fn projection_keeps_the_order_of_fixed_steps() {
    let (_, exact, _) = projected(&[("solver.tolerance", "1e-13")], None);
    let points = [8000.0, 4000.0, 2000.0, 1000.0].map(|step| {
        let changes = [("solver.method", "rk4"), ("solver.step", &format!("{step} us"))];
        (step, projected(&changes, Some(&exact)).0)
    });
    let observed = slope(&points);
    println!("rk4, projected: order {observed:.3}, {points:?}");
    assert!((observed - 4.0).abs() < 0.3, "{observed}");
}

#[test]
fn error_of_the_adaptive_method_follows_its_tolerance() {
    let (_, exact, _) = projected(&[("solver.tolerance", "1e-13")], None);
    let runs = ["1e-8", "1e-9", "1e-10", "1e-11"].map(|tolerance| {
        let (error, _, steps) = projected(&[("solver.tolerance", tolerance)], Some(&exact));
        (tolerance.parse::<f64>().unwrap(), error, steps as f64)
    });
    let by_tolerance = slope(&runs.map(|(tolerance, error, _)| (tolerance, error)));
    let by_steps = slope(&runs.map(|(_, error, steps)| (1.0 / steps, error)));
    println!("dopri5: error ~ tolerance^{by_tolerance:.3}, ~ step^{by_steps:.3}, {runs:?}");
    // The step control limits the error per step: with order 5 of the result and 4 of the estimate, the exponent is 1.
    assert!((by_tolerance - 1.0).abs() < 0.15, "{by_tolerance}");
    assert!((by_steps - 5.0).abs() < 0.75, "{by_steps}");
}
