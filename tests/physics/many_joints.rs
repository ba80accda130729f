//! Machines with many loose joints: `automatic` steps friction implicitly while balls stick under load, at a part of the
//! explicit pair's evaluations and with the same forces.

use jointplay::scene::Scene;
use jointplay::simulate::Simulation;

/// Time and peak force of the first six impacts to begin, s and N, and the evaluations of the whole run.
fn run(scene: &str, method: &str, tolerance: &str, end: f64) -> (Vec<(f64, f64)>, u64) {
    let changes = [("solver.method", method), ("solver.tolerance", tolerance)];
    let changes = changes.map(|(key, value)| (key.to_owned(), value.to_owned()));
    let scene = Scene::load(scene, &changes).unwrap();
    let mut simulation = Simulation::new(&scene).unwrap();
    let mut impacts: Vec<(f64, f64)> = Vec::new();
    while simulation.time() < end {
        simulation.step().unwrap();
        for impact in simulation.impacts() {
            if !impacts.contains(&(impact.start, impact.peak)) {
                impacts.push((impact.start, impact.peak));
            }
        }
    }
    impacts.sort_by(|a, b| a.0.total_cmp(&b.0));
    impacts.truncate(6);
    (impacts, simulation.statistics().evaluations)
}

#[test]
fn friction_is_stepped_implicitly_where_it_holds_explicit_steps_back() {
    let path = |name: &str| format!("{}/assets/machines/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    for (scene, end, part) in [
        ("chain".to_owned(), 25e-3, 0.25),
        (path("hexapod"), 30e-3, 0.75),
        (path("delta"), 30e-3, 0.85),
    ] {
        let (reference, _) = run(&scene, "dopri5", "1e-8", end);
        let (found, _) = run(&scene, "automatic", "1e-6", end);
        assert_eq!(reference.len(), 6);
        for (found, expected) in found.iter().zip(&reference) {
            let off = (found.0 - expected.0).abs();
            assert!(
                off < 1e-5,
                "{scene}: at {} instead of {}",
                found.0,
                expected.0
            );
            let off = (found.1 / expected.1 - 1.0).abs();
            assert!(
                off < 0.01,
                "{scene}: {} N instead of {} N",
                found.1,
                expected.1
            );
        }
        let (_, explicit) = run(&scene, "dopri5", "1e-5", end);
        let (_, evaluations) = run(&scene, "automatic", "1e-5", end);
        assert!(
            (evaluations as f64) < part * explicit as f64,
            "{scene}: {evaluations} evaluations, {explicit} of dopri5"
        );
    }
}
