//! Corners of the friction law are events: a step ends at each, and a sliding contact stays on its branch of the law.

use crate::common::{frame_now, simulation};
use jointplay_physics::contact::FrictionBranch;

#[test]
fn settled_sliding_keeps_its_law_branch_and_corners_cost_few_rejections() {
    for method in ["radau5", "automatic"] {
        let mut simulation = simulation("spcmm", &[("solver.method", method), ("solver.tolerance", "1e-5")]);
        // Joints slide about slip_speed_high between 1.1 s and 1.3 s.
        simulation.advance_to(1.1).unwrap();
        let before = simulation.statistics().clone();
        while simulation.time() < 1.35 {
            simulation.step().unwrap();
            let frame = frame_now(&mut simulation);
            for (j, joint) in frame.joints.iter().enumerate() {
                let contact = simulation.contact_states(j)[0];
                assert!(contact.active && contact.friction_branch != FrictionBranch::Unfrozen, "{method}");
                let c = simulation.mechanism().contacts.coefficients(j);
                let beyond = c.excess_over_branch(contact.friction_branch, joint.slip_speed);
                assert!(beyond < 1e-2 * c.slip_high, "{method}, {j}: {beyond:e}");
            }
        }
        let after = simulation.statistics();
        let corners = after.corners - before.corners;
        let rejected = after.rejected - before.rejected;
        println!(
            "{method}: {corners} corners, {rejected} rejected, {} steps, {} evaluations",
            after.steps - before.steps,
            after.evaluations - before.evaluations
        );
        assert!(corners >= 10, "{method}: {corners}");
        assert!(rejected < 2 * corners, "{method}: {rejected}");
    }
}

#[test]
fn a_maximum_rate_is_found_anywhere_within_a_step() {
    // The spring keeps pushing during the impact, so the rate rises at first. Each tolerance places its maximum elsewhere in a step.
    let approach_speeds = |tolerance: f64| {
        let solver = [("solver.method", "dopri5"), ("solver.tolerance", &tolerance.to_string())];
        let mut simulation = simulation("suspension", &solver);
        let (mut largest, mut speeds) = (0.0_f64, Vec::new());
        while simulation.time() < 0.015 {
            simulation.step().unwrap();
            let contact = simulation.contact_states(0)[0];
            if contact.active {
                largest = contact.approach_speed;
            } else if largest > 0.0 {
                speeds.push(std::mem::take(&mut largest));
            }
        }
        speeds
    };
    let reference = approach_speeds(1e-13);
    assert!(reference.len() >= 3, "{reference:?}");
    for n in 0..24 {
        let tolerance = 1e-9 * f64::powf(10.0, -f64::from(n) / 8.0);
        let speeds = approach_speeds(tolerance);
        for (speed, reference) in std::iter::zip(&speeds, &reference) {
            let error = (speed - reference).abs() / reference;
            assert!(error < 300.0 * tolerance, "{tolerance:e}: {error:e}");
        }
    }
}
