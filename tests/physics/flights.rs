//! Bodies in free flight are left out of the evaluations that impacts elsewhere need.

use crate::common::{frame_now, simulation};
use jointplay_physics::machine::{AppliedForces, Vec3};
use jointplay_physics::simulate::{ContactMode, Frame, Simulation};

const CHAIN: [(&str, &str); 2] = [("chain.links", "8"), ("solver.tolerance", "1e-5")];

/// Whether any ball joint of body `b` is in contact.
fn in_contact(simulation: &Simulation, frame: &Frame, b: usize) -> bool {
    let joints = &simulation.machine().loose_joints;
    joints.iter().zip(&frame.joints).any(|(joint, report)| {
        (joint.carried().body == Some(b) || joint.carrier().body == Some(b)) && report.state != ContactMode::Free
    })
}

#[test]
fn a_body_without_contact_follows_its_parabola_within_each_step() {
    let mut simulation = simulation("chain", &CHAIN);
    let gravity = simulation.conditions().gravity;
    let mut inside = Frame::default();
    let (mut free_samples, mut other_samples) = (0, 0);
    while simulation.time() < 40e-3 {
        let before = frame_now(&mut simulation);
        simulation.step().expect("runs");
        let after = frame_now(&mut simulation);
        let h = after.time - before.time;
        for theta in [0.25, 0.6] {
            let time = before.time + theta * h;
            simulation.sample(time, &mut inside);
            let s = time - before.time;
            for (b, body) in inside.bodies.iter().enumerate() {
                let free = [&before, &inside, &after].iter().all(|frame| !in_contact(&simulation, frame, b));
                if !free {
                    other_samples += 1;
                    continue;
                }
                free_samples += 1;
                let start = &before.bodies[b];
                let velocity = start.velocity + gravity * s;
                let position = start.position + (start.velocity + gravity * (0.5 * s)) * s;
                assert!((body.position - position).norm() < 1e-14, "{b} at {time}");
                assert!((body.velocity - velocity).norm() < 1e-13, "{b} at {time}");
                assert!((body.acceleration - gravity).norm() < 1e-12, "{b} at {time}");
            }
        }
    }
    assert!(free_samples > 1000 && other_samples > 1000, "{free_samples} {other_samples}");
}

#[test]
fn bodies_in_free_flight_cost_no_evaluation_and_leave_the_others_unchanged() {
    // Dormand-Prince evaluates every body at every stage.
    let peaks = |method: &str| {
        let mut simulation = simulation("chain", &[CHAIN[0], ("solver.tolerance", "1e-8"), ("solver.method", method)]);
        while simulation.time() < 14e-3 {
            simulation.step_until(14e-3).expect("runs");
        }
        let frame = frame_now(&mut simulation);
        let forces: Vec<f64> = (0..5).map(|j| simulation.peak(j).0).collect();
        (forces, frame)
    };
    let ((automatic, a), (explicit, b)) = (peaks("automatic"), peaks("dopri5"));
    assert!(automatic[0] > 500.0);
    for (a, b) in automatic.iter().zip(&explicit) {
        assert!((a - b).abs() <= 1e-5 * b, "{automatic:?} {explicit:?}");
    }
    for (a, b) in a.bodies.iter().zip(&b.bodies) {
        assert!((a.position - b.position).norm() < 1e-8);
    }
}

#[test]
fn a_change_of_gravity_changes_free_flights() {
    let mut simulation = simulation("chain", &CHAIN);
    simulation.advance_to(5e-3).expect("runs");
    let before = frame_now(&mut simulation);
    let gravity = Vec3::new(3.0, 0.0, 1.0);
    let forces = AppliedForces { gravity, ..simulation.state().applied_forces() };
    simulation.set_applied_forces(&forces).expect("no element changes");
    simulation.advance_to(6e-3).expect("runs");
    let after = frame_now(&mut simulation);
    let s = after.time - before.time;
    for (a, b) in after.bodies.iter().zip(&before.bodies) {
        let position = b.position + (b.velocity + gravity * (0.5 * s)) * s;
        assert!((a.position - position).norm() < 1e-14);
    }
}
