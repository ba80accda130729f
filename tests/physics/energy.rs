//! Energy is conserved without actuators and dissipation, and the work of actuators equals the gain of energy.

use crate::common::{Changes, parse, simulation};
use jointplay_physics::simulate::{Frame, Simulation};
use jointplay_scene::built_in_text;

/// Elastic and frictionless contacts, with a tolerance at which impacts conserve energy to 1e-6.
const ELASTIC: [(&str, &str); 3] =
    [("contact.normal_law", "hertz"), ("contact.friction_law", "none"), ("solver.tolerance", "1e-11")];
/// Restitution 1 makes every damped law elastic, too.
const RESTITUTION_ONE: [(&str, &str); 3] =
    [("contact.restitution", "1"), ("contact.friction", "0"), ("solver.tolerance", "1e-11")];

/// Largest change of the total energy over `duration`, relative to the largest kinetic plus elastic energy, and the number of impacts.
fn drift(simulation: &mut Simulation, duration: f64) -> (f64, u64) {
    let mut frame = Frame::default();
    simulation.sample(0.0, &mut frame);
    let start = frame.kinetic + frame.potential;
    let (mut worst, mut largest) = (0.0_f64, frame.kinetic + frame.elastic);
    while simulation.time() < duration {
        simulation.step().unwrap();
        simulation.sample(simulation.time(), &mut frame);
        worst = worst.max((frame.kinetic + frame.potential - start).abs());
        largest = largest.max(frame.kinetic + frame.elastic);
    }
    (worst / largest, simulation.statistics().impacts())
}

#[test]
fn elastic_impacts_conserve_the_total_energy() {
    let resting = [("spcmm.amplitude_x", "0"), ("spcmm.amplitude_beta", "0")];
    let cases: [(&str, &Changes, &Changes); 5] = [
        ("spcmm", &resting, &ELASTIC),
        ("spcmm", &resting, &RESTITUTION_ONE),
        ("pendulum", &[], &ELASTIC),
        ("chain", &[("chain.links", "3")], &ELASTIC),
        ("slider-crank", &[], &RESTITUTION_ONE),
    ];
    for (name, changes, elastic) in cases {
        let changes = [changes, elastic].concat();
        let mut simulation = simulation(name, &changes);
        let (drift, impacts) = drift(&mut simulation, 0.3);
        println!("{name} {}: {drift:.2e} over {impacts} impacts", elastic[0].0);
        assert!(impacts > 10, "{name}: only {impacts} impacts");
        assert!(drift < 1e-6, "{name} {changes:?}: {drift:e}");
    }
}

/// The pendulum with an ideal joint, at `angle` from the vertical, with an angular velocity.
fn ideal_pendulum(angle: &str, angular_velocity: &str) -> Simulation {
    let text = built_in_text("pendulum").unwrap();
    let start = "rotation = { axis = [0, 1, 0], angle = \"-30 deg\" }";
    assert!(text.contains(start));
    let text = text.replace(
        start,
        &format!("rotation = {{ axis = [0, 1, 0], angle = \"{angle}\" }}\nangular_velocity = \"{angular_velocity}\""),
    );
    let changes = [("contact.clearance", "0"), ("solver.tolerance", "1e-12")];
    Simulation::new(&parse(&text, &changes).machine).unwrap()
}

#[test]
fn an_ideal_pendulum_conserves_energy_and_vertical_angular_momentum() {
    let mut simulation = ideal_pendulum("-50 deg", "1 2 3 rad/s");
    let body = simulation.machine().bodies[0].clone();
    let momentum = |frame: &Frame| {
        let b = &frame.bodies[0];
        let spin = b.rotation * (body.inertia * b.rotation.tr_mul(&b.angular_velocity));
        (b.position.cross(&b.velocity) * body.mass + spin).z
    };
    let mut frame = Frame::default();
    simulation.sample(0.0, &mut frame);
    let (energy, vertical) = (frame.kinetic + frame.potential, momentum(&frame));
    assert!(vertical.abs() > 1e-3 && frame.kinetic > 1e-3);
    let (mut energy_error, mut momentum_error) = (0.0_f64, 0.0_f64);
    while simulation.time() < 3.0 {
        simulation.step().unwrap();
        simulation.sample(simulation.time(), &mut frame);
        energy_error = energy_error.max((frame.kinetic + frame.potential - energy).abs());
        momentum_error = momentum_error.max((momentum(&frame) - vertical).abs());
    }
    println!("energy {energy_error:.2e} J, vertical angular momentum {momentum_error:.2e} kg m^2/s");
    // Tolerance 1e-12 per step, a few thousand steps.
    assert!(energy_error < 1e-9 * energy.abs());
    assert!(momentum_error < 1e-9 * vertical.abs());
}

#[test]
fn small_swings_have_the_period_of_the_compound_pendulum() {
    let amplitude = 1e-3_f64;
    let mut simulation = ideal_pendulum(&format!("-{amplitude} rad"), "0 0 0 rad/s");
    let body = &simulation.machine().bodies[0];
    let (mass, arm) = (body.mass, 0.1);
    let about_pivot = body.inertia[(1, 1)] + mass * arm * arm;
    // First term of the series in the amplitude; the next is 1e-14.
    let expected =
        std::f64::consts::TAU * (about_pivot / (mass * 9.81 * arm)).sqrt() * (1.0 + amplitude * amplitude / 16.0);
    let mut frame = Frame::default();
    let mut crossings = Vec::new();
    simulation.sample(0.0, &mut frame);
    let mut before = frame.bodies[0].position.x;
    while crossings.len() < 3 {
        simulation.step().unwrap();
        simulation.sample(simulation.time(), &mut frame);
        let after = frame.bodies[0].position.x;
        if (before > 0.0) != (after > 0.0) {
            let (mut low, mut high) = (simulation.step_start(), simulation.time());
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                simulation.sample(middle, &mut frame);
                if (frame.bodies[0].position.x > 0.0) == (before > 0.0) {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            crossings.push(0.5 * (low + high));
        }
        before = after;
    }
    let period = crossings[2] - crossings[0];
    println!("period {period:.9} s, expected {expected:.9} s");
    assert!((period / expected - 1.0).abs() < 1e-8, "{period} {expected}");
}

/// Gauss-Legendre nodes and weights on 0..1: exact up to degree 5.
fn gauss() -> [(f64, f64); 3] {
    let d = 0.5 * 0.6_f64.sqrt();
    [(0.5 - d, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.5 + d, 5.0 / 18.0)]
}

/// Largest difference, J, between actuator work and change of energy over `duration`; the largest |work|; the number of impacts.
fn power_balance(simulation: &mut Simulation, duration: f64) -> (f64, f64, u64) {
    let machine = simulation.machine().clone();
    // All driven joints are on the world, so their axes are world axes.
    let drives: Vec<_> = machine.joints.iter().filter(|j| j.drive.is_some()).collect();
    assert!(drives.iter().all(|j| j.parent.is_none()));
    let power = |frame: &Frame| -> f64 {
        assert_eq!(frame.actuators.len(), drives.len());
        let rate = |joint: &&jointplay_physics::machine::Joint| {
            let body = &frame.bodies[joint.child];
            let along = match joint.kind {
                jointplay_physics::machine::JointKind::Revolute => body.angular_velocity,
                _ => body.velocity,
            };
            joint.axis.dot(&along)
        };
        let pairs = frame.actuators.iter().zip(&drives);
        pairs.map(|(force, joint)| force * rate(joint)).sum()
    };
    let mut frame = Frame::default();
    simulation.sample(0.0, &mut frame);
    let start = frame.kinetic + frame.potential;
    let (mut work, mut worst, mut max_work) = (0.0, 0.0_f64, 0.0_f64);
    while simulation.time() < duration {
        // Limits the step for the quadrature where nothing else does.
        let end = simulation.time() + 2e-3;
        simulation.step_until(end).unwrap();
        let (from, to) = (simulation.step_start(), simulation.time());
        for (node, weight) in gauss() {
            simulation.sample(from + node * (to - from), &mut frame);
            work += weight * (to - from) * power(&frame);
        }
        simulation.sample(to, &mut frame);
        worst = worst.max((frame.kinetic + frame.potential - start - work).abs());
        max_work = max_work.max(work.abs());
    }
    (worst, max_work, simulation.statistics().impacts())
}

#[test]
fn the_work_of_actuators_equals_the_gain_of_energy() {
    let ideal = |joint: &'static str| (joint, "0");
    let fast = ("spcmm.frequency", "2 Hz");
    let lagrange = ("formulation", "lagrange");
    // (scene, changes, bound relative to the largest work): rounding for pure kinematics, otherwise some hundred times the
    // integrator's tolerance.
    let cases: [(&str, &Changes, f64); 7] = [
        ("spcmm", &[ideal("contact.clearance"), fast], 1e-12),
        ("spcmm", &[ideal("contact.clearance"), fast, lagrange], 1e-9),
        ("spcmm", &[fast], 1e-8),
        ("spcmm", &[fast, ideal("joint.S2.clearance")], 1e-8),
        ("spcmm", &[fast, lagrange], 1e-7),
        ("slider-crank-driven", &[ideal("joint.C.clearance")], 1e-12),
        ("slider-crank-driven", &[], 1e-8),
    ];
    for (name, changes, bound) in cases {
        let mut changes = changes.to_vec();
        changes.extend(ELASTIC);
        if changes.contains(&lagrange) {
            changes.retain(|c| c.0 != "solver.tolerance");
            changes.push(("solver.tolerance", "1e-9"));
        }
        let all_ideal = changes.contains(&ideal("contact.clearance")) || changes.contains(&ideal("joint.C.clearance"));
        let duration = if all_ideal { 0.4 } else { 0.05 };
        let mut simulation = simulation(name, &changes);
        let (worst, work, impacts) = power_balance(&mut simulation, duration);
        println!(
            "{name} {changes:?}: work {work:.3e} J, off by {worst:.2e} J, {:.1e} of it, {impacts} impacts",
            worst / work
        );
        assert_eq!(impacts == 0, all_ideal);
        assert!(work > 1e-3, "{name}: {work}");
        assert!(worst < bound * work, "{name} {changes:?}: {worst:e} of {work:e}");
    }
}

#[test]
fn friction_and_damping_only_dissipate_energy() {
    // With surface velocities friction opposes the motion of its points of action.
    for (name, links) in [("pendulum", None), ("chain", Some(("chain.links", "3")))] {
        let mut changes = vec![("solver.tolerance", "1e-9")];
        changes.extend(links);
        let mut simulation = simulation(name, &changes);
        let mut frame = Frame::default();
        simulation.sample(0.0, &mut frame);
        let start = frame.kinetic + frame.potential;
        let (mut lowest, mut highest) = (start, start);
        while simulation.time() < 0.3 {
            simulation.step().unwrap();
            simulation.sample(simulation.time(), &mut frame);
            // The potential energy includes the elastic one, so the total never rises.
            let energy = frame.kinetic + frame.potential;
            assert!(energy < lowest + 1e-8, "{name}, {}: {energy} after {lowest}", frame.time);
            lowest = lowest.min(energy);
            highest = highest.max(energy);
        }
        println!("{name}: lost {:.3e} J", start - lowest);
        assert!(start - lowest > 1e-5);
    }
}
