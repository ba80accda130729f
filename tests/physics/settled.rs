//! The implicit methods on settled contacts: same forces as the explicit one, in far fewer steps, resumable bit by bit.

use crate::common::{mean_forces, simulation};
use jointplay::simulate::Simulation;

#[test]
fn settled_forces_are_those_of_a_converged_explicit_run() {
    let mut explicit = simulation("spcmm", &[("solver.method", "dopri5"), ("solver.tolerance", "1e-7")]);
    let expected = mean_forces(&mut explicit, 1.0, 1.5);
    let explicit_steps = explicit.statistics().steps;
    for (method, tolerance) in [("radau5", "1e-5"), ("automatic", "1e-5"), ("rosenbrock", "1e-6")] {
        let mut implicit = simulation("spcmm", &[("solver.method", method), ("solver.tolerance", tolerance)]);
        let got = mean_forces(&mut implicit, 1.0, 1.5);
        for (j, (got, expected)) in got.iter().zip(&expected).enumerate() {
            let ratio = got / expected;
            println!("{method} joint {j}: {ratio:.6}");
            assert!((ratio - 1.0).abs() < 0.01, "{method}, joint {j}: {ratio}");
        }
        let steps = implicit.statistics().steps;
        println!("{method}: {steps} steps against {explicit_steps}");
        if method != "rosenbrock" {
            assert!(5 * steps < explicit_steps, "{method}: {steps} against {explicit_steps}");
        }
    }
}

#[test]
fn peaks_of_the_first_six_impacts_are_right_with_the_automatic_pair() {
    let mut simulation = simulation("spcmm", &[("solver.method", "automatic"), ("solver.tolerance", "1e-5")]);
    // Continuous-time peaks of the reference solution, N, in the order in which they begin.
    let expected = [(0, 621.35), (1, 560.67), (2, 533.36), (1, 870.58), (0, 771.13), (2, 321.29)];
    let mut found: Vec<(usize, f64)> = Vec::new();
    let mut open: [Option<usize>; 3] = [None; 3];
    let mut peaks = Vec::new();
    while simulation.time() < 0.013 {
        simulation.step().unwrap();
        simulation.take_peaks(&mut peaks);
        for j in 0..3 {
            if peaks[j].impacts > 0 {
                open[j] = Some(found.len());
                found.push((j, 0.0));
            }
            if let Some(at) = open[j] {
                found[at].1 = f64::max(found[at].1, peaks[j].normal);
            }
            if !simulation.contact_memory(j).active {
                open[j] = None;
            }
        }
    }
    for (got, want) in found.iter().zip(expected) {
        assert_eq!(got.0, want.0);
        assert!((got.1 / want.1 - 1.0).abs() < 0.01, "{got:?} against {want:?}");
    }
}

#[test]
fn a_resumed_implicit_run_gives_the_same_bits() {
    for method in ["rosenbrock", "radau5", "automatic"] {
        let mut simulation = simulation("spcmm", &[("solver.method", method), ("solver.tolerance", "1e-5")]);
        // Settled: the automatic pair has changed to its implicit method.
        simulation.advance_to(0.3).unwrap();
        let snapshot = simulation.snapshot();
        simulation.advance_to(0.4).unwrap();
        let expected = simulation.state_hash();
        simulation.restore(&snapshot);
        simulation.advance_to(0.4).unwrap();
        assert_eq!(simulation.state_hash(), expected, "{method}");
        let mut fresh = Simulation::new(simulation.running_scene()).unwrap();
        fresh.restore(&snapshot);
        fresh.advance_to(0.4).unwrap();
        assert_eq!(fresh.state_hash(), expected, "{method}, fresh");
    }
}

#[test]
fn both_formulations_settle_alike_under_the_implicit_method() {
    let run = |formulation: &str| {
        let mut simulation = simulation(
            "spcmm",
            &[("solver.method", "automatic"), ("solver.tolerance", "1e-5"), ("formulation", formulation)],
        );
        mean_forces(&mut simulation, 0.3, 0.4)
    };
    for (tree, lagrange) in run("tree").iter().zip(run("lagrange")) {
        assert!((tree / lagrange - 1.0).abs() < 0.01, "{tree} {lagrange}");
    }
}

#[test]
fn a_scene_too_large_for_a_dense_matrix_is_refused_by_name() {
    let scene = crate::common::scene("chain", &[("chain.links", "200"), ("solver.method", "radau5")]);
    let error = Simulation::new(&scene).err().unwrap().to_string();
    assert!(error.contains("1200 velocity coordinates") && error.contains("automatic"), "{error}");
}
