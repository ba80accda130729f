//! Machines with many joints with play: `discrete-gradient` needs a fraction of the evaluations of explicit steps for nearly the
//! same peaks, and `automatic` gives the same forces in a long chain at rest.

use crate::common::{Changes, simulation};
use jointplay_physics::simulate::Impact;

/// An impact: its joint, how many the joint had before, its start (s) and its peak force (N).
type ImpactRow = (usize, usize, f64, f64);

/// The impacts in the order in which they began, and the evaluations of the whole run, those of single contacts included.
fn run(name: &str, changes: &Changes, method: &str, accuracy: (&str, &str), end: f64) -> (Vec<ImpactRow>, u64) {
    let solver = [("solver.method", method), accuracy];
    let mut simulation = simulation(name, &[&solver, changes].concat());
    let (mut impacts, mut rows): (Vec<Impact>, Vec<ImpactRow>) = (Vec::new(), Vec::new());
    while simulation.time() < end {
        simulation.step().unwrap();
        impacts.extend(simulation.take_impacts());
    }
    impacts.sort_by(|a, b| a.start.total_cmp(&b.start));
    for impact in impacts {
        let before = rows.iter().filter(|row| row.0 == impact.joint).count();
        rows.push((impact.joint, before, impact.start, impact.peak));
    }
    let statistics = simulation.statistics();
    (rows, statistics.evaluations.max(statistics.contact_evaluations))
}

/// Largest errors of the first impacts of `impacts` against `reference`: of their starts, s, and of their peaks, relative.
fn impact_errors(scene: &str, impacts: &[ImpactRow], reference: &[ImpactRow]) -> (f64, f64) {
    // The sixth impact of the chain overlaps that of a neighbour by 25 us.
    let compared = if scene == "chain" { 5 } else { 6 };
    let (mut start_error, mut peak_error) = (0.0_f64, 0.0_f64);
    // Impacts of two joints may begin within a few nanoseconds, in either order.
    for &(joint, before, start, peak) in &reference[..compared] {
        let same = |row: &&ImpactRow| (row.0, row.1) == (joint, before);
        let &(.., at, force) = impacts.iter().find(same).expect("that impact");
        start_error = start_error.max((at - start).abs());
        peak_error = peak_error.max((force / peak - 1.0).abs());
    }
    (start_error, peak_error)
}

#[test]
fn impacts_are_resolved_at_a_loose_tolerance() {
    let cases =
        [("chain", 25e-3, 2e-6), ("four-bar", 20e-3, 2e-6), ("pendulum", 60e-3, 1.2e-5), ("slider-crank", 60e-3, 3e-5)];
    for (scene, end, limit) in cases {
        let (reference, _) = run(scene, &[], "dopri5", ("solver.tolerance", "1e-9"), end);
        let (impacts, _) = run(scene, &[], "automatic", ("solver.tolerance", "1e-3"), end);
        let (start_error, peak_error) = impact_errors(scene, &impacts, &reference);
        println!("{scene}: {start_error} {peak_error}");
        assert!(start_error < limit, "{scene}: {start_error} s");
        assert!(peak_error < 0.01, "{scene}: {peak_error}");
    }
}

#[test]
fn steps_per_impact_need_a_fraction_of_the_explicit_evaluations() {
    let cases: [(&str, &Changes, f64, f64); 3] = [
        ("chain", &[], 25e-3, 0.03),
        ("hexapod", &[], 30e-3, 0.12),
        ("delta", &[("parameter.grip", "0.001 N")], 30e-3, 0.12),
    ];
    for (scene, changes, end, fraction) in cases {
        let (reference, _) = run(scene, changes, "dopri5", ("solver.tolerance", "1e-8"), end);
        let (impacts, evaluations) = run(scene, changes, "discrete-gradient", ("solver.steps_per_impact", "24"), end);
        let (start_error, peak_error) = impact_errors(scene, &impacts, &reference);
        assert!(start_error < 1e-5, "{scene}: {start_error} s");
        assert!(peak_error < 0.01, "{scene}: {peak_error}");
        let (_, explicit) = run(scene, changes, "dopri5", ("solver.tolerance", "1e-5"), end);
        assert!(
            (evaluations as f64) < fraction * explicit as f64,
            "{scene}: {evaluations} evaluations, {explicit} of dopri5"
        );
    }
}

#[test]
fn a_long_chain_at_rest_in_its_sockets_is_stepped_implicitly() {
    let run = |method: &str, tolerance: &str| {
        let chain = [("chain.links", "32"), ("start", "settled")];
        let solver = [("solver.method", method), ("solver.tolerance", tolerance)];
        let mut simulation = simulation("chain", &[chain, solver].concat());
        simulation.advance_to(10e-3).unwrap();
        let peaks: Vec<f64> = (0..32).map(|j| simulation.peak(j).0).collect();
        (peaks, simulation.statistics().evaluations)
    };
    let (reference, explicit) = run("dopri5", "1e-7");
    // The instant at which the implicit scheme is first tried varies irregularly with the tolerance.
    for (tolerance, limit) in [("2e-5", 1000), ("1e-5", 4500), ("5e-6", 1500)] {
        let (forces, evaluations) = run("automatic", tolerance);
        for (j, (force, peak)) in forces.iter().zip(&reference).enumerate() {
            let error = (force / peak - 1.0).abs();
            let joint = j + 1;
            assert!(error < 5e-4, "J{joint}: {force} N instead of {peak} N");
        }
        assert!(evaluations < limit, "{tolerance}: {evaluations} evaluations, {explicit} of dopri5");
    }
}
