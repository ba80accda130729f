//! Machines with many loose joints: `discrete-gradient` steps them at a part of the evaluations of explicit steps and with nearly the same
//! peaks, `automatic` a long chain at rest with the same forces.

use crate::common::{Changes, simulation};
use jointplay::simulate::Impact;

/// An impact: its joint, how many the joint had before, its start (s) and its peak force (N).
type Hit = (usize, usize, f64, f64);

/// The impacts in the order in which they began, and the evaluations of the whole run, those of single contacts included.
fn run(name: &str, changes: &Changes, method: &str, accuracy: (&str, &str), end: f64) -> (Vec<Hit>, u64) {
    let solver = [("solver.method", method), accuracy];
    let mut simulation = simulation(name, &[&solver, changes].concat());
    let (mut impacts, mut hits): (Vec<Impact>, Vec<Hit>) = (Vec::new(), Vec::new());
    while simulation.time() < end {
        simulation.step().unwrap();
        simulation.take_impacts(&mut impacts);
    }
    impacts.sort_by(|a, b| a.start.total_cmp(&b.start));
    for impact in impacts {
        let before = hits.iter().filter(|hit| hit.0 == impact.joint).count();
        hits.push((impact.joint, before, impact.start, impact.peak));
    }
    let statistics = simulation.statistics();
    (hits, statistics.evaluations.max(statistics.contact_evaluations))
}

/// Largest errors of `found` at the first impacts of `reference`: of their starts, s, and relative, of their peaks.
fn off_at_first(scene: &str, found: &[Hit], reference: &[Hit]) -> (f64, f64) {
    // The sixth impact of the chain overlaps that of a neighbour by 25 us.
    let compared = if scene == "chain" { 5 } else { 6 };
    let (mut late, mut off) = (0.0_f64, 0.0_f64);
    // Two joints may be hit within a few nanoseconds, in either order.
    for &(joint, before, start, peak) in &reference[..compared] {
        let same = |hit: &&Hit| (hit.0, hit.1) == (joint, before);
        let &(.., at, force) = found.iter().find(same).expect("that impact");
        late = late.max((at - start).abs());
        off = off.max((force / peak - 1.0).abs());
    }
    (late, off)
}

#[test]
fn impacts_are_resolved_at_a_loose_tolerance() {
    let cases =
        [("chain", 25e-3, 2e-6), ("four-bar", 20e-3, 2e-6), ("pendulum", 60e-3, 1.2e-5), ("slider-crank", 60e-3, 3e-5)];
    for (scene, end, allowed) in cases {
        let (reference, _) = run(scene, &[], "dopri5", ("solver.tolerance", "1e-9"), end);
        let (found, _) = run(scene, &[], "automatic", ("solver.tolerance", "1e-3"), end);
        let (late, off) = off_at_first(scene, &found, &reference);
        println!("{scene}: {late} {off}");
        assert!(late < allowed, "{scene}: {late} s");
        assert!(off < 0.01, "{scene}: {off}");
    }
}

#[test]
fn steps_per_impact_cost_a_part_of_explicit_steps() {
    let cases: [(&str, &Changes, f64, f64); 3] = [
        ("chain", &[], 25e-3, 0.03),
        ("hexapod", &[], 30e-3, 0.12),
        ("delta", &[("parameter.grip", "0.001 N")], 30e-3, 0.12),
    ];
    for (scene, changes, end, part) in cases {
        let (reference, _) = run(scene, changes, "dopri5", ("solver.tolerance", "1e-8"), end);
        let (found, evaluations) = run(scene, changes, "discrete-gradient", ("solver.steps_per_impact", "24"), end);
        let (late, off) = off_at_first(scene, &found, &reference);
        assert!(late < 1e-5, "{scene}: {late} s");
        assert!(off < 0.01, "{scene}: {off}");
        let (_, explicit) = run(scene, changes, "dopri5", ("solver.tolerance", "1e-5"), end);
        assert!(
            (evaluations as f64) < part * explicit as f64,
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
    // The instant at which the implicit scheme is tried is a matter of chance.
    for (tolerance, most) in [("2e-5", 1000), ("1e-5", 4500), ("5e-6", 1500)] {
        let (found, evaluations) = run("automatic", tolerance);
        for (j, (force, peak)) in found.iter().zip(&reference).enumerate() {
            let off = (force / peak - 1.0).abs();
            let joint = j + 1;
            assert!(off < 5e-4, "J{joint}: {force} N instead of {peak} N");
        }
        assert!(evaluations < most, "{tolerance}: {evaluations} evaluations, {explicit} of dopri5");
    }
}
