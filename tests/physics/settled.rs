//! The implicit methods on settled contacts: the forces of the explicit method in far fewer steps, and bit-identical resumption.

use crate::common::{mean_forces, simulation};
use jointplay_physics::simulate::Simulation;

#[test]
fn settled_forces_are_those_of_a_converged_explicit_run() {
    let mut explicit = simulation("spcmm", &[("solver.method", "dopri5"), ("solver.tolerance", "1e-7")]);
    let expected = mean_forces(&mut explicit, 1.0, 1.5);
    let explicit_steps = explicit.statistics().steps;
    for (method, tolerance) in [("radau5", "1e-5"), ("automatic", "1e-5")] {
        let mut implicit = simulation("spcmm", &[("solver.method", method), ("solver.tolerance", tolerance)]);
        let actual = mean_forces(&mut implicit, 1.0, 1.5);
        for (j, (actual, expected)) in actual.iter().zip(&expected).enumerate() {
            let ratio = actual / expected;
            println!("{method} joint {j}: {ratio:.6}");
            assert!((ratio - 1.0).abs() < 0.01, "{method}, joint {j}: {ratio}");
        }
        let steps = implicit.statistics().steps;
        println!("{method}: {steps} steps against {explicit_steps}");
        assert!(5 * steps < explicit_steps, "{method}: {steps} against {explicit_steps}");
    }
}

#[test]
fn a_resumed_implicit_run_gives_the_same_bits() {
    for method in ["radau5", "automatic"] {
        let mut simulation = simulation("spcmm", &[("solver.method", method), ("solver.tolerance", "1e-5")]);
        // Settled: the automatic pair has changed to its implicit method.
        simulation.advance_to(0.3).unwrap();
        let snapshot = simulation.snapshot();
        simulation.advance_to(0.4).unwrap();
        let expected = simulation.state_hash();
        simulation.restore(&snapshot);
        simulation.advance_to(0.4).unwrap();
        assert_eq!(simulation.state_hash(), expected, "{method}");
        let mut fresh = Simulation::new(simulation.machine()).unwrap();
        fresh.restore(&snapshot);
        fresh.advance_to(0.4).unwrap();
        assert_eq!(fresh.state_hash(), expected, "{method}, fresh");
    }
}

#[test]
fn a_scene_too_large_for_a_dense_matrix_is_refused_by_name() {
    let scene = crate::common::scene("chain", &[("chain.links", "200"), ("solver.method", "radau5")]);
    let error = Simulation::new(&scene.machine).err().unwrap().to_string();
    assert!(error.contains("1200 velocity coordinates") && error.contains("automatic"), "{error}");
}
