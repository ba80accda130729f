//! The method that is implicit in the contacts alone: stable and right on settled contacts at steps that resolve no impact,
//! and it creates no energy.

use crate::common::{frame_now, live, mean_forces, scene, simulation, slope};
use jointplay::scene::LiveScene;
use jointplay::simulate::Frame;

#[test]
fn settled_forces_are_right_within_a_per_cent_at_steps_far_beyond_the_contacts_period() {
    let ideal = [("joint.S1.clearance", "0")];
    let surface = [("contact.friction_velocity", "surface")];
    for (name, formulation, step, changes) in [
        ("spcmm", "tree", "500 us", &[][..]),
        ("spcmm", "lagrange", "100 us", &[]),
        ("spcmm", "tree", "500 us", &ideal),
        ("spcmm", "tree", "500 us", &surface),
        ("chain", "tree", "1 ms", &[]),
        ("slider-crank", "tree", "200 us", &[]),
        ("slider-crank-driven", "tree", "500 us", &[]),
    ] {
        let base = [&[("formulation", formulation)], changes].concat();
        let close = [&base[..], &[("solver.tolerance", "1e-8")]].concat();
        let mut exact = live(name, &close);
        crate::common::run_until(&mut exact, 0.3);
        let start = exact.snapshot();
        let expected = mean_forces(&mut exact, 0.3, 0.5);
        let mut fixed = live(name, &base);
        fixed.restore(&start);
        fixed.set("solver.method", "imex-euler").unwrap();
        fixed.set("solver.step", step).unwrap();
        let got = mean_forces(&mut fixed, 0.3, 0.5);
        for (j, (got, expected)) in got.iter().zip(&expected).enumerate() {
            let ratio = got / expected;
            println!("{name}, {base:?}, {step}, joint {j}: {ratio:.5}");
            assert!((ratio - 1.0).abs() < 0.01, "{name}, {base:?}, joint {j}");
        }
    }
}

#[test]
fn a_step_costs_one_evaluation_and_one_more_for_reactions() {
    for name in crate::common::SCENES {
        let mut simulation = simulation(name, &[("solver.method", "imex-euler"), ("solver.step", "200 us")]);
        simulation.advance_to(0.05).unwrap();
        let statistics = simulation.statistics();
        let reactions = simulation.mechanism().has_reactions();
        let each = 1 + u64::from(reactions);
        assert_eq!(statistics.evaluations, each * statistics.steps, "{name}");
    }
}

#[test]
fn the_peak_of_an_ideal_joint_is_that_of_its_rows() {
    let mut simulation = simulation("slider-crank-driven", &[("solver.method", "imex-euler")]);
    let mut frame = Frame::default();
    let mut rows = 0.0_f64;
    while simulation.time() < 0.025 {
        simulation.step().unwrap();
        let middle = 0.5 * (simulation.step_start() + simulation.time());
        for time in [middle, simulation.time()] {
            simulation.sample(time, &mut frame);
            rows = rows.max(frame.joints[0].normal_force.norm());
        }
    }
    let found = simulation.statistics().peak_normal[0];
    assert!(rows > 200.0 && (found / rows - 1.0).abs() < 1e-2, "{found} {rows}");
    assert!(simulation.peak(0).0 >= rows);
}

#[test]
fn no_step_creates_energy() {
    for step in ["1 us", "10 us", "50 us", "200 us", "1 ms"] {
        for (name, friction) in
            [("pendulum", "0"), ("pendulum", "0.15"), ("pendulum", "10"), ("chain", "0.15"), ("slider-crank", "0.15")]
        {
            if friction == "10" && step == "1 ms" {
                // Friction and normal force of such a step need not have a common solution.
                continue;
            }
            let mut simulation = simulation(
                name,
                &[("solver.method", "imex-euler"), ("solver.step", step), ("contact.friction", friction)],
            );
            let start = frame_now(&mut simulation);
            let energy = start.kinetic + start.potential;
            let (mut most, mut exchanged) = (0.0_f64, start.kinetic);
            for _ in 0..4000 {
                if simulation.time() > 1.0 {
                    break;
                }
                simulation.step().unwrap();
                let frame = frame_now(&mut simulation);
                most = most.max(frame.kinetic + frame.potential - energy);
                exchanged = exchanged.max(frame.kinetic);
            }
            println!("{name}, {friction}, {step}: {:.2e}", most / exchanged);
            assert!(most <= 0.01 * exchanged, "{name}, friction {friction}, {step}: {most:e} of {exchanged:e} J");
        }
    }
}

#[test]
fn on_settled_contacts_the_error_shrinks_with_the_step() {
    let mut exact = live("spcmm", &[("solver.tolerance", "1e-8")]);
    exact.advance_to(0.3).unwrap();
    let start = exact.snapshot();
    let end = exact.time() + 0.02;
    crate::common::run_until(&mut exact, end);
    let exact = exact.state_vector().to_vec();
    let points = [200.0, 100.0, 50.0, 25.0].map(|step| {
        let mut simulation = LiveScene::new(&scene("spcmm", &[])).unwrap();
        simulation.restore(&start);
        simulation.set("solver.method", "imex-euler").unwrap();
        simulation.set("solver.step", &format!("{step} us")).unwrap();
        crate::common::run_until(&mut simulation, end);
        let scale = simulation.mechanism().scale();
        let error = simulation
            .state_vector()
            .iter()
            .zip(&exact)
            .zip(scale)
            .map(|((a, b), s)| (a - b).abs() / s)
            .fold(0.0, f64::max);
        (step, error)
    });
    let found = slope(&points);
    println!("order {found:.3}, {points:?}");
    assert!(found > 0.8, "{found}");
}

#[test]
fn too_long_a_step_is_announced_as_what_it_costs() {
    let warnings = scene("spcmm", &[("solver.method", "imex-euler"), ("solver.step", "100 us")]).machine.warnings();
    assert!(warnings.iter().any(|w| w.to_string().contains("stays stable")), "{warnings:?}");
}
